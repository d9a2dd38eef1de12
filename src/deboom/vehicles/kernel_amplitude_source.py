"""Writes the loops of the amplitude-dependent motion for `deboom.vehicles.kernel_amplitude_numba`.

Lanes and buffers are those of `deboom.vehicles.kernel_source`. A sweep solves all lanes; those
whose amplitudes have come to rest keep them, so further sweeps give them the same bits again, and
what a design gets does not depend on the designs beside it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from deboom.vehicles.amplitude_motion import CALM, CALMER, LEAST_STEP, MOST_STEP
from deboom.vehicles.kernel_ldlt_source import N, factorise_and_solve
from deboom.vehicles.kernel_source import SHARED, CoupledPattern, hear_source

LANES = 64
"""Designs side by side."""

_RUN = f"""
CALM, CALMER = {CALM}, {CALMER}

@jit
def calm(g, h):
    for at in range(g.size):
        h[at] = np.sqrt(g[at] * h[at])

@jit
def take(g, h, active):
    for first in range(0, g.size, LANES):
        for lane in range(LANES):
            g[first + lane] = h[first + lane] if active[lane] > 0.0 else g[first + lane]

@jit
def foresee(g, before):
    for at in range(g.size):
        step = min(max(g[at] / before[at], {LEAST_STEP}), {MOST_STEP})
        before[at] = g[at]
        g[at] *= step
