"""What the supplier's page is made of, and its figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from deboom.report import figures
from deboom.report.figures import IndexBars
from deboom.report.style import MUTED, mount_colours, vehicle_colours
from deboom.study.motion_report import MotionReport
from deboom.study.specification_sheet import SpecificationSheet
from deboom.study.supplier_curves import StiffnessCurve, stiffness_panels
from deboom.study.supplier_effects import ALL, SupplierEffects
from deboom.study.supplier_names import ShownNames
from deboom.study.supplier_study import Direction, Need, SupplierStudy


@dataclass(frozen=True, eq=False)
class SupplierContent:
    """All that the page is made of.

    Parameters
    ----------
    effects : SupplierEffects
        Of all parts.
    mount : str or None
        The one that the page is about; None: all.
    directions : tuple of Direction
        That are shown.
    curves : tuple of StiffnessCurve
        Of these.
    names : ShownNames
        Of the vehicles.
    tables : mapping of str to DataFrame
        By sheet of the workbook.
    motion : MotionReport
        Models behind the levels, checked at today's and the wanted design.
    sheet : SpecificationSheet
        What can be quoted.
    """

    effects: SupplierEffects
    mount: str | None
    directions: tuple[Direction, ...]
    curves: tuple[StiffnessCurve, ...]
    names: ShownNames
    tables: Mapping[str, pd.DataFrame]
    motion: MotionReport
    sheet: SpecificationSheet

    @property
    def study(self) -> SupplierStudy:
        """What is asked for."""
        return self.effects.study

    @property
    def mounts(self) -> tuple[str, ...]:
        """Names of the mounts that are shown."""
        return tuple(dict.fromkeys(direction.mount.name for direction in self.directions))

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Shown names of the vehicles."""
        return tuple(self.names(vehicle) for vehicle in self.study.vehicles)


def supplier_figures(content: SupplierContent) -> dict[str, bytes]:
    """Draw all pictures of the page; file stem → PNG."""
    study, effects = content.study, content.effects
    colours = mount_colours([mount.name for mount in study.platform.mounts])
    found = effects.importance
    columns = [direction.column for direction in content.directions]
    own = [colours[direction.mount.name] for direction in content.directions]
    labels = [direction.name for direction in content.directions]
    pictures = {}
    for mount in content.mounts:
        curves = [one for one in content.curves if one.direction.mount.name == mount]
        if curves:
            panels = stiffness_panels(study, curves)
            pictures[f"stiffness {mount}"] = figures.stiffness_over_preload(panels, colours[mount])
    pictures["parts"] = figures.part_effects(
        content.vehicles,
        {f"only {mount}": effects.change[mount] for mount in content.mounts},
        {f"only {mount}": effects.half_width[mount] for mount in content.mounts},
        effects.change[ALL],
        {f"only {mount}": colours[mount] for mount in content.mounts},
        x_label="change of the mean level [dB]",
        together_label=f"{ALL} as wanted",
    )
    if content.mount is not None:
        pictures["levels"] = _levels(content, content.mount)
    pictures["importance"] = figures.index_bars(
        labels,
        own,
        [
            IndexBars(
                vehicle,
                found.first[columns, place],
                found.total[columns, place],
                found.total_interval[columns, place],
                found.zero[columns, place],
            )
            for place, vehicle in enumerate(content.vehicles)
        ],
        x_label="share of the variance [1]",
    )
    worth = content.tables["tolerances"]
    asked = [direction.need is not Need.nothing for direction in content.directions]
    pictures["tolerances"] = figures.tolerance_worth(
        labels,
        worth["share of sigma [%]"],
        worth["sigma saved per % tighter [0.001 dB]"],
        [colour if need else MUTED for colour, need in zip(own, asked, strict=True)],
    )
    return pictures


def _levels(content: SupplierContent, mount: str) -> bytes:
    study, design = content.study, content.effects.designs[mount]
    case, _ = study.load_cases[0]
    before, after = content.effects.levels(design)
    peaks = content.effects.peaks(design)
    colours = vehicle_colours(study.platform.fleet.names)
    return figures.spl_curves(
        np.asarray(study.index.frequency),
        case.order,
        before,
        after,
        content.vehicles,
        [[c.before.frequency for c in peaks[v] if c.before] for v in study.vehicles],
        [[c.after.frequency for c in peaks[v] if c.after] for v in study.vehicles],
        {content.names(vehicle): colours[vehicle] for vehicle in study.vehicles},
    )
