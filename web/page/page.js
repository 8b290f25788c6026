// The page: inputs, the requests that follow from them, and the pictures of the answers.

import { Chart, COLOURS, drawPoles } from "./charts.js";
import { Core } from "./core.js";
import {
  DESIGN_SLIDERS,
  ERROR_SLIDERS,
  FAULTS,
  FLAGS,
  PLANT_SLIDERS,
  SHEET_FIELDS,
  SHEET_NOTE,
  SHEETS,
  inUnitOf,
  show,
} from "./fields.js";
import { fromFragment, toFragment } from "./link.js";
import { Scene } from "./scene.js";

const $ = (id) => document.getElementById(id);
// Margins have a thread of their own, so that they follow a slider while the tests of the last inputs still run.
const core = new Core(),
  background = new Core(),
  rivals = new Core(),
  testers = Array.from({ length: Math.max(1, Math.min(4, navigator.hardwareConcurrency || 2)) }, () => new Core());

/** State of the page: everything that a link holds, and what follows from it. */
const state = { sheet: "motor", own: null, values: {}, test: "move", fault: null, retunes: [], retuneBase: {} };
let templates = {},
  defaults = {},
  answer = null,
  sheetBase = {};
const inputs = new Map();

const TESTS = [
  { id: "move", title: "Move", what: "1 rad in the shortest time within 90 % of the current limit" },
  { id: "load", title: "Load step", what: "a load torque at a resting target" },
  { id: "sine", title: "Sine", what: "0.5 rad" },
  { id: "rest", title: "Rest", what: "after a move of 0.1 rad, with friction and play" },
];

const plant = () => (state.own ? state.own.plant : SHEETS.find((it) => it.id === state.sheet).plant);
const baseText = () => (state.own ? state.own.text : templates[plant()].text);
const name = () => state.own?.name ?? state.sheet;
const sheetSets = () => (state.own ? {} : SHEETS.find((it) => it.id === state.sheet).sets);

/** Returns what a person types as a TOML value: a gear as 10:1 or 10, a decimal comma, a number without its zero. */
function asToml(key, value) {
  const gear = key.endsWith(".gear") && /^(\d+)(?:\s*[:/]\s*(\d+))?$/.exec(value);
  if (gear) return `[${gear[1]}, ${gear[2] ?? 1}]`;
  const inUnit = inUnitOf(key, value);
  if (inUnit !== null) return inUnit;
  const number = /^([+-]?)(\d*)[.,](\d+)(e[+-]?\d+)?$/i.exec(value);
  return number ? `${number[1]}${number[2] || "0"}.${number[3]}${number[4] ?? ""}` : value;
}

/** Keys of the file with their values, without the inputs that are not keys. */
function keys(values = state.values) {
  const all = Object.fromEntries(
    Object.entries({ ...sheetSets(), ...values }).map(([key, value]) => [key, asToml(key, value)]),
  );
  delete all.load;
  if ("friction.coulomb_n_m" in values) {
    all["friction.static_n_m"] = String(1.5 * Number(values["friction.coulomb_n_m"]));
  }
  return all;
}

const setsOf = (all) => Object.entries(all).map(([key, value]) => `${key}=${value}`);
const scenario = (values) => ({ toml: baseText(), name: name(), sets: setsOf(keys(values)) });
const rounded = (value) => Number(value.toPrecision(3));

/** Load step, N m: by default 14 % of the largest torque at the output. */
const loadOf = () => Number(state.values.load ?? rounded(0.14 * sheetBase.torque));

/** Returns the runs for these times: of the shortest move of 1 rad, and of the bandwidth. */
function testRuns(moveS, surface, period) {
  const ticks = (seconds) => Math.max(1, Math.round(seconds / period)) * period;
  const start = rounded(ticks(0.2 * moveS)),
    slow = 1 / surface;
  const frequency = rounded(1 / (3 * moveS)),
    entry = rounded(1 / frequency);
  const move = (to, from) => `reference={kind = "move", to_rad = ${to}, start_s = ${from}}`;
  const restMove = rounded(start + moveS * 0.6);
  const at = { move: start + 0.5 * moveS, load: rounded(5 * slow), sine: 1.4 / frequency, rest: restMove + 10 * slow };
  const t0 = rounded(2 * slow);
  const runs = {
    move: { sets: [move(1, start), "load=[]"], span: start + 2.2 * moveS + 12 * slow },
    load: {
      sets: ['reference={kind = "rest"}', `load=[{kind = "step", amplitude = ${loadOf()}, t0_s = ${t0}}]`],
      span: 24 * slow,
    },
    sine: {
      sets: [
        `reference={kind = "sine", amplitude_rad = 0.5, frequency_hz = ${frequency}, duration_s = ${entry}}`,
        "load=[]",
      ],
      span: 2.2 / frequency,
      frequency,
    },
    rest: { sets: [move(0.1, start), "load=[]"], span: restMove + 40 * slow, from: restMove },
  };
  for (const [id, run] of Object.entries(runs)) {
    run.span = rounded(run.span);
    run.sets.push(`span_s=${run.span}`, "fault=[]");
    run.at = rounded(at[id]);
  }
  return runs;
}

let isBusy = false,
  isDue = false,
  serial = 0,
  /** Tests of the newest inputs that still run; `null` if there are none. */
  testing = null;

/** Computes everything again. While a slider moves, each computation begins with the newest inputs. */
async function compute() {
  isDue = true;
  if (isBusy) return;
  isBusy = true;
  while (isDue) {
    isDue = false;
    await computeMargins();
  }
  isBusy = false;
  restIfDone();
}

/** Marks the page as quiet when nothing is computed any more. */
function restIfDone() {
  if (!waiting && !isBusy && !testing) delete document.documentElement.dataset.busy;
}

