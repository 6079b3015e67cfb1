"use strict";
// The window's own state: nothing of it is kept by the server, and no other window sees it.

const state = { rig: null, units: "si", structure: null, speed: 120, rop: 20, rock_strength: null,
  omega0: 10, delta0: 1.75, psi: 14, eta: 1.6, xi: 0.02, kappa: 0.02 };
const opened = new Map();          // rigs that this window opened, by name
const moved = new Map();           // gains that were moved, by rig and structure
let started = false;
let known = null;                  // what the server says of the rig
let axes = { x: [30, 240], y: [0, 50] };
let chartPlot = null, lastChart = null, free = null, freeFor = "", lastPoint = "";

const byId = id => document.getElementById(id);
const onRig = () => state.rig !== null;
const names = () => onRig() ? ["speed", "rop"] : ["omega0", "delta0"];
const structure = () => known.structures.find(s => s.name === state.structure) || known.structures[0];
const gainKey = () => JSON.stringify([state.rig, state.units, state.structure]);
// Quantities in the units of this window: [unit, how many are one SI unit].
const unitOf = quantity => known.units[quantity][0];
const inUnits = (quantity, value) => value * known.units[quantity][1];
const tellIn = (quantity, value) => value === null ? "–" : `${short(inUnits(quantity, value))} ${unitOf(quantity)}`;
// As the files of `map` name their columns.
const columnNames = () => onRig() ? ["speed in rpm", `rop in ${unitOf("axial_rate")}`] : names();
const isField = () => onRig() && state.units === "field";

function question(without) {
  const asked = { rig: state.rig, units: state.units };
  for (const name of onRig() ? ["speed", "rop", "rock_strength"] : ["omega0", "delta0", "psi", "eta", "xi", "kappa"])
    asked[name] = state[name];
  asked.structure = without ? null : state.structure;
  if (asked.structure === null) return asked;
  const set = moved.get(gainKey());
  if (!set) return asked;
  const chosen = structure();
  if (!chosen.at_bit) return set.touched ? { ...asked, K1: set.values.slice(0, 2) } : asked;
  const width = 1 + Math.max(...chosen.gains.map(g => g.index));
  asked.K1 = Array(width).fill(0);
  asked.K2 = Array(width).fill(0);
  chosen.gains.forEach((gain, k) => { asked[gain.matrix][gain.index] = set.values[k]; });
  return asked;
}

// ---------------------------------------------------------------- controls

// A slider with a box for the number itself.
function slider(id, text, low, high, step, value, changed) {
  const short6 = v => Number(v.toPrecision(6));
  value = short6(value);
  const range = element("input", { type: "range", id: `${id}-range`, min: low, max: high, step: "any", value, "aria-label": `${text}, slider` });
  const box = element("input", { type: "number", id, min: low, step: "any", value });
  const set = (to, from) => {
    if (!Number.isFinite(to)) return;
    if (from !== range) range.value = to;
    if (from !== box) box.value = to;
    changed(to);
  };
  const rounded = v => Number((Math.round(v / step) * step).toPrecision(10));
  range.addEventListener("input", () => set(rounded(Number(range.value)), range));
  range.addEventListener("keydown", event => {
    const way = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key];
    if (!way) return;
    event.preventDefault();
    const to = rounded(Number(range.value) + way * step * (event.shiftKey ? 10 : 1));
    set(Math.min(high, Math.max(low, to)));
  });
  box.addEventListener("input", () => { if (box.value !== "") set(Number(box.value), box); });
  const made = element("div", { class: "slider" }, element("label", { for: id }, text), range, box);
  made.put = to => { range.value = to; if (document.activeElement !== box) box.value = to; };
  return made;
}

const sliders = {};
const short3 = value => Number(value.toPrecision(3));
function buildPoint() {
  const at = byId("point");
  at.replaceChildren();
  const [xs, ys] = [axes.x, axes.y];
  const wanted = onRig()
    ? [["speed", "Rotary speed, rpm", Math.max(1, xs[0]), xs[1], 0.5], ["rop", `Rate of penetration, ${unitOf("axial_rate")}`, ys[0], ys[1], isField() ? 0.5 : 0.1],
      ["rock_strength", `Rock strength, ${unitOf("stress")}`, short3(inUnits("stress", 1e6)), short3(inUnits("stress", 300e6)), isField() ? 0.1 : 1]]
    : [["omega0", "Rotary speed ω₀", Math.max(0.1, xs[0]), xs[1], 0.05], ["delta0", "Depth of cut δ₀", ys[0], ys[1], 0.01], ["psi", "Cutting coefficient ψ", 0.1, 40, 0.1]];
  for (const [name, text, low, high, step] of wanted) {
    const value = state[name] === null ? known.rock_strength : state[name];
    sliders[name] = slider(name, text, low, high, step, value, to => {
      state[name] = to;
      if (name === "rock_strength" || name === "psi") changedLoop(); else changedPoint();
    });
    at.append(sliders[name]);
  }
}

