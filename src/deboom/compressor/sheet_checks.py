"""What no fit may swallow: reversed and exchanged channels, wrong units, a wrong scale."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from deboom.arrays import RealArray
from deboom.compressor.model import CompressorModel
from deboom.compressor.self_calibration import SelfCalibration
from deboom.errors import InputError
from deboom.measurement.culprit import Diagnosis, culprit_of_excitation, culprit_of_responses
from deboom.measurement.exchanged import Exchange, exchanged_impacts, exchanged_responses
from deboom.measurement.fault_fits import Fault
from deboom.measurement.inertance_test import InertanceTest
from deboom.measurement.placement_tolerances import PlacementTolerances
from deboom.measurement.tolerances import Tolerances
from deboom.measurement.virtual_point import VirtualPoint

SHEET_FAULTS = (Fault.SIGN, Fault.AXES)
"""Faults that no tolerance explains."""
PLAUSIBLE_DENSITY = (50.0, 2e4)
"""Of a body with the found mass and radius of gyration, from foam to lead [kg/m³]."""
DIFFERENT_UNITS = 8.0
"""Ratio of the spread of the sensors to that of the impacts that no hammer test has."""
WRONG_SCALE = 2.0
"""Factor by which no tolerance and no flexible body moves the mass from that of the scales."""
MISPLACED = 5.0
"""Standard deviations of its tolerance beyond which something is not where the sheet has it."""


def sheet_tolerances(stated: PlacementTolerances) -> Tolerances:
    """Tolerances of the sheet as the search for the culprit takes them.

    Parameters
    ----------
    stated : PlacementTolerances
        Of sensors and impacts.

    Returns
    -------
    Tolerances
        The larger of each pair.
    """
    return Tolerances(
        sensor_position=max(stated.sensor_position, stated.impact_position),
        sensor_angle=max(stated.sensor_angle, stated.impact_angle),
        sensor_gain=max(stated.sensor_gain, stated.hammer_gain),
        sensor_cross_axis=0.0,
    )


def refuse_different_units(test: InertanceTest) -> None:
    """Refuse a sheet whose sensors and impacts are not in one unit of length.

    Parameters
    ----------
    test : InertanceTest

    Raises
    ------
    InputError
        One group spreads over many times the size of the other.
    """
    sensors = _spread([sensor.position for sensor in test.sensors])
    impacts = _spread([impact.position for impact in test.impacts])
    if not 1 / DIFFERENT_UNITS < sensors / impacts < DIFFERENT_UNITS:
        raise InputError(
            f"{test.name}: the sensors lie {sensors:.3g} m from their middle and the impacts "
            f"{impacts:.3g} m: one of the two is in another unit of length, look at the headers of "
            "the position sheet"
        )


def refuse_sheet_faults(
    test: InertanceTest, response: VirtualPoint, excitation: VirtualPoint
) -> None:
    """Refuse a reversed or a swapped channel or impact, and name it.

    Parameters
    ----------
    test : InertanceTest
    response, excitation : VirtualPoint
        As the position sheet has them.

    Raises
    ------
    InputError
        A channel or impact of the wrong sign, swapped axes of a sensor, two channels, sensors or
        impacts exchanged.
    """
    tolerances = sheet_tolerances(test.tolerances)
    _refuse_fault(
        test,
        culprit_of_responses(response, test.frf, tolerances),
        exchanged_responses(response, test.frf),
        "sensor",
    )
    _refuse_fault(
        test,
        culprit_of_excitation(excitation, test.frf, tolerances),
        exchanged_impacts(excitation, test.frf),
        "impact",
    )


def refuse_implausible_body(test: InertanceTest, model: CompressorModel, length: float) -> None:
    """Refuse a body that no unit of length or force explains.

    Parameters
    ----------
    test : InertanceTest
    model : CompressorModel
        Of the linear start.
    length : float
        Its radius of gyration [m].

    Raises
    ------
    InputError
        A density outside `PLAUSIBLE_DENSITY`: lengths in mm read as m make inertias a million times
        too large.
    """
    density = model.mass / (4 / 3 * math.pi * (length * math.sqrt(5 / 2)) ** 3)
    low, high = PLAUSIBLE_DENSITY
    if not low <= density <= high:
        raise InputError(
            f"{test.name}: {model.mass:.3g} kg with a radius of gyration of {length:.3g} m has a "
            f"density of {density:.2g} kg/m³: check the length unit of the position sheet and the "
            "units of the FRFs"
        )


def refuse_wrong_scale(test: InertanceTest, model: CompressorModel) -> None:
    """Refuse FRFs whose mass is not that of the scales.

    Parameters
    ----------
    test : InertanceTest
        Nothing is checked where the body was not weighed.
    model : CompressorModel
        Fitted without the weighed mass.

    Raises
    ------
    InputError
        A mass off by a factor that only a wrong unit explains, such as g read as m/s².
    """
    if test.weighed_mass is None:
        return
    ratio = model.mass / test.weighed_mass
    if not 1 / WRONG_SCALE < ratio < WRONG_SCALE:
        raise InputError(
            f"{test.name}: the FRFs belong to {model.mass:.3g} kg, the scales say "
            f"{test.weighed_mass:.3g} kg, {ratio:.3g} times apart: check units and sensitivities "
            "of hammer and accelerometers (g or m/s²)"
        )


def misplaced(found: SelfCalibration, tolerances: PlacementTolerances) -> tuple[str, ...]:
    """Name what came out beyond its tolerance.

    Parameters
    ----------
    found : SelfCalibration
    tolerances : PlacementTolerances
        1 σ.

    Returns
    -------
    tuple of str
        Such as ``A3 position y (-56 σ)``, the worst first.
    """
    scores: RealArray = found.errors / found.placement.deviations(tolerances)
    worst = np.argsort(-np.abs(scores))
    return tuple(
        f"{found.placement.names[n]} ({scores[n]:+.0f} σ)"
        for n in worst
        if abs(scores[n]) > MISPLACED
    )


def _refuse_fault(
    test: InertanceTest, diagnosis: Diagnosis, exchange: Exchange | None, what: str
) -> None:
    """Refuse the better of two explanations: one item at fault, or two exchanged."""
    suspect = diagnosis.suspect
    named = diagnosis.named and suspect is not None and suspect.fault in SHEET_FAULTS
    left = suspect.residual_undone / diagnosis.residual_of_all if named and suspect else np.inf
    if exchange is not None and exchange.left / exchange.disagreement < left:
        raise InputError(
            f"{test.name}: {exchange.verdict}. Mend the position sheet or the cables and start "
            "again"
        )
    if named and suspect is not None:
        raise InputError(
            f"{what} {suspect.name} contradicts all others: {diagnosis.verdict}. Mend the position "
            "sheet and start again"
        )


def _spread(places: Sequence[RealArray]) -> float:
    """Mean distance from the middle [m]."""
    points = np.array(places)
    return float(np.mean(np.linalg.norm(points - points.mean(axis=0), axis=1)))
