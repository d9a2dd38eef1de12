"""The hot loops of the booming index, compiled with numba: the only module that imports it.

A lane is one design. Every inner loop runs over a fixed number of lanes with the same operations
for each, so the compiler keeps several lanes in one register, and the result of a design does not
depend on the designs beside it. Loops over variables, springs and paths have lengths that the
factories below fix, so that the compiler unrolls them; helpers are inlined, so that it knows the
shapes of the buffers. A sum of logarithms is the logarithm of a product: the loops multiply
``|p|²`` of up to `STORED` lines and leave the logarithm to numpy.

Compiling takes seconds, once per problem shape and machine: numba keeps the result on disk.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from deboom.arrays import ComplexArray, IntArray, RealArray
from deboom.vehicles.amplitude_motion import CALM, CALMER, LEAST_STEP, MOST_STEP, MOST_SWEEPS

PRESCRIBED_LANES = 128
COUPLED_LANES = 64
FLEXIBLE_LANES = 32
"""Designs side by side: the buffers of the loops stay in the first-level cache."""

SLOPE_LANES, FEW_LANES = 64, 16
"""Designs side by side where slopes are summed, and where there are no more than a few, such as the
draws that find the branches of a front. Loops of other lanes may round the last bit otherwise."""

SUMMED_TOGETHER = 5
"""Vehicles whose weighted transfer functions are summed in registers. A sum over all of a wide
fleet is not vectorised over lanes: with 200 vehicles it took six times as long."""

GROUP = 16
"""Lines multiplied before the product is checked."""

STORED = 96
"""Lines multiplied before the product is stored."""

LARGEST_PRODUCT = 1e50
"""Designs with a group's product beyond this, or below its inverse, are not trusted; the groups of
one stored product fit a double."""

_OPTIONS: dict[str, Any] = {
    "fastmath": {"contract", "reassoc", "nsz", "arcp"},
    # a branch for a division by zero would keep the loops from being vectorised
    "error_model": "numpy",
    "nogil": True,
}
_INLINED: dict[str, Any] = {"fastmath": _OPTIONS["fastmath"], "error_model": "numpy"}
_helper = njit(inline="always", **_INLINED)


def _compile(function: Callable[..., None]) -> Callable[..., None]:
    """Compile a loop and keep it on disk where a folder can be written."""
    try:
        return njit(cache=True, **_OPTIONS)(function)  # type: ignore[no-any-return]
    except RuntimeError:
        return njit(**_OPTIONS)(function)  # type: ignore[no-any-return]


class MotionTables(NamedTuple):
    """Equations of motion of one load case as the loops read them.

    Springs along x of all n mounts come first, those along y and z next, then those of the wheel
    ends; where any spring is oblique, those of the powertrain stand in their own order.

    - `variables` (s,): design variable of each spring.
    - `stiffness` (f, s) [N/m].
    - `levers` (3, n, 2): displacement of a spring along axis a by a turn about the axes a + 1 and a
      + 2 [m/rad].
    - `forward` (o, 6): motion of the powertrain → displacement of each oblique spring; empty where
      none is [1, m/rad].
    - `products` (o, 21): products of two entries of a row of `forward`, lower triangle by columns.
    - `mass_matrix` (6, 6): mass matrix of the powertrain.
    - `load` (f, 6): external load on the powertrain [N, N m].
    - `squared` (f,): ω² [rad²/s²].
    - `end_mass` (e,) [kg].
    - `end_load` (f, e) [N].
    - `path` (s,): path that each spring feeds; -1 where it does not reach an ear.
    - `transfer_real`, `transfer_imag` (f, v, path): transfer functions, scaled to a pressure of
      about 1.
    - `follows` (m,): springs whose stiffness follows the amplitude.
    - `amplitude` (f, m): their nominal amplitudes [m].
    - `cubic` (f, m, 4): coefficients of their relative stiffness over the ratio of amplitudes [1].
    - `lowest`, `highest` (f, m): bounds of that ratio [1].
    """

    variables: IntArray
    stiffness: ComplexArray
    levers: RealArray
    forward: RealArray
    products: RealArray
    mass_matrix: RealArray
    load: ComplexArray
    squared: RealArray
    end_mass: RealArray
    end_load: ComplexArray
    path: IntArray
    transfer_real: RealArray
    transfer_imag: RealArray
    follows: IntArray
    amplitude: RealArray
    cubic: ComplexArray
    lowest: RealArray
    highest: RealArray


class FlexibleTables(NamedTuple):
    """Springs between powertrain, wheel ends and bodies that give way, as the loop reads them.

    - `variables` (s,): design variable of each spring.
    - `compliance` (f, s): of each spring at factor 1 [m/N].
    - `joined` (f, b, s, s + 2, 2): receptance of powertrain, wheel ends and body together [m/N],
      below it displacements at the springs without springs [m] and transfer functions to the first
      response in the body, scaled to a pressure of about 1; real and imaginary part.
    - `further` (f, v, s, 2): transfer functions to every response, likewise; empty where each body
      has one.
    - `first` (b + 1,): number of the first response in each body, and of all of them.
    """

    variables: IntArray
    compliance: ComplexArray
    joined: RealArray
    further: RealArray
    first: IntArray


@lru_cache
def prescribed_loop(n_variables: int) -> Callable[..., None]:
    """Return the loop for prescribed motion with a number of variables.

    It reads factors (chunk, k, lane) and a table (v, f, 2, k) with the real and the imaginary parts
    of the contributions; it writes products of ``|p|²`` (chunk, v, part, lane) and sets `trusted`
    (chunk, lane) to False where a product comes near the end of the range of numbers.
    """
    lanes = PRESCRIBED_LANES

    @_compile
    def run(factors, table, products, trusted):  # type: ignore[no-untyped-def]
        n_vehicles, n_lines = table.shape[:2]
        x = np.empty((n_variables, lanes))
        product = np.empty(lanes)
        for chunk in range(factors.shape[0]):
            x[:] = factors[chunk]
            for vehicle in range(n_vehicles):
                products[chunk, vehicle] = 1.0
                for first in range(0, n_lines, GROUP):
                    product[:] = 1.0
                    for line in range(first, min(first + GROUP, n_lines)):
                        real, imag = table[vehicle, line, 0], table[vehicle, line, 1]
                        for lane in range(lanes):
                            p_real = 0.0
                            p_imag = 0.0
                            for k in range(n_variables):
                                p_real += real[k] * x[k, lane]
                                p_imag += imag[k] * x[k, lane]
                            product[lane] *= p_real * p_real + p_imag * p_imag
                    _settle(product, products[chunk, vehicle, first // STORED], trusted[chunk])

    return run


@lru_cache
def coupled_loop(
    n_body: int, n_end: int, n_paths: int, oblique: bool, lanes: int
) -> Callable[..., None]:
    """Return the loop for coupled motion with `n_body` springs of the powertrain.

    As many lie along each axis, or they are oblique. Each wheel end has `n_end` springs.

    It reads factors (chunk, k, lane), the changes of the stiffnesses beside the factors (chunk, f,
    s, 2, lane), or an empty array where there are none, `MotionTables` and the tolerance of the
    amplitudes; it writes as `prescribed_loop` does. Where no stiffness follows the amplitude, a
    line takes one sweep.
    """
    # of the factory, because what is kept on disk is found by them
    most_sweeps, calms, steps = MOST_SWEEPS, (CALM, CALMER), (LEAST_STEP, MOST_STEP)
    n_mounts, n_entries = n_body // 3, 21 if oblique else 0

    @_compile
    def run(factors, ratio, tables, tolerance, products, trusted):  # type: ignore[no-untyped-def]
        n_lines, n_vehicles = tables.transfer_real.shape[:2]
        n_springs, n_follows = tables.variables.size, tables.follows.size
        k = np.empty((n_springs, 2, lanes))
        nominal = np.empty((n_follows, 2, lanes))
        z = np.empty((3, 6, 2, lanes))
        whole = np.empty((n_entries, 2, lanes))
        rigid = np.empty(21)
        q = np.empty((6, 2, lanes))
        u = np.empty((n_springs, 2, lanes))
        force = np.empty((n_paths, 2, lanes))
        product = np.empty((n_vehicles, lanes))
        reached = np.empty((n_follows, lanes))
        before = np.empty((n_follows, lanes))
        after = np.empty((n_follows, lanes))
        moving = np.empty(lanes)
        change = np.empty(lanes)
        levers = tables.levers
        for chunk in range(factors.shape[0]):
            products[chunk] = 1.0
            product[:] = 1.0
            reached[:] = 1.0
            before[:] = 1.0
            for line in range(n_lines):
                _scale(factors[chunk], tables.variables, tables.stiffness[line], k, lanes)
                if ratio.shape[0] > 0:
                    _multiply(ratio[chunk, line], k, lanes)
                for m in range(n_follows):
                    nominal[m] = k[tables.follows[m]]
                moving[:] = 1.0
                for sweep in range(most_sweeps):
                    _follow(tables, line, reached, nominal, k, lanes)
                    # the flag is a constant of the factory: one branch is left
                    for entry in range(n_entries):
                        for part in range(2):
                            for lane in range(lanes):
                                total = 0.0
                                for s in range(n_body):
                                    total += k[s, part, lane] * tables.products[s, entry]
                                whole[entry, part, lane] = total
                    for axis in range(0 if oblique else 3):
                        for part in range(2):
                            for lane in range(lanes):
                                aa = ab = ac = bb = bc = cc = 0.0
                                for mount in range(n_mounts):
                                    b, c = levers[axis, mount, 0], levers[axis, mount, 1]
                                    spring = k[axis * n_mounts + mount, part, lane]
                                    aa += spring
                                    ab += spring * b
                                    ac += spring * c
                                    bb += spring * b * b
                                    bc += spring * b * c
                                    cc += spring * c * c
                                z[axis, 0, part, lane] = aa
                                z[axis, 1, part, lane] = ab
                                z[axis, 2, part, lane] = ac
                                z[axis, 3, part, lane] = bb
                                z[axis, 4, part, lane] = bc
                                z[axis, 5, part, lane] = cc
                    if oblique:
                        _inertia(tables.mass_matrix, tables.squared[line], rigid)
                        _solve_whole(whole, tables.load[line], rigid, q, lanes)
                        _displace_oblique(q, tables.forward, u, lanes)
                    else:
                        _solve(
                            z, tables.load[line], tables.mass_matrix, tables.squared[line], q, lanes
                        )
                        _displace(q, levers, u, lanes)
                    for end in range(tables.end_mass.size):
                        load = tables.end_load[line, end]
                        inertia = tables.squared[line] * tables.end_mass[end]
                        first = n_body + end * n_end
                        for lane in range(lanes):
                            real, imag = -inertia, 0.0
                            for s in range(n_end):
                                real += k[first + s, 0, lane]
                                imag += k[first + s, 1, lane]
                            moved = load * _inverse(real, imag)
                            for s in range(n_end):
                                u[first + s, 0, lane] = moved.real
                                u[first + s, 1, lane] = moved.imag
                    if not _compare(
                        tables, line, u, reached, after, moving, change, tolerance, lanes
                    ):
                        break
                    for calm in calms:
                        if sweep >= calm:
                            _halve(reached, after, lanes)
                    _take(reached, after, moving, lanes)
                for lane in range(lanes):
                    trusted[chunk, lane] &= moving[lane] == 0.0
                _foresee(reached, before, steps, lanes)
                _push(k, u, tables.path, force, lanes)
                for vehicle in range(n_vehicles):
                    real = tables.transfer_real[line, vehicle]
                    imag = tables.transfer_imag[line, vehicle]
                    for lane in range(lanes):
                        p_real = 0.0
                        p_imag = 0.0
                        for path in range(n_paths):
                            p_real += real[path] * force[path, 0, lane]
                            p_real -= imag[path] * force[path, 1, lane]
                            p_imag += real[path] * force[path, 1, lane]
                            p_imag += imag[path] * force[path, 0, lane]
                        product[vehicle, lane] *= p_real * p_real + p_imag * p_imag
                if (line + 1) % GROUP == 0 or line + 1 == n_lines:
                    for vehicle in range(n_vehicles):
                        stored = products[chunk, vehicle, line // STORED]
                        _settle(product[vehicle], stored, trusted[chunk])
                    product[:] = 1.0

    return run


@lru_cache
def flexible_loop(
    n_springs: int, lanes: int, *, with_slopes: bool, with_further: bool
) -> Callable[..., None]:
    """Return the loop for coupled motion with the receptance of every body, and perhaps its slopes.

    Further responses in a body take the solution of the first one.

    It reads factors (chunk, k, lane) and `FlexibleTables`, and writes as `prescribed_loop` does.
    With slopes it writes ``Σ_f Re(∂p_f/∂x_k / p_f)`` to `slopes` (chunk, v, k, lane), too, which it
    leaves alone otherwise.

    Per line and vehicle ``p = Yᵀ A⁻¹ u_free`` with the symmetric ``A = diag(1/(x K)) + Y_S + Y_B``,
    see `_eliminate`. With ``g = A⁻¹ u_free`` and ``t = A⁻¹ Y`` the derivatives are
    ``∂p/∂x_i = t_i g_i / (x_i² K_i)``: values and slopes come from the same elimination.
    """
    n_entries = n_springs * (n_springs + 5) // 2
    keep, n_vectors = with_slopes or with_further, 2 if with_slopes else 1

    @_compile
    def run(factors, tables, products, slopes, trusted):  # type: ignore[no-untyped-def]
        n_lines, n_bodies = tables.joined.shape[:2]
        n_vehicles = products.shape[1]
        inverse_factor = np.empty((n_springs, lanes))
        flexibility = np.empty((n_springs, 2, lanes))
        z = np.empty((n_entries, 2, lanes))
        pair = np.empty((2, n_springs + 2, 2, lanes))
        scaled = np.empty((2, n_springs + 2, 2, lanes))
        first = np.empty((2, lanes))
        pressure = np.empty((2, lanes))
        inverse = np.empty((2, lanes))
        solved = np.empty((n_springs, 2, 2, lanes))
        product = np.empty((n_vehicles, lanes))
        for chunk in range(factors.shape[0]):
            products[chunk] = 1.0
            product[:] = 1.0
            if with_slopes:
                slopes[chunk] = 0.0
            _invert_factors(factors[chunk], tables.variables, inverse_factor, lanes)
            for line in range(n_lines):
                _give_way(tables.compliance[line], inverse_factor, flexibility, lanes)
                for body in range(n_bodies):
                    joined = tables.joined[line, body]
                    vehicle = tables.first[body]
                    _eliminate(
                        joined,
                        flexibility,
                        z,
                        pair,
                        scaled,
                        first,
                        pressure,
                        n_springs,
                        keep,
                        lanes,
                    )
                    for lane in range(lanes):
                        real, imag = pressure[0, lane], pressure[1, lane]
                        square = real * real + imag * imag
                        product[vehicle, lane] *= square
                        if with_slopes:
                            inverse[0, lane] = real / square
                            inverse[1, lane] = -imag / square
                    if not keep:
                        continue
                    _substitute_back(joined, z, first, solved, n_springs, n_vectors, lanes)
                    if with_slopes:
                        _add_slopes(
                            slopes[chunk, vehicle],
                            tables.variables,
                            solved,
                            flexibility,
                            inverse_factor,
                            inverse,
                            lanes,
                        )
                    if not with_further:
                        continue
                    for other in range(vehicle + 1, tables.first[body + 1]):
                        heard = tables.further[line, other]
                        for lane in range(lanes):
                            real = imag = 0.0
                            for s in range(n_springs):
                                real += heard[s, 0] * solved[s, 0, 0, lane]
                                real -= heard[s, 1] * solved[s, 0, 1, lane]
                                imag += heard[s, 0] * solved[s, 0, 1, lane]
                                imag += heard[s, 1] * solved[s, 0, 0, lane]
                            square = real * real + imag * imag
                            product[other, lane] *= square
                            inverse[0, lane] = real / square
                            inverse[1, lane] = -imag / square
                        if with_slopes:
                            _solve_again(
                                joined, z, pair, first, heard, solved, scaled, n_springs, lanes
                            )
                            _add_slopes(
                                slopes[chunk, other],
                                tables.variables,
                                solved,
                                flexibility,
                                inverse_factor,
                                inverse,
                                lanes,
                            )
                if (line + 1) % GROUP == 0 or line + 1 == n_lines:
                    for vehicle in range(n_vehicles):
                        stored = products[chunk, vehicle, line // STORED]
                        _settle(product[vehicle], stored, trusted[chunk])
                    product[:] = 1.0

    return run


@_helper
def _at(column, row, n_springs):  # type: ignore[no-untyped-def]
    """Return the place of an entry on or below the diagonal, with two rows of vectors below."""
    return column * (n_springs + 2) - column * (column - 1) // 2 + row - column


@_helper
def _invert_factors(x, variables, inverse_factor, lanes):  # type: ignore[no-untyped-def]
    """Write one over the factor of every spring."""
    for s in range(variables.size):
        for lane in range(lanes):
            inverse_factor[s, lane] = 1.0 / x[variables[s], lane]


@_helper
def _give_way(compliance, inverse_factor, flexibility, lanes):  # type: ignore[no-untyped-def]
    """Write the compliance of every spring."""
    for s in range(compliance.size):
        real, imag = compliance[s].real, compliance[s].imag
        for lane in range(lanes):
            flexibility[s, 0, lane] = inverse_factor[s, lane] * real
            flexibility[s, 1, lane] = inverse_factor[s, lane] * imag


@_helper
def _eliminate(  # type: ignore[no-untyped-def]
    joined, flexibility, z, pair, scaled, first, pressure, n_springs, keep, lanes
):
    """Write ``Yᵀ A⁻¹ u`` for the symmetric ``A = diag(flexibility) + joined``.

    LDLᵀ with both vectors as two more rows, which needs no substitution back. The column of the
    first spring is the same for all lanes; the other springs are eliminated two at a time, so that
    what is left of the matrix is read and written half as often. `keep` leaves the columns of L in
    `z` for `_substitute_back`. No pivoting: springs with losses keep the pivots away from zero.
    """
    u, y = n_springs, n_springs + 1
    real, imag = joined[0, 0, 0], joined[0, 0, 1]
    for lane in range(lanes):
        inverse = _inverse(flexibility[0, 0, lane] + real, flexibility[0, 1, lane] + imag)
        first[0, lane], first[1, lane] = inverse.real, inverse.imag
    both = complex(joined[0, u, 0], joined[0, u, 1]) * complex(joined[0, y, 0], joined[0, y, 1])
    for lane in range(lanes):
        pressure[0, lane] = both.real * first[0, lane] - both.imag * first[1, lane]
        pressure[1, lane] = both.real * first[1, lane] + both.imag * first[0, lane]
    for column in range(1, n_springs):
        of_column = complex(joined[0, column, 0], joined[0, column, 1])
        for row in range(column, n_springs + 2):
            both = of_column * complex(joined[0, row, 0], joined[0, row, 1])
            real, imag = joined[column, row, 0], joined[column, row, 1]
            entry = z[_at(column, row, n_springs)]
            for lane in range(lanes):
                entry[0, lane] = real - (both.real * first[0, lane] - both.imag * first[1, lane])
                entry[1, lane] = imag - (both.real * first[1, lane] + both.imag * first[0, lane])
        entry = z[_at(column, column, n_springs)]
        for lane in range(lanes):
            entry[0, lane] += flexibility[column, 0, lane]
            entry[1, lane] += flexibility[column, 1, lane]
    for pivot in range(1, n_springs - 1, 2):
        after = pivot + 1
        d_0, d_01 = z[_at(pivot, pivot, n_springs)], z[_at(pivot, after, n_springs)]
        d_1 = z[_at(after, after, n_springs)]
        for lane in range(lanes):
            inverse = _inverse(d_0[0, lane], d_0[1, lane])
            coupled = complex(d_01[0, lane], d_01[1, lane])
            share = coupled * inverse
            left = complex(d_1[0, lane], d_1[1, lane]) - share * coupled
            other = _inverse(left.real, left.imag)
            # the rows of the pair itself hold its inverse pivots and the entry of L between them
            pair[0, pivot, 0, lane], pair[0, pivot, 1, lane] = inverse.real, inverse.imag
            pair[1, pivot, 0, lane], pair[1, pivot, 1, lane] = share.real, share.imag
            pair[1, after, 0, lane], pair[1, after, 1, lane] = other.real, other.imag
        if keep:
            d_01[:] = pair[1, pivot]
        for row in range(pivot + 2, n_springs + 2):
            z_0, z_1 = z[_at(pivot, row, n_springs)], z[_at(after, row, n_springs)]
            for lane in range(lanes):
                share = complex(pair[1, pivot, 0, lane], pair[1, pivot, 1, lane])
                x_0 = complex(z_0[0, lane], z_0[1, lane])
                x_1 = complex(z_1[0, lane], z_1[1, lane]) - share * x_0
                l_0 = x_0 * complex(pair[0, pivot, 0, lane], pair[0, pivot, 1, lane])
                l_1 = x_1 * complex(pair[1, after, 0, lane], pair[1, after, 1, lane])
                pair[0, row, 0, lane], pair[0, row, 1, lane] = x_0.real, x_0.imag
                pair[1, row, 0, lane], pair[1, row, 1, lane] = x_1.real, x_1.imag
                scaled[0, row, 0, lane], scaled[0, row, 1, lane] = l_0.real, l_0.imag
                scaled[1, row, 0, lane], scaled[1, row, 1, lane] = l_1.real, l_1.imag
            if keep:
                z_0[:], z_1[:] = scaled[0, row], scaled[1, row]
        for lane in range(lanes):
            part = complex(scaled[0, u, 0, lane], scaled[0, u, 1, lane]) * complex(
                pair[0, y, 0, lane], pair[0, y, 1, lane]
            ) + complex(scaled[1, u, 0, lane], scaled[1, u, 1, lane]) * complex(
                pair[1, y, 0, lane], pair[1, y, 1, lane]
            )
            pressure[0, lane] += part.real
            pressure[1, lane] += part.imag
        for column in range(pivot + 2, n_springs):
            for row in range(column, n_springs + 2):
                entry = z[_at(column, row, n_springs)]
                for lane in range(lanes):
                    part = complex(
                        scaled[0, column, 0, lane], scaled[0, column, 1, lane]
                    ) * complex(pair[0, row, 0, lane], pair[0, row, 1, lane]) + complex(
                        scaled[1, column, 0, lane], scaled[1, column, 1, lane]
                    ) * complex(pair[1, row, 0, lane], pair[1, row, 1, lane])
                    entry[0, lane] -= part.real
                    entry[1, lane] -= part.imag
    if n_springs > 1 and n_springs % 2 == 0:
        # the last spring has no partner
        last = n_springs - 1
        d_0, of_u = z[_at(last, last, n_springs)], z[_at(last, u, n_springs)]
        of_y = z[_at(last, y, n_springs)]
        for lane in range(lanes):
            inverse = _inverse(d_0[0, lane], d_0[1, lane])
            l_u = inverse * complex(of_u[0, lane], of_u[1, lane])
            x_y = complex(of_y[0, lane], of_y[1, lane])
            part = l_u * x_y
            pressure[0, lane] += part.real
            pressure[1, lane] += part.imag
            if keep:
                l_y = inverse * x_y
                of_u[0, lane], of_u[1, lane] = l_u.real, l_u.imag
                of_y[0, lane], of_y[1, lane] = l_y.real, l_y.imag


@_helper
def _add_slopes(  # type: ignore[no-untyped-def]
    slopes, variables, solved, flexibility, inverse_factor, inverse, lanes
):
    """Add ``Re(t g / (x² K) / p)`` of every spring to the slope by its variable."""
    for s in range(variables.size):
        slope = slopes[variables[s]]
        for lane in range(lanes):
            both = complex(solved[s, 0, 0, lane], solved[s, 0, 1, lane]) * complex(
                solved[s, 1, 0, lane], solved[s, 1, 1, lane]
            )
            both *= complex(flexibility[s, 0, lane], flexibility[s, 1, lane])
            of_level = both.real * inverse[0, lane] - both.imag * inverse[1, lane]
            slope[lane] += inverse_factor[s, lane] * of_level


@_helper
def _solve_again(  # type: ignore[no-untyped-def]
    joined, z, pair, first, heard, solved, left, n_springs, lanes
):
    """Write ``A⁻¹ Y`` of another response to `solved`, from what `_eliminate` kept.

    `left` holds what is left of Y while springs are eliminated.
    """
    for s in range(n_springs):
        left[0, s, 0], left[0, s, 1] = heard[s, 0], heard[s, 1]
    for pivot in range(n_springs):
        has_partner = pivot % 2 == 0 or pivot + 1 < n_springs
        for lane in range(lanes):
            of_pivot = complex(left[0, pivot, 0, lane], left[0, pivot, 1, lane])
            if pivot == 0:
                inverse = complex(first[0, lane], first[1, lane])
            elif has_partner:
                row = pair[1 - pivot % 2, pivot]
                inverse = complex(row[0, lane], row[1, lane])
            else:
                row = z[_at(pivot, pivot, n_springs)]
                inverse = _inverse(row[0, lane], row[1, lane])
            share = of_pivot * inverse
            solved[pivot, 1, 0, lane], solved[pivot, 1, 1, lane] = share.real, share.imag
        for row in range(pivot + 1, n_springs):
            for lane in range(lanes):
                if pivot == 0:
                    part = complex(joined[0, row, 0], joined[0, row, 1]) * complex(
                        solved[0, 1, 0, lane], solved[0, 1, 1, lane]
                    )
                else:
                    factor = z[_at(pivot, row, n_springs)]
                    part = complex(factor[0, lane], factor[1, lane]) * complex(
                        left[0, pivot, 0, lane], left[0, pivot, 1, lane]
                    )
                left[0, row, 0, lane] -= part.real
                left[0, row, 1, lane] -= part.imag
    for down in range(n_springs):
        pivot = n_springs - 1 - down
        goal = solved[pivot, 1]
        for row in range(pivot + 1, n_springs):
            for lane in range(lanes):
                below = complex(solved[row, 1, 0, lane], solved[row, 1, 1, lane])
                if pivot == 0:
                    part = complex(joined[0, row, 0], joined[0, row, 1]) * complex(
                        first[0, lane], first[1, lane]
                    )
                else:
                    factor = z[_at(pivot, row, n_springs)]
                    part = complex(factor[0, lane], factor[1, lane])
                part *= below
                goal[0, lane] -= part.real
                goal[1, lane] -= part.imag


@_helper
def _substitute_back(  # type: ignore[no-untyped-def]
    joined, z, first, solved, n_springs, n_vectors, lanes
):
    """Write ``A⁻¹ u``, and of two vectors ``A⁻¹ Y``, from what `_eliminate` kept."""
    for down in range(n_springs):
        pivot = n_springs - 1 - down
        goal = solved[pivot]
        for vector in range(n_vectors):
            if pivot == 0:
                real, imag = joined[0, n_springs + vector, 0], joined[0, n_springs + vector, 1]
                goal[vector, 0], goal[vector, 1] = real, imag
            else:
                goal[vector] = z[_at(pivot, n_springs + vector, n_springs)]
        for row in range(pivot + 1, n_springs):
            below = solved[row]
            if pivot == 0:
                part = complex(joined[0, row, 0], joined[0, row, 1])
                for vector in range(n_vectors):
                    for lane in range(lanes):
                        goal[vector, 0, lane] -= (
                            part.real * below[vector, 0, lane] - part.imag * below[vector, 1, lane]
                        )
                        goal[vector, 1, lane] -= (
                            part.real * below[vector, 1, lane] + part.imag * below[vector, 0, lane]
                        )
            else:
                factor = z[_at(pivot, row, n_springs)]
                for lane in range(lanes):
                    share = complex(factor[0, lane], factor[1, lane])
                    g = share * complex(below[0, 0, lane], below[0, 1, lane])
                    goal[0, 0, lane] -= g.real
                    goal[0, 1, lane] -= g.imag
                    if n_vectors > 1:
                        t = share * complex(below[1, 0, lane], below[1, 1, lane])
                        goal[1, 0, lane] -= t.real
                        goal[1, 1, lane] -= t.imag
        if pivot == 0:
            for vector in range(n_vectors):
                for lane in range(lanes):
                    moved = complex(first[0, lane], first[1, lane]) * complex(
                        goal[vector, 0, lane], goal[vector, 1, lane]
                    )
                    goal[vector, 0, lane], goal[vector, 1, lane] = moved.real, moved.imag


@_helper
def _settle(product, stored, trusted):  # type: ignore[no-untyped-def]
    """Multiply a group's product into the stored one, and say which lanes can be trusted."""
    for lane in range(product.size):
        trusted[lane] &= 1.0 / LARGEST_PRODUCT < product[lane] < LARGEST_PRODUCT
        stored[lane] *= product[lane]