/** Draws margins and poles at once, and starts the tests. */
async function computeMargins() {
  const started = performance.now(),
    asked = JSON.stringify(state);
  testing = null;
  let here = scenario();
  const probe = { ...here, sets: [...here.sets, 'reference={kind = "move", to_rad = 1.0}', "load=[]", "fault=[]"] };
  const first = await core.ask("design", { call: "margins", scenario: probe });
  if (!first) return;
  if (first.error) return refuse(first.error);
  const { facts, design, rule } = first;
  // The other threads need not search the gains of a stiff joint again.
  here = { ...here, rule };
  // The torque constant is the one behind the gear.
  sheetBase = { torque: facts.torque_n_m_per_a * facts.max_current_a };
  const runs = testRuns(facts.move_s, design.gains.surface_rad_s, facts.period_s);
  const fault = FAULTS.find((it) => it.id === state.fault);
  const runsAsked = TESTS.map(({ id }) => ({ name: id, sets: [...runs[id].sets], rows: 360, retunes: [] }));
  const chosen = runsAsked.find((it) => it.name === state.test);
  chosen.rows = 1200;
  if (fault) chosen.sets.push(...fault.sets(runs[state.test].at, facts.period_s, facts.max_current_a));
  // The run begins with the design from which the changes started.
  chosen.retunes = state.retunes.map(({ at_s, values }) => ({ at_s, scenario: scenario(values) }));
  const begun = state.retunes.length ? scenario(state.retuneBase) : here;
  const isOfSheet = () => sheetOf(asked) === sheetOf(JSON.stringify(state));
  if (!isOfSheet()) return;
  answer = { facts, design, fault, plan: runs, runs: answer?.runs ?? {}, late: new Set(TESTS.map(({ id }) => id)) };
  accept([]);
  document.documentElement.dataset.marginsMs = (performance.now() - started).toFixed(1);
  const inOrder = [chosen, ...runsAsked.filter((it) => it !== chosen)];
  const own = { answer, here, started };
  testing = own;
  Promise.all(inOrder.map((run, k) => test(run === chosen ? begun : here, run, k, isOfSheet))).then((whole) => {
    if (testing !== own) return;
    testing = null;
    if (whole.every(Boolean)) finish(own);
    restIfDone();
  });
}

/** Runs a test and draws it. An older one is better than none while a slider moves. */
async function test(of, run, k, isOfSheet) {
  const found = await testers[k % testers.length].ask(run.name, { call: "run", scenario: of, run });
  // A late answer must not cover the message about newer inputs.
  if (!found || !isOfSheet() || "refused" in document.documentElement.dataset) return false;
  if (found.error) {
    if (!found.isStale) refuse(found.error);
    return false;
  }
  answer.runs[run.name] = found.run;
  answer.late.delete(run.name);
  accept([run.name]);
  return true;
}

/** All tests of the newest inputs are drawn: the whole design follows in the background. */
function finish({ answer: own, here, started }) {
  const sheet = document.documentElement.dataset;
  sheet.answeredMs = (performance.now() - started).toFixed(1);
  sheet.serial = String(++serial);
  clearTimeout(wholeSoon);
  wholeSoon = setTimeout(async () => {
    const whole = await background.ask("whole", { call: "design", scenario: here });
    // It belongs to the design for which it was asked.
    if (own !== answer || !whole) return;
    if (whole.error) verdict("bad", whole.error[0].text);
    else drawWhole(whole);
  }, 100);
  remember();
}

let wholeSoon = 0;

/** Returns the part of a state after whose change an answer is for another plant. */
const sheetOf = (text) => {
  const { sheet, own } = JSON.parse(text);
  return JSON.stringify([sheet, own?.name]);
};

let waiting = false;

/** Asks for a computation with the next picture. */
function changed() {
  document.documentElement.dataset.busy = "true";
  if (rivalsRun) stopRivals();
  // The whole design of older inputs would slow down the margins of these.
  clearTimeout(wholeSoon);
  background.stop();
  if (waiting) return;
  waiting = true;
  // A hidden tab has no pictures.
  const soon = document.hidden ? (act) => setTimeout(act, 16) : requestAnimationFrame;
  soon(() => {
    waiting = false;
    compute();
  });
}

// ------------------------------------------------------------------------------------------------------- errors

function refuse(errors) {
  clearErrors();
  const others = [];
  for (const { key, text } of errors) {
    const field = inputs.get(key);
    if (field) {
      field.input.setAttribute("aria-invalid", "true");
      field.error.textContent = text;
    } else {
      others.push(text);
    }
  }
  $("sheet-error").textContent = others.join("\n");
  verdict("bad", `Not computed: ${errors[0].text}`);
  document.documentElement.dataset.refused = "true";
  remember();
}

function clearErrors() {
  for (const { input, error } of inputs.values()) {
    input.removeAttribute("aria-invalid");
    error.textContent = "";
  }
  $("sheet-error").textContent = "";
  delete document.documentElement.dataset.refused;
}

let speaking = 0;

/** Shows the verdict at once; a screen reader hears it when the sliders rest. */
function verdict(kind, text) {
  const it = $("verdict");
  it.className = `verdict ${kind}`;
  clearTimeout(speaking);
  it.setAttribute("aria-live", "off");
  it.textContent = text;
  speaking = setTimeout(() => {
    it.setAttribute("aria-live", "polite");
    it.textContent = "";
    it.textContent = text;
  }, 700);
}

// ------------------------------------------------------------------------------------------------------- inputs

function node(kind, attributes = {}, ...children) {
  const it = document.createElement(kind);
  for (const [key, value] of Object.entries(attributes)) {
    if (key in it && key !== "list") it[key] = value;
    else it.setAttribute(key, value);
  }
  it.append(...children);
  return it;
}

function setValue(key, value) {
  if (value === null) delete state.values[key];
  else state.values[key] = value;
  const isDesign = key === "drive.surface_rad_s" || key === "drive.margin";
  if ($("live").checked && isDesign && player.run) {
    if (!state.retunes.length) state.retuneBase = liveBase;
    const at = Math.max(rounded(player.time), answer.facts.period_s);
    const near = at - 0.02 * player.span();
    state.retunes = [...state.retunes.filter((it) => it.at_s < near), { at_s: at, values: { ...state.values } }];
    $("live-note").textContent =
      `Re-tuned at ${state.retunes.map((it) => `${show(it.at_s)} s`).join(", ")}.`;
  } else {
    forgetRetunes();
  }
  changed();
}

let liveBase = {};

function forgetRetunes() {
  state.retunes = [];
  liveBase = { ...state.values };
  $("live-note").textContent = "";
}

/** Builds the inputs of a plant. */
function buildInputs() {
  inputs.clear();
  const kind = plant();
  $("sheet-fields").replaceChildren(...SHEET_FIELDS[kind].map(textField));
  $("sheet-note").textContent = SHEET_NOTE;
  $("design-sliders").replaceChildren(...DESIGN_SLIDERS[kind].map(sliderField));
  $("plant-sliders").replaceChildren(...PLANT_SLIDERS[kind].map(sliderField));
  $("error-sliders").replaceChildren(...ERROR_SLIDERS[kind].map(sliderField));
  const faults = FAULTS.filter((it) => it.plants.includes(kind));
  $("faults").replaceChildren(
    ...faults.map(({ id, label }) => {
      const button = node("button", { type: "button", id: `fault-${id}` }, label);
      button.onclick = () => {
        state.fault = state.fault === id ? null : id;
        player.restart();
        changed();
      };
      return button;
    }),
  );
}

