"""Identification of a compressor from its hammer test, step by step."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import numpy.typing as npt

from deboom.arrays import BoolArray, RealArray
from deboom.compressor.hose_presence import hoses_in_hammer_test
from deboom.compressor.identified_compressor import ALARM, Identification, IdentifyOptions
from deboom.compressor.inertance_fit import (
    START_GAIN,
    THESIS_BANDS,
    Bounds,
    fit_at_virtual_point,
    in_bands,
    linear_start,
    thinned,
    whitened_inertance,
)
from deboom.compressor.model import CompressorModel, modal_table, rigid_limit
from deboom.compressor.parameter_information import knowledge
from deboom.compressor.parameters import N_MASS, N_STIFFNESS, MinimalParameters
from deboom.compressor.self_calibration import (
    HoldOut,
    Prior,
    RawInertance,
    SelfCalibration,
    deviation_from_coherence,
    hold_out_lines,
    self_calibrate,
    with_misfit,
)
from deboom.errors import InputError
from deboom.measurement.channels import Frf, refuse_window
from deboom.measurement.compressor_test import (
    HoseDrawing,
    InertanceTest,
    refuse_contradictions,
    refuse_drawing,
    spread,
)
from deboom.measurement.culprit import (
    culprit_of_excitation,
    culprit_of_responses,
    tolerances_of_all,
)
from deboom.measurement.quality import quality_of_frf
from deboom.measurement.virtual_point import (
    impact_geometry,
    sensor_geometry,
    virtual_point,
    virtual_point_frf,
)
from deboom.physics.frf import FrfForm, mac

GAIN_DEVIATION = (0.6, 0.8, 0.15, 0.8, 0.8)
"""How widely rubbers differ from `START_GAIN`, 1 σ, in the order of `GAIN_SHAPE_NAMES`."""
SANE_DEVIATIONS = 6.0
"""Deviations of the gain's shape within which it may move in the fit at the virtual point."""
PLAUSIBLE_DENSITY = (50.0, 2e4)
"""Of a body with the found mass and radius of gyration, from foam to lead [kg/m³]."""
WRONG_SCALE = 2.0
"""Factor by which no tolerance and no flexible body moves the mass from that of the scales."""
DOUBTED_IMPACT = 3.5
"""Contradiction of an impact over the tolerances from which on the check names it [1]: of eighteen,
one in forty right tests has one of 3."""
SMALLEST_MASS_GAP = 0.05
"""Difference of masses that is never doubted [1]."""
OTHER_INERTIA = 1.5
"""Factor between drawn inertia and that of the linear start from which on it is doubted [1]."""
OTHER_STIFFNESS = 5.0
"""The same of stiffness: dynamic over static is 1.3 to 2.5 for rubber [1]."""
MASS_LINE = 60.0
"""Line from which the load of the mounts is some percent of the body's inertia [Hz]."""
SMALLEST_LINES, LARGEST_LINES = 12, 48
"""Lines of a calibration from the mass line."""
MISFIT_LINES = 96
"""Lines of the whole band that say how far a model with an alarm may be off."""
STIFFNESS_DEVIATION = 0.3
"""Of each entry of K_VP over its size, at least `stiffness_scale`: what 60 Hz leave open [1]."""

PRIOR = Prior(
    np.concatenate([np.zeros(N_MASS + N_STIFFNESS), START_GAIN]),
    np.concatenate([np.full(N_MASS + N_STIFFNESS, np.inf), GAIN_DEVIATION]),
)
"""Nothing is known beforehand but the shape of the gain."""

Step = Callable[[str], None]


