"""Unbalance and gas of a compressor as one set of numbers, and line by line with their bands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
import numpy.typing as npt

from deboom.arrays import PERCENT, BoolArray, ComplexArray, RealArray, RealOrComplexArray
from deboom.compressor.identified_compressor import ALARM
from deboom.compressor.model import applied
from deboom.compressor.operating_fit import SourceFit
from deboom.compressor.routes import OperatingLoad, RouteModel, mount_covariance, noise_covariance
from deboom.compressor.unbalance_load import (
    GAS_UNITS,
    N_GAS,
    RotationSense,
    gas_columns,
    rotor_columns,
)

RESIDUAL_BANDS = ((20.0, 40.0), (40.0, 60.0), (60.0, 90.0), (90.0, 120.0), (120.0, 150.0))
"""In which the rest is looked at [Hz]."""
LARGEST_UNCERTAINTY = 0.05
"""Half band over amplitude above which a line is not trusted [1]."""
NEIGHBOURS = 5
"""Lines over which residuals are averaged: one line alone says little."""
PASCAL_PER_BAR = 1e5
_CAUSES = (
    "mostly because the mounts in operation may differ from those that were struck",
    "mostly because places and gains of impacts and sensors are not known better",
    "mostly because of noise in sweep and hammer test",
)


@dataclass(frozen=True)
class Estimate:
    """A complex number of the source.

    `value`: most probable value; `deviation`: 1 σ of its amplitude; `lower`, `upper`: confidence
    interval of its amplitude; `unit`: unit of all of them.
    """

    value: complex
    deviation: float
    lower: float
    upper: float
    unit: str


@dataclass(frozen=True)
class GasEstimate:
    """Gas forces at one pressure.

    `pressure`: [Pa].
    """

    pressure: float
    axial: Estimate
    moment: Estimate
    rotating: Estimate


@dataclass(frozen=True)
class ResidualBand:
    """What neither rotor nor gas nor mounts explain in a band.

    `low`, `high`: band [Hz]; `share`: rms of the rest over rms of the load, rotations scaled by the
    radius of gyration, noise taken off [1]; `reduced_chi`: rms of the rest in units of its noise
    [1].
    """

    low: float
    high: float
    share: float
    reduced_chi: float


@dataclass(frozen=True, eq=False)
class Sources:
    """Result of the global weighted least squares.

    `values` (n,): both unbalances, then the gas of each pressure; `covariance` (2 n, 2 n): of their
    real and imaginary parts by turns; `reduced_chi`: rms of the residuals in units of their noise
    [1]; `remaining_chi`: the same, with what the mounts do beyond a common factor taken for noise
    [1].
    """

    sense: RotationSense
    static: Estimate
    dynamic: Estimate
    gas: tuple[GasEstimate, ...]
    values: ComplexArray
    covariance: RealArray
    reduced_chi: float
    remaining_chi: float
    residual_bands: tuple[ResidualBand, ...]

    @property
    def estimates(self) -> dict[str, Estimate]:
        """Both unbalances and the gas forces of each pressure by their names."""
        named = {"static unbalance": self.static, "dynamic unbalance": self.dynamic}
        for gas in self.gas:
            case = case_name(gas.pressure)
            named[f"axial gas force, {case}"] = gas.axial
            named[f"gas moment, {case}"] = gas.moment
            named[f"rotating gas force, {case}"] = gas.rotating
        return named


def sources(
    fit: SourceFit, loads: Sequence[OperatingLoad], length: float, confidence: float
) -> Sources:
    """State the numbers of a fit.

    `length`: characteristic length by which moments are scaled [m]; `confidence`: confidence of the
    intervals [1].
    """
    values = fit.values[: fit.change_slice.start].view(complex)
    covariance = fit.covariance[: 2 * values.size, : 2 * values.size]
    units = ["kg m", "kg m²", *GAS_UNITS * fit.pressure.size]
    quantile = NormalDist().inv_cdf(0.5 + confidence / 2)
    estimates = [
        _estimate(complex(value), covariance[2 * i : 2 * i + 2, 2 * i : 2 * i + 2], unit, quantile)
        for i, (value, unit) in enumerate(zip(values, units, strict=True))
    ]
    white = np.concatenate([part[np.isfinite(part)] for part in fit.whitened])
    bands = [_residual_band(fit, loads, length, low, high) for low, high in RESIDUAL_BANDS]
    return Sources(
        fit.sense,
        estimates[0],
        estimates[1],
        tuple(
            GasEstimate(float(pressure), *estimates[2 + N_GAS * i : 2 + N_GAS * (i + 1)])
            for i, pressure in enumerate(fit.pressure)
        ),
        values,
        covariance,
        fit.reduced_chi,
        float(np.sqrt(np.mean(np.abs(white) ** 2) / 2)),
        tuple(band for band in bands if band is not None),
    )


def case_name(pressure: float) -> str:
    """Name a pressure [Pa], such as ``7.5 bar``."""
    return f"{pressure / PASCAL_PER_BAR:g} bar"


def source_loads(sources: Sources, frequency: npt.ArrayLike) -> dict[str, ComplexArray]:
    """Compute the load of rotor and gas at any speed, pressure by pressure.

    `frequency` (n_frequency,): frequency of the rotation [Hz]. Returns, by name such as
    ``7.5 bar``, (n_frequency, 6) complex peak at the virtual point [N, N m].

    Thesis, eq. 36 and 38: unbalances grow with ω² and are the same at every pressure, gas forces do
    neither.
    """
    rotor = rotor_columns(frequency, sources.sense) @ np.array(
        [sources.static.value, sources.dynamic.value]
    )
    columns = gas_columns(sources.sense)
    return {
        case_name(gas.pressure): rotor
        + columns @ np.array([gas.axial.value, gas.moment.value, gas.rotating.value])
        for gas in sources.gas
    }


def _estimate(value: complex, covariance: RealArray, unit: str, quantile: float) -> Estimate:
    """State a number with the confidence interval of its amplitude."""
    along = np.array([value.real, value.imag]) / abs(value)
    deviation = float(np.sqrt(along @ covariance @ along))
    amplitude = abs(value)
    return Estimate(
        value,
        deviation,
        max(amplitude - quantile * deviation, 0.0),
        amplitude + quantile * deviation,
        unit,
    )


def _residual_band(
    fit: SourceFit, loads: Sequence[OperatingLoad], length: float, low: float, high: float
) -> ResidualBand | None:
    """Rest in one band; None where it holds no line."""
    scale = np.repeat([1.0, 1 / length], 3)
    rest, whole, chi = [], [], []
    for load, residual, white in zip(loads, fit.residuals, fit.whitened, strict=True):
        lines = (load.frequency >= low) & (load.frequency < high) & np.isfinite(white[:, 0])
        rest.append((scale * residual[lines]).ravel())
        whole.append((scale * load.load[lines]).ravel())
        chi.append(white[lines].ravel())
    count = sum(part.size for part in chi)
    if count == 0:
        return None
    squares = [float(np.sum(np.abs(np.concatenate(parts)) ** 2)) for parts in (rest, whole, chi)]
    mean = squares[2] / (2 * count)
    beyond_noise = max(1 - 1 / mean, 0.0)
    share = float(np.sqrt(beyond_noise * squares[0] / squares[1]))
    return ResidualBand(low, high, share, float(np.sqrt(mean)))


@dataclass(frozen=True, eq=False)
class Band:
    """A complex number over speed and how well it is known.

    `value` (n_frequency,): complex value; `lower`, `upper` (n_frequency,): of its amplitude; an
    error that is known to be there widens one side only; `noise`, `placement`, `mounts`
    (n_frequency,): what makes it wide: noise of sweep and hammer test; errors of sensors, impacts
    and model; mounts that have or may have changed; `half` (n_frequency,): largest error at this
    confidence, that of the phase included where it is known to be there.
    """

    value: ComplexArray
    lower: RealArray
    upper: RealArray
    noise: RealArray
    placement: RealArray
    mounts: RealArray
    half: RealArray

    @property
    def relative(self) -> RealArray:
        """Largest error over the amplitude, shape (n_frequency,) [1]."""
        return np.asarray(self.half / np.abs(self.value))


@dataclass(frozen=True, eq=False)
class UnbalanceCurve:
    """Static [kg m] or dynamic [kg m²] unbalance over speed.

    `frequency` (n_frequency,): frequency of the rotation [Hz]; `trusted` (n_frequency,): lines that
    can be trusted; `reasons`: why others cannot, in words → lines (n_frequency,).
    """

    frequency: RealArray
    from_y: Band
    from_z: Band
    both: Band
    trusted: BoolArray
    reasons: Mapping[str, BoolArray]

    @property
    def mean(self) -> ComplexArray:
        """Value of `both`."""
        return self.both.value

    @property
    def mismatch(self) -> RealArray:
        """Difference of y and z over their mean, shape (n_frequency,) [1].

        A rotor makes it small; that it is small proves no rotor, since a rotating gas force passes.
        """
        return np.asarray(np.abs(self.from_y.value - self.from_z.value) / np.abs(self.mean))


class LoadUncertainty:
    """Errors of a load by one route, as far as the sweeps and the hammer test tell.

    `updated`: whether the change of the mounts that the fit found is taken into the load;
    `confidence`: confidence of the bands [1].
    """

    def __init__(
        self,
        model: RouteModel,
        load: OperatingLoad,
        fit: SourceFit,
        *,
        updated: bool,
        confidence: float,
    ) -> None:
        self.fit = fit
        self.quantile = NormalDist().inv_cdf(0.5 + confidence / 2)
        change = fit.change.matrices(load.frequency, model.mounts[load.lines], load.motion)
        taken = np.tensordot(fit.line_values[fit.change_slice], change, axes=1)
        now = model.apparent_mass[load.lines] - (taken if updated else 0)
        self.load = applied(now, load.motion)
        self.stated_load = np.zeros_like(self.load) if updated else applied(taken, load.motion)
        self.noise = noise_covariance(model, (load,), (now,))
        self.mismatch = fit.mismatch**2 * mount_covariance(model, (load,))
        self.slopes = applied(model.by_error[:, load.lines], load.motion)
        self.slopes -= model.frame.slopes(taken, load.motion)
        self.by_change = applied(change, load.motion)

    def band(self, weights: RealOrComplexArray) -> Band:
        """Propagate everything to a combination of the six loads with `weights` (n_frequency, 6).

        Along the direction of the value: noise of each line; errors of placement, with their
        posterior of the hammer test; the difference between the mounts' true change and the one
        found. The last is correlated with the second, since both were found together. A load that
        leaves the change out is wrong by a known amount, which is added to one side.
        """
        value = np.einsum("fa,fa->f", weights, self.load)
        along = (value / np.abs(value)).conj()
        variance, of_mounts = (
            np.einsum("fa,fab,fb->f", weights, covariance, weights.conj()).real
            for covariance in (self.noise, self.mismatch)
        )
        placement = _along(along, weights, self.slopes)
        mounts, places = _along(along, weights, self.by_change), self.fit.change_slice
        covariance = self.fit.line_covariance[:, places]
        of_mounts += _quadratic(mounts, covariance[places], mounts)
        cross = _quadratic(placement, covariance[places.stop :], mounts)
        of_placement = np.sum(placement**2, axis=0)
        total = np.sqrt(np.maximum(variance + of_placement + of_mounts + 2 * cross, variance))
        offset_along = along * np.einsum("fa,fa->f", weights, self.stated_load)
        offset = offset_along.real
        amplitude, half = np.abs(value), self.quantile * total
        return Band(
            value,
            np.maximum(amplitude - half - np.maximum(offset, 0), 0),
            amplitude + half + np.maximum(-offset, 0),
            self.quantile * np.sqrt(variance),
            self.quantile * np.sqrt(of_placement),
            self.quantile * np.sqrt(of_mounts) + np.abs(offset_along),
            half + np.abs(offset_along),
        )


def _quadratic(slopes: RealArray, covariance: RealArray, other: RealArray) -> RealArray:
    """Covariance of two amplitudes, each a sum of slopes times unknowns, shape (n_frequency,)."""
    return np.asarray(np.einsum("kf,kl,lf->f", slopes, covariance, other, optimize=True))


def _along(along: ComplexArray, weights: RealOrComplexArray, slopes: ComplexArray) -> RealArray:
    """Change of an amplitude by real unknowns, shape (n_unknown, n_frequency)."""
    return np.asarray((along * np.einsum("fa,kfa->kf", weights, slopes)).real)


def unbalance_curve(
    uncertainty: LoadUncertainty,
    frequency: RealArray,
    from_y: RealOrComplexArray,
    from_z: RealOrComplexArray,
    unexplained: BoolArray,
) -> UnbalanceCurve:
    """Make the curve of one unbalance and mark what cannot be trusted.

    `frequency` (n_frequency,): lines [Hz]; `from_y`, `from_z` (n_frequency, 6): weights of the
    loads, in y and in z; `unexplained` (n_frequency,): lines whose load is not that of a rotor, gas
    and mounts.
    """
    bands = [uncertainty.band(weights) for weights in (from_y, from_z)]
    widths = np.array([band.half for band in bands])
    share = widths[1] ** 2 / np.sum(widths**2, axis=0)
    both = uncertainty.band(share[:, np.newaxis] * from_y + (1 - share)[:, np.newaxis] * from_z)
    wide = (both.relative > LARGEST_UNCERTAINTY) & ~unexplained
    cause = np.argmax([both.mounts, both.placement, both.noise], axis=0)
    reasons = {}
    for number, words in enumerate(_CAUSES):
        lines = wide & (cause == number)
        if lines.any():
            worst = float(np.max(both.relative[lines]))
            reasons[f"{_where(frequency, lines)}: up to ±{PERCENT * worst:.0f} %, {words}"] = lines
    if unexplained.any():
        text = f"{_where(frequency, unexplained)}: the load is not that of a rotor, gas and mounts"
        reasons[f"{text}: look for hoses and loose parts"] = unexplained
    return UnbalanceCurve(frequency, bands[0], bands[1], both, ~(wide | unexplained), reasons)


def unexplained_lines(whitened: ComplexArray) -> BoolArray:
    """Mark lines whose residuals are no noise.

    `whitened` (n_frequency, 6): residuals of the global fit in units of the noise of one part; not
    a number where they took no part in it. Returns (n_frequency,) where the running mean over
    `NEIGHBOURS` lines has a χ above 1.5.
    """
    squares = np.mean(np.abs(whitened) ** 2, axis=1) / 2
    valid = np.isfinite(squares)
    kernel = np.ones(min(NEIGHBOURS, squares.size))
    summed = np.convolve(np.where(valid, squares, 0.0), kernel, mode="same")
    count = np.convolve(valid.astype(float), kernel, mode="same")
    mean = np.divide(summed, count, out=np.zeros_like(summed), where=count > 0)
    return np.asarray(mean > ALARM**2)


def _where(frequency: RealArray, lines: BoolArray) -> str:
    """State lines as ranges."""
    picked = np.flatnonzero(lines)
    runs = np.split(picked, np.flatnonzero(np.diff(picked) > 1) + 1)
    return ", ".join(
        f"{frequency[run[0]]:g} Hz"
        if run.size == 1
        else f"{frequency[run[0]]:g}-{frequency[run[-1]]:g} Hz"
        for run in runs
    )