function buildStructures() {
  const select = byId("structure");
  select.replaceChildren(...known.structures.map(s => element("option", { value: s.name === null ? "" : s.name }, s.label)));
  if (!known.structures.some(s => s.name === state.structure))
    state.structure = known.drive ? "soft-torque" : null;
  select.value = state.structure === null ? "" : state.structure;
  byId("structure-hint").textContent = known.drive
    ? "Laws of the top drive; their gains follow from a rule until they are moved."
    : "Torque at the bit: p holds its angle, pd its speed too; case1 and case2 also as they were one delay ago.";
  buildGains();
}

function buildGains() {
  const chosen = structure(), at = byId("gains"), bounds = byId("bounds");
  at.replaceChildren();
  bounds.replaceChildren();
  let set = moved.get(gainKey());
  if (!set) {
    set = { values: chosen.gains.map(g => g.value), bounds: chosen.gains.map(g => [g.low, g.high]), touched: false };
    moved.set(gainKey(), set);
  }
  chosen.gains.forEach((gain, k) => {
    const text = `${gain.label}, ${gain.name}${gain.unit ? `, ${gain.unit}` : ""}`;
    const span = gain.high - gain.low, step = 10 ** Math.floor(Math.log10(span / 200));
    const made = slider(`gain-${gain.name}`, text, set.bounds[k][0], set.bounds[k][1], step, set.values[k], to => {
      set.values[k] = to;
      set.touched = true;
      changedLoop();
    });
    at.append(made);
    if (!chosen.at_bit) return;
    ["low", "high"].forEach((end, side) => {
      bounds.append(slider(`bound-${gain.name}-${end}`, `${gain.name} at ${side ? "most" : "least"}${gain.unit ? `, ${gain.unit}` : ""}`,
        gain.low, gain.high, step, set.bounds[k][side], to => {
          set.bounds[k][side] = to;
          for (const input of made.querySelectorAll("input")) input[side ? "max" : "min"] = to;
        }));
    });
  });
  byId("search").hidden = !chosen.gains.length || !chosen.at_bit;
  byId("found").hidden = true;
}

function buildRigs() {
  const select = byId("rig"), chosen = state.rig ? state.rig.name : "";
  select.replaceChildren(element("option", { value: "" }, "none: dimensionless numbers"),
    ...[...known.presets, ...opened.keys()].map(name => element("option", { value: name }, name)));
  select.value = chosen;
}

// ---------------------------------------------------------------- rigs

async function chooseRig(rig) {
  const before = state.rig;
  let found;
  byId("complaints").replaceChildren();
  try {
    found = await ask("describe", { ...state, rig }, {});
  } catch (error) {
    complain([{ line: null, text: told(error) }], rig);
    return false;
  }
  if (found.complaints.length) { complain(found.complaints, rig); return false; }
  known = found;
  if (rig && rig.text !== null) { opened.set(rig.name, rig.text); byId("text").value = rig.text; }
  if (JSON.stringify(before) !== JSON.stringify(rig)) {
    state.rock_strength = null;
    byId("verdict").textContent = "Working …";
    byId("verdict").className = "";
    for (const one of Object.values(follow)) one.renew();
    for (const job of [runMotion, runMap, runStrings, runFind]) if (job.stop) job.stop.abort();
    chartPlot = chartHeld = null;
    lastPoint = "";
  }
  state.rig = rig;
  if (onRig() !== (before !== null) || !started) axes = usualAxes();
  started = true;
  byId("notes").replaceChildren(...known.notes.map(note => element("li", {}, note)));
  buildRigs();
  byId("units-of-rig").hidden = !onRig();
  byId("units").value = state.units;
  buildStructures();
  buildPoint();
  buildAxes();
  buildRigList();
  for (const panel of [panels.map, panels.strings]) panel.clear("");
  changedLoop();
  return true;
}

function usualAxes() {
  return onRig()
    ? { x: [30, Math.max(240, 1.5 * state.speed)], y: [0, Math.max(isField() ? 160 : 50, 1.5 * state.rop)] }
    : { x: [0.5, Math.max(25, 1.5 * state.omega0)], y: [0, Math.max(15, 1.5 * state.delta0)] };
}

