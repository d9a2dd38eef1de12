// What hands move: sliders, cards with limits, tabs, buttons.

// choices of which one is taken
function choices(place, options, chosen, then) {
  byId(place).querySelectorAll("label").forEach((label) => label.remove());
  for (const [value, words, title] of options) {
    const label = node(byId(place), "label", { title: title || "" });
    const input = node(label, "input", { type: "radio", name: place, value });
    input.checked = value === chosen;
    input.addEventListener("change", () => then(value));
    node(label, "span", {}, words);
  }
}

function buildChoices() {
  byId("live-title").textContent = data.title;
  byId("live-groups").hidden = groupNames.length < 2;
  const groups = [...groupNames.map((name) => [name, name]), ["all", `all ${V}`]];
  choices("live-groups", groups, session.group, (value) => {
    session.group = value;
    if (!shownVehicles().includes(session.chosen)) session.chosen = shownVehicles()[0];
    rebuild();
  });
  byId("live-motion").hidden = data.motions.length < 2;
  const motions = { coupled: ["solved again", "Coupled motion: powertrain and wheel ends answer the new stiffnesses"], prescribed: ["as measured", "Prescribed motion: it stays as measured, forces grow with the stiffness"] };
  choices("live-motion", data.motions.map((name) => [name, ...motions[name]]), session.coupled ? "coupled" : "prescribed", (value) => {
    session.coupled = value === "coupled";
    rebuild();
  });
  byId("live-kind").hidden = !data.lossFactors;
  choices("live-kind", [["stiffness", "stiffness"], ["loss", "loss"]], session.loss ? "loss" : "stiffness", (value) => {
    session.loss = value === "loss";
    buildSliders();
    drawSliders();
  });
  choices("live-tab", [["paths", "Paths"], ["price", "Mounts"], ["weights", "Limits, weights"], ["pins", "Pinned"]], shownTab, showTab);
}

const select = byId("live-case");
cases.forEach((loadCase, c) => node(select, "option", { value: c }, loadCase.title));
select.parentElement.hidden = cases.length < 2;
select.addEventListener("change", () => {
  session.shown = Number(select.value);
  rebuild();
});

// ---- where to start

const start = byId("live-start");
function fillStarts() {
  start.replaceChildren();
  node(start, "option", { value: "" }, "…");
  node(start, "option", { value: "today" }, "today’s mounts");
  data.starts.forEach((design, at) => node(start, "option", { value: at }, design.name));
  if (typeof front !== "undefined") {
    front.points.forEach((point, design) => { if (!front.picks[design]) node(start, "option", { value: `front ${design}` }, nameOf(design)); });
  }
}
start.addEventListener("change", () => {
  const { value } = start;
  if (value === "today") moveTo(model.ones);
  else if (value.startsWith("front ")) moveTo(ofFront(Number(value.slice(6))));
  else if (value !== "") moveTo(data.starts[Number(value)].design);
  start.value = "";
});
// a design of the front below, or today's
const ofFront = (design) => names.map((name) => {
  const axis = axes.find((entry) => entry.name === name);
  return axis ? valueOf(axis, design) : 1;
});

// ---- sliders

let rows = [];
function buildSliders() {
  const place = byId("live-sliders");
  place.replaceChildren();
  rows = [];
  const room = Math.floor((430 - 30 * data.mounts.length) / (N - data.silent.filter(Boolean).length));
  place.style.setProperty("--row", `${Math.max(20, Math.min(30, room))}px`);
  for (const mount of data.mounts) {
    const box = node(place, "div", { class: "mount", style: `border-color:${mount.colour}` });
    const head = node(box, "h3", { title: mount.words }, mount.name + " ");
    node(head, "small", {}, mount.words);
    const quiet = [];
    for (let at = 0; at < N; at++) {
      const k = session.loss ? N + at : at;
      if (mountOf(k) !== mount) continue;
      if (isSilent(k)) {
        quiet.push(axisOf(k));
        continue;
      }
      const row = node(box, "div", { class: "row", style: `--tint:${mount.colour}` });
      node(row, "b", {}, axisOf(k));
      const track = node(row, "div", { class: "track" });
      const place100 = (x) => `calc(8px + ${(x - data.lower[k]) / (data.upper[k] - data.lower[k])} * (100% - 16px))`;
      node(track, "i", { style: `left:${place100(1)}` });
      const reach = node(track, "u");
      const input = node(track, "input", { type: "range", min: data.lower[k], max: data.upper[k], step: 0.005, "aria-label": `${session.loss ? "loss factor" : "stiffness"} of ${names[k % N]}` });
      const output = node(row, "output");
      input.addEventListener("input", () => slide(k, Math.abs(input.value - 1) < 0.0024 ? 1 : Number(input.value), input));
      input.addEventListener("change", () => {
        input.holding = false;
        remember();
        announce();
      });
      track.addEventListener("dblclick", () => moveTo(session.x.map((xk, j) => (partnersOf(k).includes(j) ? 1 : xk))));
      rows.push({ k, row, input, output, reach, place100 });
    }
    if (quiet.length) node(node(box, "div", { class: "row silent" }), "span", {}, `${quiet.join(", ")} ${quiet.length > 1 ? "reach" : "reaches"} no ear`);
  }
}

