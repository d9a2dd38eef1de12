// "Improve from here", and the worker that answers for the page. No page in here either.
//
// Steps of a trust region: objective and limits are made linear where the search stands, the small
// quadratic problem min g·d + |d|²/2h, A d ≤ room, |d_i| ≤ r is solved on its dual, one multiplier
// at a time (Hildreth 1957), and a step is taken only where it lowers objective plus what is beyond
// limits. The variables d are groups of factors: parts that share a stiffness move together.

const PENALTY = 20; // of one dB, mm or Hz beyond a limit, in dB of the objective
const SEARCH_DRAWS = 32; // draws behind σ on the way; all of them judge where it arrives
const MOST_STEPS = 100, ROUNDS = 4, MARGIN = 0.002; // of each limit [dB]

// wish: x, weights (of load cases), vehicleWeights, coupled, objective ("mean" or "sigma"), groups
// of factors, lower and upper of each factor, and limits: mean [v], peak [v] (Infinity: none), of
// vehicles that are held [v], atLeast and atMost of each number of the price (∓Infinity: none)
function improved(model, price, data, wish) {
  const F = data.nLines, { weights, coupled, limits } = wish, ofSigma = wish.objective === "sigma";
  const total = wish.vehicleWeights.reduce((a, b) => a + b, 0);
  const share = wish.vehicleWeights.map((weight) => weight / total);
  const summed = (values) => share.reduce((sum, part, v) => sum + (part ? part * values[v] : 0), 0);
  const noise = ofSigma ? null : model.scatterEnergy(model.ones, weights, coupled);
  const counted = weights.findIndex((weight) => weight > 0); // a load case that is computed anyway
  const judged = (x) => {
    const { mean, sigma } = model.band(x, counted, weights, coupled);
    return { mean: mean.map((sum) => sum / F), sigma: sigma.map((sum) => sum / F) };
  };
  const missed = (x, { mean }) => beyondLimits(mean, limits.mean, x).reduce((most, next) => (next.over > most.over ? next : most), { over: -Infinity });
  const value = (moments) => summed(ofSigma ? moments.sigma : moments.mean);

  // how far a design is beyond every limit, negative where room is left [dB, mm, Hz], and of what;
  // limits of a vehicle hold, of mean and peak alike, where the vehicle is held
  const held = (bounds, v) => limits.held[v] && Number.isFinite(bounds[v]);
  function beyondLimits(mean, meanLimits, x) {
    const beyond = [];
    meanLimits.forEach((limit, v) => held(meanLimits, v) && beyond.push({ over: mean[v] - limit, of: "mean", at: v }));
    if (limits.peak.some((_, v) => held(limits.peak, v))) {
      model.loudest(x, weights, coupled).forEach(({ level }, v) => held(limits.peak, v) && beyond.push({ over: level - limits.peak[v], of: "peak", at: v }));
    }
    if (price && [...limits.atLeast, ...limits.atMost].some(Number.isFinite)) {
      price(x).forEach((number, i) => {
        if (Number.isFinite(limits.atLeast[i])) beyond.push({ over: orBeyond(limits.atLeast[i] - number), of: "price", at: i });
        if (Number.isFinite(limits.atMost[i])) beyond.push({ over: orBeyond(number - limits.atMost[i]), of: "price", at: i });
      });
    }
    return beyond;
  }

  const expanded = (steps, from) => {
    const x = Float64Array.from(from);
    wish.groups.forEach((group, i) => group.forEach((k) => (x[k] = from[k] + steps[i])));
    return x;
  };
  const grouped = (by, at = 0) => Float64Array.from(wish.groups, (group) => group.reduce((sum, k) => sum + by[at + k], 0));

  // objective, limits and their slopes in the groups: rows with the room that is left
  function linearised(x, meanLimits) {
    const K = model.K;
    const { mean, meanBy, sigmaBy } = ofSigma
      ? model.momentGradients(x, weights, coupled, Math.min(SEARCH_DRAWS, data.nDraws))
      : (({ mean, by }) => ({ mean, meanBy: by }))(model.gradient(x, weights, coupled, noise));
    const slope = new Float64Array(wish.groups.length), rows = [];
    share.forEach((part, v) => {
      if (part) grouped(ofSigma ? sigmaBy : meanBy, v * K).forEach((by, i) => (slope[i] += part * by));
      if (held(meanLimits, v)) rows.push({ by: grouped(meanBy, v * K), room: meanLimits[v] - mean[v] });
    });
    if (limits.peak.some((_, v) => held(limits.peak, v))) {
      model.loudest(x, weights, coupled, true).forEach(({ level, by }, v) => {
        if (held(limits.peak, v)) rows.push({ by: grouped(by), room: limits.peak[v] - level });
      });
    }
    if (price && [...limits.atLeast, ...limits.atMost].some(Number.isFinite)) rows.push(...priceRows(x));
    return { slope, rows };
  }

  function priceRows(x) {
    const now = price(x), step = 1e-4, ahead = wish.groups.map((_, i) => {
      const d = new Float64Array(wish.groups.length);
      d[i] = step;
      return price(expanded(d, x));
    });
    const rows = [];
    now.forEach((number, i) => {
      const by = Float64Array.from(ahead, (moved) => (moved[i] - number) / step);
      if (Number.isFinite(limits.atMost[i])) rows.push({ by, room: limits.atMost[i] - number });
      if (Number.isFinite(limits.atLeast[i])) rows.push({ by: by.map((slopeBy) => -slopeBy), room: number - limits.atLeast[i] });
    });
    return rows.filter(({ by, room }) => Number.isFinite(room) && by.every(Number.isFinite));
  }

  function merit(x, meanLimits) {
    let moments;
    if (ofSigma) {
      const draws = Math.min(SEARCH_DRAWS, data.nDraws), level = new Float64Array(draws * data.nVehicles);
      for (let t = 0; t < draws; t++) level.set(model.splv(model.made(x, t), weights, coupled).map((sum) => sum / F), t * data.nVehicles);
      moments = momentsOf(level, data.nVehicles);
    } else moments = { mean: model.smoothed(x, weights, coupled, noise) };
    const beyond = beyondLimits(moments.mean, meanLimits, x).reduce((sum, { over }) => sum + Math.max(0, over), 0);
    return { value: value(moments) + PENALTY * beyond, mean: moments.mean };
  }

  // one step, or false where none is better
  function step(state) {
    const { slope, rows } = linearised(state.x, state.meanLimits);
    const largest = slope.reduce((most, by) => Math.max(most, Math.abs(by)), 1e-12);
    for (; state.radius > 1e-4; state.radius /= 2) {
      const d = quadraticStep(slope, rows, state.radius, (30 * state.radius) / largest, state.x, wish);
      const tried = expanded(d, state.x), after = merit(tried, state.meanLimits);
      if (!(after.value < state.value - 1e-5)) continue;
      Object.assign(state, { x: tried, gain: state.value - after.value, value: after.value, radius: Math.min(0.05, 1.5 * state.radius) });
      return true;
    }
    return false;
  }

  // Limits hold for the mean over the draws, steps know another one: the gap between both is taken
  // off the limits and found again where the steps arrive; the best point that keeps all limits wins.
  const trail = [], started = performance.now();
  let x = Float64Array.from(wish.x), moments = judged(x), steps = 0;
  const first = moments;
  let best = { x, moments, missed: missed(x, moments), at: 0 };
  for (let round = 0; round < ROUNDS; round++) {
    const { mean } = merit(x, limits.mean);
    const meanLimits = Float64Array.from(limits.mean, (limit, v) => limit - (moments.mean[v] - mean[v]) - MARGIN);
    const state = { x, meanLimits, radius: 0.03, value: merit(x, meanLimits).value };
    for (let k = 0; k < MOST_STEPS && step(state); k++) {
      trail.push(state.x);
      steps++;
      if (state.gain < 2e-4 && state.radius < 0.02) break;
    }
    x = state.x;
    moments = judged(x);
    const next = missed(x, moments), { over } = next;
    const better = over <= 0 ? best.missed.over > 0 || value(moments) < value(best.moments) - 1e-4 : over < best.missed.over - 1e-4;
    if (better) best = { x, moments, missed: next, at: trail.length };
    else if (round > 0) break;
  }
  return { trail: trail.slice(0, best.at), steps, ms: performance.now() - started, gain: value(first) - value(best.moments), beyond: best.missed.over, missed: best.missed };
}

