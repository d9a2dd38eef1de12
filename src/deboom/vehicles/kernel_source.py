"""Writes the straight-line loops that `deboom.vehicles.kernel_numba` compiles.

A lane is one design. Every loop runs over a fixed number of lanes with the same operations for
each, without a branch, so the compiler keeps several lanes in one register and the result of a
design does not depend on its lane. What differs between problems (the number of variables, which
entries of the 6×6 impedance are zero) is written out here instead of being looped over.

Buffers are flat, row k of a buffer starting at ``k * LANES``: with a constant stride the compiler
needs few checks for overlap.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from deboom.vehicles.kernel_ldlt_source import Entry, N, factorise_and_solve

PRESCRIBED_LANES = 128
COUPLED_LANES = 64
"""Designs side by side: the buffers of the loops stay in the first-level cache."""

SHARED = """
@jit
def fill(designs, first, x):
    last = designs.shape[0] - 1
    for lane in range(LANES):
        row = min(first + lane, last)
        for k in range(designs.shape[1]):
            x[k * LANES + lane] = designs[row, k]

@jit
def settle(product, total, lowest, highest, one):
    for at in range(product.size):
        lowest[at] = min(lowest[at], product[at])
        highest[at] = max(highest[at], product[at])
        total[at] *= product[at]
        product[at] = one

@jit
def store(total, out):
    for vehicle in range(out.shape[0]):
        for lane in range(LANES):
            out[vehicle, lane] = total[vehicle * LANES + lane]
            total[vehicle * LANES + lane] = 1.0