function slide(k, factor, input) {
  if (!input.holding) leave(session.x);
  input.holding = true;
  byId("live-said").textContent = "";
  session.x = session.x.map((xk, j) => (partnersOf(k).includes(j) ? factor : xk));
  redraw();
}

const threeDigits = (value) => value.toFixed(Math.max(0, 2 - Math.floor(Math.log10(value))));

function drawSliders() {
  for (const { k, row, input, output, reach, place100 } of rows) {
    const factor = session.x[k], newtons = k < N ? data.newtons[k] : null, percent = 100 * (factor - 1), moved = Math.abs(percent) > 0.05;
    if (Number(input.value) !== factor) input.value = factor;
    row.classList.toggle("moved", moved);
    output.textContent = newtons === null ? (k < N ? "" : `× ${factor.toFixed(3)} `) : `${threeDigits(newtons * factor)} N/mm `;
    node(output, "small", {}, moved ? signed(percent, Math.abs(percent) < 9.95 ? 1 : 0) + " %" : "today");
    input.setAttribute("aria-valuetext", output.textContent);
    const narrowed = session.lower[k] > data.lower[k] || session.upper[k] < data.upper[k];
    reach.style.cssText = narrowed ? `left:${place100(session.lower[k])};right:calc(100% - ${place100(session.upper[k])})` : "display:none";
  }
  byId("live-back").disabled = undo.length === 0;
  byId("live-again").disabled = redo.length === 0;
}

// ---- a card of each vehicle

let cards = [];
function numberInput(place, label, value, then) {
  const input = node(place, "input", { type: "number", step: 0.1, "aria-label": label });
  input.value = value;
  input.addEventListener("change", () => then(input.value === "" ? null : Number(input.value), input));
  return input;
}

function buildCards() {
  const place = byId("live-cards"), list = shownVehicles();
  place.replaceChildren();
  place.classList.toggle("many", list.length > 6);
  cards = list.map((v) => {
    const { name, colour } = vehicles[v];
    const card = node(place, "div", { class: "card", style: `border-top-color:${colour}` });
    const top = node(card, "div", { class: "top" });
    const button = node(top, "button", { type: "button", class: "name", title: `paths into ${name}` }, name);
    button.addEventListener("click", () => choose(v));
    const change = node(top, "span", { class: "change" });
    const level = node(card, "p"), peak = node(card, "p", { class: "wide" }), builds = node(card, "p", { class: "wide muted" });
    const foot = node(card, "div", { class: "foot" });
    const play = ["today", "now"].map((which) => {
      const button = node(foot, "button", { type: "button", "aria-label": `hear the run-up of ${name}, ${which}`, title: `run-up, ${which}; switches over while it plays` }, `▶ ${which}`);
      button.addEventListener("click", () => player.press(v, which));
      return button;
    });
    const label = node(foot, "label", { title: "limit of the mean level over the parts made, which an improvement keeps [dB(A)]" }, "≤ ");
    const limit = numberInput(label, `limit of the mean level of ${name} in dB(A)`, "", (value) => {
      session.limits.mean[v] = value ?? NaN;
      remember();
      drawCards();
    });
    return { v, card, button, change, level, peak, builds, play, limit };
  });
}

const speedOf = (line, c = session.shown) => `${Math.round(cases[c].speed[line])}/min`;
const changeClass = (value) => (Math.abs(value) < 0.05 ? "" : value < 0 ? "quieter" : "louder");

