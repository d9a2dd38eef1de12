"""Spectra, frequency response functions, time records and load cases with names of their channels.

Names are doubled nowhere, numbers are finite, and lines increase; else InputError.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from deboom.arrays import BoolArray, ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.tabled import Tabled

Band = tuple[float, float]
"""Lower and upper edge, both inside [Hz]."""

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


@dataclass(frozen=True)
class SideUnits:
    """Units of functions whose outputs, or inputs, are of several kinds: one each.

    - `outputs`, `inputs`: such as ``m/s^2`` and ``rad/s^2``, ``N`` and ``N m``.
    """

    outputs: tuple[str, ...]
    inputs: tuple[str, ...]

    def __str__(self) -> str:
        """Kinds of outputs per kinds of inputs."""
        kinds = (", ".join(dict.fromkeys(side)) for side in (self.outputs, self.inputs))
        return " per ".join(kinds)

    def of(self, output: int, source: int) -> str:
        """Return the unit of one function."""
        above, below = self.outputs[output], self.inputs[source]
        return f"{_enclosed(above)}/{_enclosed(below)}"


def _enclosed(unit: str) -> str:
    return f"({unit})" if "/" in unit or " " in unit else unit


_ROTATION = {"m": "rad", "m/s": "rad/s", "m/s^2": "rad/s^2"}


def motion_units(names: Sequence[str], unit: str) -> tuple[str, ...]:
    """Return the units of motions ``<point> x … rz``, translations in `unit`: rad/s² for m/s²."""
    turning = _ROTATION.get(unit, f"{unit}/m")
    return tuple(turning if name.endswith(("rx", "ry", "rz")) else unit for name in names)


def load_units(names: Sequence[str], unit: str) -> tuple[str, ...]:
    """Return the units of loads ``<point> x … mz``, forces in `unit`: N m for N."""
    return tuple(f"{unit} m" if name.endswith(("mx", "my", "mz")) else unit for name in names)


def unit_sides(unit: str | SideUnits) -> tuple[str, str]:
    """Split the one unit of functions into that of the output and that of the input.

    - raises InputError: functions of several units, or no output per input.
    """
    depth, text = 0, unit if isinstance(unit, str) else ""
    for place in range(len(text) - 1, 0, -1):
        depth += {")": 1, "(": -1}.get(text[place], 0)
        if text[place] == "/" and depth == 0:
            return _bare(text[:place]), _bare(text[place + 1 :])
    raise InputError(
        f"functions at a virtual point are made of ones of a single unit, an output per input such "
        f"as (m/s^2)/N, not of {unit}"
    )


def _bare(unit: str) -> str:
    return unit[1:-1] if unit.startswith("(") and unit.endswith(")") else unit


def unit_of_response(function: str, source: str) -> str:
    """Return the unit of a frequency response function times what goes into it.

    ``Pa/N`` times ``N`` is ``Pa``, ``(m/s^2)/N`` times ``N`` is ``m/s^2``; where the source does
    not stand under the function, the result is both units with a dot.
    """
    for below in (f"/{source}", f"/({source})"):
        if function.endswith(below):
            return _bare(function.removesuffix(below))
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
    unit : str or tuple of str
        Unit of all channels, or of each of them where they are of several kinds.

    Raises
    ------
    InputError
        Another shape, numbers that are not finite, lines that do not increase, doubled names.

    See Also
    --------
    deboom.Frf, deboom.spl, deboom.tracked_run

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
    unit: str | tuple[str, ...]

    def __post_init__(self) -> None:
        if not isinstance(self.unit, str):
            if len(self.unit) != len(self.channels):
                raise InputError(f"{len(self.channels)} channels need a unit each, or one for all")
            object.__setattr__(self, "unit", _alike(tuple(self.unit)))

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of each channel."""
        return (self.unit,) * len(self.channels) if isinstance(self.unit, str) else self.unit

    @property
    def table(self) -> pd.DataFrame:
        """Complex values of each channel over frequency."""
        columns = {
            f"{channel} [{unit}]": values
            for channel, unit, values in zip(self.channels, self.units, self.values.T, strict=True)
        }
        return pd.DataFrame({"frequency [Hz]": self.frequency} | columns)

    def select(self, channels: Sequence[str]) -> Spectrum:
        """Return the spectrum of the named channels, in the order asked for."""
        columns = _positions(channels, self.channels, "channel")
        units = tuple(self.units[column] for column in columns)
        return Spectrum(
            self.frequency, self.values[:, columns], tuple(channels), units or self.unit
        )


