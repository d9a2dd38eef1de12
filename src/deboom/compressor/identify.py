"""From a hammer test to an identified compressor, step by step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.compressor.hold_out import HoldOut, hold_out_impacts, hold_out_lines
from deboom.compressor.identifiability import Knowledge, knowledge
from deboom.compressor.linear_start import START_GAIN, linear_start
from deboom.compressor.minimal_parameters import N_MASS, N_STIFFNESS, MinimalParameters
from deboom.compressor.modes import ModalTable, modal_table
from deboom.compressor.objectives import THESIS_BANDS, WhitenedInertance, in_bands
from deboom.compressor.raw_inertance import RawInertance, deviation_from_coherence
from deboom.compressor.rigid_limit import RigidLimit, rigid_limit
from deboom.compressor.self_calibration import (
    Prior,
    SelfCalibration,
    WeighedMass,
    self_calibrate,
)
from deboom.compressor.sheet_checks import (
    misplaced,
    refuse_different_units,
    refuse_implausible_body,
    refuse_sheet_faults,
    refuse_wrong_scale,
    sheet_tolerances,
)
from deboom.compressor.virtual_point_fit import Bounds, PointFit, fit_at_virtual_point
from deboom.errors import InputError
from deboom.measurement.channel_geometry import impact_geometry, sensor_geometry
from deboom.measurement.channels import Frf
from deboom.measurement.inertance_test import InertanceTest
from deboom.measurement.quality import quality_of_frf
from deboom.measurement.quality_check import QualityCheck
from deboom.measurement.virtual_point import VirtualPoint, virtual_point, virtual_point_frf
from deboom.physics.frf import FrfForm

ALARM = 1.5
"""Reduced χ above this: flexible receiver, hoses, wrong symmetry; do not trust the model."""
GAIN_DEVIATION = (0.6, 0.8, 0.15, 0.8, 0.8)
"""How widely rubbers differ from `START_GAIN`, 1 σ, in the order of `GAIN_SHAPE_NAMES`."""
SANE_DEVIATIONS = 6.0
"""Of these that the gain's shape may move in the fit at the virtual point."""

Step = Callable[[str], None]
LineMask: TypeAlias = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class IdentifyOptions:
    """What the identification looks at.

    Parameters
    ----------
    bands : tuple of (float, float)
        Lines of the fit [Hz]; the thesis's by default.
    largest_lines : int
        Of the fit; denser lines are thinned evenly, since placement and not noise limits it.
    smallest_coherence : float
        Median over the lines of the fit below which nothing is identified [1].
    held_out : int
        Every how many impacts one is left out and predicted; 0 leaves the check out.
    gain_deviation : tuple of float
        1 σ of the gain's shape before the test; see `GAIN_DEVIATION`.

    Raises
    ------
    InputError
        Fewer than 12 lines, or leaving out more than every third impact.
    """

    bands: tuple[tuple[float, float], ...] = THESIS_BANDS
    largest_lines: int = 72
    smallest_coherence: float = 0.8
    held_out: int = 6
    gain_deviation: tuple[float, ...] = GAIN_DEVIATION

    def __post_init__(self) -> None:
        if self.largest_lines < 12:
            raise InputError("an identification needs at least 12 lines")
        if self.held_out in (1, 2):
            raise InputError("leave out at most every third impact, or 0 for none")


