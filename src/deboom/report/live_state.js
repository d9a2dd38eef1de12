// The live part: one design, computed here in every vehicle, beside today's. Everything that is shown
// follows from `session`; what takes longer than a frame comes from a worker that runs the same model.

const data = unpack(JSON.parse(byId("live-header").textContent), byId("live-numbers").textContent);
const { model, price } = prepared(data);
const { nLines: F, nVehicles: V, nStiffness: N, variables: names, vehicles, cases } = data;
const everyVehicle = vehicles.map((_, v) => v);
const groupNames = [...new Set(vehicles.map((vehicle) => vehicle.group))];
const nothing = (n, value) => new Float64Array(n).fill(value);
const nPrice = price ? data.price.names.length : 0;

const session = {
  x: Float64Array.from(data.starts.length ? data.starts[0].design : model.ones),
  coupled: data.motion === "coupled",
  shown: 0, // load case whose curves are shown
  group: groupNames[0],
  chosen: 0, // vehicle whose paths are shown
  line: null, // line that is read
  loss: false, // whether the sliders move loss factors
  caseWeights: Float64Array.from(cases, (loadCase) => loadCase.weight),
  vehicleWeights: Float64Array.from(data.vehicleWeights),
  limits: { mean: nothing(V, NaN), peak: nothing(V, Infinity), atLeast: nothing(nPrice, -Infinity), atMost: nothing(nPrice, Infinity) }, // NaN: today's
  lower: Float64Array.from(data.lower),
  upper: Float64Array.from(data.upper),
  sameAs: {}, // mount → mount whose part it shares
  pinned: [], // { name, design }
  band: null, // what the worker said last; `fresh` if of this design
  steps: null, // what ±10 % of each factor does
};
const undo = [], redo = []; // designs before this one, and those that were taken back
function leave(design) {
  undo.push(design);
  redo.length = 0;
}
let today = {}; // of the motion, load case and weights on show
let now = {};

// for a script that measures: what it reads and sets
const timing = { curves: [], drawing: [], band: [] };

const shownVehicles = () => everyVehicle.filter((v) => session.group === "all" || vehicles[v].group === session.group);
const mountOf = (k) => data.mounts.find((mount) => names[k % N].startsWith(mount.name + " "));
const axisOf = (k) => names[k % N].slice(mountOf(k).name.length + 1);
const isSilent = (k) => data.silent[k % N];
const share = (weights) => {
  const total = weights.reduce((a, b) => a + b, 0);
  return Array.from(weights, (weight) => weight / total);
};
const caseShares = () => share(session.caseWeights);
// weights of the vehicles on show; alike where all of them have weight 0
function countedWeights() {
  const list = shownVehicles(), none = list.every((v) => !session.vehicleWeights[v]);
  return Array.from(session.vehicleWeights, (weight, v) => (list.includes(v) ? (none ? 1 : weight) : 0));
}
const vehicleShares = () => share(countedWeights());
const meanLimits = () => session.limits.mean.map((limit, v) => (Number.isNaN(limit) ? today.band.mean[v] / F : limit));
const averaged = (values) => vehicleShares().reduce((sum, part, v) => sum + (part ? part * values[v] : 0), 0);

// ---- numbers of a design

function valued(x) {
  const weights = caseShares(), splv = new Float64Array(V);
  const loudest = everyVehicle.map(() => ({ level: -Infinity, line: 0, c: 0 }));
  let spl = null;
  cases.forEach((_, c) => {
    if (c !== session.shown && !weights[c]) return;
    const levels = model.levels(x, c, session.coupled);
    if (c === session.shown) spl = levels;
    if (!weights[c]) return;
    for (let v = 0; v < V; v++) {
      for (let f = 0; f < F; f++) {
        const level = levels[v * F + f];
        splv[v] += weights[c] * level;
        if (level > loudest[v].level) loudest[v] = { level, line: f, c };
      }
    }
  });
  const peaks = everyVehicle.map((v) => boomingPeaks(spl.subarray(v * F, (v + 1) * F)));
  return { spl, splv, loudest, peaks, price: price ? price(x) : null };
}

function setToday() {
  today = { ...valued(model.ones), band: model.band(model.ones, session.shown, caseShares(), session.coupled) };
  session.band = session.steps = null;
}

// numbers of a pinned design, over the draws
function summary(design) {
  const { mean, sigma } = model.band(Float64Array.from(design), session.shown, caseShares(), session.coupled);
  const { loudest } = valued(Float64Array.from(design));
  return { mean: mean.map((sum) => sum / F), sigma: sigma.map((sum) => sum / F), loudest };
}

// ---- designs

// factors that move together: those of one axis of mounts that share a part
function partnersOf(k) {
  const leader = (mount) => session.sameAs[mount] || mount;
  const first = leader(mountOf(k).name), kind = Math.floor(k / N);
  return names.map((_, j) => j).filter((j) => Math.floor(j / N) === kind && axisOf(j) === axisOf(k) && leader(mountOf(j).name) === first);
}

