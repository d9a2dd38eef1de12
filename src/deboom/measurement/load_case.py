"""A load case: what was measured at the mounts' virtual points during one run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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

    Raises
    ------
    InputError
        Displacement and force of different lines or channels.
    """

    name: str
    title: str
    gear: int
    total_ratio: float
    torque_limit: float
    order: float
    displacement: Spectrum
    force: Spectrum

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
