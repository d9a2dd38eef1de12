"""The numbers of a specification sheet: what a supplier can quote, direction by direction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from deboom.files.solution_box import BoxVariable
from deboom.study.robust_front import N_PER_MM
from deboom.study.specification_sources import SpecificationSources
from deboom.study.supplier_certainty import SupplierCertainty
from deboom.study.supplier_curves import FREQUENCY, StiffnessCurve, loudest_line, preload_factor
from deboom.study.supplier_names import ShownNames
from deboom.study.supplier_study import Direction, Need, SupplierStudy

SAMPLE = 20
"""Measured parts for which the asked capability is stated."""
CONFIDENCE = 0.95
"""Of the bound of that capability [1]."""
NAN = float("nan")


@dataclass(frozen=True)
class MachineSetting:
    """One state of a direction in the load case: what a dynamic test machine is set to.

    Parameters
    ----------
    preload_label : str
        ``static force [N]`` or ``wheel torque [N m]``; empty where there is none.
    preload : float
        [unit of the label]; nan without one.
    frequency, amplitude : float
        [Hz, m peak].
    stiffness : float
        Today's, magnitude [N/mm]; nan where the direction is not identified.
    loss_factor : float
        Today's [1]; likewise.
    """

    preload_label: str
    preload: float
    frequency: float
    amplitude: float
    stiffness: float
    loss_factor: float


@dataclass(frozen=True, eq=False)
class SpecifiedDirection:
    """What is asked of one direction.

    Parameters
    ----------
    direction : Direction
    box : BoxVariable or None
        Interval of its stiffness factor; None without a box.
    set_by_limit : str
        Which ends the limit sets: ``from``, ``to``, both, ``neither``; empty: not known.
    best : float
        Factor of the design of the front; nan where nothing is asked [1].
    tolerance : float
        Wanted half width of the scatter about it, three standard deviations [1].
    today : float
        Mean magnitude of today's stiffness that factors are of [N/mm]; nan: not identified, or
        not measured.
    half_width : float
        Of its 90 % interval, relative [1].
    setting : MachineSetting or None
        None where the load case has no state.
    capability : float
        Cpk that is asked of the process; nan without a box [1].
    """

    direction: Direction
    box: BoxVariable | None
    set_by_limit: str
    best: float
    tolerance: float
    today: float
    half_width: float
    setting: MachineSetting | None
    capability: float

    @property
    def limited(self) -> bool:
        """Whether the box has an interval for it that means something."""
        return self.box is not None and self.box.required

    @property
    def ends(self) -> tuple[float, float]:
        """Ends of its interval, factors; nan without one [1]."""
        if self.box is None or not self.box.required:
            return NAN, NAN
        return self.box.lower, self.box.upper

    @property
    def scatter_fits(self) -> bool | None:
        """Whether the wanted value with its tolerance lies inside; None: nothing to compare."""
        low, high = self.ends
        if not np.isfinite([low, self.best, self.tolerance]).all():
            return None
        return low <= self.best * (1.0 - self.tolerance) and (
            self.best * (1.0 + self.tolerance) <= high
        )


@dataclass(frozen=True, eq=False)
class SpecificationSheet:
    """All numbers of the sheet.

    Parameters
    ----------
    study : SupplierStudy
    sources : SpecificationSources
    directions : tuple of SpecifiedDirection
        That are shown.
    names : ShownNames
        Of the vehicles.
    """

    study: SupplierStudy
    sources: SpecificationSources
    directions: tuple[SpecifiedDirection, ...]
    names: ShownNames

    @property
    def mounts(self) -> tuple[str, ...]:
        """Names of the mounts that are shown."""
        return tuple(dict.fromkeys(one.direction.mount.name for one in self.directions))


def specification_sheet(
    study: SupplierStudy,
    sources: SpecificationSources,
    directions: Sequence[Direction],
    curves: Sequence[StiffnessCurve],
    sure: SupplierCertainty,
    names: ShownNames,
) -> SpecificationSheet:
    """Put the pieces of a sheet together.

    Parameters
    ----------
    study : SupplierStudy
    sources : SpecificationSources
        Of this study.
    directions : sequence of Direction
        That are shown.
    curves : sequence of StiffnessCurve
        Of these.
    sure : SupplierCertainty
        Of the study.
    names : ShownNames
        Of the vehicles.
    """
    by_name = {curve.direction.name: curve for curve in curves}
    frequency = loudest_line(study)
    found = tuple(
        _specified(study, sources, one, by_name.get(one.name), frequency, sure)
        for one in directions
    )
    return SpecificationSheet(study, sources, found, names)


def asked_capability(share: float, n_axes: int) -> float:
    """Return the Cpk per axis with which a share of the pieces lies inside in all axes [1].

    Parameters
    ----------
    share : float
        Between 0 and 1 [1].
    n_axes : int
        Limited axes of a part.

    Notes
    -----
    ``2Φ(3 Cpk) − 1 ≥ share^(1/n)``: of a normal process with this Cpk at least so much lies inside,
    and independent axes are the worst case of correlated ones (Šidák, J. Am. Stat.
    Assoc. 62 (1967) 626).
    """
    return float(norm.ppf(0.5 * (1.0 + share ** (1.0 / n_axes))) / 3.0)


def measured_capability(asked: float, n_parts: int, confidence: float) -> float:
    """Return the Cpk that a sample must show so that its lower bound is the asked one [1].

    Parameters
    ----------
    asked : float
        [1].
    n_parts : int
        Measured, more than 2.
    confidence : float
        Of the one-sided bound [1].

    Notes
    -----
    The bound of `deboom.explore.process_capability.capability`, solved for the sample's value.
    """
    z = float(norm.ppf(confidence))
    a = 1.0 - z**2 / (2.0 * (n_parts - 1))
    c = asked**2 - z**2 / (9.0 * n_parts)
    return float((asked + np.sqrt(asked**2 - a * c)) / a)


def _specified(
    study: SupplierStudy,
    sources: SpecificationSources,
    direction: Direction,
    curve: StiffnessCurve | None,
    frequency: float,
    sure: SupplierCertainty,
) -> SpecifiedDirection:
    column, known = direction.column, direction.need is not Need.unknown
    asked = direction.need in (Need.wanted, Need.anything)
    place = study.directions.index(direction)
    today = float(sure.stiffness.value[place]) * N_PER_MM
    half_width = float(sure.stiffness.half_width[place] / sure.stiffness.value[place])
    tolerance = float(study.space.tolerance[column])
    if sources.tolerances is not None:
        allocated = sources.tolerances.directions["cheapest ± [%]"]
        tolerance = float(allocated.get(direction.name, 100.0 * tolerance)) / 100.0
    variable, ends, capability = None, "", NAN
    if sources.box is not None:
        box = sources.box.box
        variable = box.variable(direction.name)
        ends = sources.box.set_by_limit.get(direction.name, "")
        if variable.reference_stiffness is not None:
            today = variable.reference_stiffness * N_PER_MM
        own = [v for v in study.of(direction.mount.name) if box.variable(v.name).required]
        if variable.required:
            capability = asked_capability(box.share_stated, len(own))
    return SpecifiedDirection(
        direction,
        variable,
        ends,
        best=float(study.wanted[column]) if asked else NAN,
        tolerance=tolerance if asked else NAN,
        today=today if known else NAN,
        half_width=half_width,
        setting=_setting(study, curve, frequency) if curve else None,
        capability=capability,
    )


def _setting(
    study: SupplierStudy, curve: StiffnessCurve, frequency: float
) -> MachineSetting | None:
    """Return the state nearest to a frequency in the first load case."""
    if curve.n_first == 0:
        return None
    line = int(np.argmin(np.abs(curve.frequency[: curve.n_first] - frequency)))
    has_preload = curve.label != FREQUENCY
    loss, known = float(curve.loss_factor[line]), curve.direction.need is not Need.unknown
    return MachineSetting(
        preload_label=curve.label if has_preload else "",
        preload=preload_factor(study, curve) * float(curve.preload[line]) if has_preload else NAN,
        frequency=float(curve.frequency[line]),
        amplitude=float(curve.amplitude[line]),
        stiffness=float(curve.stiffness[line]) if known else NAN,
        loss_factor=loss if known and loss > 0.0 else NAN,
    )


def shared_vehicles(names: ShownNames, vehicles: str) -> str:
    """Return the shown names of vehicles in a list; those that have none are counted.

    Parameters
    ----------
    names : ShownNames
    vehicles : str
        Own names, with commas.
    """
    own = [name.strip() for name in vehicles.split(",")]
    known: Mapping[str, str] = names.vehicles
    if not names.anonymous:
        return ", ".join(known.get(name, name) for name in own)
    shown = [known[name] for name in own if name in known]
    others = len(own) - len(shown)
    counted = [f"{others} other{'s' if others > 1 else ''}"] if others else []
    return ", ".join([*shown, *counted])
