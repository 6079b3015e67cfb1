"use strict";
// Pictures as SVG: axes, lines, points, areas and a handle. All looks are attributes, so that a
// picture that is saved looks the same.

const SVG = "http://www.w3.org/2000/svg";
const COLOURS = ["#0072b2", "#d55e00", "#00745a", "#8a4f7d", "#595959"];
const WIDTH = 560, LEFT = 62, RIGHT = 14, TOP = 12, BOTTOM = 44;

function make(name, attributes, parent, text) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes || {})) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  if (parent) parent.append(element);
  return element;
}

// Four digits at most, as people read them.
function short(value) {
  if (!Number.isFinite(value)) return "–";
  if (value !== 0 && (Math.abs(value) >= 1e5 || Math.abs(value) < 1e-3)) return value.toExponential(1);
  return String(Number(value.toPrecision(4)));
}

function ticks(axis, count) {
  const found = [];
  if (axis.log) {
    for (let e = Math.floor(Math.log10(axis.min)); e <= Math.log10(axis.max); e++)
      for (const m of [1, 2, 5]) {
        const value = Number((m * 10 ** e).toPrecision(3));
        if (value >= axis.min * 0.999 && value <= axis.max * 1.001) found.push(value);
      }
    return found;
  }
  const span = axis.max - axis.min, raw = span / count, base = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map(m => m * base).find(s => s >= raw) || raw;
  for (let k = Math.ceil(axis.min / step - 1e-9); k * step <= axis.max + 1e-9 * span; k++)
    found.push(Number((k * step).toPrecision(12)));
  return found;
}

function extent(arrays, share) {
  let low = Infinity, high = -Infinity;
  for (const values of arrays) for (const value of values)
    if (value !== null && Number.isFinite(value)) { low = Math.min(low, value); high = Math.max(high, value); }
  if (low > high) return { min: 0, max: 1 };
  const room = (high - low || Math.abs(high) || 1) * (share === undefined ? 0.06 : share);
  return { min: low - room, max: high + room };
}

