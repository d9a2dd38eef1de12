"""Noise transfer functions of one vehicle, acquired with a hammer and with a loudspeaker."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.fleet import Body, Cabin
from deboom.bench.frozen import freeze_arrays
from deboom.bench.interfaces import (
    EARS,
    interfaces,
    panel_pressure,
    point_receptance,
    point_shapes,
    source_motion,
)
from deboom.bench.layout import FIRST_EAR_NODE, accelerometer_places
from deboom.bench.powertrain import AXES, VirtualBench, read_data
from deboom.errors import InputError
from deboom.files.hammer_test import HammerChannel, HammerPoint, HammerSheet, write_hammer_test
from deboom.files.tables import parse_unit
from deboom.files.uff import UffFunction
from deboom.files.vehicle import PanelRow
from deboom.physics.rigid_body import forward_matrices, rotation_matrix

FIRST_IMPACT_NODE = 301
FIRST_BODY_SENSOR_NODE = 401
EAR_NODES = {ear: FIRST_EAR_NODE + number for number, ear in enumerate(EARS)}
"""The driver's ear has the node of the first vehicle of a platform; a folder holds one vehicle."""

MICROPHONES = {"driver ear": "MIC2101", "passenger ear": "MIC2102"}
"""Serial numbers: one microphone per ear, the same in all of its functions."""

IMPACT_OFFSETS = ((0.05, 0.02, 0.0), (-0.03, 0.05, 0.02), (-0.02, -0.05, -0.03))
"""Three points around a mount that a hammer reaches, from the virtual point [m]."""

PUSHES = ((1, 1, -1), (-1, 1, -1), (1, -1, 1))
"""To which side each point is hit along x, y and z: the hammer comes from where there is room."""

BODY_SENSOR_OFFSETS = ((0.06, -0.02, 0.01), (-0.04, 0.05, -0.02), (-0.02, -0.06, 0.03))
"""Three triaxial accelerometers on the body around a mount, from the virtual point [m]."""

BODY_SENSOR_ANGLES = ((0.0, 0.0, 0.0), (0.0, 0.0, 90.0), (180.0, 0.0, 0.0))
"""How they are glued on, known: about the fixed axes x, then y, then z [deg]."""


@dataclass(frozen=True, eq=False)
class ImpactPlace:
    """One blow of the hammer.

    Parameters
    ----------
    name : str
        Such as ``I3 y``.
    mount, piece : str
        Around which it lies.
    node : int
        Of the point in the UFF files.
    direction : str
        Of a positive force, such as ``-y``.
    position : array, shape (3,)
        From the powertrain's centre of gravity [m].
    """

    name: str
    mount: str
    piece: str
    node: int
    direction: str
    position: RealArray

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def vector(self) -> RealArray:
        """Unit vector along `direction`."""
        sign = -1.0 if self.direction.startswith("-") else 1.0
        return np.array([sign * (axis == self.direction[1:]) for axis in AXES])


@dataclass(frozen=True, eq=False)
class SensorPlace:
    """One triaxial accelerometer of the vehicle.

    Parameters
    ----------
    name : str
        Such as ``B4`` on the body, ``A2`` on the powertrain or a wheel end.
    mount, piece : str
        At which it sits.
    node : int
        In the UFF files.
    position : array, shape (3,)
        From the powertrain's centre of gravity [m].
    angles : (rx, ry, rz)
        That turn vehicle axes into its own, about the fixed axes x, then y, then z [deg].
    """

    name: str
    mount: str
    piece: str
    node: int
    position: RealArray
    angles: tuple[float, float, float]

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def channels(self) -> tuple[str, ...]:
        """Such as ``B4 x``."""
        return tuple(f"{self.name} {axis}" for axis in AXES)