const orBeyond = (over) => (Number.isNaN(over) ? 1 : over); // a curve that was not measured that far

function momentsOf(level, V) {
  const n = level.length / V, mean = new Float64Array(V), sigma = new Float64Array(V);
  for (let t = 0; t < n; t++) for (let v = 0; v < V; v++) mean[v] += level[t * V + v] / n;
  for (let t = 0; t < n; t++) for (let v = 0; v < V; v++) sigma[v] += (level[t * V + v] - mean[v]) ** 2 / (n - 1);
  return { mean, sigma: sigma.map(Math.sqrt) };
}

// min slope·d + |d|²/2h, by·d ≤ room, within the radius and the bounds of the factors
function quadraticStep(slope, rows, radius, h, x, { groups, lower, upper }) {
  const from = groups.map((group) => Math.max(-radius, ...group.map((k) => lower[k] - x[k])));
  const to = groups.map((group) => Math.min(radius, ...group.map((k) => upper[k] - x[k])));
  const rooms = rows.map(({ by, room }) => Math.max(room, -0.5 * radius * by.reduce((sum, slopeBy) => sum + Math.abs(slopeBy), 0)));
  const multiplier = new Float64Array(rows.length), d = new Float64Array(slope.length);
  const refresh = () => slope.forEach((by, i) => {
    let sum = by;
    for (let r = 0; r < rows.length; r++) sum += multiplier[r] * rows[r].by[i];
    d[i] = Math.min(Math.max(to[i], 0), Math.max(Math.min(from[i], 0), -h * sum)); // the box is separable: cut exactly
  });
  refresh();
  for (let sweep = 0; sweep < 60; sweep++) {
    let moved = 0;
    rows.forEach(({ by }, r) => {
      let over = -rooms[r], size = 0;
      by.forEach((slopeBy, i) => {
        over += slopeBy * d[i];
        size += slopeBy * slopeBy;
      });
      const next = Math.max(0, multiplier[r] + over / (h * size + 1e-300));
      moved = Math.max(moved, Math.abs(next - multiplier[r]) * h);
      multiplier[r] = next;
      refresh();
    });
    if (moved < 1e-9) break;
  }
  return d;
}