@_helper
def _inverse(real, imag):  # type: ignore[no-untyped-def]
    """Return one over a complex number."""
    size = 1.0 / (real * real + imag * imag)
    return complex(real * size, -imag * size)


@_helper
def _scale(x, variables, stiffness, k, lanes):  # type: ignore[no-untyped-def]
    """Write factor times stiffness of every spring."""
    for s in range(variables.size):
        factor, real, imag = x[variables[s]], stiffness[s].real, stiffness[s].imag
        for lane in range(lanes):
            k[s, 0, lane] = factor[lane] * real
            k[s, 1, lane] = factor[lane] * imag


@_helper
def _multiply(ratio, k, lanes):  # type: ignore[no-untyped-def]
    """Multiply stiffnesses by complex ratios."""
    for s in range(ratio.shape[0]):
        for lane in range(lanes):
            changed = complex(k[s, 0, lane], k[s, 1, lane]) * complex(
                ratio[s, 0, lane], ratio[s, 1, lane]
            )
            k[s, 0, lane] = changed.real
            k[s, 1, lane] = changed.imag


@_helper
def _follow(tables, line, reached, nominal, k, lanes):  # type: ignore[no-untyped-def]
    """Write the stiffness of springs that follow the amplitude, at ratios of the nominal one."""
    for m in range(tables.follows.size):
        s = tables.follows[m]
        lowest, highest = tables.lowest[line, m], tables.highest[line, m]
        c0, c1, c2, c3 = (
            tables.cubic[line, m, 0],
            tables.cubic[line, m, 1],
            tables.cubic[line, m, 2],
            tables.cubic[line, m, 3],
        )
        for lane in range(lanes):
            t = min(max(reached[m, lane], lowest), highest)
            real = c0.real + t * (c1.real + t * (c2.real + t * c3.real))
            imag = c0.imag + t * (c1.imag + t * (c2.imag + t * c3.imag))
            k[s, 0, lane] = nominal[m, 0, lane] * real - nominal[m, 1, lane] * imag
            k[s, 1, lane] = nominal[m, 0, lane] * imag + nominal[m, 1, lane] * real