def impact_places(bench: VirtualBench) -> tuple[ImpactPlace, ...]:
    """Return nine blows per interface: three points, three directions."""
    places = []
    for number, interface in enumerate(interfaces(bench)):
        for k, (offset, pushes) in enumerate(zip(IMPACT_OFFSETS, PUSHES, strict=True)):
            point = len(IMPACT_OFFSETS) * number + k
            for axis, push in zip(AXES, pushes, strict=True):
                places.append(
                    ImpactPlace(
                        name=f"I{point + 1} {axis}",
                        mount=interface.mount,
                        piece=interface.piece,
                        node=FIRST_IMPACT_NODE + point,
                        direction=f"{'+' if push > 0 else '-'}{axis}",
                        position=interface.position + np.array(offset),
                    )
                )
    return tuple(places)


def body_sensor_places(bench: VirtualBench) -> tuple[SensorPlace, ...]:
    """Return three triaxial accelerometers per interface, on the body."""
    glued = list(zip(BODY_SENSOR_OFFSETS, BODY_SENSOR_ANGLES, strict=True))
    where = [
        (interface, offset, angles) for interface in interfaces(bench) for offset, angles in glued
    ]
    return tuple(
        SensorPlace(
            name=f"B{number + 1}",
            mount=interface.mount,
            piece=interface.piece,
            node=FIRST_BODY_SENSOR_NODE + number,
            position=interface.position + np.array(offset),
            angles=angles,
        )
        for number, (interface, offset, angles) in enumerate(where)
    )


def source_sensor_places(bench: VirtualBench) -> tuple[SensorPlace, ...]:
    """Return two accelerometers per mount on the powertrain, one on each wheel end."""
    return tuple(
        SensorPlace(p.sensor, p.mount, p.piece, p.node, p.position, (0.0, 0.0, 0.0))
        for p in accelerometer_places(bench)
    )


def impact_rows(
    bench: VirtualBench, positions: RealArray, directions: RealArray
) -> tuple[RealArray, ...]:
    """Return per interface what the given blows push: rows ``dᵀ V``, shape (9, 6) each."""
    virtual_points = np.array([interface.position for interface in interfaces(bench)])
    levers = positions.reshape(len(virtual_points), -1, 3) - virtual_points[:, None]
    forward = forward_matrices(levers.reshape(-1, 3)).reshape(-1, 3, 6)
    rows = np.einsum("ca,cab->cb", directions, forward)
    return tuple(rows.reshape(len(virtual_points), -1, 6))


def sensor_rows(
    bench: VirtualBench, positions: RealArray, orientations: RealArray
) -> tuple[RealArray, ...]:
    """Return per interface what the given accelerometers see: rows ``Rᵀ V``, shape (9, 6) each."""
    virtual_points = np.array([interface.position for interface in interfaces(bench)])
    levers = positions.reshape(len(virtual_points), -1, 3) - virtual_points[:, None]
    rows = forward_matrices(levers.reshape(-1, 3), orientations)
    return tuple(rows.reshape(len(virtual_points), -1, 6))


def orientations(places: tuple[SensorPlace, ...]) -> RealArray:
    """Return the rotation of each sensor, columns are its axes, shape (n, 3, 3)."""
    return rotation_matrix(np.deg2rad([place.angles for place in places]))


@dataclass(frozen=True)
class AcquisitionErrors:
    """Standard deviations of every error of both methods; judgement, after data sheets.

    Parameters
    ----------
    microphone_db : float
        Calibration of each microphone [dB].
    source_db : float
        Volume acceleration of the loudspeaker, drawn once per ear: it is set up anew [dB].
    hammer_gain, accelerometer_gain : float
        Of the hammer, and of each accelerometer channel [1].
    impact_position, sensor_position : float
        Of a blow, and of an accelerometer, against the position sheet, per axis [m].
    impact_angle, sensor_angle : float
        [rad].
    relative : float
        Noise left after averaging, of the function itself [1].
    pressure_floor : float
        Of pressure per force, real and imaginary part [Pa/N].
    acceleration_floor : float
        Of acceleration per volume acceleration, real and imaginary part [1/m²].
    accelerance_floor : float
        Of acceleration per force, real and imaginary part [m/s² per N].
    """

    microphone_db: float = 0.2
    source_db: float = 0.5
    hammer_gain: float = 0.01
    accelerometer_gain: float = 0.01
    impact_position: float = 0.003
    sensor_position: float = 0.002
    impact_angle: float = float(np.deg2rad(2.0))
    sensor_angle: float = float(np.deg2rad(1.0))
    relative: float = 0.01
    pressure_floor: float = 2e-5
    acceleration_floor: float = 2e-5
    accelerance_floor: float = 1e-4


