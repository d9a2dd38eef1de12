"""Two qualities under two names: the thesis's geometric and van der Seijs's rigid consistency.

Both compare what channels measured with what the body's motion, estimated from all of them, makes
of it. The first is an error, 0 is perfect; the second a coherence, 1 is perfect.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.coherence import likeness
from deboom.measurement.virtual_point import VirtualPoint, channel_values


@dataclass(frozen=True, eq=False)
class RigidConsistency:
    """What is left of the channels after projection on the motions of the virtual point.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        [Hz].
    channels : tuple of str
        Sensor channels or impacts.
    overall : array, shape (n_frequency,)
        Norm of the projected over norm of the measured channels, 0 … 1 [1].
    specific : array, shape (n_frequency, n_channel)
        Coherence of projected and measured channel, 0 … 1 [1]; 0.5 if nothing is left of it.
    """

    frequency: RealArray
    channels: tuple[str, ...]
    overall: RealArray
    specific: RealArray

    def __post_init__(self) -> None:
        for name in ("frequency", "overall", "specific"):
            array = np.array(getattr(self, name), dtype=float)
            array.setflags(write=False)
            object.__setattr__(self, name, array)


def geometric_consistency(point: VirtualPoint, measured: Spectrum | Frf) -> dict[str, float]:
    """Geometric consistency of the thesis: the mean error of each channel.

    Parameters
    ----------
    point : VirtualPoint
        Of the motion sensors.
    measured : Spectrum or Frf
        Of their channels, or with them as outputs; then every line of every input is a line.

    Returns
    -------
    mapping of channel name to float
        0 is perfect; above 0.02 a channel deserves a look [1].

    Raises
    ------
    InputError
        A missing channel, or no signal.

    Notes
    -----
    ``Corr = Σ_f (|Re e| + |Im e|) / (2 M max(|Re a|, |Im a|))`` over M lines, with the error
    ``e = a − V V⁺ a`` and the maximum over all channels and lines. Thesis, 3.2.3; its formula sums
    the differences without absolute values, which its text and its meaning ask for: errors of
    opposite sign would cancel.
    """
    values = channel_values(point, measured).reshape(-1, len(point.channels))
    error = values - point.reproject(values)
    largest = max(np.abs(values.real).max(), np.abs(values.imag).max())
    _refuse_silence(largest)
    mean = np.mean(np.abs(error.real) + np.abs(error.imag), axis=0) / (2 * largest)
    return {name: float(value) for name, value in zip(point.channels, mean, strict=True)}


def response_consistency(point: VirtualPoint, measured: Spectrum | Frf) -> RigidConsistency:
    """Consistency of the motion sensors (van der Seijs).

    Parameters
    ----------
    point : VirtualPoint
        Of the motion sensors.
    measured : Spectrum or Frf
        Of their channels, or with them as outputs; energies are summed over the inputs.

    Raises
    ------
    InputError
        A missing channel, or a line without any signal.

    Notes
    -----
    ``u_f = V V⁺ u``. The overall value is taken in the norm in which the projection is orthogonal,
    ``√(uᴴ W u)``, so that it never exceeds 1, whatever the weights.
    """
    return _consistency(point, measured.frequency, channel_values(point, measured))


def excitation_consistency(point: VirtualPoint, measured: Frf) -> RigidConsistency:
    """Consistency of the points of excitation (van der Seijs).

    Parameters
    ----------
    point : VirtualPoint
        Of the points of excitation, which are inputs of `measured`.
    measured : Frf
        Energies are summed over its outputs.

    Raises
    ------
    InputError
        A missing impact, or a line without any signal.

    Notes
    -----
    ``y_f = y (U U⁺)ᵀ``: the same projection as for responses, because each row of a rigid body's
    matrix is ``y = c Uᵀ``. With weights the transposed order, found elsewhere, is wrong: a rigid
    body would not come back as itself.
    """
    return _consistency(point, measured.frequency, measured.select(inputs=point.channels).values)


def _consistency(
    point: VirtualPoint, frequency: RealArray, values: ComplexArray
) -> RigidConsistency:
    """Of values of shape (n_frequency, n_other, n_channel)."""
    weights = point.geometry.weights

    def energy(channels: ComplexArray) -> npt.NDArray[np.float64]:
        return np.asarray(np.einsum("foc,c->f", np.abs(channels) ** 2, weights))

    projected = point.reproject(values)
    measured = energy(values)
    for line, value in zip(frequency, measured, strict=True):
        _refuse_silence(float(value), f" at {line:g} Hz")
    return RigidConsistency(
        frequency=frequency,
        channels=point.channels,
        overall=np.sqrt(energy(projected) / measured),
        specific=likeness(projected, values, axis=1),
    )


def _refuse_silence(largest: float, where: str = "") -> None:
    if largest == 0:
        raise InputError(f"no channel shows any signal{where}: there is nothing to be consistent")