function groupsOfFactors() {
  const seen = new Set(), groups = [];
  names.forEach((_, k) => {
    if (seen.has(k)) return;
    const group = partnersOf(k);
    group.forEach((j) => seen.add(j));
    const heard = group.filter((j) => !isSilent(j));
    if (heard.length) groups.push(heard);
  });
  return groups;
}

function within(design) {
  return Float64Array.from(design, (xk, k) => Math.min(data.upper[k], Math.max(data.lower[k], Number.isFinite(xk) ? xk : 1)));
}

function moveTo(design) {
  leave(session.x);
  session.x = within(design);
  const beyond = names.filter((_, k) => Math.abs(session.x[k] - design[k]) > 1e-6);
  byId("live-said").textContent = beyond.length ? `Beyond the range of its slider, so set to its end: ${beyond.join(", ")}.` : "";
  remember();
  redraw();
  announce();
}

// ---- the state in words: in the address behind the #, and as a file that deboom takes back

const exact = (values) => Array.from(values, (value) => Number(value.toFixed(6)));
const everyFactor = Array.from(data.lower, (_, k) => k);
const factorName = (k) => (k < N ? names[k] : `loss factor of ${names[k % N]}`);
const chosenOnly = (values, labels, absent) => Object.fromEntries(labels.map((label, i) => [label, values[i]]).filter(([, value]) => !absent(value)));

function stated() {
  const { limits } = session, vehicleNames = vehicles.map((vehicle) => vehicle.name);
  const mounts = {};
  (price ? data.price.names : []).forEach((name, i) => {
    const ends = { ...(limits.atLeast[i] > -Infinity && { at_least: limits.atLeast[i] }), ...(limits.atMost[i] < Infinity && { at_most: limits.atMost[i] }) };
    if (Object.keys(ends).length) mounts[name] = ends;
  });
  return {
    format: 1, kind: "design of deboom", run: data.run, study: data.study,
    motion: session.coupled ? "coupled" : "prescribed", load_case: cases[session.shown].name, vehicles: session.group,
    variables: names, design: exact(session.x),
    pinned: session.pinned.map(({ name, design }) => ({ name, design: exact(design) })),
    limits: { mean: chosenOnly(limits.mean, vehicleNames, Number.isNaN), peak: chosenOnly(limits.peak, vehicleNames, (value) => value === Infinity), mounts },
    weights: { load_cases: Object.fromEntries(cases.map((loadCase, c) => [loadCase.name, session.caseWeights[c]])), vehicles: Object.fromEntries(vehicleNames.map((name, v) => [name, session.vehicleWeights[v]])) },
    ranges: Object.fromEntries(everyFactor.filter((k) => session.lower[k] > data.lower[k] || session.upper[k] < data.upper[k]).map((k) => [factorName(k), [session.lower[k], session.upper[k]]])),
    same_part: session.sameAs,
  };
}

const numbers = (into, table = {}, labels) => labels.forEach((label, i) => { if (Number.isFinite(table[label])) into[i] = table[label]; });

// limits as a state or the run states them; all others are none
function takeLimits({ mean, peak, mounts = {} }) {
  const vehicleNames = vehicles.map((vehicle) => vehicle.name);
  session.limits.mean.fill(NaN);
  session.limits.peak.fill(Infinity);
  numbers(session.limits.mean, mean, vehicleNames);
  numbers(session.limits.peak, peak, vehicleNames);
  (price ? data.price.names : []).forEach((name, i) => {
    const ends = mounts[name] || {};
    session.limits.atLeast[i] = Number.isFinite(ends.at_least) ? ends.at_least : -Infinity;
    session.limits.atMost[i] = Number.isFinite(ends.at_most) ? ends.at_most : Infinity;
  });
}

takeLimits(data.limits);
const { unjudged } = data.limits; // limits of the run that this page does not compute, in words

// take a state over; what belongs to other variables is refused with a sentence
function take(state) {
  if (!state || !Array.isArray(state.variables) || state.variables.join("|") !== names.join("|")) {
    return `These are designs of other variables; this page has ${names.join(", ")}.`;
  }
  const designs = [state.design, ...(state.pinned || []).map((pin) => pin.design)];
  if (designs.some((design) => !Array.isArray(design) || design.length !== model.K || !design.every(Number.isFinite))) return `A design of this page has ${model.K} numbers.`;
  const vehicleNames = vehicles.map((vehicle) => vehicle.name), { limits = {}, weights = {} } = state;
  if (data.motions.includes(state.motion)) session.coupled = state.motion === "coupled";
  session.shown = Math.max(0, cases.findIndex((loadCase) => loadCase.name === state.load_case));
  if (state.vehicles === "all" || groupNames.includes(state.vehicles)) session.group = state.vehicles;
  session.chosen = shownVehicles()[0];
  takeLimits(limits);
  everyFactor.forEach((k) => {
    const [low, high] = ((state.ranges || {})[factorName(k)] || []).map(Number);
    session.lower[k] = low > data.lower[k] && low <= data.upper[k] ? low : data.lower[k];
    session.upper[k] = high < data.upper[k] && high >= session.lower[k] ? high : data.upper[k];
  });
  const caseWeights = Float64Array.from(cases, (loadCase) => loadCase.weight);
  numbers(caseWeights, weights.load_cases, cases.map((loadCase) => loadCase.name));
  if (caseWeights.every((weight) => weight >= 0) && caseWeights.some((weight) => weight > 0)) session.caseWeights = caseWeights;
  const vehicleWeights = Float64Array.from(data.vehicleWeights);
  numbers(vehicleWeights, weights.vehicles, vehicleNames);
  if (vehicleWeights.every((weight) => weight >= 0)) session.vehicleWeights = vehicleWeights;
  session.sameAs = Object.fromEntries(Object.entries(state.same_part || {}).filter((pair) => pair.every((name) => data.mounts.some((mount) => mount.name === name))));
  session.pinned = (state.pinned || []).map(({ name, design }) => ({ name: String(name), design: within(design) }));
  session.x = within(state.design);
  return "";
}

