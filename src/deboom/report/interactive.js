"use strict";
// One state, one redraw: pictures and form controls show the same state and change it through the
// same few functions. Brushes are steps of an axis, so that a drag and a slider mean the same.

const front = JSON.parse(document.getElementById("front").textContent);
const STEPS = 200;
const [WIDE, CLOSE] = [56, 42]; // gaps between axes [px]: below it names are slanted; the least
const TODAY = -1;
const SVG = "http://www.w3.org/2000/svg";
const COLOUR = { a: "#1f2933", b: "#b5478a", chosen: "#0b4f7d", other: "#c3cad2", today: "#5f6b7a", walk: "#e69f00" };
const axes = front.axes;
const designs = front.points.map((_, design) => design);
const levels = decoded(front.levels);
const byId = (id) => document.getElementById(id);

const state = {
  brushes: new Map(), // axis → [lowest step, highest step]
  pins: { a: startPin(["best mean"], 0), b: startPin(["knee", "best sigma"], TODAY) },
  stiffness: true, // numbers in N/mm, otherwise as factors
  vehicles: false, // whether vehicles have axes of their own
  across: axes.find((axis) => axis.kind === "objective") || axes[0],
  up: axes.filter((axis) => axis.kind === "objective")[1] || axes[axes.length - 1],
  line: Math.floor(front.frequency.length / 2),
  walk: null, // design under the pointer or the arrow keys
};
let selected = designs;

function startPin(names, otherwise) {
  for (const name of names) {
    const design = front.picks.indexOf(name);
    if (design >= 0) return design;
  }
  return otherwise;
}

function decoded(text) {
  const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  const values = new Float32Array(bytes.length / 2);
  for (let at = 0; at < values.length; at++) values[at] = view.getInt16(2 * at, true) * front.levelStep;
  return values;
}

// ---- quantities

const valueOf = (axis, design) => (design === TODAY ? axis.today : axis.values[design]);
const inStiffness = (axis) => state.stiffness && axis.stiffness !== null;
const unitOf = (axis) => (inStiffness(axis) ? "N/mm" : axis.unit);
const stepOf = (axis, value) => ((value - axis.lower) / (axis.upper - axis.lower)) * STEPS;
const atStep = (axis, step) => axis.lower + (step / STEPS) * (axis.upper - axis.lower);
const isDecibel = (axis) => axis.unit.startsWith("dB");
const shownAxes = () => axes.filter((axis) => state.vehicles || axis.kind !== "vehicle");

function levelsOf(design, vehicle) {
  const lines = front.frequency.length;
  const first = ((design + 1) * front.vehicles.length + vehicle) * lines;
  return levels.subarray(first, first + lines);
}

function text(value, decimals) {
  const plain = Math.abs(value).toFixed(decimals);
  return (value < 0 && Number(plain) !== 0 ? "−" : "") + plain;
}

function signed(value, decimals) {
  const words = text(value, decimals);
  return value > 0 && Number(words) !== 0 ? "+" + words : words;
}

function decimalsOf(axis, scale = 1) {
  if (isDecibel(axis)) return axis.upper - axis.lower < 0.3 ? 3 : 2;
  if (scale === 1 && axis.unit === "1") return 3;
  return Math.max(0, 2 - Math.floor(Math.log10(Math.max(1e-9, Math.abs(axis.lower), Math.abs(axis.upper)) * scale)));
}

function shownValue(axis, value) {
  const scale = inStiffness(axis) ? axis.stiffness : 1;
  return text(value * scale, decimalsOf(axis, scale));
}

const withUnit = (axis, value) => shownValue(axis, value) + (unitOf(axis) === "1" ? "" : " " + unitOf(axis));

function nameOf(design) {
  if (design === TODAY) return "today's";
  const pick = front.picks[design];
  return "design " + front.points[design] + (pick ? ", " + pick : "");
}

function ticks(lower, upper, wanted) {
  const rough = (upper - lower) / wanted;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough * 0.999);
  const found = [];
  for (let at = Math.ceil(lower / step - 1e-9); at * step <= upper + step * 1e-9; at++) found.push(at * step);
  return { values: found, decimals: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}

// ---- actions: everything that a pointer, a key or a control can ask for

function brush(axis, from, to) {
  const low = Math.max(0, Math.min(STEPS, Math.round(Math.min(from, to))));
  const high = Math.max(0, Math.min(STEPS, Math.round(Math.max(from, to))));
  if (low === 0 && high === STEPS) state.brushes.delete(axis);
  else state.brushes.set(axis, [low, high]);
  redraw();
}

