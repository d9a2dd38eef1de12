"""The hammer on the body of an electric car as UFF functions, and its part of ``car.toml``."""

from __future__ import annotations

from collections.abc import Sequence

from deboom.arrays import RealOrComplexArray
from deboom.bench.electric_hammer import BodyFrfs
from deboom.bench.electric_places import EAR, EAR_NODE, MICROPHONE, PointSheet
from deboom.bench.parameters import AXES
from deboom.files.uff import UffFunction

FRF, COHERENCE = 4, 6
"""UFF function types."""


def pressure_functions(points: Sequence[PointSheet], frfs: BodyFrfs, car: str) -> list[UffFunction]:
    """Return pressure at the ear per force of every impact, type 4, and its coherence, type 6.

    Parameters
    ----------
    points : sequence of PointSheet
        In the order of the impacts.
    frfs : BodyFrfs
        What the hammer found.
    car : str
        Its name.
    """
    impacts = [row for point in points for row in point.impacts()]
    functions = []
    for column, impact in enumerate(impacts):
        title = f"noise transfer function, {car}, {EAR}, hammer at {impact.impact}"
        reference = (impact.node, impact.uff_direction, impact.impact)
        ear = (EAR_NODE, "scalar", MICROPHONE)
        functions.append(
            _function(frfs, frfs.pressure[:, column], ear, reference, ("pressure", "Pa"), title)
        )
        title = f"coherence of the {title}"
        functions.append(_function(frfs, frfs.coherence[:, column], ear, reference, None, title))
    return functions


def accelerance_functions(
    points: Sequence[PointSheet], frfs: BodyFrfs, car: str
) -> list[UffFunction]:
    """Return acceleration at every sensor on the body per force of every impact, type 4.

    Parameters
    ----------
    points, frfs, car
        As for `pressure_functions`.
    """
    channels = [(row, axis) for point in points for row in point.sensors() for axis in AXES]
    impacts = [row for point in points for row in point.impacts()]
    return [
        _function(
            frfs,
            frfs.acceleration[:, row, column],
            (sensor.node, f"+{axis}", sensor.sensor),
            (impact.node, impact.uff_direction, impact.impact),
            ("acceleration", "m/s^2"),
            f"accelerance, {car}, hammer at {impact.impact}, {sensor.sensor} {axis}",
        )
        for column, impact in enumerate(impacts)
        for row, (sensor, axis) in enumerate(channels)
    ]


def _function(
    frfs: BodyFrfs,
    values: RealOrComplexArray,
    response: tuple[int, str, str],
    reference: tuple[int, str, str],
    quantity: tuple[str, str] | None,
    title: str,
) -> UffFunction:
    # a coherence has no unit, but the quantities of its two channels
    ordinate, unit = quantity or ("general", "1")
    return UffFunction(
        abscissa=frfs.frequency,
        values=values,
        function_type=FRF if quantity else COHERENCE,
        response_node=response[0],
        response_direction=response[1],
        reference_node=reference[0],
        reference_direction=reference[1],
        ordinate=ordinate,
        ordinate_unit=unit,
        denominator="force" if quantity else "none",
        denominator_unit="N" if quantity else "",
        id_lines=(title, "roving hammer, H1"),
        response_name=response[2],
        reference_name=reference[2],
    )
