// Pictures of the live part: curves, ±10 %, paths; and the beginning.

const INK = "#1f2933", GREY = "#5f6b7a", FAINT = "#e6eaee";
const title = (svg, words) => element(svg, "title", {}, words);

// ---- curves: a panel of each vehicle, and what changes in the chosen one

let panels = [];
const view = { left: 28, right: 6, top: 17, bottom: 17, width: 340, height: 172, low: 0, high: 100 };
const speeds = () => cases[session.shown].speed;
const xOf = (rpm) => view.left + ((rpm - speeds()[0]) / (speeds()[F - 1] - speeds()[0])) * (view.width - view.left - view.right);
const yOf = (level) => view.top + ((view.high - level) / (view.high - view.low)) * (view.height - view.top - view.bottom);
let placed = []; // of each line from the left, as it stands in a path; the same until panels are built anew
function points(spl, v) {
  const words = new Array(F), perDecibel = (view.height - view.top - view.bottom) / (view.high - view.low);
  for (let f = 0; f < F; f++) words[f] = placed[f] + Math.min(999, Math.round(10 * (view.top + (view.high - spl[v * F + f]) * perDecibel)) / 10);
  return words;
}
const curveOf = (spl, v) => "M" + points(spl, v).join("L");

function speedGrid(svg, base) {
  const { values } = ticks(speeds()[0], speeds()[F - 1], view.width > 240 ? 4 : 3);
  for (const rpm of values) {
    element(svg, "line", { x1: xOf(rpm), x2: xOf(rpm), y1: view.top, y2: base, stroke: FAINT });
    element(svg, "text", { x: xOf(rpm), y: view.height - 3, "text-anchor": "middle" }, Math.round(rpm));
  }
}

function buildCurves() {
  const place = byId("live-curves"), list = shownVehicles();
  place.replaceChildren();
  place.classList.toggle("many", list.length > 6);
  const all = list.flatMap((v) => [...today.spl.subarray(v * F, (v + 1) * F)]).sort((a, b) => a - b);
  view.high = 10 * Math.ceil((all[all.length - 1] + 3) / 10);
  view.low = Math.max(view.high - 60, 10 * Math.floor(all[Math.floor(0.03 * all.length)] / 10)); // notches leave the picture
  view.height = list.length > 6 ? 96 : list.length > 3 ? 160 : 250;
  if (matchMedia("(max-width: 600px)").matches) view.height = Math.min(view.height, 140);
  panels = list.map((v) => {
    const { colour, name } = vehicles[v];
    const box = node(place, "div", { class: "panel" });
    view.width = Math.max(150, box.clientWidth);
    placed = Array.from(speeds(), (rpm) => `${xOf(rpm).toFixed(1)},`);
    const svg = element(box, "svg", { viewBox: `0 0 ${view.width} ${view.height}`, height: view.height, role: "img", tabindex: 0 });
    const right = view.width - view.right, base = view.height - view.bottom;
    for (let level = view.low; level <= view.high; level += 10) {
      element(svg, "line", { x1: view.left, x2: right, y1: yOf(level), y2: yOf(level), stroke: FAINT });
      if (level < view.high) element(svg, "text", { x: view.left - 5, y: yOf(level) + 4, "text-anchor": "end" }, level);
    }
    speedGrid(svg, base);
    const clip = element(svg, "clipPath", { id: `live-clip-${v}` });
    element(clip, "rect", { x: view.left, y: view.top, width: right - view.left, height: base - view.top });
    const inside = element(svg, "g", { "clip-path": `url(#live-clip-${v})` });
    const area = element(inside, "path", { fill: colour, opacity: 0.2 });
    element(inside, "path", { d: curveOf(today.spl, v), fill: "none", stroke: GREY, "stroke-width": 1.5, "stroke-dasharray": "4 3" });
    const curve = element(inside, "path", { fill: "none", stroke: colour, "stroke-width": 2.2, "stroke-linejoin": "round" });
    const cursor = element(inside, "line", { y1: view.top, y2: base, stroke: INK, "stroke-width": 1, visibility: "hidden" });
    const peaks = element(svg, "g");
    element(svg, "text", { x: view.left + 2, y: 11, class: "strong" }, name);
    const read = element(svg, "text", { x: right, y: 11, "text-anchor": "end", class: "strong" });
    box.addEventListener("click", () => choose(v));
    listenForLines(svg);
    return { v, svg, area, curve, cursor, peaks, read };
  });
  buildChange(list.length % 3 && list.length < 6 ? node(place, "div", { class: "panel" }) : null);
}

