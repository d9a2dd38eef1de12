"use strict";
// The booming model of deboom in plain arithmetic on typed arrays: pressure at the ears, levels,
// scatter, derivatives, sag, travel, modes and sound of any design. It knows no page: the page, its
// worker, node and the tests run this same text.
//
// A design x holds one factor of stiffness per variable, then, where there are any, one factor y of
// loss per variable: K_s = x_k K'_s + j x_k y_k K''_s for every spring s of variable k.
//
//   coupled      (Σ_s K_s v_s v_sᵀ − ω² M) q = F,  u_s = v_sᵀ q,  force_s = K_s u_s
//   wheel end    u = L / (K − ω² m)
//   flexible     (diag(1/K) + Y_source + Y_body) force = u_free, in every vehicle by itself
//   prescribed   u_s stays what it is at x = 1
//   all          p_v = Σ_path Y_v,path Σ_{s on path} force_s,  level = 10 lg |p|² + offset
//
// Arrays are laid out with the line outermost, so that what one line needs lies together.

const TEN = 10 / Math.LN10; // decibels of a factor e of an energy
const NEPER = 20 / Math.LN10; // decibels of a factor e of a pressure
const HELD_BACK = 0.025; // share of the parts made below the band, and above it
const GROUP = 8; // lines whose energies are multiplied before a logarithm is taken

// ---- data: names and sizes as JSON, numbers as one base64 block of little-endian float64

function unpack(header, block) {
  const text = atob(block.trim()), bytes = new Uint8Array(text.length);
  for (let at = 0; at < text.length; at++) bytes[at] = text.charCodeAt(at);
  const numbers = new Float64Array(bytes.buffer), data = { ...header };
  let at = 0;
  for (const [name, length] of header.arrays) data[name] = numbers.subarray(at, (at += length));
  return data;
}

