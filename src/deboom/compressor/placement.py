"""Sensors and impacts as they may really be: gains, positions and angles off the position sheet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.compressor.mount_derivatives import rotation_derivative
from deboom.measurement.impacts import Impact
from deboom.measurement.placement_tolerances import PlacementTolerances
from deboom.measurement.sensors import SENSOR_AXES, Sensor
from deboom.physics.rigid_body import forward_matrix, rotation_matrix, skew

_UNIT_VECTORS = np.eye(3)


@dataclass(frozen=True, eq=False)
class Placement:
    """Errors of placement and calibration as unknowns.

    Parameters
    ----------
    sensors : tuple of Sensor
        n of them, as the position sheet has them.
    impacts : tuple of Impact
        m of them, as the position sheet has them.

    Notes
    -----
    Per sensor three gains, three offsets and three angles about its own axes; one gain of the
    hammer; per impact two offsets across its direction and two tilts: 9 n + 1 + 4 m unknowns.
    """

    sensors: tuple[Sensor, ...]
    impacts: tuple[Impact, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """One per unknown."""
        per_sensor = [
            f"{sensor.name} {what} {axis}"
            for what in ("gain", "position", "angle")
            for sensor in self.sensors
            for axis in SENSOR_AXES
        ]
        per_impact = [
            f"{impact.name} {what} {number}"
            for what in ("position", "angle")
            for impact in self.impacts
            for number in (1, 2)
        ]
        return (*per_sensor, "hammer gain", *per_impact)

    def deviations(self, tolerances: PlacementTolerances) -> RealArray:
        """State how well each unknown is known before, 1 σ, shape (9 n + 1 + 4 m,)."""
        n_channels, n_tangents = 3 * len(self.sensors), 2 * len(self.impacts)
        return np.concatenate(
            [
                np.full(n_channels, tolerances.sensor_gain),
                np.full(n_channels, tolerances.sensor_position),
                np.full(n_channels, tolerances.sensor_angle),
                [tolerances.hammer_gain],
                np.full(n_tangents, tolerances.impact_position),
                np.full(n_tangents, tolerances.impact_angle),
            ]
        )

    def response_matrix(self, errors: RealArray) -> RealArray:
        """Motion of the virtual point → channels, shape (3 n, 6)."""
        gain, offset, angle, _, _ = self._parts(errors)
        blocks = [
            (1 + gain[i])[:, np.newaxis]
            * (self._turn(i, angle[i]).T @ forward_matrix(sensor.position + offset[i]))
            for i, sensor in enumerate(self.sensors)
        ]
        return np.concatenate(blocks)

    def response_derivatives(self, errors: RealArray) -> RealArray:
        """Differentiate `response_matrix` by gains, offsets and angles, shape (9 n, 3 n, 6)."""
        gain, offset, angle, _, _ = self._parts(errors)
        n = len(self.sensors)
        result = np.zeros((3, n, 3, n, 3, 6))
        for i, sensor in enumerate(self.sensors):
            turn, forward = self._turn(i, angle[i]), forward_matrix(sensor.position + offset[i])
            seen, factor = turn.T @ forward, (1 + gain[i])[:, np.newaxis]
            for axis in range(3):
                result[0, i, axis, i, axis] = seen[axis]
                moved = np.hstack([np.zeros((3, 3)), skew(_UNIT_VECTORS[axis]).T])
                result[1, i, axis, i] = factor * (turn.T @ moved)
                turned = sensor.orientation @ rotation_derivative(angle[i], axis)
                result[2, i, axis, i] = factor * (turned.T @ forward)
        return result.reshape(9 * n, 3 * n, 6)

    def excitation_matrix(self, errors: RealArray) -> RealArray:
        """Wrench of each impact per newton that the hammer states, shape (m, 6)."""
        gain = errors[9 * len(self.sensors)]
        wrenches = np.stack([wrench for wrench, _ in self._wrenches(errors)])
        return np.asarray(wrenches / (1 + gain))

    def excitation_derivatives(self, errors: RealArray) -> RealArray:
        """Differentiate `excitation_matrix` by gain, offsets and tilts, shape (1 + 4 m, m, 6)."""
        m = len(self.impacts)
        factor = 1 / (1 + errors[9 * len(self.sensors)])
        result = np.zeros((1 + 4 * m, m, 6))
        result[0] = -factor * self.excitation_matrix(errors)
        for i, (_, changes) in enumerate(self._wrenches(errors)):
            result[1 + 2 * i : 3 + 2 * i, i] = factor * changes[:2]
            result[1 + 2 * (m + i) : 3 + 2 * (m + i), i] = factor * changes[2:]
        return result

    def _parts(self, errors: RealArray) -> tuple[RealArray, ...]:
        n, m = len(self.sensors), len(self.impacts)
        gain, offset, angle = errors[: 9 * n].reshape(3, n, 3)
        impact_offset, tilt = errors[9 * n + 1 :].reshape(2, m, 2)
        return gain, offset, angle, impact_offset, tilt

    def _turn(self, sensor: int, angle: RealArray) -> RealArray:
        return np.asarray(self.sensors[sensor].orientation @ rotation_matrix(angle))

    def _wrenches(self, errors: RealArray) -> list[tuple[RealArray, RealArray]]:
        """Find the unit wrench of each impact, shape (6,), and its derivatives, shape (4, 6)."""
        *_, offsets, tilts = self._parts(errors)
        result = []
        for impact, offset, tilt in zip(self.impacts, offsets, tilts, strict=True):
            across = tangents(impact.direction)
            position = impact.position + offset @ across
            leaning = impact.direction + tilt @ across
            length = np.linalg.norm(leaning)
            direction = leaning / length
            turned = (across - np.outer(across @ direction, direction)) / length
            zero = np.zeros((2, 3))
            changes = np.concatenate(
                [
                    np.hstack([zero, np.cross(across, direction)]),
                    np.hstack([turned, np.cross(position, turned)]),
                ]
            )
            result.append((np.concatenate([direction, np.cross(position, direction)]), changes))
        return result


def tangents(direction: RealArray) -> RealArray:
    """Two unit vectors across a direction.

    Parameters
    ----------
    direction : array, shape (3,)
        Unit vector [1].

    Returns
    -------
    array, shape (2, 3)
        Right-handed with the direction [1].
    """
    least = _UNIT_VECTORS[int(np.argmin(np.abs(direction)))]
    first = np.cross(direction, least)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(direction, first)])