function complain(found, rig) {
  const text = rig && rig.text;
  if (text) { byId("text").value = text; byId("paste").open = true; }
  byId("complaints").replaceChildren(
    element("p", {}, `${rig ? rig.name : "This"} makes no rig:`),
    element("ol", {}, ...found.map(c => {
      const item = element("li", {}, c.line === null ? "" : `line ${c.line}: `, c.text);
      if (c.line !== null) item.append(" ", element("button", { type: "button", onclick: () => showLine(c.line) }, `Show line ${c.line}`));
      return item;
    })));
}

function showLine(line) {
  const area = byId("text"), lines = area.value.split("\n");
  const from = lines.slice(0, line - 1).reduce((n, l) => n + l.length + 1, 0);
  byId("paste").open = true;
  area.focus();
  area.setSelectionRange(from, from + (lines[line - 1] || "").length);
}

// All numbers of the window in other units; what they say stays the same.
byId("units").addEventListener("change", async event => {
  const before = known, units = event.target.value;
  let found;
  const rate = before.units.axial_rate[1], stress = before.units.stress[1];
  try { found = await ask("describe", { rig: state.rig, units }, {}); } catch (error) {
    byId("verdict").textContent = told(error);
    event.target.value = state.units;
    return;
  }
  const round6 = v => Number(v.toPrecision(6)), turn = found.units.axial_rate[1] / rate;
  for (const structure of before.structures) {
    const [old, own] = [state.units, units].map(u => JSON.stringify([state.rig, u, structure.name])), set = moved.get(old);
    const ratios = structure.gains.map((g, k) => found.structures.find(s => s.name === structure.name).gains[k].per / g.per);
    if (set) moved.set(own, { touched: set.touched, values: set.values.map((v, k) => round6(v * ratios[k])), bounds: set.bounds.map((b, k) => b.map(v => round6(v * ratios[k]))) });
  }
  known = { ...found, notes: before.notes };
  state.units = units;
  state.rop = round6(state.rop * turn);
  axes.y = axes.y.map(v => Number((v * turn).toPrecision(4)));
  if (state.rock_strength !== null) state.rock_strength = round6(state.rock_strength * found.units.stress[1] / stress);
  for (const one of Object.values(follow)) one.renew();
  for (const job of [runMotion, runMap, runStrings, runFind]) if (job.stop) job.stop.abort();
  chartPlot = chartHeld = null;
  buildStructures();
  buildPoint();
  buildAxes();
  for (const panel of [panels.map, panels.strings]) panel.clear("");
  changedLoop();
});
byId("rig").addEventListener("change", event => {
  const name = event.target.value;
  chooseRig(name === "" ? null : { name, text: opened.has(name) ? opened.get(name) : null })
    .then(() => { byId("rig").value = state.rig ? state.rig.name : ""; });
});
byId("file").addEventListener("change", async event => {
  const file = event.target.files[0];
  if (!file) return;
  if (file.size > 200000) complain([{ line: null, text: `${file.name} is larger than 200 kB: no rig file is` }], null);
  else await chooseRig({ name: file.name, text: await file.text() });
  event.target.value = "";
});
byId("read").addEventListener("click", () => {
  const name = state.rig && state.rig.text !== null ? state.rig.name : "pasted.toml";
  chooseRig({ name, text: byId("text").value });
});
byId("structure").addEventListener("change", event => {
  state.structure = event.target.value || null;
  buildGains();
  changedLoop();
});
byId("controls").addEventListener("submit", event => event.preventDefault());

// ---------------------------------------------------------------- panels

const panels = {};
const columnsOf = (x, y, extra) => ({ [x.name]: x.values, [y.name]: y.values, ...extra });

const axisFields = {};
function chartAxes() {
  const box = element("div", { class: "controls" });
  for (const key of ["x", "y"]) for (const side of [0, 1]) {
    const made = field(`axis-${key}-${side}`, "", { step: "any", min: 0 });
    made.input.addEventListener("change", () => {
      const to = Number(made.input.value), other = axes[key][1 - side];
      if (made.input.value === "" || to < 0 || (side ? to <= other : to >= other)) { made.input.value = axes[key][side]; return; }
      axes[key][side] = to;
      buildPoint();
      changedLoop();
    });
    axisFields[`${key}${side}`] = made;
    box.append(made.label);
  }
  return box;
}
function buildAxes() {
  const words = onRig() ? { x: "Speed", y: "ROP" } : { x: "ω₀", y: "δ₀" };
  for (const key of ["x", "y"]) for (const side of [0, 1]) {
    const made = axisFields[`${key}${side}`];
    made.label.firstChild.textContent = `${words[key]} ${side ? "to" : "from"}`;
    made.input.value = axes[key][side];
  }
}
const axisLabels = () => onRig()
  ? { x: { label: "rotary speed", unit: "rpm" }, y: { label: "rate of penetration", unit: unitOf("axial_rate") } }
  : { x: { label: "rotary speed ω₀", unit: "" }, y: { label: "nominal depth of cut δ₀", unit: "" } };