NO_ACQUISITION_ERRORS = AcquisitionErrors(*[0.0] * 12)
"""Everything exact, for verification."""


@dataclass(frozen=True, eq=False)
class Setup:
    """How the vehicle is truly instrumented, and how its hammer and loudspeaker err.

    Parameters
    ----------
    impact_rows : tuple of array, shape (n_impact, 6)
        Per interface: what each blow truly pushes.
    sensor_rows : tuple of array, shape (n_channel, 6)
        Per interface: what each channel truly sees, gain included.
    microphone : array, shape (n_ear,)
        Gain [1].
    source : array, shape (n_ear,)
        True volume acceleration per stated one [1].
    hammer : float
        Gain [1].
    """

    impact_rows: tuple[RealArray, ...]
    sensor_rows: tuple[RealArray, ...]
    microphone: RealArray
    source: RealArray
    hammer: float

    def __post_init__(self) -> None:
        freeze_arrays(self)


def draw_setup(
    bench: VirtualBench, errors: AcquisitionErrors, generator: np.random.Generator
) -> Setup:
    """Instrument a vehicle: nominal places, with the errors of those who put the sensors there."""
    impacts, sensors = impact_places(bench), body_sensor_places(bench)
    nominal = orientations(sensors)
    blows = np.array([place.position for place in impacts])
    blows = blows + generator.normal(0, errors.impact_position, blows.shape)
    tilt = rotation_matrix(generator.normal(0, errors.impact_angle, blows.shape))
    pushes = np.einsum("cab,cb->ca", tilt, np.array([place.vector for place in impacts]))
    seats = np.array([place.position for place in sensors])
    seats = seats + generator.normal(0, errors.sensor_position, seats.shape)
    turn = rotation_matrix(generator.normal(0, errors.sensor_angle, seats.shape))
    gains = 1 + generator.normal(0, errors.accelerometer_gain, (len(sensors), 3))
    seen = sensor_rows(bench, seats, turn @ nominal)
    by_interface = gains.reshape(len(seen), -1)
    return Setup(
        impact_rows=impact_rows(bench, blows, pushes),
        sensor_rows=tuple(
            gain[:, None] * rows for gain, rows in zip(by_interface, seen, strict=True)
        ),
        microphone=10 ** (generator.normal(0, errors.microphone_db, len(EARS)) / 20),
        source=10 ** (generator.normal(0, errors.source_db, len(EARS)) / 20),
        hammer=1 + float(generator.normal(0, errors.hammer_gain)),
    )


def struck_pressure(setup: Setup, body: Body, cabin: Cabin, frequency: RealArray) -> ComplexArray:
    """Return the pressure at the ears per force of every blow, as stated, without noise.

    Returns
    -------
    array, shape (f, n_ear, n_impact)
        With the gains of microphones and hammer [Pa/N].
    """
    pushed = np.hstack([point_shapes(body, rows, k) for k, rows in enumerate(setup.impact_rows)])
    per_mode = panel_pressure(cabin, frequency) @ body.shapes_at_panels.T
    pressure = (per_mode * body.modal_receptance(frequency)[:, None, :]) @ pushed
    return np.asarray(setup.microphone[:, None] * pressure / setup.hammer)


