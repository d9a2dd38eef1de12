"""Electric cars: what compressor and hoses do to a body, and sensors, hammer and sweeps on it.

A body is held at the places of one compressor: three mounts and two hose ends, six motions each,
along the axes of the compressor. It is struck and measured around every one of them; the places
around a point are those around a mount of the bench's other vehicles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from deboom.arrays import DOFS, ComplexArray, RealArray
from deboom.bench import compressor_rig as rig
from deboom.bench.compressor_truth import COMPRESSOR_DATA, Compressor, Hose
from deboom.bench.families import BodyKind, log_uniform
from deboom.bench.fleet import Body, Cabin, noise_transfer, read_cabin, receptance
from deboom.bench.powertrain import read_data
from deboom.bench.signals import complex_normal
from deboom.bench.vehicle_acquisition import (
    BODY_SENSOR_ANGLES,
    BODY_SENSOR_OFFSETS,
    IMPACT_OFFSETS,
    PUSHES,
)
from deboom.bench.writing import check_seed, triple
from deboom.files.rows import PlacedImpact, PlacedSensor
from deboom.physics.rigid_body import forward_matrices, rotation_matrix

MOUNTS = ("mount 1", "mount 2", "mount 3")
HOSES = ("hose 1", "hose 2")
POINTS = (*MOUNTS, *HOSES)
"""Where the compressor and its hoses meet a body."""

ELECTRIC_FLEET = "electric_fleet.json"

PATCH_RADIUS = 0.05
"""Of the piece of sheet metal that turns under a local moment [m]; judgement. With the stiffness k
of the translations the local rotations have k r²; no mount and no hose is a thousandth as stiff."""

LEVEL = 2.1e-3
"""Median translational noise transfer function of the first car's mounts [Pa/N], as measured."""

LEVEL_LINES = np.arange(30.0, 140.01, 0.5)
"""Lines of that median [Hz]."""

NOMINAL_FREQUENCIES = np.array(
    [24, 31, 38, 44, 52, 60, 67, 75, 83, 90, 98, 106, 113, 121, 129, 137, 146, 155, 164], float
)
"""Of the prior's body modes [Hz]."""

NOMINAL_DAMPING = 0.03
HIGHEST = 165.0
"""Frequency up to which the bodies of a family have modes [Hz]."""

PANEL_SHAPE = 0.04
"""Spread of the modes at the panels [kg^-1/2]."""

ROTATION_LENGTH = 0.35
"""A mode that moves the compressor's carrier by 1 turns it by 1 over this length [m]."""

MOUNT_SCATTER = 0.15
"""Part of a shape that each mount has for itself; the rest is a rigid carrier's [1]."""

HOSE_SHARE, HOSE_SCATTER = 0.6, 0.8
"""Of the carrier's motion, and of an own one, at a hose end [1]."""

FREQUENCY_SPREAD, DAMPING_SPREAD, SHAPE_SPREAD = 0.02, 0.2, 0.2
"""Log-normal, from car to car [1]."""


@dataclass(frozen=True, eq=False)
class ElectricCarBody:
    """One electric car without its compressor.

    - `name`: name, such as ``EV-1``.
    - `body`: body whose paths are the six motions of every one of `POINTS`: shapes of rotations in
      kg^-1/2/m, their local stiffness in N m/rad.
    - `cabin`: air in the cabin.
    """

    name: str
    body: Body
    cabin: Cabin

    def noise_transfer(self, frequency: RealArray) -> ComplexArray:
        """Find the pressure at the ear per load at every point, (f, 30) [Pa/N, Pa/(N m)]."""
        return noise_transfer(self.body, self.cabin, frequency)

    def receptance(self, frequency: RealArray) -> ComplexArray:
        """Find the motion of all points per load at all points, (f, 30, 30) [m/N, 1/N, 1/(N m)]."""
        return receptance(self.body, frequency)


def columns_of(points: tuple[str, ...], n_motion: int = len(DOFS)) -> list[int]:
    """Return the places of some points' first motions among all motions of `POINTS`."""
    return [
        len(DOFS) * POINTS.index(point) + motion for point in points for motion in range(n_motion)
    ]