def identify(
    test: InertanceTest,
    options: IdentifyOptions | None = None,
    step: Step | None = None,
    *,
    hoses: Sequence[HoseDrawing] = (),
) -> Identification:
    """Identify mass, centre of gravity, inertia, stiffness and gain of a mounted compressor.

    Parameters
    ----------
    test : InertanceTest
        Hammer test without hoses.
    options : IdentifyOptions, optional
        Lines and checks.
    step : callable of str, optional
        Receiver of progress messages.
    hoses : sequence of HoseDrawing
        Hoses of the vehicle as drawn: an alarm is raised where they show in the test.

    Returns
    -------
    Identification
        ``calibrated.model``: mass [kg], centre [m], inertia [kg m²], K at the virtual point, (6, 6)
        [N/m, N/rad, N m/rad], and the gain; ``alarms``; ``table`` with standard deviations.

    Raises
    ------
    InputError
        Low coherence, one hit per impact, a band without lines, fewer than eight lines above 60 Hz,
        lengths in two units, a reversed, swapped or exchanged channel or impact, a body of
        implausible density, a mass far from the weighed one, a virtual point that is not spanned.

    See Also
    --------
    deboom.read_inertance_test, deboom.compressor.identified_compressor.Identification
    deboom.unbalance, deboom.free_body

    Examples
    --------
    >>> import deboom
    >>> identification = deboom.identify(deboom.read_inertance_test("hammer"))  # doctest: +SKIP
    >>> identification.table  # doctest: +SKIP
    """
    options = options or IdentifyOptions()
    say = step or (lambda _: None)
    say("virtual point and quality")
    refuse_window(test.frf.added_decay_rate, test.name)
    fitted = thinned(in_bands(test.frf.frequency, options.bands), options.largest_lines)
    _refuse_low_coherence(test, fitted, options)
    response = virtual_point(sensor_geometry(test.sensors))
    excitation = virtual_point(impact_geometry(test.impacts))
    refuse_contradictions(test)
    tolerances = tolerances_of_all(test.tolerances)
    quality = quality_of_frf(
        response, excitation, test.frf, FrfForm.INERTANCE, tolerances=tolerances
    )
    inertance = virtual_point_frf(test.frf, response=response, excitation=excitation)
    deviation = deviation_from_coherence(test.frf, test.coherence, test.n_averages)
    floor = 1e-9 * np.abs(test.frf.values).max()
    raw = RawInertance(test.sensors, test.impacts, test.frf, np.maximum(deviation, floor))
    say("linear start")
    parametrisation, start = _start(test, inertance, fitted)
    say("fit at the virtual point")
    part = raw.select(fitted)
    objective = whitened_inertance(
        part.frf.frequency,
        inertance.values[fitted],
        response.inverse,
        excitation.inverse,
        # sensors have one noise at each line
        np.sqrt(np.mean(part.deviation**2, axis=(1, 2))),
    )
    width = SANE_DEVIATIONS * PRIOR.deviations
    lower, upper = PRIOR.values - width, PRIOR.values + width
    bounds = Bounds(np.minimum(lower, start), np.maximum(upper, start))
    point = fit_at_virtual_point(parametrisation, objective, start, bounds)
    _refuse_wrong_scale(test, point.model)
    say("self-calibration")
    calibrated = self_calibrate(parametrisation, part, test, point.values, PRIOR)
    lowest, highest = min(b[0] for b in options.bands), max(b[1] for b in options.bands)
    between = (test.frf.frequency >= lowest) & (test.frf.frequency <= highest) & ~fitted
    held_out = (hold_out_lines(calibrated, raw.select(between)),) if between.any() else ()
    # by the sheet: the calibration explains part of a flexible body by placement
    by_sheet = np.linalg.inv(inertance.values)
    rigid = rigid_limit(calibrated.model, inertance.frequency, by_sheet)
    if _worst_chi(calibrated, held_out) > ALARM or not rigid.is_rigid:
        marked = raw.select(thinned(between | fitted, MISFIT_LINES))
        calibrated = with_misfit(calibrated, marked, test, PRIOR)
    return Identification(
        test,
        options,
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
        knowledge(parametrisation.names, calibrated.parameter_covariance, PRIOR.deviations),
        modal_table(calibrated.model),
        rigid,
        held_out,
        hoses_in_hammer_test(test.name, inertance, parametrisation.length, hoses)
        if hoses
        else None,
    )


def hammer_test_doubts(test: InertanceTest) -> tuple[str, ...]:
    """Judge a hammer test by its linear start, in a second, and return what is doubtful.

    Nothing is judged of a free body with the decay of a window, nor without enough lines to start.

    - returns: a sentence for each sensor or impact that contradicts all others by more than the
      tolerances allow, and for each number of scales or drawing that the functions deny.
    - raises InputError: what `identify` would refuse: low coherence; contradictions between sheet
      and functions; a body of implausible density, another mass than the scales say, or a drawing
      of another body.
    """
    refuse_contradictions(test)
    if test.frf.added_decay_rate:
        return ()
    try:
        fitted = thinned(in_bands(test.frf.frequency, THESIS_BANDS), LARGEST_LINES)
    except InputError:
        return ()
    _refuse_low_coherence(test, fitted, IdentifyOptions())
    response = virtual_point(sensor_geometry(test.sensors))
    excitation = virtual_point(impact_geometry(test.impacts))
    inertance = virtual_point_frf(test.frf, response=response, excitation=excitation)
    tolerances = tolerances_of_all(test.tolerances)
    culprits = [
        (what, diagnosis)
        for what, diagnosis, least in (
            ("sensor", culprit_of_responses(response, test.frf, tolerances), 0.0),
            ("impact", culprit_of_excitation(excitation, test.frf, tolerances), DOUBTED_IMPACT),
        )
        if diagnosis.named and diagnosis.suspect and diagnosis.suspect.significance > least
    ]
    doubts = [
        f"{what} {diagnosis.verdict}: it contradicts all others by "
        f"{diagnosis.suspect.significance:.0f} times what the tolerances allow; correct the "
        "position sheet or measure it again"
        for what, diagnosis in culprits
        if diagnosis.suspect is not None
    ]
    try:
        parametrisation, start = _start(test, inertance, fitted)
    except InputError as error:
        # what contradicts is the likely reason for a body that cannot be
        raise InputError("\n".join([*error.sentences, *doubts])) from None
    if np.all(test.coherence > 1.0 - 1e-12):
        doubts.append(
            "the coherence is 1 at all lines, as that of a single hit is: no noise is known; "
            "export the coherence of all hits of an impact"
        )
    if not culprits:
        doubts += _other_than_stated(test, parametrisation.model(start))
    return tuple(doubts)