def strike(
    setup: Setup,
    body: Body,
    cabin: Cabin,
    frequency: RealArray,
    errors: AcquisitionErrors,
    generator: np.random.Generator,
) -> tuple[ComplexArray, ComplexArray]:
    """Acquire with the hammer: pressure at the ears, acceleration on the body.

    Parameters
    ----------
    setup : Setup
        Of this vehicle.
    body, cabin
        The trimmed body without its powertrain, and its air.
    frequency : array, shape (f,)
        [Hz].
    errors : AcquisitionErrors
        The noise in them; the rest is in the setup.
    generator : Generator
        Draws the noise.

    Returns
    -------
    pressure : array, shape (f, n_ear, n_impact)
        [Pa/N].
    acceleration : array, shape (f, n_channel, n_impact)
        In sensor axes [m/s² per N].
    """
    receptance = point_receptance(body, frequency, setup.sensor_rows, setup.impact_rows)
    acceleration = -((2 * np.pi * frequency) ** 2)[:, None, None] * receptance
    return (
        _noisy(
            struck_pressure(setup, body, cabin, frequency),
            errors.relative,
            errors.pressure_floor,
            generator,
        ),
        _noisy(acceleration / setup.hammer, errors.relative, errors.accelerance_floor, generator),
    )


def breathe(
    setup: Setup,
    body: Body,
    cabin: Cabin,
    frequency: RealArray,
    errors: AcquisitionErrors,
    generator: np.random.Generator,
) -> ComplexArray:
    """Acquire with the loudspeaker at each ear in turn: acceleration per volume acceleration.

    Returns
    -------
    array, shape (f, n_channel, n_ear)
        In sensor axes [m/s² per m³/s²].

    Notes
    -----
    Acceleration per volume acceleration equals displacement per volume displacement.
    """
    motion = source_motion(body, cabin, frequency)
    seen = np.concatenate(
        [np.einsum("ca,fae->fce", rows, motion[:, k]) for k, rows in enumerate(setup.sensor_rows)],
        axis=1,
    )
    return _noisy(setup.source * seen, errors.relative, errors.acceleration_floor, generator)


def _noisy(
    exact: ComplexArray, relative: float, floor: float, generator: np.random.Generator
) -> ComplexArray:
    shape = (2, *exact.shape)
    own, flat = ((g[0] + 1j * g[1]) for g in (generator.normal(size=shape) for _ in range(2)))
    return np.asarray(exact * (1 + relative * own / np.sqrt(2)) + floor * flat)


FIRST_PANEL_NODE = 601
FRF = 4

_PLACES = {
    "trunk floor": ((3.3, 0.0, -0.05), (0.0, 0.0, 1.0)),
    "rear bench": ((2.7, 0.0, 0.15), (-0.8, 0.0, 0.6)),
    "front floor": ((1.4, 0.0, -0.2), (0.0, 0.0, 1.0)),
    "front doors": ((1.5, -0.75, 0.25), (0.0, 1.0, 0.0)),
    "rear doors": ((2.4, -0.75, 0.25), (0.0, 1.0, 0.0)),
    "tailgate": ((3.7, 0.0, 0.45), (-1.0, 0.0, 0.0)),
    "roof": ((2.2, 0.0, 0.95), (0.0, 0.0, -1.0)),
    "windshield": ((0.9, 0.0, 0.7), (0.8, 0.0, -0.6)),
}
"""Accelerometer and inward normal of each panel [m], [1]; of doors, those of the left one."""


def panel_table(cabin: Cabin) -> list[PanelRow]:
    """Return the position sheet of the panels."""
    names = read_data("body_prior.json")["panels"]
    return [
        PanelRow(name, FIRST_PANEL_NODE + number, *_PLACES[name], area=float(area))
        for number, (name, area) in enumerate(zip(names, cabin.panel_areas, strict=True))
    ]


def panel_motion(body: Body, cabin: Cabin, frequency: RealArray) -> ComplexArray:
    """Find how the panels move when a loudspeaker breathes at an ear.

    Returns
    -------
    array, shape (f, n_panel, n_ear)
        Displacement inwards per volume displacement [1/m²].
    """
    # the raised pressure pushes every panel outwards, against its shape
    modal_force = -panel_pressure(cabin, frequency) @ body.shapes_at_panels.T
    modal = modal_force * body.modal_receptance(frequency)[:, None, :]
    return np.swapaxes(modal @ body.shapes_at_panels, 1, 2)


