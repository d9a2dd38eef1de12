"""What a hammer test says of a compressor: the identification as a value, and its alarms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from deboom.arrays import PERCENT, BoolArray, RealArray, checked, short_repr
from deboom.compressor.inertance_fit import THESIS_BANDS, PointFit
from deboom.compressor.model import ModalTable, RigidLimit
from deboom.compressor.parameter_information import Knowledge, quantities, quantity_deviations
from deboom.compressor.self_calibration import HoldOut, RawInertance, SelfCalibration
from deboom.measurement.channels import Frf
from deboom.measurement.compressor_test import InertanceTest
from deboom.measurement.quality import QualityCheck
from deboom.measurement.sensors import PlacementTolerances
from deboom.measurement.virtual_point import VirtualPoint
from deboom.tabled import Tabled

ALARM = 1.5
"""Reduced χ above this: flexible receiver, hoses, wrong symmetry; do not trust the model."""


MISPLACED = 5.0
"""Standard deviations of its tolerance beyond which something is not where the sheet has it."""


HOSE_ALARM = 1.5
"""Misfit without hoses above which something besides rotor, gas and mounts is at work."""


EXPLAINED_BY_HOSES = 0.4
"""Part of the squared misfit that the drawn hoses must take away to count as its cause."""


@dataclass(frozen=True)
class HosePresence:
    """Whether a measurement that is said to be free of hoses shows them.

    `where`: sweep or hammer test; `misfit`: of the best explanation without hoses, in units of
    noise and of one percent of the signal [1]; `misfit_with_hoses`: of the best one with hoses that
    are near the drawn ones; as `misfit` where nothing is left to explain [1].
    """

    where: str
    misfit: float
    misfit_with_hoses: float

    @property
    def explained(self) -> float:
        """Part of the squared misfit that the hoses take away [1]."""
        return 1 - (self.misfit_with_hoses / self.misfit) ** 2

    @property
    def unexplained(self) -> bool:
        """Whether more than rotor, gas and mounts is at work."""
        return self.misfit > HOSE_ALARM

    @property
    def visible(self) -> bool:
        """Whether that is the drawn hoses."""
        return self.unexplained and self.explained > EXPLAINED_BY_HOSES

    @property
    def statement(self) -> str:
        """One sentence for the report."""
        if not self.unexplained:
            return (
                f"{self.where}: no hose shows (misfit {self.misfit:.2f}, alarm at {HOSE_ALARM:g})."
            )
        missed = f"{self.where} is missed by {self.misfit:.1f} times its uncertainty without hoses"
        if self.visible:
            return (
                f"{missed}, and the drawn hoses explain {PERCENT * self.explained:.0f} % of that: "
                "they were attached, whatever the label says."
            )
        return (
            f"{missed}, and the drawn hoses explain {PERCENT * self.explained:.0f} % of that only: "
            "something else is at work, such as a flexible receiver or a hose unlike its drawing."
        )


@checked(largest_lines=">=12")
class IdentifyOptions:
    """What the identification looks at.

    - `bands`: lines of the fit [Hz]; the thesis's by default.
    - `largest_lines`: number of lines of the fit; denser lines are thinned evenly, since placement
      and not noise limits it.
    - `smallest_coherence`: median over the lines of the fit below which nothing is identified [1].
    - raises InputError: fewer than 12 lines.
    """

    bands: tuple[tuple[float, float], ...] = THESIS_BANDS
    largest_lines: int = 72
    smallest_coherence: float = 0.8


@dataclass(frozen=True, eq=False)
class Identification(Tabled):
    """Everything that a hammer test says of a compressor.

    The result is `calibrated`: compressor and placement together, all else leads there or judges
    it. `length`: radius of gyration, by which rotations are scaled [m]; `response`, `excitation`,
    `inertance`: as the position sheet has them, all lines [1/kg, 1/(kg m), 1/(kg m²)]; `fitted`
    (n_frequency,): lines of the fit; `start` (35,): linear start; `point`: fit with the placement
    of the sheet; `knowledge`: posterior against prior; `held_out`: lines not fitted between the
    ends of all bands; `hoses`: search for the drawn hoses, None where none are drawn.

    See Also
    --------
    deboom.identify, deboom.unbalance
    """

    test: InertanceTest
    options: IdentifyOptions
    length: float
    quality: tuple[QualityCheck, ...]
    response: VirtualPoint
    excitation: VirtualPoint
    inertance: Frf
    raw: RawInertance
    fitted: BoolArray
    start: RealArray
    point: PointFit
    calibrated: SelfCalibration
    knowledge: Knowledge
    modes: ModalTable
    rigid: RigidLimit
    held_out: tuple[HoldOut, ...]
    hoses: HosePresence | None = None

    __repr__ = short_repr

    @property
    def table(self) -> pd.DataFrame:
        """Mass, centre, inertia, stiffness and gain with their standard deviations."""
        identified = quantities(self.calibrated.model)
        return pd.DataFrame(
            {
                "quantity": identified.names,
                "unit": identified.units,
                "value": identified.values,
                "standard deviation": quantity_deviations(self.calibrated),
            }
        )

    @property
    def alarms(self) -> tuple[str, ...]:
        """Reasons not to trust the model, in words; empty where there are none."""
        alarms = [f"{doubt[:1].upper()}{doubt[1:]}." for doubt in self.test.doubts]
        if self.hoses is not None and self.hoses.visible:
            alarms.append(self.hoses.statement)
        if self.calibrated.reduced_chi > ALARM:
            alarms.append(
                f"The residuals are {self.calibrated.reduced_chi:.2f} times the noise (alarm at "
                f"{ALARM:g}): a flexible receiver, hoses, or mounts that differ in their gain. The "
                "stiffness is that of the mounts with what carries them."
            )
        for check in self.held_out:
            if check.reduced_chi > ALARM:
                alarms.append(
                    f"Held out, {check.what} are missed by {check.reduced_chi:.2f} times the noise "
                    f"(alarm at {ALARM:g}), {PERCENT * check.relative_error:.1f} % of their size."
                )
        off = misplaced(self.calibrated, self.test.tolerances)
        if off:
            alarms.append(
                f"Further from the sheet than its tolerances allow: {', '.join(off[:4])}"
                + (f" and {len(off) - 4} more." if len(off) > 4 else ".")
            )
        if not self.rigid.is_rigid:
            alarms.append(self.rigid.statement)
        if not self.calibrated.converged:
            alarms.append("The self-calibration stopped before it converged.")
        return tuple(alarms)


def misplaced(calibration: SelfCalibration, tolerances: PlacementTolerances) -> tuple[str, ...]:
    """Name what lies over 5 σ off the sheet, such as ``A3 position y (-56 σ)``, worst first."""
    scores: RealArray = calibration.errors / calibration.placement.deviations(tolerances)
    worst = np.argsort(-np.abs(scores))
    return tuple(
        f"{calibration.placement.names[n]} ({scores[n]:+.0f} σ)"
        for n in worst
        if abs(scores[n]) > MISPLACED
    )