function makeModel(data) {
  const { nLines: F, nVehicles: V, nStiffness: N, nSprings: S, nPaths: P, nDraws: T } = data;
  const { springVariable, springPath, pathVariable, pathLossy } = data;
  const { frequency, offset, draws, sigma } = data;
  const K = data.lossFactors ? 2 * N : N; // length of a design
  const E = data.nEnds, B = S - E; // wheel ends; springs of the powertrain come first
  const D = 6 + E; // loads of a line: six of the powertrain, one of each wheel end
  const springs = S > 0, flexible = data.nPerches > 0;
  const ones = new Float64Array(K).fill(1);
  const cases = data.cases.map((words, c) => ({
    ...words,
    kRe: data[`kRe${c}`], kIm: data[`kIm${c}`], loadRe: data[`loadRe${c}`], loadIm: data[`loadIm${c}`],
    yRe: data[springs ? "yRe" : `yRe${c}`], yIm: data[springs ? "yIm" : `yIm${c}`],
    heldRe: new Float64Array(F * P), heldIm: new Float64Array(F * P), // forces of the paths at x = 1 [N]
  }));
  const totalOffset = offset.reduce((a, b) => a + b, 0); // of all lines [dB]
  const squaredOf = (line) => (2 * Math.PI * frequency[line]) ** 2;

  // ---- one line: stiffnesses, then the powertrain's motion

  const sRe = new Float64Array(S), sIm = new Float64Array(S); // stiffness of each spring [N/m]
  const uRe = new Float64Array(S), uIm = new Float64Array(S); // displacement of each spring [m]
  const fRe = new Float64Array(P), fIm = new Float64Array(P); // force of each path [N]
  const zRe = new Float64Array(36), zIm = new Float64Array(36); // U above, L below the diagonal
  const dRe = new Float64Array(6), dIm = new Float64Array(6); // inverse pivots
  const qRe = new Float64Array(6), qIm = new Float64Array(6);
  const endRe = new Float64Array(E), endIm = new Float64Array(E); // inverse impedance of wheel ends
  let pRe = 0, pIm = 0; // pressure that `hear` has written [Pa]

  // v vᵀ of each spring of the powertrain, upper triangle by rows
  const { mass, endMass, forward } = data;
  const UPPER = [];
  for (let i = 0; i < 6; i++) for (let j = i; j < 6; j++) UPPER.push(6 * i + j);
  const outer = new Float64Array(21 * B);
  for (let s = 0; s < B; s++) {
    UPPER.forEach((at, e) => (outer[21 * s + e] = forward[6 * s + Math.floor(at / 6)] * forward[6 * s + (at % 6)]));
  }

  function scaleSprings(x, c, line) {
    const { kRe, kIm } = cases[c], first = line * S;
    for (let s = 0; s < S; s++) {
      const k = springVariable[s], factor = x[k];
      sRe[s] = factor * kRe[first + s];
      sIm[s] = (data.lossFactors ? factor * x[N + k] : factor) * kIm[first + s];
    }
  }

  // Z = L U of the symmetric impedance, without pivoting: a damped body on mounts has no small pivot
  function factorise(line) {
    const squared = squaredOf(line);
    for (let e = 0; e < 21; e++) {
      const at = UPPER[e];
      let re = -squared * mass[at], im = 0;
      for (let s = 0; s < B; s++) {
        re += sRe[s] * outer[21 * s + e];
        im += sIm[s] * outer[21 * s + e];
      }
      zRe[at] = re;
      zIm[at] = im;
    }
    for (let j = 0; j < 6; j++) {
      const a = zRe[7 * j], b = zIm[7 * j], size = 1 / (a * a + b * b);
      const r = (dRe[j] = a * size), i0 = (dIm[j] = -b * size);
      for (let i = j + 1; i < 6; i++) {
        const ur = zRe[6 * j + i], ui = zIm[6 * j + i];
        const lr = ur * r - ui * i0, li = ur * i0 + ui * r;
        zRe[6 * i + j] = lr;
        zIm[6 * i + j] = li;
        for (let k = i; k < 6; k++) {
          const wr = zRe[6 * j + k], wi = zIm[6 * j + k];
          zRe[6 * i + k] -= lr * wr - li * wi;
          zIm[6 * i + k] -= lr * wi + li * wr;
        }
      }
    }
    for (let e = 0; e < E; e++) {
      const a = sRe[B + e] - squared * endMass[e], b = sIm[B + e], size = 1 / (a * a + b * b);
      endRe[e] = a * size;
      endIm[e] = -b * size;
    }
  }

  // Z q = (re, im), in place
  function solve(re, im) {
    for (let j = 0; j < 5; j++) {
      const a = re[j], b = im[j];
      for (let i = j + 1; i < 6; i++) {
        const lr = zRe[6 * i + j], li = zIm[6 * i + j];
        re[i] -= lr * a - li * b;
        im[i] -= lr * b + li * a;
      }
    }
    for (let i = 5; i >= 0; i--) {
      let a = re[i], b = im[i];
      for (let k = i + 1; k < 6; k++) {
        const ur = zRe[6 * i + k], ui = zIm[6 * i + k];
        a -= ur * re[k] - ui * im[k];
        b -= ur * im[k] + ui * re[k];
      }
      re[i] = a * dRe[i] - b * dIm[i];
      im[i] = a * dIm[i] + b * dRe[i];
    }
  }

  function displace(c, line) {
    factorise(line);
    const { loadRe, loadIm } = cases[c], first = line * D;
    for (let i = 0; i < 6; i++) {
      qRe[i] = loadRe[first + i];
      qIm[i] = loadIm[first + i];
    }
    solve(qRe, qIm);
    for (let s = 0; s < B; s++) {
      let a = 0, b = 0;
      for (let i = 0; i < 6; i++) {
        a += forward[6 * s + i] * qRe[i];
        b += forward[6 * s + i] * qIm[i];
      }
      uRe[s] = a;
      uIm[s] = b;
    }
    for (let e = 0; e < E; e++) {
      const a = loadRe[first + 6 + e], b = loadIm[first + 6 + e];
      uRe[B + e] = a * endRe[e] - b * endIm[e];
      uIm[B + e] = a * endIm[e] + b * endRe[e];
    }
  }

  function pushPaths() {
    fRe.fill(0);
    fIm.fill(0);
    for (let s = 0; s < S; s++) {
      const p = springPath[s];
      if (p < 0) continue;
      fRe[p] += sRe[s] * uRe[s] - sIm[s] * uIm[s];
      fIm[p] += sRe[s] * uIm[s] + sIm[s] * uRe[s];
    }
  }

  // ---- bodies that give way: springs between two receptances

  const { nPerches: G, perch, receptanceRe, receptanceIm } = data; // springs on one perch share a point
  const PAIRS = (G * (G + 1)) / 2;
  const pairOf = (i, j) => (i <= j ? i * G - (i * (i - 1)) / 2 + j - i : j * G - (j * (j - 1)) / 2 + i - j);
  const A = flexible ? S : 0;
  const aRe = new Float64Array(A * A), aIm = new Float64Array(A * A);
  const gRe = new Float64Array(A), gIm = new Float64Array(A), tRe = new Float64Array(Math.max(A, 6)), tIm = new Float64Array(Math.max(A, 6));
  const source = new Float64Array(A * A); // V M⁻¹ Vᵀ of powertrain and wheel ends [1/kg]
  const pairs = new Int32Array(A * A);
  if (flexible) {
    const perMass = Array.from({ length: B }, (_, s) => solvedReal(mass, forward.subarray(6 * s, 6 * s + 6)));
    for (let i = 0; i < S; i++) {
      for (let j = 0; j < S; j++) {
        pairs[i * S + j] = pairOf(perch[i], perch[j]);
        if (i < B && j < B) for (let n = 0; n < 6; n++) source[i * S + j] += forward[6 * i + n] * perMass[j][n];
        if (i === j && i >= B) source[i * S + j] = 1 / endMass[i - B];
      }
    }
    for (const loadCase of cases) { // displacement at the springs under the loads, without springs [m]
      loadCase.freeRe = new Float64Array(F * S);
      loadCase.freeIm = new Float64Array(F * S);
      for (let line = 0; line < F; line++) {
        const squared = squaredOf(line), first = line * D;
        for (let s = 0; s < S; s++) {
          let a = 0, b = 0;
          if (s < B) {
            for (let i = 0; i < 6; i++) {
              a += perMass[s][i] * loadCase.loadRe[first + i];
              b += perMass[s][i] * loadCase.loadIm[first + i];
            }
          } else {
            a = loadCase.loadRe[first + 6 + s - B] / endMass[s - B];
            b = loadCase.loadIm[first + 6 + s - B] / endMass[s - B];
          }
          loadCase.freeRe[line * S + s] = -a / squared;
          loadCase.freeIm[line * S + s] = -b / squared;
        }
      }
    }
  }

  // A = L D Lᵀ of diag(1/K) + Y_source + Y_body, lower triangle, inverse pivots on the diagonal
  function factoriseJoined(line, v) {
    const inverse = -1 / squaredOf(line), first = (line * V + v) * PAIRS;
    for (let i = 0; i < S; i++) {
      for (let j = 0; j <= i; j++) {
        aRe[i * S + j] = inverse * source[i * S + j] + receptanceRe[first + pairs[i * S + j]];
        aIm[i * S + j] = receptanceIm[first + pairs[i * S + j]];
      }
      const size = 1 / (sRe[i] * sRe[i] + sIm[i] * sIm[i]);
      aRe[i * S + i] += sRe[i] * size;
      aIm[i * S + i] -= sIm[i] * size;
    }
    for (let j = 0; j < S; j++) {
      const a = aRe[j * S + j], b = aIm[j * S + j], size = 1 / (a * a + b * b);
      const r = (aRe[j * S + j] = a * size), m = (aIm[j * S + j] = -b * size);
      for (let i = j + 1; i < S; i++) {
        const cr = aRe[i * S + j], ci = aIm[i * S + j], lr = cr * r - ci * m, li = cr * m + ci * r;
        for (let k = j + 1; k <= i; k++) {
          const wr = aRe[k * S + j], wi = aIm[k * S + j];
          aRe[i * S + k] -= lr * wr - li * wi;
          aIm[i * S + k] -= lr * wi + li * wr;
        }
      }
      for (let i = j + 1; i < S; i++) {
        const cr = aRe[i * S + j], ci = aIm[i * S + j];
        aRe[i * S + j] = cr * r - ci * m;
        aIm[i * S + j] = cr * m + ci * r;
      }
    }
  }

  function solveJoined(re, im) {
    for (let i = 1; i < S; i++) {
      let a = re[i], b = im[i];
      for (let j = 0; j < i; j++) {
        const lr = aRe[i * S + j], li = aIm[i * S + j];
        a -= lr * re[j] - li * im[j];
        b -= lr * im[j] + li * re[j];
      }
      re[i] = a;
      im[i] = b;
    }
    for (let i = S - 1; i >= 0; i--) {
      const r = aRe[i * S + i], m = aIm[i * S + i];
      let a = re[i] * r - im[i] * m, b = re[i] * m + im[i] * r;
      for (let j = i + 1; j < S; j++) {
        const lr = aRe[j * S + i], li = aIm[j * S + i];
        a -= lr * re[j] - li * im[j];
        b -= lr * im[j] + li * re[j];
      }
      re[i] = a;
      im[i] = b;
    }
  }

  // ---- one line of one load case: `move`, then `hear` in each vehicle

  function move(x, c, line, coupled) {
    if (springs && coupled) {
      scaleSprings(x, c, line);
      if (flexible) return;
      displace(c, line);
      pushPaths();
      return;
    }
    const { heldRe, heldIm } = cases[c];
    for (let p = 0; p < P; p++) {
      const k = pathVariable[p], factor = pathLossy[p] ? x[k] * x[N + k] : x[k];
      fRe[p] = springs ? factor * heldRe[line * P + p] : factor;
      fIm[p] = springs ? factor * heldIm[line * P + p] : 0;
    }
  }

  function hear(c, line, v, coupled) {
    if (flexible && coupled) {
      const { freeRe, freeIm } = cases[c];
      factoriseJoined(line, v);
      for (let s = 0; s < S; s++) {
        gRe[s] = freeRe[line * S + s];
        gIm[s] = freeIm[line * S + s];
      }
      solveJoined(gRe, gIm);
      fRe.fill(0);
      fIm.fill(0);
      for (let s = 0; s < S; s++) {
        if (springPath[s] < 0) continue;
        fRe[springPath[s]] += gRe[s];
        fIm[springPath[s]] += gIm[s];
      }
    }
    const { yRe, yIm } = cases[c];
    let a = 0, b = 0;
    for (let p = 0, at = (line * V + v) * P; p < P; p++, at++) {
      a += yRe[at] * fRe[p] - yIm[at] * fIm[p];
      b += yRe[at] * fIm[p] + yIm[at] * fRe[p];
    }
    pRe = a;
    pIm = b;
  }

  if (springs) { // forces that prescribed motion scales: a body at rest, all factors 1
    cases.forEach((loadCase, c) => {
      for (let line = 0; line < F; line++) {
        scaleSprings(ones, c, line);
        displace(c, line);
        pushPaths();
        loadCase.heldRe.set(fRe, line * P);
        loadCase.heldIm.set(fIm, line * P);
      }
    });
  }

  // ---- designs

  // complex pressure at the ears in one load case, [vehicle][line] [Pa]
  function pressure(x, c, coupled) {
    const re = new Float64Array(V * F), im = new Float64Array(V * F);
    for (let line = 0; line < F; line++) {
      move(x, c, line, coupled);
      for (let v = 0; v < V; v++) {
        hear(c, line, v, coupled);
        re[v * F + line] = pRe;
        im[v * F + line] = pIm;
      }
    }
    return { re, im };
  }

  // sound pressure level in one load case, [vehicle][line] [dB(A)]
  function levels(x, c, coupled) {
    const { re, im } = pressure(x, c, coupled);
    return re.map((a, at) => TEN * Math.log(a * a + im[at] * im[at]) + offset[at % F]);
  }

  // SPLV of each vehicle, Σ_c w_c Σ_f level [dB(A)]; weights of the load cases add up to 1
  function splv(x, weights, coupled) {
    const sum = new Float64Array(V), product = new Float64Array(V);
    weights.forEach((weight, c) => {
      if (!weight) return;
      product.fill(1);
      for (let line = 0; line < F; line++) {
        move(x, c, line, coupled);
        for (let v = 0; v < V; v++) {
          hear(c, line, v, coupled);
          product[v] *= pRe * pRe + pIm * pIm;
        }
        if ((line + 1) % GROUP === 0 || line + 1 === F) {
          for (let v = 0; v < V; v++) sum[v] += weight * TEN * Math.log(product[v]);
          product.fill(1);
        }
      }
    });
    return sum.map((level) => level + totalOffset);
  }

  // a design as it is made in draw t: x (1 + σ z)
  function made(x, t) {
    return x.map((xk, k) => xk * (1 + sigma[k] * draws[t * K + k]));
  }

  // What scatter does: ends of the band of 95 % of the parts, line by line, in the load case that is
  // shown; mean and standard deviation of SPLV over all load cases that count. Of the energies of a
  // line only the few lowest and highest are kept, sorted: the ends need no more, and one logarithm
  // each, between which np.quantile interpolates.
  const lowAt = HELD_BACK * (T - 1), keep = Math.floor(lowAt) + 2, part = lowAt - Math.floor(lowAt);
  const product = new Float64Array(T * V);
  const least = new Float64Array(V * keep), most = new Float64Array(V * keep);
  const between = (ends, v) => {
    const at = v * keep + keep - 2;
    return TEN * ((1 - part) * Math.log(ends[at]) + part * Math.log(ends[at + 1]));
  };
  function band(x, shown, weights, coupled) {
    const lower = new Float64Array(V * F), upper = new Float64Array(V * F), sums = new Float64Array(T * V);
    const rows = Array.from({ length: T }, (_, t) => made(x, t));
    cases.forEach((_, c) => {
      if (c !== shown && !weights[c]) return;
      product.fill(1);
      for (let line = 0; line < F; line++) {
        least.fill(Infinity);
        most.fill(-Infinity);
        for (let t = 0; t < T; t++) {
          move(rows[t], c, line, coupled);
          for (let v = 0; v < V; v++) {
            hear(c, line, v, coupled);
            const energy = pRe * pRe + pIm * pIm;
            product[t * V + v] *= energy;
            if (c === shown) keepEnds(v, energy);
          }
        }
        if (c === shown) {
          for (let v = 0; v < V; v++) {
            lower[v * F + line] = between(least, v) + offset[line];
            upper[v * F + line] = between(most, v) + offset[line];
          }
        }
        if ((line + 1) % GROUP === 0 || line + 1 === F) {
          if (weights[c]) for (let at = 0; at < T * V; at++) sums[at] += weights[c] * TEN * Math.log(product[at]);
          product.fill(1);
        }
      }
    });
    return { lower, upper, splv: sums.map((sum) => sum + totalOffset), ...moments(sums) };
  }

  function keepEnds(v, energy) {
    const first = v * keep, last = first + keep - 1;
    if (energy < least[last]) {
      let at = last;
      for (; at > first && least[at - 1] > energy; at--) least[at] = least[at - 1];
      least[at] = energy;
    }
    if (energy > most[last]) {
      let at = last;
      for (; at > first && most[at - 1] < energy; at--) most[at] = most[at - 1];
      most[at] = energy;
    }
  }

  // mean and standard deviation of each vehicle over draws [t][v], without the offsets of the lines
  function moments(sums) {
    const mean = new Float64Array(V), deviation = new Float64Array(V), n = sums.length / V;
    for (let v = 0; v < V; v++) {
      let sum = 0, squares = 0;
      for (let t = 0; t < n; t++) sum += sums[t * V + v];
      const middle = sum / n;
      for (let t = 0; t < n; t++) squares += (sums[t * V + v] - middle) ** 2;
      mean[v] = middle + totalOffset;
      deviation[v] = Math.sqrt(squares / (n - 1));
    }
    return { mean, sigma: deviation };
  }

  // ---- derivatives, by the adjoint: Z and A are symmetric

  const slopeRe = new Float64Array(V * K), slopeIm = new Float64Array(V * K);
  const earRe = new Float64Array(V), earIm = new Float64Array(V);

  // add ∂p/∂K_s = (a + jb) of a spring to those by its factors: ∂K/∂x = K' + j y K'', ∂K/∂y = j x K''
  function addSpring(x, c, line, v, s, a, b) {
    const k = springVariable[s], at = line * S + s, re = cases[c].kRe[at], im = cases[c].kIm[at];
    const loss = data.lossFactors ? x[N + k] * im : im;
    slopeRe[v * K + k] += re * a - loss * b;
    slopeIm[v * K + k] += re * b + loss * a;
    if (!data.lossFactors) return;
    slopeRe[v * K + N + k] -= x[k] * im * b;
    slopeIm[v * K + N + k] += x[k] * im * a;
  }

  // ∂p_v/∂x_k of one line into (slopeRe, slopeIm)[v][k], the pressures into (earRe, earIm)[v]
  function slopes(x, c, line, coupled) {
    const { yRe, yIm, heldRe, heldIm } = cases[c];
    move(x, c, line, coupled);
    slopeRe.fill(0);
    slopeIm.fill(0);
    for (let v = 0; v < V; v++) {
      const ear = (line * V + v) * P;
      hear(c, line, v, coupled);
      earRe[v] = pRe;
      earIm[v] = pIm;
      if (!(springs && coupled)) {
        for (let p = 0; p < P; p++) {
          const a = springs ? heldRe[line * P + p] : 1, b = springs ? heldIm[line * P + p] : 0, k = pathVariable[p];
          const re = yRe[ear + p] * a - yIm[ear + p] * b, im = yRe[ear + p] * b + yIm[ear + p] * a;
          const by = pathLossy[p] ? x[N + k] : 1;
          slopeRe[v * K + k] += by * re;
          slopeIm[v * K + k] += by * im;
          if (!pathLossy[p]) continue;
          slopeRe[v * K + N + k] += x[k] * re;
          slopeIm[v * K + N + k] += x[k] * im;
        }
        continue;
      }
      if (flexible) { // A t = Y, ∂p/∂K_s = t_s g_s / K_s²
        for (let s = 0; s < S; s++) {
          tRe[s] = springPath[s] < 0 ? 0 : yRe[ear + springPath[s]];
          tIm[s] = springPath[s] < 0 ? 0 : yIm[ear + springPath[s]];
        }
        solveJoined(tRe, tIm);
        for (let s = 0; s < S; s++) {
          const size = 1 / (sRe[s] * sRe[s] + sIm[s] * sIm[s]), cr = sRe[s] * size, ci = -sIm[s] * size;
          const a = tRe[s] * gRe[s] - tIm[s] * gIm[s], b = tRe[s] * gIm[s] + tIm[s] * gRe[s];
          const d = a * cr - b * ci, e = a * ci + b * cr;
          addSpring(x, c, line, v, s, d * cr - e * ci, d * ci + e * cr);
        }
        continue;
      }
      tRe.fill(0); // Z t = Σ_s K_s Y_s v_s, ∂p/∂K_s = u_s (Y_s − v_sᵀ t)
      tIm.fill(0);
      for (let s = 0; s < B; s++) {
        if (springPath[s] < 0) continue;
        const yr = yRe[ear + springPath[s]], yi = yIm[ear + springPath[s]];
        const a = sRe[s] * yr - sIm[s] * yi, b = sRe[s] * yi + sIm[s] * yr;
        for (let i = 0; i < 6; i++) {
          tRe[i] += forward[6 * s + i] * a;
          tIm[i] += forward[6 * s + i] * b;
        }
      }
      solve(tRe, tIm);
      for (let s = 0; s < S; s++) {
        const heard = springPath[s] >= 0;
        let a = heard ? yRe[ear + springPath[s]] : 0, b = heard ? yIm[ear + springPath[s]] : 0;
        if (s < B) {
          for (let i = 0; i < 6; i++) {
            a -= forward[6 * s + i] * tRe[i];
            b -= forward[6 * s + i] * tIm[i];
          }
        } else { // Y − K Y / Z
          const wr = sRe[s] * a - sIm[s] * b, wi = sRe[s] * b + sIm[s] * a;
          a -= wr * endRe[s - B] - wi * endIm[s - B];
          b -= wr * endIm[s - B] + wi * endRe[s - B];
        }
        addSpring(x, c, line, v, s, uRe[s] * a - uIm[s] * b, uRe[s] * b + uIm[s] * a);
      }
    }
  }

  // Mean level of the lines over the load cases that count, and its derivatives, [v] and [v][k].
  // `noise` [case][v][line] is an energy added to each line: that of scatter keeps a search out of
  // notches, where all paths cancel in one line as they do in no part that is made. Null: none.
  function gradient(x, weights, coupled, noise = null) {
    const mean = new Float64Array(V), by = new Float64Array(V * K);
    weights.forEach((weight, c) => {
      if (!weight) return;
      for (let line = 0; line < F; line++) {
        slopes(x, c, line, coupled);
        for (let v = 0; v < V; v++) {
          const energy = earRe[v] ** 2 + earIm[v] ** 2 + (noise ? noise[c][v * F + line] : 0);
          mean[v] += (weight * (TEN * Math.log(energy) + offset[line])) / F;
          const a = (weight * NEPER * earRe[v]) / energy / F, b = (weight * NEPER * earIm[v]) / energy / F;
          for (let k = 0, at = v * K; k < K; k++, at++) by[at] += a * slopeRe[at] + b * slopeIm[at];
        }
      }
    });
    return { mean, by };
  }

  // the mean levels of `gradient` alone
  function smoothed(x, weights, coupled, noise) {
    const mean = new Float64Array(V);
    weights.forEach((weight, c) => {
      if (!weight) return;
      for (let line = 0; line < F; line++) {
        move(x, c, line, coupled);
        for (let v = 0; v < V; v++) {
          hear(c, line, v, coupled);
          mean[v] += (weight * (TEN * Math.log(pRe * pRe + pIm * pIm + noise[c][v * F + line]) + offset[line])) / F;
        }
      }
    });
    return mean;
  }

  // energy of the scatter to first order, Σ_k |σ_k x_k ∂p/∂x_k|², [case][v][line] [Pa²]
  function scatterEnergy(x, weights, coupled) {
    return cases.map((_, c) => {
      const energy = new Float64Array(V * F);
      for (let line = 0; weights[c] && line < F; line++) {
        slopes(x, c, line, coupled);
        for (let v = 0; v < V; v++) {
          for (let k = 0; k < K; k++) {
            const size = sigma[k] * x[k];
            energy[v * F + line] += size * size * (slopeRe[v * K + k] ** 2 + slopeIm[v * K + k] ** 2);
          }
        }
      }
      return energy;
    });
  }

  // Mean and standard deviation of the mean level over the first `n` draws, and their derivatives:
  // ∂mean/∂x_k = Σ_t (1 + σ_k z_tk) ∂L_t/∂x_k / n, ∂σ/∂x_k = Σ_t (L_t − mean) (…) / (n − 1) / σ.
  function momentGradients(x, weights, coupled, n = T) {
    const level = new Float64Array(n * V), slope = [];
    for (let t = 0; t < n; t++) {
      const { mean, by } = gradient(made(x, t), weights, coupled);
      level.set(mean, t * V);
      slope.push(by.map((value, at) => value * (1 + sigma[at % K] * draws[t * K + (at % K)])));
    }
    const mean = new Float64Array(V), deviation = new Float64Array(V);
    const meanBy = new Float64Array(V * K), deviationBy = new Float64Array(V * K);
    for (let v = 0; v < V; v++) {
      for (let t = 0; t < n; t++) mean[v] += level[t * V + v] / n;
      for (let t = 0; t < n; t++) deviation[v] += (level[t * V + v] - mean[v]) ** 2 / (n - 1);
      deviation[v] = Math.sqrt(deviation[v]);
      for (let t = 0; t < n; t++) {
        const share = (level[t * V + v] - mean[v]) / (n - 1) / (deviation[v] || 1);
        for (let k = 0; k < K; k++) {
          meanBy[v * K + k] += slope[t][v * K + k] / n;
          deviationBy[v * K + k] += share * slope[t][v * K + k];
        }
      }
    }
    return { mean, meanBy, sigma: deviation, sigmaBy: deviationBy };
  }

  // Loudest line of each vehicle over the load cases that count, [v]: level, its case and line, and
  // with `slopesToo` its derivatives [k]
  function loudest(x, weights, coupled, slopesToo = false) {
    const best = Array.from({ length: V }, () => ({ level: -Infinity, c: 0, line: 0, by: null }));
    weights.forEach((weight, c) => {
      if (!weight) return;
      for (let line = 0; line < F; line++) {
        move(x, c, line, coupled);
        for (let v = 0; v < V; v++) {
          hear(c, line, v, coupled);
          const level = TEN * Math.log(pRe * pRe + pIm * pIm) + offset[line];
          if (level > best[v].level) best[v] = { level, c, line, by: null };
        }
      }
    });
    if (slopesToo) {
      best.forEach((peak, v) => {
        slopes(x, peak.c, peak.line, coupled);
        const size = NEPER / (earRe[v] ** 2 + earIm[v] ** 2);
        peak.by = Float64Array.from({ length: K }, (_, k) => size * (earRe[v] * slopeRe[v * K + k] + earIm[v] * slopeIm[v * K + k]));
      });
    }
    return best;
  }

  // Change of each vehicle's mean level when one factor moves by ∓10 %: the whole step, no slope.
  // Two arrays [k][v] [dB], softer and stiffer
  function steps(x, weights, coupled, step = 0.1) {
    const now = splv(x, weights, coupled);
    return [-step, step].map((by) => {
      const change = new Float64Array(K * V), moved = Float64Array.from(x);
      for (let k = 0; k < K; k++) {
        if (data.silent[k % N]) continue;
        moved[k] = x[k] * (1 + by);
        splv(moved, weights, coupled).forEach((sum, v) => (change[k * V + v] = (sum - now[v]) / F));
        moved[k] = x[k];
      }
      return change;
    });
  }

  // Size [Pa] and share of the energy [1] of each variable's paths at one ear, lines as they are heard
  function contributions(x, c, v, coupled) {
    const size = new Float64Array(N), along = new Float64Array(N), { yRe, yIm } = cases[c];
    let whole = 0;
    for (let line = 0; line < F; line++) {
      move(x, c, line, coupled);
      hear(c, line, v, coupled);
      const weight = data.energyWeight[line], ear = (line * V + v) * P;
      const re = new Float64Array(N), im = new Float64Array(N);
      for (let p = 0; p < P; p++) {
        re[pathVariable[p]] += yRe[ear + p] * fRe[p] - yIm[ear + p] * fIm[p];
        im[pathVariable[p]] += yRe[ear + p] * fIm[p] + yIm[ear + p] * fRe[p];
      }
      whole += weight * (pRe * pRe + pIm * pIm);
      for (let k = 0; k < N; k++) {
        size[k] += weight * (re[k] * re[k] + im[k] * im[k]);
        along[k] += weight * (re[k] * pRe + im[k] * pIm);
      }
    }
    return { rms: size.map((energy) => Math.sqrt(energy / F)), share: along.map((energy) => energy / whole) };
  }

  return {
    K, ones, cases, pressure, levels, splv, made, band, gradient, smoothed, scatterEnergy, momentGradients,
    loudest, steps, contributions,
  };
}

