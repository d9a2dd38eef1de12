"""Mass properties of a free or softly hung body, from its accelerance or from how it swings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy import stats
from scipy.optimize import OptimizeResult, brentq, least_squares

from deboom.arrays import ComplexArray, RealArray, checked_array
from deboom.errors import InputError
from deboom.physics.rigid_body import RigidBody, characteristic_length, mass_matrix, mass_properties
from deboom.tabled import Tabled

GRAVITY = 9.80665
"""Standard acceleration of a fall [m/s²]."""
FEWEST_LINES = 8
"""Lines that a fit needs at least."""
INNER = 0.6
"""Part of a band whose mass line is compared with that of the whole [1]."""
CANDIDATES = 24
"""Bands that are tried."""
SMALLEST = 1e-9
"""Deviation that an entry has at least, relative to its masses [1]."""
PARAMETERS = ("m", "cx", "cy", "cz", "Jxx", "Jyy", "Jzz", "Jxy", "Jxz", "Jyz")
UNITS = ("kg", "m", "m", "m", *("kg m^2",) * 6)
_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


@dataclass(frozen=True, eq=False)
class FreeBody(Tabled):
    """Identified mass properties of a free body.

    - `body`: mass, centre of gravity from the virtual point, inertia about it.
    - `deviation` (10,): standard deviations of `PARAMETERS`; ± 1.96 hold 95 % [kg, m, kg m²].
    - `band`: first and last line of the fit [Hz].
    - `gain`: factor on all of the accelerance as measured, 1 without a weighed mass [1].
    - `misfit`: root mean square of what no rigid body explains, over its noise; near 1 [1].
    """

    body: RigidBody
    deviation: RealArray
    band: tuple[float, float]
    gain: float
    misfit: float

    @property
    def table(self) -> pd.DataFrame:
        """A row per number: value, standard deviation, unit."""
        inertia = [self.body.inertia[i, j] for i, j in _PAIRS]
        return pd.DataFrame(
            {
                "quantity": PARAMETERS,
                "value": [self.body.mass, *self.body.centre, *inertia],
                "standard deviation": self.deviation,
                "unit": UNITS,
            }
        )


def free_body(
    frequency: npt.ArrayLike,
    accelerance: npt.ArrayLike,
    *,
    sensors: npt.ArrayLike | None = None,
    impacts: npt.ArrayLike | None = None,
    band: tuple[float, float] | None = None,
    hung: bool = False,
    weighed: tuple[float, float] | None = None,
    gain_deviation: float = 0.0,
) -> FreeBody:
    """Identify a free body from its accelerance at a virtual point.

    Parameters
    ----------
    frequency : array_like, shape (n,) — rising lines [Hz]
    accelerance : array_like, shape (n, 6, 6), or (n, c, i) of raw sensors and impacts
        Accelerations over loads at the virtual point [1/kg, 1/(kg m), 1/(kg m²)].
    sensors, impacts : array_like, shape (c, 6) and (i, 6), optional
        Forward matrices of raw channels, both or neither; see `rigid_body.forward_matrices` [1, m].
    band : (float, float), optional
        Lines of the fit; by default from the first line to where noise and flexible modes together
        cost least [Hz].
    hung : bool
        Whether a soft suspension is in the data: adds a term with 1/ω².
    weighed : (float, float), optional
        Weighed mass and its standard deviation [kg]: frees a common gain of the accelerance.
    gain_deviation : float
        Standard deviation of the gain of each motion and each load, as calibrated [1].

    Returns
    -------
    FreeBody
        With standard deviations that grow where channels disagree with any rigid body.

    Raises
    ------
    InputError
        A line at 0 Hz, fewer than 8 lines, a band beyond them, other shapes, no positive mass.

    See Also
    --------
    deboom.virtual_point, deboom.pendulum_inertia, deboom.torsion_inertia

    Notes
    -----
    ``A(ω) = M⁻¹ + ω² R₁ + ω⁴ R₂ [+ S/ω²]``: a constant and the foot of the flexible modes are
    fitted to the accelerance itself; its inverse would turn their bias into one of the mass. M⁻¹ is
    that of a rigid body of ten parameters, each entry weighted by its noise, from the residuals,
    and its bias, from what the constant changes by in the lower part of the band. Where entries
    still disagree with any rigid body, all get a common further error. A gain that all channels
    share does not show in that: weigh the body.

    Examples
    --------
    >>> import numpy as np
    >>> lines = np.arange(20.0, 80.0)
    >>> accelerance = np.broadcast_to(np.diag([0.2, 0.2, 0.2, 50.0, 50.0, 40.0]), (60, 6, 6))
    >>> body = free_body(lines, accelerance)
    >>> print(f"{body.body.mass:.3f} kg, Jzz {body.body.inertia[2, 2]:.4f} kg m²")
    5.000 kg, Jzz 0.0250 kg m²
    """
    values = np.asarray(accelerance, dtype=complex)
    if sensors is not None and impacts is not None:
        motion, load = (np.linalg.pinv(np.asarray(v, dtype=float)) for v in (sensors, impacts))
        values = motion @ values @ load.T
    lines, values = _checked(frequency, values)
    if band is None:
        band = _best_band(lines, values, hung)
    elif band[0] < lines[0] or band[1] > lines[-1]:
        raise InputError(
            f"a band from {band[0]:g} to {band[1]:g} Hz leaves the measured {lines[0]:g} to "
            f"{lines[-1]:g} Hz: nothing is extrapolated"
        )
    inside = (lines >= band[0]) & (lines <= band[1])
    if inside.sum() < FEWEST_LINES:
        raise InputError(
            f"{inside.sum()} lines from {band[0]:g} to {band[1]:g} Hz: a mass line needs "
            f"{FEWEST_LINES}"
        )
    return _rigid(
        *_mass_lines(lines[inside], values[inside], hung),
        (float(lines[inside][0]), float(lines[inside][-1])),
        weighed,
        gain_deviation,
    )


def _checked(
    frequency: npt.ArrayLike, accelerance: npt.ArrayLike
) -> tuple[RealArray, ComplexArray]:
    lines = np.asarray(frequency, dtype=float)
    values = np.asarray(accelerance, dtype=complex)
    checked_array(lines, "f", "frequency", {})
    if values.shape != (lines.size, 6, 6) or not np.all(np.isfinite(values)):
        raise InputError(f"an accelerance of {lines.size} lines has shape ({lines.size}, 6, 6)")
    if lines.size == 0 or lines[0] <= 0 or not np.all(np.diff(lines) > 0):
        raise InputError("mass lines need rising lines above 0 Hz: leave the line at 0 Hz out")
    return lines, values


def _mass_lines(
    lines: RealArray, values: ComplexArray, hung: bool
) -> tuple[RealArray, RealArray, RealArray]:
    """Constant (6, 6), its bias (6, 6) and the covariance (36, 36) of its noise.

    What the constant changes by when the upper part of the band is left out is its bias.
    """
    fits = []
    for n in (max(FEWEST_LINES, round(INNER * lines.size)), lines.size):
        square = (2 * np.pi * lines[:n] / lines[n - 1]) ** 2
        columns = [np.ones(n), square, square**2, *([1 / square] if hung else [])]
        basis, data = np.column_stack(columns), values[:n].real.reshape(n, 36)
        coefficients, *_ = np.linalg.lstsq(basis, data, rcond=None)
        residuals = data - basis @ coefficients
        fits.append(coefficients[0].reshape(6, 6))
    inner, constant = fits
    factor = np.linalg.inv(basis.T @ basis)[0, 0] / (n - len(columns))
    return constant, constant - inner, factor * residuals.T @ residuals


def _best_band(lines: RealArray, values: ComplexArray, hung: bool) -> tuple[float, float]:
    """Return the band from the first line on with the smallest error of noise and model."""
    numbers = np.unique(np.geomspace(FEWEST_LINES, lines.size, CANDIDATES).astype(int))
    errors = []
    for n in numbers:
        constant, bias, noise = _mass_lines(lines[:n], values[:n], hung)
        size = np.abs(np.diag(constant))
        errors.append(float(np.mean(_variance(bias, noise) / np.outer(size, size))))
    return float(lines[0]), float(lines[numbers[int(np.argmin(errors))] - 1])


def _variance(bias: RealArray, noise: RealArray) -> RealArray:
    """Variance (6, 6) of each constant, of its bias and its noise."""
    return bias**2 + np.diag(noise).reshape(6, 6)


def _rigid(
    constant: RealArray,
    bias: RealArray,
    noise: RealArray,
    band: tuple[float, float],
    weighed: tuple[float, float] | None,
    gain_deviation: float,
) -> FreeBody:
    """Fit the inverse mass matrix of a rigid body, with gains where these are free."""
    if not np.all(np.linalg.eigvalsh((constant + constant.T) / 2) > 0):
        raise InputError(
            f"the mass line from {band[0]:g} to {band[1]:g} Hz is not that of a body: look for a "
            "reversed channel, or say that the body was hung"
        )
    start = mass_properties(np.linalg.inv((constant + constant.T) / 2), tolerance=np.inf)
    length = characteristic_length(start.mass, start.inertia)
    unit = np.array([start.mass, *[length] * 3, *[start.mass * length**2] * 6])
    first = np.array([start.mass, *start.centre, *(start.inertia[i, j] for i, j in _PAIRS)]) / unit
    n_common, n_gains = int(weighed is not None), 12 if gain_deviation > 0 else 0
    first = np.concatenate([first, np.ones(n_common), np.zeros(n_gains)])
    size = np.sqrt(np.outer(np.diag(constant), np.diag(constant)))
    deviation = np.maximum(np.sqrt(_variance(bias, noise)), SMALLEST * size)

    def solved(share: float) -> OptimizeResult:
        spread = np.hypot(deviation, share * size)

        def residuals(scaled: RealArray) -> RealArray:
            common, gains = scaled[10 : 10 + n_common], scaled[10 + n_common :]
            predicted = np.prod(common) * np.linalg.inv(_matrix(unit * scaled[:10]))
            if n_gains:
                predicted = (1 + gains[:6, np.newaxis]) * predicted * (1 + gains[6:])
            weight = [] if weighed is None else [(unit[0] * scaled[0] - weighed[0]) / weighed[1]]
            prior = gains / gain_deviation if n_gains else gains
            return np.concatenate([((predicted - constant) / spread).ravel(), prior, weight])

        return least_squares(residuals, first, method="lm", xtol=1e-12, ftol=1e-12)

    def excess(share: float) -> float:
        result = solved(share)
        return float(np.log(2 * result.cost / (result.fun.size - first.size)))

    misfit = float(np.exp(excess(0.0) / 2))
    if misfit > 1 and excess(1.0) > 0:
        raise InputError("no rigid body moves like this: check sensors, impacts and the band")
    share = brentq(excess, 0.0, 1.0, xtol=1e-6) if misfit > 1 else 0.0
    result = solved(share)
    n_free = result.fun.size - first.size
    correlation = np.eye(result.fun.size)
    together = noise / np.outer(spread := np.hypot(deviation, share * size).ravel(), spread)
    correlation[:36, :36] += together - np.diag(np.diag(together))
    weights = np.linalg.pinv(result.jac)
    covariance = weights @ correlation @ weights.T
    return FreeBody(
        mass_properties(_matrix(unit * result.x[:10])),
        unit * np.sqrt(np.diag(covariance))[:10] * stats.t.ppf(0.975, n_free) / 1.96,
        band,
        float(np.prod(result.x[10 : 10 + n_common])),
        misfit,
    )


def _matrix(parameters: RealArray) -> RealArray:
    """Mass matrix of the ten parameters."""
    inertia = np.zeros((3, 3))
    for value, (i, j) in zip(parameters[4:], _PAIRS, strict=True):
        inertia[i, j] = inertia[j, i] = value
    return mass_matrix(parameters[0], inertia, parameters[1:4])


def pendulum_inertia(
    mass: tuple[float, float],
    arm: tuple[float, float],
    period: tuple[float, float],
    gravity: tuple[float, float] = (GRAVITY, 0.0),
) -> tuple[float, float]:
    """Return the inertia about the centre of gravity of a body that swings about a pivot [kg m²].

    Parameters
    ----------
    mass, arm, period, gravity : (float, float)
        Value and standard deviation: of the body [kg], of the pivot's distance from the centre of
        gravity [m], of a full small swing [s], of the local gravity [m/s²].

    Returns
    -------
    float, float — inertia about the axis parallel to the pivot, and its standard deviation

    Raises
    ------
    InputError
        Values not above 0, or a period shorter than that of a point mass on this arm.

    See Also
    --------
    deboom.torsion_inertia, deboom.free_body

    Notes
    -----
    ``J = m g l (T/2π)² − m l²``, deviations to first order. The short arm has the small deviation.

    Examples
    --------
    >>> inertia, deviation = pendulum_inertia((2.02, 0.02), (0.293, 0.001), (1.33, 0.01))
    >>> print(f"{inertia:.4f} ± {deviation:.4f} kg m²")
    0.0867 ± 0.0040 kg m²
    """
    (m, dm), (length, dl), (t, dt), (g, dg) = mass, arm, period, gravity
    if min(m, length, t) <= 0:
        raise InputError("mass, arm and period of a pendulum are above 0")
    squared = (t / (2 * np.pi)) ** 2
    inertia = m * length * (g * squared - length)
    if inertia <= 0:
        raise InputError(
            f"a period of {t:g} s is shorter than that of a point mass on {length:g} m: measure "
            "the arm from the pivot to the centre of gravity"
        )
    slopes = np.array(
        [
            inertia / m,
            m * (g * squared - 2 * length),
            2 * m * g * length * squared / t,
            m * length * squared,
        ]
    )
    return float(inertia), float(np.linalg.norm(slopes * [dm, dl, dt, dg]))


def torsion_inertia(
    period: tuple[float, float], reference: tuple[float, float], inertia: tuple[float, float]
) -> tuple[float, float]:
    """Return the inertia of a body on a torsion wire, from a reference body on it [kg m²].

    Parameters
    ----------
    period, reference : (float, float)
        Full swing of the body and of the reference body, and standard deviations [s].
    inertia : (float, float)
        Of the reference body about the wire, and its standard deviation [kg m²].

    Returns
    -------
    float, float — inertia about the wire, and its standard deviation to first order

    Raises
    ------
    InputError
        Values not above 0.

    See Also
    --------
    deboom.pendulum_inertia, deboom.free_body

    Notes
    -----
    ``J = J_r (T/T_r)²``.

    Examples
    --------
    >>> print("%.3f ± %.3f" % torsion_inertia((2.0, 0.01), (1.0, 0.01), (0.1, 0.0)))
    0.400 ± 0.009
    """
    if min(period[0], reference[0], inertia[0]) <= 0:
        raise InputError("periods and inertia of a torsion pendulum are above 0")
    value = inertia[0] * (period[0] / reference[0]) ** 2
    parts = [2 * period[1] / period[0], 2 * reference[1] / reference[0], inertia[1] / inertia[0]]
    return float(value), float(value * np.linalg.norm(parts))