@_helper
def _solve(z, load, mass, squared, q, lanes):  # type: ignore[no-untyped-def]
    """Solve the impedance ``Z q = F`` of the powertrain.

    Springs lie along the axes, so the translations do not couple with each other: each is
    eliminated by a division, and a symmetric 3×3 system of the rotations is left (LDLᵀ). `z` holds
    per axis a with the next axes b, c: aa, then a with turns about b and c, then turns bb, bc, cc.
    No pivoting: the impedance of a damped body on mounts has no small pivots.
    """
    f_x, f_y, f_z, f_rx, f_ry, f_rz = load[0], load[1], load[2], load[3], load[4], load[5]
    m = squared * mass[0, 0]
    m_x_ry, m_x_rz, m_y_rz = squared * mass[0, 4], squared * mass[0, 5], squared * mass[1, 5]
    j_x, j_y, j_z = squared * mass[3, 3], squared * mass[4, 4], squared * mass[5, 5]
    j_xy, j_xz, j_yz = squared * mass[3, 4], squared * mass[3, 5], squared * mass[4, 5]
    for lane in range(lanes):
        # springs and inertia
        inv_x = _inverse(z[0, 0, 0, lane] - m, z[0, 0, 1, lane])
        inv_y = _inverse(z[1, 0, 0, lane] - m, z[1, 0, 1, lane])
        inv_z = _inverse(z[2, 0, 0, lane] - m, z[2, 0, 1, lane])
        x_ry = complex(z[0, 1, 0, lane] - m_x_ry, z[0, 1, 1, lane])
        x_rz = complex(z[0, 2, 0, lane] - m_x_rz, z[0, 2, 1, lane])
        y_rz = complex(z[1, 1, 0, lane] - m_y_rz, z[1, 1, 1, lane])
        y_rx = complex(z[1, 2, 0, lane] + m_x_ry, z[1, 2, 1, lane])
        z_rx = complex(z[2, 1, 0, lane] + m_x_rz, z[2, 1, 1, lane])
        z_ry = complex(z[2, 2, 0, lane] + m_y_rz, z[2, 2, 1, lane])
        rx = complex(z[1, 5, 0, lane] + z[2, 3, 0, lane] - j_x, z[1, 5, 1, lane] + z[2, 3, 1, lane])
        ry = complex(z[0, 3, 0, lane] + z[2, 5, 0, lane] - j_y, z[0, 3, 1, lane] + z[2, 5, 1, lane])
        rz = complex(z[0, 5, 0, lane] + z[1, 3, 0, lane] - j_z, z[0, 5, 1, lane] + z[1, 3, 1, lane])
        rx_ry = complex(z[2, 4, 0, lane] - j_xy, z[2, 4, 1, lane])
        rx_rz = complex(z[1, 4, 0, lane] - j_xz, z[1, 4, 1, lane])
        ry_rz = complex(z[0, 4, 0, lane] - j_yz, z[0, 4, 1, lane])
        # eliminate the translations
        rx = rx - y_rx * y_rx * inv_y - z_rx * z_rx * inv_z
        ry = ry - x_ry * x_ry * inv_x - z_ry * z_ry * inv_z
        rz = rz - x_rz * x_rz * inv_x - y_rz * y_rz * inv_y
        rx_ry = rx_ry - z_rx * z_ry * inv_z
        rx_rz = rx_rz - y_rx * y_rz * inv_y
        ry_rz = ry_rz - x_ry * x_rz * inv_x
        g_x, g_y, g_z = f_x * inv_x, f_y * inv_y, f_z * inv_z
        q_rx = f_rx - y_rx * g_y - z_rx * g_z
        q_ry = f_ry - x_ry * g_x - z_ry * g_z
        q_rz = f_rz - x_rz * g_x - y_rz * g_y
        # solve the rotations
        inv_rx = _inverse(rx.real, rx.imag)
        l_ry, l_rz = rx_ry * inv_rx, rx_rz * inv_rx
        ry = ry - l_ry * rx_ry
        ry_rz = ry_rz - l_ry * rx_rz
        rz = rz - l_rz * rx_rz
        q_ry = q_ry - l_ry * q_rx
        inv_ry = _inverse(ry.real, ry.imag)
        l_rz_ry = ry_rz * inv_ry
        rz = rz - l_rz_ry * ry_rz
        q_rz = (q_rz - l_rz * q_rx - l_rz_ry * q_ry) * _inverse(rz.real, rz.imag)
        q_ry = q_ry * inv_ry - l_rz_ry * q_rz
        q_rx = q_rx * inv_rx - l_ry * q_ry - l_rz * q_rz
        # and the translations
        q_x = g_x - (x_ry * q_ry + x_rz * q_rz) * inv_x
        q_y = g_y - (y_rx * q_rx + y_rz * q_rz) * inv_y
        q_z = g_z - (z_rx * q_rx + z_ry * q_ry) * inv_z
        q[0, 0, lane], q[0, 1, lane] = q_x.real, q_x.imag
        q[1, 0, lane], q[1, 1, lane] = q_y.real, q_y.imag
        q[2, 0, lane], q[2, 1, lane] = q_z.real, q_z.imag
        q[3, 0, lane], q[3, 1, lane] = q_rx.real, q_rx.imag
        q[4, 0, lane], q[4, 1, lane] = q_ry.real, q_ry.imag
        q[5, 0, lane], q[5, 1, lane] = q_rz.real, q_rz.imag