// a pointer, or the arrow keys, read all panels at one engine speed
function listenForLines(svg) {
  svg.addEventListener("pointermove", (event) => {
    const box = svg.getBoundingClientRect();
    const part = ((event.clientX - box.left) * (view.width / box.width) - view.left) / (view.width - view.left - view.right);
    readAt(Math.min(F - 1, Math.max(0, nearestLine(speeds()[0] + part * (speeds()[F - 1] - speeds()[0])))));
  });
  svg.addEventListener("pointerleave", () => { if (!player.sources) readAt(null); });
  svg.addEventListener("keydown", (event) => {
    const at = session.line ?? 0, to = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: F - 1 }[event.key];
    if (to === undefined) return;
    event.preventDefault();
    readAt(Math.min(F - 1, Math.max(0, to)));
    const { v } = panels.find((panel) => panel.svg === svg);
    byId("live-announced").textContent = `${vehicles[v].name}: ${readingOf(v, session.line)}`;
  });
}

function nearestLine(rpm) {
  let best = 0;
  speeds().forEach((speed, f) => { if (Math.abs(speed - rpm) < Math.abs(speeds()[best] - rpm)) best = f; });
  return best;
}

function readingOf(v, line) {
  const at = v * F + line, { band } = session;
  const ends = band ? ` (${text(band.lower[at], 1)} to ${text(band.upper[at], 1)})` : "";
  return `${speedOf(line)}: ${text(now.spl[at], 1)}${ends}, today ${text(today.spl[at], 1)}`;
}

function readAt(line) {
  session.line = line;
  for (const { v, cursor, read } of panels) {
    cursor.setAttribute("visibility", line === null ? "hidden" : "visible");
    read.textContent = line === null ? "" : view.width > 240 ? readingOf(v, line) : `${text(now.spl[v * F + line], 1)}, was ${text(today.spl[v * F + line], 1)}`;
    if (line === null) continue;
    cursor.setAttribute("x1", xOf(speeds()[line]));
    cursor.setAttribute("x2", xOf(speeds()[line]));
  }
  if (!change) return;
  const at = session.chosen * F + (line ?? 0);
  change.read.textContent = line === null ? "" : `${speedOf(line)}: ${signed(now.spl[at] - today.spl[at], 1)}`;
}

// what the worker has answered; curves and peaks stand already
function drawBands() {
  for (const { v, area } of panels) {
    area.setAttribute("d", "M" + points(session.band.upper, v).concat(points(session.band.lower, v).reverse()).join("L") + "Z");
  }
  if (session.line !== null) readAt(session.line);
}

function drawCurves() {
  for (const { v, svg, curve, peaks } of panels) {
    curve.setAttribute("d", curveOf(now.spl, v));
    peaks.replaceChildren();
    const loudest = now.peaks[v].reduce((best, peak) => (best && best.level >= peak.level ? best : peak), null);
    for (const peak of now.peaks[v]) {
      const [x, y] = [xOf(speeds()[peak.line]), Math.max(yOf(peak.level), view.top + 4)];
      element(peaks, "path", { d: `M${x - 4},${y - 9}h8l-4,6z`, fill: vehicles[v].colour });
      if (peak !== loudest || session.line !== null) continue;
      const clear = Math.min(y, yOf(today.spl[v * F + peak.line])); // above both curves
      element(peaks, "text", { x: clear - 12 < 22 ? Math.max(x, view.left + 72) : x, y: Math.max(clear - 12, 11), "text-anchor": "middle", class: "strong" }, text(peak.level, 1));
    }
    const worst = now.loudest[v];
    svg.setAttribute("aria-label", `${vehicles[v].name}: loudest ${text(worst.level, 1)} dB(A) at ${speedOf(worst.line, worst.c)}, today ${text(today.loudest[v].level, 1)}; arrow keys read along the curve`);
  }
  drawChange();
  if (session.line !== null) readAt(session.line);
}

