// Motor or joint as it moves, as a drawing.

const NS = "http://www.w3.org/2000/svg";

function element(parent, name, attributes, text) {
  const it = document.createElementNS(NS, name);
  for (const [key, value] of Object.entries(attributes)) it.setAttribute(key, value);
  if (text !== undefined) it.textContent = text;
  parent.append(it);
  return it;
}

const INK = "#16202b",
  BLUE = "#0b5cad",
  SOFT = "#6b7785",
  ORANGE = "#b45309";

export class Scene {
  #root;
  #parts = {};
  #kind = "";

  constructor(root) {
    this.#root = root;
  }

  /** Draws the parts of a motor or a joint. */
  build(kind) {
    if (kind === this.#kind) return;
    this.#kind = kind;
    const title = this.#root.querySelector("title");
    this.#root.replaceChildren(title);
    const root = this.#root;
    const parts = (this.#parts = {});
    for (let k = 0; k < 12; k++) {
      const angle = (k * Math.PI) / 6,
        at = (r) => [150 + r * Math.cos(angle), 128 - r * Math.sin(angle)];
      const [[x1, y1], [x2, y2]] = [at(108), at(113)];
      element(root, "line", { x1, y1, x2, y2, stroke: "#b4bfca", "stroke-width": 1.5 });
    }
    const turned = (name) => (parts[name] = element(root, "g", {}));
    const reference = turned("reference");
    element(reference, "line", {
      x1: 0,
      y1: 0,
      x2: 110,
      y2: 0,
      stroke: SOFT,
      "stroke-width": 2,
      "stroke-dasharray": "5 5",
    });
    const shaft = turned("shaft");
    if (kind === "motor") {
      element(shaft, "circle", { r: 78, fill: "#dfe9f4", stroke: BLUE, "stroke-width": 2 });
      element(shaft, "circle", {
        r: 64,
        fill: "none",
        stroke: BLUE,
        "stroke-width": 6,
        "stroke-dasharray": "26.8 6.7",
        opacity: 0.35,
      });
      element(shaft, "line", {
        x1: 0,
        y1: 0,
        x2: 100,
        y2: 0,
        stroke: BLUE,
        "stroke-width": 5,
        "stroke-linecap": "round",
      });
    } else {
      element(shaft, "rect", {
        x: -16,
        y: -9,
        width: 124,
        height: 18,
        rx: 9,
        fill: "#dfe9f4",
        stroke: BLUE,
        "stroke-width": 2,
      });
      element(shaft, "circle", { cx: 98, cy: 0, r: 4, fill: BLUE });
      parts.spring = element(root, "path", { fill: "none", stroke: ORANGE, "stroke-width": 2.5 });
      const motor = turned("motor");
      element(motor, "circle", { r: 22, fill: "#fff4e5", stroke: ORANGE, "stroke-width": 2 });
      element(motor, "line", {
        x1: 0,
        y1: 0,
        x2: 20,
        y2: 0,
        stroke: ORANGE,
        "stroke-width": 4,
        "stroke-linecap": "round",
      });
    }
    element(root, "circle", { cx: 150, cy: 128, r: 4, fill: INK });
    parts.load = element(root, "path", {
      fill: "none",
      stroke: "#b3261e",
      "stroke-width": 3,
      "stroke-linecap": "round",
    });
    parts.head = element(root, "path", { fill: "#b3261e" });
    const label = (y, text) => element(root, "text", { x: 282, y, "font-size": 12.5, fill: "#4a5868" }, text);
    const value = (y) => element(root, "text", { x: 282, y, "font-size": 16, "font-weight": 600, fill: INK });
    label(34, "position");
    parts.y = value(53);
    label(82, "error");
    parts.error = value(101);
    label(130, "current");
    parts.u = value(149);
    element(root, "rect", { x: 282, y: 156, width: 124, height: 8, rx: 4, fill: "#e7ecf1" });
    parts.bar = element(root, "rect", { x: 344, y: 156, width: 0, height: 8, fill: BLUE });
    element(root, "line", { x1: 344, y1: 153, x2: 344, y2: 167, stroke: INK });
    label(192, "estimated load");
    parts.d = value(211);
    parts.state = element(root, "text", { x: 282, y: 238, "font-size": 14, "font-weight": 700, fill: "#b3261e" });
    const key = (x, color, text, dash) => {
      element(root, "line", {
        x1: x,
        y1: 246,
        x2: x + 18,
        y2: 246,
        stroke: color,
        "stroke-width": 3,
        "stroke-dasharray": dash,
      });
      element(root, "text", { x: x + 23, y: 249.5, "font-size": 11, fill: "#4a5868" }, text);
    };
    key(8, BLUE, kind === "motor" ? "shaft" : "link", "none");
    key(72, SOFT, "reference", "4 3");
    if (kind !== "motor") key(154, ORANGE, "motor", "none");
  }

  /** Draws a moment: angles in rad, share of the largest current, texts. */
  draw({ y, r, motor, share, load, texts, state }) {
    const parts = this.#parts;
    const degrees = (angle) => `translate(150 128) rotate(${((-angle * 180) / Math.PI).toFixed(3)})`;
    parts.shaft.setAttribute("transform", degrees(y));
    parts.reference.setAttribute("transform", degrees(r));
    if (parts.motor) {
      parts.motor.setAttribute("transform", degrees(motor));
      let path = "";
      for (let k = 0; k <= 90; k++) {
        const part = k / 90,
          angle = motor + part * (4 * Math.PI + y - motor),
          radius = 23 + part * 27;
        const at = [150 + radius * Math.cos(angle), 128 - radius * Math.sin(angle)];
        path += `${k ? "L" : "M"}${at.map((it) => it.toFixed(1)).join(" ")}`;
      }
      parts.spring.setAttribute("d", path);
    }
    const size = Math.min(1, Math.abs(share)) * 62;
    parts.bar.setAttribute("width", size.toFixed(1));
    parts.bar.setAttribute("x", (share < 0 ? 344 - size : 344).toFixed(1));
    parts.bar.setAttribute("fill", Math.abs(share) > 0.98 ? "#b3261e" : BLUE);
    const arc = Math.min(1.2, Math.abs(load) * 4);
    const shown = arc > 0.06;
    parts.load.setAttribute("visibility", shown ? "visible" : "hidden");
    parts.head.setAttribute("visibility", shown ? "visible" : "hidden");
    if (shown) {
      // A positive load torque acts against positive motion.
      const sign = Math.sign(load),
        from = y + (sign * arc) / 2,
        to = y - (sign * arc) / 2;
      const at = (angle, radius) => [150 + radius * Math.cos(angle), 128 - radius * Math.sin(angle)];
      const [[x1, y1], [x2, y2]] = [at(from, 96), at(to, 96)];
      parts.load.setAttribute("d", `M${x1} ${y1}A96 96 0 0 ${sign > 0 ? 1 : 0} ${x2} ${y2}`);
      const tip = at(to - sign * 0.1, 96),
        inner = at(to, 90),
        outer = at(to, 102);
      parts.head.setAttribute("d", `M${tip}L${inner}L${outer}Z`);
    }
    for (const name of ["y", "error", "u", "d"]) parts[name].textContent = texts[name];
    parts.state.textContent = state;
  }

  describe(text) {
    this.#root.querySelector("title").textContent = text;
  }
}