@_helper
def _inertia(mass, squared, inertia):  # type: ignore[no-untyped-def]
    """Write the lower triangle of ``ω² M`` by columns."""
    entry = 0
    for column in range(6):
        for row in range(column, 6):
            inertia[entry] = squared * mass[row, column]
            entry += 1


@_helper
def _solve_whole(z, load, inertia, q, lanes):  # type: ignore[no-untyped-def]
    """Solve the impedance ``Z q = F`` of a powertrain on oblique springs.

    Every motion couples with every other: LDLᵀ of the symmetric 6×6 system, written out so that a
    lane stays in registers, and without pivoting as in `_solve`. `z` holds the lower triangle of
    the springs by columns, `inertia` that of ``ω² M``.
    """
    f_0, f_1, f_2, f_3, f_4, f_5 = load[0], load[1], load[2], load[3], load[4], load[5]
    for lane in range(lanes):
        z_00 = complex(z[0, 0, lane] - inertia[0], z[0, 1, lane])
        z_10 = complex(z[1, 0, lane] - inertia[1], z[1, 1, lane])
        z_20 = complex(z[2, 0, lane] - inertia[2], z[2, 1, lane])
        z_30 = complex(z[3, 0, lane] - inertia[3], z[3, 1, lane])
        z_40 = complex(z[4, 0, lane] - inertia[4], z[4, 1, lane])
        z_50 = complex(z[5, 0, lane] - inertia[5], z[5, 1, lane])
        z_11 = complex(z[6, 0, lane] - inertia[6], z[6, 1, lane])
        z_21 = complex(z[7, 0, lane] - inertia[7], z[7, 1, lane])
        z_31 = complex(z[8, 0, lane] - inertia[8], z[8, 1, lane])
        z_41 = complex(z[9, 0, lane] - inertia[9], z[9, 1, lane])
        z_51 = complex(z[10, 0, lane] - inertia[10], z[10, 1, lane])
        z_22 = complex(z[11, 0, lane] - inertia[11], z[11, 1, lane])
        z_32 = complex(z[12, 0, lane] - inertia[12], z[12, 1, lane])
        z_42 = complex(z[13, 0, lane] - inertia[13], z[13, 1, lane])
        z_52 = complex(z[14, 0, lane] - inertia[14], z[14, 1, lane])
        z_33 = complex(z[15, 0, lane] - inertia[15], z[15, 1, lane])
        z_43 = complex(z[16, 0, lane] - inertia[16], z[16, 1, lane])
        z_53 = complex(z[17, 0, lane] - inertia[17], z[17, 1, lane])
        z_44 = complex(z[18, 0, lane] - inertia[18], z[18, 1, lane])
        z_54 = complex(z[19, 0, lane] - inertia[19], z[19, 1, lane])
        z_55 = complex(z[20, 0, lane] - inertia[20], z[20, 1, lane])
        i_0 = _inverse(z_00.real, z_00.imag)
        l_1, l_2, l_3, l_4, l_5 = z_10 * i_0, z_20 * i_0, z_30 * i_0, z_40 * i_0, z_50 * i_0
        z_11 = z_11 - l_1 * z_10
        z_21 = z_21 - l_1 * z_20
        z_31 = z_31 - l_1 * z_30
        z_41 = z_41 - l_1 * z_40
        z_51 = z_51 - l_1 * z_50
        q_1 = f_1 - l_1 * f_0
        z_22 = z_22 - l_2 * z_20
        z_32 = z_32 - l_2 * z_30
        z_42 = z_42 - l_2 * z_40
        z_52 = z_52 - l_2 * z_50
        q_2 = f_2 - l_2 * f_0
        z_33 = z_33 - l_3 * z_30
        z_43 = z_43 - l_3 * z_40
        z_53 = z_53 - l_3 * z_50
        q_3 = f_3 - l_3 * f_0
        z_44 = z_44 - l_4 * z_40
        z_54 = z_54 - l_4 * z_50
        q_4 = f_4 - l_4 * f_0
        z_55 = z_55 - l_5 * z_50
        q_5 = f_5 - l_5 * f_0
        i_1 = _inverse(z_11.real, z_11.imag)
        l_2, l_3, l_4, l_5 = z_21 * i_1, z_31 * i_1, z_41 * i_1, z_51 * i_1
        z_22 = z_22 - l_2 * z_21
        z_32 = z_32 - l_2 * z_31
        z_42 = z_42 - l_2 * z_41
        z_52 = z_52 - l_2 * z_51
        q_2 = q_2 - l_2 * q_1
        z_33 = z_33 - l_3 * z_31
        z_43 = z_43 - l_3 * z_41
        z_53 = z_53 - l_3 * z_51
        q_3 = q_3 - l_3 * q_1
        z_44 = z_44 - l_4 * z_41
        z_54 = z_54 - l_4 * z_51
        q_4 = q_4 - l_4 * q_1
        z_55 = z_55 - l_5 * z_51
        q_5 = q_5 - l_5 * q_1
        i_2 = _inverse(z_22.real, z_22.imag)
        l_3, l_4, l_5 = z_32 * i_2, z_42 * i_2, z_52 * i_2
        z_33 = z_33 - l_3 * z_32
        z_43 = z_43 - l_3 * z_42
        z_53 = z_53 - l_3 * z_52
        q_3 = q_3 - l_3 * q_2
        z_44 = z_44 - l_4 * z_42
        z_54 = z_54 - l_4 * z_52
        q_4 = q_4 - l_4 * q_2
        z_55 = z_55 - l_5 * z_52
        q_5 = q_5 - l_5 * q_2
        i_3 = _inverse(z_33.real, z_33.imag)
        l_4, l_5 = z_43 * i_3, z_53 * i_3
        z_44 = z_44 - l_4 * z_43
        z_54 = z_54 - l_4 * z_53
        q_4 = q_4 - l_4 * q_3
        z_55 = z_55 - l_5 * z_53
        q_5 = q_5 - l_5 * q_3
        i_4 = _inverse(z_44.real, z_44.imag)
        l_5 = z_54 * i_4
        z_55 = z_55 - l_5 * z_54
        q_5 = q_5 - l_5 * q_4
        i_5 = _inverse(z_55.real, z_55.imag)
        q_5 = q_5 * i_5
        q_4 = (q_4 - z_54 * q_5) * i_4
        q_3 = (q_3 - z_43 * q_4 - z_53 * q_5) * i_3
        q_2 = (q_2 - z_32 * q_3 - z_42 * q_4 - z_52 * q_5) * i_2
        q_1 = (q_1 - z_21 * q_2 - z_31 * q_3 - z_41 * q_4 - z_51 * q_5) * i_1
        q_0 = (f_0 - z_10 * q_1 - z_20 * q_2 - z_30 * q_3 - z_40 * q_4 - z_50 * q_5) * i_0
        q[0, 0, lane], q[0, 1, lane] = q_0.real, q_0.imag
        q[1, 0, lane], q[1, 1, lane] = q_1.real, q_1.imag
        q[2, 0, lane], q[2, 1, lane] = q_2.real, q_2.imag
        q[3, 0, lane], q[3, 1, lane] = q_3.real, q_3.imag
        q[4, 0, lane], q[4, 1, lane] = q_4.real, q_4.imag
        q[5, 0, lane], q[5, 1, lane] = q_5.real, q_5.imag


