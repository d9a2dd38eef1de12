"""Spectra, frequency response functions, time records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError

_T = TypeVar("_T", bound=np.generic)


def _frozen_copy(array: npt.NDArray[_T]) -> npt.NDArray[_T]:
    """Copy first: freezing in place would freeze the caller's array."""
    copy = array.copy()
    copy.setflags(write=False)
    return copy


def _checked_names(names: Sequence[str], count: int, what: str) -> tuple[str, ...]:
    names = tuple(names)
    if len(names) != count:
        raise InputError(f"{len(names)} {what} names for {count} {what} columns: {list(names)}")
    doubled = sorted({name for name in names if names.count(name) > 1})
    if doubled:
        raise InputError(f"duplicated {what} {doubled}: every {what} needs a name of its own")
    return names


def _positions(wanted: Sequence[str], names: tuple[str, ...], what: str) -> list[int]:
    missing = [name for name in wanted if name not in names]
    if missing:
        raise InputError(f"no {what} named {missing}; there are {list(names)}")
    return [names.index(name) for name in wanted]


def _checked_frequency(frequency: npt.ArrayLike) -> RealArray:
    values = np.asarray(frequency, dtype=float)
    if values.ndim != 1 or values.size == 0:
        raise InputError(f"a frequency axis has one dimension, this one has shape {values.shape}")
    if not np.all(np.isfinite(values)) or np.any(np.diff(values) <= 0):
        raise InputError("frequencies must be finite and increase from line to line")
    return _frozen_copy(values)


def _checked_values(values: npt.ArrayLike, what: str) -> ComplexArray:
    array = np.asarray(values, dtype=complex)
    bad = ~np.isfinite(array)
    if bad.any():
        where = tuple(int(i) for i in np.argwhere(bad)[0])
        raise InputError(f"{what} is not finite at index {where} (line, channel, ...)")
    return _frozen_copy(array)