// ---- booming peaks: local maxima that stand out by their topographic prominence [dB]

function boomingPeaks(curve, prominence = 6) {
  const peaks = [];
  for (let i = 1; i < curve.length - 1; i++) {
    if (!(curve[i - 1] < curve[i])) continue;
    let end = i;
    while (end < curve.length - 1 && curve[end + 1] === curve[i]) end++;
    if (end === curve.length - 1 || !(curve[end + 1] < curve[i])) continue;
    const at = (i + end) >> 1;
    let left = curve[at], right = curve[at];
    for (let k = at; k >= 0 && curve[k] <= curve[at]; k--) left = Math.min(left, curve[k]);
    for (let k = at; k < curve.length && curve[k] <= curve[at]; k++) right = Math.min(right, curve[k]);
    const rise = curve[at] - Math.max(left, right);
    if (rise >= prominence) peaks.push({ line: at, level: curve[at], prominence: rise });
  }
  return peaks;
}

// ---- what mounts pay for being quiet: sag, travel, modes

// Numbers of a design in the order of `data.price.names`: sag [mm], travel [mm], modes [Hz]. NaN where
// a static curve was not measured that far. Loss factors have no part in it.
function makePrice(data) {
  const { price } = data;
  if (!price) return null;
  const { variables, sagRows, travelColumns } = price; // variable of each direction (mount, piece, axis)
  const { priceForward: forward, priceMass: mass, priceStiffness: stiffness } = data;
  const n = variables.length;
  const curves = (price.curves || []).map((words, c) => ({ ...words, at: data[`curveAt${c}`], by: data[`curveBy${c}`] }));
  const factorsOf = (x) => variables.map((k) => (k < 0 ? 1 : x[k]));

  // Vᵀ diag(k) V
  function stiffnessMatrix(k) {
    const matrix = new Float64Array(36);
    for (let s = 0; s < n; s++) {
      for (let i = 0; i < 6; i++) for (let j = 0; j < 6; j++) matrix[6 * i + j] += k[s] * forward[6 * s + i] * forward[6 * s + j];
    }
    return matrix;
  }

  // sinking under the weight, by the tangents at no torque [mm]
  function sag(factors) {
    const position = solvedReal(stiffnessMatrix(factors.map((x, s) => x * data.sagTangents[s])), data.sagLoad);
    return Array.from({ length: sagRows }, (_, row) => {
      let down = 0;
      for (let i = 0; i < 6; i++) down -= 1e3 * data.sagForward[6 * row + i] * position[i];
      return down;
    });
  }

  // force and slope of one direction: cubic pieces, straight beyond the ends
  function curveOf(s, u) {
    const { lowest, highest, first, last, least, at, by } = curves[price.curveOf[s]];
    const inside = Math.min(highest, Math.max(lowest, u));
    let piece = 0;
    while (piece < at.length - 2 && inside >= at[piece + 1]) piece++;
    const h = inside - at[piece], [a, b, c, d] = by.subarray(4 * piece, 4 * piece + 4);
    const secant = u < lowest ? first : last;
    const slope = u < lowest ? first : u > highest ? last : Math.max(3 * a * h * h + 2 * b * h + c, least);
    return { force: ((a * h + b) * h + c) * h + d + secant * (u - inside), slope };
  }

  // deflections under the wheel torque, Vᵀ F(x V q) = load, by Newton's method with halved steps [mm]
  function travel(x) {
    let turn = 0;
    for (let s = 0; s < n; s++) for (let i = 3; i < 6; i++) turn += forward[6 * s + i] ** 2;
    const length = Math.sqrt(turn / n); // rotations in radians are small: the body's size weighs their load
    const load = [0, 0, 0, 0, price.torque, 0];
    const moved = (q) => Array.from({ length: n }, (_, s) => q.reduce((sum, qi, i) => sum + forward[6 * s + i] * qi, 0));
    const unbalanced = (q) => {
      const left = Float64Array.from(load);
      moved(q).forEach((u, s) => {
        const { force } = curveOf(s, x[s] * u);
        for (let i = 0; i < 6; i++) left[i] -= forward[6 * s + i] * force;
      });
      return left;
    };
    const size = (left) => Math.sqrt(left.reduce((sum, part, i) => sum + (i < 3 ? part : part / length) ** 2, 0));
    const enough = 1e-9 * (1 + size(Float64Array.from(load)));
    let q = new Float64Array(6), left = unbalanced(q);
    for (let turnOf = 0; turnOf < 100 && size(left) > enough; turnOf++) {
      const slopes = moved(q).map((u, s) => x[s] * curveOf(s, x[s] * u).slope);
      const step = solvedReal(stiffnessMatrix(slopes), left);
      let share = 1, tried = null;
      for (let halving = 0; halving < 30; halving++) {
        tried = unbalanced(q.map((qi, i) => qi + share * step[i]));
        if (!(size(tried) > (1 - 0.1 * share) * size(left) && size(tried) > enough)) break;
        share /= 2;
      }
      q = q.map((qi, i) => qi + share * step[i]);
      left = unbalanced(q);
    }
    const u = moved(q);
    const beyond = u.some((deflection, s) => x[s] * deflection < curves[price.curveOf[s]].lowest || x[s] * deflection > curves[price.curveOf[s]].highest);
    return travelColumns.map((s) => (beyond ? NaN : 1e3 * u[s]));
  }

  // Undamped natural frequencies: eigenvalues of L⁻¹ K L⁻ᵀ with M = L Lᵀ, by Jacobi [Hz]
  function modes(factors) {
    const low = cholesky(mass), a = stiffnessMatrix(factors.map((x, s) => x * stiffness[s]));
    for (let side = 0; side < 2; side++) { // rows, then columns
      for (let j = 0; j < 6; j++) {
        for (let i = 0; i < 6; i++) {
          let sum = a[6 * i + j];
          for (let k = 0; k < i; k++) sum -= low[6 * i + k] * a[6 * k + j];
          a[6 * i + j] = sum / low[7 * i];
        }
      }
      for (let i = 0; i < 6; i++) for (let j = 0; j < i; j++) [a[6 * i + j], a[6 * j + i]] = [a[6 * j + i], a[6 * i + j]];
    }
    return eigenvalues(a).map((value) => Math.sqrt(Math.max(0, value)) / (2 * Math.PI));
  }

  return (x) => {
    const factors = factorsOf(x);
    const numbers = sagRows ? [...sag(factors), ...travel(factors)] : [];
    return Float64Array.from([...numbers, ...modes(factors)]);
  };
}

