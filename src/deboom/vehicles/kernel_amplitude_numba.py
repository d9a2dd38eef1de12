"""Amplitude-dependent motion compiled with numba: in search time, with the plain solution's digits.

The iteration is that of `deboom.vehicles.amplitude_motion.solve_along_lines`, lane by lane; the
loops are written by `deboom.vehicles.kernel_amplitude_source`. Sums of logarithms and their guard
are as in `deboom.vehicles.kernel_numba`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from deboom.arrays import RealArray
from deboom.vehicles.amplitude_motion import MOST_SWEEPS, TOLERANCE, AmplitudeMotion
from deboom.vehicles.kernel_amplitude_numpy import AmplitudeSum, NumpyAmplitudeKernel
from deboom.vehicles.kernel_amplitude_source import LANES, AmplitudePattern, amplitude_source
from deboom.vehicles.kernel_numba import (
    FACTOR_RANGE,
    GROUP,
    GROUP_RANGE,
    GROUPS,
    aligned,
    compile_loops,
    coupled_pattern,
)
from deboom.vehicles.scaled_equations import ScaledEquations, scaled_equations

BLOCKS = 16
"""Blocks of lanes per call where a factor changes stiffnesses line by line: bounds the memory."""

Products = tuple[RealArray, np.typing.NDArray[np.bool_]]


@dataclass(frozen=True, eq=False)
class NumbaAmplitudeSum:
    """Sums of levels over the lines of one load case, compiled; the kernel's `prepare` makes it.

    Parameters
    ----------
    motion : AmplitudeMotion
        Of the load case.
    pattern : AmplitudePattern
        What the loops are written for.
    tables : tuple of array
        In the order of the loops' arguments.
    scale_level : array, shape (n_vehicle,)
        Sum over the lines of what scaling took out [dB re 1 Pa].
    tolerance : float
        Largest relative change of an amplitude in the last sweep [1].
    careful : AmplitudeSum
        Computes designs whose products leave the range, or whose amplitudes did not come to rest.
    """

    motion: AmplitudeMotion
    pattern: AmplitudePattern
    tables: tuple[RealArray, ...]
    scale_level: RealArray
    tolerance: float
    careful: AmplitudeSum

    def __call__(self, designs: RealArray) -> RealArray:
        """Return ``Σ_f 20 lg |p_f|`` of each design and vehicle.

        Parameters
        ----------
        designs : array, shape (n, n_variable)
            Stiffness factors, finite [1].

        Returns
        -------
        array, shape (n, n_vehicle)
            [dB re 1 Pa]; NaN where amplitudes do not come to rest.
        """
        level = np.empty((len(designs), self.scale_level.size))
        step = BLOCKS * LANES if self.pattern.ratio else max(len(designs), 1)
        for start in range(0, len(designs), step):
            rows = np.ascontiguousarray(designs[start : start + step], dtype=float)
            with np.errstate(all="ignore"):
                product, trusted = self._products(rows)
                neper = np.log(product).sum(axis=1).T
            found = 10.0 / np.log(10.0) * neper + self.scale_level
            if not trusted.all():
                found[~trusted] = self.careful(rows[~trusted])
            level[start : start + step] = found
        return level

    def sweeps(self, designs: RealArray) -> float:
        """Solutions per line of designs (n, n_variable), mean over lines and blocks [1]."""
        counts = np.zeros(-(-len(designs) // LANES), dtype=np.int64)
        self._products(np.ascontiguousarray(designs, dtype=float), counts)
        return float(counts.mean() / self.motion.frequency.size)

    def _products(self, designs: RealArray, sweeps: Any = None) -> Products:
        """Return products of ``|p|²`` (n_vehicle, n_part, n), and which designs to trust."""
        n, n_line, n_vehicle = len(designs), self.motion.frequency.size, self.scale_level.size
        n_block, group = -(-n // LANES), GROUP["float64"]
        stores = np.empty((n_vehicle, -(-n_line // (GROUPS * group)), n_block * LANES))
        lowest, highest = np.ones((2, n_vehicle, n_block * LANES))
        lost = np.zeros(n_block * LANES)
        counts = np.zeros(n_block, dtype=np.int64) if sweeps is None else sweeps
        rows = (designs.shape[1], *[n_vehicle] * 3, *self.pattern.rows)
        work = tuple(aligned(max(k, 1) * LANES, np.dtype(np.float64)) for k in rows)
        total = aligned(n_vehicle * LANES, np.dtype(np.float64))
        _compiled(self.pattern)(
            *(designs, self._ratio(designs, n_block), *self.tables, 1.0, self.tolerance),
            *(MOST_SWEEPS, group, GROUPS * group, work, total, stores, lowest, highest),
            *(lost, counts),
        )
        product, limit = stores[:, :, :n], GROUP_RANGE["float64"]
        size = np.abs(designs).max(axis=1)
        trusted = (size > 1.0 / FACTOR_RANGE) & (size < FACTOR_RANGE) & (lost[:n] == 0)
        trusted &= (lowest.min(axis=0) > 1.0 / limit)[:n] & (highest.max(axis=0) < limit)[:n]
        trusted &= (product > 0.0).all(axis=(0, 1)) & np.isfinite(product).all(axis=(0, 1))
        return product, trusted

    def _ratio(self, designs: RealArray, n_block: int) -> RealArray:
        """Lay out what factors do beside scaling, (n_block, n_line, rows of lanes), or nothing."""
        if not self.pattern.ratio:
            return np.ones((1, 1, 1))
        ratio = self.motion.ratio(designs)
        assert ratio is not None
        last = np.minimum(np.arange(n_block * LANES), len(designs) - 1)
        whole = ratio[last].reshape(n_block, LANES, *ratio.shape[1:])
        both = np.stack([whole.real, whole.imag], axis=-1).transpose(0, 2, 3, 4, 1)
        return np.ascontiguousarray(both).reshape(n_block, ratio.shape[1], -1)


@dataclass(frozen=True)
class NumbaAmplitudeKernel:
    """Compiled kernel, a `deboom.vehicles.booming_model.AmplitudeKernel`.

    Parameters
    ----------
    name : str
        What the run's record calls it.
    tolerance : float
        Largest relative change of an amplitude in the last sweep [1].
    """

    name: str = "numba"
    tolerance: float = TOLERANCE

    def prepare(self, motion: AmplitudeMotion) -> NumbaAmplitudeSum:
        """Scale the equations of motion of one load case.

        Numba compiles the loops when they run first.

        Raises
        ------
        InputError
            Numba is not installed.
        """
        equations = scaled_equations(motion.coupled)
        body, _ = coupled_pattern(equations)
        designs = np.ones((1, len(motion.variable_names)))
        pattern = AmplitudePattern(
            body=body,
            variables=tuple(motion.variables.tolist()),
            follows=tuple(np.flatnonzero(motion.follows).tolist()),
            ratio=motion.ratio(designs) is not None,
        )
        _compiled(pattern)
        tables = (
            *_stiffness_tables(motion, pattern),
            _product_table(equations, pattern),
            _load_table(motion, equations),
            _reach_table(motion, pattern),
            _forward_table(equations, pattern),
            _transfer_table(motion, equations, pattern),
        )
        return NumbaAmplitudeSum(
            motion=motion,
            pattern=pattern,
            tables=tuple(np.ascontiguousarray(table, dtype=float) for table in tables),
            scale_level=equations.scale_level,
            tolerance=self.tolerance,
            careful=NumpyAmplitudeKernel(tolerance=self.tolerance).prepare(motion),
        )


NUMBA_AMPLITUDE = NumbaAmplitudeKernel()
"""Amplitude-dependent motion, double precision."""


@cache
def _compiled(pattern: AmplitudePattern) -> Callable[..., None]:
    return compile_loops(amplitude_source(pattern), LANES)


def _parts(values: Any) -> RealArray:
    """Real and imaginary parts side by side along the last axis."""
    return np.stack([values.real, values.imag], axis=-1).reshape(
        *values.shape[:-1], 2 * values.shape[-1]
    )


def _stiffness_tables(
    motion: AmplitudeMotion, pattern: AmplitudePattern
) -> tuple[RealArray, RealArray]:
    base = motion.coupled
    squared = base.angular_frequency_squared[:, np.newaxis]
    stiffness = np.hstack(
        [base.stiffness / squared, base.own_stiffness / (squared * base.own_mass)]
    )
    follows = list(pattern.follows)
    fixed = [k for k in range(stiffness.shape[1]) if k not in follows]
    cubic = stiffness[:, follows, np.newaxis] * motion.cubic[:, follows]
    bounds = np.stack([motion.lowest[:, follows], motion.highest[:, follows]], axis=2)
    followed = np.concatenate([_parts(cubic), bounds], axis=2)
    rows = followed.reshape(len(stiffness), 10 * len(follows))
    return _parts(stiffness[:, fixed]), rows


def _product_table(equations: ScaledEquations, pattern: AmplitudePattern) -> RealArray:
    numbers: list[float] = []
    for i, j in pattern.body.nonzero:
        springs = pattern.body.springs(i, j)
        numbers.append(-equations.mass_matrix[i, j])
        numbers += (equations.forward[springs, i] * equations.forward[springs, j]).tolist()
    return np.array(numbers)


def _load_table(motion: AmplitudeMotion, equations: ScaledEquations) -> RealArray:
    return np.hstack([_parts(equations.load), _parts(motion.coupled.own_load)])


def _reach_table(motion: AmplitudeMotion, pattern: AmplitudePattern) -> RealArray:
    """Return factors from a displacement, or one over ``|y - 1|``, to a ratio of amplitudes."""
    base = motion.coupled
    squared = base.angular_frequency_squared[:, np.newaxis]
    own = np.abs(base.own_load) / (squared * base.own_mass)
    size = np.hstack([np.ones((len(squared), pattern.n_body)), own])
    return np.asarray((size / motion.amplitude)[:, list(pattern.follows)])


def _forward_table(equations: ScaledEquations, pattern: AmplitudePattern) -> RealArray:
    rows = [equations.forward[k, list(pattern.body.directions[k])] for k in pattern.moved]
    return np.concatenate(rows) if rows else np.zeros(1)


def _transfer_table(
    motion: AmplitudeMotion, equations: ScaledEquations, pattern: AmplitudePattern
) -> RealArray:
    """Transfer of each path's force over ω², shape (n_frequency, n_vehicle, 2 n_path)."""
    base = motion.coupled
    firsts = [pieces[0] for pieces in pattern.body.own_paths]
    transmitting = list(pattern.body.transmitting)
    power = equations.power[..., np.newaxis]
    squared = base.angular_frequency_squared[:, np.newaxis]
    body = base.transfer[..., transmitting] * squared * power
    table = np.moveaxis(np.concatenate([body, base.own_transfer[..., firsts] * power], 2), 0, 1)
    return np.concatenate([table.real, table.imag], axis=2)
