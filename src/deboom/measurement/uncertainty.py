"""Uncertainty of measured functions: spreads, intervals, difference of methods."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.stats import t as student

from deboom.arrays import BoolArray, ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.channels import Frf

COVERAGE = 0.90
"""Coverage of an interval, unless said otherwise [1]."""

LEAST_DRAWS = 40
"""Below which 5 % on either side are fewer than two draws."""

DB_PER_NEPER = 20.0 / np.log(10.0)

SWEEPS = 50
"""Iterations of the most likely variance; it converges within ten."""

TINY = 1e-12
"""Share of the magnitude around below which a function has no phase [1]."""

SMOOTHING = 3.0
"""Standard deviation of the window of `local_magnitude`: about a resonance of a body [Hz]."""


@checked(value="... ?", lower="... ?", upper="... ?")
class Interval:
    """A number, or an array of them, with the interval of the truth.

    - `value` (...).
    - `lower`, `upper` (...): ends of the interval [unit]. The value need not lie in the middle, and
      in data whose errors push to one side not even inside.
    """

    value: RealArray
    lower: RealArray
    upper: RealArray
    coverage: float

    @property
    def half_width(self) -> RealArray:
        """Half of the width, shape (...) [unit]."""
        return np.asarray((self.upper - self.lower) / 2.0)

    def about(self, value: npt.ArrayLike) -> Interval:
        """Return the interval of the same errors about a value that was computed otherwise."""
        other = np.asarray(value, dtype=float)
        moved = other - self.value
        return Interval(other, self.lower + moved, self.upper + moved, self.coverage)

    def holds(self, truth: npt.ArrayLike) -> BoolArray:
        """Say whether it holds the truth, shape (...)."""
        where = np.asarray(truth, dtype=float)
        return np.asarray((self.lower <= where) & (where <= self.upper))


def pivotal_interval(
    value: npt.ArrayLike, again: npt.ArrayLike, coverage: float = COVERAGE
) -> Interval:
    """Return the interval of the truth behind a measured value.

    Raises InputError: fewer than `LEAST_DRAWS` draws, shapes that differ, values that are not
    finite, a coverage outside of ]0, 1[.

    - `value` (...): as measured [unit].
    - `again` (n_draws, ...): the same measured again in thought, in the same unit.

    ``[2 v - q_(1-α/2), 2 v - q_(α/2)]`` with the quantiles q of the values measured again, which
    lie about the measured value as it lies about the truth (basic bootstrap interval, Davison and
    Hinkley 1997, eq. 5.6). A percentile interval would take the bias of the noise, which fills
    every notch, a second time instead of away. Quantiles are those with (n + 1) p draws below.
    """
    measured, drawn = np.asarray(value, dtype=float), np.asarray(again, dtype=float)
    if not 0.0 < coverage < 1.0:
        raise InputError(f"a coverage of {coverage}: give a number between 0 and 1, such as 0.9")
    if drawn.ndim < 1 or drawn.shape[1:] != measured.shape:
        raise InputError(
            f"draws of shape {drawn.shape} for values of shape {measured.shape}: one row per draw"
        )
    if len(drawn) < LEAST_DRAWS:
        raise InputError(f"{len(drawn)} draws do not give an interval: take at least {LEAST_DRAWS}")
    if not (np.isfinite(drawn).all() and np.isfinite(measured).all()):
        raise InputError("an interval needs finite values: a draw silences a line or fails")
    tails = [(1.0 - coverage) / 2.0, (1.0 + coverage) / 2.0]
    low, high = np.quantile(drawn, tails, axis=0, method="weibull")
    return Interval(measured, 2.0 * measured - high, 2.0 * measured - low, coverage)


def probability_below(value: npt.ArrayLike, again: npt.ArrayLike, bound: float = 0.0) -> RealArray:
    """Return the probability that the truth behind a measured value lies below a bound [1].

    Arguments as for `pivotal_interval`, such as the level of design A minus that of design B with
    the same errors for both. A difference that is 0 in every draw gives one half.
    """
    truth = 2.0 * np.asarray(value, dtype=float) - np.asarray(again, dtype=float)
    below, at = (truth < bound).mean(axis=0), (truth == bound).mean(axis=0)
    return np.asarray(below + at / 2.0)


@dataclass(frozen=True)
class VariancePart:
    """Variance of a number by one cause.

    - `degrees_of_freedom`: degrees of freedom behind that variance, from 1; infinite where it is
      stated.
    """

    name: str
    variance: float
    degrees_of_freedom: float = math.inf


@dataclass(frozen=True)
class NextMeasurement:
    """What would be measured next, and what it would leave of each variance.

    - `remaining`: cause → share of its variance that would remain, 0 to 1; causes that are not
      named stay [1].
    - `more_degrees_of_freedom`: cause → degrees of freedom that it would gain.
    """

    name: str
    remaining: Mapping[str, float]
    more_degrees_of_freedom: Mapping[str, float]


def half_width(parts: Sequence[VariancePart], coverage: float = COVERAGE) -> float:
    """Return the half width of the interval of a number with independent causes of error [unit].

    Notes
    -----
    ``t_ν √Σ u²`` with the effective degrees of freedom of Welch and Satterthwaite,
    ``ν = (Σ u²)² / Σ u⁴/ν_i`` (GUM, JCGM 100:2008, G.4).
    """
    total = sum(part.variance for part in parts)
    if total == 0.0:
        return 0.0
    spread = sum(part.variance**2 / part.degrees_of_freedom for part in parts)
    freedom = total**2 / spread if spread > 0.0 else math.inf
    return float(student.ppf((1.0 + coverage) / 2.0, freedom) * math.sqrt(total))


def half_width_after(parts: Sequence[VariancePart], measurement: NextMeasurement) -> float:
    """Return the half width to be expected after one more measurement, at `COVERAGE` [unit].

    Pre-posterior analysis of normal errors: the variance after a measurement does not depend on
    what it will show, so its expectation is known before.
    """
    after = [
        VariancePart(
            part.name,
            part.variance * measurement.remaining.get(part.name, 1.0),
            part.degrees_of_freedom + measurement.more_degrees_of_freedom.get(part.name, 0.0),
        )
        for part in parts
    ]
    return half_width(after)


@checked(rows="...", columns="...", rest="...")
class CrossedSpread:
    """Components of variance of a table with one value per row and column.

    - `rows`, `columns`, `rest` (...): variance between rows, between columns, and what neither
      explains; not below 0 [unit²].
    """

    rows: RealArray
    columns: RealArray
    rest: RealArray
    n_column: int


def crossed_spread(values: npt.ArrayLike) -> CrossedSpread:
    """Split the variance of a table (n_row, n_column, ...) such as vehicles × load cases.

    With a single column the rows hold all the spread. Valid for at least two rows.

    Random effects ``y_ij = µ + r_i + c_j + e_ij`` (Searle, Casella and McCulloch 1992, ch. 4):
    ``E MS_r = σ_e² + n_c σ_r²``, ``E MS_c = σ_e² + n_r σ_c²``, ``E MS_e = σ_e²``.
    """
    table = np.asarray(values, dtype=float)
    n_row, n_column = table.shape[:2]
    if n_column < 2:
        rows = table[:, 0].var(axis=0, ddof=1)
        return CrossedSpread(rows, np.zeros_like(rows), np.zeros_like(rows), n_column)
    mean = table.mean(axis=(0, 1))
    of_row, of_column = table.mean(axis=1), table.mean(axis=0)
    left = table - of_row[:, np.newaxis] - of_column[np.newaxis] + mean
    rest = np.sum(left**2, axis=(0, 1)) / ((n_row - 1) * (n_column - 1))
    rows = of_row.var(axis=0, ddof=1) - rest / n_column
    columns = of_column.var(axis=0, ddof=1) - rest / n_row
    return CrossedSpread(np.maximum(rows, 0.0), np.maximum(columns, 0.0), rest, n_column)


@checked(mean="...", lowest="...", highest="...")
class LevelSpread:
    """Spread of several level curves, line by line (thesis, figure 10).

    - `mean`, `lowest`, `highest` (n_frequency, ...): mean, least and largest level over the
      vehicles [dB].
    """

    mean: RealArray
    lowest: RealArray
    highest: RealArray

    @property
    def range(self) -> RealArray:
        """Highest minus lowest, shape (n_frequency, ...) [dB]."""
        return np.asarray(self.highest - self.lowest)

    def quantile(self, share: float) -> float:
        """Return the range that this share of all lines (and curves) does not exceed [dB]."""
        return float(np.quantile(self.range, share))


def level_spread(levels: npt.ArrayLike) -> LevelSpread:
    """Return the spread of levels (n_vehicle, n_frequency, ...) over nominally identical vehicles.

    Raises InputError: fewer than two vehicles, levels that are not finite.
    """
    values = np.asarray(levels, dtype=float)
    if values.ndim < 2 or values.shape[0] < 2:
        raise InputError(f"a spread needs at least two vehicles, not shape {values.shape}")
    if not np.all(np.isfinite(values)):
        raise InputError("a spread needs finite levels: a pressure of exactly 0 has none")
    return LevelSpread(values.mean(axis=0), values.min(axis=0), values.max(axis=0))


@dataclass(frozen=True)
class MethodDifference:
    """Errors of the mean of two methods [dB, 1, Pa/N], lengths of their correlation [Hz]."""

    calibration_db: float
    calibration_degrees_of_freedom: float
    body: float
    body_length: float
    path: float
    path_degrees_of_freedom: float
    length: float
    floor: float


def local_magnitude(values: ComplexArray, frequency: RealArray) -> RealArray:
    """Return the rms of |Y|, (..., n_frequency, n_path), around each line [Hz].

    An error of place, or another day, moves an antiresonance and does not scale what is left in it:
    errors go with the magnitude around. The gaussian window of `SMOOTHING` is normalised at the
    ends.
    """
    distance = (frequency[:, np.newaxis] - frequency) / SMOOTHING
    weight = np.exp(-(distance**2) / 2.0)
    weight /= weight.sum(axis=1, keepdims=True)
    return np.asarray(np.sqrt(weight @ np.abs(values) ** 2))


def method_difference(pairs: Sequence[tuple[Frf, Frf]]) -> MethodDifference:
    """Estimate the errors of noise transfer functions from two measurements per vehicle.

    Raises InputError: no pair, functions that differ in ears, paths or lines; fewer than two paths
    or five lines; a path without any answer.

    - `pairs`: functions of each vehicle: one ear, the same paths and lines, by two methods with
      errors of the same size and independent of each other [Pa/N].

    Half of the difference, ``h = (A - B)/2``, errs as the mean M of both does. Calibration: the
    mean over paths of ``Re Σ h M* / Σ |M|²``, taken about 0: neither method is louder on average.
    Floor: from second differences along the lines, which smooth errors do not reach, with the
    median that outliers do not reach. The rest over `local_magnitude`, turned into the phase of M,
    is e, with ``|e|² ≈ c + p + n``: n of the floor is known; c, of the body, multiplies all paths
    as another damping does, so it is the mean product of different paths; p, of the path, is what
    remains. All means have the weights ``1/(v + n)²`` of the most likely common variance v of
    complex normal errors, ``Σ (|e|² - v - n)/(v + n)² = 0``, so that paths in the noise hardly
    count. The integral of a correlation over the lag, which rules sums over lines, gives the
    lengths. What both methods have in common, such as the virtual point of a mount, does not show;
    and the mean of an error over the band counts as calibration. Valid where smooth errors last ten
    lines or more: else a part of them counts as floor.
    """
    middle, half = _mean_and_half_difference(pairs)
    frequency = pairs[0][0].frequency
    energy = np.sum(np.abs(middle) ** 2, axis=1)
    per_path = np.sum(half * middle.conj(), axis=1).real / energy
    common = per_path.mean(axis=1)
    rest = half - common[:, np.newaxis, np.newaxis] * middle
    second = rest[:, 2:] - 2.0 * rest[:, 1:-1] + rest[:, :-2]
    # |z|² of complex noise is exponential, its median ln 2 times its mean; 1 + 4 + 1 of them
    white = float(np.median(np.abs(second) ** 2)) / np.log(2.0) / 6.0
    magnitude = local_magnitude(middle, frequency)
    # in the direction of each function itself, as a factor changes it
    error = rest / magnitude * middle.conj() / np.maximum(np.abs(middle), TINY * magnitude)
    noise, gain = white / magnitude**2, np.abs(middle) / magnitude
    total = _power_beside_noise(np.abs(error) ** 2, noise)
    weight = 1.0 / (total + noise) if total > 0.0 else np.ones_like(noise)
    lags = range(error.shape[1] - 1)
    between = np.array(
        [_between_paths(weight * error, lag) / _between_paths(weight * gain, lag) for lag in lags]
    )
    body = max(float(between[0]), 0.0)
    within = np.array(
        [
            (_within(weight * error, lag) - between[lag] * _within(weight * gain, lag))
            / _within(weight, lag)
            for lag in lags
        ]
    )
    floor = float(np.sum(weight**2 * noise) / np.sum(weight**2))
    path = max(float(within[0]) - floor, 0.0)
    step = float(np.median(np.diff(frequency)))
    return MethodDifference(
        calibration_db=float(DB_PER_NEPER * np.sqrt(np.mean(common**2))),
        calibration_degrees_of_freedom=len(pairs),
        body=float(np.sqrt(body)),
        body_length=_length(between, body, step),
        path=float(np.sqrt(path)),
        path_degrees_of_freedom=error.shape[0] * error.shape[2],
        length=_length(within, path, step),
        floor=float(np.sqrt(white / 2.0)),
    )


def _mean_and_half_difference(
    pairs: Sequence[tuple[Frf, Frf]],
) -> tuple[ComplexArray, ComplexArray]:
    """Mean and half difference of both methods, (n_vehicle, n_frequency, n_path)."""
    if not pairs:
        raise InputError("no pair of transfer functions to compare: give at least one vehicle")
    first = pairs[0][0]
    for number, pair in enumerate(pairs, 1):
        for frf in pair:
            same = frf.outputs == first.outputs and frf.inputs == first.inputs
            if not (same and np.array_equal(frf.frequency, first.frequency)):
                raise InputError(
                    f"vehicle {number}: its two transfer functions differ in ear, paths or lines "
                    "from each other or from those of the first vehicle: select() the same ones"
                )
    if len(first.outputs) != 1 or len(first.inputs) < 2 or first.frequency.size < 5:
        raise InputError("one ear, at least two paths and five lines are needed to part errors")
    both = np.array([[frf.values[:, 0] for frf in pair] for pair in pairs])
    middle, half = both.mean(axis=1), (both[:, 0] - both[:, 1]) / 2.0
    if not np.all(np.any(middle != 0.0, axis=1)):
        raise InputError("a path without any answer at the ear: leave it out")
    return middle, half


def _power_beside_noise(squared: RealArray, noise: RealArray) -> float:
    """Most likely common variance of complex errors beside a known one of each."""
    power = float(np.median(squared))
    for _ in range(SWEEPS):
        weight = 1.0 / (power + noise) ** 2 if power > 0.0 else np.ones_like(noise)
        power = max(float(np.sum(weight * (squared - noise)) / np.sum(weight)), 0.0)
    return power


def _between_paths(values: ComplexArray | RealArray, lag: int) -> float:
    """Sum of the products of different paths of a vehicle, lines apart by a lag."""
    later, earlier = values[:, lag:], values[:, : values.shape[1] - lag].conj()
    every = later.sum(axis=2) * earlier.sum(axis=2)
    return float(np.real(every.sum() - np.sum(later * earlier)))


def _within(values: ComplexArray | RealArray, lag: int) -> float:
    """Sum of the products of the same path, lines apart by a lag."""
    return float(np.real(np.sum(values[:, lag:] * values[:, : values.shape[1] - lag].conj())))


def _length(covariance: RealArray, power: float, step: float) -> float:
    """Length of the gaussian correlation with the same integral, to its first zero [Hz]."""
    total = 0.5
    for value in covariance[1:]:
        if power == 0.0 or value <= 0.0:
            break
        total += min(value / power, 1.0)
    return float(2.0 * total * step / np.sqrt(2.0 * np.pi))


def complex_normals(shape: tuple[int, ...], generator: np.random.Generator) -> ComplexArray:
    """Draw complex values of unit mean square."""
    parts = generator.standard_normal((2, *shape))
    return np.asarray((parts[0] + 1j * parts[1]) / np.sqrt(2.0))