// ---- the worker: band, then ±10 % of a design, or an improvement; the newest design replaces older ones

function bandOf({ model }, { id, x, shown, weights, coupled }) {
  const started = performance.now(), band = model.band(x, shown, weights, coupled);
  return { wish: "band", id, ...band, ms: performance.now() - started };
}

function stepsOf({ model }, { id, x, weights, coupled }) {
  const [softer, stiffer] = model.steps(x, weights, coupled);
  return { wish: "steps", id, softer, stiffer };
}

function improvementOf({ model, price, data }, message) {
  return { wish: "improve", id: message.id, ...improved(model, price, data, message) };
}

function prepared(data) {
  return { data, model: makeModel(data), price: makePrice(data) };
}

// answer messages one after the other, with room between for a newer one: `say` gets the answers
function answering(parts, say) {
  let waiting = null, busy = false;
  function next() {
    busy = waiting !== null;
    if (!busy) return;
    const message = waiting;
    waiting = null;
    if (message.wish === "improve") say(improvementOf(parts, message));
    else say(message.wish === "steps" ? stepsOf(parts, message) : bandOf(parts, message));
    if (message.wish === "band" && !waiting) waiting = { ...message, wish: "steps" };
    setTimeout(next);
  }
  return (message) => {
    waiting = message;
    if (!busy) setTimeout(next);
    busy = true;
  };
}

if (typeof document === "undefined" && typeof importScripts === "function") {
  let answer = null;
  onmessage = ({ data: message }) => {
    if (message.data) answer = answering(prepared(message.data), postMessage);
    else answer(message);
  };
}