function changes() {
  const { band } = session;
  return shownVehicles().map((v) => {
    const before = today.band.mean[v] / F;
    const after = band && band.fresh ? band.mean[v] / F : before + (now.splv[v] - today.splv[v]) / F; // until the worker has answered
    return { v, before, after, delta: after - before };
  });
}

function drawCards() {
  const { band } = session, limits = meanLimits(), list = changes();
  cards.forEach(({ v, card, button, change, level, peak, builds, limit }, at) => {
    const { before, after, delta } = list[at];
    change.className = "change " + changeClass(delta);
    change.textContent = signed(delta, 1);
    node(change, "small", {}, " dB");
    level.textContent = `${text(before, 1)} → ${text(after, 1)}${band ? ` ± ${text((1.96 * band.sigma[v]) / F, 1)}` : ""} dB(A)`;
    const [old, worst] = [today.loudest[v], now.loudest[v]];
    const where = worst.c === session.shown ? "" : `, ${cases[worst.c].title}`;
    peak.textContent = `peak ${text(old.level, 1)} → ${text(worst.level, 1)} at ${speedOf(worst.line, worst.c)}${where}`;
    peak.title = peak.textContent;
    peak.classList.toggle("louder", worst.level > session.limits.peak[v] + 0.005);
    if (band) {
      const count = band.below[v], percent = Math.min(99, Math.max(1, Math.round((100 * count) / data.nDraws)));
      builds.textContent = delta === 0 ? "the parts of today" : count === data.nDraws ? "every car made is quieter" : count ? `${percent} % of cars made are quieter` : "no car made is quieter";
    }
    card.classList.toggle("chosen", v === session.chosen);
    card.classList.toggle("beyond", after > limits[v] + 0.005);
    button.setAttribute("aria-pressed", v === session.chosen);
    if (document.activeElement !== limit) limit.value = limits[v].toFixed(1);
  });
  byId("live-verdict").textContent = verdict(list);
}

function verdict(list) {
  const sorted = list.map(({ v, delta }) => ({ name: vehicles[v].name, delta })).sort((a, b) => a.delta - b.delta), many = sorted.length;
  const louder = sorted.filter(({ delta }) => delta >= 0.05), [best, last] = [sorted[0], sorted[many - 1]];
  if (Math.max(-best.delta, last.delta) < 0.05) return many > 1 ? `As today in all ${many} vehicles` : `As today in ${best.name}`;
  const mean = averaged(everyVehicle.map((v) => list.find((change) => change.v === v)?.delta ?? 0));
  const { band } = session;
  const sigma = band && band.fresh ? `, σ ${signed((100 * averaged(band.sigma)) / averaged(today.band.sigma) - 100, 0)} %` : "";
  const range = many > 1 ? `${signed(best.delta, 1)} dB (${best.name}) to ${signed(last.delta, 1)} dB (${last.name}), mean ${signed(mean, 2)} dB${sigma}` : `${best.name} ${signed(best.delta, 1)} dB${sigma}`;
  return louder.length ? `${louder.length} of ${many} vehicles louder than today: ${range}` : `No vehicle louder than today: ${range}`;
}

// for those who do not see it: what came out, when a slider is let go
function announce() {
  byId("live-announced").textContent = verdict(changes());
}

function choose(v) {
  session.chosen = v;
  drawCards();
  drawCurves();
  drawPaths();
}

// ---- tabs

let shownTab = "paths";
function showTab(name) {
  shownTab = name;
  for (const tab of ["paths", "price", "weights", "pins"]) byId(`live-${tab}`).hidden = tab !== name;
  drawTab();
}

function drawTab() {
  ({ paths: drawPaths, price: drawPrice, weights: drawWeights, pins: drawPins })[shownTab]();
}

function head(place, words) {
  place.replaceChildren();
  const table = node(place, "table"), row = node(node(table, "thead"), "tr");
  for (const [name, unit] of words) {
    const cell = node(row, "th", { scope: "col" }, name);
    if (unit) node(cell, "span", { class: "unit" }, `[${unit}]`);
  }
  return node(table, "tbody");
}

// limits of the run that stand in no table: nobody may take them for kept
function addUnjudged(place) {
  for (const limit of unjudged) node(place, "p", { class: "muted" }, `Not judged here: ${limit}.`);
}

function noted(place, words) {
  place.replaceChildren();
  node(place, "p", { class: "muted" }, words);
}