def frozen_fleet() -> dict[str, ElectricCarBody]:
    """Return the five cars of ``data/electric_fleet.json``, an unselected draw of the prior."""
    data = read_data(ELECTRIC_FLEET)
    cabin, stiffness = read_cabin(data), _local_stiffness(data["local_stiffness_N_per_m"])
    cars = {}
    for name, modes in data["vehicles"].items():
        arrays = {key: np.array(values) for key, values in modes.items()}
        cars[name] = ElectricCarBody(name, Body(**arrays, local_stiffness=stiffness), cabin)
    return cars


def draw_fleet(seed: int, kind: BodyKind | None = None) -> dict[str, ElectricCarBody]:
    """Draw a fleet of as many cars from the prior of the frozen one, and select nothing.

    - `seed`: seed, from 1. The frozen fleet is the draw of 20261121, rounded to nine digits.
    - `kind`: distribution of bodies of a family; by default the prior. The same density of modes up
      to `HIGHEST`, damping, stiffness of attachments and size of the shapes at the mounts.
    - raises InputError: seed below 1.

    One platform: the first car has the base's shapes, the others theirs with a log-normal factor
    per entry. The mounts stand on a carrier that moves almost as a rigid body; the ends of the
    hoses follow it in part. One factor on all shapes, at the points or, of a family, at the panels,
    gives the first car the median `LEVEL`.
    """
    check_seed(seed)
    data, generator = read_data(ELECTRIC_FLEET), np.random.default_rng(seed)
    cabin, nominal = read_cabin(data), NOMINAL_FREQUENCIES
    mean_damping = np.full(nominal.size, NOMINAL_DAMPING)
    local, size = _local_stiffness(data["local_stiffness_N_per_m"]), None
    if kind is not None:
        low, high = kind.frequency
        density = float(generator.uniform(*kind.modes)) / (high - low)
        n_drawn = round(density * (HIGHEST - low))
        nominal = np.sort(generator.uniform(low, HIGHEST, n_drawn))
        mean_damping = log_uniform(generator, kind.damping, n_drawn)
        local = _local_stiffness(float(log_uniform(generator, kind.stiffness)))
        size = float(log_uniform(generator, kind.shape))
    n_mode = nominal.size
    at_points = _draw_shapes(n_mode, generator)
    at_panels = PANEL_SHAPE * generator.normal(0, 1, (n_mode, cabin.panel_areas.size))

    def spread(shapes: RealArray) -> RealArray:
        return np.asarray(shapes * np.exp(generator.normal(0, SHAPE_SPREAD, shapes.shape)))

    cars: dict[str, ElectricCarBody] = {}
    scale = 1.0
    for name in data["vehicles"]:
        frequencies = nominal * np.exp(generator.normal(0, FREQUENCY_SPREAD, n_mode))
        damping = mean_damping * np.exp(generator.normal(0, DAMPING_SPREAD, n_mode))
        own_points = spread(at_points) if cars else at_points
        own_panels = spread(at_panels) if cars else at_panels
        body = Body(frequencies, damping, own_points, own_panels, local)
        if not cars:
            at_mounts = noise_transfer(body, cabin, LEVEL_LINES)[:, columns_of(MOUNTS, 3)]
            scale = LEVEL / float(np.median(np.abs(at_mounts)))
            if size is not None:
                of_mounts = size / float(own_points[:, columns_of(MOUNTS, 3)].std())
                scale, at_panels = of_mounts, scale / of_mounts * at_panels
                own_panels = at_panels
        body = replace(body, shapes_at_paths=scale * own_points, shapes_at_panels=own_panels)
        cars[name] = ElectricCarBody(name, body, cabin)
    return cars


def point_positions() -> dict[str, RealArray]:
    """Return where the compressor of the prior meets a body, from its virtual point [m].

    Mounts of the thesis's table 11, and the far ends of two straight hoses.
    """
    data = read_data(COMPRESSOR_DATA)
    mounts = [np.array(position) for position in data["truth"]["mount_position_m"]]
    ends = []
    for hose in data["hoses"]:
        direction = np.array(hose["direction"])
        reach = hose["length_m"] * direction / np.linalg.norm(direction)
        ends.append(np.array(hose["port_position_m"]) + reach)
    return dict(zip(POINTS, [*mounts, *ends], strict=True))


def _local_stiffness(translation: float) -> RealArray:
    """Return the local stiffness of all motions at all points, shape (30,)."""
    return np.tile(np.repeat([translation, translation * PATCH_RADIUS**2], 3), len(POINTS))


