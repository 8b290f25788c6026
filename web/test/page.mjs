// Clicks through the page in a browser without a screen: node web/test/page.mjs PAGE OUTPUT
//
// EDO_SMC_BROWSER names the browser, EDO_SMC_HOST_SIM a host-sim, whose C file must equal the one of the page.

import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { appendFileSync, mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { join, resolve } from "node:path";
import puppeteer from "puppeteer-core";
import { serve } from "./serve.mjs";

const [page_folder, output] = process.argv.slice(2).map((it) => resolve(it));
const hostSim = process.env.EDO_SMC_HOST_SIM;
const browserName = process.env.EDO_SMC_BROWSER ?? "chromium";
const executablePath = browserName.includes("/") ? browserName : execFileSync("which", [browserName]).toString().trim();

rmSync(output, { recursive: true, force: true });
mkdirSync(output, { recursive: true });
const { server, address } = await serve(page_folder);
const browser = await puppeteer.launch({ executablePath, args: ["--no-sandbox", "--disable-dev-shm-usage"] });
const faults = [];

/** Opens the page and notes everything that a user would find broken. */
async function opened(url, { width = 1280, height = 900, isMobile = false, media = [] } = {}) {
  const tab = await browser.newPage();
  await tab.setViewport({ width, height, isMobile, hasTouch: isMobile, deviceScaleFactor: isMobile ? 2 : 1 });
  await tab.emulateMediaFeatures(media);
  tab.on(
    "console",
    (message) => ["error", "warn"].includes(message.type()) && faults.push(`console: ${message.text()}`),
  );
  tab.on("pageerror", (error) => faults.push(`error: ${error.message}`));
  tab.on("requestfailed", (request) => faults.push(`request failed: ${request.url()}`));
  tab.on("request", (request) => {
    const own = new URL(url).origin;
    if (!request.url().startsWith(own) && !/^(data|blob):/.test(request.url()))
      faults.push(`leaves the page: ${request.url()}`);
  });
  tab.on("response", (response) => response.status() >= 400 && faults.push(`${response.status()}: ${response.url()}`));
  await tab.goto(url, { waitUntil: "load" });
  await tab.waitForFunction(() => document.documentElement.dataset.serial, { timeout: 60_000 });
  return tab;
}

const serial = (tab) => tab.evaluate(() => Number(document.documentElement.dataset.serial ?? 0));

/** Waits until the page has answered after an action. */
async function answered(tab, act) {
  const before = await serial(tab);
  await act();
  const isDone = (n) =>
    Number(document.documentElement.dataset.serial ?? 0) > n &&
    !("refused" in document.documentElement.dataset) &&
    !("busy" in document.documentElement.dataset);
  await tab.waitForFunction(isDone, { timeout: 30_000 }, before).catch(async () => {
    throw new Error(`no answer to ${act}: ${await text(tab, "#verdict")} ${tab.url()} ${faults.join("; ")}`);
  });
}

/** Chooses a data sheet as it is. */
async function pick(tab, sheet) {
  const input = `input[name=sheet][value=${sheet}]`;
  if (!(await tab.$eval(input, (it) => it.checked))) await answered(tab, () => press(tab, input));
  await answered(tab, () => press(tab, "#reset"));
}

/** Clicks when the element rests: an answer may still move it. */
async function press(tab, selector) {
  const element = await tab.$(selector);
  await element.scrollIntoView();
  for (let last = "", k = 0; k < 50; k++) {
    const now = JSON.stringify(await element.boundingBox());
    if (now === last) break;
    last = now;
    await new Promise((wait) => setTimeout(wait, 60));
  }
  await element.click();
}

const text = (tab, selector) => tab.$eval(selector, (it) => it.textContent);
const tiles = (tab) => text(tab, "#tiles");

async function downloaded(tab, button) {
  const client = await tab.createCDPSession();
  await client.send("Browser.setDownloadBehavior", { behavior: "allow", downloadPath: output, eventsEnabled: true });
  const before = new Set(readdirSync(output));
  for (let k = 0; k < 200; k++) {
    // The whole design comes later than the tests and may move the button away from a click.
    if (k % 60 === 0) await press(tab, button);
    const found = readdirSync(output).find(
      (name) => !before.has(name) && !name.endsWith(".crdownload") && !name.startsWith("."),
    );
    if (found) return join(output, found);
    await new Promise((wait) => setTimeout(wait, 50));
  }
  throw new Error(`nothing was downloaded by ${button}: ${await text(tab, "#take-note")}`);
}

let count = 0;
async function step(title, work) {
  const found = await work();
  assert.deepEqual(faults, [], `${title}: ${faults.join("\n")}`);
  count += 1;
  console.log(`${String(count).padStart(2)} ${title}${found ? `: ${found}` : ""}`);
}

/** Moves a slider by a real drag to a share of its width. */
async function drag(tab, id, share) {
  const slider = await tab.$(`[id="${id}"]`);
  await slider.scrollIntoView();
  const { x, y, width, height } = await slider.boundingBox();
  const now = await slider.evaluate((it) => (it.value - it.min) / (it.max - it.min));
  const at = (part) => x + 8 + part * (width - 16);
  await tab.mouse.move(at(now), y + height / 2);
  await tab.mouse.down();
  await tab.mouse.move(at(share), y + height / 2, { steps: 5 });
  await tab.mouse.up();
}

try {
  let tab;
  await step("the page opens and shows a design", async () => {
    tab = await opened(address);
    const shown = await tiles(tab);
    assert.match(shown, /phase margin/);
    assert.doesNotMatch(shown, /NaN|undefined/);
    await tab.screenshot({ path: join(output, "desktop.png") });
    return shown.replaceAll(/\s+/g, " ");
  });

  for (const sheet of ["motor", "joint", "stiff", "geared"]) {
    await step(`data sheet ${sheet}: every slider changes the answer`, async () => {
      await pick(tab, sheet);
      await tab.evaluate(() => (document.querySelector("#errors-panel").open = true));
      const ids = await tab.$$eval(".slider", (all) =>
        all.filter((it) => !it.hidden).map((it) => it.querySelector("input[type=range]").id),
      );
      const times = [];
      for (const id of ids) {
        const before = await tab.$eval(`[id="${id}"]`, (it) => it.value);
        // Near its value: at the ends of the range a design may be refused.
        const share = Math.min(0.95, Math.max(0.05, Number(before) / 1000 + (Number(before) > 500 ? -0.08 : 0.08)));
        await answered(tab, () => drag(tab, id, share));
        assert.notEqual(await tab.$eval(`[id="${id}"]`, (it) => it.value), before, id);
        await tab.waitForFunction(() => document.documentElement.dataset.answeredMs);
        const { marginsMs, answeredMs } = await tab.evaluate(() => ({ ...document.documentElement.dataset }));
        times.push([Number(marginsMs), Number(answeredMs)]);
      }
      const middle = (k) => times.map((it) => it[k]).sort((a, b) => a - b)[times.length >> 1];
      return `${ids.length} sliders; margins after ${middle(0)} ms, all tests after ${middle(1)} ms (medians)`;
    });
  }

  await step("the arrow keys move a slider, and the rule takes it back", async () => {
    await answered(tab, () => press(tab, "#reset"));
    await tab.focus('[id="s-drive.surface_rad_s"]');
    const ruled = await tiles(tab);
    await answered(tab, () => tab.keyboard.press("ArrowLeft"));
    const moved = await tiles(tab);
    assert.notEqual(moved, ruled);
    await tab.keyboard.press("Tab");
    await answered(tab, () => tab.keyboard.press("Enter"));
    assert.equal(await tiles(tab), ruled);
  });

  await step("a number is typed exactly, and another data sheet does not lose it", async () => {
    await pick(tab, "motor");
    const period = '[id="n-drive.period_s"]';
    await tab.click(period, { clickCount: 3 });
    await tab.keyboard.type("0,00021");
    await answered(tab, () => tab.keyboard.press("Enter"));
    assert.equal(await tab.$eval(period, (it) => Number(it.value)), 2.1e-4);
    await answered(tab, () => press(tab, "input[name=sheet][value=joint]"));
    assert.notEqual(await tab.$eval(period, (it) => Number(it.value)), 2.1e-4);
    await answered(tab, () => press(tab, "input[name=sheet][value=motor]"));
    assert.equal(await tab.$eval(period, (it) => Number(it.value)), 2.1e-4);
    await tab.click(period, { clickCount: 3 });
    await tab.keyboard.type("fast");
    await tab.keyboard.press("Enter");
    assert.match(await text(tab, '[id="s-drive.period_s-e"]'), /expected a number in s, found fast/);
    await tab.waitForFunction(() => !document.querySelector(".stale"));
    await answered(tab, () => press(tab, "#reset"));
  });

  await step("a bad number is told beside its field, with the remedy", async () => {
    await pick(tab, "motor");
    await tab.click('[id="f-motor.inertia_kg_m2"]', { clickCount: 3 });
    await tab.keyboard.type("-1");
    await tab.waitForFunction(() => document.documentElement.dataset.refused);
    const told = await text(tab, '[id="f-motor.inertia_kg_m2-e"]');
    assert.match(told, /inertia_kg_m2/);
    await tab.click('[id="f-motor.inertia_kg_m2"]', { clickCount: 3 });
    await answered(tab, () => tab.keyboard.type("3e-4"));
    assert.equal(await text(tab, '[id="f-motor.inertia_kg_m2-e"]'), "");
    return told;
  });

  await step("a number in the unit of a data sheet is the number of the file", async () => {
    await pick(tab, "motor");
    const entered = async (key, number) => {
      await tab.click(`[id="f-${key}"]`, { clickCount: 3 });
      await answered(tab, () => tab.keyboard.type(number));
      return [await tiles(tab), await text(tab, `[id="f-${key}-h"]`)];
    };
    const shown = [];
    for (const [key, typed, number] of [
      ["motor.inertia_kg_m2", "1350 g cm²", "0.000135"],
      ["motor.torque_n_m_per_a", "36,9 mNm/A", "0.0369"],
      ["motor.torque_n_m_per_a", "191 rpm/V", "0.0499963"],
      ["motor.current_lag_s", "1.2 kHz", "0.000132629"],
    ]) {
      const [ofUnit, hint] = await entered(key, typed);
      assert.match(hint, new RegExp(`^= ${number}`), hint);
      const [ofNumber] = await entered(key, hint.split(" ")[1]);
      assert.equal(ofUnit, ofNumber);
      shown.push(`${typed} ${hint.split(".").slice(0, 2).join(".")}`);
    }
    await tab.click('[id="f-motor.inertia_kg_m2"]', { clickCount: 3 });
    await tab.keyboard.type("3 mNm/A");
    await tab.waitForFunction(() => document.documentElement.dataset.refused);
    assert.match(await text(tab, '[id="f-motor.inertia_kg_m2-e"]'), /found "3 mNm\/A"/);
    await tab.click('[id="f-motor.inertia_kg_m2"]', { clickCount: 3 });
    await answered(tab, () => tab.keyboard.type("3e-4"));
    return shown.join(", ");
  });

  await step("every test and every fault shows its outcome", async () => {
    const outcomes = [];
    for (const sheet of ["motor", "joint"]) {
      await pick(tab, sheet);
      for (const test of ["load", "sine", "rest", "move"]) await answered(tab, () => press(tab, `#test-${test}`));
      for (const id of await tab.$$eval("#faults button", (all) => all.map((it) => it.id))) {
        await answered(tab, () => press(tab, `#${id}`));
        assert.equal(await tab.$eval(`#${id}`, (it) => it.getAttribute("aria-pressed")), "true");
        const told = await text(tab, "#fault-note");
        assert.ok(told.length > 20, told);
        outcomes.push(`   ${sheet} ${id}: ${told.replaceAll(/\s+/g, " ")}`);
        if (id === "fault-reversed") {
          assert.match(told, /WRONG_WAY|STOPPED|OSCILLATES/);
          await tab.screenshot({ path: join(output, `reversed-${sheet}.png`) });
        }
      }
      const last = await tab.$eval('#faults [aria-pressed="true"]', (it) => it.id);
      await answered(tab, () => press(tab, `#${last}`));
      assert.equal(await text(tab, "#fault-note"), "");
    }
    return `\n${outcomes.join("\n")}`;
  });

  await step("the animation runs, stops and goes to a time", async () => {
    const angle = () => tab.$eval("#clock", (it) => it.textContent);
    const [one] = [await angle(), await new Promise((wait) => setTimeout(wait, 300))];
    assert.notEqual(await angle(), one);
    await press(tab, "#play");
    const still = await angle();
    await new Promise((wait) => setTimeout(wait, 200));
    assert.equal(await angle(), still);
    await tab.focus("#time");
    await tab.keyboard.press("End");
    await tab.keyboard.press("ArrowLeft");
    assert.notEqual(await angle(), still);
    await press(tab, "#play");
  });

  await step("a re-tune while it runs has no step in the current", async () => {
    await answered(tab, () => press(tab, "#test-sine"));
    await answered(tab, () => press(tab, "#live"));
    await new Promise((wait) => setTimeout(wait, 1500));
    await answered(tab, () => drag(tab, "s-drive.surface_rad_s", 0.4));
    const told = await text(tab, "#live-note");
    assert.match(told, /Re-tuned at/);
    await answered(tab, () => press(tab, "#live"));
    return told;
  });

  await step("the link holds every setting", async () => {
    await answered(tab, () => press(tab, "#reset"));
    await answered(tab, () => drag(tab, "s-drive.uncertain_percent", 0.3));
    await answered(tab, () => press(tab, "#fault-cut"));
    await press(tab, "#share");
    await tab.waitForFunction(() => document.querySelector("#take-note").textContent !== "");
    const other = await opened(tab.url());
    assert.equal(await tiles(other), await tiles(tab));
    assert.equal(await text(other, "#fault-note"), await text(tab, "#fault-note"));
    await other.close();
    await answered(tab, () => press(tab, "#fault-cut"));
    return tab.url().replace(address, "");
  });

  for (const sheet of ["motor", "geared", "joint", "stiff"]) {
    await step(`C file and scenario of ${sheet} are those of host-sim`, async () => {
      await pick(tab, sheet);
      await answered(tab, () => drag(tab, "s-drive.uncertain_percent", 0.2));
      const toml = await downloaded(tab, "#save-toml");
      const c = await downloaded(tab, "#save-c");
      if (!hostSim) return "no host-sim";
      const own = execFileSync(hostSim, ["export", toml, "--lang", "c", "--standalone"], {
        maxBuffer: 1 << 26,
      }).toString();
      assert.ok(readFileSync(c, "utf8").trimEnd() === own.trimEnd(), `${c} differs from host-sim export ${toml}`);
      execFileSync(hostSim, ["run", toml, "--no-files"], { maxBuffer: 1 << 26 });
      return `${own.length} bytes`;
    });
  }

  await step("an own file is opened, and its link holds it", async () => {
    const file = join(output, "mine.toml");
    writeFileSync(
      file,
      "[motor]\ninertia_kg_m2 = 1e-4\ntorque_n_m_per_a = 0.03\nmax_current_a = 5.0\n[encoder]\nbits = 16\n",
    );
    const input = await tab.$("#open");
    await answered(tab, () => input.uploadFile(file));
    const shown = await tiles(tab);
    const other = await opened(tab.url());
    assert.equal(await tiles(other), shown);
    await other.close();
  });

  await step("the rivals are tuned and shown", async () => {
    await pick(tab, "motor");
    await press(tab, "#compare");
    await tab.waitForFunction(() => /evaluations each/.test(document.querySelector("#compare-note").textContent), {
      timeout: 120_000,
    });
    const rows = await tab.$$eval("#rivals-table tbody tr", (all) => all.map((it) => it.textContent));
    assert.ok(
      rows.length >= 3 && rows.some((row) => row.startsWith("P-PI")) && rows.some((row) => row.startsWith("LQG")),
      rows.join(),
    );
    await tab.screenshot({ path: join(output, "desktop-full.png"), fullPage: true });
    return `${rows.length} controllers`;
  });

  await step("a screen reader finds names for all controls", async () => {
    const all = (it) => [it, ...(it.children ?? []).flatMap(all)];
    const children = all(await tab.accessibility.snapshot());
    const roles = ["button", "slider", "textbox", "radio", "checkbox"];
    const bare = children.filter((it) => roles.includes(it.role) && !it.name);
    assert.deepEqual(bare, []);
    return `${children.length} elements`;
  });
  await tab.close();

  await step("a telephone of 390 pixels has no sideways scrolling", async () => {
    const phone = await opened(`${address}#sheet=joint`, { width: 390, height: 844, isMobile: true });
    const wide = await phone.evaluate(() =>
      [...document.querySelectorAll("body *")]
        .filter((it) => {
          const box = it.getBoundingClientRect();
          return box.right > innerWidth + 1 && box.width > 0 && !it.closest(".scroll, .skip, .hidden, svg");
        })
        .map((it) => `${it.tagName}#${it.id}.${it.className}`),
    );
    assert.deepEqual(wide, []);
    assert.ok(await phone.evaluate(() => document.documentElement.scrollWidth <= innerWidth));
    await phone.screenshot({ path: join(output, "telephone.png") });
    await answered(phone, () => phone.tap("#test-load"));
    await phone.screenshot({ path: join(output, "telephone-full.png"), fullPage: true });
    await phone.close();
  });

  await step("with reduced motion the drawing stands still", async () => {
    const quiet = await opened(address, { media: [{ name: "prefers-reduced-motion", value: "reduce" }] });
    const clock = await text(quiet, "#clock");
    await new Promise((wait) => setTimeout(wait, 300));
    assert.equal(await text(quiet, "#clock"), clock);
    assert.equal(await text(quiet, "#play"), "Play");
    await quiet.close();
  });

  if (hostSim) {
    await step("host-sim view follows the record of a running drive", async () => {
      const record = join(output, "seen.csv");
      const row = (k) => `${k},${(k * 1e-3).toFixed(3)},${k * 1e-3},${k * 1e-3 + 2e-4},1,0.02,0.5,0,0\n`;
      writeFileSync(record, "tick,t_s,r_rad,motor_rad,motor_rad_s,motor_load_n_m,u_a,sigma_star,health\n" + row(1));
      const viewer = spawn(hostSim, ["view", record, "--page", page_folder]);
      try {
        const url = await new Promise((found) => viewer.stdout.once("data", (line) => found(line.toString().trim())));
        const shown = await opened(url);
        // The last row is not whole yet.
        appendFileSync(record, row(2) + row(3) + "4,0.0");
        await shown.waitForFunction(() => document.querySelector("#verdict").textContent.includes("3 rows"));
        appendFileSync(record, "04,0.004,,,,0,0,64\n");
        await shown.waitForFunction(() => document.querySelector("#clock").textContent.startsWith("0.004"));
        await shown.screenshot({ path: join(output, "view-record.png") });
        await shown.close();
      } finally {
        viewer.kill("SIGINT");
      }
    });

    await step("host-sim view opens the page on a scenario and on a trace", async () => {
      const toml = join(output, "motor.toml");
      execFileSync(hostSim, ["run", toml, "--out", join(output, "run")], { maxBuffer: 1 << 26 });
      for (const file of [toml, join(output, "run", "trace.csv")]) {
        const viewer = spawn(hostSim, ["view", file, "--page", page_folder]);
        try {
          const url = await new Promise((found, broken) => {
            viewer.stdout.once("data", (line) => found(line.toString().trim()));
            viewer.once("exit", (status) => broken(new Error(`host-sim view ended with ${status}`)));
          });
          assert.equal((await fetch(new URL("/Cargo.toml", url))).status, 404);
          const shown = await opened(url);
          await shown.screenshot({ path: join(output, file.endsWith("csv") ? "view-trace.png" : "view.png") });
          await shown.close();
        } finally {
          viewer.kill("SIGINT");
        }
      }
    });
  }
  console.log(`${count} steps, no console error, no request to another place`);
} finally {
  await browser.close();
  server.close();
}