function clearBrush(axis) {
  state.brushes.delete(axis);
  redraw();
}

function clearBrushes() {
  state.brushes.clear();
  redraw();
}

function pin(which, design) {
  state.pins[which] = design;
  redraw();
}

const clickedPin = () => (byId("click-b").checked ? "b" : "a");

function walkTo(design, spoken) {
  if (state.walk === design) return;
  state.walk = design;
  drawPictures();
  if (!spoken || design === null) return;
  const objectives = axes.filter((axis) => axis.kind === "objective");
  const words = objectives.map((axis) => axis.name + " " + withUnit(axis, valueOf(axis, design)));
  byId("walk").textContent = nameOf(design) + ": " + words.join(", ");
}

function walkByKey(event) {
  const place = selected.indexOf(state.walk);
  const last = selected.length - 1;
  const to = {
    ArrowRight: Math.min(place + 1, last), ArrowDown: Math.min(place + 1, last),
    ArrowLeft: Math.max(place - 1, 0), ArrowUp: Math.max(place - 1, 0), Home: 0, End: last,
  }[event.key];
  if (to !== undefined && last >= 0) walkTo(selected[to], true);
  else if (event.key === "Enter" && state.walk !== null) {
    const which = clickedPin();
    pin(event.shiftKey ? { a: "b", b: "a" }[which] : which, state.walk);
  } else if (event.key === "Escape") clearBrushes();
  else return;
  event.preventDefault();
}

