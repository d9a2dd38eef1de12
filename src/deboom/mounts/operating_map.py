"""Operating dynamic stiffness of one mount direction over preload, amplitude and frequency."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from enum import Enum
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.arrays import BoolArray, ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.campaign import Campaign, OperatingRun
from deboom.measurement.channels import LoadCase, Spectrum
from deboom.mounts.measuring_chain import AlignmentEstimate, BodyRecord, body_record
from deboom.mounts.mount import Mount, in_vehicle_axes
from deboom.mounts.response_surface import StiffnessSamples, operating_points
from deboom.physics.dynamic_stiffness import (
    displacement_from_acceleration,
    stiffness_h1,
    stiffness_hv,
)

FLOOR_FACTOR = 10.0
"""A displacement is near the floor below this many standard deviations of its noise [1]."""


class Preload(Enum):
    """Variable that stands for the static state of a mount; the value names it in a library."""

    WHEEL_TORQUE = "wheel_torque"
    STATIC_FORCE = "preload"

    @property
    def unit(self) -> str:
        """SI unit."""
        return "N m" if self is Preload.WHEEL_TORQUE else "N"


@dataclass(frozen=True, eq=False)
class OperatingMap:
    """Measured lines of one direction, all pieces of the mount together; arrays (n,).

    Displacement, forces and stiffness are along the axes of the mount itself.

    Per line the run (the first of repeated ones) and piece, frequency [Hz], wheel torque [N m],
    static force of the direction, nan where it was not measured [N], complex peak displacement [m]
    and force [N] at the virtual point, mean over repeats, with the standard deviation of their
    noise by the stated tolerances, and the complex stiffness estimated over the repeats [N/m].
    `confidence` is like a coherence, 0 to 1: the lesser of what the stated noise allows and of what
    the repeats show; `near_floor` masks lines at which the displacement hardly exceeds its noise.
    """

    mount: str
    axis: str
    run: npt.NDArray[np.str_]
    frequency: RealArray
    wheel_torque: RealArray
    static_force: RealArray
    displacement: ComplexArray
    force: ComplexArray
    displacement_noise: RealArray
    force_noise: RealArray
    stiffness: ComplexArray
    confidence: RealArray
    near_floor: BoolArray

    def __len__(self) -> int:
        return len(self.run)

    @property
    def name(self) -> str:
        """``<mount> <axis>``."""
        return f"{self.mount} {self.axis}"

    @property
    def amplitude(self) -> RealArray:
        """Peak displacement amplitude, shape (n,) [m]."""
        return np.abs(self.displacement)

    def preload(self, variable: Preload) -> RealArray:
        """Return the chosen preload variable, shape (n,) [N m or N].

        - raises InputError: the static force of this direction was not measured.
        """
        if variable is Preload.WHEEL_TORQUE:
            return self.wheel_torque
        if not np.all(np.isfinite(self.static_force)):
            raise InputError(
                f"the static force of {self.name} was not measured in all runs: add its channel, "
                "or take the axis out of transfer_axes of the mount"
            )
        return self.static_force

    def points(self, variable: Preload) -> RealArray:
        """Return preload, amplitude and frequency of every line, shape (n, 3)."""
        return operating_points(self.preload(variable), self.amplitude, self.frequency)

    def select(self, lines: BoolArray | slice) -> OperatingMap:
        """Return some of the lines."""
        return replace(self, **{name: getattr(self, name)[lines] for name in self.columns()})

    @classmethod
    def columns(cls) -> list[str]:
        """Return the names of the arrays."""
        return [field.name for field in fields(cls) if field.name not in ("mount", "axis")]

    def samples(self, variable: Preload) -> StiffnessSamples:
        """Return the lines that are not near the floor, to fit a model to.

        - raises InputError: no line is left; or the static force is asked for and was not measured.
        """
        usable = self.select(~self.near_floor)
        if not len(usable):
            raise InputError(
                f"{self.name} was never loaded: in all {len(self)} lines its displacement is "
                f"below {FLOOR_FACTOR:g} times the noise; leave the direction out, or excite it"
            )
        return StiffnessSamples(
            preload=usable.preload(variable),
            displacement=usable.displacement,
            frequency=usable.frequency,
            stiffness=usable.stiffness,
            run=usable.run,
        )


def operating_maps(
    chains: Sequence[AlignmentEstimate],
    records: Sequence[BodyRecord],
) -> dict[str, OperatingMap]:
    """Refer the recordings of the bodies' channels to the mounts: displacement, force, stiffness.

    - `chains`, `records`: measuring chains and recordings of the bodies, in one order.
    - returns: maps by ``<mount> <axis>``; pieces of a mount below each other.
    - raises InputError: a displacement of exactly 0.

    ``s = −V_i V⁺ a / ω²`` and ``f = FTM⁻¹ F`` (thesis, eq. 27-30). The receiver stands still: the
    motion of the body's point is the relative displacement.
    """
    pieces: dict[str, list[OperatingMap]] = {}
    for chain, record in zip(chains, records, strict=True):
        for part in _body_maps(chain, record):
            pieces.setdefault(part.name, []).append(part)
    maps = {}
    for name, parts in pieces.items():
        columns: dict[str, Any] = {
            column: np.concatenate([getattr(part, column) for part in parts])
            for column in OperatingMap.columns()
        }
        maps[name] = replace(parts[0], **columns)
    return maps


def bench_load_case(
    campaign: Campaign, run: OperatingRun, chains: Sequence[AlignmentEstimate], title: str
) -> LoadCase:
    """Refer one run on the test bench to the virtual points, as a load case.

    - `campaign`: campaign of the run.
    - `run`: run line by line; its lines keep their order.
    - `chains`: measuring chains of the bodies, from `deboom.mounts.characterise.measuring_chains`.
    - `title`: name of the run for a reader.
    - returns: motion relative to the bench, which stands still, and forces on it: blocked forces.
      Channels ``<mount> [<piece>] <axis>``.
    - raises InputError: channels of the chains that the run did not record, or a displacement of
      exactly 0.
    """
    records = [body_record(chain.alignment.body, [run], campaign.tolerances) for chain in chains]
    displacement, force = {}, {}
    for measured in operating_maps(chains, records).values():
        for label in dict.fromkeys(measured.run.tolist()):
            piece = label.removeprefix(run.name).strip()
            channel = " ".join(filter(None, (measured.mount, piece, measured.axis)))
            lines = measured.select(measured.run == label)
            if not np.array_equal(lines.frequency, run.frequency):
                raise InputError(f"run {run.name}: lines of {channel} are not those of the run")
            displacement[channel], force[channel] = lines.displacement, lines.force
    channels = tuple(force)
    moved, pushed = (np.column_stack([*columns.values()]) for columns in (displacement, force))
    case = LoadCase(
        name=run.name,
        title=title,
        gear=run.gear,
        total_ratio=run.total_ratio,
        torque_limit=run.torque_limit,
        order=run.order,
        displacement=Spectrum(run.frequency, moved, channels, "m"),
        force=Spectrum(run.frequency, pushed, channels, "N"),
        engine_torque=run.engine_torque,
    )
    mounts = [mount for mount in campaign.mounts if isinstance(mount, Mount)]
    return in_vehicle_axes(mounts, case)


def _body_maps(chain: AlignmentEstimate, record: BodyRecord) -> list[OperatingMap]:
    """Build the maps of one body: per number of repeats, point and axis."""
    motion, force_matrix = (
        matrix(chain.mean)
        for matrix in (chain.alignment.motion_matrix, chain.alignment.force_matrix)
    )
    displacement = displacement_from_acceleration(record.acceleration @ motion.T, record.frequency)
    force = record.cell_force @ force_matrix.T
    displacement_noise = np.sqrt(record.acceleration_noise**2 @ motion.T**2)
    displacement_noise /= record.squared_omega[:, np.newaxis]
    force_noise = np.sqrt(record.cell_noise**2 @ force_matrix.T**2)
    maps = []
    for repeats in record.repeated_lines():
        first, n_repeats = repeats[:, 0], repeats.shape[1]
        for point, axis, column in chain.alignment.body.measured_directions:
            s, f = displacement[repeats, column], force[repeats, column]
            s_noise, f_noise = displacement_noise[first, column], force_noise[first, column]
            mean, s_error = s.mean(axis=1), s_noise / np.sqrt(n_repeats)
            noisy = np.all((f_noise > 0) & (s_noise > 0))
            # the coherence that the noise allows, or the measured one of repeats
            moved, pushed = (np.mean(np.abs(values) ** 2, axis=1) for values in (s, f))
            confidence = 1 / ((1 + s_noise**2 / moved) * (1 + f_noise**2 / pushed))
            if n_repeats > 1:
                common = np.abs(np.mean(f * s.conj(), axis=1)) ** 2 / (moved * pushed)
                confidence = np.minimum(confidence, common)
            maps.append(
                OperatingMap(
                    mount=point.mount,
                    axis=axis,
                    run=np.array([f"{run} {point.piece}".strip() for run in record.run[first]]),
                    frequency=record.frequency[first],
                    wheel_torque=record.wheel_torque[repeats].mean(axis=1),
                    static_force=record.static_force[repeats, column].mean(axis=1),
                    displacement=mean,
                    force=f.mean(axis=1),
                    displacement_noise=s_error,
                    force_noise=f_noise / np.sqrt(n_repeats),
                    stiffness=stiffness_hv(f, s, f_noise / s_noise)
                    if noisy
                    else stiffness_h1(f, s),
                    confidence=confidence,
                    near_floor=np.abs(mean) < FLOOR_FACTOR * s_error,
                )
            )
    return maps