function textField({ key, label, unit, preset, hint }) {
  const id = `f-${key}`;
  const input = node("input", {
    type: "text",
    id,
    autocomplete: "off",
    spellcheck: false,
    "aria-describedby": `${id}-h ${id}-e`,
  });
  input.title = key;
  const error = node("p", { className: "error", id: `${id}-e` });
  const note = node("p", { className: "hint", id: `${id}-h` }, hint);
  input.oninput = () => setValue(key, input.value.trim() === "" ? null : input.value.trim());
  const field = node(
    "div",
    { className: "field" },
    node("label", { htmlFor: id }, `${label} `, node("span", { className: "unit" }, unit)),
    input,
    note,
    error,
  );
  const sync = () => {
    // The gear of an opened file is an array, which has no number.
    const own = key.endsWith(".gear") && /^\s*gear\s*=\s*(\[[^\]]*\])/m.exec(state.own?.text ?? "")?.[1];
    const typed = state.values[key] ?? "";
    const inUnit = inUnitOf(key, typed);
    note.textContent = inUnit === null ? hint : `= ${inUnit} ${unit}. ${hint}`;
    note.classList.toggle("always", inUnit !== null);
    if (document.activeElement !== input)
      input.value = inUnit === null ? (keys()[key] ?? (own || preset || short(defaults[key]))) : typed;
  };
  inputs.set(key, { input, error, sync });
  return field;
}

const short = (value) => (value === null || value === undefined ? "" : String(value));

function sliderField(it) {
  const { key, label, unit, isLog, isRule, step } = it;
  const id = `s-${key}`;
  const input = node("input", { type: "range", id, min: "0", max: "1000", step: "1", "aria-describedby": `${id}-e` });
  // The number itself can be typed: a slider is coarse.
  const typed = node("input", { type: "text", id: `n-${key}`, autocomplete: "off", spellcheck: false });
  typed.setAttribute("aria-label", unit ? `${label}, ${unit}` : label);
  const by = node("span");
  const value = node("span", { className: "value" }, typed, by);
  const reset = node(
    "button",
    { type: "button", title: isRule ? "by rule" : "as before" },
    isRule ? "By rule" : "Reset",
  );
  reset.setAttribute("aria-label", `${label}: ${isRule ? "by rule" : "reset"}`);
  const error = node("p", { className: "error", id: `${id}-e` });
  /** Largest peak of |S| that the rule reaches, once it is known. */
  let cap = it.high;
  const range = () => [it.low, it.share ? rounded(it.share * (sheetBase.torque || 1)) : Math.min(it.high, cap)];
  const valueAt = (place) => {
    const [low, high] = range();
    const raw = isLog ? low * (high / low) ** place : low + (high - low) * place;
    return step ? Number((Math.round(raw / step) * step).toFixed(6)) : rounded(raw);
  };
  const placeOf = (value) => {
    const [low, high] = range();
    const place = isLog ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
    return Math.round(1000 * Math.min(1, Math.max(0, place)));
  };
  const present = () => {
    const set = key === "load" ? state.values.load : keys()[key];
    if (set !== undefined) return [Number(set), true];
    if (key === "load") return [loadOf(), false];
    if (it.gain) return [answer?.design.gains[it.gain] ?? NaN, false];
    if (it.ruled) {
      const peak = answer ? (answer.design.gain_sets[0]?.margins?.sensitivity_peak ?? 3) : NaN;
      if (it.isCapped && peak > it.low) cap = Math.ceil(peak / step) * step;
      return [peak, false];
    }
    return [Number(defaults[key] ?? 0), false];
  };
  const sync = () => {
    const [number, isSet] = present();
    if (document.activeElement !== input || !input.matches(":active")) {
      if (Number.isFinite(number)) input.value = placeOf(number);
    }
    const isByRule = isRule && !isSet;
    if (document.activeElement !== typed) typed.value = show(number, isSet ? 6 : 3);
    by.textContent = `${unit ? ` ${unit}` : ""}${isByRule ? ", by rule" : ""}`;
    value.className = isByRule ? "value ruled" : "value";
    input.setAttribute("aria-valuetext", `${typed.value}${by.textContent}`);
    reset.disabled = !(key in state.values);
    // A gear has play only with an inertia behind it.
    const lacks = it.needs && !Number(keys()[it.needs] ?? defaults[it.needs] ?? 0);
    field.hidden = Boolean(lacks || (it.onlyCoupled && answer && !answer.facts.is_coupled));
  };
  input.oninput = () => setValue(key, String(valueAt(Number(input.value) / 1000)));
  typed.onchange = () => {
    const text = asToml(key, typed.value.trim());
    if (text !== "" && !Number.isFinite(Number(text))) {
      error.textContent = `${label}: expected a number${unit ? ` in ${unit}` : ""}, found ${typed.value}`;
      verdict("bad", `Not computed: ${error.textContent}`);
      return;
    }
    typed.value = text;
    setValue(key, text === "" ? null : text);
  };
  input.onkeydown = (event) => {
    // A step of the arrow keys is a step of the number, or 2 % of the range.
    const sign = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    if (!sign) return;
    event.preventDefault();
    const [low, high] = range();
    const by = step ? Math.max(1, Math.round((1000 * step) / (high - low))) : 20;
    let place = Number(input.value) + sign * by;
    if (step) place = placeOf(valueAt(Number(input.value) / 1000) + sign * step);
    input.value = Math.min(1000, Math.max(0, place));
    input.oninput();
  };
  reset.onclick = () => {
    setValue(key, null);
    input.focus();
  };
  const field = node(
    "div",
    { className: "slider" },
    node("div", { className: "head" }, node("label", { htmlFor: id }, label), value),
    input,
    reset,
    error,
  );
  inputs.set(key, { input, error, sync });
  return field;
}

const sync = () => inputs.forEach((field) => field.sync());

// ------------------------------------------------------------------------------------------------------- results

const charts = {};

