// Runs of a results folder and searches as they grow. Texts come from files that anybody may have
// written: they enter the page as text, never as markup.

const POLL_MS = 3000;
const WIDTH = 440, HEIGHT = 300, LEFT = 78, BOTTOM = 44, TOP = 12, RIGHT = 14;
const chosen = new Set();
const when = run => run.started || run.name;
let runs = [];

async function fetched(path) {
  const answer = await fetch(path);
  if (!answer.ok) throw new Error((await answer.text()).trim());
  return answer.json();
}

// the front: sum of sigma over sum of the mean level, best below and to the left
function drawFront(block, front) {
  const picture = element(block, "svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img",
    "aria-label": `Front of ${front.length} designs so far` });
  const range = column => {
    const values = front.map(point => point[column]);
    const low = Math.min(...values), high = Math.max(...values), pad = 0.06 * (high - low) || 0.5;
    return [low - pad, high + pad];
  };
  const [x0, x1] = range(0), [y0, y1] = range(1);
  const x = value => LEFT + (WIDTH - LEFT - RIGHT) * (value - x0) / (x1 - x0);
  const y = value => HEIGHT - BOTTOM - (HEIGHT - BOTTOM - TOP) * (value - y0) / (y1 - y0);
  const along = ticks(x0, x1, 5), up = ticks(y0, y1, 5);
  for (const value of along.values) {
    element(picture, "line", { x1: x(value), x2: x(value), y1: TOP, y2: HEIGHT - BOTTOM, stroke: "#dfe3e8" });
    element(picture, "text", { x: x(value), y: HEIGHT - BOTTOM + 16, "text-anchor": "middle", "font-size": 11, fill: "#5f6b7a" }, value.toFixed(along.decimals));
  }
  for (const value of up.values) {
    element(picture, "line", { x1: LEFT, x2: WIDTH - RIGHT, y1: y(value), y2: y(value), stroke: "#dfe3e8" });
    element(picture, "text", { x: LEFT - 6, y: y(value) + 4, "text-anchor": "end", "font-size": 11, fill: "#5f6b7a" }, value.toFixed(up.decimals));
  }
  const title = { "text-anchor": "middle", "font-size": 12, fill: "#1f2933" };
  element(picture, "text", { x: (LEFT + WIDTH) / 2, y: HEIGHT - 8, ...title }, "Σ of mean levels over vehicles and lines [dB]");
  element(picture, "text", { transform: `translate(14 ${(HEIGHT - BOTTOM) / 2}) rotate(-90)`, ...title }, "Σ of their σ [dB]");
  for (const [mean, sigma] of front)
    element(picture, "circle", { cx: x(mean), cy: y(sigma), r: 3.5, fill: "#0b4f7d", "fill-opacity": 0.75 });
}

function addSearch(place, run, search) {
  const block = node(place, "div", { class: "search" });
  const of = search.planned ? ` of ${search.planned}` : "";
  if (search.problem) return node(block, "p", { class: "warnings" }, search.problem);
  node(block, "h3", {}, `${run.study}, ${search.name}: generation ${search.generation}${of}, ${search.evaluated} designs`);
  if (search.front.length) drawFront(block, search.front);
  else node(block, "p", {}, "No design keeps the limits yet.");
  const ends = node(block, "dl");
  for (const [pick, design] of Object.entries(search.ends)) {
    node(ends, "h4", {}, `${pick} so far, × today's stiffness`);
    for (const [name, factor] of Object.entries(design)) {
      const item = node(ends, "div");
      node(item, "dt", {}, name);
      node(item, "dd", {}, factor.toFixed(3));
    }
  }
}

async function showSearches() {
  const running = runs.filter(run => run.state === "running"), place = document.createDocumentFragment();
  for (const run of running) {
    const { searches } = await fetched(`/api/search?run=${encodeURIComponent(run.id)}`);
    for (const search of searches) addSearch(place, run, search);
    if (!searches.length) node(place, "p", {}, `${run.study}, ${when(run)}: no generation is complete yet.`);
  }
  byId("running").hidden = running.length === 0;
  byId("searches").replaceChildren(place);
}

function isWanted(run) {
  const state = byId("wanted").value, text = JSON.stringify([run.study, run.name, run.special, run.headlines, run.options]).toLowerCase();
  const words = byId("words").value.toLowerCase().split(/\s+/).filter(Boolean);
  return (!state || run.state === state) && words.every(word => text.includes(word));
}

function addRun(rows, run) {
  const row = node(rows, "tr");
  const box = node(node(row, "td"), "input", { type: "checkbox", "aria-label": `compare ${run.id}` });
  box.checked = chosen.has(run.id);
  box.addEventListener("change", () => {
    if (box.checked) chosen.add(run.id); else chosen.delete(run.id);
    showSideBySide();
  });
  node(row, "td", {}, run.study);
  node(row, "td", { class: "when" }, when(run));
  node(row, "td", {}, run.state);
  node(row, "td", {}, run.special);
  const numbers = node(row, "td", { class: "headlines" });
  for (const [label, value] of Object.entries(run.headlines).slice(0, 4)) {
    const line = node(numbers, "div");
    node(line, "b", {}, value);
    line.append(` ${label}`);
  }
  const links = node(row, "td", { class: "links" });
  for (const page of run.pages.slice(0, 8)) node(links, "a", { href: page.url }, page.title);
  node(links, "a", { href: run.files }, "files");
  if (run.picks.length)
    node(links, "code", {}, `sheet from a design: deboom report ${run.typed} --supplier --design ${run.picks[0]}`);
}

function showRuns() {
  const rows = byId("runs").tBodies[0];
  rows.replaceChildren();
  for (const run of runs.filter(isWanted)) addRun(rows, run);
}

// options and headlines in which the chosen runs differ
function showSideBySide() {
  const compared = runs.filter(run => chosen.has(run.id));
  byId("side").hidden = compared.length < 2;
  if (compared.length < 2) return;
  byId("command").textContent = `deboom compare ${compared.map(run => run.typed).join(" ")}`;
  const table = byId("differences"), rows = table.tBodies[0];
  table.tHead.replaceChildren();
  rows.replaceChildren();
  const head = node(table.tHead, "tr");
  node(head, "th");
  for (const run of compared) node(head, "th", { scope: "col" }, `${run.study}, ${when(run)}`);
  const facts = compared.map(run => ({ ...run.options, ...run.headlines }));
  for (const name of new Set(facts.flatMap(Object.keys))) {
    const values = facts.map(fact => fact[name] ?? "–");
    if (new Set(values).size === 1) continue;
    const row = node(rows, "tr");
    node(row, "th", { scope: "row" }, name);
    for (const value of values) node(row, "td", {}, value);
  }
}

async function refresh() {
  try {
    const content = await fetched("/api/runs");
    const before = JSON.stringify(runs);
    runs = content.runs.reverse();
    byId("problems").hidden = content.problems.length === 0;
    byId("problems").replaceChildren();
    for (const problem of content.problems) node(byId("problems"), "li", {}, problem);
    if (JSON.stringify(runs) !== before) { showRuns(); showSideBySide(); }
    await showSearches();
    byId("state").textContent = `${runs.length} runs; looked at ${new Date().toLocaleTimeString()}.`;
  } catch (error) {
    byId("state").textContent = `deboom serve does not answer: ${error.message}`;
  }
  setTimeout(refresh, POLL_MS);
}

byId("words").addEventListener("input", showRuns);
byId("wanted").addEventListener("change", showRuns);
byId("filter").addEventListener("submit", event => event.preventDefault());
refresh();