@dataclass(frozen=True, eq=False)
class Identification:
    """Everything that a hammer test says of a compressor.

    Parameters
    ----------
    test : InertanceTest
        What was measured.
    length : float
        Characteristic length, the radius of gyration, by which rotations are scaled [m].
    quality : tuple of QualityCheck
        In their order.
    response, excitation : VirtualPoint
        As the position sheet has them.
    inertance : Frf
        At the virtual point, all lines [1/kg, 1/(kg m), 1/(kg m²)].
    raw : RawInertance
        All lines with their noise.
    fitted : bool array, shape (n_frequency,)
        Lines of the fit.
    start : array, shape (35,)
        Linear start.
    point : PointFit
        Fit at the virtual point, placement as the sheet has it.
    calibrated : SelfCalibration
        The result: compressor and placement together.
    known : Knowledge
        Posterior against prior.
    modes : ModalTable
    rigid : RigidLimit
    held_out : tuple of HoldOut
        Other lines; other impacts.
    """

    test: InertanceTest
    length: float
    quality: tuple[QualityCheck, ...]
    response: VirtualPoint
    excitation: VirtualPoint
    inertance: Frf
    raw: RawInertance
    fitted: LineMask
    start: RealArray
    point: PointFit
    calibrated: SelfCalibration
    known: Knowledge
    modes: ModalTable
    rigid: RigidLimit
    held_out: tuple[HoldOut, ...]

    @property
    def alarms(self) -> tuple[str, ...]:
        """Reasons not to trust the model, in words; empty where there are none."""
        found = []
        if self.calibrated.reduced_chi > ALARM:
            found.append(
                f"The residuals are {self.calibrated.reduced_chi:.2f} times the noise (alarm at "
                f"{ALARM:g}): a flexible receiver, hoses, or mounts that differ in their gain."
            )
        for check in self.held_out:
            if check.reduced_chi > ALARM:
                found.append(
                    f"Held out, {check.what} are missed by {check.reduced_chi:.2f} times the noise "
                    f"(alarm at {ALARM:g}), {check.relative_error:.1%} of their size."
                )
        off = misplaced(self.calibrated, self.test.tolerances)
        if off:
            found.append(
                f"Further from the sheet than its tolerances allow: {', '.join(off[:4])}"
                + (f" and {len(off) - 4} more." if len(off) > 4 else ".")
            )
        if not self.rigid.is_rigid:
            found.append(self.rigid.statement)
        if not self.calibrated.converged:
            found.append("The self-calibration stopped before it converged.")
        return tuple(found)


def identify(
    test: InertanceTest, options: IdentifyOptions | None = None, step: Step | None = None
) -> Identification:
    """Identify mass, centre of gravity, inertia, stiffness and gain of a mounted compressor.

    Parameters
    ----------
    test : InertanceTest
    options : IdentifyOptions, optional
    step : callable of str, optional
        Told what is being done, for progress.

    Returns
    -------
    Identification

    Raises
    ------
    InputError
        Coherence too low, a reversed, swapped or exchanged channel or impact, a body of implausible
        size, a mass that is not the weighed one, a virtual point that the sensors or impacts do not
        span.
    """
    options = options or IdentifyOptions()
    say = step or (lambda _: None)
    say("virtual point and quality")
    refuse_different_units(test)
    fitted = _lines(test, options)
    _require_coherence(test, fitted, options)
    response = virtual_point(sensor_geometry(test.sensors))
    excitation = virtual_point(impact_geometry(test.impacts))
    refuse_sheet_faults(test, response, excitation)
    quality = quality_of_frf(
        response,
        excitation,
        test.frf,
        FrfForm.INERTANCE,
        tolerances=sheet_tolerances(test.tolerances),
    )
    inertance = virtual_point_frf(test.frf, response=response, excitation=excitation)
    raw = RawInertance(
        test.sensors,
        test.impacts,
        test.frf,
        np.maximum(
            deviation_from_coherence(test.frf, test.coherence, test.n_averages),
            1e-9 * np.abs(test.frf.values).max(),
        ),
    )
    say("linear start")
    parametrisation, start = _start(test, inertance, fitted)
    say("fit at the virtual point")
    part = raw.select(fitted)
    objective = WhitenedInertance(
        part.frf.frequency,
        inertance.values[fitted],
        response.inverse,
        excitation.inverse,
        np.sqrt(np.mean(part.deviation**2, axis=(1, 2))),
    )
    prior = _prior(options)
    point = fit_at_virtual_point(parametrisation, objective, start, _sane(prior, start))
    refuse_wrong_scale(test, point.model)
    say("self-calibration")
    weighed = (
        WeighedMass(test.weighed_mass, test.weighed_mass_deviation)
        if test.weighed_mass is not None
        else None
    )
    calibrated = self_calibrate(
        parametrisation, part, test.tolerances, point.values, weighed=weighed, prior=prior
    )
    held_out: list[HoldOut] = []
    between = _between(test.frf.frequency, options) & ~fitted
    if between.any():
        held_out.append(hold_out_lines(calibrated, raw.select(between)))
    if options.held_out:
        say("prediction of held-out impacts")
        out = [impact.name for impact in test.impacts[:: options.held_out]]
        without = self_calibrate(
            parametrisation,
            part.without(out),
            test.tolerances,
            calibrated.values,
            weighed=weighed,
            prior=prior,
        )
        held_out.append(hold_out_impacts(without, part, test.tolerances))
    return Identification(
        test,
        parametrisation.length,
        quality,
        response,
        excitation,
        inertance,
        raw,
        fitted,
        start,
        point,
        calibrated,
        knowledge(parametrisation.names, calibrated.parameter_covariance, prior.deviations),
        modal_table(calibrated.model),
        rigid_limit(
            # by the sheet: the calibration explains part of a flexible body by placement
            calibrated.model,
            inertance.frequency,
            np.linalg.inv(inertance.values),
        ),
        tuple(held_out),
    )


