"""What a hammer test gives to the identification: raw FRFs, their noise, errors of placement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from deboom.arrays import BoolArray, RealArray, checked
from deboom.compressor.parameters import rotation_derivative
from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.compressor_test import check_enough
from deboom.measurement.sensors import SENSOR_AXES, Impact, PlacementTolerances, Sensor
from deboom.physics.rigid_body import forward_matrix, rotation_matrix, skew

SMOOTHING_LINES = 9
"""Lines over which the noise of a few hits is averaged: one line alone knows it to ±30 %."""
_UNIT_VECTORS = np.eye(3)


@dataclass(frozen=True, eq=False)
class Placement:
    """Sensors and impacts as they may really be: gains, positions and angles off the sheet.

    Per sensor three gains, three offsets and three angles about its own axes; one gain of the
    hammer; per impact two offsets across its direction and two tilts: 9 n + 1 + 4 m unknowns.
    """

    sensors: tuple[Sensor, ...]
    impacts: tuple[Impact, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each unknown."""
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
        """Compute motion of the virtual point → channels, shape (3 n, 6)."""
        gain, offset, angle = self._of_sensors(errors)
        blocks = [
            (1 + gain[i])[:, np.newaxis]
            * (
                (sensor.orientation @ rotation_matrix(angle[i])).T
                @ forward_matrix(sensor.position + offset[i])
            )
            for i, sensor in enumerate(self.sensors)
        ]
        return np.concatenate(blocks)

    def response_derivatives(self, errors: RealArray) -> RealArray:
        """Differentiate `response_matrix` by gains, offsets and angles, shape (9 n, 3 n, 6)."""
        gain, offset, angle = self._of_sensors(errors)
        n = len(self.sensors)
        result = np.zeros((3, n, 3, n, 3, 6))
        for i, sensor in enumerate(self.sensors):
            turn = sensor.orientation @ rotation_matrix(angle[i])
            forward = forward_matrix(sensor.position + offset[i])
            seen, factor = turn.T @ forward, (1 + gain[i])[:, np.newaxis]
            for axis in range(3):
                result[0, i, axis, i, axis] = seen[axis]
                moved = np.hstack([np.zeros((3, 3)), skew(_UNIT_VECTORS[axis]).T])
                result[1, i, axis, i] = factor * (turn.T @ moved)
                turned = sensor.orientation @ rotation_derivative(angle[i], axis)
                result[2, i, axis, i] = factor * (turned.T @ forward)
        return result.reshape(9 * n, 3 * n, 6)

    def excitation_matrix(self, errors: RealArray) -> RealArray:
        """Compute the wrench of each impact per newton that the hammer states, shape (m, 6)."""
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

    def _of_sensors(self, errors: RealArray) -> RealArray:
        """Gains, offsets and angles, shape (3, n, 3)."""
        n = len(self.sensors)
        return errors[: 9 * n].reshape(3, n, 3)

    def _wrenches(self, errors: RealArray) -> list[tuple[RealArray, RealArray]]:
        """Find the unit wrench of each impact, shape (6,), and its derivatives, shape (4, 6)."""
        offsets, tilts = errors[9 * len(self.sensors) + 1 :].reshape(2, len(self.impacts), 2)
        result = []
        for impact, offset, tilt in zip(self.impacts, offsets, tilts, strict=True):
            across = _tangents(impact.direction)
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


def _tangents(direction: RealArray) -> RealArray:
    """Two unit vectors across a unit vector, right-handed with it, shape (2, 3) [1]."""
    least = _UNIT_VECTORS[int(np.argmin(np.abs(direction)))]
    first = np.cross(direction, least)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(direction, first)])


@checked(deviation="f c i")
class RawInertance:
    """FRFs from every impact to every channel, and how well they are known.

    `deviation` (n_frequency, n_channel, n_impact): standard deviation of the real and of the
    imaginary part that differs from channel to channel [1/kg]; `force_deviation`: relative standard
    deviation of the real and of the imaginary part that all channels of one impact share at a line:
    the noise of the hammer's signal [1]. InputError: fewer than three sensors or six impacts.
    """

    sensors: tuple[Sensor, ...]
    impacts: tuple[Impact, ...]
    frf: Frf
    deviation: RealArray
    force_deviation: float = 0.001

    def __post_init__(self) -> None:
        check_enough(self.sensors, self.impacts)

    def select(self, lines: BoolArray) -> RawInertance:
        """Keep the marked lines."""
        frf = replace(self.frf, frequency=self.frf.frequency[lines], values=self.frf.values[lines])
        return replace(self, frf=frf, deviation=self.deviation[lines])

    def without(self, names: Sequence[str]) -> RawInertance:
        """Leave impacts of these names out; at least six must stay."""
        kept = [n for n, impact in enumerate(self.impacts) if impact.name not in set(names)]
        impacts = tuple(self.impacts[n] for n in kept)
        return replace(
            self,
            impacts=impacts,
            frf=self.frf.select(inputs=[impact.name for impact in impacts]),
            deviation=self.deviation[:, :, kept],
        )


def deviation_from_coherence(frf: Frf, coherence: npt.ArrayLike, n_averages: int) -> RealArray:
    """Estimate the noise of each FRF from the coherence of few hits.

    `coherence` (n_frequency, n_channel, n_impact): ordinary coherence of `n_averages` hits [1].
    Returns (n_frequency, n_channel, n_impact) standard deviation of the real and of the imaginary
    part [1/kg]. InputError: one hit: its coherence is 1 whatever the noise.

    ``σ² = |H|² (1 − γ²)/(2 n γ²)`` (Bendat and Piersol, eq. 9.52) per FRF. Few hits know it badly,
    but the noise of the response is the same for all channels of a kind and smooth over frequency:
    the mean over the channels and a running mean over `SMOOTHING_LINES` lines take its place. The
    factor ``n/(n−1)`` mends the bias of the coherence of n hits.
    """
    if n_averages < 2:
        raise InputError(
            "one hit per impact says nothing of the noise, its coherence is 1 by construction: "
            "average at least two"
        )
    values = np.clip(np.asarray(coherence, dtype=float), 1e-6, 1 - 1e-12)
    variance = np.abs(frf.values) ** 2 * (1 - values) / (2 * n_averages * values)
    variance *= n_averages / (n_averages - 1)
    smooth = _running_mean(variance.mean(axis=1))[:, np.newaxis]
    return np.sqrt(np.broadcast_to(smooth, variance.shape))


def _running_mean(values: RealArray) -> RealArray:
    """Mean over neighbouring lines, shorter at the ends, shape (n_frequency, n_impact)."""
    width = min(SMOOTHING_LINES, values.shape[0])
    kernel = np.ones(width)
    weight = np.convolve(np.ones(values.shape[0]), kernel, mode="same")
    summed = np.stack([np.convolve(column, kernel, mode="same") for column in values.T], axis=1)
    return np.asarray(summed / weight[:, np.newaxis])