function buildCards() {
  $("cards").replaceChildren(
    ...TESTS.map(({ id, title }) => {
      const button = node("button", { type: "button", id: `test-${id}` }, title);
      button.onclick = () => {
        state.test = id;
        player.restart();
        changed();
      };
      const root = node("div", { className: "chart" });
      root.setAttribute("aria-hidden", "true");
      charts[id] = new Chart(root, { height: 158 });
      return node(
        "section",
        { className: "card", id: `card-${id}`, ariaLabel: title },
        button,
        node("p", { id: `text-${id}` }),
        root,
      );
    }),
  );
  const detail = [
    [
      "position",
      "Angle and reference, rad",
      [
        ["y", "angle"],
        ["r", "reference", true],
      ],
    ],
    [
      "current",
      "Current, A",
      [
        ["u", "current"],
        ["limit", "limit", true],
      ],
    ],
    [
      "torque",
      "Torque of load and friction, N m",
      [
        ["d", "true"],
        ["dHat", "estimated by the observer"],
      ],
    ],
  ];
  $("detail").replaceChildren(
    ...detail.flatMap(([id, title, lines]) => {
      const legend = node(
        "p",
        { className: "legend" },
        node("b", {}, title),
        ...lines.map(([color, text, isDashed]) => {
          const sample = node("i", { className: isDashed ? "dash" : "" });
          sample.style.borderTopColor = COLOURS[color];
          return node("span", {}, sample, text);
        }),
      );
      const root = node("div", { className: "chart", id: `chart-${id}` });
      root.setAttribute("aria-hidden", "true");
      charts[id] = new Chart(root, { height: 150 });
      return [legend, root];
    }),
  );
}

const angleOf = (run) => run.columns[Object.keys(run.columns).find((name) => /(^|link_|load_)angle_rad$/.test(name))];
const largest = (values) => values.reduce((most, value) => Math.max(most, Math.abs(value)), 0);

/** Rows of a run from a time on. */
function from(run, time) {
  const begin = Math.max(
    0,
    run.columns.t_s.findIndex((t) => t >= time),
  );
  return (name) => run.columns[name].slice(begin);
}

/** Unit that fits an angle. */
function scaled(size) {
  if (!Number.isFinite(size)) return [1, ""];
  if (size >= 0.3) return [1, "rad"];
  if (size >= 3e-4) return [1e3, "mrad"];
  return [1e6, "µrad"];
}

/** Returns the mark of the pressed fault in the chosen test. */
function faultMarks() {
  const { fault, plan } = answer;
  return fault ? [{ time: fault.isFromStart ? 0 : plan[state.test].at, color: COLOURS.limit }] : [];
}

/** Draws the design, and the runs of these tests. */
function accept(ids) {
  clearErrors();
  const { facts, design, runs, plan } = answer;
  sync();
  drawTiles();
  for (const { id } of TESTS) $(`card-${id}`).classList.toggle("stale", answer.late.has(id));
  $("detail").classList.toggle("stale", answer.late.has(state.test));
  for (const { id, title } of TESTS.filter((it) => ids.includes(it.id))) {
    const run = runs[id],
      rows = from(run, plan[id].from ?? 0);
    const isRest = id === "rest" && facts.encoder_unit_rad;
    const errors = rows("error");
    const peak = largest(errors);
    const [factor, unit] = isRest ? [1 / facts.encoder_unit_rad, "counts"] : scaled(peak);
    const marks = id === state.test ? faultMarks() : [];
    charts[id].draw(
      [rows("t_s"), errors.map((error) => error * factor)],
      [{ color: COLOURS.y }],
      marks,
      `error, ${unit}`,
      isRest ? 2 : 0,
    );
    $(`card-${id}`).classList.toggle("on", id === state.test);
    $(`test-${id}`).setAttribute("aria-pressed", "false");
    $(`test-${id}`).setAttribute("aria-current", String(id === state.test));
    $(`text-${id}`).textContent = textOf(id, run, peak, rows);
    $(`test-${id}`).title = `${title}: show it in the animation and in detail`;
  }
  if (ids.includes(state.test)) {
    drawDetail();
    drawFault();
  }
  if (ids.length) return;
  const text = drawPoles($("poles"), design.poles_z, facts.period_s);
  $("poles-note").textContent = `${text}.`;
  drawMargins();
  staleRivals();
}

/** Returns an angle with a unit that fits. */
function angle(value) {
  const [factor, unit] = scaled(Math.abs(value));
  return `${show(value * factor)} ${unit}`;
}

function textOf(id, run, peak, rows) {
  return (answer.fault && id === state.test ? "With the fault: " : "") + outcomeOf(id, run, peak, rows);
}

function outcomeOf(id, run, peak, rows) {
  if (run.ending !== "finished") return `The run ${run.ending} at ${show(run.ended_at_s)} s.`;
  const [factor, unit] = scaled(peak);
  const most = `${show(peak * factor)} ${unit}`;
  const { plan, facts } = answer;
  if (id === "move") {
    const settled = run.metrics.settling_time_s;
    return (
      `1 rad in ${show(1e3 * run.move_s)} ms; largest error ${most}` + (settled === null ? ", never settles." : ".")
    );
  }
  if (id === "load") {
    const current = largest(run.columns.u_held);
    return `${show(loadOf())} N m moves it by ${most}; current up to ${show(current)} A.`;
  }
  if (id === "sine") return `0.5 rad at ${show(plan.sine.frequency)} Hz; error ${angle(run.tracking.error_rms)} rms.`;
  const late = rows("error").slice(-Math.ceil(rows("error").length / 3));
  const hunts = run.flags.some((flag) => flag.name === "hunts");
  return `Last third: ±${show(largest(late) / (facts.encoder_unit_rad || 1))} counts${hunts ? "; it hunted" : ""}.`;
}

/** Number with its name. `of` is the test that it comes from. */
function tile(text, value, unit, isBad = false, of = null) {
  return node(
    "div",
    { className: `tile${isBad ? " bad" : ""}${answer.late.has(of) ? " stale" : ""}` },
    node("b", {}, value, node("small", {}, unit ? ` ${unit}` : "")),
    node("span", {}, text),
  );
}

function drawTiles() {
  const { design, facts, runs } = answer;
  const sets = design.gain_sets;
  const least = (of) =>
    sets.reduce((low, set) => Math.min(low, set.margins ? (of(set.margins) ?? Infinity) : NaN), Infinity);
  const unstable = sets.filter((set) => !set.margins);
  const peaks = sets.map((set) => set.margins?.sensitivity_peak ?? Infinity);
  const phase = least((margins) => margins.phase_deg),
    delay = least((margins) => margins.delay_s);
  const end = (run) => (run ? largest(run.columns.error) : NaN);
  const named = (of, text) => (answer.fault && of === state.test ? `${text}, with the fault` : text);
  const ends = { move: end(runs.move), load: end(runs.load) };
  const [fMove, uMove] = scaled(ends.move),
    [fLoad, uLoad] = scaled(ends.load);
  $("tiles").replaceChildren(
    tile(
      "phase margin",
      Number.isFinite(phase) ? show(phase) : unstable.length ? "none" : "any",
      "deg",
      unstable.length > 0,
    ),
    tile("peak sensitivity Ms", unstable.length ? "unstable" : show(Math.max(...peaks)), "", unstable.length > 0),
    tile("delay margin", Number.isFinite(delay) ? show(1e3 * delay) : "–", "ms", unstable.length > 0),
    tile("position bandwidth", show(design.gains.surface_rad_s), "rad/s"),
    tile(named("move", "largest error, move"), show(ends.move * fMove), uMove, runs.move && runs.move.ending !== "finished", "move"),
    tile(named("load", "dip under load"), show(ends.load * fLoad), uLoad, runs.load && runs.load.ending !== "finished", "load"),
  );
  drawVerdict();
}

