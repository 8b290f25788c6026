// Charts with uPlot, and poles as SVG.

import { show } from "./fields.js";

const GRID = { stroke: "#e7ecf1", width: 1 };
export const COLOURS = { y: "#0b5cad", r: "#6b7785", u: "#0b5cad", d: "#6b7785", dHat: "#b45309", limit: "#b3261e" };
const FONT = "11.5px system-ui, sans-serif";

/** One chart that keeps its canvas while its numbers change. */
export class Chart {
  #plot = null;
  #key = "";
  #mark = null;
  #lines = [];

  constructor(root, { label, height, lines = [] }) {
    this.root = root;
    this.label = label;
    this.height = height;
    this.#lines = lines;
    new ResizeObserver(() => this.#resize()).observe(root);
  }

  /** Draws columns: the first one is the time. `marks` are times with a colour. */
  draw(columns, series, marks = [], unit = "", least = 0) {
    this.least = least;
    const key = JSON.stringify(series) + unit;
    this.marks = marks;
    if (this.#key !== key || !this.#plot) {
      this.#plot?.destroy();
      this.#plot = new uPlot(this.#options(series, unit), columns, this.root);
      this.#key = key;
    } else {
      this.#plot.setData(columns);
    }
  }

  /** Shows the present time of the animation. */
  at(time) {
    this.#mark = time;
    if (!this.#plot) return;
    const x = this.#plot.valToPos(time, "x");
    const line = (this.cursor ??= this.root.querySelector(".u-over").appendChild(document.createElement("div")));
    if (!line.isConnected) this.root.querySelector(".u-over").append(line);
    line.className = "present";
    line.style.left = `${x}px`;
  }

  #resize() {
    const width = Math.floor(this.root.clientWidth);
    if (this.#plot && width > 0 && width !== this.#plot.width) {
      this.#plot.setSize({ width, height: this.height });
      if (this.#mark !== null) this.at(this.#mark);
    }
  }

  #options(series, unit) {
    const axis = { font: FONT, stroke: "#4a5868", grid: GRID, ticks: { show: false } };
    const marked = (plot) => {
      const { ctx, bbox } = plot;
      for (const { time, color } of this.marks) {
        const x = Math.round(plot.valToPos(time, "x", true));
        if (x < bbox.left || x > bbox.left + bbox.width) continue;
        ctx.save();
        ctx.strokeStyle = color;
        ctx.lineWidth = 2;
        ctx.setLineDash([6, 4]);
        ctx.beginPath();
        ctx.moveTo(x, bbox.top);
        ctx.lineTo(x, bbox.top + bbox.height);
        ctx.stroke();
        ctx.restore();
      }
    };
    return {
      width: Math.max(120, Math.floor(this.root.clientWidth)),
      height: this.height,
      legend: { show: false },
      cursor: { show: false },
      padding: [8, 10, 0, 0],
      scales: { x: { time: false }, y: { range: (plot, low, high) => around(low, high, this.least) } },
      axes: [
        {
          ...axis,
          size: 28,
          gap: 2,
          space: 55,
          values: (plot, ticks) => ticks.map((tick) => (tick === ticks.at(-1) ? `${show(tick)} s` : show(tick))),
        },
        {
          ...axis,
          size: 44,
          gap: 3,
          space: 26,
          values: (plot, ticks) => ticks.map((tick) => show(tick)),
          label: unit,
          labelSize: unit ? 15 : 0,
          labelGap: 0,
          labelFont: FONT,
        },
      ],
      series: [
        {},
        ...series.map(({ color, dash, width }) => ({
          stroke: color,
          dash,
          width: width ?? 1.8,
          points: { show: false },
        })),
      ],
      hooks: { draw: [marked] },
    };
  }
}

/** Returns the range of an axis; `least` is its smallest half. */
function around(low, high, least) {
  if (!Number.isFinite(low) || !Number.isFinite(high)) return [-1, 1];
  if (least) [low, high] = [Math.min(low, -least), Math.max(high, least)];
  if (low === high) return [low - 1, high + 1];
  const margin = 0.08 * (high - low);
  return [low - margin, high + margin];
}

const NS = "http://www.w3.org/2000/svg";

/** Draws the poles with the unit circle. */
export function drawPoles(root, poles, period) {
  const title = root.querySelector("title");
  root.replaceChildren(title);
  const add = (name, attributes, text) => {
    const it = document.createElementNS(NS, name);
    for (const [key, value] of Object.entries(attributes)) it.setAttribute(key, value);
    if (text) it.textContent = text;
    root.append(it);
  };
  add("circle", { r: 1, fill: "#eef4fb", stroke: "#0b5cad", "stroke-width": 0.012 });
  add("line", { x1: -1.15, x2: 1.15, y1: 0, y2: 0, stroke: "#b4bfca", "stroke-width": 0.008 });
  add("line", { y1: -1.15, y2: 1.15, x1: 0, x2: 0, stroke: "#b4bfca", "stroke-width": 0.008 });
  add("text", { x: 1.04, y: -0.05, "font-size": 0.1, fill: "#4a5868" }, "1");
  add("text", { x: 1.12, y: 0.13, "font-size": 0.1, fill: "#4a5868" }, "Re z");
  add("text", { x: 0.04, y: -1.06, "font-size": 0.1, fill: "#4a5868" }, "Im z");
  for (const [re, im] of poles) {
    const size = Math.hypot(re, im),
      scale = size > 1.25 ? 1.25 / size : 1,
      [x, y] = [re * scale, -im * scale];
    const color = size >= 1 ? "#b3261e" : "#16202b",
      s = 0.038;
    add("path", {
      d: `M${x - s} ${y - s}L${x + s} ${y + s}M${x - s} ${y + s}L${x + s} ${y - s}`,
      stroke: color,
      "stroke-width": 0.022,
    });
  }
  const out = poles.filter(([re, im]) => Math.hypot(re, im) >= 1).length;
  const rates = poles.map(([re, im]) => -Math.log(Math.hypot(re, im)) / period).filter(Number.isFinite);
  title.textContent = out
    ? `${out} of ${poles.length} poles are outside the unit circle: the loop is unstable`
    : `${poles.length} poles, all inside the unit circle; the slowest decays at ${show(Math.min(...rates))} per second`;
  return title.textContent;
}