@_helper
def _displace_oblique(q, forward, u, lanes):  # type: ignore[no-untyped-def]
    """Write the displacement of every oblique spring of the powertrain."""
    for s in range(forward.shape[0]):
        for part in range(2):
            for lane in range(lanes):
                total = 0.0
                for motion in range(6):
                    total += forward[s, motion] * q[motion, part, lane]
                u[s, part, lane] = total


@_helper
def _displace(q, levers, u, lanes):  # type: ignore[no-untyped-def]
    """Write the displacement of every spring of the powertrain."""
    n_mounts = levers.shape[1]
    for axis in range(3):
        turn_b, turn_c = q[3 + (axis + 1) % 3], q[3 + (axis + 2) % 3]
        for mount in range(n_mounts):
            b, c = levers[axis, mount, 0], levers[axis, mount, 1]
            for part in range(2):
                for lane in range(lanes):
                    turned = b * turn_b[part, lane] + c * turn_c[part, lane]
                    u[axis * n_mounts + mount, part, lane] = q[axis, part, lane] + turned


@_helper
def _compare(tables, line, u, reached, after, moving, change, tolerance, lanes):  # type: ignore[no-untyped-def]
    """Compare the amplitudes with those the stiffnesses were taken at; say whether any moves."""
    change[:] = -1.0
    for m in range(tables.follows.size):
        s, inverse = tables.follows[m], 1.0 / tables.amplitude[line, m]
        for lane in range(lanes):
            real, imag = u[s, 0, lane], u[s, 1, lane]
            ratio = inverse * np.sqrt(real * real + imag * imag)
            after[m, lane] = ratio
            beyond = abs(ratio - reached[m, lane]) - tolerance * ratio
            change[lane] = max(change[lane], beyond)
    n_moving = 0.0
    for lane in range(lanes):
        moving[lane] = moving[lane] if change[lane] > 0.0 else 0.0
        n_moving += moving[lane]
    return n_moving > 0.0


