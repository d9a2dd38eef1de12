"""Whether hoses that are said to be absent or soft show in the data all the same."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray, RealOrComplexArray
from deboom.compressor.hose_beams import changed_hose, hose_matrices, point_derivatives
from deboom.compressor.hose_identification import HosePrior
from deboom.compressor.hose_sweeps import motion_at_virtual_point, running_compressor
from deboom.compressor.operating_stiffness import FactorOverFrequency
from deboom.compressor.source_structure import gas_columns, rotor_columns
from deboom.compressor.unbalance_load import RotationSense
from deboom.errors import InputError

if TYPE_CHECKING:
    from deboom.compressor.identify import Identification
    from deboom.measurement.operating_sweep import HoseDrawing, OperatingSweep

ALARM = 1.5
"""Misfit without hoses above which something besides rotor, gas and mounts is at work."""
EXPLAINED = 0.4
"""Part of the squared misfit that the drawn hoses must take away to count as its cause."""
MODEL_ERROR = 0.01
"""Relative error that compressor and placement bring into load or inertance, 1 σ [1]."""
REFINEMENTS = 12
SMALLEST_SHARE = 0.5
SMALLEST_LINES = 20
LARGEST_LINES = 48


@dataclass(frozen=True)
class HosePresence:
    """Whether a measurement that is said to be free of hoses shows them.

    Parameters
    ----------
    where : str
        Sweep or hammer test.
    misfit : float
        Of the best explanation without hoses, in units of noise and of one percent of the signal
        [1].
    misfit_with_hoses : float
        Of the best one with hoses that are near the drawn ones [1].
    """

    where: str
    misfit: float
    misfit_with_hoses: float

    @property
    def explained(self) -> float:
        """Part of the squared misfit that the hoses take away [1]."""
        return 1 - (self.misfit_with_hoses / self.misfit) ** 2

    @property
    def unexplained(self) -> bool:
        """Whether more than rotor, gas and mounts is at work."""
        return self.misfit > ALARM

    @property
    def visible(self) -> bool:
        """Whether that is the drawn hoses."""
        return self.unexplained and self.explained > EXPLAINED

    @property
    def statement(self) -> str:
        """One sentence for the report."""
        if not self.unexplained:
            return f"{self.where}: no hose shows (misfit {self.misfit:.2f}, alarm at {ALARM:g})."
        missed = f"{self.where} is missed by {self.misfit:.1f} times its uncertainty without hoses"
        if self.visible:
            return (
                f"{missed}, and the drawn hoses explain {self.explained:.0%} of that: they were "
                "attached, whatever the label says."
            )
        return (
            f"{missed}, and the drawn hoses explain {self.explained:.0%} of that only: something "
            "else is at work, such as a flexible receiver or a hose unlike its drawing."
        )


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
    run-up, the mounts a smooth change δ, and only hoses resonate in between. Least squares in x, δ,
    the share s of the hoses and s times their deviations from the drawing, linear in all of them
    and repeated where these end.
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
    free = np.concatenate([source, 1j * source, by_mounts])
    deviations = np.concatenate([np.full(2 * len(source), np.inf), change.deviations])
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
    if kept.size > LARGEST_LINES:
        kept = kept[np.round(np.linspace(0, kept.size - 1, LARGEST_LINES)).astype(int)]
    lines, inertance = found.inertance.frequency[kept], found.inertance.values[kept]
    weight = np.repeat([1.0, found.length], 3)
    scaled = inertance * np.outer(weight, weight)
    noise = MODEL_ERROR * np.linalg.norm(scaled, axis=(1, 2), keepdims=True) / 6
    basis = np.eye(36).reshape(36, 1, 6, 6)
    octaves = np.log2(lines / lines.mean())
    real = np.stack([octaves**power for power in range(3)]) * (lines.mean() / lines) ** 2
    rubber = np.concatenate([real, 1j * real])
    held = (rubber[:, np.newaxis, :, np.newaxis, np.newaxis] * basis).reshape(-1, lines.size, 6, 6)
    whole = np.broadcast_to(basis, (36, lines.size, 6, 6))
    free = scaled @ np.concatenate([whole, held]) @ scaled / noise

    def by_stiffness(stiffness: ComplexArray) -> ComplexArray:
        own = stiffness / np.outer(weight, weight)
        return np.asarray(-(scaled @ own @ scaled) / noise)

    return _presence(
        f"hammer test {found.test.name}",
        np.asarray(scaled / noise),
        (np.asarray(free, dtype=complex), np.full(len(free), np.inf)),
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
    squared = ((2 * np.pi * lines) ** 2)[:, np.newaxis, np.newaxis]
    explained = np.vstack([_real(columns).T, np.diag(1 / known)])
    directions, _ = np.linalg.qr(explained / np.linalg.norm(explained, axis=0))

    def beside(rows: RealArray) -> RealArray:
        """Leave what nothing else explains of rows, shape (p, n); at its priors they are zero."""
        longer = np.hstack([rows, np.zeros((len(rows), known.size))])
        return np.asarray(longer - (longer @ directions) @ directions.T)

    def columns_of(stiffness: ComplexArray) -> RealArray:
        return beside(_real(by_stiffness(np.asarray(stiffness / squared, dtype=complex))))

    (left,) = beside(_real(target[np.newaxis]))
    numbers = np.zeros((len(hoses), prior.deviations.size))
    squares = float(left @ left)
    best = squares
    for _ in range(REFINEMENTS):
        now = [changed_hose(hose, row) for hose, row in zip(hoses, numbers, strict=True)]
        own = columns_of(hose_matrices(now, lines).point[np.newaxis])
        slopes = point_derivatives(hoses, numbers, lines).reshape(-1, lines.size, 6, 6)
        missed, share, step = _step(np.vstack([own, columns_of(slopes)]), left, numbers, prior)
        best = min(best, missed)
        if share <= 0:
            # hoses that are not there have no numbers
            break
        # resonances that are passed over make whole steps swing
        numbers = numbers + step / 2
    size = left.size - known.size
    return HosePresence(where, float(np.sqrt(squares / size)), float(np.sqrt(best / size)))


def _step(
    columns: RealArray, left: RealArray, numbers: RealArray, prior: HosePrior
) -> tuple[float, float, RealArray]:
    """Solve for the share and a step (n_hose, 11), held to the drawing; also the squares missed."""
    deviations = np.tile(prior.deviations, len(numbers))
    held = np.hstack([np.zeros((deviations.size, 1)), np.diag(1 / deviations)])
    matrix = np.vstack([columns.T, held])
    right = np.concatenate([left, -numbers.reshape(-1) / deviations])
    unit = np.linalg.norm(matrix, axis=0)
    values = np.linalg.lstsq(matrix / unit, right)[0] / unit
    missed = float(np.sum((right - matrix @ values) ** 2))
    share = float(values[0])
    # far from the true numbers the share comes out too small; hoses are whole or not there
    step = values[1:].reshape(numbers.shape) / max(share, SMALLEST_SHARE)
    limited = np.clip(step, -prior.deviations, prior.deviations)
    return missed, share, np.asarray(limited)


def _lines(frequency: RealArray, band: tuple[float, float], where: str) -> npt.NDArray[np.intp]:
    """Find the lines of a band."""
    kept = np.flatnonzero((frequency >= band[0]) & (frequency <= band[1]))
    if kept.size < SMALLEST_LINES:
        raise InputError(
            f"{where}: fewer than {SMALLEST_LINES} lines lie between {band[0]:g} and {band[1]:g} "
            "Hz: hoses cannot be told from rotor and mounts there"
        )
    return kept


def _applied(matrices: RealOrComplexArray, motion: ComplexArray) -> ComplexArray:
    return np.asarray((matrices @ motion[..., np.newaxis])[..., 0], dtype=complex)


def _real(columns: ComplexArray) -> RealArray:
    return np.ascontiguousarray(columns.reshape(columns.shape[0], -1)).view(float)