/** Returns the first alarm of a run. */
const firstAlarm = (run) =>
  (run?.flags ?? []).filter(({ name }) => FLAGS[name]?.[2] === "alarm").sort((a, b) => a.from_s - b.from_s)[0];

/** Shows the verdict. The corners come with the whole design, a little later. */
function drawVerdict() {
  const { facts, design } = answer,
    sets = design.gain_sets;
  const unstable = sets.filter((set) => !set.margins);
  const weak = sets.filter((set) => set.worst && set.worst.sensitivity_peak === null);
  const percent = state.values["drive.uncertain_percent"] ?? defaults["drive.uncertain_percent"] ?? 20;
  const chosen = facts.chosen[0]?.replace("set by the file", "as set");
  const why = chosen ? ` ${chosen[0].toUpperCase()}${chosen.slice(1)}.` : "";
  if (unstable.length)
    return verdict("bad", `Unstable with the ${unstable.map((set) => set.name).join(" and ")} gains.${why}`);
  if (weak.some((set) => set.name === "base") || (weak.length && !facts.is_coupled)) {
    const { name: set, worst } = weak[0];
    return verdict("warn", `Stable by the data sheet, but unstable in the corner ${worst.name} (${set} gains).${why}`);
  }
  // A test that the user broke on purpose has its own note.
  const broken = TESTS.filter(({ id }) => !(answer.fault && id === state.test))
    .map(({ id, title }) => [title, firstAlarm(answer.runs[id])])
    .find(([, alarm]) => alarm);
  if (broken) {
    const [title, { name: flag, from_s: at }] = broken;
    const [alarm, meaning] = FLAGS[flag];
    const where = `in the test ${title} at ${show(at)} s`;
    return verdict("bad", `Stable by the data sheet, but an alarm ${where}: ${alarm}, ${meaning}.`);
  }
  const corners = answer.whole ? ` and in every corner of ±${percent} %` : "";
  const high = weak.length
    ? " This holds for the base gains; the high gains would be unstable in a corner if they stayed on."
    : "";
  verdict("", `Stable by the data sheet${corners}.${high}${why}`);
}

/** Shows limits, noise and corners. */
function drawWhole(whole) {
  answer.whole = whole;
  answer.design.gain_sets = whole.design.gain_sets ?? answer.design.gain_sets;
  drawMargins();
  drawLimits(whole);
  drawVerdict();
}

function drawMargins() {
  const { gain_sets: sets } = answer.design;
  const head = ["Gains", "Phase margin, deg", "Delay margin, ms", "Gain margin", "Ms", "Ms, worst corner"];
  const or = (value, factor = 1) => (value === null || value === undefined ? "any" : show(value * factor));
  const rows = sets.map(({ name: set, margins, worst }) => {
    const corner = worst ? (worst.sensitivity_peak === null ? "unstable" : show(worst.sensitivity_peak)) : "..";
    if (!margins) return [set, "unstable", "–", "–", "–", corner];
    const down = margins.gain_down < 1e-6 ? "0" : show(margins.gain_down);
    return [
      set,
      or(margins.phase_deg),
      or(margins.delay_s, 1e3),
      `${down} to ${or(margins.gain_up)}`,
      show(margins.sensitivity_peak),
      corner,
    ];
  });
  $("margins").replaceChildren(table(head, rows));
}

function table(head, rows, ours = -1) {
  const cell = (text, k) => node(k ? "td" : "th", k ? {} : { scope: "row" }, text);
  return node(
    "table",
    {},
    node("thead", {}, node("tr", {}, ...head.map((text) => node("th", { scope: "col" }, text)))),
    node("tbody", {}, ...rows.map((row, k) => node("tr", { className: k === ours ? "ours" : "" }, ...row.map(cell)))),
  );
}

function drawLimits({ design, warnings }) {
  const lines = design.limits
    .slice(0, 3)
    .map(({ what, used }, k) => `${k ? "Then" : "Limiting factor"}: ${what}, ${show(100 * used)} % used.`);
  const noise = Math.sqrt(design.noise.reduce((sum, it) => sum + it.u_rms ** 2, 0));
  if (design.margins) lines.push(`Current noise from the encoder: ${show(noise)} A rms.`);
  if (design.suggested && !design.suggested.is_same) {
    lines.push(
      `Suggested: ${design.suggested.lines.map(([, line]) => line.split("  #")[0]).join(", ")}` +
        ` (${design.suggested.why}).`,
    );
  }
  $("limits").replaceChildren(
    ...[...lines, ...warnings.map((text) => `Warning: ${text}`)].map((text) => node("li", {}, text)),
  );
}

function drawDetail() {
  const { facts, runs, fault } = answer;
  const run = runs[state.test],
    title = TESTS.find((it) => it.id === state.test).title;
  const t = run.columns.t_s,
    y = angleOf(run);
  const marks = [
    ...faultMarks(),
    ...state.retunes.map(({ at_s }) => ({ time: at_s, color: "#1a6b3c" })),
  ];
  charts.position.draw([t, y, run.columns.r], [{ color: COLOURS.y }, { color: COLOURS.r, dash: [5, 4] }], marks, "rad");
  const most = largest(run.columns.u_held) > 0.6 * facts.max_current_a ? facts.max_current_a : null;
  const limit = (sign) => t.map(() => (most === null ? null : sign * most));
  charts.current.draw(
    [t, run.columns.u_held, limit(1), limit(-1)],
    [
      { color: COLOURS.u },
      { color: COLOURS.limit, dash: [5, 4], width: 1.2 },
      { color: COLOURS.limit, dash: [5, 4], width: 1.2 },
    ],
    marks,
    "A",
  );
  const shaft = facts.shafts[0].name;
  charts.torque.draw(
    [t, run.columns[`load of the ${shaft}`], run.columns[`estimated load of the ${shaft}`]],
    [{ color: COLOURS.d, width: 1.3 }, { color: COLOURS.dHat }],
    marks,
    "N m",
  );
  $("stage-title").textContent = `${title}${fault ? `: ${fault.label.toLowerCase()}` : ""}`;
  $("detail-title").textContent = `${title} in detail`;
  const rows = 24,
    pick = Array.from({ length: rows + 1 }, (_, k) => Math.round((k * (t.length - 1)) / rows));
  $("numbers").replaceChildren(
    table(
      ["Time, s", "Reference, rad", "Angle, rad", "Error, rad", "Current, A", "Load, N m", "Estimated load, N m"],
      pick.map((k) =>
        [
          t[k],
          run.columns.r[k],
          y[k],
          run.columns.error[k],
          run.columns.u_held[k],
          run.columns[`load of the ${shaft}`][k],
          run.columns[`estimated load of the ${shaft}`][k],
        ].map((value) => show(value, 4)),
      ),
    ),
  );
  player.show(run);
}