def pressure_at_panels(cabin: Cabin, frequency: RealArray) -> ComplexArray:
    """Find the pressure at still panels when a loudspeaker breathes at an ear.

    Returns
    -------
    array, shape (f, n_panel, n_ear)
        Per volume acceleration [Pa/(m³/s²)].

    Notes
    -----
    A cabin answers alike with source and receiver exchanged: what a panel raises at the ear per
    volume displacement, the ear raises at the panel.
    """
    per_volume = panel_pressure(cabin, frequency) / cabin.panel_areas
    per_acceleration = per_volume / -((2 * np.pi * frequency) ** 2)[:, None, None]
    return np.swapaxes(per_acceleration, 1, 2)


def listen_at_panels(
    setup: Setup,
    body: Body,
    cabin: Cabin,
    frequency: RealArray,
    errors: AcquisitionErrors,
    generator: np.random.Generator,
) -> tuple[ComplexArray, ComplexArray]:
    """Acquire motion of and pressure at the panels, with the loudspeaker at each ear in turn.

    Returns
    -------
    motion : array, shape (f, n_panel, n_ear)
        Acceleration inwards per volume acceleration [(m/s²)/(m³/s²)].
    pressure : array, shape (f, n_panel, n_ear)
        [Pa/(m³/s²)].
    """
    n_panel = cabin.panel_areas.size
    gains = 1 + generator.normal(0, errors.accelerometer_gain, n_panel)
    microphones = 10 ** (generator.normal(0, errors.microphone_db, n_panel) / 20)
    motion = gains[:, None] * setup.source * panel_motion(body, cabin, frequency)
    pressure = microphones[:, None] * setup.source * pressure_at_panels(cabin, frequency)
    return (
        _noisy_3(motion, errors.relative, generator),
        _noisy_3(pressure, errors.relative, generator),
    )


def _noisy_3(exact: ComplexArray, relative: float, generator: np.random.Generator) -> ComplexArray:
    noise = generator.normal(0, 1 / np.sqrt(2), (2, *exact.shape))
    return np.asarray(exact * (1 + relative * (noise[0] + 1j * noise[1])))


def panel_functions(
    panels: list[PanelRow],
    values: ComplexArray,
    frequency: RealArray,
    quantity: tuple[str, str],
    vehicle: str,
) -> list[UffFunction]:
    """Return functions of the panels per volume acceleration at the ears, UFF type 4.

    Parameters
    ----------
    panels : list of PanelRow
    values : array, shape (f, n_panel, n_ear)
        [SI].
    frequency : array, shape (f,)
        [Hz].
    quantity : (str, str)
        Word of the UFF ordinate and its SI unit.
    vehicle : str
        For the title.
    """
    return [
        UffFunction(
            abscissa=frequency,
            values=values[:, row, column],
            function_type=FRF,
            response_node=panel.node,
            response_direction="scalar",
            reference_node=EAR_NODES[ear],
            reference_direction="scalar",
            ordinate=quantity[0],
            ordinate_unit=quantity[1],
            denominator="general",
            denominator_unit="m^3/s^2",
            id_lines=(f"{vehicle}, loudspeaker at {ear}, {quantity[0]}, {panel.panel}",),
            response_name=f"P{row + 1}",
            reference_name="LOUDSP 1",
        )
        for row, panel in enumerate(panels)
        for column, ear in enumerate(EARS)
    ]


@dataclass(frozen=True)
class BlowPlan:
    """How the hammer strikes and how it is recorded.

    Parameters
    ----------
    hits : int
        Per blow of the position sheet.
    rate : float
        [Hz].
    duration : float
        Of a block [s]; its inverse is the spacing of the lines.
    pretrigger : float
        [s].
    contact : float
        Of the tip [s]; a half sine.
    lightest, hardest : float
        Peak force, even between them [N].
    force_noise, pressure_noise : float
        Standard deviation per sample [N], [Pa].
    """

    hits: int = 5
    rate: float = 512.0
    duration: float = 4.0
    pretrigger: float = 0.25
    contact: float = 8e-3
    lightest: float = 150.0
    hardest: float = 400.0
    force_noise: float = 0.05
    pressure_noise: float = 2e-3