def _draw_shapes(n_mode: int, generator: np.random.Generator) -> RealArray:
    """Draw the modes at all points, shape (n_mode, 30)."""

    def normal(deviation: float = 1.0) -> RealArray:
        return generator.normal(0, 1, (n_mode, 3)) * deviation

    shift = generator.normal(0, 1, (n_mode, 3))
    turn = generator.normal(0, 1 / ROTATION_LENGTH, (n_mode, 3))
    blocks = []
    of_carrier = (1.0, MOUNT_SCATTER)
    of_hose = (HOSE_SHARE, HOSE_SCATTER)
    for point, position in point_positions().items():
        share, scatter = of_carrier if point in MOUNTS else of_hose
        blocks.append(share * (shift + np.cross(turn, position)) + normal(scatter))
        blocks.append(share * turn + normal(scatter / ROTATION_LENGTH))
    return np.concatenate(blocks, axis=1)


@dataclass(frozen=True, eq=False)
class CarRun:
    """Everything that happens in the car while the compressor runs, complex peak amplitudes.

    - `frequency` (f,): frequency of the rotation [Hz].
    - `load`, `displacement` (f, 6): load of the source on the compressor, and its displacement, at
      its virtual point [N, N m], [m, rad].
    - `body_motion`, `body_load` (f, 30): motion of the body at every point, six motions each, and
      load on it [m, rad], [N, N m].
    - `pressure` (f,): pressure at the driver's ear [Pa].
    """

    frequency: RealArray
    load: ComplexArray
    displacement: ComplexArray
    body_motion: ComplexArray
    body_load: ComplexArray
    pressure: ComplexArray


def run_car(
    car: ElectricCarBody,
    compressor: Compressor,
    source: rig.Source,
    frequency: RealArray,
    hoses: Sequence[Hose] = (),
    gas_factor: float = 1.0,
) -> CarRun:
    """Run the compressor in the car.

    - `car`: trimmed body without the compressor.
    - `compressor`: rigid compressor on three mounts that do not soften, without a receiver of its
      own; its own hoses are left alone.
    - `source`: loads from inside, gyroscopic moment of the rotor included.
    - `frequency` (f,): frequency of the rotation, above 0 [Hz].
    - `hoses`: hoses to both hose ends of the body; none where long soft hoses cut these paths.
    - `gas_factor`: factor on the gas forces [1].

    Primal coupling without any truncation besides the body's own modes. Mounts and hoses are an
    element with the stiffness Z between compressor (c) and body (b); the body answers its loads
    with ``y = -Y (Z_bc x + Z_bb y)``, hence ``y = -(I + Y Z_bb)⁻¹ Y Z_bc x`` and
    ``(D + Z_cc) x + Z_cb y = F``.
    """
    n_at_mounts = len(columns_of(MOUNTS, 3))
    columns = columns_of(MOUNTS, 3) + (columns_of(HOSES) if hoses else [])
    size = 6 + len(columns)
    stretch = np.zeros((n_at_mounts, size))
    stretch[:, :6] = forward_matrices(compressor.positions)
    stretch[:, 6 : 6 + n_at_mounts] = -np.eye(n_at_mounts)
    by_mounts, by_hoses = np.zeros((2, np.size(frequency), size, size), dtype=complex)
    stiffness = mount_stiffnesses(compressor, frequency)
    for number, rows in enumerate(stretch.reshape(-1, 3, size)):
        by_mounts += rows.T @ stiffness[:, number] @ rows
    for number, hose in enumerate(hoses):
        first = 6 + n_at_mounts + 6 * number
        ends = np.r_[0:6, first : first + 6]
        by_hoses[:, ends[:, None], ends] += hose.stiffness(frequency)
    joint = by_mounts + by_hoses
    squared = ((2 * np.pi * frequency) ** 2)[:, None, None]
    free = source.gyroscopic(frequency) - squared * compressor.mass_matrix
    load = source.load(frequency, gas_factor)

    # what is touched moves the rest as well
    everywhere = car.receptance(frequency)[:, :, columns]
    touched_only = everywhere[:, columns]
    across, receiver = joint[:, 6:, :6], joint[:, 6:, 6:]
    follows = -np.linalg.solve(
        np.eye(len(columns)) + touched_only @ receiver, touched_only @ across
    )
    whole = free + joint[:, :6, :6] + joint[:, :6, 6:] @ follows
    displacement = np.linalg.solve(whole, load[:, :, None])
    touched = -(across @ displacement + receiver @ (follows @ displacement))
    on_body = np.zeros((np.size(frequency), everywhere.shape[1]), dtype=complex)
    on_body[:, columns] = touched[:, :, 0]
    transfer = car.noise_transfer(frequency)[:, columns]
    return CarRun(
        frequency=np.asarray(frequency, dtype=float),
        load=load,
        displacement=np.asarray(displacement[:, :, 0], dtype=np.complex128),
        body_motion=(everywhere @ touched)[:, :, 0],
        body_load=on_body,
        pressure=np.einsum("fj,fj->f", transfer, touched[:, :, 0]),
    )


