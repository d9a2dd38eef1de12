"""Dynamic stiffness of mounts from runs of the car alone: the body takes the place of force cells.

Accelerometers on both sides of every mount give its deflection s; those on the body answer the
forces of all mounts, and the hammer test says how. So K of every direction follows from

    a(f) = Σ H(f) K(f) s(f),    K(f) complex, linear between a few frequencies

over all accelerometers on the body and all lines of a run. No force is measured. Parametric
stiffness over bands is the idea of OPAX (Janssens et al., Mechanical Systems and Signal Processing
25, 2011, and Wang et al., the same 122, 2019, of both the abstract alone was read).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd

from deboom.arrays import AXES, BoolArray, ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channels import LoadCase, Spectrum
from deboom.measurement.measured_vehicle import (
    MeasuredVehicle,
    Method,
    VehicleRun,
    path_accelerance,
    path_noise_transfer,
    piece_paths,
    summed_over_pieces,
)
from deboom.measurement.sensor_classes import CLASS_DEFAULTS
from deboom.measurement.sensors import PlacementTolerances, Sensor
from deboom.measurement.uncertainty import complex_normals
from deboom.measurement.virtual_point import conditioning, sensor_geometry, virtual_point
from deboom.mounts.characterised_mount import (
    CampaignRecord,
    CharacterisedDirection,
    CharacterisedMount,
    DirectionQuality,
    MapPoints,
    MountIdentity,
)
from deboom.mounts.mount import LEAST_LOSS_FACTOR, Mount
from deboom.mounts.operating_map import Preload
from deboom.mounts.response_surface import DynamicStiffnessSurface, operating_points
from deboom.physics.dynamic_stiffness import N_PER_MM, displacement_from_acceleration
from deboom.physics.rigid_body import forward_matrices, rotation_matrix
from deboom.tabled import Tabled

IDENTIFIED = 0.2
"""Half width of the 90 % interval of |K|, median over all lines, up to which it is identified [1].
"""

UNTOLD = 0.5
"""Half width from which the car says nothing of a direction [1]."""

BAND = 1.13
"""Ratio of neighbouring frequencies between which a stiffness is linear [1]."""

STEADY = 0.2
"""Standard deviation of the change of a stiffness from one of these to the next [1]: the prior that
lines without motion are left to. No rate of a supplier takes part."""

MOST_LINES = 121
"""Lines of a run that count; of more, every second or third is taken."""

ALIKE = 5
"""Lines that share the errors of the transfer functions; judgement, some hertz of a hundred lines.
"""

RIPPLES = 12
"""Cosines over the band that make up a smooth error of a transfer function."""

LEAST_ERROR, ANOTHER_DAY = 0.01, 0.03
"""Error of a transfer function at least, and what the body changes by between hammer and road, of
all answers to one force alike [1]; judgement: what doors, fuel and temperature do."""

ROUNDS = 4
"""Fits in which the weights of the channels settle."""

DRAWS = 40

UNEXPLAINED = 0.3
"""Share of the body's motion that no force of a mount explains from which no direction counts as
identified: force passes the mounts by, or a sensor is mistaken [1]. Virtual cars have 0.02 to 0.1.
"""

NORMAL_90, NORMAL_95 = 1.6449, 1.96


@dataclass(frozen=True, eq=False)
class RunInCar:
    """Stiffness of every direction in one run.

    - `source`: motion of the source at every mount, in vehicle axes [m].
    - `deflection`, `force`: this motion less that of the body, and the force on the body [m], [N].
    - `stiffness`, `half_width` (f, n_direction): along the axes of the mounts [N/m]; half width of
      the 90 % interval of its magnitude, relative to it [1].
    - `unexplained`: share of the motion of the body that no force of a mount explains [1].
    """

    name: str
    source: Spectrum
    deflection: Spectrum
    force: Spectrum
    stiffness: ComplexArray
    half_width: RealArray
    unexplained: float


@dataclass(frozen=True, eq=False)
class MountsInCar(Tabled):
    """Dynamic stiffness of the mounts of one vehicle, from its runs alone.

    - `directions`: ``<mount> <axis>``, the columns of each run's arrays. Pieces of a mount share
      their stiffness.
    """

    vehicle: MeasuredVehicle
    directions: tuple[str, ...]
    runs: tuple[RunInCar, ...]

    @property
    def stiffness(self) -> ComplexArray:
        """Of all lines, run after run, shape (n, n_direction) [N/m]."""
        return np.vstack([run.stiffness for run in self.runs])

    @property
    def half_width(self) -> RealArray:
        """Of the 90 % interval of |K|, median over all lines, shape (n_direction,) [1]."""
        return np.asarray(np.median(np.vstack([run.half_width for run in self.runs]), axis=0))

    @property
    def unexplained(self) -> float:
        """Largest share of the motion of the body that no force of a mount explains [1]."""
        return max(run.unexplained for run in self.runs)

    @property
    def passive(self) -> BoolArray:
        """Whether each direction only stores and loses energy, shape (n_direction,)."""
        loss = np.median(self.stiffness.imag / self.stiffness.real, axis=0)
        stores = np.median(self.stiffness.real, axis=0) > 0
        return np.asarray(stores & (loss >= LEAST_LOSS_FACTOR))

    @property
    def identified(self) -> dict[str, bool]:
        """Whether each direction is narrow enough and passive; none where force passes by."""
        sure = (self.half_width <= IDENTIFIED) & self.passive & (self.unexplained <= UNEXPLAINED)
        return dict(zip(self.directions, sure.tolist(), strict=True))

    @property
    def assumed(self) -> tuple[str, ...]:
        """Directions of which the car says nothing, see `load_cases`."""
        silent = ~self.passive | (self.half_width > UNTOLD)
        return tuple(name for name, each in zip(self.directions, silent, strict=True) if each)

    @cached_property
    def load_cases(self) -> tuple[LoadCase, ...]:
        """Runs as a platform takes them: motion of the source, and forces on a body at rest.

        It is what a test bench would give; in the car the body moves by some per cent of this
        motion. A direction of which the car says nothing (`assumed`) is as stiff as the identified
        directions of its mount, or of all mounts, are on average.
        """
        paths, identified = _Paths.of(self.vehicle), self.identified
        sure = [column for column, name in enumerate(self.directions) if identified[name]]
        if not sure:
            raise InputError(
                f"vehicle {self.vehicle.name}: no direction is identified, so that there is no "
                "load case to go on with: place sensors and blows more exactly, and state it in "
                "[tolerances]"
            )
        cases = []
        for run in self.runs:
            stiffness = run.stiffness.copy()
            for name in self.assumed:
                mount = name.rpartition(" ")[0]
                alike = [c for c in sure if self.directions[c].rpartition(" ")[0] == mount] or sure
                stiffness[:, self.directions.index(name)] = run.stiffness[:, alike].mean(axis=1)
            driven = self.vehicle.run(run.name)
            case = LoadCase(
                name=run.name,
                title=f"{run.name} in the car",
                gear=driven.gear,
                total_ratio=driven.total_ratio,
                torque_limit=driven.torque_limit,
                order=driven.order,
                displacement=run.source,
                force=paths.force(stiffness, run.source),
                engine_torque=driven.engine_torque,
            )
            cases.append(case)
        return tuple(cases)

    @property
    def table(self) -> pd.DataFrame:
        """One row per direction: stiffness, loss factor, interval, and whether it is identified."""
        return pd.DataFrame(
            {
                "direction": self.directions,
                "median |K| [N/mm]": N_PER_MM * np.median(np.abs(self.stiffness), axis=0),
                "loss factor [1]": np.median(self.stiffness.imag / self.stiffness.real, axis=0),
                "90 % half width of |K| [%]": 100 * self.half_width,
                "identified": list(self.identified.values()),
            }
        )

    def at_ear(self, run: RunInCar) -> tuple[ComplexArray, ComplexArray]:
        """Return the pressure at the first ear, as measured and of these forces, (f,) [Pa].

        The forces times the hammer's functions; the microphone took no part in finding them.
        """
        ear = self.vehicle.ears[0]
        measured = self.vehicle.run(run.name).pressure.select([ear])
        functions = path_noise_transfer(self.vehicle, Method.DIRECT, ear)
        force = summed_over_pieces(run.force, piece_paths(self.vehicle.mounts))
        synthesised = functions.select(inputs=force.channels) @ force
        return measured.values[:, 0], synthesised.values[:, 0]

    @cached_property
    def mounts(self) -> tuple[CharacterisedMount, ...]:
        """Mounts as a library keeps them, with surfaces over the wheel torque.

        Raises
        ------
        InputError
            A run without engine torque; no direction that is identified.
        """
        lacking = [run.name for run in self.vehicle.runs if run.engine_torque is None]
        if lacking:
            raise InputError(
                f"vehicle {self.vehicle.name}: no engine torque was recorded in {lacking}, so that "
                "no stiffness stands over a preload: name its table as torque_table of the run"
            )
        parts = []
        for mount in self.vehicle.mounts:
            part = Mount(
                name=mount.name,
                description=mount.description,
                pieces=mount.pieces,
                positions=mount.positions,
                transfer_axes=mount.transfer_axes,
                rotations=mount.rotations,
            )
            directions = [
                self._in_library(column)
                for column, name in enumerate(self.directions)
                if name.rpartition(" ")[0] == mount.name
            ]
            identity = MountIdentity(self.record({}).name, mount.name, "in the car")
            parts.append(CharacterisedMount(identity, part, tuple(directions), {}))
        return tuple(parts)

    def record(self, inputs_sha256: Mapping[str, str]) -> CampaignRecord:
        """Return the library's record of the runs, with the hash of every input file."""
        stated = self.vehicle.tolerances
        return CampaignRecord(
            name=f"{self.vehicle.name} in the car",
            order=self.vehicle.runs[0].order,
            runs=tuple(run.name for run in self.runs),
            # the hammer takes the place of the shaker of a test bench
            tolerances={
                "sensor_position [m]": stated.sensor_position,
                "sensor_angle [rad]": stated.sensor_angle,
                "sensor_gain [1]": stated.sensor_gain,
                "shaker_angle [rad]": stated.impact_angle,
                "shaker_gain [1]": stated.hammer_gain,
            },
            inputs_sha256=inputs_sha256,
        )

    def _in_library(self, column: int) -> CharacterisedDirection:
        """Fit the surface of one direction to all lines of its runs and pieces.

        Amplitudes are those of the source, as load cases have them; deflections differ by some per
        cent.
        """
        direction, paths = self.directions[column], _Paths.of(self.vehicle)
        axis = direction.rpartition(" ")[2]
        pieces = np.flatnonzero(paths.shared[:, column])
        points, stiffness, width, names = [], [], [], []
        for case, run in zip(self.load_cases, self.runs, strict=True):
            along = np.abs(run.source.values @ paths.turn)
            for piece in pieces:
                points.append(
                    operating_points(case.wheel_torque, along[:, piece], case.force.frequency)
                )
                stiffness.append(run.stiffness[:, column])
                width.append(run.half_width[:, column])
                names += [run.name] * len(along)
        X, y, widths = np.vstack(points), np.concatenate(stiffness), np.concatenate(width)
        surface = DynamicStiffnessSurface(preload_unit="N m")
        try:
            surface.fit(X, y, 1 / (widths * np.abs(y)) ** 2, groups=names)
        except InputError:
            quality = DirectionQuality(identified=False)
            return CharacterisedDirection(axis, MapPoints.none(), quality)
        misfit = np.median(np.abs(surface.predict(X, extrapolate=True) / y - 1))
        half_width = np.hypot(NORMAL_95 / NORMAL_90 * self.half_width[column], NORMAL_95 * misfit)
        quality = DirectionQuality(
            identified=self.identified[direction] and misfit <= IDENTIFIED,
            half_width_95=float(half_width),
            r2_real=surface.r2_real_,
            r2_imag=surface.r2_imag_,
            r2_force=surface.r2_force_,
        )
        settings = {"preload": Preload.WHEEL_TORQUE.value, "estimate": "in the car"}
        return CharacterisedDirection(axis, MapPoints.none(), quality, surface, settings=settings)