// sag, travel and modes with limits
function drawPrice() {
  const place = byId("live-price");
  if (!price) {
    noted(place, data.notes.price);
    return addUnjudged(place);
  }
  if (place.contains(document.activeElement) && document.activeElement !== place) return fillPrice();
  const body = head(place, [["", ""], ["today"], ["now"], ["at least"], ["at most"]]);
  data.price.names.forEach((name, i) => {
    const row = node(body, "tr", { "data-row": i });
    node(row, "th", { scope: "row" }, `${name} [${data.price.units[i]}]`);
    node(row, "td");
    node(row, "td");
    for (const [end, none, words] of [["atLeast", -Infinity, "least"], ["atMost", Infinity, "most"]]) {
      const value = session.limits[end][i];
      numberInput(node(row, "td"), `at ${words}: ${name} in ${data.price.units[i]}`, Number.isFinite(value) ? value : "", (limit) => {
        session.limits[end][i] = limit ?? none;
        remember();
        fillPrice();
      });
    }
  });
  addUnjudged(place);
  fillPrice();
}

function fillPrice() {
  for (const row of byId("live-price").querySelectorAll("tr[data-row]")) {
    const i = Number(row.dataset.row), cells = row.children;
    const words = (value) => (Number.isNaN(value) ? "beyond its curve" : text(value, 2));
    cells[1].textContent = words(today.price[i]);
    cells[2].textContent = words(now.price[i]);
    const beyond = !(now.price[i] >= session.limits.atLeast[i] - 1e-9 && now.price[i] <= session.limits.atMost[i] + 1e-9);
    cells[2].className = beyond ? "louder" : "";
  }
}

// limits of peaks, weights of vehicles and load cases, parts that share a stiffness
function drawWeights() {
  const place = byId("live-weights");
  if (place.contains(document.activeElement) && document.activeElement !== place) return;
  const body = head(place, [["vehicle"], ["peak at most", "dB(A)"], ["weight", "1"]]);
  for (const v of shownVehicles()) {
    const row = node(body, "tr"), { name } = vehicles[v], { peak } = session.limits;
    node(row, "th", { scope: "row" }, name);
    numberInput(node(row, "td"), `peak of ${name} at most, in dB(A)`, Number.isFinite(peak[v]) ? peak[v] : "", (value) => {
      peak[v] = value ?? Infinity;
      remember();
      drawCards();
    });
    numberInput(node(row, "td"), `weight of ${name}`, session.vehicleWeights[v], (value, input) => weigh(session.vehicleWeights, v, value, input, shownVehicles()));
  }
  if (cases.length > 1) {
    cases.forEach((loadCase, c) => {
      const row = node(body, "tr");
      node(row, "th", { scope: "row", colspan: 2 }, loadCase.title);
      numberInput(node(row, "td"), `weight of the load case ${loadCase.title}`, session.caseWeights[c], (value, input) => weigh(session.caseWeights, c, value, input, cases.map((_, at) => at)));
    });
  }
  if (data.notes.cases) node(node(body, "tr"), "td", { class: "word muted", colspan: 3 }, data.notes.cases);
  for (const mount of data.mounts) {
    const row = node(body, "tr");
    node(row, "th", { scope: "row" }, mount.name);
    const cell = node(row, "td", { colspan: 2 }), list = node(cell, "select", { "aria-label": `mount whose part ${mount.name} shares` });
    node(list, "option", { value: "" }, "part of its own");
    const others = data.mounts.filter((other) => other !== mount && !session.sameAs[other.name]);
    for (const other of others) node(list, "option", { value: other.name }, `same part as ${other.name}`);
    list.value = session.sameAs[mount.name] || "";
    list.addEventListener("change", () => {
      delete session.sameAs[mount.name];
      if (list.value) session.sameAs[mount.name] = list.value;
      list.blur();
      const leader = list.value || mount.name;
      moveTo(session.x.map((xk, k) => {
        const twin = mountOf(k) === mount ? names.findIndex((name, j) => Math.floor(j / N) === Math.floor(k / N) && mountOf(j).name === leader && axisOf(j) === axisOf(k)) : k;
        return twin < 0 ? xk : session.x[twin];
      }));
    });
  }
  addUnjudged(place);
}