def _other_than_stated(test: InertanceTest, model: CompressorModel) -> Iterator[str]:
    """Give a sentence for each stated number that the linear start denies."""
    if test.weighed_mass is not None:
        gains = math.hypot(test.tolerances.sensor_gain, test.tolerances.hammer_gain)
        allowed = max(SMALLEST_MASS_GAP, math.hypot(3.0 * gains, 3.0 * _scales(test)))
        gap = model.mass / test.weighed_mass - 1.0
        if abs(gap) > allowed:
            yield (
                f"the functions belong to {model.mass:.3g} kg, the scales say "
                f"{test.weighed_mass:.3g} kg, {100 * abs(gap):.0f} % apart, and tolerances allow "
                f"{100 * allowed:.0f} %: was it weighed with a bracket or with oil, or is a "
                "sensitivity wrong?"
            )
    drawing = test.drawing
    if drawing is None:
        return
    found, drawn = (np.linalg.eigvalsh(each) for each in (model.inertia, drawing.inertia))
    ratio = float(np.exp(np.mean(np.log(np.maximum(found, 1e-12) / drawn))))
    if not 1.0 / OTHER_INERTIA < ratio < OTHER_INERTIA:
        yield (
            f"drawing: inertia_kg_m2 is {1.0 / ratio:.2g} times what the functions say: is it "
            "about the centre of gravity, of this body, and in kg m²?"
        )
    if drawing.mounts:
        stated = sum(float(np.sum(mount.stiffness)) for mount in drawing.mounts)
        ratio = float(np.trace(model.stiffness[:3, :3])) / stated
        if not 1.0 / OTHER_STIFFNESS < ratio < OTHER_STIFFNESS:
            yield (
                f"mounts of the drawing: the functions belong to mounts {ratio:.2g} times as stiff "
                "as stiffness_n_per_m: are the lines of the functions in Hz and not in rad/s or "
                "rpm, and are these its mounts?"
            )


def _scales(test: InertanceTest) -> float:
    """Return the relative deviation of the scales [1]."""
    return test.weighed_mass_deviation / test.weighed_mass if test.weighed_mass else 0.0


def calibration_of(identification: Identification, above: float = MASS_LINE) -> SelfCalibration:
    """Choose the calibration of sensors and impacts that can be trusted.

    `above`: first line of the mass line [Hz]. Returns that of the identification; where its model
    of mounts on rigid ground raised its alarm, one from the lines above alone, in which mounts and
    ground hardly take part. InputError: an alarm, and too few lines above.

    A subframe's resonance that the model does not know is otherwise explained by sensors out of
    place, and that error goes into every load.
    """
    if _worst_chi(identification.calibrated, identification.held_out) <= ALARM:
        return identification.calibrated
    lines = identification.raw.frf.frequency >= above
    if np.count_nonzero(lines) < SMALLEST_LINES:
        raise InputError(
            f"{identification.test.name}: mounts on rigid ground do not explain the hammer test, "
            f"and only {np.count_nonzero(lines)} of its lines lie above {above:g} Hz, where they "
            "hardly matter: measure up to 150 Hz"
        )
    free = N_MASS + N_STIFFNESS
    start = identification.point.values
    stiffness = np.maximum(np.abs(start[N_MASS:free]), 1.0) * STIFFNESS_DEVIATION
    prior = Prior(
        np.concatenate([start[:free], START_GAIN]),
        np.concatenate([np.full(N_MASS, np.inf), stiffness, GAIN_DEVIATION]),
    )
    raw = identification.raw.select(thinned(lines, LARGEST_LINES))
    return self_calibrate(
        identification.calibrated.parametrisation, raw, identification.test, start, prior
    )