def unit_of_response(function: str, source: str) -> str:
    """Return the unit of a frequency response function times what goes into it.

    Parameters
    ----------
    function : str
        Such as ``Pa/N`` or ``(m/s^2)/N``.
    source : str
        Such as ``N``.

    Returns
    -------
    str
        What stands over `source`, such as ``Pa`` or ``m/s^2``; where it does not stand under the
        function, both units with a dot.
    """
    for below in (f"/{source}", f"/({source})"):
        if function.endswith(below):
            above = function.removesuffix(below)
            return above[1:-1] if above.startswith("(") and above.endswith(")") else above
    return f"{function}·{source}"


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Complex spectra of several channels of one unit.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        Increasing [Hz].
    values : array, shape (n_frequency, n_channel)
        Complex peak amplitudes, factor e^{+jωt} [unit].
    channels : sequence of str
        Name of each column.
    unit : str
        SI unit of all columns.

    Raises
    ------
    InputError
        Shapes that disagree, duplicated names, values that are not finite.
    """

    frequency: RealArray
    values: ComplexArray
    channels: tuple[str, ...]
    unit: str

    def __post_init__(self) -> None:
        frequency = _checked_frequency(self.frequency)
        values = _checked_values(self.values, "spectrum")
        if values.ndim != 2 or values.shape[0] != frequency.size:
            raise InputError(
                f"a spectrum has shape (n_frequency, n_channel) = ({frequency.size}, n), "
                f"not {values.shape}"
            )
        object.__setattr__(self, "frequency", frequency)
        object.__setattr__(self, "values", values)
        names = _checked_names(self.channels, values.shape[1], "channel")
        object.__setattr__(self, "channels", names)

    def select(self, channels: Sequence[str]) -> Spectrum:
        """Return the spectrum of the named channels, in the order asked for."""
        columns = _positions(channels, self.channels, "channel")
        return Spectrum(self.frequency, self.values[:, columns], tuple(channels), self.unit)


@dataclass(frozen=True, eq=False)
class Frf:
    """A matrix of frequency response functions whose outputs and inputs have names.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        Increasing [Hz].
    values : array, shape (n_frequency, n_output, n_input)
        Complex response per unit input [unit].
    outputs, inputs : sequence of str
        Names of the rows and of the columns.
    unit : str
        SI unit, such as ``Pa/N``.

    Raises
    ------
    InputError
        Shapes that disagree, duplicated names, values that are not finite.
    """

    frequency: RealArray
    values: ComplexArray
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    unit: str

    def __post_init__(self) -> None:
        frequency = _checked_frequency(self.frequency)
        values = _checked_values(self.values, "frequency response function")
        if values.ndim != 3 or values.shape[0] != frequency.size:
            raise InputError(
                "a matrix of frequency response functions has shape (n_frequency, n_output, "
                f"n_input) = ({frequency.size}, n, m), not {values.shape}"
            )
        object.__setattr__(self, "frequency", frequency)
        object.__setattr__(self, "values", values)
        outputs = _checked_names(self.outputs, values.shape[1], "output")
        object.__setattr__(self, "outputs", outputs)
        inputs = _checked_names(self.inputs, values.shape[2], "input")
        object.__setattr__(self, "inputs", inputs)

    def select(
        self, outputs: Sequence[str] | None = None, inputs: Sequence[str] | None = None
    ) -> Frf:
        """Return the named rows and columns, in the order asked for; None keeps them all."""
        outputs = self.outputs if outputs is None else tuple(outputs)
        inputs = self.inputs if inputs is None else tuple(inputs)
        rows = _positions(outputs, self.outputs, "output")
        columns = _positions(inputs, self.inputs, "input")
        values = self.values[:, rows][:, :, columns]
        return Frf(self.frequency, values, outputs, inputs, self.unit)

    def __matmul__(self, source: Spectrum) -> Spectrum:
        """Response to a spectrum: ``o_f = Σ_i H_foi s_fi``; names and frequencies must agree."""
        if self.inputs != source.channels:
            raise InputError(
                f"inputs {list(self.inputs)} and channels {list(source.channels)} differ: "
                "select() the same names in the same order first"
            )
        if not np.array_equal(self.frequency, source.frequency):
            raise InputError("the frequency axes of matrix and spectrum differ")
        values = np.einsum("foi,fi->fo", self.values, source.values)
        unit = unit_of_response(self.unit, source.unit)
        return Spectrum(self.frequency, values, self.outputs, unit)


@dataclass(frozen=True, eq=False)
class TimeRecord:
    """Channels of one unit, sampled together.

    Parameters
    ----------
    values : array, shape (n_sample, n_channel)
        [unit].
    rate : float
        Samples per second [Hz].
    channels : sequence of str
        Name of each column.
    unit : str
        SI unit of all columns.
    start : float
        Time of the first sample on the clock of the tacho [s].

    Raises
    ------
    InputError
        Shapes that disagree, duplicated names, a rate that is not positive, or a value that is not
        finite.
    """

    values: RealArray
    rate: float
    channels: tuple[str, ...]
    unit: str
    start: float = 0.0

    def __post_init__(self) -> None:
        values = np.array(self.values, dtype=float)
        channels = tuple(self.channels)
        if values.ndim != 2 or values.shape[1] != len(channels) or values.size == 0:
            raise InputError(
                f"a time record of {len(channels)} channels has shape (n_sample, "
                f"{len(channels)}), not {values.shape}"
            )
        doubled = sorted({name for name in channels if channels.count(name) > 1})
        if doubled:
            raise InputError(f"duplicated channel {doubled}: every channel needs a name of its own")
        if not self.rate > 0:
            raise InputError(f"a sampling rate of {self.rate} Hz is not positive")
        bad = ~np.isfinite(values)
        if bad.any():
            sample, channel = (int(i) for i in np.argwhere(bad)[0])
            raise InputError(f"channel {channels[channel]} is not finite at sample {sample}")
        values.setflags(write=False)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "channels", channels)


@dataclass(frozen=True, eq=False)
class LoadCase:
    """Operating displacement and force spectra of one run, along one engine order.

    Parameters
    ----------
    name : str
        Short key, such as ``g5_wot220``.
    title : str
        What a reader calls it, such as ``5th gear, full load, 220 Nm``.
    gear : int
        Gear of the run.
    total_ratio : float
        Engine speed over wheel speed [1].
    torque_limit : float
        Engine torque limit of the run [N m].
    order : float
        Engine order of the spectra [1]; ``f = order * rpm / 60``.
    displacement : Spectrum
        At the virtual points, columns ``<mount> [<piece>] <axis>`` [m].
    force : Spectrum
        On the receiver at the virtual points, the same columns [N].
    engine_torque : array, shape (f,), optional
        Quasi-static engine torque at every line [N m]; None where it was not recorded.

    Raises
    ------
    InputError
        Displacement and force of different lines or channels; not one finite torque per line.
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
        if self.displacement.channels != self.force.channels:
            raise InputError(
                f"load case {self.name}: displacement channels "
                f"{list(self.displacement.channels)} and force channels "
                f"{list(self.force.channels)} differ"
            )
        if not np.array_equal(self.displacement.frequency, self.force.frequency):
            raise InputError(
                f"load case {self.name}: the frequency axes of displacement and force differ"
            )
        for spectrum, unit, what in (
            (self.displacement, "m", "displacement"),
            (self.force, "N", "force"),
        ):
            if spectrum.unit != unit:
                raise InputError(
                    f"load case {self.name}: {what} is in {spectrum.unit}, expected {unit}"
                )
        if self.engine_torque is not None:
            self._keep_torque(self.engine_torque)

    @property
    def wheel_torque(self) -> RealArray:
        """Engine torque times total ratio, the preload of the mounts, shape (f,) [N m].

        Raises
        ------
        InputError
            The engine torque of this run was not recorded.
        """
        if self.engine_torque is None:
            raise InputError(
                f"load case {self.name}: its engine torque was not recorded: add its table as "
                "torque_table in platform.toml"
            )
        return self.engine_torque * self.total_ratio

    def _keep_torque(self, torque: RealArray) -> None:
        values = np.array(torque, dtype=float)
        if values.shape != self.displacement.frequency.shape:
            raise InputError(
                f"load case {self.name}: engine torque of shape {values.shape}, expected one value "
                f"for each of {self.displacement.frequency.size} lines"
            )
        if not np.isfinite(values).all():
            line = self.displacement.frequency[np.argmin(np.isfinite(values))]
            raise InputError(
                f"load case {self.name}: the engine torque at {line:g} Hz is not finite"
            )
        values.setflags(write=False)
        object.__setattr__(self, "engine_torque", values)