let change = null;
function buildChange(box) {
  change = null;
  if (!box) return;
  const svg = element(box, "svg", { viewBox: `0 0 ${view.width} ${view.height}`, height: view.height, role: "img" });
  const [right, base, reach] = [view.width - view.right, view.height - view.bottom, 10];
  const y = (dB) => view.top + ((reach - dB) / (2 * reach)) * (base - view.top);
  speedGrid(svg, base);
  for (const dB of [-10, -5, 0, 5]) {
    element(svg, "line", { x1: view.left, x2: right, y1: y(dB), y2: y(dB), stroke: dB ? FAINT : GREY });
    element(svg, "text", { x: view.left - 5, y: y(dB) + 4, "text-anchor": "end" }, signed(dB, 0));
  }
  const halves = [["louder", view.top, y(0) - view.top, "#a8321f"], ["quieter", y(0), base - y(0), "#0f6b45"]];
  const areas = halves.map(([name, top, height, fill]) => {
    element(element(svg, "clipPath", { id: `live-${name}` }), "rect", { x: view.left, width: right - view.left, y: top, height });
    return element(svg, "path", { "clip-path": `url(#live-${name})`, fill, opacity: 0.55 });
  });
  const words = element(svg, "text", { x: view.left + 2, y: 11, class: "strong" });
  const read = element(svg, "text", { x: right, y: 11, "text-anchor": "end", class: "strong" });
  listenForLines(svg);
  change = { svg, y, areas, words, read };
}

function drawChange() {
  if (!change) return;
  const at = session.chosen * F, curve = Array.from({ length: F }, (_, f) => `${xOf(speeds()[f]).toFixed(1)},${change.y(now.spl[at + f] - today.spl[at + f]).toFixed(1)}`);
  const d = `M${xOf(speeds()[0])},${change.y(0)}L${curve.join("L")}L${xOf(speeds()[F - 1])},${change.y(0)}Z`;
  change.areas.forEach((area) => area.setAttribute("d", d));
  change.words.textContent = `Change in ${vehicles[session.chosen].name}, dB`;
  change.svg.setAttribute("aria-label", `change of the level in ${vehicles[session.chosen].name} over engine speed`);
}

// ---- bars

const heardVariables = () => names.map((_, k) => k).filter((k) => !isSilent(k));
const pitchOf = (rows) => Math.max(11, Math.min(21, Math.floor(232 / rows)));

let reach = 0; // of the axis of ±10 %: it stays while bars move a little
function drawTornado() {
  const { steps } = session, place = byId("live-tornado");
  if (!steps) return;
  const list = shownVehicles(), mean = (change, k) => averaged(everyVehicle.map((v) => change[k * V + v]));
  const rows = heardVariables().filter((k) => (k >= N) === session.loss);
  byId("live-tornado-of").textContent = `dB, bars: mean of ${list.length}`;
  const width = Math.max(280, place.clientWidth), pitch = pitchOf(rows.length), height = pitch * rows.length + 16;
  const label = Math.min(110, 14 + 6.5 * Math.max(...rows.map((k) => names[k].length))), middle = label + 8 + (width - label - 54) / 2;
  const need = Math.max(1e-3, ...rows.flatMap((k) => list.flatMap((v) => [steps.softer[k * V + v], steps.stiffer[k * V + v]]).map(Math.abs)));
  if (need > reach || need < 0.45 * reach) reach = 1.15 * need;
  const scale = (width - label - 54) / 2 / reach, digits = reach < 0.05 ? 3 : 2;
  place.replaceChildren();
  const words = (k) => `${names[k]}: stiffer ${signed(mean(steps.stiffer, k), digits)} dB, softer ${signed(mean(steps.softer, k), digits)} dB`;
  const svg = element(place, "svg", { viewBox: `0 0 ${width} ${height}`, height, role: "img", "aria-label": rows.map(words).join("; ") });
  element(svg, "text", { x: middle - 6, y: 10, "text-anchor": "end" }, "◂ quieter");
  element(svg, "text", { x: middle + 6, y: 10 }, "louder ▸");
  rows.forEach((k, row) => {
    const y = 16 + pitch * row, half = pitch / 2 - 2, { colour } = mountOf(k);
    element(svg, "line", { x1: label, x2: width - 42, y1: y + pitch / 2, y2: y + pitch / 2, stroke: FAINT });
    element(svg, "text", { x: label - 6, y: y + pitch / 2 + 4, "text-anchor": "end", class: "strong" }, names[k]);
    for (const [change, fill, top] of [[steps.softer, "#fff", 1], [steps.stiffer, colour, half + 1]]) {
      const value = mean(change, k) * scale;
      title(element(svg, "rect", { x: middle + Math.min(0, value), width: Math.max(0.5, Math.abs(value)), y: y + top, height: half, fill, stroke: colour, "stroke-width": 1.2 }), words(k));
    }
    for (const v of list) {
      const chosen = v === session.chosen, value = steps.stiffer[k * V + v];
      title(element(svg, "circle", { cx: middle + value * scale, cy: y + half + 1 + half / 2, r: chosen ? 4 : 2.8, fill: chosen ? vehicles[v].colour : "#fff", stroke: vehicles[v].colour, "stroke-width": 1.4 }), `${vehicles[v].name}, ${names[k]} +10 %: ${signed(value, digits)} dB`);
    }
    element(svg, "text", { x: width, y: y + pitch / 2 + 4, "text-anchor": "end" }, signed(mean(steps.stiffer, k), digits));
  });
  element(svg, "line", { x1: middle, x2: middle, y1: 12, y2: height, stroke: GREY });
}