def design_pressure(
    car: ElectricCarBody,
    compressor: Compressor,
    source: rig.Source,
    frequency: RealArray,
    stiffness: RealArray,
    hoses: Sequence[Hose] = (),
    gas_factor: float = 1.0,
) -> ComplexArray:
    """Return the pressure at the driver's ear for other mounts under the same compressor.

    - `car`, `compressor`, `source`, `frequency`, `hoses`, `gas_factor`: arguments as in `run_car`.
    - `stiffness` (n, n_mount, 3): static stiffness of each mount of each design, axial and two
      radial [N/m].
    - returns (n, f): [Pa].
    """
    designs = (replace(compressor, stiffness=design) for design in stiffness)
    return np.array(
        [run_car(car, design, source, frequency, hoses, gas_factor).pressure for design in designs]
    )


def mount_stiffnesses(compressor: Compressor, frequency: RealArray) -> ComplexArray:
    """Dynamic stiffness of each mount in fixed axes, shape (f, n_mount, 3, 3) [N/m]."""
    turn = rotation_matrix(compressor.rotations)
    static = (turn * compressor.stiffness[:, None, :]) @ np.swapaxes(turn, 1, 2)
    return np.asarray(compressor.gain_at(frequency)[:, None, None, None] * static)


FIRST_SENSOR_NODE, FIRST_IMPACT_NODE, FIRST_HOLDER_NODE = 401, 501, 301
EAR, EAR_NODE, MICROPHONE = "driver ear", 901, "MIC2101"

SHEET_DIGITS = 4
"""Of the positions on the sheet [m]."""

BODY_IMPULSE, BODY_PULSE, BODY_BAND = 1.0, 0.005, (15.0, 150.0)
"""A usual hit on a body [N s], the half sine of a soft tip on sheet metal [s], the lines [Hz]."""

CABIN_NOISE = 1e-4
"""Amplitude spectral density of the background noise in a closed car in a quiet room [Pa/√Hz]."""

MICROPHONE_DB = 0.2
"""Deviation of a microphone's calibration [dB]."""

SOUND_FLOOR = 3e-5
"""Deviation of the real and of the imaginary part of a tracked pressure [Pa]: ten seconds per line
in a closed car in a quiet room."""


def point_sheets(compressor: Compressor) -> tuple[rig.Sheet, ...]:
    """Plan sensors and impacts around every one of `POINTS`, where a compressor's load enters.

    Impacts of one place share a node.
    """
    places = [*compressor.positions, *(hose.end for hose in compressor.hoses)]
    return tuple(
        sheet_around(f"{name[0].upper()}{name[-1]}", 3 * number, point)
        for number, (name, point) in enumerate(zip(POINTS, places, strict=True))
    )


