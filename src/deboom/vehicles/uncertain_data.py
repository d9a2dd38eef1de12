"""Measured data with their possible errors, and draws of repeated measurements.

A draw does not blur results: it measures again. Noise transfer functions, forces and motions are
changed, and whatever is computed from data is computed from the changed ones. So vehicles, designs
and load cases keep their correlation: a change of the level against today's design, which the
calibration of a microphone does not touch, is known much better than the level.

A source of uncertainty changes measured data as another measurement with the same equipment would
have changed them. Its errors are independent standard-normal draws of its own.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from deboom.arrays import AXES, ComplexArray, IntArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.channels import Band, LoadCase, Spectrum, lines_inside
from deboom.measurement.uncertainty import complex_normals, local_magnitude
from deboom.vehicles.fleet import Fleet
from deboom.vehicles.receivers import Receiver

NEPER_PER_DB = np.log(10.0) / 20.0
LOSS_FACTOR = 0.2
"""Of rubber mounts, for the phase of their stiffness [1]."""

SMALLEST_SHARE = 1e-9
"""Components of a smooth error with a smaller share of its variance are left out [1]."""


@dataclass(frozen=True, eq=False)
class MeasuredArrays:
    """The measured data of a study as plain arrays.

    - `frequency` (f,) [Hz].
    - `transfer` (v, f, p): noise transfer functions of p paths to every receiver; of a vibration
      those to the pressure of the same level [Pa/N].
    - `transfer_around` (v, f, p): magnitude around each line, as measured, see
      `deboom.measurement.uncertainty.local_magnitude` [Pa/N].
    - `displacement`, `force` (c, f, n): motion and force of n channels in c load cases [m], [N].
    - `paths`, `channels`: ``<mount> <axis>`` and ``<mount> [<piece>] <axis>``.
    - `vehicle_of` (v,): number of the vehicle of each receiver; its ear comes first.
    - `floor` (v, f): noise floor of vibrations, as their functions show it [Pa/N]; nan of sounds.
    """

    frequency: RealArray
    transfer: ComplexArray
    transfer_around: RealArray
    displacement: ComplexArray
    force: ComplexArray
    paths: tuple[str, ...]
    channels: tuple[str, ...]
    vehicle_of: IntArray
    floor: RealArray

    @property
    def ears(self) -> IntArray:
        """Numbers of the receivers that come first in their vehicles."""
        return np.unique(self.vehicle_of, return_index=True)[1]


Again = Callable[[MeasuredArrays, np.random.Generator], MeasuredArrays]


@dataclass(frozen=True, eq=False)
class UncertaintySource:
    """One independent cause of error.

    - `name`: name in a few words; unique among the sources of a study, and part of their seeds.
    - `origin`: where its size comes from.
    - `size`: standard deviation, in words with its unit.
    - `measured_again`: from data and a generator to the data with one draw of this error.
    """

    name: str
    origin: str
    size: str
    measured_again: Again


CALIBRATION = "calibration of the transfer functions"
PATHS = "transfer functions, path by path"
DAY = "day of the measurement"
FLOOR = "noise floor of the transfer functions"
SHAKER = "stiffness: alignment of the shaker"
BUDGET = "stiffness: rest of the error budget"
MOTION = "motion in the runs"
CELLS = "measured forces: cells and shaker"
NOISE = "noise of the runs"


def transfer_calibration(
    origin: str, decibels: float, degrees_of_freedom: float = np.inf
) -> UncertaintySource:
    """Level of a vehicle's transfer functions: sensors and source, all paths and receivers alike.

    - `decibels`: standard deviation [dB].
    - `degrees_of_freedom`: degrees of freedom of the standard deviation; infinite where it is
      stated.
    """

    def again(data: MeasuredArrays, generator: np.random.Generator) -> MeasuredArrays:
        normals = generator.standard_normal((len(data.ears), 1, 1))[data.vehicle_of]
        deviation = decibels * _scale(degrees_of_freedom, generator)
        return replace(data, transfer=data.transfer * np.exp(NEPER_PER_DB * deviation * normals))

    return UncertaintySource(CALIBRATION, origin, f"{decibels:.2g} dB per vehicle", again)


def transfer_paths(
    origin: str, relative: float, length: float, degrees_of_freedom: float = np.inf
) -> UncertaintySource:
    """Smooth complex error of every noise transfer function: place and direction.

    - `relative`: root mean square of the complex error over the magnitude around the line, in the
      phase of the function [1].
    - `length`: correlation length over frequency [Hz].
    - `degrees_of_freedom`: degrees of freedom of the root mean square; infinite where it is stated.
    """

    def again(data: MeasuredArrays, generator: np.random.Generator) -> MeasuredArrays:
        basis = _kept_basis(data.frequency.tobytes(), length)
        shape = basis.shape[1], data.transfer.shape[2]
        of_ears = complex_normals((len(data.ears), *shape), generator)
        scale = _scale(degrees_of_freedom, generator)
        error = relative * scale * (basis @ _of_each(data, of_ears, generator))
        size = np.abs(data.transfer)
        phase = np.divide(data.transfer, size, out=np.ones_like(data.transfer), where=size > 0)
        return replace(data, transfer=data.transfer + data.transfer_around * phase * error)

    return UncertaintySource(PATHS, origin, _smooth(relative, length), again)


def transfer_body(origin: str, relative: float, length: float) -> UncertaintySource:
    """Smooth complex factor on all paths of a vehicle: damping and resonances of another day.

    All receivers of the vehicle share it: the modes that moved are those of the same body.

    - `relative`: root mean square of the complex error [1].
    - `length`: correlation length over frequency, about the width of a resonance [Hz].
    """

    def again(data: MeasuredArrays, generator: np.random.Generator) -> MeasuredArrays:
        basis = _kept_basis(data.frequency.tobytes(), length)
        normals = complex_normals((len(data.ears), basis.shape[1], 1), generator)
        factor = np.exp(relative * (basis @ normals))
        return replace(data, transfer=data.transfer * factor[data.vehicle_of])

    return UncertaintySource(DAY, origin, _smooth(relative, length), again)


def transfer_floor(origin: str, floor: float) -> UncertaintySource:
    """Noise of transfer functions, line by line: deviation of real and imaginary part [Pa/N].

    Vibrations have that of `MeasuredArrays.floor` instead: a microphone says nothing of theirs.
    """

    def again(data: MeasuredArrays, generator: np.random.Generator) -> MeasuredArrays:
        of_ears = complex_normals((len(data.ears), *data.transfer.shape[1:]), generator)
        size = np.where(np.isnan(data.floor), floor, data.floor)[..., np.newaxis]
        noise = np.sqrt(2.0) * size * _of_each(data, of_ears, generator)
        return replace(data, transfer=data.transfer + noise)

    return UncertaintySource(FLOOR, origin, f"{floor:.2g} Pa/N per line", again)


def stiffness_error(
    name: str, origin: str, magnitude: Mapping[str, float], channels: Mapping[str, tuple[str, ...]]
) -> UncertaintySource:
    """Dynamic stiffness of each direction: a common gain and turn of all its lines.

    Alignment and calibration of the characterisation are the same at all lines and in all load
    cases, so their error is as well; all pieces of a mount share it. Re K and Im K err alike by the
    magnitude, and independently by as much, so the phase of K by ``√2`` loss factor times that.

    - `magnitude`: direction ``<mount> <axis>`` → standard deviation of ln |K| [1].
    - `channels`: direction → channels of its pieces.
    """
    turn = 1j * np.sqrt(2.0) * LOSS_FACTOR

    def again(data: MeasuredArrays, generator: np.random.Generator) -> MeasuredArrays:
        gain = np.ones(len(data.channels), dtype=complex)
        for direction, deviation in magnitude.items():
            along, across = generator.standard_normal(2)
            at = np.isin(data.channels, channels[direction])
            gain[at] = np.exp(deviation * (along + turn * across))
        return replace(data, force=data.force * gain)

    return UncertaintySource(name, origin, _range_of(magnitude), again)


def force_cells(
    origin: str, gain: Mapping[str, float], angle: Mapping[str, float], channels: tuple[str, ...]
) -> UncertaintySource:
    """Measured forces: gain of each axis of a cell, and leakage by the angle of the shaker.

    - `gain`: point ``<mount> [<piece>]`` → standard deviation of each axis' gain [1].
    - `angle`: point → angle of the shaker that calibrates its cell, per pair of axes [rad].
    - `channels`: channels that err; the others only leak.
    """
    largest = np.rad2deg(max(angle.values(), default=0.0))

    def again(data: MeasuredArrays, generator: np.random.Generator) -> MeasuredArrays:
        mixing = _mixing(data.channels, channels, gain, angle, generator)
        return replace(data, force=data.force + data.force @ mixing.T)

    size = f"gain {_range_of(gain)}, shaker up to {largest:.2g}°"
    return UncertaintySource(CELLS, origin, size, again)


def motion_error(
    origin: str,
    gain: Mapping[str, float],
    leakage: Mapping[str, float],
    surface_channels: tuple[str, ...],
) -> UncertaintySource:
    """Measured motion of the mounts, and with it the forces that surfaces make of it.

    - `gain`, `leakage`: point ``<mount> [<piece>]`` → standard deviation of each axis' gain, and of
      what each other axis leaks into it [1].
    - `surface_channels`: channels whose force is stiffness times motion; measured forces stay.
    """

    def again(data: MeasuredArrays, generator: np.random.Generator) -> MeasuredArrays:
        mixing = _mixing(data.channels, data.channels, gain, leakage, generator)
        moved = data.displacement @ mixing.T
        moves = (np.abs(data.displacement) > 0.0) & np.isin(data.channels, surface_channels)
        relative = np.divide(moved, data.displacement, out=np.zeros_like(moved), where=moves)
        displacement = data.displacement + moved
        return replace(data, displacement=displacement, force=data.force * (1.0 + relative))

    size = f"gain {_range_of(gain)}, other axes {_range_of(leakage)}"
    return UncertaintySource(MOTION, origin, size, again)


def run_noise(origin: str, relative: float) -> UncertaintySource:
    """Order-tracking noise of the forces, line by line, another one in every load case.

    - `relative`: root mean square of the complex error [1].
    """

    def again(data: MeasuredArrays, generator: np.random.Generator) -> MeasuredArrays:
        noise = relative * complex_normals(data.force.shape, generator)
        return replace(data, force=data.force * (1.0 + noise))

    return UncertaintySource(NOISE, origin, f"{100 * relative:.2g} % per line", again)


@checked()
class UncertainData:
    """Vehicles and load cases with the sources of their errors.

    - `fleet`: vehicles as measured; every vehicle with the same paths.
    - `load_cases`: load cases as measured, at least one, with the same channels and lines.
    - `sources`: sources independent of each other, each with a name of its own.
    - `band` (lower, upper): lines that are kept, both edges included [Hz].
    - raises InputError: lines, paths or channels that differ.
    """

    fleet: Fleet
    load_cases: tuple[LoadCase, ...]
    sources: tuple[UncertaintySource, ...]
    band: Band

    def __post_init__(self) -> None:
        first, transfers = self.load_cases[0].force, [v.noise_transfer for v in self.fleet.vehicles]
        differing = [
            (case.name, case.force.channels != first.channels, case.force.frequency)
            for case in self.load_cases
        ] + [
            (name, set(transfer.inputs) != set(transfers[0].inputs), transfer.frequency)
            for name, transfer in zip(self.fleet.names, transfers, strict=True)
        ]
        for name, others, frequency in differing:
            if others or not np.array_equal(frequency, first.frequency):
                raise InputError(
                    f"{name} has other channels, paths or lines than load case "
                    f"{self.load_cases[0].name} and vehicle {self.fleet.names[0]}: bring all to "
                    "the same ones"
                )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the sources."""
        return tuple(source.name for source in self.sources)

    def drawn(
        self, draw: int, seed: int, only: Collection[str] | None = None
    ) -> tuple[Fleet, tuple[LoadCase, ...]]:
        """Measure again, within the band.

        - `draw`: number of the draw, from 0. The same draw and seed give the same errors.
        - `seed`: seed, from 1.
        - `only`, optional: names of the sources that err; by default all. Their errors are those
          that they have among all.
        """
        data = self._arrays
        for source in self.sources:
            if only is None or source.name in only:
                data = source.measured_again(data, own_generator(source, seed, draw))
        return self._of(data)

    @cached_property
    def measured(self) -> tuple[Fleet, tuple[LoadCase, ...]]:
        """Vehicles and load cases as measured, within the band."""
        return self._of(self._arrays)

    @cached_property
    def _arrays(self) -> MeasuredArrays:
        first = self.load_cases[0]
        inside = lines_inside(first.force.frequency, self.band, f"load case {first.name}")
        paths = self.fleet.vehicles[0].noise_transfer.inputs
        frequency = first.force.frequency[inside]
        transfer = np.stack(
            [
                frf.select(inputs=paths).values[inside, 0] * _scale_of(receiver, frequency)
                for vehicle in self.fleet.vehicles
                for receiver, frf in vehicle.transfers.items()
            ]
        )
        return MeasuredArrays(
            frequency=frequency,
            transfer=transfer,
            transfer_around=local_magnitude(transfer, frequency),
            displacement=np.stack([case.displacement.values[inside] for case in self.load_cases]),
            force=np.stack([case.force.values[inside] for case in self.load_cases]),
            paths=paths,
            channels=first.force.channels,
            vehicle_of=np.array(self.fleet.vehicle_of),
            floor=_floors(self.fleet, transfer, frequency),
        )

    def _of(self, data: MeasuredArrays) -> tuple[Fleet, tuple[LoadCase, ...]]:
        vehicles, rows = [], iter(data.transfer)
        for vehicle in self.fleet.vehicles:
            again = {
                receiver: replace(
                    frf,
                    frequency=data.frequency,
                    values=(next(rows) / _scale_of(receiver, data.frequency))[:, np.newaxis],
                    inputs=data.paths,
                )
                for receiver, frf in vehicle.transfers.items()
            }
            ear = again.pop(vehicle.ear)
            vehicles.append(replace(vehicle, noise_transfer=ear, receivers=again))
        first = self.load_cases[0]
        inside = lines_inside(first.force.frequency, self.band, f"load case {first.name}")
        cases = [
            replace(
                case,
                displacement=Spectrum(data.frequency, displacement, data.channels, "m"),
                force=Spectrum(data.frequency, force, data.channels, "N"),
                engine_torque=None if case.engine_torque is None else case.engine_torque[inside],
            )
            for case, displacement, force in zip(
                self.load_cases, data.displacement, data.force, strict=True
            )
        ]
        return Fleet(tuple(vehicles)), tuple(cases)