def blows(
    setup: Setup,
    body: Body,
    cabin: Cabin,
    columns: list[int],
    plan: BlowPlan,
    generator: np.random.Generator,
) -> tuple[RealArray, RealArray]:
    """Record force and pressure at the ears of some blows.

    Parameters
    ----------
    setup : Setup
        Of the vehicle, with its true places and gains.
    body, cabin
        Of the vehicle.
    columns : list of int
        Places of the blows in `impact_places`.
    plan : BlowPlan
        How.
    generator : Generator
        Draws the hits and the noise.

    Returns
    -------
    force : array, shape (n_blow, n_hit, n_sample)
        As the hammer's cell states it [N].
    pressure : array, shape (n_blow, n_hit, n_sample, n_ear)
        As the microphones state it [Pa].

    Notes
    -----
    The answer is the inverse Fourier transform of function times spectrum of the push: exact for
    the sampled push, since a block of some seconds outlasts every mode.
    """
    n_sample = round(plan.rate * plan.duration)
    time = np.arange(n_sample) / plan.rate
    shape = (len(columns), plan.hits)
    begin = plan.pretrigger + generator.uniform(0, 1 / plan.rate, shape)
    peak = generator.uniform(plan.lightest, plan.hardest, shape)
    since = (time - begin[..., None]) / plan.contact
    push = peak[..., None] * np.sin(np.pi * since) * ((since >= 0) & (since <= 1))
    frequency = np.asarray(np.fft.rfftfreq(n_sample, 1 / plan.rate), dtype=np.float64)
    function = struck_pressure(setup, body, cabin, frequency)[:, :, columns]
    spectrum = np.fft.rfft(push)
    answer = np.fft.irfft(np.einsum("fec,chf->chfe", function, spectrum), n_sample, axis=2)
    answer = answer * setup.hammer  # the function is per stated force, the push is the true one
    force = setup.hammer * push + generator.normal(0, plan.force_noise, push.shape)
    return force, answer + generator.normal(0, plan.pressure_noise, answer.shape)


def write_blows(
    folder: Path,
    bench: VirtualBench,
    setup: Setup,
    body: Body,
    cabin: Cabin,
    point: str,
    generator: np.random.Generator,
    plan: BlowPlan | None = None,
) -> None:
    """Write the blows around one mount as a hammer test.

    Parameters
    ----------
    folder : Path
        Of the hammer test; made if it is not there.
    bench, setup, body, cabin
        The vehicle.
    point : str
        Mount, or mount and piece, such as ``TSM`` or ``Du left``.
    generator : Generator
        Draws the hits and the noise.
    plan : BlowPlan, optional
        How it is struck.

    Raises
    ------
    InputError
        No such point.
    """
    plan = plan or BlowPlan()
    places = impact_places(bench)
    around = [_point(place) for place in places]
    if point not in around:
        known = ", ".join(dict.fromkeys(around))
        raise InputError(f"no mount or piece '{point}' to strike: use {known}")
    columns = [number for number, name in enumerate(around) if name == point]
    force, pressure = blows(setup, body, cabin, columns, plan, generator)
    struck = [places[column] for column in columns]
    sheet = HammerSheet(
        title=f"hammer around {point}, pressure at the ears",
        rate=plan.rate,
        pretrigger=plan.pretrigger,
        points=tuple(
            HammerPoint(
                impact=place.name,
                node=place.node,
                file=f"hits/{place.name.replace(' ', '')}.uff",
                position=_three(place.position),
                direction=_three(place.vector),
            )
            for place in struck
        ),
        channels=tuple(
            HammerChannel(ear, "pressure", EAR_NODES[ear], "scalar", parse_unit("Pa"))
            for ear in EARS
        ),
    )
    hits = {place.name: (force[k], pressure[k]) for k, place in enumerate(struck)}
    write_hammer_test(folder, sheet, hits)


def _point(place: ImpactPlace) -> str:
    return f"{place.mount} {place.piece}".strip()


def _three(vector: RealArray) -> tuple[float, float, float]:
    x, y, z = np.round(vector, 4).tolist()
    return x, y, z