def _lines(test: InertanceTest, options: IdentifyOptions) -> LineMask:
    """Mark the lines of the fit: in the bands, thinned evenly."""
    marked = np.flatnonzero(in_bands(test.frf.frequency, options.bands))
    if marked.size > options.largest_lines:
        spread = np.linspace(0, marked.size - 1, options.largest_lines)
        marked = marked[np.round(spread).astype(int)]
    lines = np.zeros(test.frf.frequency.size, dtype=bool)
    lines[marked] = True
    return lines


def _between(frequency: RealArray, options: IdentifyOptions) -> LineMask:
    """Mark the lines from the lowest to the highest band."""
    low, high = min(b[0] for b in options.bands), max(b[1] for b in options.bands)
    return np.asarray((frequency >= low) & (frequency <= high))


def _require_coherence(test: InertanceTest, lines: LineMask, options: IdentifyOptions) -> None:
    median = np.median(test.coherence[lines], axis=0)
    middle = float(np.median(median))
    if middle < options.smallest_coherence:
        channel, impact = np.unravel_index(int(np.argmin(median)), median.shape)
        raise InputError(
            f"{test.name}: the median coherence is {middle:.2f}, below "
            f"{options.smallest_coherence:g}; the worst is {test.frf.outputs[int(channel)]} at "
            f"{test.frf.inputs[int(impact)]}: repeat the hits, nothing is identified from these"
        )


def _start(
    test: InertanceTest, inertance: Frf, fitted: LineMask
) -> tuple[MinimalParameters, RealArray]:
    """Linear start with the radius of gyration as characteristic length."""
    places = np.array([sensor.position for sensor in test.sensors])
    length = float(np.mean(np.linalg.norm(places - places.mean(axis=0), axis=1)))
    lines, values = inertance.frequency[fitted], inertance.values[fitted]
    for _ in range(2):
        parametrisation = MinimalParameters(length)
        start = linear_start(parametrisation, lines, values)
        model = parametrisation.model(start)
        length = float(np.sqrt(np.trace(model.inertia) / (3 * model.mass)))
    refuse_implausible_body(test, model, length)
    return parametrisation, parametrisation.values_of(model)


def _sane(prior: Prior, start: RealArray) -> Bounds:
    """Bounds of the gain's shape only, so far out that they hold no rubber.

    Misplaced sensors leave the shape so free that a fit without prior may run off to infinity.
    """
    width = SANE_DEVIATIONS * prior.deviations
    known = np.isfinite(width)
    lower, upper = prior.values - width, prior.values + width
    return Bounds(
        np.where(known, np.minimum(lower, start), -np.inf),
        np.where(known, np.maximum(upper, start), np.inf),
    )


def _prior(options: IdentifyOptions) -> Prior:
    free = N_MASS + N_STIFFNESS
    return Prior(
        np.concatenate([np.zeros(free), START_GAIN]),
        np.concatenate([np.full(free, np.inf), options.gain_deviation]),
    )