function drawFault() {
  const { fault, runs, plan, facts } = answer;
  for (const button of $("faults").children) {
    button.setAttribute("aria-pressed", String(button.id === `fault-${state.fault}`));
  }
  if (!fault) {
    $("fault-note").textContent = "";
    return;
  }
  const run = runs[state.test],
    at = plan[state.test].at;
  const flags = run.flags.map((flag) => ({ ...flag, about: FLAGS[flag.name] })).filter((flag) => flag.about);
  const alarms = flags.filter(({ about }) => about[2] !== "note").sort((a, b) => a.from_s - b.from_s);
  const notes = flags.filter(({ about }) => about[2] === "note" && flags.length < 8);
  const items = [...alarms, ...notes].sort((a, b) => a.from_s - b.from_s).map((flag) =>
    node("li", {}, node("b", {}, flag.about[0]), ` from ${show(flag.from_s, 4)} s: ${flag.about[1]}`),
  );
  const stopped = alarms.find(({ about }) => about[2] === "stop");
  const isEarly = !fault.isFromStart && alarms[0]?.from_s < at;
  const end = run.columns.error.at(-1);
  const [factor, unit] = scaled(Math.abs(end));
  const result =
    run.ending !== "finished"
      ? `The run ${run.ending}.`
      : stopped
        ? `The drive stops${isEarly ? " before the fault" : ""}: alarm at ${show(alarms[0].from_s, 4)} s.`
        : alarms.length
          ? "The drive reports an alarm and goes on."
          : `No alarm. The error at the end is ${show(end * factor)} ${unit}.`;
  const when = fault.id === "reversed" ? "" : ` At ${show(at)} s.`;
  $("fault-note").replaceChildren(
    `${fault.what(at, facts.period_s, facts.max_current_a)}${when} `,
    node("b", {}, result),
    node("ul", {}, ...items),
  );
}

// ------------------------------------------------------------------------------------------------------- animation

const scene = new Scene($("scene"));
const still = matchMedia("(prefers-reduced-motion: reduce)");

/** Plays the chosen run. */
const player = {
  run: null,
  time: 0,
  isPlaying: !still.matches,
  last: 0,
  restart() {
    this.time = 0;
    if (!still.matches) this.isPlaying = true;
  },
  span() {
    return this.run.columns.t_s.at(-1) || 1;
  },
  show(run) {
    this.run = run;
    if (this.time > this.span()) this.time = 0;
    scene.build(answer.facts.kind);
    if (still.matches && this.time === 0) this.time = this.span();
    this.draw();
  },
  /** Seconds of a run per second: a run takes about six seconds. */
  speed() {
    return this.span() / 6;
  },
  step(now) {
    const passed = Math.min(0.1, (now - this.last) / 1e3);
    this.last = now;
    if (this.run && this.isPlaying) {
      this.time += passed * this.speed();
      if (this.time > this.span() * 1.08) this.time = 0;
      this.draw();
    }
    requestAnimationFrame((then) => this.step(then));
  },
  draw() {
    const { columns } = this.run,
      t = columns.t_s,
      time = Math.min(this.time, t.at(-1));
    let low = 0,
      high = t.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (t[middle] <= time) low = middle;
      else high = middle - 1;
    }
    const { facts } = answer,
      k = low,
      y = angleOf(this.run)[k],
      u = columns.u_held[k];
    const d = columns[`estimated load of the ${facts.shafts[0].name}`][k];
    const error = columns.error[k],
      [factor, unit] = scaled(Math.abs(error));
    const flags = this.run.flags
      .filter((flag) => flag.from_s <= time && flag.to_s >= time)
      .map((flag) => FLAGS[flag.name]);
    const stop = flags.find((flag) => flag?.[2] === "stop") ?? flags.find((flag) => flag?.[2] === "alarm");
    scene.draw({
      y,
      r: columns.r[k],
      motor: (columns.motor_angle_rad ?? angleOf(this.run))[k],
      share: u / facts.max_current_a,
      load: d / (sheetBase.torque || 1),
      state: stop?.[0] ?? "",
      texts: {
        y: `${y.toFixed(4)} rad`,
        error: `${show(error * factor)} ${unit}`,
        u: `${show(u)} A`,
        d: `${show(d)} N m`,
      },
    });
    for (const id of ["position", "current", "torque"]) charts[id].at(time);
    if (document.activeElement !== $("time") || this.isPlaying)
      $("time").value = String(Math.round((1000 * time) / this.span()));
    const slow = 1 / this.speed();
    const rate =
      slow > 1.5 ? `, ${show(slow, 2)} times slower` : slow < 0.67 ? `, ${show(1 / slow, 2)} times faster` : "";
    $("clock").textContent = `${show(time)} s${rate}`;
    $("time").setAttribute("aria-valuetext", `${show(time)} s, angle ${y.toFixed(3)} rad, current ${show(u)} A`);
    $("play").textContent = this.isPlaying ? "Pause" : "Play";
    scene.describe(
      `${facts.kind === "motor" ? "Motor shaft" : "Joint"} at ${y.toFixed(3)} rad, ` +
        `reference ${columns.r[k].toFixed(3)} rad`,
    );
  },
};

$("play").onclick = () => {
  player.isPlaying = !player.isPlaying;
  if (player.isPlaying && player.time >= player.span()) player.time = 0;
  player.draw();
};
$("time").oninput = () => {
  player.isPlaying = false;
  player.time = (player.span() * Number($("time").value)) / 1000;
  player.draw();
};
$("live").onchange = () => {
  forgetRetunes();
  $("live-note").textContent = $("live").checked ? "Move the bandwidth or the margin now." : "";
  changed();
};