const pointText = () => onRig() ? `${short(state.speed)} rpm, ${short(state.rop)} ${unitOf("axial_rate")}` : `ω₀ ${short(state.omega0)}, δ₀ ${short(state.delta0)}`;

panels.chart = new Panel("chart", "Where drilling is stable: drag the circle", chartAxes());
let chartHeld = null;
function drawChart(result) {
  const old = chartPlot && chartPlot.handle;
  if (old && old.held) { chartHeld = result; return; }
  const labels = axisLabels();
  const [nx, ny] = names();
  const closed = (points, is) => is ? [...points, points[0]] : points;
  const lines = (found, name, colour, dash) => found.curves.map((points, k) => {
    const all = closed(points, found.closed[k]);
    return { name: k ? "" : name, x: all.map(p => p[0]), y: all.map(p => p[1]), colour, dash };
  });
  const series = lines(result, `edge, ${state.structure || "no control"}`, COLOURS[0]);
  if (free && free !== result) series.push(...lines(free, "edge without control", COLOURS[4], "6 4"));
  chartPlot = {
    id: "chart", label: `Stable part of ${labels.x.label} and ${labels.y.label}`,
    x: { ...labels.x, min: axes.x[0], max: axes.x[1] }, y: { ...labels.y, min: axes.y[0], max: axes.y[1] },
    areas: [{ name: "stable", polygons: result.strips, colour: COLOURS[0] }], series,
    handle: {
      x: state[nx], y: state[ny], label: "Operating point: arrow keys move it", text: pointText(),
      stepX: onRig() ? 1 : 0.1, stepY: isField() ? 1 : onRig() ? 0.5 : 0.05,
      moved(x, y) {
        state[nx] = Math.max(Number(x.toFixed(onRig() ? 1 : 2)), onRig() ? 1 : 0.1);
        state[ny] = Number(y.toFixed(onRig() ? 1 : 2));
        sliders[nx].put(state[nx]);
        sliders[ny].put(state[ny]);
        changedPoint();
      },
      released() { if (chartHeld) { const late = chartHeld; chartHeld = null; drawChart(late); } },
    },
  };
  const focused = document.activeElement && document.activeElement.classList.contains("handle");
  drawPlot(panels.chart.picture, chartPlot);
  if (focused) panels.chart.picture.querySelector(".handle").focus({ preventScroll: true });
  const share = result.data.stable_area / ((axes.x[1] - axes.x[0]) * (axes.y[1] - axes.y[0]));
  panels.chart.tell(`Smooth drilling is stable on ${(100 * share).toFixed(0)} % of this chart.`);
  panels.chart.show(result, {
    curve: result.curves.flatMap((c, k) => c.map(() => k + 1)), [columnNames()[0]]: result.curves.flatMap(c => c.map(p => p[0])),
    [columnNames()[1]]: result.curves.flatMap(c => c.map(p => p[1])),
  });
}

panels.roots = new Panel("roots", "Roots: left of the line they die away");
function drawRoots(result) {
  const xs = result.series.map(s => s.x), ys = result.series.map(s => s.y);
  const x = extent([...xs.flat().length ? xs : [[0]], [0]]), y = extent(ys);
  drawPlot(panels.roots.picture, {
    id: "roots", label: `Roots. ${result.sentence}`, x: { ...result.x, ...x }, y: { ...result.y, ...y },
    areas: [{ name: "growing", colour: COLOURS[1], opacity: 0.12, polygons: [[[0, y.min], [Math.max(0, x.max), y.min], [Math.max(0, x.max), y.max], [0, y.max]]] }],
    rules: [{ x: 0, colour: "#1a1a1a", dash: "none" }, { x: result.rightmost }],
    series: result.series.map((s, k) => {
      const last = k === result.series.length - 1;
      return { name: s.name, x: s.x, y: s.y, points: last ? "x" : "o", colour: last ? COLOURS[0] : COLOURS[4] };
    }),
  });
  if (result.rough) checkSoon();
  panels.roots.tell(result.sentence);
  const verdict = byId("verdict");
  if (verdict.textContent !== result.sentence) verdict.textContent = result.sentence;
  verdict.className = result.stable ? "stable" : "unstable";
  panels.roots.show(result, {
    loop: result.series.flatMap(s => s.x.map(() => s.name)),
    [`real (${result.x.unit || "1"})`]: xs.flat(), [`imaginary (${result.y.unit || "1"})`]: ys.flat(),
  });
}

