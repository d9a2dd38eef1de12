"""Whether hoses that are said to be absent or soft show in the data all the same."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from deboom.compressor.hose_beams import changed_hose, hose_matrices, point_derivatives
from deboom.compressor.hose_identification import HosePrior
from deboom.compressor.hose_sweeps import motion_at_virtual_point, running_compressor
from deboom.compressor.operating_stiffness import FactorOverFrequency
from deboom.compressor.source_structure import gas_columns, rotor_columns
from deboom.compressor.unbalance_load import RotationSense
from deboom.errors import InputError
from deboom.physics.arrays import ComplexArray, RealArray, RealOrComplexArray

if TYPE_CHECKING:
    from deboom.compressor.identify import Identification
    from deboom.measurement.operating_sweep import HoseDrawing, OperatingSweep

PRESENT = 0.5
"""Share of the drawn hoses above which they count as attached."""
MODEL_ERROR = 0.01
"""Relative error that compressor and placement bring into load or inertance, 1 σ [1]."""
REFINEMENTS = 4
SMALLEST_LINES = 20
LARGEST_LINES = 72


@dataclass(frozen=True)
class HosePresence:
    """How much of the drawn hoses a measurement shows.

    Parameters
    ----------
    where : str
        Sweep or hammer test.
    share : float
        Factor on the stiffness of the drawn hoses that explains the data best; 1 where they hang
        on the compressor, 0 where they do not [1].
    deviation : float
        Of it, 1 σ [1].
    """

    where: str
    share: float
    deviation: float

    @property
    def visible(self) -> bool:
        """Whether the hoses are there."""
        return self.share - self.deviation > PRESENT

    @property
    def undecided(self) -> bool:
        """Whether the measurement leaves it open."""
        return abs(self.share - PRESENT) <= self.deviation

    @property
    def statement(self) -> str:
        """One sentence for the report."""
        size = f"{self.where} shows {self.share:.2f} ± {self.deviation:.2f} of the drawn hoses"
        if self.visible:
            return f"{size}: they were attached, whatever the label says."
        if self.undecided:
            return f"{size}: whether they were attached stays open."
        return f"{size}: they were not attached, or cut off."


def hoses_in_sweep(
    sweep: OperatingSweep,
    hoses: Sequence[HoseDrawing],
    found: Identification,
    *,
    rotor_inertia: float | None = None,
    sense: RotationSense = RotationSense.POSITIVE,
    prior: HosePrior | None = None,
    band: tuple[float, float] = (20.0, 150.0),
) -> HosePresence:
    """Look for the drawn hoses in one sweep, whatever it is said to be.

    Parameters
    ----------
    sweep : OperatingSweep
    hoses : sequence of HoseDrawing
        At least one.
    found : Identification
        Of the hammer test without hoses.
    rotor_inertia : float, optional
        [kg m²]
    sense : RotationSense
    prior : HosePrior, optional
        How well the hoses are known.
    band : (float, float)
        Lines that are used [Hz].

    Returns
    -------
    HosePresence

    Raises
    ------
    InputError
        No drawing, other sensors, or fewer than 20 lines in the band.

    Notes
    -----
    ``AM a = S x + δ (v K/ω²) a + s (K_h/ω²) a``: rotor and gas have five numbers over the whole
    run-up, the mounts a smooth change δ, and only hoses resonate in between. Linear least squares
    in x, δ, s and s times the deviations of the hoses from their drawing, repeated where these end.
    """
    motion, covariance = motion_at_virtual_point(sweep, found)
    kept = _lines(sweep.frequency, band, f"sweep {sweep.name}")
    lines, motion, covariance = sweep.frequency[kept], motion[kept], covariance[kept]
    state = running_compressor(found, lines, rotor_inertia=rotor_inertia, sense=sense)
    load = _applied(state.apparent_mass, motion)
    weight = np.repeat([1.0, 1 / state.length], 3)
    adjoint = np.swapaxes(state.apparent_mass.conj(), -1, -2)
    model = (MODEL_ERROR * np.linalg.norm(load * weight, axis=1)) ** 2 / 6
    noise = state.apparent_mass @ covariance @ adjoint
    noise = noise + model[:, np.newaxis, np.newaxis] * np.diag(weight**-2)
    whiten = np.linalg.inv(np.linalg.cholesky(noise))
    gas = np.broadcast_to(gas_columns(sense), (lines.size, 6, 3))
    source = np.moveaxis(np.concatenate([rotor_columns(lines, sense), gas], axis=2), -1, 0)
    change = FactorOverFrequency()
    by_mounts = change.basis(lines)[..., np.newaxis] * _applied(state.mounts, motion)
    free = np.concatenate([source, 1j * source, by_mounts, 1j * by_mounts])
    deviations = np.concatenate([np.full(2 * len(source), np.inf), *[change.deviations] * 2])
    return _presence(
        f"sweep {sweep.name}",
        _applied(whiten, load),
        (_applied(whiten, free), deviations),
        lambda stiffness: _applied(whiten, _applied(stiffness, motion)),
        (tuple(hoses), lines, prior or HosePrior()),
    )


def hoses_in_hammer_test(
    found: Identification,
    hoses: Sequence[HoseDrawing],
    *,
    prior: HosePrior | None = None,
    band: tuple[float, float] = (20.0, 150.0),
) -> HosePresence:
    """Look for the drawn hoses in a hammer test that is said to be without them.

    Parameters
    ----------
    found : Identification
        Of that test; only its inertance by the position sheet is used, since hoses that were
        overlooked have spoilt the rest.
    hoses : sequence of HoseDrawing
        At least one.
    prior : HosePrior, optional
        How well the hoses are known.
    band : (float, float)
        Lines that are used [Hz].

    Returns
    -------
    HosePresence

    Raises
    ------
    InputError
        No drawing, or fewer than 20 lines in the band.

    Notes
    -----
    ``H = H (M − v(f) K/ω²) H − s H (K_h/ω²) H`` with H as measured: one step from the measurement
    itself, linear in M, K and s. M and K are any 6×6 matrices and v runs through real and imaginary
    parts of three powers of the frequency, so that misplaced sensors and any rubber fit; hoses that
    resonate do not.
    """
    kept = _lines(found.inertance.frequency, band, f"hammer test {found.test.name}")
    if np.count_nonzero(kept) > LARGEST_LINES:
        marked = np.flatnonzero(kept)
        kept = marked[np.round(np.linspace(0, marked.size - 1, LARGEST_LINES)).astype(int)]
    lines, inertance = found.inertance.frequency[kept], found.inertance.values[kept]
    weight = np.repeat([1.0, found.length], 3)
    scaled = inertance * np.outer(weight, weight)
    noise = MODEL_ERROR * np.linalg.norm(scaled, axis=(1, 2), keepdims=True) / 6
    squared = ((2 * np.pi * lines) ** 2)[:, np.newaxis, np.newaxis]
    basis = np.eye(36).reshape(36, 1, 6, 6)
    power = np.log(lines / lines.mean())[:, np.newaxis, np.newaxis] ** np.array(
        [[[[0]]], [[[1]]], [[[2]]]]
    )
    rubber = np.concatenate([power, 1j * power]) / squared * (2 * np.pi * lines.mean()) ** 2
    held = (rubber[:, np.newaxis] * basis).reshape(-1, lines.size, 6, 6)
    whole = np.broadcast_to(basis, (36, lines.size, 6, 6))
    free = scaled @ np.concatenate([whole, held]) @ scaled / noise

    def by_stiffness(stiffness: ComplexArray) -> ComplexArray:
        own = stiffness / np.outer(weight, weight)
        return np.asarray(-(scaled @ own @ scaled) / noise)

    return _presence(
        f"hammer test {found.test.name}",
        np.asarray(scaled / noise),
        (free, np.full(len(free), np.inf)),
        by_stiffness,
        (tuple(hoses), lines, prior or HosePrior()),
    )


def _presence(
    where: str,
    target: ComplexArray,
    free: tuple[ComplexArray, RealArray],
    by_stiffness: Callable[[ComplexArray], ComplexArray],
    drawn: tuple[tuple[HoseDrawing, ...], RealArray, HosePrior],
) -> HosePresence:
    """Fit a share of the hoses beside all else that the target may be.

    Parameters
    ----------
    where : str
        For the statement.
    target : array, shape (...)
        Of white noise with unit deviation in both parts [1].
    free : (array, shape (k, ...), array, shape (k,))
        Real columns that need no hose, and their prior deviations.
    by_stiffness : callable
        ``K_h/ω²`` (p, n_frequency, 6, 6) → columns (p, ...).
    drawn : (tuple of HoseDrawing, array, HosePrior)
        Hoses, lines [Hz] and how well the hoses are known.
    """
    columns, known = free
    hoses, lines, prior = drawn
    n_share = len(columns)
    deviations = np.concatenate([known, [np.inf], np.tile(prior.deviations, len(hoses))])
    squared = ((2 * np.pi * lines) ** 2)[:, np.newaxis, np.newaxis]
    numbers = np.zeros((len(hoses), prior.deviations.size))
    for _ in range(REFINEMENTS):
        now = [changed_hose(hose, row) for hose, row in zip(hoses, numbers, strict=True)]
        slopes = point_derivatives(hoses, numbers, lines).reshape(-1, lines.size, 6, 6)
        stiffness = np.concatenate([hose_matrices(now, lines).point[np.newaxis], slopes])
        rows = np.concatenate([_real(columns), _real(by_stiffness(stiffness / squared))])
        # the prior holds the hoses to their drawing, not to the last step away from it
        pulled = np.concatenate([np.zeros(n_share + 1), -numbers.reshape(-1)]) / deviations
        matrix = np.vstack([rows.T, np.diag(1 / deviations)])
        right = np.concatenate([_real(target[np.newaxis])[0], pulled])
        unit = np.linalg.norm(matrix, axis=0)
        values = np.linalg.lstsq(matrix / unit, right)[0] / unit
        share = float(values[n_share])
        if share < PRESENT / 2:
            # hoses that are not there have no numbers
            break
        steps = (values[n_share + 1 :] / share).reshape(numbers.shape)
        numbers = numbers + np.clip(steps, -prior.deviations, prior.deviations)
    chi = float(np.sqrt(np.mean((right - matrix @ values) ** 2)))
    variance = np.linalg.inv((matrix / unit).T @ (matrix / unit))[n_share, n_share]
    return HosePresence(where, share, float(np.sqrt(variance)) / unit[n_share] * max(chi, 1.0))


def _lines(frequency: RealArray, band: tuple[float, float], where: str) -> RealOrComplexArray:
    """Mark the lines of a band."""
    kept = (frequency >= band[0]) & (frequency <= band[1])
    if np.count_nonzero(kept) < SMALLEST_LINES:
        raise InputError(
            f"{where}: fewer than {SMALLEST_LINES} lines lie between {band[0]:g} and {band[1]:g} "
            "Hz: hoses cannot be told from rotor and mounts there"
        )
    return kept


def _applied(matrices: RealOrComplexArray, motion: ComplexArray) -> ComplexArray:
    return np.asarray((matrices @ motion[..., np.newaxis])[..., 0], dtype=complex)


def _real(columns: ComplexArray) -> RealArray:
    return np.ascontiguousarray(columns.reshape(columns.shape[0], -1)).view(float)