// ------------------------------------------------------------------------------------------------------- rivals

let rivalsChart = null,
  rivalsOf = "",
  rivalsRun = false;
const subject = () => JSON.stringify([name(), baseText(), keys()]);
const LAW_COLOURS = ["#0b5cad", "#b45309", "#1a6b3c", "#7a3e9d"];

async function tuneRivals() {
  const button = $("compare");
  rivals.stop();
  const asked = subject();
  button.disabled = rivalsRun = true;
  $("compare-note").textContent = "Tuning the rivals, some seconds ..";
  const found = await rivals.ask("rivals", { call: "rivals", scenario: scenario(), evaluations: 24 });
  button.disabled = rivalsRun = false;
  if (!found) return;
  if (found.error) {
    $("compare-note").textContent = found.error[0].text;
    return;
  }
  rivalsOf = asked;
  const { laws } = found;
  $("rivals").replaceChildren(
    node(
      "p",
      { className: "legend" },
      node("b", {}, "Error, mrad"),
      ...laws.map(({ law }, k) => {
        const sample = node("i");
        sample.style.borderTopColor = LAW_COLOURS[k];
        return node("span", {}, sample, law);
      }),
    ),
    node("div", { className: "chart", id: "chart-rivals" }),
  );
  rivalsChart = new Chart($("chart-rivals"), { height: 190 });
  const rows = Math.max(...laws.map(({ course }) => course[0].length)),
    stride = Math.max(1, Math.floor(rows / 1500));
  const thin = (values) => Array.from({ length: Math.ceil(rows / stride) }, (_, k) => values[k * stride] ?? null);
  const time = thin(laws.find(({ course }) => course[0].length === rows).course[0]);
  rivalsChart.draw(
    [time, ...laws.map(({ course }) => thin(course[1]).map((e) => (e === null || Math.abs(e) > 1 ? null : 1e3 * e)))],
    laws.map((_, k) => ({ color: LAW_COLOURS[k] })),
    [],
    "mrad",
  );
  const lost = (value, factor) => (value >= 100 ? "fails" : show(value * factor));
  $("rivals-table").replaceChildren(
    table(
      [
        "Controller",
        "Current noise, A",
        "Move, mrad",
        "Load step, mrad",
        "Load step ±20 %, mrad",
        "Settling, ms",
        "Unstable corners",
      ],
      laws.map(({ law, figures: f, is_too_noisy: isNoisy }) => [
        law,
        `${show(f.noise_a)}${isNoisy ? " (above)" : ""}`,
        lost(f.move_rad, 1e3),
        lost(f.load_rad, 1e3),
        lost(f.load_20_rad, 1e3),
        lost(f.settle_s, 1e3),
        String(f.unstable),
      ]),
      0,
    ),
  );
  $("compare-note").textContent =
    `${found.evaluations} evaluations each, at ${show(found.limit_a)} A rms of current noise.`;
  staleRivals();
}

/** Ends a search whose inputs have changed: it would slow down the sliders. */
function stopRivals() {
  rivals.stop();
  $("compare-note").textContent = "Stopped: the inputs have changed.";
}

function staleRivals() {
  const isStale = rivalsOf !== "" && rivalsOf !== subject();
  $("rivals").style.opacity = $("rivals-table").style.opacity = isStale ? 0.45 : 1;
  $("compare").textContent = isStale ? "Tune again for the new inputs" : "Tune the rivals";
}

$("compare").onclick = tuneRivals;

// ------------------------------------------------------------------------------------------------------- files, link

async function text({ isBroken = true } = {}) {
  const run = answer.plan[state.test];
  const { facts, fault: pressed } = answer;
  const fault = pressed && isBroken ? pressed.sets(run.at, facts.period_s, facts.max_current_a) : [];
  const changes = [["load", null], ["fault", null], ["reference", null], ["span_s", null], ...Object.entries(keys())];
  for (const set of [...run.sets, ...fault]) {
    const at = set.indexOf("=");
    changes.push([set.slice(0, at), set.slice(at + 1)]);
  }
  changes.push(["name", JSON.stringify(name())]);
  const found = await core.ask("text", { call: "rewritten", text: baseText(), changes });
  return found?.text;
}

function save(file, content, type) {
  const url = URL.createObjectURL(new Blob([content], { type }));
  const link = node("a", { href: url, download: file });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(url), 1000);
  $("take-note").textContent = `Saved ${file}.`;
}

/** Says that nothing can be saved while the inputs are refused. */
function isRefused() {
  const isSo = "refused" in document.documentElement.dataset;
  if (isSo) $("take-note").textContent = "Nothing saved: the inputs are refused, see above.";
  return isSo;
}

$("save-toml").onclick = async () => {
  if (!isRefused()) save(`${name()}.toml`, await text(), "text/plain");
};
$("save-c").onclick = async () => {
  if (isRefused()) return;
  // A fault is one of the test, not of the drive.
  const toml = await text({ isBroken: false });
  const found = await core.ask("c", { call: "export_c", scenario: { toml, name: name() } });
  if (found?.error) $("take-note").textContent = found.error[0].text;
  if (!found || found.error) return;
  save(`${name()}_drive.h`, found.text, "text/x-c");
  if (found.warnings.length) $("take-note").textContent += ` Its warnings: ${found.warnings.join("; ")}.`;
};
$("share").onclick = async () => {
  await remember();
  // A browser may ask first, or never answer.
  $("take-note").textContent = "The address of this page holds every setting: copy it.";
  const isCopied = await navigator.clipboard.writeText(location.href).then(
    () => true,
    () => false,
  );
  if (isCopied) $("take-note").textContent = "The link is in the clipboard.";
};

async function remember() {
  const fragment = await toFragment(state);
  history.replaceState(null, "", `#${fragment}`);
}

async function openText(file, content) {
  const isJoint = /^\s*\[joint\]|^\s*joint\s*[.=]/m.test(content);
  state.own = {
    text: content,
    name: file.replace(/\.toml$/, "").replace(/[^\w.-]/g, "_") || "mine",
    plant: isJoint ? "joint" : "motor",
  };
  Object.assign(state, { values: {}, fault: null, retunes: [] });
  await choose();
}

$("open").onchange = async (event) => {
  const [file] = event.target.files;
  if (file) await openText(file.name, await file.text());
  event.target.value = "";
};
$("reset").onclick = () => {
  Object.assign(state, { values: {}, fault: null });
  choose();
};

