"""Reaction forces of hoses, and hoses in the data although they are said to be absent."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import gamma

from deboom.arrays import PERCENT, BoolArray, ComplexArray, RealArray
from deboom.compressor.hose_identification import DRAWN
from deboom.compressor.hoses import (
    SweepPair,
    changed_hose,
    hose_matrices,
    motion_at_virtual_point,
    point_derivatives,
    running_mass,
    sweep_pairs,
)
from deboom.compressor.identified_compressor import HOSE_ALARM, HosePresence, Identification
from deboom.compressor.inertance_fit import thinned
from deboom.compressor.model import applied
from deboom.compressor.routes import MountsApart
from deboom.compressor.unbalance_load import RotationSense, gas_columns, rotor_columns
from deboom.measurement.channels import Frf
from deboom.measurement.compressor_test import HoseDrawing, OperatingSweep, OperatingTest

REACTION_BANDS = ((30.0, 60.0), (60.0, 90.0), (90.0, 120.0), (120.0, 150.0))
"""In which the reaction is judged; the upper end belongs to the last only [Hz]."""
PRESENT_FROM = 0.99
"""Share of tests without hoses that stay below the floor."""
MODEL_ERROR = 0.01
"""Relative error that compressor and placement bring into load or inertance, 1 σ [1]."""
REFINEMENTS = 12
SMALLEST_SHARE = 0.5
SOUGHT_IN = (20.0, 150.0)
"""Lines on which hoses are looked for [Hz]."""
SMALLEST_LINES, LARGEST_LINES = 20, 48


@dataclass(frozen=True)
class ReactionBand:
    """Reaction of the hoses in one band.

    `low`, `high`: band [Hz]; `share`: root mean square over the lines of the reaction over the
    source's load, noise taken off [1]; `floor`: what two sweeps without hoses would show at most,
    by their noise alone [1]; `measured`: as `share`, with the noise in it; a reaction counts as
    detected above `floor` [1].
    """

    low: float
    high: float
    share: float
    floor: float
    measured: float

    @property
    def detected(self) -> bool:
        """Whether more than noise was seen."""
        return self.measured > self.floor

    @property
    def statement(self) -> str:
        """One sentence for the report."""
        where = f"{self.low:.0f} to {self.high:.0f} Hz"
        if self.detected:
            return (
                f"In {where} the hoses push back with {PERCENT * self.share:.1f} % of the source's "
                f"load (floor {PERCENT * self.floor:.1f} %)."
            )
        floor = PERCENT * self.floor
        return f"In {where} no reaction of the hoses rises above the floor of {floor:.1f} %."


@dataclass(frozen=True, eq=False)
class HoseReaction:
    """Reaction of the hoses at one pressure.

    `reaction` (n_frequency, 6): load of the standard hoses on the compressor at the virtual point
    [N, N m].
    """

    pressure: float
    reaction: ComplexArray
    bands: tuple[ReactionBand, ...]


def hose_reactions(
    test: OperatingTest,
    identification: Identification,
    *,
    change: Callable[[RealArray], ComplexArray] | None = None,
    sense: RotationSense = RotationSense.POSITIVE,
) -> tuple[HoseReaction, ...]:
    """Find the reaction of the hoses at each pressure that was run with and without them.

    - `test`: sweeps of the running compressor.
    - `identification`: model from its hammer test without hoses.
    - `change`, optional: lines (n_frequency,) [Hz] → δ of the mounts' stiffness in operation,
      complex [1]; none by default.
    - `sense`: sense of the rotor.
    - raises InputError: no pressure with standard and soft hoses.
    """
    reactions = []
    for pair in sweep_pairs(test, identification):
        mass, _ = running_mass(
            identification,
            pair.frequency,
            change=0.0 if change is None else change(pair.frequency),
            rotor_inertia=test.rotor_inertia,
            sense=sense,
        )
        reactions.append(hose_reaction(pair, mass, identification.length))
    return tuple(reactions)


def hose_reaction(pair: SweepPair, apparent_mass: ComplexArray, length: float) -> HoseReaction:
    """Take the reaction of the hoses out of two sweeps.

    With F the load of rotor and gas: ``F = AM a_soft``, ``F + R = AM a_standard``, hence
    ``R = AM (a_standard − a_soft)``. An error of AM or of a sensor scales R and feigns none. What
    does feign one is noise, and mounts that changed between the sweeps. The floor is the 99th
    percentile of the band's mean of ``|R|²/|F|²`` under noise alone, a gamma law of the mean and
    the variance of that quadratic form (Satterthwaite 1946).
    """
    source, reaction = (
        applied(apparent_mass, motion) for motion in (pair.soft, pair.standard - pair.soft)
    )
    adjoint = np.swapaxes(apparent_mass.conj(), -1, -2)
    covariance = np.asarray(apparent_mass @ pair.covariance @ adjoint)
    weight = np.repeat([1.0, 1 / length], 3)
    size = np.linalg.norm(source * weight, axis=1)
    share = np.linalg.norm(reaction * weight, axis=1) / size
    # both parts carry the covariance, and the quadratic form adds them up
    scaled = 2 * covariance * np.outer(weight, weight) / size[:, np.newaxis, np.newaxis] ** 2
    judged = []
    for low, high in REACTION_BANDS:
        last = high == REACTION_BANDS[-1][1]
        lines = (pair.frequency >= low) & (
            (pair.frequency <= high) if last else (pair.frequency < high)
        )
        if lines.any():
            noise, squared = scaled[lines], float(np.mean(share[lines] ** 2))
            mean = float(np.trace(noise, axis1=1, axis2=2).real.mean())
            variance = float(np.sum(np.abs(noise) ** 2)) / len(noise) ** 2
            floor = gamma.ppf(PRESENT_FROM, mean**2 / variance, scale=variance / mean)
            roots = np.sqrt([max(squared - mean, 0.0), floor, squared])
            judged.append(ReactionBand(low, high, *(float(root) for root in roots)))
    return HoseReaction(pair.pressure, reaction, tuple(judged))


def hoses_in_sweep(
    sweep: OperatingSweep,
    hoses: Sequence[HoseDrawing],
    identification: Identification,
    *,
    rotor_inertia: float | None = None,
    sense: RotationSense = RotationSense.POSITIVE,
) -> HosePresence | None:
    """Look for the drawn hoses in one sweep, whatever it is said to be.

    `rotor_inertia`: polar moment of the rotor [kg m²]. Returns None where fewer than 20 lines lie
    in `SOUGHT_IN`. InputError: other sensors, or a misfit above `HOSE_ALARM` and no drawing.

    ``AM a = S x + δ (v K/ω²) a + s (K_h/ω²) a``: rotor and gas have five numbers over the whole
    run-up, the mounts a smooth change δ and one in each direction by itself, and only hoses
    resonate in between. Least squares in x, δ, the share s of the hoses and s times their
    deviations from the drawing, linear in all of them and repeated where these end.
    """
    motion, covariance = motion_at_virtual_point(sweep, identification)
    kept = _sought(sweep.frequency)
    if np.count_nonzero(kept) < SMALLEST_LINES:
        return None
    lines, motion, covariance = sweep.frequency[kept], motion[kept], covariance[kept]
    mass, mounts = running_mass(identification, lines, rotor_inertia=rotor_inertia, sense=sense)
    load = applied(mass, motion)
    weight = np.repeat([1.0, 1 / identification.length], 3)
    adjoint = np.swapaxes(mass.conj(), -1, -2)
    model = (MODEL_ERROR * np.linalg.norm(load * weight, axis=1)) ** 2 / 6
    noise = mass @ covariance @ adjoint
    noise = noise + model[:, np.newaxis, np.newaxis] * np.diag(weight**-2)
    whiten = np.linalg.inv(np.linalg.cholesky(noise))
    gas = np.broadcast_to(gas_columns(sense), (lines.size, 6, 3))
    source = np.moveaxis(np.concatenate([rotor_columns(lines, sense), gas], axis=2), -1, 0)
    # mounts that changed one by one must not pass for hoses
    change = MountsApart()
    by_mounts = applied(change.matrices(lines, mounts, motion), motion)
    free = np.concatenate([source, 1j * source, by_mounts])

    def white(loads: ComplexArray) -> ComplexArray:
        return np.asarray((whiten @ loads[..., np.newaxis])[..., 0])

    return _presence(
        f"sweep {sweep.name}",
        white(load),
        white(free),
        np.concatenate([np.full(2 * len(source), np.inf), change.deviations]),
        lambda stiffness: white(applied(stiffness, motion)),
        hoses,
        lines,
    )


def hoses_in_hammer_test(
    name: str, inertance: Frf, length: float, hoses: Sequence[HoseDrawing]
) -> HosePresence | None:
    """Look for the drawn hoses in a hammer test that is said to be without them.

    `length`: characteristic length by which rotations are scaled [m]. Returns None where fewer than
    20 lines lie in `SOUGHT_IN`. InputError: a misfit above `HOSE_ALARM` and no drawing.

    ``H = H (M − v(f) K/ω²) H − s H (K_h/ω²) H`` with H as measured: one step from the measurement
    itself, linear in M, K and s. M and K are any 6×6 matrices and v runs through real and imaginary
    parts of three powers of lg f, so that misplaced sensors and any rubber fit; hoses that
    resonate do not.
    """
    kept = _sought(inertance.frequency)
    if np.count_nonzero(kept) < SMALLEST_LINES:
        return None
    kept = thinned(kept, LARGEST_LINES)
    lines = inertance.frequency[kept]
    weight = np.outer(*(np.repeat([1.0, length], 3),) * 2)
    scaled = inertance.values[kept] * weight
    noise = MODEL_ERROR * np.linalg.norm(scaled, axis=(1, 2), keepdims=True) / 6
    basis = np.eye(36).reshape(36, 1, 6, 6)
    octaves = np.log2(lines / lines.mean())
    real = np.stack([octaves**power for power in range(3)]) * (lines.mean() / lines) ** 2
    rubber = np.concatenate([real, 1j * real])
    mounts = (rubber[:, np.newaxis, :, np.newaxis, np.newaxis] * basis).reshape(
        -1, lines.size, 6, 6
    )
    body = np.broadcast_to(basis, (36, lines.size, 6, 6))
    free = scaled @ np.concatenate([body, mounts]) @ scaled / noise
    return _presence(
        f"hammer test {name}",
        np.asarray(scaled / noise),
        np.asarray(free, dtype=complex),
        np.full(len(free), np.inf),
        lambda stiffness: np.asarray(-(scaled @ (stiffness / weight) @ scaled) / noise),
        hoses,
        lines,
    )


def _sought(frequency: RealArray) -> BoolArray:
    """Lines on which hoses are looked for."""
    return np.asarray((frequency >= SOUGHT_IN[0]) & (frequency <= SOUGHT_IN[1]))


def _presence(
    where: str,
    target: ComplexArray,
    columns: ComplexArray,
    prior_deviations: RealArray,
    by_stiffness: Callable[[ComplexArray], ComplexArray],
    hoses: Sequence[HoseDrawing],
    lines: RealArray,
) -> HosePresence:
    """Fit a share of the hoses beside all else that the target may be.

    The target (...) has white noise of unit deviation in both parts. The real columns (k, ...) need
    no hose, with prior deviations `prior_deviations` (k,); `by_stiffness` makes columns (p, ...) of
    ``K_h/ω²`` (p, n_frequency, 6, 6).
    """
    squared = ((2 * np.pi * lines) ** 2)[:, np.newaxis, np.newaxis]
    explained = np.vstack([_real(columns).T, np.diag(1 / prior_deviations)])
    directions, _ = np.linalg.qr(explained / np.linalg.norm(explained, axis=0))

    def beside(rows: RealArray) -> RealArray:
        """Leave what nothing else explains of rows, shape (p, n); at its priors they are zero."""
        longer = np.hstack([rows, np.zeros((len(rows), prior_deviations.size))])
        return np.asarray(longer - (longer @ directions) @ directions.T)

    def columns_of(stiffness: ComplexArray) -> RealArray:
        return beside(_real(by_stiffness(np.asarray(stiffness / squared, dtype=complex))))

    (left,) = beside(_real(target[np.newaxis]))
    size = left.size - prior_deviations.size
    numbers = np.zeros((len(hoses), DRAWN.size))
    squares = float(left @ left)
    best = squares
    misfit = float(np.sqrt(squares / size))
    for _ in range(REFINEMENTS if misfit > HOSE_ALARM else 0):
        now = [changed_hose(hose, row) for hose, row in zip(hoses, numbers, strict=True)]
        whole = columns_of(hose_matrices(now, lines).point[np.newaxis])
        slopes = point_derivatives(hoses, numbers, lines).reshape(-1, lines.size, 6, 6)
        missed, share, step = _step(np.vstack([whole, columns_of(slopes)]), left, numbers)
        best = min(best, missed)
        if share <= 0:
            # hoses that are not there have no numbers
            break
        # resonances that are passed over make whole steps swing
        numbers = numbers + step / 2
    return HosePresence(where, misfit, float(np.sqrt(best / size)))


def _step(
    columns: RealArray, left: RealArray, numbers: RealArray
) -> tuple[float, float, RealArray]:
    """Squares missed, share of the hoses and step of their numbers, shape (n_hose, 11)."""
    deviations = np.tile(DRAWN, len(numbers))
    near_drawing = np.hstack([np.zeros((deviations.size, 1)), np.diag(1 / deviations)])
    matrix = np.vstack([columns.T, near_drawing])
    right = np.concatenate([left, -numbers.reshape(-1) / deviations])
    unit = np.linalg.norm(matrix, axis=0)
    values = np.linalg.lstsq(matrix / unit, right)[0] / unit
    missed = float(np.sum((right - matrix @ values) ** 2))
    share = float(values[0])
    # far from the true numbers the share comes out too small; hoses are whole or not there
    step = values[1:].reshape(numbers.shape) / max(share, SMALLEST_SHARE)
    return missed, share, np.asarray(np.clip(step, -DRAWN, DRAWN))


def _real(columns: ComplexArray) -> RealArray:
    """Real and imaginary parts by turns, one row per column, shape (k, n)."""
    return np.ascontiguousarray(columns.reshape(columns.shape[0], -1)).view(float)