function remember() {
  try {
    history.replaceState(null, "", "#live=" + encodeURIComponent(JSON.stringify(stated())));
  } catch { /* some viewers forbid it */ }
}

function remembered() {
  if (!location.hash.startsWith("#live=")) return;
  try {
    byId("live-said").textContent = take(JSON.parse(decodeURIComponent(location.hash.slice(6))));
  } catch {
    byId("live-said").textContent = "The address holds no design of this page.";
  }
}

// ---- the worker

let latest = 0;
const worker = startWorker((reply) => {
  if (reply.id !== latest) return;
  if (reply.wish === "improve") return arrive(reply);
  if (reply.wish === "steps") {
    session.steps = reply;
    return drawTornado();
  }
  timing.band.push(reply.ms);
  reply.fresh = true;
  // the same draw of today's parts and of these: what a car gains, part by part
  reply.below = everyVehicle.map((v) => {
    let count = 0;
    for (let t = 0; t < data.nDraws; t++) count += reply.splv[t * V + v] < today.band.splv[t * V + v];
    return count;
  });
  session.band = reply;
  drawBands();
  drawCards();
});

function startWorker(then) {
  const here = { postMessage: answering({ model, price, data }, then) };
  try {
    const made = new Worker(URL.createObjectURL(new Blob([byId("live-script").textContent], { type: "text/javascript" })));
    const target = { to: made };
    made.onmessage = ({ data: reply }) => then(reply);
    made.onerror = () => { target.to = here; redraw(); }; // viewers that forbid workers compute on this thread
    made.postMessage({ data });
    return { postMessage: (message) => target.to.postMessage(message) };
  } catch {
    return here;
  }
}

const question = (wish) => ({ wish, id: ++latest, x: session.x, shown: session.shown, weights: caseShares(), coupled: session.coupled });

// a vehicle that does not count keeps a limit that was stated, and no other
function heldMeans() {
  const counted = countedWeights();
  return meanLimits().map((limit, v) => (counted[v] || !Number.isNaN(session.limits.mean[v]) ? limit : Infinity));
}

function improve() {
  byId("live-said").textContent = "Searching …";
  worker.postMessage({
    ...question("improve"), objective: byId("live-objective").value, vehicleWeights: countedWeights(), groups: groupsOfFactors(),
    lower: session.lower, upper: session.upper, limits: { ...session.limits, mean: heldMeans(), held: everyVehicle.map((v) => shownVehicles().includes(v)) },
  });
}

// what a limit is of, in words
const limited = ({ of, at }) => (of === "price" ? data.price.names[at] : `${vehicles[at].name}’s ${of === "mean" ? "mean level" : "loudest line"}`);

// go along the steps of an improvement
function arrive(reply) {
  const what = byId("live-objective").value === "sigma" ? `${text(reply.gain, 2)} dB less scatter` : `${text(reply.gain, 2)} dB quieter`;
  const kept = reply.beyond <= 0.005 ? (unjudged.length ? `limits are kept except for ${unjudged.length} of the run that ${unjudged.length > 1 ? "are" : "is"} not judged here` : "all limits are kept") : `the limit of ${limited(reply.missed)} is still missed by ${text(reply.beyond, 2)} ${reply.missed.of === "price" ? data.price.units[reply.missed.at] : "dB"}`;
  byId("live-said").textContent = reply.trail.length && Math.abs(reply.gain) > 0.004
    ? `${what} on average over the parts made, ${kept}; ${reply.steps} steps in ${text(reply.ms / 1000, 1)} s.`
    : reply.trail.length ? `${kept[0].toUpperCase()}${kept.slice(1)} now; ${what}.` : `Nothing better near here: ${kept}.`;
  if (!reply.trail.length) return redraw();
  leave(session.x);
  const frames = matchMedia("(prefers-reduced-motion: reduce)").matches ? 1 : 30, wanted = latest;
  let frame = 0;
  (function next() {
    if (latest !== wanted) return; // the reader took a slider
    const at = Math.min(reply.trail.length, Math.ceil((++frame / frames) ** 2 * reply.trail.length)) - 1;
    session.x = Float64Array.from(reply.trail[Math.max(0, at)]);
    if (frame < frames) {
      drawAtOnce();
      requestAnimationFrame(next);
    } else {
      remember();
      redraw();
      announce();
    }
  })();
}