"""

_RUN += """
@jit
def run(designs, ratio, fixed, cubic, products, load, reach, forward, table, one, tolerance, most,
        group, stored, work, total, stores, lowest, highest, lost, sweeps):
    n_lines, n_vehicle = table.shape[0], table.shape[1]
    x, product, low, high, y, z, q, d, g, h, before, w, active = work
    product[:] = one
    total[:] = 1.0
    for first in range(0, stores.shape[2], LANES):
        fill(designs, first, x)
        block = first // LANES % ratio.shape[0]
        low[:] = one
        high[:] = one
        g[:] = one
        before[:] = one
        for line in range(n_lines):
            r = ratio[block, line % ratio.shape[1]]
            stay(x, r, fixed[line], y)
            active[:] = one
            for sweep in range(most):
                follow(x, r, cubic[line], g, y)
                assemble(y, products, z)
                solve(z, load[line], one, q)
                move(q, forward, d)
                sweeps[first // LANES] += 1
                if renew(y, d, reach[line], g, h, active, one, tolerance) == 0.0:
                    break
                if sweep >= CALM:
                    calm(g, h)
                if sweep >= CALMER:
                    calm(g, h)
                take(g, h, active)
            foresee(g, before)
            push(y, d, load[line], one, w)
            hear(w, table[line], product)
            for lane in range(LANES):
                lost[first + lane] += active[lane]
            end = line + 1
            if end % group == 0 or end == n_lines:
                settle(product, total, low, high, one)
                if end % stored == 0 or end == n_lines:
                    store(total, stores[:, line // stored, first:first + LANES])
        lowest[:, first:first + LANES] = low.reshape(n_vehicle, LANES)
        highest[:, first:first + LANES] = high.reshape(n_vehicle, LANES)
"""


@dataclass(frozen=True)
class AmplitudePattern:
    """What does not depend on numbers in the equations of an amplitude-dependent motion.

    Parameters
    ----------
    body : CoupledPattern
        Of the same motion at fixed amplitudes.
    variables : tuple of int
        Row of the designs that scales each direction, bodies of their own last.
    follows : tuple of int
        Directions whose stiffness follows the amplitude.
    ratio : bool
        Whether a factor does more than scale a stiffness.
    """

    body: CoupledPattern
    variables: tuple[int, ...]
    follows: tuple[int, ...]
    ratio: bool

    @property
    def n_body(self) -> int:
        """Directions of the powertrain."""
        return len(self.body.directions)

    @property
    def moved(self) -> tuple[int, ...]:
        """Directions of the powertrain whose displacement somebody needs."""
        followed = {k for k in self.follows if k < self.n_body}
        return tuple(sorted(followed | set(self.body.transmitting)))

    @property
    def rows(self) -> tuple[int, ...]:
        """Rows of the buffers y, z, q, d, g, h, before, w, active."""
        n_follow, n = len(self.follows), len(self.variables)
        counts = (n, len(self.body.nonzero), N, len(self.moved))
        return (*(2 * k for k in counts), *[n_follow] * 3, 2 * self.body.n_paths, 1)


def amplitude_source(pattern: AmplitudePattern) -> str:
    """Write the loops of one problem shape.

    Parameters
    ----------
    pattern : AmplitudePattern
        What the equations look like.

    Returns
    -------
    str
        Functions decorated with ``@jit``, among them the driver ``run``; they read the names `jit`
        and `LANES`.

    Notes
    -----
    ``stay`` and ``follow`` write the stiffness of every direction over ω² (over ω² m for a body of
    its own) to `y`, ``assemble`` the impedance to `z`, ``solve`` its motion to `q`, ``move``
    displacements to `d`. ``renew`` compares the amplitudes with those the stiffnesses were taken
    at and counts the lanes that still move, ``take`` replaces theirs; ``foresee`` guesses those of
    the next line. ``push`` leaves the forces of the paths in `w`.
    """
    parts = (_stay, _follow, _assemble, _solve, _move, _renew, _push)
    written = "\n".join(line for part in parts for line in (*part(pattern), ""))
    return SHARED + written + hear_source(pattern.body.n_paths) + _RUN


def _stay(pattern: AmplitudePattern) -> list[str]:
    fixed = [k for k in range(len(pattern.variables)) if k not in pattern.follows]
    lane = [
        statement
        for place, k in enumerate(fixed)
        for statement in _stiffness(pattern, k, f"a{2 * place}", f"a{2 * place + 1}")
    ]
    return [
        "@jit",
        "def stay(x, r, row, y):",
        *(f"    a{k} = row[{k}]" for k in range(2 * len(fixed))),
        "    for lane in range(LANES):",
        *(f"        {statement}" for statement in lane or ["pass"]),
    ]


def _stiffness(pattern: AmplitudePattern, k: int, real: str, imaginary: str) -> list[str]:
    """Write the stiffness of direction k to y, given that at factor 1."""
    out = [_load("s", "x", pattern.variables[k])]
    if not pattern.ratio:
        return [*out, _store("y", 2 * k, f"s * {real}"), _store("y", 2 * k + 1, f"s * {imaginary}")]
    return [
        *out,
        f"m = s * {_at('r', 2 * k)}",
        f"n = s * {_at('r', 2 * k + 1)}",
        _store("y", 2 * k, f"m * {real} - n * {imaginary}"),
        _store("y", 2 * k + 1, f"m * {imaginary} + n * {real}"),
    ]


def _follow(pattern: AmplitudePattern) -> list[str]:
    out = ["@jit", "def follow(x, r, row, g, y):"]
    for place, k in enumerate(pattern.follows):
        start = 10 * place
        out += [
            *(f"    c{j} = row[{start + j}]" for j in range(8)),
            f"    lowest, highest = row[{start + 8}], row[{start + 9}]",
            "    for lane in range(LANES):",
            f"        t = min(max({_at('g', place)}, lowest), highest)",
            "        u = c0 + t * (c2 + t * (c4 + t * c6))",
            "        v = c1 + t * (c3 + t * (c5 + t * c7))",
            *(f"        {statement}" for statement in _stiffness(pattern, k, "u", "v")),
        ]
    return out if pattern.follows else [*out, "    pass"]


def _assemble(pattern: AmplitudePattern) -> list[str]:
    out, at = ["@jit", "def assemble(y, products, z):"], 0
    for place, entry in enumerate(pattern.body.nonzero):
        springs = pattern.body.springs(*entry)
        names = [f"p{k}" for k in springs]
        parts = [
            _sum(
                f"{name} * {_at('y', 2 * k + part)}" for name, k in zip(names, springs, strict=True)
            )
            for part in (0, 1)
        ]
        out += [
            f"    mass = products[{at}]",
            *(f"    {name} = products[{at + 1 + j}]" for j, name in enumerate(names)),
            "    for lane in range(LANES):",
            f"        {_store('z', 2 * place, _sum(['mass', parts[0]] if springs else ['mass']))}",
            f"        {_store('z', 2 * place + 1, parts[1] if springs else 'mass - mass')}",
        ]
        at += 1 + len(springs)
    return out


def _solve(pattern: AmplitudePattern) -> list[str]:
    nonzero = pattern.body.nonzero
    load = [f"{part}{k}" for k in range(N) for part in "bd"]
    return [
        "@jit",
        "def solve(z, row, one, q):",
        *(f"    f{name} = row[{place}]" for place, name in enumerate(load)),
        "    for lane in range(LANES):",
        *(f"        {_load(f'r{i}{j}', 'z', 2 * k)}" for k, (i, j) in enumerate(nonzero)),
        *(f"        {_load(f'i{i}{j}', 'z', 2 * k + 1)}" for k, (i, j) in enumerate(nonzero)),
        *(f"        {name} = f{name}" for name in load),
        *(f"        {statement}" for statement in factorise_and_solve(nonzero)),
        *(f"        {_store('q', 2 * k, f'b{k}')}" for k in range(N)),
        *(f"        {_store('q', 2 * k + 1, f'd{k}')}" for k in range(N)),
    ]


def _move(pattern: AmplitudePattern) -> list[str]:
    out, at = ["@jit", "def move(q, forward, d):"], 0
    for place, k in enumerate(pattern.moved):
        freedoms = pattern.body.directions[k]
        out += [f"    v{a} = forward[{at + j}]" for j, a in enumerate(freedoms)]
        out.append("    for lane in range(LANES):")
        for part in (0, 1):
            value = _sum(f"v{a} * {_at('q', 2 * a + part)}" for a in freedoms)
            out.append(f"        {_store('d', 2 * place + part, value)}")
        at += len(freedoms)
    return out if pattern.moved else [*out, "    pass"]


def _renew(pattern: AmplitudePattern) -> list[str]:
    out = ["@jit", "def renew(y, d, reach, g, h, active, one, tolerance):"]
    for place, k in enumerate(pattern.follows):
        out += [f"    a = reach[{place}]", "    for lane in range(LANES):"]
        if k < pattern.n_body:
            at = pattern.moved.index(k)
            out += [
                f"        u = {_at('d', 2 * at)}",
                f"        v = {_at('d', 2 * at + 1)}",
                f"        {_store('h', place, 'a * np.sqrt(u * u + v * v)')}",
            ]
        else:
            out += [
                f"        u = {_at('y', 2 * k)} - one",
                f"        v = {_at('y', 2 * k + 1)}",
                f"        {_store('h', place, 'a / np.sqrt(u * u + v * v)')}",
            ]
    n = len(pattern.follows)
    changes = [f"abs({_at('h', k)} - {_at('g', k)}) - tolerance * {_at('h', k)}" for k in range(n)]
    out += [
        "    moving = one - one",
        "    for lane in range(LANES):",
        "        most = -one",
        *(f"        most = max(most, {change})" for change in changes),
        "        active[lane] = active[lane] if most > 0.0 else 0.0",
        "        moving += active[lane]",
    ]
    return [*out, "    return moving"]


def _push(pattern: AmplitudePattern) -> list[str]:
    out, path = ["@jit", "def push(y, d, load, one, w):"], 0
    for path, k in enumerate(pattern.body.transmitting):
        at = pattern.moved.index(k)
        out += [
            "    for lane in range(LANES):",
            f"        a, b = {_at('y', 2 * k)}, {_at('y', 2 * k + 1)}",
            f"        u, v = {_at('d', 2 * at)}, {_at('d', 2 * at + 1)}",
            f"        {_store('w', 2 * path, 'a * u - b * v')}",
            f"        {_store('w', 2 * path + 1, 'a * v + b * u')}",
        ]
    for number, pieces in enumerate(pattern.body.own_paths):
        path = len(pattern.body.transmitting) + number
        sums: dict[str, list[str]] = {"u": [], "v": []}
        lane = []
        for piece in pieces:
            k, at = pattern.n_body + piece, 2 * N + 2 * piece
            out += [f"    f{piece} = load[{at}]", f"    g{piece} = load[{at + 1}]"]
            lane += [
                f"a, b = {_at('y', 2 * k)}, {_at('y', 2 * k + 1)}",
                "p = a - one",
                "t = one / (p * p + b * b)",
                # y / (y - 1) of the load f + j g
                "m, n = (a * p + b * b) * t, (b * p - a * b) * t",
                f"u{piece} = f{piece} * m - g{piece} * n",
                f"v{piece} = f{piece} * n + g{piece} * m",
            ]
            for part, names in sums.items():
                names.append(f"{part}{piece}")
        out += [
            "    for lane in range(LANES):",
            *(f"        {statement}" for statement in lane),
            f"        {_store('w', 2 * path, _sum(sums['u']))}",
            f"        {_store('w', 2 * path + 1, _sum(sums['v']))}",
        ]
    return out


def _at(buffer: str, row: int) -> str:
    return f"{buffer}[{row} * LANES + lane]"


def _load(name: str, buffer: str, row: int) -> str:
    return f"{name} = {_at(buffer, row)}"


def _store(buffer: str, row: int, value: str) -> str:
    return f"{_at(buffer, row)} = {value}"


def _sum(terms: Iterable[str]) -> str:
    return " + ".join(terms)