panels.nyquist = new Panel("nyquist", "Nyquist: how near the loop passes to −1");
function drawNyquist(result) {
  const near = 3;
  const axis = (values, min, max) => ({
    min: Math.max(-near, Math.min(min, ...values)) - 0.2, max: Math.min(near, Math.max(max, ...values)) + 0.2 });
  drawPlot(panels.nyquist.picture, {
    id: "nyquist", label: "Nyquist curve of the loop", x: { label: "real part of L", unit: "1", ...axis(result.real, -1.5, 0.5) },
    y: { label: "imaginary part of L", unit: "1", ...axis(result.imag, -1, 1) },
    rules: [{ x: 0 }, { y: 0 }],
    series: [{ name: "L(iω)", x: result.real, y: result.imag }, { name: "−1", x: [-1], y: [0], points: "x", colour: COLOURS[1] }],
  });
  panels.nyquist.tell(`The curve passes −1 at a distance of ${short(result.distance)}.`);
  panels.nyquist.show(result, { [`frequency (${result.unit || "rad"})`]: result.frequency, real: result.real, imaginary: result.imag });
}

panels.reflection = new Panel("reflection", "What the drive returns of a wave: less is softer");
function drawReflection(result) {
  const largest = Math.max(1, ...result.series.flatMap(s => s.magnitude));
  drawPlot(panels.reflection.picture, {
    id: "reflection", label: "Reflection of the drive over frequency",
    x: { label: "frequency", unit: "Hz", min: result.frequency[0], max: result.frequency[result.frequency.length - 1], log: true },
    y: { label: "reflected share |r|", unit: "1", min: 0, max: 1.08 * largest },
    rules: result.modes.map(x => ({ x })),
    series: result.series.map((s, k) => ({ name: s.name, x: result.frequency, y: s.magnitude, width: k ? 1.4 : 2.5, dash: k ? ["6 3", "2 3", "8 3 2 3"][k - 1] : "none" })),
  });
  const at = result.modes.map(f => `${short(f)} Hz`).join(", ");
  panels.reflection.tell(`Grey: the string's first modes, ${at}.`);
  panels.reflection.show(result, { "frequency (Hz)": result.frequency, ...Object.fromEntries(result.series.map(s => [s.name, s.magnitude])) });
}

const starts = [["small", "a small push"], ["kick", "a kick forward"], ["back", "a kick back"], ["rest", "rest"], ["stick", "a stuck bit"]];
const motionStart = field("motion-kind", "From", {}, starts), motionLength = field("motion-duration", "Seconds", { min: 1, step: "any", value: 30 });
const motionJob = jobControls("motion", "Simulate in full", motionStart.label, motionLength.label);
panels.motion = new Panel("motion", "The motion", motionJob.box);
function drawMotion(result) {
  const [time, speed, ...others] = result.columns;
  const weight = others.find(c => c.name === "weight on bit");
  const boxes = [speed, weight].map((column, k) => {
    const box = element("div", {});
    drawPlot(box, {
      id: `motion${k}`, height: 190, label: `${column.name} over time. ${result.sentence}`,
      x: { label: "time", unit: time.unit, min: 0, max: time.values[time.values.length - 1] || 1 },
      y: { label: column.name, unit: column.unit, ...extent([column.values, [0]]) },
      series: [{ x: time.values, y: column.values, width: 1.3, colour: COLOURS[k] }],
    });
    return box;
  });
  panels.motion.picture.replaceChildren(...boxes);
  const swing = result.data && result.data.swing !== null ? ` Swing ${short(result.data.swing)} (1 is full stick-slip).` : "";
  panels.motion.tell(result.sentence + swing);
  panels.motion.show(result, Object.fromEntries(result.columns.map(c => [c.unit ? `${c.name} (${c.unit})` : c.name, c.values])));
}
const motionOptions = () => ({ duration: Number(motionLength.input.value), start: motionStart.input.value });
const runMotion = new Job(panels.motion, "simulate", motionJob.go, motionJob.cancel, motionJob.bar);
motionJob.go.addEventListener("click", () => {
  clearTimeout(still);
  follow.motion.halt();
  runMotion.run(motionOptions(), drawMotion);
});
for (const made of [motionStart, motionLength])
  made.input.addEventListener("change", () => { if (followsMotion()) follow.motion.poke(); });
// A string of pipe takes seconds to simulate: that is started by hand.
const followsMotion = () => known.lumped;

