"""A load case: what was measured at the mounts' virtual points during one run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Spectrum


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