def mounts_in_car(vehicle: MeasuredVehicle, *, seed: int = 1, draws: int = DRAWS) -> MountsInCar:
    """Find the stiffness of the mounts of a vehicle from its runs, without force cells.

    Parameters
    ----------
    vehicle : MeasuredVehicle
        With accelerometers on both sides of every mount, recorded in the runs, and on the body in
        the hammer test, which found the body without its powertrain.
    seed : int
        Of the draws, from 1.
    draws : int
        Repeated measurements that the intervals are made of: sensors and blows of the hammer placed
        anew within the tolerances of the vehicle.

    Returns
    -------
    MountsInCar
        Stiffness, forces and intervals of each direction and run, and which are identified.

    Raises
    ------
    InputError
        No runs; a mount without accelerometer on one side; a hammer test without the accelerometers
        on the body; lines of runs and functions that differ; spectra without phase; a tilted mount
        of which an axis is missing; a seed below 1.

    See Also
    --------
    deboom.read_vehicle, deboom.characterise, deboom.forces_by_mount_stiffness

    Examples
    --------
    >>> import deboom
    >>> vehicle = deboom.read_vehicle("my_car")  # doctest: +SKIP
    >>> deboom.mounts_in_car(vehicle).table  # doctest: +SKIP
    """
    if seed < 1:
        raise InputError(f"seed {seed} is refused: seeds are whole numbers from 1")
    system = _system(vehicle)
    fits = [system.fit(number) for number in range(len(vehicle.runs))]
    generator = np.random.default_rng(seed)
    drawn: list[list[ComplexArray]] = [[] for _ in fits]
    for _ in range(draws):
        again = system.measured_again(vehicle, generator)
        errors, others = (_ripple(system.accelerance.shape, generator) for _ in range(2))
        common = _ripple(system.accelerance[:, :1].shape, generator)
        functions = again.accelerance * (1 + LEAST_ERROR * errors + ANOTHER_DAY * common)
        for number, fit in enumerate(fits):
            drawn[number].append(again.solve(number, fit, functions + fit.error * others))
    results = [
        _result(system, number, run, fit, np.array(values))
        for number, (run, fit, values) in enumerate(zip(vehicle.runs, fits, drawn, strict=True))
    ]
    return MountsInCar(vehicle, system.paths.directions, tuple(results))


