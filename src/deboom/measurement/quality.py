"""Quality report of a virtual point, in the order in which a laboratory repairs things.

Conditioning, before anything is measured; geometric consistency; specific and overall consistency;
reciprocity; passivity; and leave-one-out, which names the culprit.

Two consistencies compare what channels measured with what the body's motion, estimated from all of
them, makes of it: the thesis's geometric one is an error, 0 is perfect; van der Seijs's rigid one a
coherence, 1 is perfect.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.culprit import (
    SIGNIFICANT,
    Diagnosis,
    culprit_of_excitation,
    culprit_of_responses,
)
from deboom.measurement.sensors import Tolerances
from deboom.measurement.virtual_point import (
    RIGID_LOADS,
    RIGID_MOTIONS,
    ChannelGeometry,
    VirtualPoint,
    channel_values,
    conditioning,
    virtual_point_frf,
)
from deboom.physics.frf import FrfForm, convert

CHANCE = 0.5
"""Mean of `likeness` for two numbers that have nothing to do with each other."""

HALFWAY = (1.0 + CHANCE) / 2.0
"""Halfway between equal functions and unrelated ones: 60°, or a factor of 3.7 [1]."""

SLACK = 0.05
"""Power given, relative to the largest mobility, that noise on a weakly damped body explains."""

ROTATIONS = (*RIGID_MOTIONS[3:], *RIGID_LOADS[3:])


LARGEST_CONDITION_NUMBER = 10.0
"""Scaled: the worst-seen motion has this much more noise than the best-seen one [1]."""
LEAST_REDUNDANCY = 0.05
"""Share of a channel that the others must be able to tell [1]."""
LARGEST_INCONSISTENCY = 0.02
"""Mean error of a channel from which the thesis's metric safely flags inverted channels (0.09) and
swapped axes (0.27) [1]."""
LARGEST_ACTIVE_SHARE = 0.05
"""Share of the lines at which power may come out of a driving point [1]."""

DEFAULT_TOLERANCES = Tolerances()


@dataclass(frozen=True)
class QualityCheck:
    """One check: a number, its limit, and who is to blame.

    - `number`, `limit`: figure and its limit [1]; None where the data do not allow the check.
    - `culprit`: channel, sensor, pair or motion with the worst figure; without a number, what is
      missing.
    """

    name: str
    number: float | None
    limit: float | None
    at_most: bool
    passed: bool | None
    culprit: str


def _at_most(name: str, figures: Mapping[str, float], limit: float) -> QualityCheck:
    """Check the largest of several figures, by channel or pair, against an upper limit."""
    culprit = max(figures, key=lambda key: figures[key])
    number = float(figures[culprit])
    return QualityCheck(name, number, limit, True, number <= limit, culprit)


def _at_least(name: str, figures: Mapping[str, float], limit: float) -> QualityCheck:
    """Check the smallest of several figures, by channel or pair, against a lower limit."""
    culprit = min(figures, key=lambda key: figures[key])
    number = float(figures[culprit])
    return QualityCheck(name, number, limit, False, number >= limit, culprit)


def _not_checked(name: str, missing: str) -> QualityCheck:
    return QualityCheck(name, None, None, True, None, missing)


def quality_table(checks: Sequence[QualityCheck]) -> list[dict[str, object]]:
    """Return the checks as rows of a table: check, number [1], limit, verdict and worst."""
    verdicts = {True: "kept", False: "look here", None: "not checked"}
    return [
        {
            "check": check.name,
            "number [1]": check.number,
            "limit": ""
            if check.limit is None
            else f"{'≤' if check.at_most else '≥'} {check.limit:.3g}",
            "verdict": verdicts[check.passed],
            "worst": check.culprit,
        }
        for check in checks
    ]


def quality_of_sheet(geometry: ChannelGeometry, what: str = "sensors") -> tuple[QualityCheck, ...]:
    """Judge a position sheet before anything is measured, by scaled conditioning and redundancy.

    A sheet that misses a motion is reported, not refused. Checks are named after `what`, sensors or
    impacts.
    """
    state = conditioning(geometry)
    return (
        _at_most(
            f"conditioning of {what}, length {1e3 * state.length:.0f} mm",
            {state.worst_seen: state.condition_number},
            LARGEST_CONDITION_NUMBER,
        ),
        _at_least(
            f"redundancy of {what}",
            dict(zip(geometry.channels, state.redundancy, strict=True)),
            LEAST_REDUNDANCY,
        ),
    )


def quality_in_operation(
    point: VirtualPoint,
    measured: Spectrum,
    *,
    tolerances: Tolerances = DEFAULT_TOLERANCES,
) -> tuple[QualityCheck, ...]:
    """Judge the virtual point of a body in operation.

    All checks are listed in their order; those that need a known force as not checked. Raises
    InputError: a missing channel, or lines without signal.
    """
    missing = "needs frequency response functions"
    return (
        *quality_of_sheet(point.geometry, "sensors"),
        *_consistency_checks(point, measured),
        _not_checked("reciprocity", missing),
        _not_checked("passivity", missing),
        _leave_one_out("sensors", culprit_of_responses(point, measured, tolerances)),
    )


def quality_of_frf(
    response: VirtualPoint,
    excitation: VirtualPoint,
    measured: Frf,
    form: FrfForm,
    *,
    tolerances: Tolerances = DEFAULT_TOLERANCES,
) -> tuple[QualityCheck, ...]:
    """Judge a virtual point that was hit and watched.

    Parameters and errors as for `quality_in_operation`, with functions from impacts to channels, of
    the given form. Reciprocity and passivity are those of a driving point, not checked if the two
    virtual points are apart. Tolerances of the sensors are taken for the impacts as well.
    """
    used = measured.select(response.channels, excitation.channels)
    return (
        *quality_of_sheet(response.geometry, "sensors"),
        *quality_of_sheet(excitation.geometry, "impacts"),
        *_consistency_checks(response, used),
        *_rigid_checks("impacts", excitation_consistency(excitation, used)),
        *_driving_point_checks(response, excitation, used, form),
        _leave_one_out("sensors", culprit_of_responses(response, used, tolerances)),
        _leave_one_out("impacts", culprit_of_excitation(excitation, used, tolerances)),
    )


def _consistency_checks(point: VirtualPoint, measured: Spectrum | Frf) -> tuple[QualityCheck, ...]:
    figures = geometric_consistency(point, measured)
    return (
        _at_most("geometric consistency (error)", figures, LARGEST_INCONSISTENCY),
        *_rigid_checks("sensors", response_consistency(point, measured)),
    )


def _rigid_checks(what: str, consistency: RigidConsistency) -> tuple[QualityCheck, ...]:
    means = consistency.specific.mean(axis=0)
    specific = dict(zip(consistency.channels, means, strict=True))
    worst_line = consistency.frequency[int(np.argmin(consistency.overall))]
    # of unrelated channels the projection keeps n_motion / n_channel of the energy
    by_chance = np.sqrt(len(RIGID_MOTIONS) / len(specific))
    return (
        _at_least(f"specific consistency of {what}", specific, HALFWAY),
        _at_least(
            f"overall consistency of {what}, mean",
            {f"least at {worst_line:g} Hz": float(consistency.overall.mean())},
            float((1.0 + by_chance) / 2.0),
        ),
    )


def _driving_point_checks(
    response: VirtualPoint,
    excitation: VirtualPoint,
    measured: Frf,
    form: FrfForm,
) -> tuple[QualityCheck, ...]:
    if not np.allclose(response.geometry.position, excitation.geometry.position):
        missing = "needs responses and excitation at one virtual point"
        return _not_checked("reciprocity", missing), _not_checked("passivity", missing)
    at_point = virtual_point_frf(measured, response=response, excitation=excitation)
    pair, value = reciprocity(at_point).worst()
    power = passivity(at_point, form, response.conditioning.length)
    return (
        _at_least("reciprocity", {pair: value}, HALFWAY),
        _at_most(
            "passivity (share of active lines)",
            {power.worst: power.active_share},
            LARGEST_ACTIVE_SHARE,
        ),
    )


def _leave_one_out(what: str, diagnosis: Diagnosis) -> QualityCheck:
    """Contradiction of the first suspect over what the tolerances let expect."""
    name = f"leave-one-out of {what} (contradiction over tolerance)"
    if not diagnosis.residual_without:
        return _not_checked(name, diagnosis.verdict)
    number = diagnosis.suspect.significance if diagnosis.suspect else 0.0
    passed = not diagnosis.named
    return QualityCheck(name, number, SIGNIFICANT, True, passed, diagnosis.verdict)


def likeness(first: npt.ArrayLike, second: npt.ArrayLike, axis: int | None = None) -> RealArray:
    """Return the coherence criterion of two complex quantities that should be equal.

    1 if equal, 0 if opposite, 0.5 if one of them is zero and on average 0.5 if they are unrelated
    [1]; 1 where both are zero. Energies are summed over `axis`, if given.

    ``|a + b|² / 2 (|a|² + |b|²)``: van der Seijs's coherence of two responses, the number that
    pyFBS averages over lines for reciprocity and specific consistency. Equal amplitudes 60° apart
    give 0.75, so does a factor of 3.7 in phase.
    """
    a, b = np.asarray(first, dtype=complex), np.asarray(second, dtype=complex)
    if a.shape != b.shape:
        raise InputError(f"shapes {a.shape} and {b.shape} differ")
    together, apart = np.abs(a + b) ** 2, np.abs(a) ** 2 + np.abs(b) ** 2
    if axis is not None:
        together, apart = together.sum(axis=axis), apart.sum(axis=axis)
    return _share(together, 2.0 * apart)


def _share(part: RealArray, whole: RealArray) -> RealArray:
    """Quotient of energies; 1 where there is none."""
    silent = whole == 0
    return np.asarray(np.where(silent, 1.0, part / np.where(silent, 1.0, whole)))


@checked(frequency="f", overall="f", specific="f c")
class RigidConsistency:
    """What is left of the channels after projection on the motions of the virtual point.

    - `frequency` (n_frequency,) [Hz]; `channels`: of the sensors, or the impacts.
    - `overall` (n_frequency,): norm of the projected over that of the measured channels [1].
    - `specific` (n_frequency, n_channel): coherence of projected and measured channel, 0 … 1 [1];
      0.5 if nothing is left of it.
    """

    frequency: RealArray
    channels: tuple[str, ...]
    overall: RealArray
    specific: RealArray


def geometric_consistency(point: VirtualPoint, measured: Spectrum | Frf) -> dict[str, float]:
    """Return the geometric consistency of the thesis: the mean error of each channel.

    0 is perfect; above 0.02 a channel deserves a look [1]. Every line of every input of a matrix
    counts as a line. A missing channel, or no signal, raises InputError.

    ``Corr = Σ_f (|Re e| + |Im e|) / (2 M max(|Re a|, |Im a|))`` over M lines, with the error
    ``e = a − V V⁺ a`` and the maximum over all channels and lines. Thesis, 3.2.3; its formula sums
    the differences without absolute values, which its text and its meaning ask for: errors of
    opposite sign would cancel.
    """
    values = channel_values(point, measured).reshape(-1, len(point.channels))
    error = values - point.reproject(values)
    largest = max(np.abs(values.real).max(), np.abs(values.imag).max())
    if largest == 0:
        raise InputError("no channel shows any signal: there is nothing to be consistent")
    mean = np.mean(np.abs(error.real) + np.abs(error.imag), axis=0) / (2 * largest)
    return {name: float(value) for name, value in zip(point.channels, mean, strict=True)}


def response_consistency(point: VirtualPoint, measured: Spectrum | Frf) -> RigidConsistency:
    """Return the consistency of the motion sensors (van der Seijs), ``u_f = V V⁺ u``.

    Energies of functions are summed over the inputs. A missing channel, or a line without any
    signal, raises InputError.
    """
    return _consistency(point, measured.frequency, channel_values(point, measured))


def excitation_consistency(point: VirtualPoint, measured: Frf) -> RigidConsistency:
    """Return the consistency of the points of excitation (van der Seijs), ``y_f = y (U U⁺)ᵀ``.

    The same projection as for responses, because each row of a rigid body's matrix is ``y = c Uᵀ``.
    Energies are summed over the outputs. A missing impact, or a line without any signal, raises
    InputError.
    """
    return _consistency(point, measured.frequency, measured.select(inputs=point.channels).values)


def _consistency(
    point: VirtualPoint, frequency: RealArray, values: ComplexArray
) -> RigidConsistency:
    """Consistency of values of shape (n_frequency, n_other, n_channel)."""
    projected = point.reproject(values)
    energy, kept = (np.sum(np.abs(part) ** 2, axis=(1, 2)) for part in (values, projected))
    if not np.all(energy > 0):
        raise InputError(
            f"no channel shows any signal at {frequency[int(np.argmin(energy))]:g} Hz: there is "
            "nothing to be consistent"
        )
    specific = likeness(projected, values, axis=1)
    return RigidConsistency(frequency, point.channels, np.sqrt(kept / energy), specific)


@checked(likeness="n n", size="n n")
class Reciprocity:
    """How symmetric a matrix of frequency response functions is.

    - `likeness` (n, n): coherence criterion of each entry and its mirror image over the lines, each
      weighted by ``|Y_ij|² / |Y_ii Y_jj|``, so that lines of nothing but noise do not count: 1 is
      perfect, 0.5 what two unrelated functions have, 0 opposite sign [1].
    - `size` (n, n): rms over the lines of an entry and its mirror image, so weighted [1].
    """

    names: tuple[str, ...]
    likeness: RealArray
    size: RealArray

    def worst(self, smallest: float = 0.1) -> tuple[str, float]:
        """Return the least reciprocal pair, such as ``x–ry``, and its likeness.

        Pairs of a `size` below `smallest` do not count: symmetric bodies have entries that are
        nothing but noise. An empty name and 1 where all pairs are small.
        """
        rows, columns = np.triu_indices(len(self.names), k=1)
        pairs = [
            (float(self.likeness[i, j]), f"{self.names[i]}–{self.names[j]}")
            for i, j in zip(rows, columns, strict=True)
            if self.size[i, j] >= smallest
        ]
        value, name = min(pairs, default=(1.0, ""))
        return name, value


def reciprocity(frf: Frf) -> Reciprocity:
    """Compare each entry of a square matrix with its mirror image.

    Output i and input i are one degree of freedom, such as a virtual point's x and fx. Not square,
    or a diagonal entry of 0, raises InputError.

    Mind the scale: real virtual points are far from 1. Of the 15 pairs of a published rubber mount
    only three lie above 0.95, and four within 0.1 of the 0.5 of unrelated functions.
    """
    driving = np.abs(_driving_point(frf.values, frf.outputs, "reciprocity"))
    mirrored = np.swapaxes(frf.values, 1, 2)
    reference = np.sqrt(driving[:, :, np.newaxis] * driving[:, np.newaxis, :])
    comparable, mirror = frf.values / reference, mirrored / reference
    energy = (np.abs(comparable) ** 2 + np.abs(mirror) ** 2) / 2
    return Reciprocity(
        names=frf.outputs,
        likeness=likeness(comparable, mirror, axis=0),
        size=np.sqrt(energy.mean(axis=0)),
    )


def _driving_point(values: ComplexArray, names: tuple[str, ...], what: str) -> ComplexArray:
    """Diagonal of a square matrix, shape (n_frequency, n), nowhere 0."""
    n_output, n_input = values.shape[1:]
    if n_output != n_input:
        raise InputError(f"{what} needs as many inputs as outputs, not {n_output} by {n_input}")
    diagonal: ComplexArray = np.einsum("fii->fi", values)
    if np.any(diagonal == 0):
        where = names[int(np.argwhere(diagonal == 0)[0, 1])]
        raise InputError(f"the driving point function of {where} is 0: {what} needs it")
    return diagonal


@checked(frequency="f", margin="f", driving_point="f n")
class Passivity:
    """Power that a driving point takes.

    - `frequency` (n_frequency,).
    - `margin` (n_frequency,): least power over all forces of one size, −1 … 1; negative where power
      comes out [1].
    - `driving_point` (n_frequency, n): share of its apparent power that each degree of freedom
      takes when pushed alone, −1 … 1 (cosine of the phase between force and velocity) [1].
    """

    frequency: RealArray
    names: tuple[str, ...]
    margin: RealArray
    driving_point: RealArray

    @property
    def active_share(self) -> float:
        """Share of the lines at which more power comes out than noise explains [1]."""
        return float(np.mean(self.margin < -SLACK))

    @property
    def worst(self) -> str:
        """The degree of freedom that takes the least power when pushed alone."""
        return self.names[int(np.argmin(self.driving_point.mean(axis=0)))]


def passivity(frf: Frf, form: FrfForm, length: float) -> Passivity:
    """Check the sign of the power at a driving point: a structure takes power and gives none.

    Output i and input i are one degree of freedom; outputs named rx ry rz (mx my mz of an inverse
    form) are rotations, made comparable by the characteristic length [m]. Raises InputError: a
    matrix that is not square, a line at 0 Hz where it is divided by, a driving point function that
    is 0.

    The power ``½ Re Fᴴ v = ½ Fᴴ Y F`` is positive for every F if and only if the Hermitian part of
    the mobility Y (or of the impedance) has no negative eigenvalue; the margin is the smallest one
    over the norm of Y. For one degree of freedom: the phase of an inertance lies within 0 … 180°.
    """
    if not length > 0:
        raise InputError(f"a characteristic length is positive, not {length} m")
    target = FrfForm.IMPEDANCE if form.is_inverse else FrfForm.MOBILITY
    values = convert(frf.values, frf.frequency, form, target)
    turning = np.isin(frf.outputs, ROTATIONS)
    scale = np.where(turning, 1 / length if form.is_inverse else length, 1.0)
    diagonal = _driving_point(values, frf.outputs, "passivity") * scale**2
    values = values * np.outer(scale, scale)
    hermitian = (values + np.swapaxes(values, 1, 2).conj()) / 2
    return Passivity(
        frequency=frf.frequency,
        names=frf.outputs,
        margin=np.linalg.eigvalsh(hermitian)[:, 0] / np.linalg.norm(values, ord=2, axis=(1, 2)),
        driving_point=diagonal.real / np.abs(diagonal),
    )
