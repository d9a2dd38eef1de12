"""Sums of levels over the lines, for many designs; a robust search spends its time here.

The loops of `deboom.vehicles.compiled_loops` do the work. The plain numpy path is their reference;
it takes every number, and computes the designs whose products come near the end of the range of
numbers. Both agree within 1e-9 dB.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from deboom.arrays import BoolArray, ComplexArray, IntArray, RealArray
from deboom.vehicles.amplitude_motion import TOLERANCE, AmplitudeMotion
from deboom.vehicles.coupled_motion import CoupledMotion, FlexibleMotion
from deboom.vehicles.fleet import PathContributions

Case = PathContributions | CoupledMotion
"""One load case in a fleet, with a model of the motion."""

PullBack = Callable[[RealArray], RealArray]
"""Map from weights (o, n, v) to weighted derivatives (o, n, k)."""

BLOCK = 128
"""Designs whose pressure the numpy path holds at a time."""

CHUNKS = 16
"""Chunks of lanes per call of a compiled loop; bounds the memory."""

LARGEST_FACTOR = 1e3
"""Designs with a largest factor beyond this, or below its inverse, go to numpy at once: between
these bounds no product can leave the range of numbers within a group and come back unseen."""

DECIBEL = 20.0 / np.log(10.0)
"""Decibels of a neper [dB]."""

NOTCH = 1e-3
"""Nominal over largest contribution of a line below which the latter scales it [1]."""


@dataclass(frozen=True, eq=False)
class LevelSum:
    """Sum of levels over the lines of one load case, as a function of designs; see `level_sum`.

    - `case`: load case with its model of the motion.
    - `columns`: design variables that the loops read.
    - `tables`: what the compiled loops read; None computes in numpy.
    - `scale_level` (v,): sum over the lines of what scaling took out of the tables [dB re 1 Pa].
    """

    case: Case
    columns: IntArray
    tables: Any
    scale_level: RealArray

    def __call__(self, designs: RealArray) -> RealArray:
        """Return ``Σ_f 20 lg |p_vf|`` of each design and vehicle.

        - `designs` (n, k): stiffness factors, finite [1].
        - returns (n, v): [dB re 1 Pa]. The row of a design depends on it alone, bit for bit. Minus
          infinity where a design silences a line completely; NaN where amplitudes do not come to
          rest.
        """
        if self.tables is None:
            return self._plain(designs)
        from deboom.vehicles import compiled_loops

        lanes = compiled_loops.COUPLED_LANES
        if isinstance(self.case, PathContributions):
            lanes = compiled_loops.PRESCRIBED_LANES
        elif isinstance(self.case, FlexibleMotion):
            lanes = compiled_loops.FLEXIBLE_LANES
        return self._in_chunks(designs, lanes)

    def _in_chunks(self, designs: RealArray, lanes: int) -> RealArray:
        """Return the sums from compiled loops, and in numpy of designs that they cannot tell."""
        level = np.empty((len(designs), self.scale_level.size))
        for first in range(0, len(designs), CHUNKS * lanes):
            rows = designs[first : first + CHUNKS * lanes]
            summed, trusted = self._compiled(rows, lanes)
            if not trusted.all():
                summed[~trusted] = self._plain(rows[~trusted])
            level[first : first + CHUNKS * lanes] = summed
        return level

    def linearised(self, designs: RealArray) -> tuple[RealArray, PullBack]:
        """Return the sums of designs (n, k), (n, v) [dB re 1 Pa], and the pull-back of weights.

        The pull-back maps weights (o, n, v) to ``Σ_v w_onv ∂level_nv/∂x_nk``, (o, n, k). A few
        designs take narrower loops, whose last bit may differ from that of many.
        """
        if self.tables is not None and isinstance(self.case, PathContributions | FlexibleMotion):
            return self._slopes_of_each(designs)

        def plain(rows: RealArray, weights: RealArray) -> RealArray:
            with np.errstate(divide="ignore", invalid="ignore"):
                by_vehicle = self.case.neper_gradient(rows)
            return np.asarray(np.einsum("onv,nvk->onk", weights, by_vehicle))

        def pull_back(weights: RealArray) -> RealArray:
            if not self._adjoint:
                return np.asarray(DECIBEL * plain(designs, weights))
            slopes = self._coupled_slopes(designs, weights)
            lost = ~np.isfinite(slopes).all(axis=(0, 2))
            if lost.any():
                slopes[:, lost] = plain(designs[lost], weights[:, lost])
            return np.asarray(DECIBEL * slopes)

        if self._adjoint:
            return self._in_chunks(designs, _slope_lanes(designs)), pull_back
        return self(designs), pull_back

    @property
    def _adjoint(self) -> bool:
        """Whether slopes come from the compiled adjoint of coupled motion without amplitudes."""
        others = PathContributions | FlexibleMotion | AmplitudeMotion
        return self.tables is not None and not isinstance(self.case, others)

    def compile_slopes(self) -> None:
        """Compile the loops of slopes that `linearised` runs in coupled motion, few designs first.

        numba keeps them on disk, where another process reads them.
        """
        if not self._adjoint:
            return
        from deboom.vehicles import compiled_loops

        for n in (1, compiled_loops.FEW_LANES + 1):
            designs = np.ones((n, len(self.case.variable_names)))
            self._coupled_slopes(designs, np.zeros((1, n, self.scale_level.size)))

    def _coupled_slopes(self, designs: RealArray, weights: RealArray) -> RealArray:
        """Return ``Σ_fv w_onv Re(∂p/∂x_k / p)`` of coupled motion, shape (o, n, k)."""
        from deboom.vehicles import compiled_loops

        lanes, (n_sets, n, n_vehicles) = _slope_lanes(designs), weights.shape
        factors = _in_lanes(designs, lanes)
        by_design = weights.transpose(1, 0, 2).reshape(n, -1)
        lined = _in_lanes(by_design, lanes).reshape(len(factors), n_sets, n_vehicles, lanes)
        slopes = np.empty((len(factors), n_sets, designs.shape[1], lanes))
        run = compiled_loops.coupled_slopes_loop(*self._loop_sizes, n_vehicles, lanes)
        with np.errstate(all="ignore"):
            run(factors, lined, self.tables, slopes)
        flat = slopes.transpose(1, 0, 3, 2).reshape(n_sets, -1, designs.shape[1])
        return np.ascontiguousarray(flat[:, :n])

    def _slopes_of_each(self, designs: RealArray) -> tuple[RealArray, PullBack]:
        """Return what `linearised` does where one loop gives values and slopes of each vehicle.

        Prescribed motion is linear, and a body that gives way has a solution of its own.
        """
        from deboom.vehicles import compiled_loops

        n, lanes = len(designs), _slope_lanes(designs)
        if isinstance(self.case, FlexibleMotion):
            columns = np.arange(designs.shape[1])
            n_springs = self.tables.variables.size
            run = compiled_loops.flexible_loop(
                n_springs, lanes, with_slopes=True, with_further=self.tables.further.size > 0
            )
        else:
            columns = self.columns
            run = compiled_loops.prescribed_slopes_loop(columns.size, lanes)
        factors = np.ascontiguousarray(_in_lanes(designs, lanes)[:, columns])
        n_vehicles, n_lines = self.scale_level.size, self.case.frequency.size
        products = np.empty((len(factors), n_vehicles, -(-n_lines // compiled_loops.STORED), lanes))
        slopes = np.empty((len(factors), n_vehicles, columns.size, lanes))
        trusted = np.ones((len(factors), lanes), dtype=bool)
        with np.errstate(all="ignore"):
            run(factors, self.tables, products, slopes, trusted)
        level, trust = self._settled(designs, products, trusted)
        by_vehicle = np.zeros((n, n_vehicles, designs.shape[1]))
        by_vehicle[..., columns] = slopes.transpose(0, 3, 1, 2).reshape(
            -1, n_vehicles, columns.size
        )[:n]
        if not trust.all():
            level[~trust] = self._plain(designs[~trust])
            with np.errstate(divide="ignore", invalid="ignore"):
                by_vehicle[~trust] = self.case.neper_gradient(designs[~trust])

        def pull_back(weights: RealArray) -> RealArray:
            return np.asarray(DECIBEL * np.einsum("onv,nvk->onk", weights, by_vehicle))

        return level, pull_back

    def _plain(self, designs: RealArray) -> RealArray:
        """Return the sums from pressures, in numpy."""
        level = np.empty((len(designs), len(self.case.vehicle_names)))
        for first in range(0, len(designs), BLOCK):
            rows = designs[first : first + BLOCK]
            with np.errstate(all="ignore"):
                lines = 20.0 * np.log10(np.abs(self.case.pressure(rows)))
            level[first : first + BLOCK] = lines.sum(axis=-1)
        return level

    def _compiled(self, designs: RealArray, lanes: int) -> tuple[RealArray, BoolArray]:
        """Return the sums from compiled loops, and which designs they can be trusted for."""
        from deboom.vehicles import compiled_loops

        factors = _in_lanes(designs, lanes)
        n_lines, n_vehicles = self.case.frequency.size, self.scale_level.size
        n_parts = -(-n_lines // compiled_loops.STORED)
        products = np.empty((len(factors), n_vehicles, n_parts, lanes))
        trusted = np.ones((len(factors), lanes), dtype=bool)
        with np.errstate(all="ignore"):
            if isinstance(self.case, PathContributions):
                run = compiled_loops.prescribed_loop(self.columns.size)
                factors = np.ascontiguousarray(factors[:, self.columns])
                run(factors, self.tables, products, trusted)
            elif isinstance(self.case, FlexibleMotion):
                n_springs = self.tables.variables.size
                run = compiled_loops.flexible_loop(
                    n_springs, lanes, with_slopes=False, with_further=self.tables.further.size > 0
                )
                run(factors, self.tables, products, np.empty((0, 0, 0, 0)), trusted)
            else:
                run = compiled_loops.coupled_loop(*self._loop_sizes, lanes)
                tolerance, ratio = (
                    getattr(self.case, "tolerance", TOLERANCE),
                    self._ratio(designs, lanes),
                )
                run(factors, ratio, self.tables, tolerance, products, trusted)
        return self._settled(designs, products, trusted)

    @property
    def _loop_sizes(self) -> tuple[int, int, int, bool]:
        """Springs of the powertrain and of a wheel end, paths, and whether springs are oblique."""
        assert not isinstance(self.case, PathContributions)
        tables, n_body = self.tables, self.case.bodies[0].variables.size
        n_end = (tables.variables.size - n_body) // max(tables.end_mass.size, 1)
        return n_body, n_end, tables.transfer_real.shape[2], len(tables.forward) > 0

    def _settled(
        self, designs: RealArray, products: RealArray, trusted: BoolArray
    ) -> tuple[RealArray, BoolArray]:
        """Return the sums of levels from products of ``|p|²``, and which of them can be trusted."""
        n = len(designs)
        with np.errstate(all="ignore"):
            neper = np.log(products).sum(axis=2).transpose(0, 2, 1).reshape(-1, products.shape[1])
        largest = np.abs(designs[:, self.columns]).max(axis=1)
        in_range = (largest > 1.0 / LARGEST_FACTOR) & (largest < LARGEST_FACTOR)
        level = 10.0 / np.log(10.0) * neper[:n] + self.scale_level
        return level, trusted.reshape(-1)[:n] & in_range & np.isfinite(level).all(axis=1)

    def _ratio(self, designs: RealArray, lanes: int) -> RealArray:
        """Lay out what factors do beside scaling, (chunk, f, s, 2, lane); empty if nothing."""
        if not isinstance(self.case, AmplitudeMotion) or self.case.ratio is None:
            return np.empty((0, 0, 0, 0, 0))
        ratio = self.case.ratio(designs)[:, :, _spring_order(self.case)]
        parts = np.stack([ratio.real, ratio.imag], axis=-1)
        lined = _in_lanes(parts.reshape(len(designs), -1), lanes)
        return lined.reshape(len(lined), *parts.shape[1:], lanes)


def level_sum(case: Case, *, compiled: bool) -> LevelSum:
    """Prepare the sum of levels of one load case.

    - `case`: load case with its model of the motion.
    - `compiled`: whether to use the compiled loops. Bodies that are no powertrain of six degrees of
      freedom with wheel ends of one are computed in numpy all the same.
    - returns: function from designs (n, k) to sums (n, v); a process pool can carry it.

    Each line is divided by a power of two next to its nominal pressure, which rounds nothing.
    """
    if isinstance(case, PathContributions):
        columns = np.flatnonzero(case.values.any(axis=(0, 1)))
        exponents = _line_exponents(case.values)
        scaled = case.values[..., columns] * np.ldexp(1.0, -exponents)[..., np.newaxis]
        tables: Any = np.stack([scaled.real, scaled.imag], axis=2)
        compiled = compiled and columns.size > 0
    else:
        columns = np.unique(case.variables)
        if isinstance(case, FlexibleMotion):
            today = np.ones((1, len(case.variable_names)))
            forces = np.stack([case.force_in(today, v)[0] for v in range(len(case.vehicle_names))])
            exponents = _line_exponents(case.transfer * forces)
            tables = _flexible_tables(case, exponents) if compiled else None
        else:
            nominal = case.stiffness * case.displacement(case.stiffness)
            exponents = _line_exponents(case.transfer * nominal)
            compiled = compiled and _powertrain_and_wheel_ends(case)
            tables = _motion_tables(case, exponents) if compiled else None
    scale_level = 20.0 * np.log10(2.0) * exponents.sum(axis=1)
    return LevelSum(case, columns, tables if compiled else None, scale_level)


def _slope_lanes(designs: RealArray) -> int:
    """Return how many designs the loops of slopes take side by side."""
    from deboom.vehicles import compiled_loops

    few = len(designs) <= compiled_loops.FEW_LANES
    return compiled_loops.FEW_LANES if few else compiled_loops.SLOPE_LANES


def _in_lanes(rows: RealArray, lanes: int) -> RealArray:
    """Lay out rows (n, k) as (chunk, k, lane), the last chunk filled with the last row."""
    n_chunks = -(-len(rows) // lanes)
    filled = rows[np.minimum(np.arange(n_chunks * lanes), len(rows) - 1)]
    return np.ascontiguousarray(filled.reshape(n_chunks, lanes, -1).transpose(0, 2, 1))


def _line_exponents(contributions: ComplexArray) -> IntArray:
    """Return the exponent of the power of two next to the nominal ``|p|`` of each line, (v, f)."""
    nominal = np.abs(contributions.sum(axis=2))
    largest = np.abs(contributions).max(axis=2)
    return np.asarray(np.frexp(np.maximum(nominal, NOTCH * largest))[1])


def _powertrain_and_wheel_ends(motion: CoupledMotion) -> bool:
    """Say whether the bodies are those of the compiled loops."""
    powertrain, *wheel_ends = motion.bodies
    return (
        len(powertrain.mass_matrix) == 6
        and all(len(end.mass_matrix) == 1 and np.all(end.forward == 1.0) for end in wheel_ends)
        and len({end.variables.size for end in wheel_ends}) <= 1
    )


def _along_axes(motion: CoupledMotion) -> bool:
    """Say whether the springs of the powertrain lie along the axes, as many along each."""
    powertrain = motion.bodies[0]
    along, levers = powertrain.forward[:, :3], powertrain.forward[:, 3:]
    mass, coupling = powertrain.mass_matrix[:3, :3], powertrain.mass_matrix[:3, 3:]
    return bool(
        np.all((along == 1.0).sum(axis=1) == 1)
        and np.count_nonzero(along) == len(along)
        and np.unique(along.sum(axis=0)).size == 1
        and not (along * levers).any()
        and np.array_equal(mass, mass[0, 0] * np.eye(3))
        and np.array_equal(coupling, -coupling.T)
    )


def _spring_order(motion: CoupledMotion) -> IntArray:
    """Return the springs in the order of the loops: powertrain by axis, then wheel ends."""
    if not _along_axes(motion):
        return np.arange(motion.variables.size)
    along = motion.bodies[0].forward[:, :3]
    by_axis = np.argsort(np.argmax(along, axis=1), kind="stable")
    return np.concatenate([by_axis, np.arange(len(along), motion.variables.size)])


def _motion_tables(motion: CoupledMotion, exponents: IntArray) -> Any:
    """Lay out the equations of motion for the compiled loop."""
    from deboom.vehicles.compiled_loops import MotionTables

    powertrain, *wheel_ends = motion.bodies
    order, n_lines = _spring_order(motion), motion.frequency.size
    forward, levers = powertrain.forward, np.empty((3, 0, 2))
    if _along_axes(motion):
        by_axis = forward[order[: powertrain.variables.size]].reshape(3, -1, 6)
        levers = np.stack([by_axis[a][:, [3 + (a + 1) % 3, 3 + (a + 2) % 3]] for a in range(3)])
        forward = forward[:0]
    columns, rows = np.triu_indices(6)
    path, transfer = _paths(motion.transfer[..., order])
    scaled = np.moveaxis(transfer * np.ldexp(1.0, -exponents)[..., np.newaxis], 0, 1)
    springs = order[:0]
    amplitude = lowest = highest = np.empty((n_lines, 0))
    cubic = np.empty((n_lines, 0, 4), dtype=complex)
    if isinstance(motion, AmplitudeMotion):
        springs = np.flatnonzero(motion.follows[order])
        at = order[springs]
        amplitude, cubic = motion.amplitude[:, at], motion.cubic[:, at]
        lowest, highest = motion.lowest[:, at], motion.highest[:, at]
    tables = MotionTables(
        variables=motion.variables[order],
        stiffness=motion.stiffness[:, order],
        levers=levers,
        forward=forward,
        products=forward[:, columns] * forward[:, rows],
        mass_matrix=powertrain.mass_matrix,
        load=powertrain.load,
        squared=motion.angular_frequency_squared,
        end_mass=np.array([float(end.mass_matrix[0, 0]) for end in wheel_ends]),
        end_load=np.hstack([np.empty((n_lines, 0), dtype=complex), *(e.load for e in wheel_ends)]),
        path=path,
        transfer_real=scaled.real,
        transfer_imag=scaled.imag,
        follows=springs,
        amplitude=amplitude,
        cubic=cubic,
        lowest=lowest,
        highest=highest,
    )
    # writable copies: numba compiles once for read-only arrays and once for others
    copies: list[Any] = [np.array(table, order="C") for table in tables]
    return MotionTables(*copies)


def _flexible_tables(motion: FlexibleMotion, exponents: IntArray) -> Any:
    """Lay out springs on bodies that give way for the compiled loop."""
    from deboom.vehicles.compiled_loops import FlexibleTables

    # responses in one body follow each other
    bodies, first = np.unique(motion.body_of, return_index=True)
    matrix = motion.source + motion.receptance[bodies]
    every = motion.transfer * np.ldexp(1.0, -exponents)[..., np.newaxis]
    scaled = every[first]
    below = np.stack([np.broadcast_to(motion.free, scaled.shape), scaled], axis=-1)
    joined = np.moveaxis(np.concatenate([matrix, below], axis=-1), 0, 1)
    tables = FlexibleTables(
        variables=motion.variables,
        compliance=1.0 / motion.stiffness,
        joined=_parts(joined),
        further=_parts(np.moveaxis(every, 0, 1) if len(first) < len(every) else every[:, :0]),
        first=np.append(first, len(every)),
    )
    copies: list[Any] = [np.array(table, order="C") for table in tables]
    return FlexibleTables(*copies)


def _parts(values: ComplexArray) -> RealArray:
    """Return real and imaginary part side by side, on a further axis."""
    return np.stack([values.real, values.imag], axis=-1)


def _paths(transfer: ComplexArray) -> tuple[IntArray, ComplexArray]:
    """Return the path of each spring (-1: none; pieces share one) and transfers (v, f, path)."""
    path = np.full(transfer.shape[2], -1)
    columns: dict[bytes, int] = {}
    for spring in np.flatnonzero(transfer.any(axis=(0, 1))):
        path[spring] = columns.setdefault(transfer[..., spring].tobytes(), len(columns))
    first = [int(np.argmax(path == number)) for number in range(len(columns))]
    return path, transfer[..., first]