def _scale_of(receiver: Receiver, frequency: RealArray) -> RealArray:
    """Return the pressure of the same level, (f, 1) [Pa per unit]; 1 of a sound."""
    return receiver.pressure_of_same_level(frequency)[:, np.newaxis]


def _floors(fleet: Fleet, transfer: ComplexArray, frequency: RealArray) -> RealArray:
    """Return the noise floor of each vibration from what changes line by line, (v, f) [Pa/N].

    - `transfer` (v, f, p): see `MeasuredArrays`.

    Fourth differences over the lines, in SI, of which smooth functions have hardly any, and whose
    mean square is 70 times that of white noise; their median stands resonances. Sounds have nan,
    and so have vibrations on fewer than five lines.
    """
    floor = np.full(transfer.shape[:2], np.nan)
    for row, receiver in enumerate(fleet.receivers):
        if not receiver.is_sound and len(frequency) > 4:
            scale = _scale_of(receiver, frequency)
            bent = np.abs(np.diff(transfer[row] / scale, 4, axis=0))
            floor[row] = np.median(bent) / np.sqrt(70.0 * 2.0 * np.log(2.0)) * scale[:, 0]
    return floor


def smooth_basis(frequency: RealArray, length: float) -> RealArray:
    """Return the functions that a smooth random error of unit variance is made of.

    - `frequency` (f,) [Hz].
    - `length`: correlation length, above 0 [Hz].
    - returns (f, n): ``B``: the error ``B z`` of standard normals z has the correlation
      ``exp(-(Δf/length)²/2)`` between lines.

    Karhunen-Loève expansion on the lines: the eigenvectors of the correlation matrix times the
    roots of their eigenvalues, without those that carry no variance.
    """
    distance = (frequency[:, np.newaxis] - frequency) / length
    values, vectors = np.linalg.eigh(np.exp(-(distance**2) / 2.0))
    kept = values > SMALLEST_SHARE * frequency.size
    return np.asarray(vectors[:, kept] * np.sqrt(values[kept]))