def sheet_around(
    short: str,
    node: int,
    point: RealArray,
    angles: Sequence[tuple[float, float, float]] = BODY_SENSOR_ANGLES,
) -> rig.Sheet:
    """Plan three accelerometers and nine impacts around a point, with names that begin alike.

    - `node`: added to `FIRST_SENSOR_NODE` and `FIRST_IMPACT_NODE`, which these and the next two
      numbers take.
    - `point` (3,): [m]; `angles`: of each accelerometer [deg].
    """
    glued = zip(BODY_SENSOR_OFFSETS, np.deg2rad(angles), strict=True)
    sensors = [
        PlacedSensor(
            f"{short} S{k + 1}",
            FIRST_SENSOR_NODE + node + k,
            triple(point + offset, SHEET_DIGITS),
            triple(turn),
        )
        for k, (offset, turn) in enumerate(glued)
    ]
    impacts = [
        PlacedImpact(
            f"{short} I{k + 1}{axis}",
            FIRST_IMPACT_NODE + node + k,
            triple(point + offset, SHEET_DIGITS),
            triple(push),
        )
        for k, (offset, signs) in enumerate(zip(IMPACT_OFFSETS, PUSHES, strict=True))
        for axis, push in zip("xyz", np.diag(signs).astype(float), strict=True)
    ]
    return rig.Sheet(tuple(sensors), tuple(impacts), point)


def draw_setup(
    sheets: Sequence[rig.Sheet], errors: rig.PlacementErrors, generator: np.random.Generator
) -> tuple[rig.Placed, ...]:
    """Instrument the body with the errors of a laboratory, one hammer for all points."""
    placed = [rig.place(sheet, errors, generator) for sheet in sheets]
    return tuple(replace(point, hammer_gain=placed[0].hammer_gain) for point in placed)


@dataclass(frozen=True, eq=False)
class BodyFrfs:
    """FRFs over the hits of every impact on the body.

    - `frequency` (f,) [Hz].
    - `pressure`, `coherence` (f, m): pressure at the driver's ear per stated force of every impact,
      and its ordinary coherence [Pa/N], [1].
    - `acceleration` (f, n_channel, m): acceleration at the channels of all sensors on the body
      [m/s² per N].
    """

    frequency: RealArray
    pressure: ComplexArray
    coherence: RealArray
    acceleration: ComplexArray


def body_plan(*, noise_free: bool = False) -> rig.HitPlan:
    """Return how a body is struck: the compressor's sensors and hits, a larger and softer hammer.

    Without noise, every hit is where it should be, and channels and cabin are silent.
    """
    plan = replace(rig.hit_plan(), impulse=BODY_IMPULSE, pulse=BODY_PULSE, band=BODY_BAND)
    return rig.without_noise(plan) if noise_free else plan


def strike_body(
    car: ElectricCarBody,
    setup: Sequence[rig.Placed],
    plan: rig.HitPlan,
    cabin_noise: float,
    microphone: float,
    generator: np.random.Generator,
) -> BodyFrfs:
    """Strike the body around every point; the compressor and its hoses are taken out.

    The noise in the cabin is an amplitude spectral density [Pa/√Hz], the microphone's gain the
    stated over the true pressure [1].
    """
    lines = plan.lines
    transfer = microphone * car.noise_transfer(lines)
    accelerance = -((2 * np.pi * lines) ** 2)[:, None, None] * car.receptance(lines)
    seen = block_diag(*(placed.response_rows() for placed in setup)) @ accelerance
    noise = np.full(seen.shape[1], plan.response_noise)
    colour = np.outer(np.sqrt(1 + (plan.corner / lines) ** 2), np.append(noise, 0.0))
    colour[:, -1] = cabin_noise
    functions, coherences = [], []
    for number, placed in enumerate(setup):
        columns = slice(len(DOFS) * number, len(DOFS) * (number + 1))
        answer = np.concatenate([seen[:, :, columns], transfer[:, None, columns]], axis=1)
        estimate, coherence = strike_point(answer, placed, plan, colour, generator)
        functions.append(estimate)
        coherences.append(coherence[:, -1])
    matrix = np.concatenate(functions, axis=2)
    return BodyFrfs(
        frequency=lines,
        pressure=matrix[:, -1],
        coherence=np.concatenate(coherences, axis=1),
        acceleration=matrix[:, :-1],
    )