const mapAcross = field("map-across", "Points across", { min: 2, max: 40, value: 8 }), mapUp = field("map-up", "up", { min: 2, max: 40, value: 6 });
const mapJob = jobControls("map", "Draw the map", mapAcross.label, mapUp.label);
panels.map = new Panel("map", "How hard the bit vibrates: runs over the chart", mapJob.box);
const OUTCOMES = { settles: ["#7fb98f", ""], orbit: ["#e8cf6a", "~"], bounces: ["#e0a04e", "B"], "stick-slip": ["#d9694a", "S"], "does-not-keep-up": ["#a06fa8", "L"], stalls: ["#7d5a8c", "0"], "turns-back": ["#9c6b5a", "<"], diverges: ["#8c8c8c", "!"], undecided: ["#dddddd", "?"], chaotic: ["#c9802e", "C"] };
function drawMap(result) {
  const labels = axisLabels(), ends = [0, 1].map(k => result.points.map(p => p[k])).map(v => [Math.min(...v), Math.max(...v)]);
  const half = ends.map((v, k) => (v[1] - v[0]) / (result.counts[k] - 1) / 2);
  const edges = result.data.boundaries.controlled || result.data.boundaries.uncontrolled || [];
  const seen = [...new Set(result.outcomes)];
  drawPlot(panels.map.picture, {
    id: "map", label: "Outcome of runs over the chart", x: { ...labels.x, min: ends[0][0] - half[0], max: ends[0][1] + half[0] },
    y: { ...labels.y, min: ends[1][0] - half[1], max: ends[1][1] + half[1] },
    series: edges.map((curve, k) => ({ name: k ? "" : "edge by linear theory", x: curve.map(p => p[0]), y: curve.map(p => p[1]), colour: "#1a1a1a" })),
    cells: result.points.map((p, k) => ({
      x0: p[0] - half[0], x1: p[0] + half[0], y0: p[1] - half[1], y1: p[1] + half[1], colour: (OUTCOMES[result.outcomes[k]] || OUTCOMES.undecided)[0],
      mark: (OUTCOMES[result.outcomes[k]] || OUTCOMES.undecided)[1],
      title: `${short(p[0])}, ${short(p[1])}: ${result.outcomes[k]}${result.swing[k] === null ? "" : `, swing ${short(result.swing[k])}`}`,
    })),
    legend: seen.map(name => ({ name: `${(OUTCOMES[name] || ["", "?"])[1]} ${name}`.trim(), colour: (OUTCOMES[name] || OUTCOMES.undecided)[0], area: true, opacity: 1 })),
  });
  const bad = result.outcomes.filter(o => o !== "settles" && o !== "orbit").length;
  panels.map.tell(`At ${bad} of ${result.outcomes.length} points the bit sticks, bounces, falls behind or worse.`);
  panels.map.show(result, columnsOf({ name: columnNames()[0], values: result.points.map(p => p[0]) }, { name: columnNames()[1], values: result.points.map(p => p[1]) }, { outcome: result.outcomes, swing: result.swing }));
}
const runMap = new Job(panels.map, "map", mapJob.go, mapJob.cancel, mapJob.bar);
// Points lie in the middle of cells that cover the chart.
function inset([low, high], count) {
  const half = (high - low) / count / 2;
  return [low + half, high - half].map(v => Number(v.toPrecision(5)));
}
mapJob.go.addEventListener("click", () => {
  const counts = [Number(mapAcross.input.value), Number(mapUp.input.value)];
  runMap.run({ x: inset(axes.x, counts[0] || 1), y: inset(axes.y, counts[1] || 1), counts }, drawMap);
});

