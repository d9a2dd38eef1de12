"""A small rig with known mounts: what its sensors show, exactly or with errors."""

from dataclasses import dataclass, field

import numpy as np

from deboom.measurement.campaign import Campaign, OperatingRun, ShakerRun, StaticCurve
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.sensors import Sensor, SensorKind, Tolerances
from deboom.measurement.virtual_point import sensor_geometry
from deboom.mounts.mount import Mount
from deboom.physics.rigid_body import forward_matrices, mass_matrix, rotation_matrix

AXES = ("x", "y", "z")
FREQUENCY = np.linspace(20.0, 60.0, 41)
OMEGA_2 = (2 * np.pi * FREQUENCY) ** 2
RATIO = 4.0
EXACT = Tolerances(**dict.fromkeys(Tolerances.__dataclass_fields__, 0.0))

POSITIONS = {"E": (0.0, 0.4, 0.2), "G": (0.0, -0.4, 0.2), "S": (0.2, -0.08, -0.3)}
CARRIERS = tuple(Mount(name, "", ("",), (r,), AXES) for name, r in POSITIONS.items())
WISHBONE = Mount("W", "", ("left", "right"), ((0.1, -0.4, -0.3), (0.1, 0.4, -0.3)), ("x",))
INERTIA = np.array([[10.0, 0.3, -0.4], [0.3, 7.0, 0.6], [-0.4, 0.6, 9.0]])
MASS_MATRIX = mass_matrix(180.0, INERTIA)
WHEEL_END_MASS = 40.0
TRANSFER = np.array([[0.94, 0.01, -0.02], [0.01, 0.93, 0.01], [0.0, -0.01, 0.95]])
"""Of the cells below every carrier."""


def sensor(name, kind, mount, piece, position, angles=(0.0, 0.0, 0.0)):
    turned = rotation_matrix(np.deg2rad(angles))
    return Sensor(name, kind, "B&K 4321", mount, piece, np.array(position), turned)


ACCELEROMETERS = tuple(
    sensor(f"A{k}", SensorKind.ACCELEROMETER, mount, "", np.array(POSITIONS[mount]) + offset, turn)
    for k, (mount, offset, turn) in enumerate(
        [
            ("E", (0.05, -0.05, 0.02), (3.0, 8.0, 90.0)),
            ("E", (-0.05, -0.03, -0.04), (0.0, -5.0, 10.0)),
            ("G", (0.05, 0.05, 0.03), (-6.0, 2.0, 180.0)),
            ("S", (-0.07, 0.05, 0.03), (4.0, 4.0, 270.0)),
            ("S", (-0.05, -0.06, -0.03), (0.0, 7.0, -4.0)),
        ],
        1,
    )
)
SIDES = tuple(
    sensor(f"A{k}", SensorKind.ACCELEROMETER, "W", piece, (0.1, y, -0.25), (2.0, 3.0, 5.0))
    for k, piece, y in ((8, "left", -0.4), (9, "right", 0.4))
)
CELLS = tuple(
    sensor(f"C{k}", SensorKind.FORCE_CELL, mount, piece, (0.0, 0.0, -0.4), (1.0, 2.0, turn))
    for k, (mount, piece, turn) in enumerate(
        [("E", "", 0.0), ("G", "", 90.0), ("S", "", 0.0), ("W", "left", 5.0), ("W", "right", 5.0)],
        1,
    )
)


@dataclass(frozen=True)
class Ramp:
    """A run at one engine torque or towards it."""

    torque: float
    full_load: bool = False
    rising: bool = True
    gear: int = 5
    repeat: int = 1

    @property
    def name(self):
        """Of the run."""
        kind = "wot" if self.full_load else "slice"
        way = "" if self.rising else "_falling"
        return f"g{self.gear}_{kind}{self.torque:.0f}{way}_{self.repeat}"


RAMPS = tuple(
    Ramp(torque, full_load) for full_load in (True, False) for torque in (60.0, 120.0, 180.0)
)


def engine_torque(ramp):
    rising = np.linspace(0.3, 1.0, FREQUENCY.size) if ramp.full_load else 1.0
    return ramp.torque * rising * np.ones(FREQUENCY.size)


def true_stiffness(wheel_torque):
    """Complex stiffness of the nine directions and the wishbone mount, (f, 10) [N/m]."""
    base = 1e5 * np.array([2.0, 1.5, 2.5, 2.2, 1.8, 3.0, 1.2, 0.8, 0.9, 4.0])
    growth = np.array([5, 2, 1, 4, 2, 1, 9, 3, 3, 3]) * 1e-4
    loss = np.linspace(0.08, 0.2, 10)
    return base * (1 + np.outer(wheel_torque, growth)) * (1 + 1j * loss)


