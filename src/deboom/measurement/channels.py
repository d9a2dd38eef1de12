"""Spectra, frequency response functions, time records and load cases with names of their channels.

Names are doubled nowhere, numbers are finite, and lines increase; else InputError.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from deboom.arrays import ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.tabled import Tabled

ADDED_DECAY = "added decay rate [1/s]"
"""Column of a table of functions that were measured with an exponential window."""


def refuse_doubled(names: Sequence[str], what: str) -> None:
    """Refuse names that occur twice."""
    doubled = sorted({name for name in names if names.count(name) > 1})
    if doubled:
        raise InputError(f"duplicated {what} {doubled}: every {what} needs a name of its own")


def refuse_window(added_decay_rate: float, whose: str) -> None:
    """Refuse functions with the decay of an exponential window [1/s] where poles count."""
    if added_decay_rate:
        raise InputError(
            f"{whose}: the functions carry the decay of an exponential window, "
            f"{added_decay_rate:g} 1/s, so their peaks are too low: export them without one; only "
            "modal analysis can take it off"
        )


def _positions(wanted: Sequence[str], names: tuple[str, ...], what: str) -> list[int]:
    missing = [name for name in wanted if name not in names]
    if missing:
        raise InputError(f"no {what} named {missing}; there are {list(names)}")
    return [names.index(name) for name in wanted]


def unit_of_response(function: str, source: str) -> str:
    """Return the unit of a frequency response function times what goes into it.

    ``Pa/N`` times ``N`` is ``Pa``, ``(m/s^2)/N`` times ``N`` is ``m/s^2``; where the source does
    not stand under the function, the result is both units with a dot.
    """
    for below in (f"/{source}", f"/({source})"):
        if function.endswith(below):
            above = function.removesuffix(below)
            return above[1:-1] if above.startswith("(") and above.endswith(")") else above
    return f"{function}·{source}"


@checked(frequency="f increasing", values="f c", channels="c distinct")
class Spectrum(Tabled):
    """Complex spectra of several channels of one unit.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        Lines, increasing [Hz].
    values : array, shape (n_frequency, n_channel)
        Complex peak amplitudes [unit].
    channels : tuple of str
        Name of each column, such as ``TSM x``.
    unit : str
        Unit of all channels.

    Raises
    ------
    InputError
        Another shape, numbers that are not finite, lines that do not increase, doubled names.

    Examples
    --------
    >>> import deboom
    >>> force = deboom.Spectrum([30.0, 31.0], [[1j], [2j]], ("TSM x",), "N")
    >>> force.table.columns.tolist()
    ['frequency [Hz]', 'TSM x [N]']
    """

    frequency: RealArray
    values: ComplexArray
    channels: tuple[str, ...]
    unit: str

    @property
    def table(self) -> pd.DataFrame:
        """Complex values of each channel over frequency."""
        columns = {
            f"{c} [{self.unit}]": v for c, v in zip(self.channels, self.values.T, strict=True)
        }
        return pd.DataFrame({"frequency [Hz]": self.frequency} | columns)

    def select(self, channels: Sequence[str]) -> Spectrum:
        """Return the spectrum of the named channels, in the order asked for."""
        columns = _positions(channels, self.channels, "channel")
        return Spectrum(self.frequency, self.values[:, columns], tuple(channels), self.unit)


@checked(
    frequency="f increasing",
    values="f o i",
    outputs="o distinct",
    inputs="i distinct",
    added_decay_rate=">=0 <inf",
)
class Frf(Tabled):
    """A matrix of frequency response functions whose outputs and inputs have names.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        Lines, increasing [Hz].
    values : array, shape (n_frequency, n_output, n_input)
        Complex functions, output per input [unit].
    outputs, inputs : tuple of str
        Names of the responses and of what excites them.
    unit : str
        Unit of all functions, such as ``Pa/N``.
    added_decay_rate : float
        1/τ of an exponential window on force and responses: the values are those of a body whose
        poles lie this much further left, until modal analysis takes it off; 0 without one [1/s].

    Raises
    ------
    InputError
        Another shape, numbers that are not finite, lines that do not increase, doubled names.

    Examples
    --------
    >>> import deboom
    >>> transfer = deboom.Frf([30.0], [[[2.0]]], ("driver ear",), ("TSM x",), "Pa/N")
    >>> (transfer @ deboom.Spectrum([30.0], [[0.1]], ("TSM x",), "N")).unit
    'Pa'
    """

    frequency: RealArray
    values: ComplexArray
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    unit: str
    added_decay_rate: float = 0.0

    @property
    def table(self) -> pd.DataFrame:
        """Complex values of each output per input over frequency, and the window's decay rate."""
        columns: dict[str, object] = {
            f"{output} per {source} [{self.unit}]": self.values[:, o, i]
            for o, output in enumerate(self.outputs)
            for i, source in enumerate(self.inputs)
        }
        if self.added_decay_rate:
            columns |= {ADDED_DECAY: self.added_decay_rate}
        return pd.DataFrame({"frequency [Hz]": self.frequency} | columns)

    def select(
        self, outputs: Sequence[str] | None = None, inputs: Sequence[str] | None = None
    ) -> Frf:
        """Return the named rows and columns, in the order asked for; None keeps them all."""
        outputs = self.outputs if outputs is None else tuple(outputs)
        inputs = self.inputs if inputs is None else tuple(inputs)
        rows = _positions(outputs, self.outputs, "output")
        columns = _positions(inputs, self.inputs, "input")
        values = self.values[:, rows][:, :, columns]
        return replace(self, values=values, outputs=outputs, inputs=inputs)

    def __matmul__(self, source: Spectrum) -> Spectrum:
        """Response to a spectrum: ``o_f = Σ_i H_foi s_fi``; names and frequencies must agree."""
        if self.inputs != source.channels:
            raise InputError(
                f"inputs {list(self.inputs)} and channels {list(source.channels)} differ: "
                "select() the same names in the same order first"
            )
        if not np.array_equal(self.frequency, source.frequency):
            raise InputError("the frequency axes of matrix and spectrum differ")
        refuse_window(self.added_decay_rate, "a response to a spectrum")
        values = np.einsum("foi,fi->fo", self.values, source.values)
        unit = unit_of_response(self.unit, source.unit)
        return Spectrum(self.frequency, values, self.outputs, unit)