def _worst_chi(calibrated: SelfCalibration, held_out: Sequence[HoldOut]) -> float:
    """Find the largest reduced χ of fit and predictions [1]."""
    return max([calibrated.reduced_chi, *(check.reduced_chi for check in held_out)])


def _start(
    test: InertanceTest, inertance: Frf, fitted: BoolArray
) -> tuple[MinimalParameters, RealArray]:
    """Linear start with the radius of gyration as characteristic length."""
    length = spread([sensor.position for sensor in test.sensors])
    lines, values = inertance.frequency[fitted], inertance.values[fitted]
    for _ in range(2):
        parametrisation = MinimalParameters(length)
        start = linear_start(parametrisation, lines, values)
        model = parametrisation.model(start)
        length = float(np.sqrt(np.trace(model.inertia) / (3 * model.mass)))
    _refuse_wrong_scale(test, model)
    _refuse_implausible_body(test, model, length)
    refuse_drawing(test)
    return parametrisation, parametrisation.values_of(model)


def _refuse_low_coherence(test: InertanceTest, lines: BoolArray, options: IdentifyOptions) -> None:
    """Refuse hits whose median coherence is too low, and name the worst pair."""
    median = np.median(test.coherence[lines], axis=0)
    middle = float(np.median(median))
    if middle < options.smallest_coherence:
        channel, impact = np.unravel_index(int(np.argmin(median)), median.shape)
        raise InputError(
            f"{test.name}: the median coherence is {middle:.2f}, below "
            f"{options.smallest_coherence:g}; the worst is {test.frf.outputs[int(channel)]} at "
            f"{test.frf.inputs[int(impact)]}: repeat the hits, nothing is identified from these"
        )


def _refuse_implausible_body(test: InertanceTest, model: CompressorModel, length: float) -> None:
    """Refuse a density that no body has: lengths in mm read as m make inertias a million times."""
    density = model.mass / (4 / 3 * math.pi * (length * math.sqrt(5 / 2)) ** 3)
    low, high = PLAUSIBLE_DENSITY
    if not low <= density <= high:
        raise InputError(
            f"{test.name}: {model.mass:.3g} kg with a radius of gyration of {length:.3g} m has a "
            f"density of {density:.2g} kg/m³: check the length unit of the position sheet and the "
            "units of the FRFs"
        )


def _refuse_wrong_scale(test: InertanceTest, model: CompressorModel) -> None:
    """Refuse FRFs whose mass is not that of the scales, such as g read as m/s²."""
    if test.weighed_mass is None:
        return
    ratio = model.mass / test.weighed_mass
    if not 1 / WRONG_SCALE < ratio < WRONG_SCALE:
        raise InputError(
            f"{test.name}: the FRFs belong to {model.mass:.3g} kg, the scales say "
            f"{test.weighed_mass:.3g} kg, {ratio:.3g} times apart: check units and sensitivities "
            "of hammer and accelerometers (g or m/s²)"
        )


def frac(
    measured: npt.ArrayLike,
    identified: npt.ArrayLike,
    frequency: npt.ArrayLike,
    band: tuple[float, float],
) -> RealArray:
    """Compute the frequency response assurance criterion of each entry in a band.

    `measured`, `identified` (n_frequency, 6, 6): inertance or apparent mass, each in its SI units;
    `frequency` (n_frequency,): lines [Hz]; `band`: from, to, both included [Hz]. Returns (6, 6)
    from 0 to 1, which is one curve up to a factor [1].

    It stands where the thesis's figure 55b compares "eigenvectors" in 100-150 Hz, a band that has
    no modes.
    """
    lines = in_bands(frequency, (band,))
    return mac(np.asarray(measured)[lines], np.asarray(identified)[lines])


def modal_likeness(identification: Identification) -> RealArray:
    """Compare measured (rows) and identified (columns) mode shapes at the accelerometers by MAC.

    Returns (6, 6) MAC [1]. At the channels, translations and rotations have one unit. InputError: a
    linear estimate with a negative stiffness.

    The measured modes are those of the linear start from the inertance as the position sheet has
    it; only the gain, whose shape a linear estimate cannot give, is the identified one.
    """
    direct = np.concatenate([identification.start[:-5], identification.point.values[-5:]])
    measured_modes = modal_table(identification.point.parametrisation.model(direct))
    measured = identification.response.forward @ measured_modes.shapes
    identified = identification.response.forward @ identification.modes.shapes
    return mac(measured[:, :, np.newaxis], identified[:, np.newaxis, :])
