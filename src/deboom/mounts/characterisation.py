"""What a characterisation is asked for, what it gives, and what the library keeps of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields

import numpy as np

from deboom.errors import InputError
from deboom.measurement.campaign import Campaign, MeasuredMount, OperatingRun
from deboom.mounts.agreement import Agreement
from deboom.mounts.alignment_estimate import AlignmentEstimate
from deboom.mounts.characterised_direction import (
    CharacterisedDirection,
    DirectionQuality,
    FittedSurface,
    MapPoints,
)
from deboom.mounts.characterised_mount import CampaignRecord, CharacterisedMount, MountIdentity
from deboom.mounts.cubic_fit import PieceOptions
from deboom.mounts.error_budget import LEAST_DRAWS, DirectionBudget
from deboom.mounts.mount import AXES, Mount
from deboom.mounts.operating_map import Estimate, OperatingMap, Preload
from deboom.mounts.response_surface import DynamicStiffnessSurface

TOLERANCE_UNITS = {
    "sensor_position": "m",
    "sensor_angle": "rad",
    "acceleration_floor": "m/s^2",
    "force_floor": "N",
    "shaker_angle": "rad",
    "torque": "N m",
    "static_force": "N",
}
"""Of the tolerances that are not plain numbers."""


@dataclass(frozen=True)
class CharacteriseOptions:
    """How mounts are characterised.

    Parameters
    ----------
    gears : tuple of int or None
        Gears whose runs the surfaces are fitted to; None takes all.
    preload : Preload
        Variable of the surfaces.
    estimate : Estimate
        Over repeated runs.
    pieces : PieceOptions
        Of the surfaces.
    self_calibration : bool
        Whether rigid motion and Newton's law improve the stated alignment.
    excited : tuple of str
        Loads ``fx`` … ``mz`` that excite the powertrain at this order; about the crankshaft along y
        alone by default. Four cylinders in line add ``fz`` and its moment ``mx``.
    excitation_deviation : float
        Standard deviation of their direction, per axis [rad].
    folds : int
        Groups of load cases that are held out in turn to judge the surfaces; 0 for none.
    draws : int
        Of the error budget.
    seed : int
        Of the error budget, from 1.

    Raises
    ------
    InputError
        A single fold.
    """

    gears: tuple[int, ...] | None = (5, 6, 7)
    preload: Preload = Preload.WHEEL_TORQUE
    estimate: Estimate = Estimate.BY_NOISE_RATIO
    pieces: PieceOptions = field(default_factory=PieceOptions)
    self_calibration: bool = True
    excited: tuple[str, ...] = ("my",)
    excitation_deviation: float = math.radians(0.2)
    folds: int = 5
    draws: int = LEAST_DRAWS
    seed: int = 1

    def __post_init__(self) -> None:
        if self.folds == 1 or self.folds < 0:
            raise InputError(f"{self.folds} folds leave nothing to fit: take 0 or at least 2")


DEFAULT_OPTIONS = CharacteriseOptions()


@dataclass(frozen=True, eq=False)
class DirectionResult:
    """What came out for one direction.

    Parameters
    ----------
    measured : OperatingMap
        Line by line.
    surface : DynamicStiffnessSurface or None
        Fitted to the lines that are not near the floor.
    training, held_out : Agreement or None
        Of the surface with its own lines; of surfaces with the load cases they were not fitted to.
    budget : DirectionBudget or None
        Uncertainty of the surface.
    complaint : str
        Why there is no surface; empty where there is one.
    """

    measured: OperatingMap
    surface: DynamicStiffnessSurface | None = None
    training: Agreement | None = None
    held_out: Agreement | None = None
    budget: DirectionBudget | None = None
    complaint: str = ""


@dataclass(frozen=True, eq=False)
class Characterisation:
    """Everything that came out for one mount set.

    Parameters
    ----------
    campaign : Campaign
        What it came from.
    mount_set : str
        Parts on the bench.
    runs : tuple of OperatingRun
        That the surfaces were fitted to.
    chains : tuple of AlignmentEstimate
        One per body.
    directions : dict of str to DirectionResult
        By ``<mount> <axis>``.
    options : CharacteriseOptions
        How.
    """

    campaign: Campaign
    mount_set: str
    runs: tuple[OperatingRun, ...]
    chains: tuple[AlignmentEstimate, ...]
    directions: dict[str, DirectionResult]
    options: CharacteriseOptions

    @property
    def mounts(self) -> tuple[CharacterisedMount, ...]:
        """What the library keeps, one per mount."""
        return tuple(_characterised_mount(self, mount) for mount in self.campaign.mounts)

    def record(self, inputs_sha256: Mapping[str, str]) -> CampaignRecord:
        """Return the library's record of the campaign.

        Parameters
        ----------
        inputs_sha256 : mapping of str to str
            Hash of every file of `Campaign.input_files`.
        """
        stated = self.campaign.tolerances
        return CampaignRecord(
            name=self.campaign.name,
            order=self.campaign.order,
            runs=tuple(run.name for run in self.campaign.runs),
            tolerances={
                f"{one.name} [{TOLERANCE_UNITS.get(one.name, '1')}]": getattr(stated, one.name)
                for one in fields(stated)
            },
            inputs_sha256=inputs_sha256,
        )


def _characterised_mount(result: Characterisation, measured: MeasuredMount) -> CharacterisedMount:
    directions = {
        axis: result.directions[f"{measured.name} {axis}"]
        for axis in AXES
        if f"{measured.name} {axis}" in result.directions
    }
    points = [point for c in result.chains for point in c.alignment.body.points]
    scatter = max(p.transfer_scatter.max() for p in points if p.mount == measured.name)
    quality = {"scatter of the force transfer matrix [1]": float(scatter)}
    for chain in result.chains:
        if any(point.mount == measured.name for point in chain.alignment.body.points):
            quality |= {f"misfit of {group} [1]": value for group, value in chain.misfit}
    return CharacterisedMount(
        identity=MountIdentity(result.campaign.name, measured.name, result.mount_set),
        mount=Mount(
            measured.name,
            measured.description,
            measured.pieces,
            measured.positions,
            measured.transfer_axes,
        ),
        directions=tuple(
            _characterised_direction(result, measured.name, axis, one)
            for axis, one in directions.items()
        ),
        quality=quality,
    )


def _characterised_direction(
    result: Characterisation, mount: str, axis: str, one: DirectionResult
) -> CharacterisedDirection:
    curves = [
        curve
        for curve in result.campaign.static_curves
        if (curve.mount_set, curve.mount, curve.axis) == (result.mount_set, mount, axis)
    ]
    budget = one.budget
    quality = DirectionQuality(identified=False)
    if one.surface is not None:
        quality = DirectionQuality(
            identified=budget is not None and budget.identified,
            half_width_95=None if budget is None else budget.half_width_95,
            r2_real=one.surface.r2_real,
            r2_imag=one.surface.r2_imag,
            r2_force=one.surface.r2_force,
        )
    return CharacterisedDirection(
        axis=axis,
        map_points=_map_points(one.measured),
        quality=quality,
        surface=None if one.surface is None else _fitted_surface(one.surface, result.options),
        static_curve=curves[0] if curves else None,
    )


def _map_points(measured: OperatingMap) -> MapPoints:
    """Every line over static force; those near the floor have no confidence."""
    return MapPoints(
        preload=measured.preload(Preload.STATIC_FORCE),
        wheel_torque=measured.wheel_torque,
        amplitude=measured.amplitude,
        frequency=measured.frequency,
        dynamic_stiffness=measured.stiffness,
        confidence=np.where(measured.near_floor, 0.0, measured.confidence),
        run=measured.run,
    )


def _fitted_surface(
    surface: DynamicStiffnessSurface, options: CharacteriseOptions
) -> FittedSurface:
    ranges = surface.ranges
    return FittedSurface(
        model=type(surface).__name__,
        variables=(options.preload.value, *list(ranges)[1:]),
        units=tuple(surface.units[name] for name in ranges),
        lower=np.array([low for low, _ in ranges.values()]),
        upper=np.array([high for _, high in ranges.values()]),
        arrays=surface.to_arrays(),
        settings={
            "preload": options.preload.value,
            "gears": "all" if options.gears is None else ", ".join(map(str, options.gears)),
            "estimate": options.estimate.value,
            "pieces": options.pieces.pieces,
            "self-calibration": options.self_calibration,
        },
    )