@_helper
def _halve(reached, after, lanes):  # type: ignore[no-untyped-def]
    """Let the logarithms of the amplitudes go only half of the way."""
    for m in range(after.shape[0]):
        for lane in range(lanes):
            after[m, lane] = np.sqrt(reached[m, lane] * after[m, lane])


@_helper
def _take(reached, after, moving, lanes):  # type: ignore[no-untyped-def]
    """Take the new amplitudes of lanes that still move; the others keep theirs, bit for bit."""
    for m in range(after.shape[0]):
        for lane in range(lanes):
            reached[m, lane] = after[m, lane] if moving[lane] > 0.0 else reached[m, lane]


@_helper
def _foresee(reached, before, steps, lanes):  # type: ignore[no-untyped-def]
    """Guess the amplitudes of the next line: their last change goes on."""
    for m in range(before.shape[0]):
        for lane in range(lanes):
            step = min(max(reached[m, lane] / before[m, lane], steps[0]), steps[1])
            before[m, lane] = reached[m, lane]
            reached[m, lane] *= step


@_helper
def _push(k, u, path, force, lanes):  # type: ignore[no-untyped-def]
    """Write the force of every path: the sum of its springs."""
    force[:] = 0.0
    for s in range(path.size):
        p = path[s]
        if p >= 0:
            for lane in range(lanes):
                pushed = complex(k[s, 0, lane], k[s, 1, lane]) * complex(
                    u[s, 0, lane], u[s, 1, lane]
                )
                force[p, 0, lane] += pushed.real
                force[p, 1, lane] += pushed.imag