def strike_point(
    answer: ComplexArray,
    placed: rig.Placed,
    plan: rig.HitPlan,
    noise: RealArray,
    generator: np.random.Generator,
) -> tuple[ComplexArray, RealArray]:
    """Strike all impacts around a point and estimate functions and coherences, (f, c, m) each.

    - `answer` (f, c, 6): channels per load at the point.
    - `noise` (f, c): amplitude spectral density of each channel's noise [1/√Hz].
    """
    lines, n_impact = plan.lines, len(placed.sheet.impacts)
    pulse = _pulse(plan.pulse, lines)
    deviation = noise * np.sqrt(plan.duration) / 2
    wrenches = placed.scattered_wrenches(plan.hits, plan.scatter, generator)
    impulses = plan.impulse * generator.uniform(*plan.spread, (plan.hits, n_impact))
    functions, coherences = [], []
    for impact in range(n_impact):
        push = impulses[:, impact, None] * pulse
        response = np.einsum("fca,ha,hf->hfc", answer, wrenches[:, impact], push)
        response = response + deviation * complex_normal(response.shape, generator)
        force = (1 + placed.hammer_gain) * push + (
            plan.force_noise * plan.impulse * complex_normal(push.shape, generator)
        )
        estimate, coherence = rig.first_estimate(force, response)
        functions.append(estimate)
        coherences.append(coherence)
    return np.stack(functions, axis=2), np.stack(coherences, axis=2)


def _pulse(duration: float, frequency: RealArray) -> RealArray:
    """Spectrum of a half sine of impulse 1 about its middle [1]."""
    half_waves = 2 * frequency * duration
    sum_of_sincs = np.sinc((1 + half_waves) / 2) + np.sinc((1 - half_waves) / 2)
    return np.asarray(np.pi / 4 * sum_of_sincs)


@dataclass(frozen=True, eq=False)
class CarSweep(rig.Sweep):
    """One run-up in the car: the truth, and its channels without noise.

    Channels are those on the compressor and on the holders, and the sound [m/s²], [m/s²], [Pa].
    """

    run: CarRun
    channels: tuple[ComplexArray, ...]


def draw_car_sensors(
    errors: rig.PlacementErrors, generator: np.random.Generator
) -> tuple[list[RealArray], float]:
    """Glue one accelerometer on the body side of every mount, and set up the microphone.

    Per mount, six motions of the body there → triaxial accelerometer on its side, shape (3, 6);
    stated over true pressure of the microphone [1].
    """
    rows = []
    for _ in MOUNTS:
        offset = errors.position * generator.standard_normal(3)
        turn = rotation_matrix(errors.angle * generator.standard_normal(3))
        gain = 1 + errors.gain * generator.standard_normal(3)
        rows.append(gain[:, None] * forward_matrices(offset[None], turn[None]))
    # a laboratory without errors has an exact microphone
    decibel = MICROPHONE_DB * float(generator.standard_normal()) if errors.gain else 0.0
    return rows, float(10 ** (decibel / 20))


def sweep_car(
    car: ElectricCarBody,
    running_rig: rig.Operation,
    sensors: tuple[Sequence[RealArray], float],
    frequency: RealArray,
    pressure: float,
    *,
    soft: bool,
) -> CarSweep:
    """Run up the compressor in the car at one of `PRESSURES` [bar] over `frequency` (f,) [Hz]."""
    built, source = running_rig.laboratory, running_rig.source
    hoses = () if soft else built.compressor.hoses
    run = run_car(car, built.compressor, source, frequency, hoses, rig.gas_factor(pressure))
    squared = (2 * np.pi * frequency[:, None]) ** 2
    motion = run.body_motion[:, columns_of(MOUNTS)].reshape(len(squared), -1, len(DOFS))
    rows, microphone = sensors
    holder = np.hstack([motion[:, number] @ row.T for number, row in enumerate(rows)])
    seen = run.displacement @ built.placed.response_rows().T
    sound = microphone * run.pressure[:, None]
    return CarSweep(pressure, hoses, run, (-squared * seen, -squared * holder, sound))


def tracked(
    sweep: CarSweep, generator: np.random.Generator, factor: float = 1.0
) -> tuple[ComplexArray, ...]:
    """Return the delivered spectra: the channels with scatter and noise, times a factor [1]."""
    channel = rig.floor(sweep.run.frequency)[:, None]

    def noisy(exact: ComplexArray, deviation: RealArray | float) -> ComplexArray:
        scatter, noise = generator.standard_normal((2, *exact.shape, 2)) @ [1, 1j] / np.sqrt(2)
        scatter, noise = factor * scatter, factor * noise
        return np.asarray(exact * (1 + rig.SCATTER * scatter) + deviation * noise)

    floors = (channel, channel, np.sqrt(2) * SOUND_FLOOR)
    return tuple(map(noisy, sweep.channels, floors))