def refuse_unusable(vehicle: MeasuredVehicle) -> None:
    """Refuse a vehicle that `mounts_in_car` refuses, without its work; raises InputError."""
    _system(vehicle)


def _system(vehicle: MeasuredVehicle) -> _System:
    """Set up the equations of a vehicle as it was measured, or refuse it."""
    if not vehicle.runs:
        raise InputError(
            f"vehicle {vehicle.name}: there are no runs: drive run-ups with accelerometers on both "
            "sides of the mounts and name them as [[runs]]"
        )
    for run in vehicle.runs:
        if not np.any(run.acceleration.values.imag):
            raise InputError(
                f"vehicle {vehicle.name}, run {run.name}: its spectra are magnitudes without "
                "phase, as of a run-up without a tacho: record the tacho, and track the order with "
                "its phase"
            )
    return _System.of(vehicle, _Paths.of(vehicle))


@dataclass(frozen=True, eq=False)
class _Paths:
    """Directions of the mounts, and the channels in vehicle axes that they are made of.

    - `pieces`: ``<mount> [<piece>] <axis>`` in vehicle axes.
    - `turn` (n_piece, n_column): direction of each column in vehicle axes.
    - `shared` (n_column, n_direction): columns that share a stiffness.
    """

    pieces: tuple[str, ...]
    directions: tuple[str, ...]
    turn: RealArray
    shared: RealArray

    @classmethod
    def of(cls, vehicle: MeasuredVehicle) -> _Paths:
        """Sort the paths of a vehicle."""
        by_path = piece_paths(vehicle.mounts)
        pieces = tuple(piece for of_path in by_path.values() for piece in of_path)
        directions, columns, owners = tuple(by_path), [], []
        for mount in vehicle.mounts:
            for number, angles in enumerate(mount.rotations):
                tilted = any(angles)
                if tilted and set(mount.transfer_axes) != set(AXES):
                    raise InputError(
                        f"vehicle {vehicle.name}: mount {mount.name} is tilted and has the "
                        f"transfer_axes {list(mount.transfer_axes)}: what it does along its axes "
                        "needs all three; measure them, or state rotations of 0"
                    )
                turn = rotation_matrix(angles) if tilted else np.eye(3)
                for axis in mount.transfer_axes:
                    column = np.zeros(len(pieces))
                    for along in mount.transfer_axes:
                        row = pieces.index(mount.channels(along)[number])
                        column[row] = turn[AXES.index(along), AXES.index(axis)]
                    columns.append(column)
                    owners.append(directions.index(f"{mount.name} {axis}"))
        return cls(pieces, directions, np.array(columns).T, np.eye(len(directions))[owners])

    def force(self, stiffness: ComplexArray, motion: Spectrum) -> Spectrum:
        """Return the force of mounts of a stiffness (f, n_direction) under a motion [N]."""
        along = motion.values @ self.turn
        values = (along * (stiffness @ self.shared.T)) @ self.turn.T
        return Spectrum(motion.frequency, values, self.pieces, "N")


