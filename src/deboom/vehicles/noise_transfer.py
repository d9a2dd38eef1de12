"""Two sets of noise transfer functions of one vehicle, and what they do to its sound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum
from deboom.physics import transfer_path
from deboom.physics.correlation import corr_f, corr_s
from deboom.physics.sound_level import spl


@dataclass(frozen=True, eq=False)
class TransferComparison:
    """Noise transfer functions acquired twice, such as with loudspeaker and hammer.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        [Hz].
    paths : tuple of str
        ``<mount> <axis>``.
    corr_f, corr_s : array, shape (n_path,)
        Of the complex functions of each path: difference in shape and in scale [1].
    level_difference : array, shape (n_frequency, n_path)
        Second over first, of the functions [dB].
    contributions : array, shape (2, n_frequency, n_path)
        Pressure through each path with either set [Pa].
    spl : array, shape (2, n_frequency)
        Of the sum over the paths with either set [dB(A)].
    """

    frequency: RealArray
    paths: tuple[str, ...]
    corr_f: RealArray
    corr_s: RealArray
    level_difference: RealArray
    contributions: ComplexArray
    spl: RealArray

    def __post_init__(self) -> None:
        for name in ("frequency", "corr_f", "corr_s", "level_difference", "contributions", "spl"):
            array = np.array(getattr(self, name))
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def pressure(self) -> ComplexArray:
        """Sum over the paths with either set, shape (2, n_frequency) [Pa]."""
        return np.asarray(self.contributions.sum(axis=2))

    @property
    def spl_difference(self) -> RealArray:
        """Second minus first, shape (n_frequency,) [dB]."""
        return np.asarray(self.spl[1] - self.spl[0])


def compare_noise_transfer(first: Frf, second: Frf, force: Spectrum) -> TransferComparison:
    """Compare two acquisitions at one ear, and the sound they give with the same forces.

    Parameters
    ----------
    first, second : Frf
        One output, the same in both; inputs hold every channel of `force` [Pa/N].
    force : Spectrum
        Per path [N].

    Returns
    -------
    TransferComparison

    Raises
    ------
    InputError
        More than one ear, or different ones; a path without noise transfer function; lines that
        differ.

    Notes
    -----
    Thesis, section 3.7.1 and figures 41 and 42: the same forces, one vehicle, two methods.
    """
    if len(first.outputs) != 1 or first.outputs != second.outputs:
        raise InputError(
            f"noise transfer functions of different microphones cannot be compared: "
            f"{list(first.outputs)} and {list(second.outputs)}; select() the same ear of both"
        )
    for frf, which in ((first, "first"), (second, "second")):
        missing = [path for path in force.channels if path not in frf.inputs]
        if missing:
            raise InputError(
                f"the {which} set has no noise transfer function of {missing}, there are "
                f"{list(frf.inputs)}: measure these paths, or leave their forces out"
            )
        if not np.array_equal(frf.frequency, force.frequency):
            raise InputError(f"the {which} set and the forces have different frequency lines")
    pair = [frf.select(inputs=force.channels).values[:, 0, :] for frf in (first, second)]
    through = np.array([transfer_path.contributions(ntf, force.values) for ntf in pair])
    return TransferComparison(
        frequency=force.frequency,
        paths=force.channels,
        corr_f=corr_f(pair[1], pair[0]),
        corr_s=corr_s(pair[1], pair[0]),
        level_difference=20 * np.log10(np.abs(pair[1]) / np.abs(pair[0])),
        contributions=through,
        spl=np.array([spl(pressure, force.frequency) for pressure in through.sum(axis=2)]),
    )
