// The pictures: parallel coordinates, scatter, sound pressure level of each vehicle.

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
  if (state.pointed !== null) list.push({ design: state.pointed, style: stroke(COLOUR.pointed, 2.2), mark: "pointed" });
  return list;
}

const parallel = {
  svg: picture(byId("parallel"), "parallel coordinates", pointByKey),
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
    for (const [colour, list] of byColour(selected)) {
      element(svg, "path", { d: list.map((design) => this.path(design)).join(""), ...stroke(colour, 1.2, { opacity: state.opacity }) });
    }
    shown.forEach((axis, place) => this.drawAxis(axis, this.x(place), gap, slanted));
    this.layer = element(svg, "g");
    this.drawMarks();
  },
  drawMarks() {
    this.layer.replaceChildren();
    for (const { design, style } of marks()) element(this.layer, "path", { d: this.path(design), ...style });
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
  // the axis near x, within reach of a hand; names above it reach further
  axisAt(x, y) {
    const near = this.shown.map((axis, place) => [Math.abs(this.x(place) - x), axis]).sort((p, q) => p[0] - q[0])[0];
    return near[0] <= (y < this.top - 20 ? 24 : 12) ? near[1] : null;
  },
  placeAt(x) {
    const gap = this.shown.length > 1 ? this.x(1) - this.left : 1;
    return Math.max(0, Math.min(this.shown.length - 1, Math.round((x - this.left) / gap)));
  },
  stepAt(y) {
    return ((this.height - this.bottom - y) / (this.height - this.top - this.bottom)) * STEPS;
  },
  designAt(x, y) {
    const last = this.shown.length - 1;
    const place = Math.max(0, Math.min(last - 1, Math.floor(((x - this.left) / Math.max(1, this.x(last) - this.left)) * last)));
    const share = (x - this.x(place)) / (this.x(place + 1) - this.x(place));
    return nearest(selected.filter((design) => design < N), 9, (design) => {
      const [from, to] = [place, Math.min(last, place + 1)].map((at) => this.y(stepOf(this.shown[at], valueOf(this.shown[at], design))));
      return Math.abs(from + share * (to - from) - y);
    });
  },
};

const scatter = {
  svg: picture(byId("scatter"), "scatter", pointByKey),
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
    for (const [colour, list] of byColour(selected.filter((design) => design >= N))) {
      const dots = list.map((design) => "M" + this.place(design).map((at) => at.toFixed(1)).join(",") + "h0").join("");
      element(svg, "path", { d: dots, ...stroke(colour, 3, { opacity: state.opacity, "stroke-linecap": "round" }) });
    }
    for (const design of designs.slice(0, N)) {
      const [x, y] = this.place(design);
      const look = chosen.has(design) ? { r: 4, fill: colourOf(design), opacity: 0.8 } : { r: 3, fill: "#fff", stroke: "#9aa5b1" };
      for (const [axis, end] of [[across, 0], [up, 1]]) {
        if (!axis.errors || !chosen.has(design)) continue;
        const [from, to] = [-1, 1].map((side) => stepOf(axis, axis.values[design] + side * axis.errors[design]));
        const bar = end ? { x1: x, x2: x, y1: this.y(from), y2: this.y(to) } : { x1: this.x(from), x2: this.x(to), y1: y, y2: y };
        element(svg, "line", { ...bar, stroke: "#9aa5b1" });
      }
      element(svg, "circle", { cx: x, cy: y, ...look });
    }
    this.layer = element(svg, "g");
    this.drawMarks();
  },
  drawMarks() {
    this.layer.replaceChildren();
    for (const { design, mark } of marks()) this.drawMark(design, mark);
  },
  place(design) {
    return [this.x(stepOf(state.across, valueOf(state.across, design))), this.y(stepOf(state.up, valueOf(state.up, design)))];
  },
  drawMark(design, mark) {
    const [x, y] = this.place(design);
    const svg = this.layer;
    const side = x > this.width - 90 ? [-10, "end"] : [10, "start"];
    if (mark === "pointed") element(svg, "circle", { cx: x, cy: y, r: 9, ...stroke(COLOUR.pointed, 3) });
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
    return nearest(designs.filter((design) => design < N), 12, (design) => {
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
    const y = (level) => this.y(level);
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
    const extent = this.extent();
    if (extent) element(svg, "path", { d: path([...this.curve(extent[1]), ...this.curve(extent[0]).reverse()]) + "Z", fill: COLOUR.chosen, opacity: 0.16 });
    this.layer = element(svg, "g");
    this.drawMarks();
  },
  y(level) {
    return this.height - this.bottom - ((level - range[0]) / (range[1] - range[0])) * (this.height - this.top - this.bottom);
  },
  curve(values) {
    return Array.from(values, (level, at) => [this.x(front.frequency[at]), this.y(level)]);
  },
  drawMarks() {
    this.layer.replaceChildren();
    for (const { design, style } of marks()) {
      element(this.layer, "path", { d: path(this.curve(levelsOf(design, place))), ...style, "stroke-width": style["stroke-width"] - 0.8 });
    }
    const read = this.x(front.frequency[state.line]);
    element(this.layer, "line", { x1: read, x2: read, y1: this.top, y2: this.height - this.bottom, stroke: COLOUR.a, "stroke-width": 1, "stroke-dasharray": "1 3" });
  },
  // lowest and highest level of the selected designs at every line
  extent() {
    const drawn = selected.filter((design) => design < N);
    if (!drawn.length) return null;
    const [low, high] = [0, 1].map(() => Float32Array.from(levelsOf(drawn[0], place)));
    for (const design of drawn) {
      levelsOf(design, place).forEach((level, at) => {
        if (level < low[at]) low[at] = level;
        if (level > high[at]) high[at] = level;
      });
    }
    return [low, high];
  },
}));

