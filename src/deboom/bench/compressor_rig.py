"""Sensors and impacts around the virtual compressor: as drawn, and as they truly are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.bench.compressor_plan import COMPRESSOR_DATA, CalibrationLevel
from deboom.bench.frozen import freeze_arrays
from deboom.bench.parameters import read_data
from deboom.physics.rigid_body import forward_matrices, rotation_matrix


@dataclass(frozen=True)
class PlacementErrors:
    """Standard deviations of gains, positions and angles.

    Parameters
    ----------
    gain : float
        Of each accelerometer channel [1].
    position : float
        Of sensors and impacts, per axis [m].
    angle : float
        Of sensors and impacts, per axis [rad].
    hammer : float
        Gain of the hammer [1].
    """

    gain: float
    position: float
    angle: float
    hammer: float


NO_PLACEMENT_ERRORS = PlacementErrors(0.0, 0.0, 0.0, 0.0)
"""Everything as stated, for verification."""


@dataclass(frozen=True, eq=False)
class Sheet:
    """The position sheet of the laboratory.

    Parameters
    ----------
    sensor_positions, sensor_angles : array, shape (n, 3)
        Triaxial accelerometers; angles about the fixed axes x, then y, then z [m], [rad].
    impact_positions, impact_directions : array, shape (m, 3)
        Unit vectors along which the hammer pushes [m], [1].
    """

    sensor_positions: RealArray
    sensor_angles: RealArray
    impact_positions: RealArray
    impact_directions: RealArray

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names, such as ``A1``."""
        return tuple(f"A{number}" for number in range(1, len(self.sensor_positions) + 1))

    @property
    def impacts(self) -> tuple[str, ...]:
        """Names, such as ``I01``."""
        return tuple(f"I{number:02d}" for number in range(1, len(self.impact_positions) + 1))

    @property
    def across(self) -> RealArray:
        """Two unit vectors across the direction of each impact, shape (m, 2, 3)."""
        least = np.eye(3)[np.argmin(np.abs(self.impact_directions), axis=1)]
        first = np.cross(self.impact_directions, least)
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        return np.stack([first, np.cross(self.impact_directions, first)], axis=1)


@dataclass(frozen=True, eq=False)
class Placed:
    """What the position sheet does not say.

    Parameters
    ----------
    sensor_gain : array, shape (n, 3)
        Relative error of each channel [1].
    sensor_offset, sensor_turn : array, shape (n, 3)
        From the sheet; turns about the axes of the sensor itself [m], [rad].
    hammer_gain : float
        Relative error of the force that the hammer states [1].
    impact_offset : array, shape (m, 3)
        From the sheet, across the stated direction [m].
    impact_directions : array, shape (m, 3)
        True unit vectors [1].
    """

    sensor_gain: RealArray
    sensor_offset: RealArray
    sensor_turn: RealArray
    hammer_gain: float
    impact_offset: RealArray
    impact_directions: RealArray

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def response_rows(self, sheet: Sheet) -> RealArray:
        """Motion of the virtual point to the channels, shape (3 n, 6) [1, m]."""
        turned = rotation_matrix(sheet.sensor_angles) @ rotation_matrix(self.sensor_turn)
        rows = forward_matrices(sheet.sensor_positions + self.sensor_offset, turned)
        return np.asarray((1 + self.sensor_gain).reshape(-1, 1) * rows)

    def excitation_rows(self, sheet: Sheet, scatter: RealArray | None = None) -> RealArray:
        """Wrench at the virtual point per true newton of each impact.

        Parameters
        ----------
        sheet : Sheet
            Where the hammer should strike.
        scatter : array, shape (..., m, 3), optional
            Of the hits around their place [m].

        Returns
        -------
        array, shape (..., m, 6)
            [1, m].
        """
        places = sheet.impact_positions + self.impact_offset
        places = places if scatter is None else places + scatter
        forces = np.broadcast_to(self.impact_directions, places.shape)
        return np.concatenate([forces, np.cross(places, forces)], axis=-1)


def position_sheet() -> Sheet:
    """Return the position sheet of the frozen rig: 6 triaxial accelerometers, 18 impacts."""
    rig = read_data(COMPRESSOR_DATA)["rig"]
    return Sheet(
        sensor_positions=np.array(rig["sensor_position_m"]),
        sensor_angles=np.deg2rad(rig["sensor_rotation_deg"]),
        impact_positions=np.array(rig["impact_position_m"]),
        impact_directions=np.array(rig["impact_direction"]),
    )


def placement_errors(level: CalibrationLevel) -> PlacementErrors:
    """Return the standard deviations of a level."""
    levels = read_data(COMPRESSOR_DATA)["rig"][
        "calibration_levels_gain_position_m_angle_deg_hammer"
    ]
    gain, position, degrees, hammer = levels[level.value]
    return PlacementErrors(gain, position, float(np.deg2rad(degrees)), hammer)


def place(sheet: Sheet, errors: PlacementErrors, generator: np.random.Generator) -> Placed:
    """Glue the sensors on and mark the impacts, with the errors of a laboratory.

    Parameters
    ----------
    sheet : Sheet
        Where they should be.
    errors : PlacementErrors
        How large the errors are.
    generator : Generator
        Draws them, normal.
    """
    n_sensor, n_impact = len(sheet.sensor_positions), len(sheet.impact_positions)

    def drawn(deviation: float, *shape: int) -> RealArray:
        return deviation * generator.standard_normal(shape)

    gain, offset, turn = (
        drawn(deviation, n_sensor, 3) for deviation in (errors.gain, errors.position, errors.angle)
    )
    hammer = float(drawn(errors.hammer, 1)[0])
    shifts, tilts = drawn(errors.position, n_impact, 2), drawn(errors.angle, n_impact, 2)
    leaning = sheet.impact_directions + np.einsum("mt,mta->ma", tilts, sheet.across)
    return Placed(
        sensor_gain=gain,
        sensor_offset=offset,
        sensor_turn=turn,
        hammer_gain=hammer,
        impact_offset=np.einsum("mt,mta->ma", shifts, sheet.across),
        impact_directions=leaning / np.linalg.norm(leaning, axis=1, keepdims=True),
    )