// Draw a plot into a container. plot: {label, x, y, height, areas, cells, series, rules, handle};
// an axis: {label, unit, min, max, log}; a series: {name, x, y, points, dash, colour}.
function drawPlot(container, plot) {
  const height = plot.height || 360;
  const svg = make("svg", {
    viewBox: `0 0 ${WIDTH} ${height}`, xmlns: SVG, "font-size": 13,
    "font-family": "system-ui, 'DejaVu Sans', sans-serif", role: plot.handle ? "group" : "img",
    "aria-label": plot.label,
  });
  make("rect", { width: WIDTH, height, fill: "#ffffff" }, svg);
  const wide = WIDTH - LEFT - RIGHT, high = height - TOP - BOTTOM;
  const share = (axis, v) => axis.log
    ? Math.log(v / axis.min) / Math.log(axis.max / axis.min) : (v - axis.min) / (axis.max - axis.min);
  const px = v => LEFT + wide * share(plot.x, v);
  const py = v => TOP + high * (1 - share(plot.y, v));
  const clip = `clip-${plot.id}`;
  make("rect", { x: LEFT, y: TOP, width: wide, height: high }, make("clipPath", { id: clip }, make("defs", {}, svg)));
  const inside = make("g", { "clip-path": `url(#${clip})` }, svg);
  for (const area of plot.areas || [])
    make("path", {
      d: area.polygons.map(p => "M" + p.map(q => `${px(q[0]).toFixed(2)},${py(q[1]).toFixed(2)}`).join("L") + "Z").join(""),
      fill: area.colour, "fill-opacity": area.opacity || 0.22, stroke: "none",
    }, inside);
  for (const cell of plot.cells || []) {
    const x = px(cell.x0), y = py(cell.y1), w = px(cell.x1) - x, h = py(cell.y0) - y;
    const box = make("rect", { x, y, width: w, height: h, fill: cell.colour, stroke: "#ffffff" }, inside);
    make("title", {}, box, cell.title);
    if (w > 16 && h > 14)
      make("text", { x: x + w / 2, y: y + h / 2 + 4, "text-anchor": "middle", fill: "#1a1a1a", "font-size": 11 }, inside, cell.mark);
  }
  for (const [axis, across] of [[plot.x, true], [plot.y, false]]) {
    const marks = ticks(axis, across ? 7 : Math.max(3, Math.round(high / 50)));
    let last = -Infinity;
    for (const value of marks) {
      const at = across ? px(value) : py(value);
      if (across) {
        make("line", { x1: at, x2: at, y1: TOP + high, y2: TOP + high + 5, stroke: "#1a1a1a" }, svg);
        if (at - last > 34) { make("text", { x: at, y: TOP + high + 19, "text-anchor": "middle" }, svg, short(value)); last = at; }
      } else {
        make("line", { x1: LEFT - 5, x2: LEFT, y1: at, y2: at, stroke: "#1a1a1a" }, svg);
        make("text", { x: LEFT - 8, y: at + 4.5, "text-anchor": "end" }, svg, short(value));
      }
    }
    const text = axis.unit ? `${axis.label} [${axis.unit}]` : axis.label;
    if (across) make("text", { x: LEFT + wide / 2, y: height - 8, "text-anchor": "middle" }, svg, text);
    else make("text", { transform: `translate(14 ${TOP + high / 2}) rotate(-90)`, "text-anchor": "middle" }, svg, text);
  }
  for (const rule of plot.rules || []) {
    const at = rule.x !== undefined ? { x1: px(rule.x), x2: px(rule.x), y1: TOP, y2: TOP + high }
      : { x1: LEFT, x2: LEFT + wide, y1: py(rule.y), y2: py(rule.y) };
    make("line", { ...at, stroke: rule.colour || "#8c8c8c", "stroke-dasharray": rule.dash || "4 3" }, inside);
  }
  const named = [];
  (plot.series || []).forEach((series, k) => {
    const colour = series.colour || COLOURS[k % COLOURS.length];
    if (series.points) {
      series.x.forEach((x, i) => {
        const cx = px(x), cy = py(series.y[i]);
        if (series.points === "o") make("circle", { cx, cy, r: 5, fill: "none", stroke: colour, "stroke-width": 1.5 }, inside);
        else make("path", { d: `M${cx - 5},${cy - 5}l10,10m0,-10l-10,10`, stroke: colour, "stroke-width": 2, fill: "none" }, inside);
      });
    } else {
      let d = "", pen = "M";
      series.x.forEach((x, i) => {
        const y = series.y[i];
        if (x === null || y === null) { pen = "M"; return; }
        d += `${pen}${px(x).toFixed(2)},${py(y).toFixed(2)}`;
        pen = "L";
      });
      make("path", { d, stroke: colour, "stroke-width": series.width || 2, fill: "none",
        "stroke-dasharray": series.dash || "none", "stroke-linejoin": "round" }, inside);
    }
    if (series.name) named.push({ ...series, colour });
  });
  make("rect", { x: LEFT, y: TOP, width: wide, height: high, fill: "none", stroke: "#1a1a1a" }, svg);
  const spots = (plot.series || []).flatMap(s => s.x.map((x, i) => x === null || s.y[i] === null ? [-1, -1] : [px(x), py(s.y[i])]));
  drawLegend(svg, TOP + high, spots, [...(plot.areas || []).filter(a => a.name).map(a => ({ ...a, area: true })), ...named, ...(plot.legend || [])]);
  if (plot.handle) drawHandle(svg, plot, px, py, wide, high);
  container.replaceChildren(svg);
  return svg;
}

// A legend stands, on white, in the corner where the fewest points are drawn.
function drawLegend(svg, bottom, spots, entries) {
  if (!entries.length) return;
  const widest = Math.max(...entries.map(entry => entry.name.length));
  const width = 34 + 6.6 * widest, height = 8 + 17 * entries.length;
  const corners = [TOP + 6, bottom - height - 6].flatMap(y => [WIDTH - RIGHT - width - 6, LEFT + 6].map(x => [x, y]));
  const hidden = ([x, y]) => spots.filter(([a, b]) => a > x && a < x + width && b > y && b < y + height).length;
  const [x, y] = corners.reduce((best, corner) => hidden(corner) < hidden(best) ? corner : best);
  make("rect", { x, y, width, height, fill: "#ffffff", "fill-opacity": 0.86, stroke: "#d0d0d0" }, svg);
  entries.forEach((entry, k) => {
    const at = y + 13 + 17 * k;
    if (entry.area) make("rect", { x: x + 6, y: at - 6, width: 18, height: 11, fill: entry.colour, "fill-opacity": entry.opacity || 0.22 }, svg);
    else if (entry.points === "o") make("circle", { cx: x + 15, cy: at, r: 5, fill: "none", stroke: entry.colour, "stroke-width": 1.5 }, svg);
    else if (entry.points) make("path", { d: `M${x + 10},${at - 5}l10,10m0,-10l-10,10`, stroke: entry.colour, "stroke-width": 2 }, svg);
    else make("line", { x1: x + 6, x2: x + 24, y1: at, y2: at, stroke: entry.colour, "stroke-width": 2, "stroke-dasharray": entry.dash || "none" }, svg);
    make("text", { x: x + 30, y: at + 4.5, "font-size": 12 }, svg, entry.name);
  });
}