function drawPaths() {
  if (shownTab !== "paths") return;
  const place = byId("live-paths"), v = session.chosen, rows = heardVariables().filter((k) => k < N);
  const shareOf = (x) => model.contributions(x, session.shown, v, session.coupled).share;
  const [before, after] = [shareOf(model.ones), shareOf(session.x)];
  const width = Math.max(220, place.clientWidth), pitch = pitchOf(rows.length), height = pitch * rows.length + 16;
  const label = Math.min(110, 14 + 6.5 * Math.max(...rows.map((k) => names[k].length)));
  const low = Math.min(-5, ...rows.map((k) => 100 * Math.min(before[k], after[k]))), high = Math.max(...rows.map((k) => 100 * Math.max(before[k], after[k])));
  const xAt = (percent) => label + 8 + ((percent - low) / (high - low)) * (width - label - 42);
  place.replaceChildren();
  const svg = element(place, "svg", { viewBox: `0 0 ${width} ${height}`, height, role: "img", "aria-label": `Paths into ${vehicles[v].name}, share of the energy heard: ` + rows.map((k) => `${names[k]} ${text(100 * after[k], 0)} %`).join(", ") });
  element(svg, "text", { x: 0, y: 10 }, `${vehicles[v].name}, % of the energy heard`);
  element(svg, "text", { x: width, y: 10, "text-anchor": "end" }, "▏today");
  rows.forEach((k, row) => {
    const y = 16 + pitch * row, [from, to] = [xAt(0), xAt(100 * after[k])], old = xAt(100 * before[k]);
    element(svg, "text", { x: label - 6, y: y + pitch / 2 + 4, "text-anchor": "end", class: "strong" }, names[k]);
    title(element(svg, "rect", { x: Math.min(from, to), width: Math.max(0.5, Math.abs(to - from)), y: y + 3, height: pitch - 6, fill: mountOf(k).colour, opacity: 0.85 }), `${names[k]}: ${text(100 * after[k], 1)} % (today ${text(100 * before[k], 1)} %)${after[k] < 0 ? ", takes away from the others" : ""}`);
    element(svg, "line", { x1: old, x2: old, y1: y + 1, y2: y + pitch - 1, stroke: INK, "stroke-width": 2 });
    element(svg, "text", { x: width, y: y + pitch / 2 + 4, "text-anchor": "end" }, text(100 * after[k], 0));
  });
  element(svg, "line", { x1: xAt(0), x2: xAt(0), y1: 12, y2: height, stroke: GREY });
}

// ---- drawing

function facts() {
  const loadCase = cases[session.shown], counted = cases.filter((_, c) => session.caseWeights[c] > 0).length;
  const over = counted > 1 ? `, levels over ${counted} load cases` : session.caseWeights[session.shown] > 0 ? "" : ", which has no weight in the levels";
  byId("live-facts").textContent = `${loadCase.title}${over} · order ${loadCase.order}, ${data.frequency[0]} to ${data.frequency[F - 1]} Hz · parts within ±${Math.round(100 * data.tolerance)} %, ${data.nDraws} draws · sound: full scale ${data.fullScale.toPrecision(3)} Pa · computed in this page, offline${data.notes.vibration && ` · ${data.notes.vibration}`}`;
}

function drawAtOnce() {
  const started = performance.now();
  now = valued(session.x);
  if (session.band) session.band.fresh = false;
  const computed = performance.now();
  drawSliders();
  drawCards();
  drawCurves();
  drawTab();
  timing.curves.push(computed - started);
  timing.drawing.push(performance.now() - computed);
}

let later = 0;
function redraw() {
  drawAtOnce();
  worker.postMessage(question("band"));
  clearTimeout(later);
  later = setTimeout(() => player.follow(), 120);
}

function rebuild() {
  player.stop();
  setToday();
  select.value = session.shown;
  facts();
  buildChoices();
  buildSliders();
  buildCards();
  buildCurves();
  redraw();
}

byId("live").hidden = false;
remembered();
rebuild();
let roomNow = innerWidth;
addEventListener("resize", () => {
  if (innerWidth !== roomNow) rebuild();
  roomNow = innerWidth;
});
addEventListener("hashchange", () => {
  remembered();
  rebuild();
});