const rigList = element("div", { class: "controls", role: "group", "aria-label": "Rigs to put side by side" });
const withBoundary = element("input", { type: "checkbox", id: "strings-boundary" });
const stringsJob = jobControls("strings", "Put side by side", rigList, element("label", { class: "check", for: "strings-boundary" }, withBoundary, " with their stable parts (seconds for each string)"));
panels.strings = new Panel("strings", "Several strings side by side", stringsJob.box);
panels.strings.section.classList.add("wide");
function buildRigList() {
  const checked = new Set([...rigList.querySelectorAll("input:checked")].map(i => i.value));
  rigList.replaceChildren(...[...known.presets, ...opened.keys()].map((name, k) => element("label", { class: "check", for: `string-${k}` },
    element("input", { type: "checkbox", id: `string-${k}`, value: name, checked: checked.has(name) || (state.rig && state.rig.name === name) }), ` ${name}`)));
}
function drawStrings(result) {
  const rows = result.rows;
  const first = modes => modes.length ? `${short(modes[0].frequency)} Hz` : "–";
  const columns = {
    rig: rows.map(r => r.name), controller: rows.map(r => r.controller), length: rows.map(r => tellIn("depth", r.length)),
    "buoyed weight": rows.map(r => tellIn("force", r.buoyed_weight)), "first torsion": rows.map(r => first(r.modes.torsional)),
    "first axial": rows.map(r => first(r.modes.axial)), "pipe impedance": rows.map(r => tellIn("impedance", r.impedance)),
  };
  const heads = Object.keys(columns);
  const table = element("table", {}, element("thead", {}, element("tr", {}, ...heads.map(h => element("th", { scope: "col" }, h)))),
    element("tbody", {}, ...rows.map((_, i) => element("tr", {}, ...heads.map(h => element("td", {}, columns[h][i]))))));
  const parts = [element("div", { class: "scroll" }, table), drawnStrings(rows)];
  if (rows.some(row => row.chart)) {
    const labels = axisLabels(), box = element("div", {});
    drawPlot(box, {
      id: "strings-chart", label: "Edges of stable drilling of the strings", height: 320, x: { ...labels.x, min: axes.x[0], max: axes.x[1] }, y: { ...labels.y, min: axes.y[0], max: axes.y[1] },
      areas: rows.map((row, k) => ({ polygons: row.chart.strips, colour: COLOURS[k % 5], opacity: 0.12, name: `${row.name}, ${row.controller}` })),
      series: rows.flatMap((row, k) => row.chart.curves.map((points, j) => {
        const all = row.chart.closed[j] ? [...points, points[0]] : points;
        return { x: all.map(p => p[0]), y: all.map(p => p[1]), colour: COLOURS[k % 5] };
      })),
    });
    parts.push(box);
  }
  panels.strings.picture.replaceChildren(...parts);
  panels.strings.tell(`${rows.length} rig${rows.length === 1 ? "" : "s"}; frequencies with the top held and the bit free.`);
  panels.strings.show(result, columns);
}
// Lengths to one scale, diameters to another, as pipe is a thousand times longer than wide.
function drawnStrings(rows) {
  const drawn = rows.filter(row => row.sections.length);
  const box = element("div", {});
  if (!drawn.length) return box;
  const height = 300, svg = make("svg", { viewBox: `0 0 ${WIDTH} ${height}`, xmlns: SVG, "font-size": 13, "font-family": "system-ui, 'DejaVu Sans', sans-serif", role: "img",
    "aria-label": `Strings to scale: ${drawn.map(r => `${r.name}, ${tellIn("depth", r.length)}`).join("; ")}` }, box);
  make("rect", { width: WIDTH, height, fill: "#ffffff" }, svg);
  const longest = inUnits("depth", Math.max(...drawn.map(r => r.length))), widest = Math.max(...drawn.flatMap(r => r.sections.map(s => s.outer_diameter)));
  const y = v => 22 + (height - 50) * v / longest, room = (WIDTH - LEFT) / drawn.length;
  const depth = { min: 0, max: longest };
  for (const value of ticks(depth, 6)) {
    make("text", { x: LEFT - 8, y: y(value) + 4.5, "text-anchor": "end" }, svg, short(value));
    make("line", { x1: LEFT - 5, x2: LEFT, y1: y(value), y2: y(value), stroke: "#1a1a1a" }, svg);
  }
  make("text", { x: 4, y: 14 }, svg, `depth [${unitOf("depth")}]`);
  drawn.forEach((row, k) => {
    const middle = LEFT + room * (k + 0.5);
    let top = 0;
    for (const section of row.sections) {
      const w = 40 * section.outer_diameter / widest;
      const reach = inUnits("depth", section.length);
      const bar = make("rect", { x: middle - w / 2, y: y(top), width: w, height: Math.max(1, y(top + reach) - y(top)), fill: { pipe: "#b9cbe0", "heavy-weight": "#7f9fc6", collar: "#3d5f8a" }[section.kind] || "#999999", stroke: "#1a1a1a", "stroke-width": 0.6 }, svg);
      make("title", {}, bar, `${section.name}: ${tellIn("depth", section.length)}, OD ${tellIn("length", section.outer_diameter)}`);
      top += reach;
    }
    make("text", { x: middle, y: 14, "text-anchor": "middle" }, svg, row.name);
  });
  make("text", { x: LEFT, y: height - 8, fill: "#595959", "font-size": 12 }, svg, "light: pipe, middle: heavy-weight, dark: collars; widths enlarged");
  return box;
}
const runStrings = new Job(panels.strings, "strings", stringsJob.go, stringsJob.cancel, stringsJob.bar);
stringsJob.go.addEventListener("click", () => {
  const rigs = [...rigList.querySelectorAll("input:checked")].map(i => ({ name: i.value, text: opened.has(i.value) ? opened.get(i.value) : null }));
  if (!rigs.length) { panels.strings.tell("Choose at least one rig.", true); return; }
  if (withBoundary.checked && !onRig()) { panels.strings.tell("Choose a rig above first: charts of strings are over speed and rate of penetration.", true); return; }
  runStrings.run({ ...axes, rigs, boundary: withBoundary.checked }, drawStrings);
});