// every response over every variable; drawn while it is open
const matrix = {
  canvas: byId("matrix-canvas"),
  draw() {
    if (!byId("matrix").open) return;
    const columns = shownAxes().filter((axis) => axis.kind === "variable");
    const rows = shownAxes().filter((axis) => axis.kind !== "variable");
    const [left, top, cell, height] = [110, 6, Math.max(60, (roomIn(byId("matrix"), 1000) - 112) / columns.length), 96];
    this.canvas.width = left + cell * columns.length + 2;
    this.canvas.height = top + height * rows.length + 22;
    const pen = this.canvas.getContext("2d");
    pen.font = "12px sans-serif";
    const every = Math.ceil(selected.length / 1500); // more dots would only hide each other
    const groups = byColour(selected.filter((design, at) => at % every === 0));
    rows.forEach((row, line) => {
      [pen.fillStyle, pen.globalAlpha] = [COLOUR.a, 1];
      pen.fillText(`${row.name} [${row.unit}]`.slice(0, 18), 0, top + height * (line + 0.5));
      columns.forEach((column, place) => {
        const [x, y] = [left + cell * place, top + height * line];
        pen.strokeStyle = COLOUR.other;
        pen.globalAlpha = 1;
        pen.strokeRect(x, y, cell - 6, height - 6);
        pen.globalAlpha = state.opacity;
        for (const [colour, list] of groups) {
          pen.fillStyle = colour;
          for (const design of list) {
            const across = (stepOf(column, column.values[design]) / STEPS) * (cell - 10);
            const up = (stepOf(row, row.values[design]) / STEPS) * (height - 10);
            pen.fillRect(x + 1 + across, y + height - 9 - up, 2, 2);
          }
        }
      });
    });
    pen.globalAlpha = 1;
    pen.fillStyle = COLOUR.a;
    columns.forEach((column, place) => pen.fillText(column.name, left + cell * place, top + height * rows.length + 12));
  },
};

// the run-up of one design in one vehicle: the order alone, at an even rise of speed
const SECONDS = 10;
function aWeighting(hertz) {
  const f2 = hertz * hertz;
  const [c1, c2, c3, c4] = [20.598997 ** 2, 107.65265 ** 2, 737.86223 ** 2, 12194.217 ** 2];
  const gain = (f) => (c4 * f * f) / ((f + c1) * Math.sqrt((f + c2) * (f + c3)) * (f + c4));
  return 20 * Math.log10(gain(f2) / gain(1e6));
}
const peakPascal = (level, line) => Math.SQRT2 * 20e-6 * 10 ** ((level - aWeighting(front.frequency[line])) / 20);

function runUp(context, design, vehicle, seconds) {
  const { frequency } = front;
  const [first, last] = [frequency[0], frequency[frequency.length - 1]];
  const heard = Array.from(levelsOf(design, vehicle), peakPascal);
  const scale = front.fullScale;
  let line = 0;
  const gains = Float32Array.from({ length: 400 }, (_, at) => {
    const now = first + ((last - first) * at) / 399;
    while (line < frequency.length - 2 && frequency[line + 1] < now) line++;
    const share = Math.min(1, (now - frequency[line]) / (frequency[line + 1] - frequency[line]));
    const fade = Math.min(1, at / 4, (399 - at) / 4); // against clicks
    return (fade * (heard[line] + share * (heard[line + 1] - heard[line]))) / scale;
  });
  const [tone, volume] = [context.createOscillator(), context.createGain()];
  const begin = context.currentTime;
  tone.frequency.setValueAtTime(first, begin);
  tone.frequency.linearRampToValueAtTime(last, begin + seconds);
  volume.gain.setValueCurveAtTime(gains, begin, seconds);
  tone.connect(volume).connect(context.destination);
  tone.start(begin);
  tone.stop(begin + seconds);
}

const range = levels.reduce(([low, high], level) => [Math.min(low, level), Math.max(high, level)], [Infinity, -Infinity]).map((level, end) => 10 * (end ? Math.ceil(level / 10) : Math.floor(level / 10)));
if (range[0] === range[1]) range[1] += 10;

function grid(svg, axis, place, [from, to], level) {
  const scale = inStiffness(axis) ? axis.stiffness : 1;
  const axisTicks = ticks(axis.lower * scale, axis.upper * scale, 5);
  for (const value of axisTicks.values) {
    const at = place(stepOf(axis, value / scale));
    const [ends, label] = level
      ? [{ x1: from, x2: to, y1: at, y2: at }, { x: from - 6, y: at + 4, "text-anchor": "end" }]
      : [{ x1: at, x2: at, y1: from, y2: to }, { x: at, y: to + 17, "text-anchor": "middle" }];
    element(svg, "line", { ...ends, stroke: "#dfe3e8" });
    element(svg, "text", { ...label, class: "muted" }, text(value, axisTicks.decimals));
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