def both_sides(vehicle: MeasuredVehicle, run: VehicleRun) -> tuple[Spectrum, Spectrum]:
    """Return the motion above and below every mount in vehicle axes.

    The powertrain is rigid; every other piece has one accelerometer of its own. The body moves as
    its accelerometers around a mount say; where they do not show how it turns, without turning.

    Returns
    -------
    tuple of Spectrum
        Source and body, channels ``<mount> [<piece>] <axis>`` of the transfer axes [m].

    Raises
    ------
    InputError
        A mount without accelerometer above it, or too few on the powertrain.
    """
    above, below = {}, {}
    rigid = None
    if vehicle.powertrain_mounts:
        sensors = [s for s in vehicle.source_sensors if s.mount in vehicle.powertrain_mounts]
        if not sensors:
            raise InputError(_one_sided(vehicle, "the powertrain"))
        powertrain = virtual_point(sensor_geometry(sensors))
        rigid = run.acceleration.select(powertrain.channels).values @ powertrain.inverse.T
    for mount in vehicle.mounts:
        for piece, position in zip(mount.pieces, mount.positions, strict=True):
            point = f"{mount.name} {piece}".strip()
            if rigid is not None and mount.name in vehicle.powertrain_mounts:
                source = rigid @ forward_matrices([position]).T
            else:
                source = _single(vehicle, run, mount.name, piece)
            around = vehicle.geometry(point, Method.RECIPROCAL)
            turning = len(around.channels) > len(AXES) and conditioning(around).complete
            at_point = virtual_point(around) if turning else virtual_point(around, motions=AXES)
            body = run.acceleration.select(at_point.channels).values @ at_point.inverse[:3].T
            for axis in mount.transfer_axes:
                above[f"{point} {axis}"] = source[:, AXES.index(axis)]
                below[f"{point} {axis}"] = body[:, AXES.index(axis)]
    lines = run.acceleration.frequency

    def moved(accelerations: Mapping[str, ComplexArray]) -> Spectrum:
        columns = np.column_stack(list(accelerations.values()))
        values = displacement_from_acceleration(columns, lines)
        return Spectrum(lines, values, tuple(accelerations), "m")

    return moved(above), moved(below)