// A place that is dragged, or moved with the arrow keys: shift for ten steps at once.
function drawHandle(svg, plot, px, py, wide, high) {
  const handle = plot.handle;
  const group = make("g", {
    class: "handle", tabindex: 0, role: "slider", "aria-label": handle.label, "aria-valuetext": handle.text,
    "aria-valuenow": handle.x, "aria-valuemin": plot.x.min, "aria-valuemax": plot.x.max,
  }, svg);
  make("circle", { r: 16, fill: "#ffffff", "fill-opacity": 0.01 }, group);
  make("circle", { r: 8, fill: "#ffffff", stroke: "#1a1a1a", "stroke-width": 2.5 }, group);
  make("path", { d: "M-13,0h26M0,-13v26", stroke: "#1a1a1a", "stroke-width": 1.5 }, group);
  const place = (x, y) => group.setAttribute("transform", `translate(${px(x)} ${py(y)})`);
  const limited = (axis, value) => Math.min(axis.max, Math.max(axis.min, value));
  place(limited(plot.x, handle.x), limited(plot.y, handle.y));
  const moved = (x, y) => {
    const to = { x: limited(plot.x, x), y: limited(plot.y, y) };
    handle.moved(to.x, to.y);
  };
  handle.place = (x, y, text) => {
    place(limited(plot.x, x), limited(plot.y, y));
    group.setAttribute("aria-valuetext", text);
    group.setAttribute("aria-valuenow", x);
    handle.x = x; handle.y = y;
  };
  const at = event => {
    const box = svg.getBoundingClientRect(), scale = WIDTH / box.width;
    const sx = (event.clientX - box.left) * scale, sy = (event.clientY - box.top) * scale;
    moved(plot.x.min + (sx - LEFT) / wide * (plot.x.max - plot.x.min),
      plot.y.min + (1 - (sy - TOP) / high) * (plot.y.max - plot.y.min));
  };
  group.addEventListener("pointerdown", event => {
    group.setPointerCapture(event.pointerId);
    handle.held = true;
    event.preventDefault();
    group.focus({ preventScroll: true });
  });
  group.addEventListener("pointermove", event => { if (handle.held) at(event); });
  for (const name of ["pointerup", "pointercancel"])
    group.addEventListener(name, () => { handle.held = false; if (handle.released) handle.released(); });
  group.addEventListener("keydown", event => {
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (!steps) return;
    event.preventDefault();
    const far = event.shiftKey ? 10 : 1;
    moved(handle.x + far * steps[0] * handle.stepX, handle.y + far * steps[1] * handle.stepY);
  });
}

function saveText(name, kind, text) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: kind }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

// Several pictures of one panel are saved one below the other.
function savePicture(name, container) {
  const drawn = [...container.querySelectorAll("svg")];
  let top = 0;
  const parts = drawn.map(svg => {
    const copy = svg.cloneNode(true), height = Number(svg.getAttribute("viewBox").split(" ")[3]);
    copy.setAttribute("y", top);
    copy.setAttribute("width", WIDTH);
    copy.setAttribute("height", height);
    top += height;
    return new XMLSerializer().serializeToString(copy);
  });
  saveText(name, "image/svg+xml",
    `<svg xmlns="${SVG}" width="${WIDTH}" height="${top}" viewBox="0 0 ${WIDTH} ${top}">${parts.join("")}</svg>\n`);
}

function csv(columns) {
  const cell = value => value === null || value === undefined ? "" : /[",\n]/.test(value) ? `"${String(value).replaceAll('"', '""')}"` : String(value);
  const names = Object.keys(columns), count = Math.max(0, ...names.map(name => columns[name].length));
  const rows = [names.map(cell).join(",")];
  for (let i = 0; i < count; i++) rows.push(names.map(name => cell(columns[name][i])).join(","));
  return rows.join("\n") + "\n";
}
