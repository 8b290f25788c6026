// Draws the charts of this page from the numbers in it. Drag to zoom, double click to go back.
"use strict";
(() => {
  const data = id => JSON.parse(document.getElementById(id).textContent);
  const accounts = data("accounts"), charts = data("charts");
  const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer;
  const read = ([a, s, f, p, k]) => {
    const { step, x, y } = accounts[a].sections[s].figures[f].panels[p].series[k].points;
    const values = Array.from(new Float32Array(bytes(y)), v => Number.isFinite(v) ? v : null);
    return [step === undefined ? Array.from(new Float64Array(bytes(x))) : values.map((_, k) => k * step), values];
  };
  const digits = v => v == null ? "" : v === 0 ? "0" : Math.abs(v) >= 1e5 || Math.abs(v) < 1e-3 ? v.toExponential(3)
    : String(Number(v.toPrecision(5)));
  const ticks = (u, splits) => splits.map(digits);
  // Behind the curves, where the law asked for more than there is.
  const tint = shade => u => {
    u.ctx.save();
    u.ctx.fillStyle = "#f8d2a6";
    for (const [from, to] of shade.intervals) {
      const left = Math.max(u.valToPos(from, "x", true), u.bbox.left);
      const right = Math.min(u.valToPos(to, "x", true), u.bbox.left + u.bbox.width);
      if (right > left) u.ctx.fillRect(left, u.bbox.top, Math.max(right - left, 1), u.bbox.height);
    }
    u.ctx.restore();
  };
  const drawn = [];
  for (const place of document.querySelectorAll(".chart")) {
    const chart = charts[place.dataset.chart];
    const tables = chart.curves.map(curve => read(curve.at));
    const joined = uPlot.join(tables);
    const scale = chart.is_log ? { distr: 3 } : {};
    const curves = chart.curves.map(curve => ({
      label: curve.label || chart.y_label, stroke: curve.color, dash: curve.dash, width: 1.5, spanGaps: true,
      points: { show: curve.has_dots }, value: (u, v) => digits(v),
      ...(curve.is_held ? { paths: uPlot.paths.stepped({ align: 1 }) } : {}),
    }));
    const height = () => Math.max(200, Math.min(300, 0.5 * place.clientWidth));
    const axis = (label, size) => ({ label, values: ticks, size, grid: { stroke: "#e8e8e8" } });
    document.documentElement.classList.add("live");
    const plot = new uPlot({
      title: chart.title, width: place.clientWidth, height: height(),
      // One zoom for all that stand together.
      cursor: { sync: { key: place.parentElement.querySelector(".chart").dataset.chart, scales: ["x", null] },
        drag: { x: true, y: false } },
      scales: { x: { time: false, ...scale }, y: scale },
      axes: [axis(chart.x_label, 36), axis(chart.y_label, 64)],
      series: [{ label: chart.x_label, value: (u, v) => digits(v) }, ...curves],
      hooks: chart.shade ? { drawClear: [tint(chart.shade)] } : {},
    }, joined, place);
    // As it is drawn at first; a double click shows all.
    const show = (key, range) => range && plot.setScale(key, { min: range[0], max: range[1] });
    show("x", chart.x_range);
    show("y", chart.y_range);
    drawn.push(() => plot.setSize({ width: place.clientWidth, height: height() }));
  }
  window.addEventListener("resize", () => drawn.forEach(fit => fit()));
  // On paper nothing can be unfolded.
  window.addEventListener("beforeprint", () => document.querySelectorAll("details").forEach(file => file.open = true));
})();
