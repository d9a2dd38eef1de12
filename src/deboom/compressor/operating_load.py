"""Load inside a running compressor by one route, and the noise of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.operating_stiffness import static_part

if TYPE_CHECKING:
    from deboom.compressor.route_model import RouteModel
    from deboom.measurement.operating_sweep import OperatingSweep


@dataclass(frozen=True, eq=False)
class OperatingLoad:
    """Motion and load over the speed of one sweep, with the mounts as they were struck.

    Parameters
    ----------
    name : str
        Of the sweep.
    pressure : float
        [Pa].
    frequency : array, shape (n_frequency,)
        Of the rotation [Hz].
    lines : int array, shape (n_frequency,)
        Of the route's model.
    deviation : array, shape (n_frequency, n_channel)
        Of the real and of the imaginary part of each accelerometer [m/s²].
    motion : array, shape (n_frequency, 6)
        Of the virtual point, ``V⁺ a`` [m/s², rad/s²].
    load : array, shape (n_frequency, 6)
        ``AM V⁺ a`` [N, N m].
    """

    name: str
    pressure: float
    frequency: RealArray
    lines: npt.NDArray[np.intp]
    deviation: RealArray
    motion: ComplexArray
    load: ComplexArray

    def select(self, lines: npt.NDArray[np.intp]) -> OperatingLoad:
        """Keep these lines, given by their indices."""
        return replace(
            self,
            frequency=self.frequency[lines],
            lines=self.lines[lines],
            deviation=self.deviation[lines],
            motion=self.motion[lines],
            load=self.load[lines],
        )


def operating_load(model: RouteModel, sweep: OperatingSweep) -> OperatingLoad:
    """Take the load inside out of a sweep.

    Parameters
    ----------
    model : RouteModel
        Its lines hold those of the sweep.
    sweep : OperatingSweep

    Returns
    -------
    OperatingLoad

    Notes
    -----
    Thesis, 4.2: in-situ inverse method, ``F = AM V⁺ a``.
    """
    lines = np.searchsorted(model.frequency, sweep.frequency)
    motion = sweep.acceleration.values @ model.inverse.T
    return OperatingLoad(
        sweep.name,
        sweep.pressure,
        sweep.frequency,
        lines,
        sweep.deviation,
        motion,
        applied(model.apparent_mass[lines], motion),
    )


def noise_covariance(
    model: RouteModel, loads: Sequence[OperatingLoad], apparent_mass: Sequence[ComplexArray]
) -> ComplexArray:
    """Covariance of the noise of loads at one set of lines, which they share.

    Parameters
    ----------
    model : RouteModel
    loads : sequence of OperatingLoad
        n of them, all with the same lines.
    apparent_mass : sequence of array, shape (n_frequency, 6, 6)
        One per load, with the mounts as they are then [kg, kg m, kg m²].

    Returns
    -------
    array, shape (n_frequency, 6 n, 6 n)
        Of the real as of the imaginary part; independent from line to line.

    Notes
    -----
    Each sweep has its own noise; that of the hammer test is the same in all of them.
    """
    lines = loads[0].lines
    n = len(loads)
    blocks = np.zeros((lines.size, n, 6, n, 6), dtype=complex)
    noise = None if model.noise is None else model.noise.select(lines)
    for i, (one, mass) in enumerate(zip(loads, apparent_mass, strict=True)):
        seen = mass @ model.inverse
        weighted = seen * one.deviation[:, np.newaxis, :] ** 2
        blocks[:, i, :, i] = weighted @ np.swapaxes(seen, 1, 2).conj()
        for j, other in enumerate(loads):
            if noise is not None:
                blocks[:, i, :, j] += noise.covariance(one.load, other.load)
    return blocks.reshape(lines.size, 6 * n, 6 * n)


def mount_covariance(model: RouteModel, loads: Sequence[OperatingLoad]) -> ComplexArray:
    """Covariance of loads whose mounts have changed in a way that nothing describes.

    Parameters
    ----------
    model : RouteModel
    loads : sequence of OperatingLoad
        n of them, all with the same lines.

    Returns
    -------
    array, shape (n_frequency, 6 n, 6 n)
        Per squared relative change of the stiffness; of the real as of the imaginary part.

    Notes
    -----
    ``K → K½ (1 + E) K½`` with independent entries of E, so that each direction changes by itself:
    ``(sᴴ A s) A`` with ``A = |v| K/ω²``. The mounts are the same in all sweeps.
    """
    held = static_part(model.mounts[loads[0].lines])
    motions = np.stack([load.motion for load in loads], axis=1)
    strain = motions @ held @ np.swapaxes(motions, 1, 2).conj()
    n = len(loads)
    blocks = strain[:, :, np.newaxis, :, np.newaxis] * held[:, np.newaxis, :, np.newaxis, :]
    return np.asarray(blocks.reshape(len(held), 6 * n, 6 * n))


def applied(matrices: ComplexArray, motion: ComplexArray) -> ComplexArray:
    """Multiply matrices, shape (..., n, 6, 6), with vectors, shape (n, 6)."""
    return np.asarray(np.einsum("...fab,fb->...fa", matrices, motion))