def own_generator(source: UncertaintySource, seed: int, draw: int) -> np.random.Generator:
    """Return the generator of one draw of a source; no other source changes it."""
    return np.random.default_rng([seed, zlib.crc32(source.name.encode()), draw])


@lru_cache(maxsize=16)
def _kept_basis(frequency: bytes, length: float) -> RealArray:
    return smooth_basis(np.frombuffer(frequency), length)


def _of_each(
    data: MeasuredArrays, of_ears: ComplexArray, generator: np.random.Generator
) -> ComplexArray:
    """Draw normals of further receivers beside those of the ears, shape (v, ...).

    A seat rail that is measured as well then leaves the draws of the ears as they are.
    """
    normals = np.empty((len(data.vehicle_of), *of_ears.shape[1:]), dtype=complex)
    normals[data.ears] = of_ears
    further = np.setdiff1d(np.arange(len(normals)), data.ears)
    normals[further] = complex_normals((len(further), *of_ears.shape[1:]), generator)
    return normals


def _scale(degrees_of_freedom: float, generator: np.random.Generator) -> float:
    """Draw the true standard deviation over one that was estimated: errors follow Student's t."""
    if np.isinf(degrees_of_freedom):
        return 1.0
    return float(np.sqrt(degrees_of_freedom / generator.chisquare(degrees_of_freedom)))


def _mixing(
    channels: Sequence[str],
    erring: Sequence[str],
    gain: Mapping[str, float],
    leakage: Mapping[str, float],
    generator: np.random.Generator,
) -> RealArray:
    """Draw what each channel gets of itself and of the other axes of its point, beyond itself."""
    matrix = np.zeros((len(channels), len(channels)))
    normals = generator.standard_normal((len(channels), len(AXES)))
    points = [channel.rpartition(" ")[0] for channel in channels]
    for row, channel in enumerate(channels):
        for column, other in enumerate(channels):
            if channel in erring and points[column] == points[row]:
                deviation = (gain if row == column else leakage).get(points[row], 0.0)
                matrix[row, column] = deviation * normals[row, AXES.index(other[-1])]
    return matrix


def _smooth(relative: float, length: float) -> str:
    return f"{100 * relative:.2g} % rms, correlated over {length:.2g} Hz"


def _range_of(deviations: Mapping[str, float]) -> str:
    if not deviations:
        return "none"
    low, high = 100 * min(deviations.values()), 100 * max(deviations.values())
    return f"{low:.2g} %" if low == high else f"{low:.2g} to {high:.2g} %"