function weigh(weights, at, value, input, counted) {
  const before = weights[at];
  weights[at] = value ?? 0;
  if (!(weights[at] >= 0) || !counted.some((place) => weights[place] > 0)) {
    weights[at] = before;
    input.value = before;
    byId("live-said").textContent = "A weight is 0 or more, and one of them is above 0.";
    return;
  }
  remember();
  setToday();
  redraw();
}

// pinned designs, each with its numbers over the draws
function drawPins() {
  const place = byId("live-pins"), list = shownVehicles();
  if (!session.pinned.length) return noted(place, "“Pin” keeps a design here, with its numbers, in the address and in the saved file.");
  const body = head(place, [["design"], ["mean", "dB"], ["σ", "%"], ["loudest peak", "dB(A)"], ...list.map((v) => [vehicles[v].name, "dB"]), [""]]);
  session.pinned.forEach((pin, at) => {
    const { mean, sigma, loudest } = pinNumbers(pin), delta = mean.map((level, v) => level - today.band.mean[v] / F);
    const row = node(body, "tr");
    const load = node(node(row, "th", { scope: "row" }), "button", { type: "button", title: "go on from this design" }, pin.name);
    load.addEventListener("click", () => moveTo(pin.design));
    node(row, "td", {}, signed(averaged(delta), 2));
    node(row, "td", {}, signed((100 * averaged(sigma)) / (averaged(today.band.sigma) / F) - 100, 0));
    node(row, "td", {}, text(Math.max(...list.map((v) => loudest[v].level)), 1));
    for (const v of list) node(row, "td", { class: changeClass(delta[v]) }, signed(delta[v], 1));
    const away = node(node(row, "td"), "button", { type: "button", "aria-label": `take ${pin.name} away` }, "×");
    away.addEventListener("click", () => {
      session.pinned.splice(at, 1);
      remember();
      drawPins();
    });
  });
}

// kept until motion, load case or weights change
function pinNumbers(pin) {
  const key = JSON.stringify([session.coupled, session.shown, caseShares()]);
  if (pin.key !== key) Object.assign(pin, { key, numbers: summary(pin.design) });
  return pin.numbers;
}

// ---- buttons

byId("live-improve").addEventListener("click", improve);
byId("live-today").addEventListener("click", () => moveTo(model.ones));
function step(from, to) {
  if (!from.length) return;
  to.push(session.x);
  session.x = from.pop();
  remember();
  redraw();
  announce();
}
byId("live-back").addEventListener("click", () => step(undo, redo));
byId("live-again").addEventListener("click", () => step(redo, undo));
document.addEventListener("keydown", (event) => {
  const writes = event.target.matches("input:not([type=range]), textarea"); // has an undo of its own
  if (!(event.ctrlKey || event.metaKey) || event.altKey || writes || byId("live").hidden) return;
  const key = event.key.toLowerCase(), again = key === "y" || (key === "z" && event.shiftKey);
  if (key !== "z" && key !== "y") return;
  event.preventDefault();
  if (again) step(redo, undo);
  else step(undo, redo);
});
byId("live-pin").addEventListener("click", () => {
  const taken = new Set(session.pinned.map((pin) => pin.name));
  let number = 1;
  while (taken.has(`P${number}`)) number++;
  session.pinned.push({ name: `P${number}`, design: session.x });
  remember();
  shownTab = "pins";
  buildChoices();
  showTab("pins");
  byId("live-said").textContent = `Pinned as P${number}.`;
});
byId("live-save").addEventListener("click", () => {
  const name = `${data.run.replace(/[^\w.-]+/g, "-")}_design.json`;
  download(name, "application/json", [JSON.stringify(stated(), null, 1) + "\n"]);
  const further = `: deboom run ${data.study} --begin ${name}, or deboom report RUN --supplier --design ${name}`;
  byId("live-said").textContent = `Saved as ${name}${data.starts.length ? further : ""}.`; // an experiment has no front
});
byId("live-open").addEventListener("click", () => byId("live-file").click());
byId("live-file").addEventListener("change", async () => {
  const [file] = byId("live-file").files;
  byId("live-file").value = "";
  if (!file) return;
  const before = session.x;
  let said;
  try {
    said = take(JSON.parse(await file.text()));
  } catch {
    said = `${file.name} is no saved design.`;
  }
  if (said) {
    byId("live-said").textContent = said;
    return;
  }
  leave(before);
  remember();
  rebuild();
  byId("live-said").textContent = `${file.name} is open.`;
});
