// What hands do: pointers over the pictures, form controls, tables; and the beginning.

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
    if (!start) return pointTo(view.designAt(...now), false);
    moved = moved || Math.hypot(now[0] - start.point[0], now[1] - start.point[1]) > 4;
    if (moved && start.held !== null) drag(start, now);
  });
  view.svg.addEventListener("pointerup", () => {
    if (start && !moved) click(start);
    start = null;
  });
  view.svg.addEventListener("pointercancel", () => { start = null; });
  view.svg.addEventListener("pointerleave", () => { if (!start) pointTo(null, false); });
}

listen(parallel, {
  grab: (x, y) => { const axis = parallel.axisAt(x, y); return axis && { axis, moves: y < parallel.top - 20 }; },
  drag: ({ held, point }, now) => {
    if (!held.moves) return brush(held.axis, parallel.stepAt(point[1]), parallel.stepAt(now[1]));
    const place = parallel.placeAt(now[0]);
    if (shownAxes()[place] !== held.axis) moveAxis(held.axis, state.order.indexOf(shownAxes()[place]));
  },
  click: ({ point, held }) => {
    const design = parallel.designAt(...point);
    if (held && state.brushes.has(held.axis)) clearBrush(held.axis);
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
  drawMarks();
  drawWords();
  drawVehicles();
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
    const measured = axis.stiffness !== null;
    const decimals = measured ? decimalsOf(axis, axis.stiffness) : 0;
    const mm = (value, words = text) => (measured ? words(value * axis.stiffness, decimals) : "–");
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
  for (const axis of axes.filter(({ kind }) => kind === "objective")) {
    const values = triple(three.map((design) => valueOf(axis, design)), decimalsOf(axis));
    rows.push([{ name: `${axis.name} [${axis.unit}]`, colour: axis.colour }, ...values, "", "", "", ""]);
  }
  table("vehicles", `${pinWords()} Mean level over the lines and the tolerance.`, groups, [["vehicle"], ...four, ...four], rows);
}

function drawKey() {
  const place = byId("key");
  place.replaceChildren();
  const entries = marks().filter(({ mark }) => mark !== "pointed").map(({ design, style, mark }) => {
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
  matrix.draw();
  for (const panel of panels) panel.draw();
}

// pins, today's design and the line read lie in a layer of their own: a hand that moves over a
// picture must not wait for all designs to be drawn
function drawMarks() {
  for (const view of [parallel, scatter, ...panels]) view.drawMarks();
}

const rest = byId("designs"); // on a phone the sliders suffice; what is folded is drawn when it opens
function redraw() {
  const brushes = [...state.brushes].map(([axis, [low, high]]) => [axis, low - 1e-6, high + 1e-6]);
  selected = designs.filter((design) => brushes.every(([axis, low, high]) => {
    const step = stepOf(axis, axis.values[design]);
    return step >= low && step <= high;
  }));
  if (!rest || rest.open || printing) drawPictures();
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
byId("with-all").parentElement.hidden = ROWS === N;
const ends = axes.map((axis) => [axis.lower, axis.upper]);
byId("with-all").addEventListener("change", (event) => {
  const all = event.target.checked;
  designs = Array.from({ length: all ? ROWS : N }, (_, design) => design);
  axes.forEach((axis, place) => { [axis.lower, axis.upper] = all ? axis.reach : ends[place]; });
  clearBrushes(); // their steps are of the other ends
});
const named = axes.map((axis, place) => [place, axis.name]);
filledSelect("colour", [[-1, "run"], ...named], (place) => { state.colour = axes[place] || null; redraw(); });
filledSelect("leading", [[-1, "as they are"], ...named], (place) => { if (place >= 0) moveAxis(axes[place], 0); });
byId("opacity").addEventListener("input", (event) => { state.opacity = Number(event.target.value); redraw(); });
byId("matrix").addEventListener("toggle", () => matrix.draw());
filledSelect("heard", front.vehicles.map((vehicle, place) => [place, vehicle.name]), () => {});
byId("scale").textContent = `full scale ${front.fullScale.toPrecision(3)} Pa, ${SECONDS} s; use headphones`;
let playing = null;
for (const [id, design] of [["play-today", () => TODAY], ["play-a", () => state.pins.a], ["play-b", () => state.pins.b]]) {
  byId(id).addEventListener("click", () => {
    if (playing) playing.close();
    playing = new AudioContext();
    runUp(playing, design(), Number(byId("heard").value), SECONDS);
  });
}
byId("clear").addEventListener("click", clearBrushes);
byId("export").addEventListener("click", exportSelection);
byId("line").max = front.frequency.length - 1;
byId("line").addEventListener("input", () => readAt(Number(byId("line").value)));
byId("explorer").hidden = false;
if (rest && matchMedia("(max-width: 600px)").matches) rest.open = false;
if (rest) rest.addEventListener("toggle", () => { if (rest.open) redraw(); });
for (const [event, onPaper] of [["beforeprint", true], ["afterprint", false]]) {
  window.addEventListener(event, () => { printing = onPaper; redraw(); });
}
let width = 0;
new ResizeObserver(() => {
  if (width !== document.body.clientWidth) { width = document.body.clientWidth; redraw(); }
}).observe(document.body);
redraw();
if (live) {
  live.fillStarts();
  byId("to-live").addEventListener("click", () => live.start(state.pins.a));
  byId("to-limits").addEventListener("click", () => live.limitsFromBrushes(state.brushes));
}
