"""Booming peaks of level curves, and a synthesised pressure beside a measured one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.signal import find_peaks

from deboom.arrays import ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.physics.frf import corr_f, corr_s
from deboom.physics.order_tracking import rpm_of_frequency
from deboom.physics.sound_level import spl

PROMINENCE = 6.0
"""How far a peak rises above the higher of the two valleys beside it, at least [dB]."""

TOLERANCE = 1.5
"""How far a peak may move between two designs and still be the same one [Hz]."""


@dataclass(frozen=True)
class BoomingPeak:
    """A local maximum of the level that stands out.

    - `frequency`: frequency of its line [Hz].
    - `rpm`: engine speed at which the order has that frequency [1/min].
    - `level` [dB(A)].
    - `prominence`: height above the higher of the two valleys that part it from higher ground or
      the end of the band [dB].
    """

    frequency: float
    rpm: float
    level: float
    prominence: float


@dataclass(frozen=True)
class PeakChange:
    """One peak before and after.

    - `frequency`: frequency of the peak before or, where there was none, of the peak after [Hz].
    - `before`, `after`: None where the curve has no booming peak near the other one's.
    - `level_before`, `level_after`: level of the peak or, where there is none, the highest level
      within the tolerance of the other curve's peak [dB(A)].
    """

    frequency: float
    before: BoomingPeak | None
    after: BoomingPeak | None
    level_before: float
    level_after: float


@dataclass(frozen=True)
class MatchedPeaks:
    """Peaks of two curves that are the same one, and those that have no partner.

    - `pairs`: peak of the reference and of the compared curve, by rising frequency.
    - `only_reference`, `only_compared`: peaks of one curve alone, which have no deviation.
    - `tolerance`: largest distance of a pair [Hz].
    """

    pairs: tuple[tuple[BoomingPeak, BoomingPeak], ...]
    only_reference: tuple[BoomingPeak, ...]
    only_compared: tuple[BoomingPeak, ...]
    tolerance: float

    @property
    def level_deviations(self) -> RealArray:
        """Level of the compared peak above that of the reference, one per pair [dB]."""
        return np.array([other.level - peak.level for peak, other in self.pairs])

    @property
    def largest_deviation(self) -> float:
        """Largest absolute level deviation of the pairs; no pair is refused [dB]."""
        if not self.pairs:
            raise InputError(
                f"no two peaks within {self.tolerance:g} Hz of each other: "
                f"{len(self.only_reference)} against {len(self.only_compared)} peaks have no "
                "deviation"
            )
        return float(np.abs(self.level_deviations).max())


def booming_peaks(
    level: npt.ArrayLike,
    frequency: npt.ArrayLike,
    order: float,
    prominence: float = PROMINENCE,
) -> tuple[BoomingPeak, ...]:
    """Return the booming peaks of one level curve, by rising frequency.

    - `level` (n_frequency,): SPL of each line, finite [dB(A)].
    - `frequency` (n_frequency,) [Hz].
    - `order`: engine order of the curve [1].
    - `prominence`: least prominence of a booming peak, above 0 [dB].
    - raises InputError: shapes that differ, a level that is not finite, a prominence or order that
      is not positive.

    Topographic prominence of `scipy.signal.find_peaks`. The first and the last line are no peaks:
    the curve could rise beyond them.
    """
    curve, lines = _checked_curve(level, frequency)
    if not prominence > 0:
        raise InputError(f"a prominence of {prominence} dB finds no peaks: give more than 0 dB")
    positions, properties = find_peaks(curve, prominence=prominence)
    return tuple(
        BoomingPeak(
            frequency=float(lines[position]),
            rpm=float(rpm_of_frequency(lines[position], order)),
            level=float(curve[position]),
            prominence=float(rise),
        )
        for position, rise in zip(positions, properties["prominences"], strict=True)
    )


def compare_peaks(
    level_before: npt.ArrayLike,
    level_after: npt.ArrayLike,
    frequency: npt.ArrayLike,
    order: float,
    prominence: float = PROMINENCE,
    tolerance: float = TOLERANCE,
) -> tuple[PeakChange, ...]:
    """Return the booming peaks of two curves, paired by frequency.

    Peaks are compared with peaks, never line by line: where one curve has a notch, the difference
    of a line says nothing about booming.

    - `level_before`, `level_after` (n_frequency,): SPL of each line, finite [dB(A)].
    - `frequency` (n_frequency,) [Hz].
    - `order`: engine order of the curves [1].
    - `prominence`: least prominence of a booming peak, above 0 [dB].
    - `tolerance`: largest distance of two peaks that are the same one [Hz].
    - returns: changes by rising frequency; each peak of either curve once. The closest peaks are
      paired first.
    - raises InputError: see `booming_peaks`; a tolerance that is negative.
    """
    if not tolerance >= 0:
        raise InputError(f"a tolerance of {tolerance} Hz pairs no peaks: give at least 0 Hz")
    before = booming_peaks(level_before, frequency, order, prominence)
    after = booming_peaks(level_after, frequency, order, prominence)
    partner = _closest_pairs(before, after, tolerance)
    curve_before, lines = _checked_curve(level_before, frequency)
    curve_after, _ = _checked_curve(level_after, frequency)

    def highest(curve: RealArray, peak: BoomingPeak) -> float:
        return float(curve[np.abs(lines - peak.frequency) <= tolerance].max())

    changes = []
    for old in before:
        new = partner.get(old)
        level = new.level if new else highest(curve_after, old)
        changes.append(PeakChange(old.frequency, old, new, old.level, level))
    for new in set(after) - set(partner.values()):
        level = highest(curve_before, new)
        changes.append(PeakChange(new.frequency, None, new, level, new.level))
    return tuple(sorted(changes, key=lambda change: change.frequency))


def match_peaks(
    reference: Sequence[BoomingPeak],
    compared: Sequence[BoomingPeak],
    tolerance: float = TOLERANCE,
) -> MatchedPeaks:
    """Pair the peaks of two curves, such as a measured and a synthesised one, by frequency.

    Levels are compared at the peaks alone, never line by line: in a notch the largest difference of
    the lines says nothing about booming. The curves may have different lines.

    - `reference`, `compared`: see `booming_peaks`.
    - `tolerance`: largest distance of two peaks that are the same one [Hz].
    - raises InputError: a tolerance that is negative.
    """
    if not tolerance >= 0:
        raise InputError(f"a tolerance of {tolerance} Hz pairs no peaks: give at least 0 Hz")
    partner = _closest_pairs(reference, compared, tolerance)
    pairs = tuple((peak, partner[peak]) for peak in reference if peak in partner)
    return MatchedPeaks(
        pairs=pairs,
        only_reference=tuple(peak for peak in reference if peak not in partner),
        only_compared=tuple(peak for peak in compared if peak not in partner.values()),
        tolerance=tolerance,
    )


def _closest_pairs(
    before: Sequence[BoomingPeak], after: Sequence[BoomingPeak], tolerance: float
) -> dict[BoomingPeak, BoomingPeak]:
    """Pair peaks within the tolerance, each at most once, the closest two first."""
    candidates = sorted(
        (abs(old.frequency - new.frequency), old.frequency, new.frequency, old, new)
        for old in before
        for new in after
    )
    partner: dict[BoomingPeak, BoomingPeak] = {}
    for distance, _, _, old, new in candidates:
        if distance <= tolerance and old not in partner and new not in partner.values():
            partner[old] = new
    return partner


def _checked_curve(level: npt.ArrayLike, frequency: npt.ArrayLike) -> tuple[RealArray, RealArray]:
    curve, lines = np.asarray(level, dtype=float), np.asarray(frequency, dtype=float)
    if curve.ndim != 1 or curve.shape != lines.shape:
        raise InputError(
            f"a level curve of shape {curve.shape} over frequencies of shape {lines.shape}: give "
            "one level per line"
        )
    if not np.isfinite(curve).all():
        line = lines[np.flatnonzero(~np.isfinite(curve))[0]]
        raise InputError(f"the level at {line:g} Hz is not finite: a peak has no height beside it")
    return curve, lines


@checked(frequency="f", reference="f", compared="f")
class PressureComparison:
    """Two pressures at one ear over the same lines of an engine order.

    - `frequency` (n_frequency,) [Hz].
    - `order`: engine order of the lines [1].
    - `reference`, `compared` (n_frequency,): complex peak, such as measured and synthesised [Pa].
    - `tolerance`: largest distance of two peaks that are the same one [Hz].
    - raises InputError: arrays of different lengths, a pressure of exactly 0, a negative tolerance.

    The criteria of the thesis (eq. 33, 34) are on pressures, complex and as magnitudes, never on dB
    curves. The scale factor is the one that the compared curve still needs to meet the reference,
    ``MSF = pᴴ p_ref / (pᴴ p)``; the inverse direction has a property of its own, as the thesis does
    not say which it means. Levels are compared at peaks alone, never line by line: in a notch the
    largest difference of the lines says nothing about booming.
    """

    frequency: RealArray
    order: float
    reference: ComplexArray
    compared: ComplexArray
    tolerance: float = TOLERANCE

    @property
    def corr_f(self) -> float:
        """Difference in shape of the complex pressures [1]."""
        return float(corr_f(self.compared, self.reference))

    @property
    def corr_f_magnitude(self) -> float:
        """Difference in shape of the magnitudes [1]."""
        return float(corr_f(np.abs(self.compared), np.abs(self.reference)))

    @property
    def corr_s(self) -> float:
        """Difference in scale, and in a common phase, of the complex pressures [1]."""
        return float(corr_s(self.reference, self.compared))

    @property
    def corr_s_magnitude(self) -> float:
        """Difference in scale of the magnitudes [1]."""
        return float(corr_s(np.abs(self.reference), np.abs(self.compared)))

    @property
    def corr_s_of_reference(self) -> float:
        """The same the other way round, relative to the reference [1]."""
        return float(corr_s(np.abs(self.compared), np.abs(self.reference)))

    @property
    def levels(self) -> tuple[RealArray, RealArray]:
        """SPL of the reference and of the compared pressure, shapes (n_frequency,) [dB(A)]."""
        return spl(self.reference, self.frequency), spl(self.compared, self.frequency)

    @property
    def rms_difference(self) -> float:
        """Of the levels over all lines; notches rule it [dB]."""
        first, second = self.levels
        return float(np.sqrt(np.mean((second - first) ** 2)))

    @property
    def peaks(self) -> MatchedPeaks:
        """Booming peaks of both, paired within the tolerance."""
        first, second = (booming_peaks(one, self.frequency, self.order) for one in self.levels)
        return match_peaks(first, second, self.tolerance)

    @property
    def peak_deviation(self) -> float:
        """Largest difference of the levels at paired peaks; nan without a pair [dB]."""
        peaks = self.peaks
        return peaks.largest_deviation if peaks.pairs else float("nan")


def compare_pressure(
    frequency: npt.ArrayLike,
    order: float,
    reference: npt.ArrayLike,
    compared: npt.ArrayLike,
    band: tuple[float, float],
) -> PressureComparison:
    """Compare two pressures within a band.

    - `frequency` (n_frequency,) [Hz].
    - `order`: engine order of the lines [1].
    - `reference`, `compared` (n_frequency,): complex peak [Pa].
    - `band` (lower, upper): both edges belong to the band [Hz].
    - raises InputError: a band without lines; as `PressureComparison`.
    """
    lines = np.asarray(frequency, dtype=float)
    inside = (lines >= band[0]) & (lines <= band[1])
    if not inside.any():
        raise InputError(f"there is no line between {band[0]:g} and {band[1]:g} Hz to compare")
    first, second = np.asarray(reference, dtype=complex), np.asarray(compared, dtype=complex)
    if first.shape != lines.shape or second.shape != lines.shape:
        raise InputError(
            f"pressures of shapes {first.shape} and {second.shape} over lines of shape "
            f"{lines.shape} cannot be compared: give one value per line"
        )
    return PressureComparison(lines[inside], order, first[inside], second[inside])