@checked(values="s c some", rate=">0", channels="c distinct")
class TimeRecord:
    """Channels of one unit, sampled together.

    - `values` (n_sample, n_channel), from `start` [s] on, `rate` samples per second [Hz].
    """

    values: RealArray
    rate: float
    channels: tuple[str, ...]
    unit: str
    start: float = 0.0


@checked(engine_torque="f")
class LoadCase:
    """Operating displacement and force spectra of one run, along one engine order.

    - `displacement`: displacement at the virtual points, columns ``<mount> [<piece>] <axis>`` [m].
    - `engine_torque` (n_frequency,), optional: quasi-static engine torque at every line [N m]; None
      where it was not recorded.
    """

    name: str
    title: str
    gear: int
    total_ratio: float
    torque_limit: float
    order: float
    displacement: Spectrum
    force: Spectrum
    engine_torque: RealArray | None = None

    def __post_init__(self) -> None:
        problem = ""
        if self.displacement.channels != self.force.channels:
            problem = (
                f"displacement channels {list(self.displacement.channels)} and force channels "
                f"{list(self.force.channels)} differ"
            )
        elif not np.array_equal(self.displacement.frequency, self.force.frequency):
            problem = "the frequency axes of displacement and force differ"
        elif self.displacement.unit != "m":
            problem = f"displacement is in {self.displacement.unit}, expected m"
        elif self.force.unit != "N":
            problem = f"force is in {self.force.unit}, expected N"
        elif self.engine_torque is not None and len(self.engine_torque) != len(self.force.values):
            problem = (
                f"engine torque of shape {self.engine_torque.shape}, expected one value for each "
                f"of {len(self.force.values)} lines"
            )
        if problem:
            raise InputError(f"load case {self.name}: {problem}")

    @property
    def wheel_torque(self) -> RealArray:
        """Engine torque times total ratio, the preload of the mounts, shape (n_frequency,) [N m].

        A run whose engine torque was not recorded raises InputError.
        """
        if self.engine_torque is None:
            raise InputError(
                f"load case {self.name}: its engine torque was not recorded: add its table as "
                "torque_table in platform.toml"
            )
        return self.engine_torque * self.total_ratio