def steady_state(ramp):
    """Motion of powertrain (f, 6) and wheel ends (f,), forces (f, 10), stiffness (f, 10)."""
    stiffness = true_stiffness(RATIO * engine_torque(ramp))
    forward = forward_matrices(list(POSITIONS.values()))
    matrix = np.einsum("ka,fk,kb->fab", forward, stiffness[:, :9], forward)
    matrix = matrix - OMEGA_2[:, None, None] * MASS_MATRIX
    load = np.zeros((FREQUENCY.size, 6, 1), dtype=complex)
    load[:, 4, 0] = (40.0 + 2.0 * ramp.torque) * np.exp(-1.4j)
    motion = np.linalg.solve(matrix, load)[..., 0]
    side = 30.0 / (stiffness[:, 9] - OMEGA_2 * WHEEL_END_MASS)
    force = stiffness * np.column_stack([motion @ forward.T, side])
    return motion, side, force, stiffness


@dataclass(frozen=True)
class Rig:
    """What may be wrong with it."""

    tolerances: Tolerances = EXACT
    sensors: tuple[Sensor, ...] = (*ACCELEROMETERS, *SIDES, *CELLS)
    switched_off: tuple[str, ...] = ()
    ramps: tuple[Ramp, ...] = RAMPS
    channel_gain: dict[str, float] = field(default_factory=dict)
    extra_force: float = 0.0
    noise: float = 0.0
    seed: int = 1


RIG = Rig()


def campaign_of(rig=RIG):
    generator = np.random.default_rng(rig.seed)
    return Campaign(
        name="rig",
        mounts=(*CARRIERS, WISHBONE),
        powertrain_mounts=tuple(POSITIONS),
        sensors=rig.sensors,
        switched_off=rig.switched_off,
        mount_sets=("P1",),
        runs=tuple(operating_run(rig, ramp, generator) for ramp in rig.ramps),
        shaker_runs=shaker_runs(),
        static_curves=(
            StaticCurve("S", "x", "P1", np.array([-0.01, 0.01]), np.array([-900.0, 900.0]), 0.03),
        ),
        mass_matrix=MASS_MATRIX,
        mass_tolerance=1.0,
        inertia_tolerance=0.02,
        centre_of_gravity_tolerance=0.002,
        total_ratios=(16.0, 9.0, 6.0, 5.0, RATIO),
        order=1.5,
        tolerances=rig.tolerances,
        input_files=(),
    )


def operating_run(rig, ramp, generator):
    motion, side, force, _ = steady_state(ramp)
    acceleration = -OMEGA_2[:, None] * np.hstack(
        [
            motion @ sensor_geometry(ACCELEROMETERS).forward.T,
            *[np.outer(side, sensor.orientation[0]) for sensor in SIDES],
        ]
    )
    cells = []
    for k, cell in enumerate(CELLS):
        if k < 3:
            pushed = force[:, 3 * k : 3 * k + 3].copy()
            pushed[:, 2] += rig.extra_force
            cells.append(pushed @ TRANSFER.T @ cell.orientation)
        else:
            cells.append(np.outer(force[:, 9], cell.orientation[0]))
    return OperatingRun(
        name=ramp.name,
        mount_set="P1",
        gear=ramp.gear,
        total_ratio=RATIO,
        full_load=ramp.full_load,
        torque_limit=ramp.torque,
        rising=ramp.rising,
        order=1.5,
        engine_torque=engine_torque(ramp),
        acceleration=spectrum(rig, (*ACCELEROMETERS, *SIDES), acceleration, "m/s^2", generator),
        cell_force=spectrum(rig, CELLS, np.hstack(cells), "N", generator),
        static_force=np.outer(RATIO * engine_torque(ramp), np.arange(1.0, 12.0)),
        static_force_names=(
            *(f"{mount} {axis}" for mount in POSITIONS for axis in AXES),
            "W left x",
            "W right x",
        ),
    )


def spectrum(rig, sensors, values, unit, generator):
    names = tuple(channel for sensor in sensors for channel in sensor.channels)
    gains = np.array([rig.channel_gain.get(name, 1.0) for name in names])
    normals = generator.standard_normal((2, *values.shape)) / np.sqrt(2)
    noise = rig.noise * np.abs(values) * (normals[0] + 1j * normals[1])
    return Spectrum(FREQUENCY, gains * values + noise, names, unit)


def shaker_runs():
    return tuple(
        ShakerRun(
            cell.mount,
            "",
            axis,
            1,
            Frf(
                FREQUENCY,
                np.tile((TRANSFER.T @ cell.orientation)[column], (FREQUENCY.size, 1))[..., None],
                cell.channels,
                (f"{cell.mount} {axis}",),
                "N/N",
            ),
        )
        for cell in CELLS[:3]
        for column, axis in enumerate(AXES)
    )