@lru_cache
def prescribed_slopes_loop(n_variables: int, lanes: int) -> Callable[..., None]:
    """Return the loop that writes sums of levels and their slopes for prescribed motion.

    It reads and writes as that of `prescribed_loop`, and writes ``Σ_f Re(C_fk / p_f)`` to `slopes`
    (chunk, v, k, lane).
    """

    @_compile
    def run(factors, table, products, slopes, trusted):  # type: ignore[no-untyped-def]
        n_vehicles, n_lines = table.shape[:2]
        x = np.empty((n_variables, lanes))
        product = np.empty(lanes)
        inverse = np.empty((2, lanes))
        for chunk in range(factors.shape[0]):
            x[:] = factors[chunk]
            for vehicle in range(n_vehicles):
                products[chunk, vehicle] = 1.0
                slope = slopes[chunk, vehicle]
                slope[:] = 0.0
                for first in range(0, n_lines, GROUP):
                    product[:] = 1.0
                    for line in range(first, min(first + GROUP, n_lines)):
                        real, imag = table[vehicle, line, 0], table[vehicle, line, 1]
                        for lane in range(lanes):
                            p_real = 0.0
                            p_imag = 0.0
                            for k in range(n_variables):
                                p_real += real[k] * x[k, lane]
                                p_imag += imag[k] * x[k, lane]
                            square = p_real * p_real + p_imag * p_imag
                            product[lane] *= square
                            size = 1.0 / square
                            inverse[0, lane] = p_real * size
                            inverse[1, lane] = p_imag * size
                        for k in range(n_variables):
                            for lane in range(lanes):
                                slope[k, lane] += (
                                    real[k] * inverse[0, lane] + imag[k] * inverse[1, lane]
                                )
                    _settle(product, products[chunk, vehicle, first // STORED], trusted[chunk])

    return run


@lru_cache
def coupled_slopes_loop(
    n_body: int, n_end: int, n_paths: int, oblique: bool, n_vehicles: int, lanes: int
) -> Callable[..., None]:
    """Return the loop that pulls weights of the vehicles' levels back to the design variables.

    It reads factors (chunk, k, lane), weights (chunk, o, v, lane) and `MotionTables` of springs
    that follow no amplitude; it writes ``Σ_fv w_ov Re(∂p_vf/∂x_k / p_vf)`` to `slopes` (chunk, o,
    k, lane).

    With the impedance ``Z = Σ_i x_i K_i v_i v_iᵀ − ω² M``, symmetric, the motion is ``q = Z⁻¹ F``
    and the adjoint of one set of weights ``t = Z⁻¹ Σ_i x_i K_i Y_i v_i`` with the transfer
    ``Y_i = Σ_v (w_v / p_v) Y_vi``; then ``∂/∂x_i = K_i (v_iᵀ q) (Y_i − v_iᵀ t)``. The factors of Z
    serve both solutions, so that a set of weights costs one substitution, whatever the number of
    vehicles.
    """
    n_mounts = n_body // 3
    part_size = min(n_vehicles, SUMMED_TOGETHER)
    n_parts, n_last = divmod(n_vehicles, part_size)

    @_compile
    def run(factors, weights, tables, slopes):  # type: ignore[no-untyped-def]
        n_lines, n_springs = tables.stiffness.shape
        n_sets, n_ends = weights.shape[1], tables.end_mass.size
        k = np.empty((n_springs, 2, lanes))
        u = np.empty((n_springs, 2, lanes))
        pushed = np.empty((n_springs, 2, lanes))
        z = np.empty((21, 2, lanes))
        q = np.empty((6, 2, lanes))
        t = np.empty((6, 2, lanes))
        rigid = np.empty(21)
        end_compliance = np.empty((n_ends, 2, lanes))
        force = np.empty((n_paths, 2, lanes))
        inverse = np.empty((n_vehicles, 2, lanes))
        weighted = np.empty((n_vehicles, 2, lanes))
        transfer = np.empty((n_paths, 2, lanes))
        scaled = np.empty((2, lanes))
        slope = np.empty((weights.shape[1], factors.shape[1], lanes))
        for chunk in range(factors.shape[0]):
            slope[:] = 0.0
            for line in range(n_lines):
                stiffness = tables.stiffness[line]
                _scale(factors[chunk], tables.variables, stiffness, k, lanes)
                _inertia(tables.mass_matrix, tables.squared[line], rigid)
                if oblique:
                    _sum_oblique(k, tables.products, rigid, z, n_body, lanes)
                else:
                    _sum_along_axes(k, tables.levers, rigid, z, n_mounts, lanes)
                _factorise(z, scaled, oblique, lanes)
                for motion in range(6):
                    load = tables.load[line, motion]
                    for lane in range(lanes):
                        q[motion, 0, lane] = load.real
                        q[motion, 1, lane] = load.imag
                _substitute(z, q, oblique, lanes)
                if oblique:
                    _displace_oblique(q, tables.forward, u, lanes)
                else:
                    _displace(q, tables.levers, u, lanes)
                for end in range(n_ends):
                    load = tables.end_load[line, end]
                    inertia = tables.squared[line] * tables.end_mass[end]
                    first = n_body + end * n_end
                    for lane in range(lanes):
                        real, imag = -inertia, 0.0
                        for s in range(n_end):
                            real += k[first + s, 0, lane]
                            imag += k[first + s, 1, lane]
                        compliance = _inverse(real, imag)
                        end_compliance[end, 0, lane] = compliance.real
                        end_compliance[end, 1, lane] = compliance.imag
                        moved = load * compliance
                        for s in range(n_end):
                            u[first + s, 0, lane] = moved.real
                            u[first + s, 1, lane] = moved.imag
                _push(k, u, tables.path, force, lanes)
                for vehicle in range(n_vehicles):
                    y_real = tables.transfer_real[line, vehicle]
                    y_imag = tables.transfer_imag[line, vehicle]
                    for lane in range(lanes):
                        real = 0.0
                        imag = 0.0
                        for path in range(n_paths):
                            real += y_real[path] * force[path, 0, lane]
                            real -= y_imag[path] * force[path, 1, lane]
                            imag += y_real[path] * force[path, 1, lane]
                            imag += y_imag[path] * force[path, 0, lane]
                        size = 1.0 / (real * real + imag * imag)
                        inverse[vehicle, 0, lane] = real * size
                        inverse[vehicle, 1, lane] = -imag * size
                for number in range(n_sets):
                    for vehicle in range(n_vehicles):
                        weight = weights[chunk, number, vehicle]
                        for lane in range(lanes):
                            weighted[vehicle, 0, lane] = weight[lane] * inverse[vehicle, 0, lane]
                            weighted[vehicle, 1, lane] = weight[lane] * inverse[vehicle, 1, lane]
                    transfer[:] = 0.0
                    real, imag = tables.transfer_real[line], tables.transfer_imag[line]
                    for part in range(n_parts):
                        first = part * part_size
                        _add_vehicles(weighted, real, imag, first, part_size, transfer, lanes)
                    first = n_parts * part_size
                    _add_vehicles(weighted, real, imag, first, n_last, transfer, lanes)
                    for s in range(n_springs):
                        p = tables.path[s]
                        if p >= 0:
                            for lane in range(lanes):
                                f = complex(k[s, 0, lane], k[s, 1, lane]) * complex(
                                    transfer[p, 0, lane], transfer[p, 1, lane]
                                )
                                pushed[s, 0, lane] = f.real
                                pushed[s, 1, lane] = f.imag
                        else:
                            pushed[s] = 0.0
                    if oblique:
                        _load_oblique(pushed, tables.forward, t, n_body, lanes)
                    else:
                        _load_along_axes(pushed, tables.levers, t, n_mounts, lanes)
                    _substitute(z, t, oblique, lanes)
                    if oblique:
                        _displace_oblique(t, tables.forward, pushed, lanes)
                    else:
                        _displace(t, tables.levers, pushed, lanes)
                    for end in range(n_ends):
                        first = n_body + end * n_end
                        for lane in range(lanes):
                            real = imag = 0.0
                            for s in range(n_end):
                                real += pushed[first + s, 0, lane]
                                imag += pushed[first + s, 1, lane]
                            answer = complex(real, imag) * complex(
                                end_compliance[end, 0, lane], end_compliance[end, 1, lane]
                            )
                            for s in range(n_end):
                                pushed[first + s, 0, lane] = answer.real
                                pushed[first + s, 1, lane] = answer.imag
                    # `pushed` now holds vᵀ t
                    for s in range(n_springs):
                        p, v = tables.path[s], tables.variables[s]
                        for lane in range(lanes):
                            f = stiffness[s] * complex(u[s, 0, lane], u[s, 1, lane])
                            real, imag = -pushed[s, 0, lane], -pushed[s, 1, lane]
                            if p >= 0:
                                real += transfer[p, 0, lane]
                                imag += transfer[p, 1, lane]
                            slope[number, v, lane] += f.real * real - f.imag * imag
            slopes[chunk] = slope

    return run


@_helper
def _add_vehicles(weighted, y_real, y_imag, first, count, transfer, lanes):  # type: ignore[no-untyped-def]
    """Add the weighted transfer functions of `count` vehicles from `first` on, path by path."""
    for path in range(transfer.shape[0]):
        for lane in range(lanes):
            real = transfer[path, 0, lane]
            imag = transfer[path, 1, lane]
            for vehicle in range(first, first + count):
                real += weighted[vehicle, 0, lane] * y_real[vehicle, path]
                real -= weighted[vehicle, 1, lane] * y_imag[vehicle, path]
                imag += weighted[vehicle, 0, lane] * y_imag[vehicle, path]
                imag += weighted[vehicle, 1, lane] * y_real[vehicle, path]
            transfer[path, 0, lane] = real
            transfer[path, 1, lane] = imag


@_helper
def _sum_along_axes(k, levers, inertia, z, n_mounts, lanes):  # type: ignore[no-untyped-def]
    """Write the lower triangle, by columns, of the impedance of springs along the axes."""
    for entry in range(21):
        for lane in range(lanes):
            z[entry, 0, lane] = -inertia[entry]
            z[entry, 1, lane] = 0.0
    for axis in range(3):
        turn_b, turn_c = 3 + (axis + 1) % 3, 3 + (axis + 2) % 3
        low, high = min(turn_b, turn_c), max(turn_b, turn_c)
        at_aa, at_ab, at_ac = _entry(axis, axis), _entry(turn_b, axis), _entry(turn_c, axis)
        at_bb, at_bc, at_cc = _entry(turn_b, turn_b), _entry(high, low), _entry(turn_c, turn_c)
        for part in range(2):
            for lane in range(lanes):
                aa = ab = ac = bb = bc = cc = 0.0
                for mount in range(n_mounts):
                    b, c = levers[axis, mount, 0], levers[axis, mount, 1]
                    spring = k[axis * n_mounts + mount, part, lane]
                    aa += spring
                    ab += spring * b
                    ac += spring * c
                    bb += spring * b * b
                    bc += spring * b * c
                    cc += spring * c * c
                z[at_aa, part, lane] += aa
                z[at_ab, part, lane] += ab
                z[at_ac, part, lane] += ac
                z[at_bb, part, lane] += bb
                z[at_bc, part, lane] += bc
                z[at_cc, part, lane] += cc


@_helper
def _entry(row, column):  # type: ignore[no-untyped-def]
    """Return the place of an entry of a lower triangle by columns."""
    return column * 6 - column * (column - 1) // 2 + row - column


@_helper
def _sum_oblique(k, products, inertia, z, n_body, lanes):  # type: ignore[no-untyped-def]
    """Write the lower triangle, by columns, of the impedance of oblique springs."""
    for entry in range(21):
        for part in range(2):
            mass = inertia[entry] if part == 0 else 0.0
            for lane in range(lanes):
                total = -mass
                for s in range(n_body):
                    total += k[s, part, lane] * products[s, entry]
                z[entry, part, lane] = total


@_helper
def _is_coupled(row, column, oblique):  # type: ignore[no-untyped-def]
    """Say whether two motions couple: springs along the axes leave translations uncoupled."""
    return oblique or (row >= 3 and (column >= 3 or row - column != 3))


@_helper
def _factorise(z, scaled, oblique, lanes):  # type: ignore[no-untyped-def]
    """Replace the lower triangle of Z by the inverse diagonal and the factors of LDLᵀ."""
    for column in range(6):
        at = _entry(column, column)
        for lane in range(lanes):
            inverse = _inverse(z[at, 0, lane], z[at, 1, lane])
            z[at, 0, lane] = inverse.real
            z[at, 1, lane] = inverse.imag
        for row in range(column + 1, 6):
            if _is_coupled(row, column, oblique):
                factor = _entry(row, column)
                for lane in range(lanes):
                    part = complex(z[factor, 0, lane], z[factor, 1, lane]) * complex(
                        z[at, 0, lane], z[at, 1, lane]
                    )
                    scaled[0, lane] = part.real
                    scaled[1, lane] = part.imag
                for below in range(row, 6):
                    if _is_coupled(below, column, oblique):
                        other, goal = _entry(below, column), _entry(below, row)
                        for lane in range(lanes):
                            part = complex(scaled[0, lane], scaled[1, lane]) * complex(
                                z[other, 0, lane], z[other, 1, lane]
                            )
                            z[goal, 0, lane] -= part.real
                            z[goal, 1, lane] -= part.imag
                z[factor] = scaled


@_helper
def _substitute(z, q, oblique, lanes):  # type: ignore[no-untyped-def]
    """Replace a load by the motion that it causes, with the factors of `_factorise`."""
    for column in range(6):
        for row in range(column + 1, 6):
            if _is_coupled(row, column, oblique):
                factor = _entry(row, column)
                for lane in range(lanes):
                    part = complex(z[factor, 0, lane], z[factor, 1, lane]) * complex(
                        q[column, 0, lane], q[column, 1, lane]
                    )
                    q[row, 0, lane] -= part.real
                    q[row, 1, lane] -= part.imag
    for column in range(6):
        at = _entry(column, column)
        for lane in range(lanes):
            moved = complex(z[at, 0, lane], z[at, 1, lane]) * complex(
                q[column, 0, lane], q[column, 1, lane]
            )
            q[column, 0, lane] = moved.real
            q[column, 1, lane] = moved.imag
    for down in range(6):
        column = 5 - down
        for row in range(column + 1, 6):
            if _is_coupled(row, column, oblique):
                factor = _entry(row, column)
                for lane in range(lanes):
                    part = complex(z[factor, 0, lane], z[factor, 1, lane]) * complex(
                        q[row, 0, lane], q[row, 1, lane]
                    )
                    q[column, 0, lane] -= part.real
                    q[column, 1, lane] -= part.imag


@_helper
def _load_along_axes(pushed, levers, t, n_mounts, lanes):  # type: ignore[no-untyped-def]
    """Write the load of forces of springs along the axes, ``Σ v f``."""
    for axis in range(3):
        # a turn about this axis moves springs along the axes before the last and before it
        first, second = (axis + 2) % 3, (axis + 1) % 3
        for part in range(2):
            for lane in range(lanes):
                force = 0.0
                moment = 0.0
                for mount in range(n_mounts):
                    force += pushed[axis * n_mounts + mount, part, lane]
                    moment += pushed[first * n_mounts + mount, part, lane] * levers[first, mount, 0]
                    moment += (
                        pushed[second * n_mounts + mount, part, lane] * levers[second, mount, 1]
                    )
                t[axis, part, lane] = force
                t[3 + axis, part, lane] = moment


@_helper
def _load_oblique(pushed, forward, t, n_body, lanes):  # type: ignore[no-untyped-def]
    """Write the load of forces of oblique springs, ``Σ v f``."""
    for motion in range(6):
        for part in range(2):
            for lane in range(lanes):
                total = 0.0
                for s in range(n_body):
                    total += forward[s, motion] * pushed[s, part, lane]
                t[motion, part, lane] = total
