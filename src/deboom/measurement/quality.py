"""Quality report of a virtual point, in the order in which a laboratory repairs things.

Conditioning, before anything is measured; coherence of repeats; geometric consistency; specific
and overall consistency; reciprocity; passivity; and leave-one-out, which names the culprit.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from deboom.measurement.channel_geometry import ChannelGeometry
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.coherence import repeat_coherence
from deboom.measurement.conditioning import conditioning
from deboom.measurement.consistency import (
    RigidConsistency,
    excitation_consistency,
    geometric_consistency,
    response_consistency,
)
from deboom.measurement.culprit import (
    SIGNIFICANT,
    Diagnosis,
    culprit_of_excitation,
    culprit_of_responses,
)
from deboom.measurement.passivity import passivity
from deboom.measurement.quality_check import (
    QualityCheck,
    QualityLimits,
    at_least,
    at_most,
    not_checked,
)
from deboom.measurement.reciprocity import reciprocity
from deboom.measurement.tolerances import Tolerances
from deboom.measurement.virtual_point import VirtualPoint, channel_values, virtual_point_frf
from deboom.physics.frf import FrfForm

DEFAULT_LIMITS = QualityLimits()
DEFAULT_TOLERANCES = Tolerances()


def quality_of_sheet(
    geometry: ChannelGeometry, what: str = "sensors", limits: QualityLimits = DEFAULT_LIMITS
) -> tuple[QualityCheck, ...]:
    """Judge a position sheet before anything is measured.

    Parameters
    ----------
    geometry : ChannelGeometry
        Channels in use, seen from the virtual point.
    what : str
        ``sensors`` or ``impacts``, for the names of the checks.
    limits : QualityLimits

    Returns
    -------
    tuple of QualityCheck
        Scaled conditioning and redundancy; a sheet that misses a motion is reported, not refused.

    Raises
    ------
    InputError
        No channels, or all of them at the virtual point.
    """
    state = conditioning(geometry)
    return (
        at_most(
            f"conditioning of {what}, length {1e3 * state.length:.0f} mm",
            {state.worst_seen: state.condition_number},
            limits.condition_number,
        ),
        at_least(
            f"redundancy of {what}",
            dict(zip(geometry.channels, state.redundancy, strict=True)),
            limits.redundancy,
        ),
    )


def quality_in_operation(
    point: VirtualPoint,
    measured: Spectrum,
    *,
    repeats: Sequence[Spectrum] = (),
    tolerances: Tolerances = DEFAULT_TOLERANCES,
    limits: QualityLimits = DEFAULT_LIMITS,
) -> tuple[QualityCheck, ...]:
    """Judge the virtual point of a body in operation.

    Parameters
    ----------
    point : VirtualPoint
        Of the motion sensors.
    measured : Spectrum
        One run.
    repeats : sequence of Spectrum
        The same run again, phase referred to the same event; may be empty.
    tolerances : Tolerances
        Of placement and calibration.
    limits : QualityLimits

    Returns
    -------
    tuple of QualityCheck
        All checks in their order; those that need a known force are listed as not checked.

    Raises
    ------
    InputError
        A missing channel, repeats of other lines, or lines without signal.
    """
    missing = "needs frequency response functions"
    return (
        *quality_of_sheet(point.geometry, "sensors", limits),
        _coherence(point, (measured, *repeats), limits),
        *_consistency(point, measured, limits),
        not_checked("reciprocity", missing),
        not_checked("passivity", missing),
        _leave_one_out("sensors", culprit_of_responses(point, measured, tolerances)),
    )


def quality_of_frf(
    response: VirtualPoint,
    excitation: VirtualPoint,
    measured: Frf,
    form: FrfForm,
    *,
    repeats: Sequence[Frf] = (),
    tolerances: Tolerances = DEFAULT_TOLERANCES,
    limits: QualityLimits = DEFAULT_LIMITS,
) -> tuple[QualityCheck, ...]:
    """Judge a virtual point that was hit and watched.

    Parameters
    ----------
    response, excitation : VirtualPoint
        Of the motion sensors and of the points of excitation.
    measured : Frf
        Channels as outputs, impacts as inputs.
    form : FrfForm
        Motion per force.
    repeats : sequence of Frf
        The same measurement again; may be empty.
    tolerances : Tolerances
        Of placement and calibration; those of the sensors are taken for the impacts as well.
    limits : QualityLimits

    Returns
    -------
    tuple of QualityCheck
        All checks in their order. Reciprocity and passivity are those of a driving point, not
        checked if the two virtual points are apart.

    Raises
    ------
    InputError
        A missing channel or impact, repeats of other lines, or lines without signal.
    """
    used = measured.select(response.channels, excitation.channels)
    again = [repeat.select(used.outputs, used.inputs) for repeat in repeats]
    return (
        *quality_of_sheet(response.geometry, "sensors", limits),
        *quality_of_sheet(excitation.geometry, "impacts", limits),
        _coherence(response, (used, *again), limits),
        *_consistency(response, used, limits),
        *_rigid("impacts", excitation_consistency(excitation, used), excitation, limits),
        *_driving_point(response, excitation, used, form, limits),
        _leave_one_out("sensors", culprit_of_responses(response, used, tolerances)),
        _leave_one_out("impacts", culprit_of_excitation(excitation, used, tolerances)),
    )


def _coherence(
    point: VirtualPoint, runs: Sequence[Spectrum | Frf], limits: QualityLimits
) -> QualityCheck:
    name = "coherence of repeats"
    if len(runs) < 2:
        return not_checked(name, "needs the same measurement twice")
    values = repeat_coherence([channel_values(point, run) for run in runs])
    means = values.mean(axis=(0, 1))
    return at_least(name, dict(zip(point.channels, means, strict=True)), limits.repeat_coherence)


def _consistency(
    point: VirtualPoint, measured: Spectrum | Frf, limits: QualityLimits
) -> tuple[QualityCheck, ...]:
    figures = geometric_consistency(point, measured)
    return (
        at_most("geometric consistency (error)", figures, limits.geometric_consistency),
        *_rigid("sensors", response_consistency(point, measured), point, limits),
    )


def _rigid(
    what: str, consistency: RigidConsistency, point: VirtualPoint, limits: QualityLimits
) -> tuple[QualityCheck, ...]:
    means = consistency.specific.mean(axis=0)
    specific = dict(zip(consistency.channels, means, strict=True))
    worst_line = consistency.frequency[int(np.argmin(consistency.overall))]
    n_motion, n_channel = point.inverse.shape
    # of unrelated channels the projection keeps n_motion / n_channel of the energy
    by_chance = np.sqrt(n_motion / n_channel)
    return (
        at_least(f"specific consistency of {what}", specific, limits.specific_consistency),
        at_least(
            f"overall consistency of {what}, mean",
            {f"least at {worst_line:g} Hz": float(consistency.overall.mean())},
            float((1.0 + by_chance) / 2.0),
        ),
    )


def _driving_point(
    response: VirtualPoint,
    excitation: VirtualPoint,
    measured: Frf,
    form: FrfForm,
    limits: QualityLimits,
) -> tuple[QualityCheck, ...]:
    one_place = np.allclose(response.geometry.position, excitation.geometry.position)
    if not one_place or response.geometry.motions != excitation.geometry.motions:
        missing = "needs responses and excitation at one virtual point"
        return not_checked("reciprocity", missing), not_checked("passivity", missing)
    at_point = virtual_point_frf(measured, response=response, excitation=excitation)
    pair, value = reciprocity(at_point).worst()
    power = passivity(at_point, form, response.conditioning.length)
    return (
        at_least("reciprocity", {pair: value}, limits.reciprocity),
        at_most(
            "passivity (share of active lines)",
            {power.worst: power.active_share},
            limits.active_share,
        ),
    )


def _leave_one_out(what: str, diagnosis: Diagnosis) -> QualityCheck:
    """Contradiction of the first suspect over what the tolerances let expect."""
    name = f"leave-one-out of {what} (contradiction over tolerance)"
    if not diagnosis.residual_without:
        return not_checked(name, diagnosis.verdict)
    number = diagnosis.suspect.significance if diagnosis.suspect else 0.0
    passed = not diagnosis.named
    return QualityCheck(name, number, SIGNIFICANT, True, passed, diagnosis.verdict)