// lower triangle L of a positive definite 6×6 matrix, M = L Lᵀ
function cholesky(matrix) {
  const low = new Float64Array(36);
  for (let i = 0; i < 6; i++) {
    for (let j = 0; j <= i; j++) {
      let sum = matrix[6 * i + j];
      for (let k = 0; k < j; k++) sum -= low[6 * i + k] * low[6 * j + k];
      low[6 * i + j] = i === j ? Math.sqrt(sum) : sum / low[7 * j];
    }
  }
  return low;
}

// M x = b for a positive definite 6×6 matrix
function solvedReal(matrix, right) {
  const low = cholesky(matrix), x = Float64Array.from(right);
  for (let i = 0; i < 6; i++) {
    for (let k = 0; k < i; k++) x[i] -= low[6 * i + k] * x[k];
    x[i] /= low[7 * i];
  }
  for (let i = 5; i >= 0; i--) {
    for (let k = i + 1; k < 6; k++) x[i] -= low[6 * k + i] * x[k];
    x[i] /= low[7 * i];
  }
  return x;
}

// eigenvalues of a symmetric 6×6 matrix, rising, by Jacobi's rotations
function eigenvalues(a) {
  const n = 6;
  for (let sweep = 0; sweep < 30; sweep++) {
    let off = 0;
    for (let p = 0; p < n; p++) {
      for (let q = p + 1; q < n; q++) {
        off += Math.abs(a[6 * p + q]);
        if (a[6 * p + q] === 0) continue;
        const theta = (a[7 * q] - a[7 * p]) / (2 * a[6 * p + q]);
        const t = Math.sign(theta || 1) / (Math.abs(theta) + Math.sqrt(theta * theta + 1));
        const c = 1 / Math.sqrt(t * t + 1), s = t * c;
        for (let k = 0; k < n; k++) {
          const [u, w] = [a[6 * k + p], a[6 * k + q]];
          a[6 * k + p] = c * u - s * w;
          a[6 * k + q] = s * u + c * w;
        }
        for (let k = 0; k < n; k++) {
          const [u, w] = [a[6 * p + k], a[6 * q + k]];
          a[6 * p + k] = c * u - s * w;
          a[6 * q + k] = s * u + c * w;
        }
      }
    }
    if (off < 1e-9) break;
  }
  return Float64Array.from({ length: n }, (_, i) => a[7 * i]).sort();
}