def _alike(units: tuple[str, ...]) -> str | tuple[str, ...]:
    return units[0] if len(set(units)) == 1 else units


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
    unit : str or SideUnits
        Unit of all functions, such as ``Pa/N``, or of each output and input.
    added_decay_rate : float
        1/τ of an exponential window on force and responses: the values are those of a body whose
        poles lie this much further left, until modal analysis takes it off; 0 without one [1/s].

    Raises
    ------
    InputError
        Another shape, numbers that are not finite, lines that do not increase, doubled names.

    See Also
    --------
    deboom.Spectrum, deboom.virtual_point, deboom.read_uff

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
    unit: str | SideUnits
    added_decay_rate: float = 0.0

    def __post_init__(self) -> None:
        if isinstance(self.unit, SideUnits):
            above, below = self.unit.outputs, self.unit.inputs
            if (len(above), len(below)) != (len(self.outputs), len(self.inputs)):
                raise InputError(
                    f"units of {len(above)} outputs and {len(below)} inputs, but there are "
                    f"{len(self.outputs)} and {len(self.inputs)}: state one each"
                )
            if len(set(above)) == 1 and len(set(below)) == 1:
                object.__setattr__(self, "unit", self.unit.of(0, 0))

    def unit_of(self, output: int, source: int) -> str:
        """Return the unit of one function."""
        return self.unit if isinstance(self.unit, str) else self.unit.of(output, source)

    @property
    def table(self) -> pd.DataFrame:
        """Complex values of each output per input over frequency, and the window's decay rate."""
        columns: dict[str, object] = {
            f"{output} per {source} [{self.unit_of(o, i)}]": self.values[:, o, i]
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
        unit = self.unit
        if isinstance(unit, SideUnits):
            unit = SideUnits(
                tuple(unit.outputs[row] for row in rows),
                tuple(unit.inputs[column] for column in columns),
            )
        return replace(self, values=values, outputs=outputs, inputs=inputs, unit=unit)

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
        return Spectrum(self.frequency, values, self.outputs, self.response_units(source.units))

    def response_units(self, source: Sequence[str]) -> tuple[str, ...]:
        """Return the unit of each output, with inputs in the units `source`.

        - raises InputError: inputs that would add up to several units in one output.
        """
        units = []
        for o, output in enumerate(self.outputs):
            of_inputs = {
                unit_of_response(self.unit_of(o, i), unit) for i, unit in enumerate(source)
            }
            if len(of_inputs) > 1:
                raise InputError(
                    f"the inputs of '{output}' add up in {', '.join(sorted(of_inputs))}: their "
                    f"units {', '.join(source)} do not fit functions in {self.unit}"
                )
            units.append(of_inputs.pop())
        return tuple(units)


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


def lines_inside(frequency: RealArray, band: Band, whose: str) -> BoolArray:
    """Say which lines lie in a band, edges included; refuse a band without any, by name."""
    inside = (frequency >= band[0]) & (frequency <= band[1])
    if not inside.any():
        raise InputError(
            f"{whose}: no line between {band[0]:g} and {band[1]:g} Hz: give a band inside the "
            f"measured {frequency[0]:g} to {frequency[-1]:g} Hz, lower edge first"
        )
    return inside