const findPanel = {
  busy: words => { byId("find").textContent = words || "Find gains"; },
  tell: text => { byId("found").hidden = false; byId("found").textContent = text; },
};
const runFind = new Job(findPanel, "gains", byId("find"), byId("find-cancel"), byId("find-progress"));
byId("find").addEventListener("click", () => {
  const key = gainKey(), set = moved.get(key), chosen = structure();
  runFind.run({ bounds: set.bounds, trials: byId("trials").checked }, result => {
    chosen.gains.forEach((gain, k) => { set.values[k] = Number(result[gain.matrix][gain.index].toPrecision(7)); });
    set.touched = true;
    if (gainKey() === key) { buildGains(); changedLoop(); }
    findPanel.tell(`${result.summary}\n\n${result.command}`);
  });
});

// ---------------------------------------------------------------- what follows what

const follow = {
  // Analysing a string of pipe takes longer than a drag: its roots are sketched first.
  roots: new Follower(panels.roots, "roots", () => ({ rough: !known.lumped }), drawRoots),
  checked: new Follower(panels.roots, "roots", () => { checkedOf = lastPoint; return {}; }, result => {
    if (checkedOf === lastPoint) drawRoots(result);
  }),
  nyquist: new Follower(panels.nyquist, "nyquist", () => ({}), drawNyquist),
  reflection: new Follower(panels.reflection, "reflection", () => ({}), drawReflection),
  motion: new Follower(panels.motion, "motion", motionOptions, drawMotion),
  chart: new Follower(panels.chart, "chart", () => ({ ...axes }), result => {
    const alone = state.structure === null;
    if (alone) free = result;
    lastChart = result;
    drawChart(result);
    if (!alone && !known.drive && free === null) askFree();
  }),
};
// The point rests: what was sketched is sharpened, counted and certified.
let checkedOf = "", resting = 0, still = 0;
function checkSoon() {
  clearTimeout(resting);
  panels.roots.busy("checking …", follow.checked);
  resting = setTimeout(rested, 250);
}
function rested() {
  follow.checked.poke();
  if (!panels.nyquist.section.hidden) follow.nyquist.poke();
}
async function askFree() {
  free = false;
  const key = freeFor;
  let found = null;
  try { found = await ask("chart", question(true), { ...axes }); } catch { /* the chart is there without it */ }
  if (key !== freeFor) return;
  free = found;
  if (found) drawChart(lastChart);
}

function changedPoint() {
  if (chartPlot) chartPlot.handle.place(state[names()[0]], state[names()[1]], pointText());
  const now = JSON.stringify(question());
  if (now === lastPoint) return;
  lastPoint = now;
  clearTimeout(resting);
  panels.roots.busy("", follow.checked);
  follow.roots.poke();
  const atBit = state.structure !== null && !known.drive;
  panels.nyquist.section.hidden = !atBit;
  // Of a string of pipe it takes longer than a drag, too.
  if (atBit && known.lumped) follow.nyquist.poke();
  // A run takes longer than a step of the hand: it waits until the hand does.
  clearTimeout(still);
  if (followsMotion()) still = setTimeout(() => follow.motion.poke(), 120);
  else panels.motion.clear("A string of pipe takes a while: start the simulation.");
}
// Rig, rock or gains: the chart is another one too.
function changedLoop() {
  const key = JSON.stringify([state.rig, state.units, state.rock_strength, state.psi, axes]);
  if (key !== freeFor) { free = null; freeFor = key; }
  changedPoint();
  follow.chart.poke();
  panels.reflection.section.hidden = !known.drive;
  if (known.drive) follow.reflection.poke();
}

(async () => {
  try {
    const response = await fetch("api/start", { headers: { "X-Token": TOKEN } });
    const first = await response.json();
    Object.assign(state, first);
    if (first.rig && first.rig.text !== null) opened.set(first.rig.name, first.rig.text);
    known = { presets: [], structures: [], notes: [] };
    const strength = state.rock_strength;
    await chooseRig(state.rig);
    if (strength !== null && strength !== undefined) {
      state.rock_strength = strength;
      buildPoint();
      changedLoop();
    }
  } catch (error) {
    byId("verdict").textContent = told(error);
  }
})();