// ---- sound of one order while the engine's speed rises evenly [Pa]

// p(t) = Re P(f(t)) e^{jφ}, φ = 2π ∫ f dt, P linear between the lines; faded in and out
const FADE = 0.05; // [s]
function runUpSound(re, im, frequency, seconds, rate) {
  const n = Math.round(seconds * rate), F = frequency.length, sound = new Float64Array(n);
  const first = frequency[0], slope = (frequency[F - 1] - first) / seconds;
  for (let i = 0, at = 0; i < n; i++) {
    const t = i / rate, f = first + slope * t;
    while (at < F - 2 && f >= frequency[at + 1]) at++;
    const share = (f - frequency[at]) / (frequency[at + 1] - frequency[at]);
    const phase = 2 * Math.PI * (first * t + (slope * t * t) / 2);
    const a = re[at] + share * (re[at + 1] - re[at]), b = im[at] + share * (im[at + 1] - im[at]);
    sound[i] = (a * Math.cos(phase) - b * Math.sin(phase)) * fade(i, n, seconds);
  }
  return sound;
}

// the window of scipy.signal.windows.tukey(n, 2 FADE / seconds)
function fade(i, n, seconds) {
  const alpha = (2 * FADE) / seconds, width = Math.floor((alpha * (n - 1)) / 2);
  if (i <= width) return 0.5 * (1 + Math.cos(Math.PI * (-1 + (2 * i) / alpha / (n - 1))));
  if (i >= n - width - 1) return 0.5 * (1 + Math.cos(Math.PI * (-2 / alpha + 1 + (2 * i) / alpha / (n - 1))));
  return 1;
}