def _single(vehicle: MeasuredVehicle, run: VehicleRun, mount: str, piece: str) -> ComplexArray:
    """Return the acceleration of what a piece of its own carries, (f, 3) [m/s²]."""
    name = f"{mount} {piece}".strip()
    sensors = [s for s in vehicle.source_sensors if (s.mount, s.piece) == (mount, piece)]
    if len(sensors) != 1:
        if not sensors:
            raise InputError(_one_sided(vehicle, name))
        raise InputError(
            f"vehicle {vehicle.name}: {name} carries a body of its own and needs one accelerometer "
            f"above it; it has {[sensor.name for sensor in sensors]}"
        )
    (sensor,) = sensors
    return np.asarray(run.acceleration.select(sensor.channels).values @ sensor.orientation.T)


def _one_sided(vehicle: MeasuredVehicle, what: str) -> str:
    return (
        f"vehicle {vehicle.name}: there is an accelerometer on the body, but none on {what}: a "
        "stiffness needs the motion on both sides of its mount; glue one on, and name it in "
        "source_sensors"
    )


@dataclass(frozen=True, eq=False)
class _Fit:
    """What one run says, and how far its functions may be believed.

    - `nodes` (n_node, n_direction): stiffness at the frequencies between which it is linear [N/m].
    - `weight` (f, n_channel): of each equation; `prior` (n_direction,): of changes [m²/N²].
    - `error`: floor of the transfer functions, from what the fit leaves [(m/s²)/N].
    - `unexplained`: see `RunInCar`.
    """

    nodes: ComplexArray
    weight: RealArray
    prior: RealArray
    error: float
    unexplained: float