/** Values of the sheets that are not shown, so that a look at another sheet loses nothing; and the opened file. */
const kept = new Map();
let openedFile = null;
const sheetName = () => (state.own ? "own" : state.sheet);

function drawSheets() {
  openedFile = state.own ?? openedFile;
  const own = openedFile ? [{ id: "own", title: openedFile.name, note: "opened file" }] : [];
  $("sheets").replaceChildren(
    ...[...SHEETS, ...own].map(({ id, title, note }) => {
      const input = node("input", {
        type: "radio",
        name: "sheet",
        value: id,
        checked: state.own ? id === "own" : id === state.sheet,
      });
      input.onchange = () => {
        kept.set(sheetName(), state.values);
        const isOwn = id === "own";
        Object.assign(state, { sheet: isOwn ? state.sheet : id, own: isOwn ? openedFile : null, fault: null });
        state.values = kept.get(sheetName()) ?? {};
        choose();
      };
      return node("label", {}, input, title, node("small", {}, note));
    }),
  );
}

/** Starts again with another data sheet. */
async function choose() {
  document.documentElement.dataset.busy = "true";
  const focused = document.activeElement?.name === "sheet";
  drawSheets();
  if (focused) document.querySelector("input[name=sheet]:checked")?.focus();
  forgetRetunes();
  buildInputs();
  answer = null;
  player.run = null;
  player.restart();
  const asked = [...inputs.keys()].filter((key) => key.includes("."));
  const found = await core.ask("numbers", { call: "numbers", scenario: { ...scenario({}) }, keys: asked });
  defaults = found && !found.error ? found : {};
  sync();
  changed();
}

/** Lays the columns of a trace, or of the record of a running drive, out as a run. */
function setTrace(pairs) {
  const columns = Object.fromEntries(pairs);
  const angle = Object.keys(columns).find((it) => /angle_rad$|^x1$/.test(it));
  for (const [name, values] of Object.entries(columns)) {
    // Before the first row of a record there is one at rest. A stopped drive has no estimates: the last ones stay.
    let last = 0;
    columns[name] = values.length ? values.map((value) => (last = value ?? last)) : [0];
  }
  const zeros = columns.t_s.map(() => 0);
  columns.r ??= zeros;
  columns.error ??= columns[angle].map((y, k) => y - columns.r[k]);
  columns.u_held ??= columns.u;
  columns.angle_rad ??= columns[angle];
  // A trace has no inertia: the disturbance stays an acceleration.
  columns["load of the shaft"] = columns.load_n_m ? zeros.map(() => null) : (columns.d2 ?? zeros);
  columns["estimated load of the shaft"] = columns.load_n_m ?? columns.d_hat2 ?? zeros;
  answer = {
    facts: {
      kind: "motor_angle_rad" in columns ? "joint" : "motor",
      max_current_a: largest(columns.u_held) || 1,
      shafts: [{ name: "shaft" }],
    },
    plan: { move: {} },
    runs: { move: { columns, flags: [], ending: "finished" } },
    fault: null,
  };
  return columns;
}

/** Reads the record of a running drive again twice a second, and shows its end. */
function follow(title) {
  let last = null;
  const look = async () => {
    const now = await fetch("view.json").then((it) => (it.ok ? it.json() : null), () => null);
    const at = now?.columns && Object.fromEntries(now.columns).t_s.at(-1);
    if (at !== undefined && at !== null && at !== last) {
      last = at;
      const columns = setTrace(now.columns);
      player.isPlaying = false;
      player.time = columns.t_s.at(-1);
      drawDetail();
      told(title, columns);
    }
    setTimeout(look, 500);
  };
  look();
}

function told(title, columns) {
  $("stage-title").textContent = $("detail-title").textContent = `Trace ${title}`;
  verdict(
    "",
    `${columns.t_s.length} rows of ${title}: largest error ${show(largest(columns.error))} rad, ` +
      `largest current ${show(largest(columns.u_held))} A.`,
  );
}

/** Shows a trace in place of a design, and follows the record of a running drive. */
function showTrace({ name: title, columns: pairs, follow: isLive }) {
  const columns = setTrace(pairs);
  for (const hidden of ["inputs", "tiles", "cards", "compare"]) $(hidden).hidden = true;
  for (const id of ["margins", "poles", "rivals", "save-c"]) $(id).closest(".panel").hidden = true;
  for (const id of ["faults", "live"]) $(id).closest("fieldset, label").hidden = true;
  document.querySelector("main").classList.add("alone");
  $("sheets").hidden = true;
  drawDetail();
  $("chart-torque").previousElementSibling.querySelector("b").textContent = isLive
    ? "Estimated load, N m"
    : "Disturbance of the motion, rad/s²";
  told(title, columns);
  requestAnimationFrame((now) => player.step(now));
  document.documentElement.dataset.serial = "1";
  if (isLive) follow(title);
}

async function start() {
  if (matchMedia("(max-width: 48rem)").matches) $("sheet-panel").open = false;
  const began = await core.ask("start", { call: "start" });
  if (!began || began.error) {
    $("fatal").hidden = false;
    $("fatal").textContent =
      `The page cannot start: ${began?.error?.[0].text ?? "no answer"}. It needs WebAssembly ` +
      "for example with python3 -m http.server.";
    return;
  }
  templates = Object.fromEntries(began.templates.map((it) => [it.plant, it]));
  $("version").textContent = `edo-smc ${began.version}.`;
  buildCards();
  const given = await fromFragment(location.hash).catch(() => null);
  if (given) {
    Object.assign(state, given);
    if (!SHEETS.some((it) => it.id === state.sheet)) state.sheet = "motor";
    if (!TESTS.some((it) => it.id === state.test)) state.test = "move";
    if (state.own) state.own.plant = /^\s*\[joint\]|^\s*joint\s*[.=]/m.test(state.own.text) ? "joint" : "motor";
  }
  const kept = { values: state.values, fault: state.fault };
  // `host-sim view` serves its file beside the page.
  const opened = location.search === "?view" ? await fetch("view.json").then((it) => it.json()) : null;
  if (opened?.columns) return showTrace(opened);
  if (!given && opened) await openText(opened.name, opened.text);
  else await choose();
  Object.assign(state, opened && !given ? {} : kept);
  requestAnimationFrame((now) => player.step(now));
  setTimeout(() => {
    if (serial === 1) tuneRivals();
  }, 1500);
}

// Another link in the address bar; the skip link has no setting.
window.addEventListener("hashchange", () => {
  if (location.hash.includes("=")) location.reload();
});
document.querySelector(".skip").onclick = (event) => {
  event.preventDefault();
  $("verdict").focus();
};
start();