"""

_PRESCRIBED = """
@jit
def run(designs, table, one, group, stored, work, total, products, lowest, highest):
    n_vehicle, n_lines = table.shape[0], table.shape[1]
    x, product, low, high = work
    product[:] = one
    total[:] = 1.0
    for first in range(0, products.shape[2], LANES):
        fill(designs, first, x)
        for vehicle in range(n_vehicle):
            low[:] = one
            high[:] = one
            for line in range(0, n_lines, stored):
                end = min(line + stored, n_lines)
                lines(x, table[vehicle], line, end, group, product, total, low, high, one)
                store(total, products[vehicle:vehicle + 1, line // stored, first:first + LANES])
            lowest[vehicle, first:first + LANES] = low
            highest[vehicle, first:first + LANES] = high
"""

_COUPLED = """
@jit
def run(designs, equations, forward, table, one, group, stored, work, total, products,
        lowest, highest):
    n_lines, n_vehicle = table.shape[0], table.shape[1]
    x, product, low, high, z, q, w = work
    product[:] = one
    total[:] = 1.0
    for first in range(0, products.shape[2], LANES):
        fill(designs, first, x)
        low[:] = one
        high[:] = one
        for line in range(n_lines):
            solve(x, equations[line], forward, one, z, q, w)
            hear(w, table[line], product)
            end = line + 1
            if end % group == 0 or end == n_lines:
                settle(product, total, low, high, one)
                if end % stored == 0 or end == n_lines:
                    store(total, products[:, line // stored, first:first + LANES])
        lowest[:, first:first + LANES] = low.reshape(n_vehicle, LANES)
        highest[:, first:first + LANES] = high.reshape(n_vehicle, LANES)
"""


@dataclass(frozen=True)
class CoupledPattern:
    """What does not depend on numbers in the equations of motion.

    Parameters
    ----------
    directions : tuple of (tuple of int)
        Degrees of freedom that move each direction of the mounts: the nonzero entries of its row of
        the forward matrix.
    nonzero : tuple of (int, int)
        Entries (row ≥ column) of the impedance that are not always zero, all diagonal ones among
        them.
    transmitting : tuple of int
        Directions that reach the ear.
    own_paths : tuple of (tuple of int)
        Per path of bodies of their own, the pieces that feed it.
    """

    directions: tuple[tuple[int, ...], ...]
    nonzero: tuple[Entry, ...]
    transmitting: tuple[int, ...]
    own_paths: tuple[tuple[int, ...], ...]

    def springs(self, row: int, column: int) -> list[int]:
        """Directions that contribute to an entry of the impedance."""
        pairs = enumerate(self.directions)
        return [number for number, freedoms in pairs if {row, column} <= set(freedoms)]

    @property
    def n_variables(self) -> int:
        """Rows of designs that the loops read: directions, then own paths."""
        return len(self.directions) + len(self.own_paths)

    @property
    def n_paths(self) -> int:
        """Complex forces, up to a factor, that the synthesis reads."""
        return len(self.transmitting) + len(self.own_paths)


def source(pattern: int | CoupledPattern) -> str:
    """Write the loops of one problem shape.

    Parameters
    ----------
    pattern : int or CoupledPattern
        Number of variables with prescribed motion, or what the equations of motion look like.

    Returns
    -------
    str
        Functions decorated with ``@jit``, among them the driver ``run``; they read the names `jit`
        and `LANES`.
    """
    if isinstance(pattern, int):
        return SHARED + prescribed_source(pattern) + _PRESCRIBED
    return SHARED + coupled_source(pattern) + _COUPLED


def prescribed_source(n_variables: int) -> str:
    """Source of ``lines``, which multiplies ``|p|²`` of some lines of one vehicle.

    A row of the table holds the real, then the imaginary parts of the contributions of a line.
    """
    real = _sum(f"c{k} * x{k}" for k in range(n_variables))
    imaginary = _sum(f"c{n_variables + k} * x{k}" for k in range(n_variables))
    return "\n".join(
        [
            "@jit",
            "def lines(x, table, first, last, group, product, total, low, high, one):",
            "    for start in range(first, last, group):",
            "        for line in range(start, min(start + group, last)):",
            *(f"            c{k} = table[line, {k}]" for k in range(2 * n_variables)),
            "            for lane in range(LANES):",
            *(f"                x{k} = x[{k} * LANES + lane]" for k in range(n_variables)),
            f"                re = {real}",
            f"                im = {imaginary}",
            "                product[lane] *= re * re + im * im",
            "        settle(product, total, low, high, one)",
            "",
        ]
    )


def coupled_source(pattern: CoupledPattern) -> str:
    """Source of ``solve``, which leaves in `w` the forces of the paths, and of ``hear``.

    `solve` assembles the impedance of one line in `z`, factorises it as LDLᵀ without pivoting into
    the motion `q`, and leaves in `w` the forces of the paths up to their stiffness; `hear`
    multiplies ``|p|²`` of every vehicle. Several short loops instead of one: each keeps the numbers
    of the line in registers. Their order in `row`: per nonzero entry, minus the mass and the real
    and imaginary parts of its springs; real and imaginary parts of the load; per body of its own,
    stiffness and load.
    """
    numbers = _Numbers("row")
    body = [line for entry in pattern.nonzero for line in _assembly(pattern, entry, numbers)]
    body += _elimination(pattern, numbers)
    forward = _Numbers("forward")
    for path, direction in enumerate(pattern.transmitting):
        body += _displacement(path, direction, pattern.directions[direction], forward)
    for number, pieces in enumerate(pattern.own_paths):
        row = len(pattern.directions) + number
        body += _own_path(len(pattern.transmitting) + number, row, pieces, numbers)
    return "\n".join(
        [
            "@jit",
            "def solve(x, row, forward, one, z, q, w):",
            "    zero = one - one",
            *(f"    {line}" for line in body),
            hear_source(pattern.n_paths),
        ]
    )


def hear_source(n: int) -> str:
    """Source of ``hear``, which multiplies ``|p|²`` of every vehicle with `n` paths in `w`."""
    real = _sum(f"c{k} * u{k} - c{n + k} * v{k}" for k in range(n))
    imaginary = _sum(f"c{n + k} * u{k} + c{k} * v{k}" for k in range(n))
    return "\n".join(
        [
            "@jit",
            "def hear(w, table, product):",
            "    for vehicle in range(table.shape[0]):",
            *(f"        c{k} = table[vehicle, {k}]" for k in range(2 * n)),
            "        for lane in range(LANES):",
            *(f"            {_load(f'u{k}', 'w', 2 * k)}" for k in range(n)),
            *(f"            {_load(f'v{k}', 'w', 2 * k + 1)}" for k in range(n)),
            f"            re = {real}",
            f"            im = {imaginary}",
            "            product[vehicle * LANES + lane] *= re * re + im * im",
            "",
        ]
    )


def _assembly(pattern: CoupledPattern, entry: Entry, numbers: _Numbers) -> list[str]:
    """One entry of the impedance: minus the mass, plus springs times factors."""
    springs, place = pattern.springs(*entry), pattern.nonzero.index(entry)
    mass = numbers.next()
    parts = [[f"{numbers.next()} * x{i}" for i in springs] for _ in range(2)]
    return [
        *numbers.taken(),
        "for lane in range(LANES):",
        *(f"    {_load(f'x{i}', 'x', i)}" for i in springs),
        f"    {_store('z', 2 * place, _sum([mass, *parts[0]]))}",
        f"    {_store('z', 2 * place + 1, _sum(parts[1] or ['zero']))}",
    ]


def _elimination(pattern: CoupledPattern, numbers: _Numbers) -> list[str]:
    load = [f"{part}{k} = {numbers.next()}" for k in range(N) for part in "bd"]
    entries = [f"{i}{j}" for i, j in pattern.nonzero]
    return [
        *numbers.taken(),
        "for lane in range(LANES):",
        *(f"    {_load(f'r{ij}', 'z', 2 * k)}" for k, ij in enumerate(entries)),
        *(f"    {_load(f'i{ij}', 'z', 2 * k + 1)}" for k, ij in enumerate(entries)),
        *(f"    {statement}" for statement in load),
        *(f"    {statement}" for statement in factorise_and_solve(pattern.nonzero)),
        *(f"    {_store('q', 2 * k, f'b{k}')}" for k in range(N)),
        *(f"    {_store('q', 2 * k + 1, f'd{k}')}" for k in range(N)),
    ]


def _displacement(
    path: int, direction: int, freedoms: tuple[int, ...], forward: _Numbers
) -> list[str]:
    """Factor times displacement of one direction."""
    lever = [forward.next() for _ in freedoms]
    parts = (
        _sum(f"{c} * {part}{a}" for c, a in zip(lever, freedoms, strict=True)) for part in "bd"
    )
    real, imaginary = (f"t * ({part})" for part in parts)
    return [
        *forward.taken(),
        "for lane in range(LANES):",
        f"    {_load('t', 'x', direction)}",
        *(f"    {_load(f'b{a}', 'q', 2 * a)}" for a in freedoms),
        *(f"    {_load(f'd{a}', 'q', 2 * a + 1)}" for a in freedoms),
        f"    {_store('w', 2 * path, real)}",
        f"    {_store('w', 2 * path + 1, imaginary)}",
    ]


def _own_path(path: int, row: int, pieces: tuple[int, ...], numbers: _Numbers) -> list[str]:
    """Sum of the forces of pieces with a body of their own, ``x a / (x k - 1)``."""
    lane: list[str] = []
    for piece in pieces:
        kr, ki, ar, ai = (numbers.next() for _ in range(4))
        lane += [
            f"p = f * {kr} - one",
            f"s = f * {ki}",
            "t = f / (p * p + s * s)",
            f"u{piece} = ({ar} * p + {ai} * s) * t",
            f"v{piece} = ({ai} * p - {ar} * s) * t",
        ]
    return [
        *numbers.taken(),
        "for lane in range(LANES):",
        f"    {_load('f', 'x', row)}",
        *(f"    {statement}" for statement in lane),
        f"    {_store('w', 2 * path, _sum(f'u{piece}' for piece in pieces))}",
        f"    {_store('w', 2 * path + 1, _sum(f'v{piece}' for piece in pieces))}",
    ]


def _load(name: str, buffer: str, row: int) -> str:
    return f"{name} = {buffer}[{row} * LANES + lane]"


def _store(buffer: str, row: int, value: str) -> str:
    return f"{buffer}[{row} * LANES + lane] = {value}"


class _Numbers:
    """Names the numbers of one array in the order in which the loops read them."""

    def __init__(self, array: str) -> None:
        self._array = array
        self._count = 0
        self._named = 0

    def next(self) -> str:
        """Return the name of the next number."""
        self._count += 1
        return f"{self._array[0]}{self._count - 1}_"

    def taken(self) -> list[str]:
        """Return the statements that read the numbers named since the last call."""
        start, self._named = self._named, self._count
        return [f"{self._array[0]}{k}_ = {self._array}[{k}]" for k in range(start, self._count)]


def _sum(terms: Iterable[str]) -> str:
    return " + ".join(terms)