@dataclass(frozen=True, eq=False)
class _System:
    """Equations of all runs of a vehicle.

    - `kept`: lines that count. `hats` (f, n_node): share of each node in the stiffness of a line.
    - `accelerance` (f, n_channel, n_column): of the body, per force along each column of `paths`;
      of the lines that count.
    - `source`, `deflection`: by run, of all lines [m].
    - `answer`: by run (f, n_channel), of the lines that count [m/s²].
    """

    paths: _Paths
    kept: slice
    hats: RealArray
    accelerance: ComplexArray
    source: tuple[Spectrum, ...]
    deflection: tuple[Spectrum, ...]
    answer: tuple[ComplexArray, ...]

    @classmethod
    def of(cls, vehicle: MeasuredVehicle, paths: _Paths) -> _System:
        """Set up the equations."""
        function = path_accelerance(vehicle)
        lines = function.frequency
        kept = slice(None, None, -(-lines.size // MOST_LINES))
        sources, deflections, answers = [], [], []
        for run in vehicle.runs:
            if not np.array_equal(run.acceleration.frequency, lines):
                raise InputError(
                    f"vehicle {vehicle.name}, run {run.name}: it has other lines than the "
                    "accelerances: bring both to the same lines, nothing is interpolated here"
                )
            above, below = (side.select(paths.pieces) for side in both_sides(vehicle, run))
            sources.append(above)
            deflections.append(replace(above, values=above.values - below.values))
            answers.append(run.acceleration.select(function.outputs).values[kept])
        values = function.select(inputs=paths.pieces).values[kept] @ paths.turn
        return cls(
            paths=paths,
            kept=kept,
            hats=_hats(lines),
            accelerance=values,
            source=tuple(sources),
            deflection=tuple(deflections),
            answer=tuple(answers),
        )

    def _equations(self, run: int, accelerance: ComplexArray) -> ComplexArray:
        """Answer of every channel per stiffness of each direction, (f, n_channel, n_direction)."""
        along = self.deflection[run].values[self.kept] @ self.paths.turn
        return np.asarray((accelerance * along[:, np.newaxis, :]) @ self.paths.shared)

    def fit(self, run: int) -> _Fit:
        """Find the stiffness; channels count by what they leave."""
        matrix, answer = self._equations(run, self.accelerance), self.answer[run]
        level = np.mean(np.abs(answer) ** 2)
        variance = np.full(answer.shape, level)
        size = np.sqrt(level / np.mean(np.abs(matrix) ** 2, axis=(0, 1)))
        hats = self.hats[self.kept]
        for _ in range(ROUNDS):
            weight = 1 / (ALIKE * variance)
            prior = 1 / (STEADY * size) ** 2
            nodes = _solved(matrix, answer, hats, weight, prior)
            answered = matrix * (hats @ nodes)[:, np.newaxis, :]
            rest = answer - answered.sum(axis=2)
            # one floor for all: a quiet channel would take its noise for a proof of soft mounts
            floor = np.median(np.mean(np.abs(rest) ** 2, axis=0))
            variance = ANOTHER_DAY**2 * np.sum(np.abs(answered) ** 2, axis=2) + floor
            size = np.abs(nodes).mean(axis=0)
        force = self.paths.force(self.hats @ nodes, self.deflection[run]).values
        error = float(np.sqrt(floor / np.mean(np.sum(np.abs(force) ** 2, axis=1))))
        unexplained = float(np.linalg.norm(rest) / np.linalg.norm(answer))
        return _Fit(nodes, weight, prior, error, unexplained)

    def measured_again(self, vehicle: MeasuredVehicle, generator: np.random.Generator) -> _System:
        """Draw the same measurement with sensors and blows placed anew."""
        return _System.of(_placed_anew(vehicle, generator), self.paths)

    def solve(self, run: int, fit: _Fit, accelerance: ComplexArray) -> ComplexArray:
        """Find the stiffness with the weights of a fit and other transfer functions."""
        matrix = self._equations(run, accelerance)
        hats = self.hats[self.kept]
        return _solved(matrix, self.answer[run], hats, fit.weight, fit.prior)


def _hats(lines: RealArray) -> RealArray:
    """Return the share of each node in the lines, linear from node to node, (f, n_node)."""
    count = 1 + max(1, int(np.ceil(np.log(lines[-1] / lines[0]) / np.log(BAND))))
    nodes = np.geomspace(lines[0], lines[-1], count)
    return np.stack([np.interp(lines, nodes, unit) for unit in np.eye(count)], axis=1)


def _solved(
    matrix: ComplexArray, answer: ComplexArray, hats: RealArray, weight: RealArray, prior: RealArray
) -> ComplexArray:
    """Solve the weighted equations for the stiffness at the nodes, (n_node, n_direction)."""
    n_node, n_direction = hats.shape[1], matrix.shape[2]
    weighted = matrix.conj() * weight[:, :, np.newaxis]
    squares = np.swapaxes(weighted, 1, 2) @ matrix
    right = np.einsum("fa,frk,fr->ak", hats, weighted, answer, optimize=True)
    shares = np.einsum("fa,fb->fab", hats, hats).reshape(len(hats), -1)
    normal = (shares.T @ squares.reshape(len(hats), -1)).reshape(
        n_node, n_node, n_direction, n_direction
    )
    change = np.diff(np.eye(n_node), axis=0)
    normal = normal + np.einsum("ab,kl->abkl", change.T @ change, np.diag(prior))
    flat = normal.swapaxes(1, 2).reshape(n_node * n_direction, -1)
    return np.linalg.solve(flat, right.ravel()).reshape(n_node, n_direction)


def _ripple(shape: tuple[int, ...], generator: np.random.Generator) -> ComplexArray:
    """Draw complex errors that are smooth over the lines, of unit size, shape (f, …)."""
    over = np.cos(np.pi * np.outer(np.linspace(0, 1, shape[0]), np.arange(RIPPLES)))
    normals = complex_normals((RIPPLES, *shape[1:]), generator)
    return np.asarray(np.tensordot(over, normals, 1) / np.sqrt(np.mean(np.sum(over**2, axis=1))))


def _placed_anew(vehicle: MeasuredVehicle, generator: np.random.Generator) -> MeasuredVehicle:
    """Draw sensors, blows and gains within the tolerances of a vehicle."""
    stated = vehicle.tolerances
    impacts = {}
    for point, blows in vehicle.impacts.items():
        moved = []
        for blow in blows:
            turn = rotation_matrix(generator.normal(0, stated.impact_angle, 3))
            position = blow.position + generator.normal(0, stated.impact_position, 3)
            moved.append(replace(blow, position=position, direction=turn @ blow.direction))
        impacts[point] = tuple(moved)
    assert vehicle.accelerance is not None
    hammer = 1 + generator.normal(0, stated.hammer_gain)
    body = {
        point: _sensors_anew(sensors, stated, generator)
        for point, sensors in vehicle.body_sensors.items()
    }
    source = _sensors_anew(vehicle.source_sensors, stated, generator)
    channels = vehicle.runs[0].acceleration.channels
    gains = np.ones(len(channels))
    of_source = {channel for sensor in source for channel in sensor.channels}
    above = np.array([channel in of_source for channel in channels])
    # a gain below a mount is in the hammer's functions as well
    gains[above] += generator.normal(0, stated.sensor_gain, int(above.sum()))
    own, floor = (CLASS_DEFAULTS[f"acceleration_{name}"].value for name in ("own", "floor"))

    def recorded(measured: Spectrum) -> Spectrum:
        noise = np.hypot(own * np.abs(measured.values), floor)
        noise = noise * complex_normals(measured.values.shape, generator)
        return replace(measured, values=measured.values * gains + noise)

    runs = tuple(replace(run, acceleration=recorded(run.acceleration)) for run in vehicle.runs)
    accelerance = replace(vehicle.accelerance, values=vehicle.accelerance.values * hammer)
    return replace(
        vehicle,
        impacts=impacts,
        body_sensors=body,
        source_sensors=source,
        runs=runs,
        accelerance=accelerance,
    )


def _sensors_anew(
    sensors: Sequence[Sensor], stated: PlacementTolerances, generator: np.random.Generator
) -> tuple[Sensor, ...]:
    return tuple(
        replace(
            sensor,
            position=sensor.position + generator.normal(0, stated.sensor_position, 3),
            orientation=rotation_matrix(generator.normal(0, stated.sensor_angle, 3))
            @ sensor.orientation,
        )
        for sensor in sensors
    )


def _result(
    system: _System, number: int, run: VehicleRun, fit: _Fit, drawn: ComplexArray
) -> RunInCar:
    """Say what a run shows, and how far repeated measurements differ."""
    stiffness = system.hats @ fit.nodes
    spread = np.abs(np.einsum("fa,dak->dfk", system.hats, drawn)).std(axis=0)
    moved = system.deflection[number]
    return RunInCar(
        name=run.name,
        source=system.source[number],
        deflection=moved,
        force=system.paths.force(stiffness, moved),
        stiffness=stiffness,
        half_width=NORMAL_90 * spread / np.abs(stiffness),
        unexplained=fit.unexplained,
    )