function exportSelection() {
  const variables = axes.filter((axis) => axis.kind === "variable");
  const heads = ["point", "pick", "pin"];
  for (const axis of variables) {
    heads.push(`${axis.name} [${axis.unit}]`);
    if (axis.stiffness !== null) heads.push(`${axis.name} [N/mm]`);
  }
  const others = axes.filter((axis) => axis.kind !== "variable");
  heads.push(...others.map((axis) => `${axis.name} [${axis.unit}]`));
  const rows = selected.map((design) => {
    const pins = ["a", "b"].filter((which) => state.pins[which] === design);
    const row = [front.points[design], front.picks[design], pins.join(" ").toUpperCase()];
    for (const axis of variables) {
      row.push(axis.values[design]);
      if (axis.stiffness !== null) row.push(Number((axis.values[design] * axis.stiffness).toPrecision(7)));
    }
    return row.concat(others.map((axis) => axis.values[design]));
  });
  const quoted = (cell) => (/[",\n\r]/.test(cell) ? `"${String(cell).replace(/"/g, '""')}"` : String(cell));
  const lines = [heads, ...rows].map((row) => row.map(quoted).join(",") + "\n");
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob(["\ufeff", ...lines], { type: "text/csv;charset=utf-8" }));
  link.download = front.run.replace(/[^\w.-]+/g, "-") + "_selection.csv";
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

// ---- drawing

function element(parent, name, attributes = {}, words = null) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (words !== null) made.textContent = words;
  parent.append(made);
  return made;
}

function node(parent, name, attributes = {}, words = null) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (words !== null) made.textContent = words;
  parent.append(made);
  return made;
}

function sheet(svg, width, height) {
  svg.replaceChildren();
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.setAttribute("width", width);
  svg.setAttribute("height", height);
}

// width of a picture [px]: what its place has on the screen, or what a sheet of paper has
let printing = false;
const roomIn = (place, onPaper) => (printing ? onPaper : place.clientWidth);

const path = (points) => "M" + points.map(([x, y]) => x.toFixed(1) + "," + y.toFixed(1)).join("L");
const stroke = (colour, width, more = {}) => ({ fill: "none", stroke: colour, "stroke-width": width, "stroke-linejoin": "round", ...more });

// the design marks that lie over everything else, in this order
function marks() {
  const list = [
    { design: TODAY, style: stroke(COLOUR.today, 2, { "stroke-dasharray": "2 4" }), mark: "today" },
    { design: state.pins.b, style: stroke(COLOUR.b, 2.6, { "stroke-dasharray": "9 4" }), mark: "b" },
    { design: state.pins.a, style: stroke(COLOUR.a, 2.6), mark: "a" },
  ];
  if (state.walk !== null) list.push({ design: state.walk, style: stroke(COLOUR.walk, 2.2), mark: "walk" });
  return list;
}

const parallel = {
  svg: picture(byId("parallel"), "parallel coordinates", walkByKey),
  left: 46, bottom: 28,
  draw() {
    const shown = shownAxes();
    const room = roomIn(byId("parallel"), 1030);
    const gaps = Math.max(1, shown.length - 1);
    const slanted = (room - 2 * this.left) / gaps < WIDE; // names of close axes
    const right = slanted ? 88 : this.left;
    const gap = Math.max((room - this.left - right) / gaps, CLOSE);
    const width = this.left + gap * gaps + right;
    this.top = slanted ? 126 : 74;
    this.height = (printing ? 366 : 246) + this.top;
    this.shown = shown;
    this.x = (place) => this.left + gap * place;
    this.y = (step) => this.height - this.bottom - (step / STEPS) * (this.height - this.top - this.bottom);
    const svg = this.svg;
    sheet(svg, width, this.height);
    svg.setAttribute("aria-label", `Parallel coordinates of ${shown.length} axes; ${selected.length} of ${designs.length} designs selected`);
    const chosen = new Set(selected);
    const others = designs.filter((design) => !chosen.has(design));
    element(svg, "path", { d: others.map((design) => this.path(design)).join(""), ...stroke(COLOUR.other, 1, { opacity: 0.75 }) });
    element(svg, "path", { d: selected.map((design) => this.path(design)).join(""), ...stroke(COLOUR.chosen, 1.2, { opacity: 0.5 }) });
    shown.forEach((axis, place) => this.drawAxis(axis, this.x(place), gap, slanted));
    for (const { design, style } of marks()) element(svg, "path", { d: this.path(design), ...style });
  },
  path(design) {
    return path(this.shown.map((axis, place) => [this.x(place), this.y(stepOf(axis, valueOf(axis, design)))]));
  },
  drawAxis(axis, x, gap, slanted) {
    const svg = this.svg;
    const middle = { x, "text-anchor": "middle" };
    const brushed = state.brushes.get(axis);
    element(svg, "line", { x1: x, x2: x, y1: this.y(0), y2: this.y(STEPS), stroke: axis.colour, "stroke-width": 3 });
    if (brushed) {
      const [low, high] = brushed.map((step) => this.y(step));
      element(svg, "rect", { x: x - 8, width: 16, y: high, height: Math.max(2, low - high), fill: "#fff", "fill-opacity": 0.75, stroke: axis.colour, "stroke-width": 2 });
    }
    const unit = `[${unitOf(axis)}]${axis.note ? "°" : ""}`;
    if (slanted) {
      const words = `${axis.name.length > 16 ? axis.name.slice(0, 15) + "…" : axis.name} ${unit}`;
      element(svg, "text", { transform: `translate(${x + 3} ${this.top - 24}) rotate(-45)` }, words);
    } else {
      const name = fitted(axis.name, gap);
      name.forEach((part, row) => element(svg, "text", { ...middle, y: 32 - 15 * (name.length - 1 - row), "font-weight": 600 }, part));
      element(svg, "text", { ...middle, y: 47, class: "muted" }, unit);
    }
    for (const [step, y] of [[STEPS, this.top - 7], [0, this.height - this.bottom + 17]]) {
      element(svg, "text", { ...middle, y }, shownValue(axis, atStep(axis, step)));
    }
  },
  // the axis near x, within reach of a hand
  axisAt(x) {
    const near = this.shown.map((axis, place) => [Math.abs(this.x(place) - x), axis]).sort((p, q) => p[0] - q[0])[0];
    return near[0] <= 12 ? near[1] : null;
  },
  stepAt(y) {
    return ((this.height - this.bottom - y) / (this.height - this.top - this.bottom)) * STEPS;
  },
  designAt(x, y) {
    const last = this.shown.length - 1;
    const place = Math.max(0, Math.min(last - 1, Math.floor(((x - this.left) / Math.max(1, this.x(last) - this.left)) * last)));
    const share = (x - this.x(place)) / (this.x(place + 1) - this.x(place));
    return nearest(selected, 9, (design) => {
      const [from, to] = [place, Math.min(last, place + 1)].map((at) => this.y(stepOf(this.shown[at], valueOf(this.shown[at], design))));
      return Math.abs(from + share * (to - from) - y);
    });
  },
};

const scatter = {
  svg: picture(byId("scatter"), "scatter", walkByKey),
  left: 64, right: 18, top: 14, bottom: 48,
  draw() {
    const width = Math.max(320, roomIn(byId("scatter"), 350));
    const height = Math.round(Math.min(500, width * 0.86));
    const [across, up] = [state.across, state.up];
    this.width = width;
    this.height = height;
    const edge = 10;
    this.x = (step) => this.left + edge + (step / STEPS) * (width - this.left - this.right - 2 * edge);
    this.y = (step) => height - this.bottom - edge - (step / STEPS) * (height - this.top - this.bottom - 2 * edge);
    const svg = this.svg;
    sheet(svg, width, height);
    svg.setAttribute("aria-label", `${up.name} over ${across.name}; ${selected.length} of ${designs.length} designs selected`);
    grid(svg, across, (step) => this.x(step), [this.top, height - this.bottom], false);
    grid(svg, up, (step) => this.y(step), [this.left, width - this.right], true);
    element(svg, "text", { x: (this.left + width - this.right) / 2, y: height - 6, "text-anchor": "middle" }, `${across.name} [${unitOf(across)}]`);
    element(svg, "text", { transform: `translate(15 ${(this.top + height - this.bottom) / 2}) rotate(-90)`, "text-anchor": "middle" }, `${up.name} [${unitOf(up)}]`);
    const box = [across, up].map((axis) => state.brushes.get(axis));
    if (box[0] || box[1]) {
      const [xs, ys] = box.map((steps) => steps || [0, STEPS]);
      element(svg, "rect", { x: this.x(xs[0]), width: Math.max(1, this.x(xs[1]) - this.x(xs[0])), y: this.y(ys[1]), height: Math.max(1, this.y(ys[0]) - this.y(ys[1])), fill: COLOUR.chosen, opacity: 0.12, stroke: COLOUR.chosen });
    }
    const chosen = new Set(selected);
    for (const design of designs) {
      const [x, y] = this.place(design);
      const look = chosen.has(design) ? { r: 4, fill: COLOUR.chosen, opacity: 0.8 } : { r: 3, fill: "#fff", stroke: "#9aa5b1" };
      element(svg, "circle", { cx: x, cy: y, ...look });
    }
    for (const { design, mark } of marks()) this.drawMark(design, mark);
  },
  place(design) {
    return [this.x(stepOf(state.across, valueOf(state.across, design))), this.y(stepOf(state.up, valueOf(state.up, design)))];
  },
  drawMark(design, mark) {
    const [x, y] = this.place(design);
    const svg = this.svg;
    const side = x > this.width - 90 ? [-10, "end"] : [10, "start"];
    if (mark === "walk") element(svg, "circle", { cx: x, cy: y, r: 9, ...stroke(COLOUR.walk, 3) });
    if (mark === "today") {
      element(svg, "path", { d: `M${x},${y - 7}l7,7l-7,7l-7,-7z`, fill: "#fff", stroke: COLOUR.today, "stroke-width": 2 });
      backed(svg, "today", x + side[0], y + 4, side[1]);
    }
    if (mark === "a") element(svg, "circle", { cx: x, cy: y, r: 6.5, fill: "#fff", stroke: COLOUR.a, "stroke-width": 3 });
    if (mark === "b") element(svg, "rect", { x: x - 6, y: y - 6, width: 12, height: 12, fill: "#fff", stroke: COLOUR.b, "stroke-width": 3 });
    if (mark === "a" || mark === "b") {
      const label = backed(svg, mark.toUpperCase(), x + (mark === "a" ? side[0] : -10), y - 8, mark === "a" ? side[1] : "end");
      label.setAttribute("font-weight", 700);
    }
  },
  steps(x, y) {
    return [((x - this.x(0)) / (this.x(STEPS) - this.x(0))) * STEPS, ((y - this.y(0)) / (this.y(STEPS) - this.y(0))) * STEPS];
  },
  designAt(x, y) {
    return nearest(designs, 12, (design) => {
      const [px, py] = this.place(design);
      return Math.hypot(px - x, py - y);
    });
  },
};

const panels = front.vehicles.map((vehicle, place) => ({
  svg: element(node(byId("panels"), "div"), "svg", { role: "img" }), vehicle, place, left: 44, right: 12, top: 52, bottom: 40, height: 230,
  draw() {
    const width = Math.max(240, roomIn(this.svg.parentElement, 300));
    const { frequency, speed } = front;
    const ends = [frequency[0], frequency[frequency.length - 1]];
    this.x = (at) => this.left + ((at - ends[0]) / Math.max(1e-9, ends[1] - ends[0])) * (width - this.left - this.right);
    const y = (level) => this.height - this.bottom - ((level - range[0]) / (range[1] - range[0])) * (this.height - this.top - this.bottom);
    const svg = this.svg;
    sheet(svg, width, this.height);
    svg.setAttribute("aria-label", `SPL of ${vehicle.name} over ${ends[0]} to ${ends[1]} Hz; the table below gives the values at the line read`);
    element(svg, "rect", { x: this.left, y: 3, width: 12, height: 12, rx: 2, fill: vehicle.colour });
    element(svg, "text", { x: this.left + 18, y: 14, "font-weight": 650 }, vehicle.name);
    const decades = ticks(range[0], range[1], 5);
    for (const level of decades.values) {
      element(svg, "line", { x1: this.left, x2: width - this.right, y1: y(level), y2: y(level), stroke: "#dfe3e8" });
      element(svg, "text", { x: this.left - 6, y: y(level) + 4, "text-anchor": "end", class: "muted" }, text(level, decades.decimals));
    }
    element(svg, "text", { x: width - this.right, y: 14, "text-anchor": "end", class: "muted" }, "SPL [dB(A)]");
    const hertz = ticks(ends[0], ends[1], 5);
    for (const at of hertz.values) {
      element(svg, "line", { x1: this.x(at), x2: this.x(at), y1: this.top, y2: this.height - this.bottom, stroke: "#dfe3e8" });
      element(svg, "text", { x: this.x(at), y: this.height - this.bottom + 15, "text-anchor": "middle", class: "muted" }, text(at, hertz.decimals));
    }
    element(svg, "text", { x: width - this.right, y: this.height - 6, "text-anchor": "end", class: "muted" }, "frequency [Hz]");
    const ratio = speed[0] / frequency[0];
    const turns = ticks(ends[0] * ratio, ends[1] * ratio, 4);
    turns.values.forEach((rpm, at) => {
      element(svg, "line", { x1: this.x(rpm / ratio), x2: this.x(rpm / ratio), y1: this.top - 5, y2: this.top, stroke: COLOUR.today });
      element(svg, "text", { x: this.x(rpm / ratio), y: this.top - 9, "text-anchor": "middle", class: "muted" }, text(rpm, turns.decimals) + (at === turns.values.length - 1 ? " rpm" : ""));
    });
    const curve = (values) => Array.from(values, (level, at) => [this.x(frequency[at]), y(level)]);
    const extent = this.extent();
    if (extent) element(svg, "path", { d: path([...curve(extent[1]), ...curve(extent[0]).reverse()]) + "Z", fill: COLOUR.chosen, opacity: 0.16 });
    for (const { design, style } of marks()) element(svg, "path", { d: path(curve(levelsOf(design, place))), ...style, "stroke-width": style["stroke-width"] - 0.8 });
    const read = this.x(frequency[state.line]);
    element(svg, "line", { x1: read, x2: read, y1: this.top, y2: this.height - this.bottom, stroke: COLOUR.a, "stroke-width": 1, "stroke-dasharray": "1 3" });
  },
  // lowest and highest level of the selected designs at every line
  extent() {
    if (!selected.length) return null;
    const [low, high] = [0, 1].map(() => Float32Array.from(levelsOf(selected[0], place)));
    for (const design of selected) {
      levelsOf(design, place).forEach((level, at) => {
        if (level < low[at]) low[at] = level;
        if (level > high[at]) high[at] = level;
      });
    }
    return [low, high];
  },
}));

const range = levels.reduce(([low, high], level) => [Math.min(low, level), Math.max(high, level)], [Infinity, -Infinity]).map((level, end) => 10 * (end ? Math.ceil(level / 10) : Math.floor(level / 10)));
if (range[0] === range[1]) range[1] += 10;

function grid(svg, axis, place, [from, to], level) {
  const scale = inStiffness(axis) ? axis.stiffness : 1;
  const found = ticks(axis.lower * scale, axis.upper * scale, 5);
  for (const value of found.values) {
    const at = place(stepOf(axis, value / scale));
    const [ends, label] = level
      ? [{ x1: from, x2: to, y1: at, y2: at }, { x: from - 6, y: at + 4, "text-anchor": "end" }]
      : [{ x1: at, x2: at, y1: from, y2: to }, { x: at, y: to + 17, "text-anchor": "middle" }];
    element(svg, "line", { ...ends, stroke: "#dfe3e8" });
    element(svg, "text", { ...label, class: "muted" }, text(value, found.decimals));
  }
}

// words that stay legible over lines
function backed(svg, words, x, y, anchor) {
  return element(svg, "text", { x, y, "text-anchor": anchor, stroke: "#fff", "stroke-width": 4, "paint-order": "stroke" }, words);
}

// a name in as many rows as its axis has room for, at most two
function fitted(name, gap) {
  const room = Math.max(6, Math.floor(gap / 7));
  if (name.length <= room) return [name];
  const words = name.split(" ");
  let cut = 1;
  while (cut < words.length - 1 && words.slice(0, cut + 1).join(" ").length <= room) cut++;
  return [words.slice(0, cut), words.slice(cut)].map((part) => part.join(" ")).filter(Boolean)
    .map((part) => (part.length > room + 2 ? part.slice(0, room + 1) + "…" : part));
}

function nearest(list, reach, distance) {
  let [best, least] = [null, reach];
  for (const design of list) {
    const far = distance(design);
    if (far <= least) [best, least] = [design, far];
  }
  return best;
}

function picture(parent, words, onKey) {
  const svg = element(parent, "svg", { tabindex: 0, role: "application", "aria-label": words });
  svg.addEventListener("keydown", onKey);
  return svg;
}

// ---- pointers

function pointAt(svg, event) {
  const place = svg.getBoundingClientRect();
  const scale = svg.viewBox.baseVal.width / place.width;
  return [(event.clientX - place.left) * scale, (event.clientY - place.top) * scale];
}

// drag(start, now) while the button is down and the pointer has left its place; else click(point)
function listen(view, { grab, drag, click }) {
  let start = null;
  let moved = false;
  view.svg.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    start = { point: pointAt(view.svg, event), held: grab(...pointAt(view.svg, event)) };
    moved = false;
    view.svg.setPointerCapture(event.pointerId);
  });
  view.svg.addEventListener("pointermove", (event) => {
    const now = pointAt(view.svg, event);
    if (!start) return walkTo(view.designAt(...now), false);
    moved = moved || Math.hypot(now[0] - start.point[0], now[1] - start.point[1]) > 4;
    if (moved && start.held !== null) drag(start, now);
  });
  view.svg.addEventListener("pointerup", () => {
    if (start && !moved) click(start);
    start = null;
  });
  view.svg.addEventListener("pointercancel", () => { start = null; });
  view.svg.addEventListener("pointerleave", () => { if (!start) walkTo(null, false); });
}

listen(parallel, {
  grab: (x) => parallel.axisAt(x),
  drag: (start, now) => brush(start.held, parallel.stepAt(start.point[1]), parallel.stepAt(now[1])),
  click: ({ point, held }) => {
    const design = parallel.designAt(...point);
    if (held && state.brushes.has(held)) clearBrush(held);
    else if (design !== null) pin(clickedPin(), design);
  },
});

listen(scatter, {
  grab: () => true,
  drag: (start, now) => {
    const [from, to] = [scatter.steps(...start.point), scatter.steps(...now)];
    brush(state.across, from[0], to[0]);
    if (state.up !== state.across) brush(state.up, from[1], to[1]);
  },
  click: ({ point }) => {
    const design = scatter.designAt(...point);
    if (design !== null) pin(clickedPin(), design);
  },
});

for (const panel of panels) {
  panel.svg.addEventListener("pointermove", (event) => {
    const [x] = pointAt(panel.svg, event);
    readAt(nearest(front.frequency.map((_, line) => line), Infinity, (line) => Math.abs(panel.x(front.frequency[line]) - x)));
  });
}

function readAt(line) {
  if (state.line === line) return;
  state.line = line;
  redraw();
}

// ---- form controls and tables

function filledSelect(id, options, onChange) {
  const select = byId(id);
  for (const [value, words] of options) node(select, "option", { value }, words);
  select.addEventListener("change", () => onChange(Number(select.value)));
}

function slider(axis, end, place) {
  const label = `${axis.name}, ${end ? "highest" : "lowest"}`;
  const input = node(place, "input", { type: "range", min: 0, max: STEPS, step: 1, value: end ? STEPS : 0, "aria-label": label });
  input.addEventListener("input", () => {
    const steps = [...(state.brushes.get(axis) || [0, STEPS])];
    steps[end] = Number(input.value);
    if (steps[0] > steps[1]) steps[1 - end] = steps[end];
    brush(axis, ...steps);
  });
  return input;
}

const sliders = axes.map((axis) => {
  const place = node(byId("brushes"), "fieldset");
  place.style.borderLeftColor = axis.colour;
  const legend = node(place, "legend", {}, axis.name);
  if (axis.note) node(legend, "span", { class: "note" }, " ° " + axis.note);
  const output = node(place, "output");
  return { axis, place, output, inputs: [0, 1].map((end) => slider(axis, end, place)) };
});

function drawSliders() {
  const shown = new Set(shownAxes());
  for (const { axis, place, output, inputs } of sliders) {
    const steps = state.brushes.get(axis) || [0, STEPS];
    place.hidden = !shown.has(axis);
    place.classList.toggle("active", state.brushes.has(axis));
    inputs.forEach((input, end) => {
      input.value = steps[end];
      input.setAttribute("aria-valuetext", withUnit(axis, atStep(axis, steps[end])));
    });
    output.textContent = `${shownValue(axis, atStep(axis, steps[0]))} to ${withUnit(axis, atStep(axis, steps[1]))}`;
  }
}

function drawWords() {
  const brushes = [...state.brushes].map(([axis, [low, high]]) => `${axis.name} ${shownValue(axis, atStep(axis, low))} to ${withUnit(axis, atStep(axis, high))}`);
  const count = byId("count");
  const words = `${selected.length} of ${designs.length} designs selected`;
  if (count.textContent !== words) {
    count.replaceChildren();
    node(count, "strong", {}, String(selected.length));
    count.append(` of ${designs.length} designs selected`);
  }
  byId("brushed").textContent = brushes.length ? `: ${brushes.join("; ")}` : ", no brush";
  byId("pin-a").value = state.pins.a;
  byId("pin-b").value = state.pins.b;
  byId("line").value = state.line;
  const [hertz, rpm] = [front.frequency[state.line], front.speed[state.line]];
  const at = `${text(hertz, 2)} Hz, ${text(rpm, 0)} rpm`;
  byId("line-value").textContent = at;
  byId("line").setAttribute("aria-valuetext", at);
}

function table(id, caption, groups, heads, rows) {
  const place = byId(id);
  place.replaceChildren();
  node(place, "caption", {}, caption);
  const head = node(place, "thead");
  const above = node(head, "tr", { class: "groups" });
  for (const [words, columns] of groups) {
    if (words) node(above, "th", { colspan: columns, scope: "colgroup" }, words);
    else node(above, "td", { colspan: columns });
  }
  const top = node(head, "tr");
  for (const [name, unit] of heads) {
    const cell = node(top, "th", { scope: "col" }, name);
    if (unit) node(cell, "span", { class: "unit" }, `[${unit}]`);
  }
  const body = node(place, "tbody");
  for (const [first, ...cells] of rows) {
    const row = node(body, "tr");
    const cell = node(row, "th", { scope: "row" });
    node(cell, "span", { class: "swatch", "aria-hidden": "true" }).style.background = first.colour;
    cell.append(first.name);
    cells.forEach((words) => node(row, "td", {}, words));
  }
}

const pinWords = () => `A is ${nameOf(state.pins.a)}; B is ${nameOf(state.pins.b)}.`;

function drawStiffness() {
  const variables = axes.filter((axis) => axis.kind === "variable");
  const notes = variables.some((axis) => axis.note);
  const groups = [["", 1], ["dynamic stiffness", 4], ["factor", 2]];
  const heads = [["variable"], ["today", "N/mm"], ["A", "N/mm"], ["B", "N/mm"], ["B − A", "N/mm"], ["A", "1"], ["B", "1"]];
  if (notes) {
    groups.push(["", 1]);
    heads.push(["°"]);
  }
  const rows = variables.map((axis) => {
    const [a, b] = [state.pins.a, state.pins.b].map((design) => valueOf(axis, design));
    const known = axis.stiffness !== null;
    const decimals = known ? decimalsOf(axis, axis.stiffness) : 0;
    const mm = (value, words = text) => (known ? words(value * axis.stiffness, decimals) : "–");
    const row = [axis, mm(axis.today), mm(a), mm(b), mm(b - a, signed), text(a, 3), text(b, 3)];
    return notes ? [...row, axis.note] : row;
  });
  table("stiffness", `${pinWords()} Dynamic stiffness: mean magnitude over the band, today at factor 1.`, groups, heads, rows);
}

function drawVehicles() {
  const at = state.line;
  const four = [["today", "dB(A)"], ["A", "dB(A)"], ["B", "dB(A)"], ["B − A", "dB"]];
  const groups = [["", 1], ["mean level", 4], [`SPL at ${text(front.frequency[at], 2)} Hz, ${text(front.speed[at], 0)} rpm`, 4]];
  const triple = (values, decimals) => [...values.map((value) => text(value, decimals)), signed(values[2] - values[1], decimals)];
  const three = [TODAY, state.pins.a, state.pins.b];
  const means = axes.filter((axis) => axis.kind === "vehicle");
  const rows = front.vehicles.map((vehicle, place) => {
    const mean = triple(three.map((design) => valueOf(means[place], design)), 2);
    return [vehicle, ...mean, ...triple(three.map((design) => levelsOf(design, place)[at]), 1)];
  });
  for (const axis of axes.filter((one) => one.kind === "objective")) {
    const values = triple(three.map((design) => valueOf(axis, design)), decimalsOf(axis));
    rows.push([{ name: `${axis.name} [${axis.unit}]`, colour: axis.colour }, ...values, "", "", "", ""]);
  }
  table("vehicles", `${pinWords()} Mean level over the lines and the tolerance.`, groups, [["vehicle"], ...four, ...four], rows);
}

function drawKey() {
  const place = byId("key");
  place.replaceChildren();
  const entries = marks().filter(({ mark }) => mark !== "walk").map(({ design, style, mark }) => {
    return [mark === "today" ? "today's mounts" : `${mark.toUpperCase()}: ${nameOf(design)}`, style];
  });
  entries.push(["selected designs, lowest to highest", { stroke: COLOUR.chosen, "stroke-width": 10, opacity: 0.25 }]);
  for (const [words, style] of entries) {
    const item = node(place, "li");
    element(element(item, "svg", { width: 34, height: 12, "aria-hidden": "true" }), "line", { x1: 1, x2: 33, y1: 6, y2: 6, ...style });
    item.append(words);
  }
}

function drawPictures() {
  parallel.draw();
  scatter.draw();
  for (const panel of panels) panel.draw();
}

function redraw() {
  const brushes = [...state.brushes].map(([axis, [low, high]]) => [axis, low - 1e-6, high + 1e-6]);
  selected = designs.filter((design) => brushes.every(([axis, low, high]) => {
    const step = stepOf(axis, axis.values[design]);
    return step >= low && step <= high;
  }));
  drawPictures();
  drawKey();
  drawSliders();
  drawWords();
  drawStiffness();
  drawVehicles();
}

const choices = [[TODAY, "today's mounts"], ...designs.filter((d) => front.picks[d]).map((d) => [d, nameOf(d)]), ...designs.filter((d) => !front.picks[d]).map((d) => [d, nameOf(d)])];
filledSelect("pin-a", choices, (design) => pin("a", design));
filledSelect("pin-b", choices, (design) => pin("b", design));
for (const [id, key] of [["scatter-x", "across"], ["scatter-y", "up"]]) {
  filledSelect(id, axes.map((axis, place) => [place, axis.name]), (place) => { state[key] = axes[place]; redraw(); });
  byId(id).value = axes.indexOf(state[key]);
}
for (const id of ["in-stiffness", "in-factor"]) {
  byId(id).addEventListener("change", () => { state.stiffness = byId("in-stiffness").checked; redraw(); });
}
byId("with-vehicles").addEventListener("change", (event) => {
  state.vehicles = event.target.checked;
  for (const axis of [...state.brushes.keys()]) if (!shownAxes().includes(axis)) state.brushes.delete(axis);
  redraw();
});
byId("clear").addEventListener("click", clearBrushes);
byId("export").addEventListener("click", exportSelection);
byId("line").max = front.frequency.length - 1;
byId("line").addEventListener("input", () => readAt(Number(byId("line").value)));
byId("explorer").hidden = false;
for (const [event, onPaper] of [["beforeprint", true], ["afterprint", false]]) {
  window.addEventListener(event, () => { printing = onPaper; redraw(); });
}
let width = 0;
new ResizeObserver(() => {
  if (width !== document.body.clientWidth) { width = document.body.clientWidth; redraw(); }
}).observe(document.body);
redraw();
