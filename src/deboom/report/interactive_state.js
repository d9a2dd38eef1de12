// Pictures and form controls show one state and change it through the same few functions (actions,
// below). Brushes are steps of an axis, so that a drag and a slider mean the same.

const front = JSON.parse(document.getElementById("front").textContent);
const STEPS = 200;
const [WIDE, CLOSE] = [56, 42]; // gaps between axes [px]: below it names are slanted; the least
const TODAY = -1;
const COLOUR = { a: "#1f2933", b: "#b5478a", chosen: "#0b4f7d", beside: "#d55e00", cloud: "#7aa6c2", other: "#c3cad2", today: "#5f6b7a", pointed: "#e69f00" };
const axes = front.axes;
const N = front.points.length; // designs with curves; further rows were evaluated on the way
const ROWS = axes[0].values.length;
let designs = front.points.map((_, design) => design);
const levels = decoded(front.levels);

const state = {
  brushes: new Map(), // axis → [lowest step, highest step]
  pins: { a: startPin(["best-mean"], 0), b: startPin(["sigma-kept", "best-sigma"], TODAY) },
  stiffness: true, // numbers in N/mm, otherwise as factors
  vehicles: false, // whether vehicles have axes of their own
  across: axes.find((axis) => axis.kind === "objective") || axes[0],
  up: axes.filter((axis) => axis.kind === "objective")[1] || axes[axes.length - 1],
  line: Math.floor(front.frequency.length / 2),
  order: [...axes], // of the parallel coordinates
  colour: null, // axis that colours the selected designs; null: their run
  opacity: 0.5,
  pointed: null, // design under the pointer or the arrow keys
};
let selected = designs;

function startPin(names, otherwise) {
  for (const name of names) {
    const design = front.picks.findIndex((pick) => pick.split(" = ").includes(name));
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
const shownAxes = () => state.order.filter((axis) => state.vehicles || axis.kind !== "vehicle");

function levelsOf(design, vehicle) {
  const lines = front.frequency.length;
  const first = ((design + 1) * front.vehicles.length + vehicle) * lines;
  return levels.subarray(first, first + lines);
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
  return (front.runs[design] ? "beside: " : "") + "design " + front.points[design] + (pick ? ", " + pick : "");
}

// the selected designs by colour: few paths draw faster than many
const SCALE = ["#440154", "#482878", "#3e4a89", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58", "#b5de2b", "#fde725"];
function colourOf(design) {
  const axis = state.colour;
  if (!axis) return design >= N ? COLOUR.cloud : front.runs[design] ? COLOUR.beside : COLOUR.chosen;
  const share = stepOf(axis, axis.values[design]) / STEPS;
  return SCALE[Math.max(0, Math.min(SCALE.length - 1, Math.floor(share * SCALE.length)))];
}

function byColour(list) {
  const groups = new Map([[COLOUR.cloud, []]]);
  for (const design of list) {
    const colour = colourOf(design);
    if (!groups.has(colour)) groups.set(colour, []);
    groups.get(colour).push(design);
  }
  return groups;
}

// ---- actions: everything that a pointer, a key or a control can ask for

function brush(axis, from, to) {
  const low = Math.max(0, Math.min(STEPS, Math.round(Math.min(from, to))));
  const high = Math.max(0, Math.min(STEPS, Math.round(Math.max(from, to))));
  if (low === 0 && high === STEPS) state.brushes.delete(axis);
  else state.brushes.set(axis, [low, high]);
  redraw();
}

function moveAxis(axis, place) {
  state.order.splice(state.order.indexOf(axis), 1);
  state.order.splice(place, 0, axis);
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
  drawMarks();
  drawKey();
  drawWords();
  drawStiffness();
  drawVehicles();
}

const clickedPin = () => (byId("click-b").checked ? "b" : "a");

function pointTo(design, spoken) {
  if (state.pointed === design) return;
  state.pointed = design;
  drawMarks();
  if (!spoken || design === null) return;
  const objectives = axes.filter((axis) => axis.kind === "objective");
  const words = objectives.map((axis) => axis.name + " " + withUnit(axis, valueOf(axis, design)));
  byId("pointed").textContent = nameOf(design) + ": " + words.join(", ");
}

function pointByKey(event) {
  const passed = selected.filter((design) => design < N);
  const place = passed.indexOf(state.pointed);
  const last = passed.length - 1;
  const to = {
    ArrowRight: Math.min(place + 1, last), ArrowDown: Math.min(place + 1, last),
    ArrowLeft: Math.max(place - 1, 0), ArrowUp: Math.max(place - 1, 0), Home: 0, End: last,
  }[event.key];
  if (to !== undefined && last >= 0) pointTo(passed[to], true);
  else if (event.key === "Enter" && state.pointed !== null) {
    const which = clickedPin();
    pin(event.shiftKey ? { a: "b", b: "a" }[which] : which, state.pointed);
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
    const row = [front.points[design] || "", front.picks[design] || "", pins.join(" ").toUpperCase()];
    for (const axis of variables) {
      row.push(axis.values[design]);
      if (axis.stiffness !== null) row.push(Number((axis.values[design] * axis.stiffness).toPrecision(7)));
    }
    return row.concat(others.map((axis) => axis.values[design]));
  });
  const quoted = (cell) => (/[",\n\r]/.test(cell) ? `"${String(cell).replace(/"/g, '""')}"` : String(cell));
  const lines = [heads, ...rows].map((row) => row.map(quoted).join(",") + "\n");
  const name = front.run.replace(/[^\w.-]+/g, "-") + "_selection.csv";
  download(name, "text/csv;charset=utf-8", ["\ufeff", ...lines]);
}
