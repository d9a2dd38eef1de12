"""Operating dynamic stiffness of one mount direction over preload, amplitude and frequency."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from enum import Enum
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.campaign import AXES, Campaign, OperatingRun
from deboom.measurement.channels import LoadCase, Spectrum
from deboom.mounts.measuring_chain import AlignmentEstimate, BodyRecord, body_record
from deboom.mounts.response_surface import StiffnessSamples
from deboom.physics.dynamic_stiffness import (
    displacement_from_acceleration,
    loss_factor,
    stiffness_h1,
    stiffness_h2,
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


class Estimate(Enum):
    """How force and displacement of repeated runs become one stiffness."""

    BY_NOISE_RATIO = "Hv"
    NOISE_IN_FORCE = "H1"
    NOISE_IN_DISPLACEMENT = "H2"


@dataclass(frozen=True, eq=False)
class OperatingMap:
    """What was measured of one direction, line by line.

    Parameters
    ----------
    mount, axis : str
        Direction; all pieces of the mount together.
    run : array of str, shape (n,)
        Run (the first of repeated ones) and piece of each line.
    frequency : array, shape (n,)
        [Hz].
    wheel_torque : array, shape (n,)
        [N m].
    static_force : array, shape (n,)
        Of the direction; nan where it was not measured [N].
    displacement, force : array, shape (n,)
        Complex peak at the virtual point, mean over repeats [m], [N].
    displacement_noise, force_noise : array, shape (n,)
        Standard deviation of their noise, by the stated tolerances [m], [N].
    stiffness : array, shape (n,)
        Estimated over the repeats, complex [N/m].
    confidence : array, shape (n,)
        Like a coherence: what the stated noise leaves of it and, over repeats, what is left indeed,
        whichever is less; 0 … 1 [1].
    near_floor : array of bool, shape (n,)
        Mask of lines at which the displacement hardly exceeds its noise: not to be used.
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
    near_floor: npt.NDArray[np.bool_]

    def __post_init__(self) -> None:
        for name in self._columns():
            column = np.array(getattr(self, name))
            if column.shape != (len(self.run),):
                raise InputError(
                    f"map of {self.name}: {name} has shape {column.shape}, expected "
                    f"({len(self.run)},)"
                )
            column.setflags(write=False)
            object.__setattr__(self, name, column)

    def __len__(self) -> int:
        return len(self.run)

    @classmethod
    def _columns(cls) -> list[str]:
        return [field.name for field in fields(cls) if field.name not in ("mount", "axis")]

    @property
    def name(self) -> str:
        """``<mount> <axis>``."""
        return f"{self.mount} {self.axis}"

    @property
    def amplitude(self) -> RealArray:
        """Peak displacement amplitude, shape (n,) [m]."""
        return np.abs(self.displacement)

    @property
    def loss_factor(self) -> RealArray:
        """``Im K / Re K``, shape (n,) [1]."""
        return loss_factor(self.stiffness)

    def preload(self, variable: Preload) -> RealArray:
        """Return the chosen preload variable, shape (n,) [N m or N].

        Raises
        ------
        InputError
            The static force of this direction was not measured.
        """
        if variable is Preload.WHEEL_TORQUE:
            return self.wheel_torque
        if not np.all(np.isfinite(self.static_force)):
            raise InputError(
                f"the static force of {self.name} was not measured in all runs: add its channel, "
                "or take the wheel torque as preload"
            )
        return self.static_force

    def select(self, lines: npt.NDArray[np.bool_] | slice) -> OperatingMap:
        """Return some of the lines."""
        return replace(self, **{name: getattr(self, name)[lines] for name in self._columns()})

    def samples(self, variable: Preload) -> StiffnessSamples:
        """Return the lines that are not near the floor, to fit a model to.

        Raises
        ------
        InputError
            No line is left; or the static force is asked for and was not measured.
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
    estimates: Sequence[AlignmentEstimate],
    records: Sequence[BodyRecord],
    estimate: Estimate = Estimate.BY_NOISE_RATIO,
) -> dict[str, OperatingMap]:
    """Refer what the bodies' channels recorded to the mounts: displacement, force, stiffness.

    Parameters
    ----------
    estimates : sequence of AlignmentEstimate
        One per body.
    records : sequence of BodyRecord
        What each body recorded, in the same order.
    estimate : Estimate
        Over repeated runs.

    Returns
    -------
    dict of str to OperatingMap
        By ``<mount> <axis>``; pieces of a mount below each other.

    Raises
    ------
    InputError
        A displacement of exactly 0.

    Notes
    -----
    ``s = −V_i V⁺ a / ω²`` and ``f = FTM⁻¹ F`` (thesis, eq. 27-30). The receiver stands still: the
    motion of the body's point is the relative displacement.
    """
    parts: dict[str, list[OperatingMap]] = {}
    for body, record in zip(estimates, records, strict=True):
        for one in _body_maps(body, record, estimate):
            parts.setdefault(one.name, []).append(one)
    return {name: _stacked(pieces) for name, pieces in parts.items()}


def _body_maps(
    body: AlignmentEstimate, record: BodyRecord, estimate: Estimate
) -> list[OperatingMap]:
    motion, force_matrix = body.motion_matrix, body.force_matrix
    displacement = displacement_from_acceleration(record.acceleration @ motion.T, record.frequency)
    force = record.cell_force @ force_matrix.T
    displacement_noise = np.sqrt(record.acceleration_noise**2 @ motion.T**2)
    displacement_noise /= record.squared_omega[:, np.newaxis]
    force_noise = np.sqrt(record.cell_noise**2 @ force_matrix.T**2)
    maps = []
    for repeats in record.repeated_lines():
        first, n_repeats = repeats[:, 0], repeats.shape[1]
        for place, point in enumerate(body.alignment.body.points):
            for axis in point.axes:
                column = 3 * place + AXES.index(axis)
                s, f = displacement[repeats, column], force[repeats, column]
                s_noise, f_noise = displacement_noise[first, column], force_noise[first, column]
                mean, s_error = s.mean(axis=1), s_noise / np.sqrt(n_repeats)
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
                        stiffness=_stiffness(f, s, f_noise, s_noise, estimate),
                        confidence=_confidence(f, s, f_noise, s_noise),
                        near_floor=np.abs(mean) < FLOOR_FACTOR * s_error,
                    )
                )
    return maps


def _stiffness(
    force: ComplexArray,
    displacement: ComplexArray,
    force_noise: RealArray,
    displacement_noise: RealArray,
    estimate: Estimate,
) -> ComplexArray:
    if estimate is Estimate.NOISE_IN_DISPLACEMENT:
        return stiffness_h2(force, displacement)
    noisy = np.all((force_noise > 0) & (displacement_noise > 0))
    if estimate is Estimate.BY_NOISE_RATIO and noisy:
        return stiffness_hv(force, displacement, force_noise / displacement_noise)
    return stiffness_h1(force, displacement)


def _confidence(
    force: ComplexArray,
    displacement: ComplexArray,
    force_noise: RealArray,
    displacement_noise: RealArray,
) -> RealArray:
    """Coherence that the noise allows, ``1/((1 + σ_s²/|s|²)(1 + σ_f²/|f|²))``, or the measured."""
    moved = np.mean(np.abs(displacement) ** 2, axis=1)
    pushed = np.mean(np.abs(force) ** 2, axis=1)
    expected = 1 / ((1 + displacement_noise**2 / moved) * (1 + force_noise**2 / pushed))
    if force.shape[1] == 1:
        return np.asarray(expected)
    common = np.abs(np.mean(force * displacement.conj(), axis=1)) ** 2 / (moved * pushed)
    return np.asarray(np.minimum(expected, common))


def _stacked(pieces: Sequence[OperatingMap]) -> OperatingMap:
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(one, name) for one in pieces])
        for name in OperatingMap._columns()
    }
    return replace(pieces[0], **columns)


def bench_load_case(
    campaign: Campaign, run: OperatingRun, chains: Sequence[AlignmentEstimate], title: str
) -> LoadCase:
    """Refer what the sensors of the bench recorded in one run to the virtual points.

    Parameters
    ----------
    campaign : Campaign
        That the run belongs to.
    run : OperatingRun
        Line by line; its lines keep their order.
    chains : sequence of AlignmentEstimate
        One per body, from `deboom.mounts.characterise.measuring_chains`.
    title : str
        What a reader calls the run.

    Returns
    -------
    LoadCase
        Motion relative to the bench, which stands still, and forces on it: blocked forces. Channels
        ``<mount> [<piece>] <axis>``.

    Raises
    ------
    InputError
        Channels of the chains that the run did not record, or a displacement of exactly 0.
    """
    records = [body_record(one.alignment.body, [run], campaign.tolerances) for one in chains]
    displacement, force = {}, {}
    for one in operating_maps(chains, records).values():
        for label in dict.fromkeys(one.run.tolist()):
            piece = label.removeprefix(run.name).strip()
            channel = " ".join(filter(None, (one.mount, piece, one.axis)))
            lines = one.select(one.run == label)
            if not np.array_equal(lines.frequency, run.frequency):
                raise InputError(f"run {run.name}: lines of {channel} are not those of the run")
            displacement[channel], force[channel] = lines.displacement, lines.force
    channels = tuple(force)
    moved, pushed = (np.column_stack([*one.values()]) for one in (displacement, force))
    return LoadCase(
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
