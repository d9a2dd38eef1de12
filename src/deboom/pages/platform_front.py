"""The front of a platform's mount stiffnesses, with what a page says of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.explore.choices import Pick
from deboom.explore.front import thinned, unbeaten
from deboom.explore.result import Front
from deboom.explore.robust import RobustValues, chosen
from deboom.files.uncertain_index import uncertain_index
from deboom.measurement.channels import LoadCase
from deboom.pages.front import PANELS
from deboom.pages.motion import MotionReport, factor_name, motion_report
from deboom.physics.dynamic_stiffness import N_PER_MM
from deboom.plot.style import vehicle_colours
from deboom.vehicles.booming_model import BoomingModel, Motion
from deboom.vehicles.design_factor import Factor
from deboom.vehicles.expected_change import ExpectedChange, expected_or_why, half_width_of_others
from deboom.vehicles.fleet_front import FleetFront
from deboom.vehicles.free_directions import DirectionFreedom, free_directions
from deboom.vehicles.limits import mount_price
from deboom.vehicles.platform import Platform, Runs

TELLING = 0.9
"""Share of the change that the parts named on top bring alone, at least [1]."""


AT_THE_EDGE = 0.005
"""Distance from a bound of the search at which a factor lies there [1]."""


FURTHER = 0.1
"""How much further than the search a factor at its edge is tried [1]."""


DRAWN_OF_PRESCRIBED = 40
"""Designs of the front of prescribed motion that are judged anew where a fleet is wide."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PlatformFront:
    """The front of a platform's mount stiffnesses, and what its report needs beside it.

    Levels are those of the first load case; objectives are those of all.

    Parameters
    ----------
    front : Front
        The front, verified.
    runs : Runs
        Platform, vehicles and load cases of the search.
    every : BoomingModel or None
        The same model in all load cases of the platform; None where they do not allow it.
    prescribed : Front or None
        The same search with prescribed motion.
    target : float or None
        Level that cars shall not exceed [dB(A)]; None: the target of each ear, or its level of
        today.
    run : str
        Folder of the run, for the commands that come next.
    """

    front: Front
    runs: Runs
    every: BoomingModel | None = None
    prescribed: Front | None = None
    target: float | None = None
    run: str = "results/front/latest"

    @property
    def platform(self) -> Platform:
        """With the forces of the search, measured or from response surfaces."""
        return self.runs.platform

    @property
    def load_case(self) -> LoadCase:
        """The load case whose levels are shown."""
        return self.platform.load_case(self.index.load_case_names[0])

    @property
    def stiffness_variables(self) -> tuple[str, ...]:
        """Variables that are stiffness factors; loss factors come after them."""
        return tuple(name for mount in self.platform.mounts for name in mount.variables)

    @cached_property
    def motion_report(self) -> MotionReport:
        """What there is to say about motion and stiffness factors, checked at the picks."""
        return motion_report(self.index, np.stack(list(self.front.named_designs.values())))

    @property
    def index(self) -> BoomingModel:
        """The model of the search."""
        model = self.front.model
        assert isinstance(model, BoomingModel)
        return model

    @cached_property
    def fleet(self) -> FleetFront:
        """Levels and booming peaks of the load case that is shown."""
        return FleetFront(self.front, self.load_case.order)

    @property
    def best(self) -> RealArray:
        """Best-mean, shape (k,)."""
        return self.front.pick_designs[Pick.best_mean]

    @property
    def cars_target(self) -> RealArray:
        """Level that cars of each vehicle shall not exceed, shape (v,) [dB(A)]."""
        if self.target is None:
            targets = [self.index.receivers[ear].target for ear in self.fleet.ears]
            stated = np.array([np.nan if each is None else each for each in targets])
            return np.where(np.isnan(stated), self.fleet.todays_levels, stated)
        return np.full(len(self.fleet.vehicles), self.target)

    @property
    def expected(self) -> ExpectedChange | str:
        """Changes that ears of cars show of all picks, in their order; or why none is expected."""
        expected = self.expected_everywhere
        return expected if isinstance(expected, str) else expected.at(self.fleet.ears)

    @cached_property
    def expected_everywhere(self) -> ExpectedChange | str:
        """The same of all receivers, seats and wheels among them."""
        picks = np.stack(list(self.front.pick_designs.values()))
        weights = self.front.robust.weights
        return expected_or_why(
            self.index,
            lambda: uncertain_index(self.index, self.platform, self.runs.parts).expected_change(
                picks, weights=weights, seed=self.front.search.seed
            ),
        )

    @property
    def expected_of_best(self) -> ExpectedChange | str:
        """What is expected of best-mean; or why nothing is."""
        expected = self.expected
        return expected if isinstance(expected, str) else expected.of(self.row_of_best)

    @property
    def row_of_best(self) -> int:
        """Row of best-mean among the picks."""
        return list(self.front.pick_designs).index(Pick.best_mean)

    @property
    def unseen(self) -> float:
        """Half width by which the mean of further vehicles may differ, 90 % [dB]; nan of one."""
        return half_width_of_others(self.fleet.splv_change(self.best))

    @cached_property
    def with_prescribed_motion(self) -> float:
        """Mean change by best-mean if the powertrain's motion stays as measured [dB]."""
        loss = self.index.loss_factors
        model = (
            self.prescribed.model
            if self.prescribed is not None
            else self.runs.model(Motion.prescribed, self.index.factor, loss_factors=loss)
        )
        both = np.asarray(model(np.stack([self.front.robust.space.nominal, self.best])))
        change = (both[1] - both[0])[self.fleet.ears]
        return float(self.fleet.mean(change) / self.index.n_lines)

    @cached_property
    def evaluated_changes(self) -> RealArray:
        """Change of each vehicle by the designs that the search evaluated, (n, v) [dB]."""
        evaluated = self.front.search.evaluated
        today = self.front.robust(self.front.robust.space.nominal[np.newaxis]).mean
        kept = ~evaluated.failed
        changes = (evaluated.mean[kept] - today) / self.index.n_lines
        return np.asarray(changes[:, self.fleet.ears])

    @property
    def sigma_range(self) -> float:
        """By how much σ differs over the front, per vehicle and line [dB]."""
        return float(np.ptp(self.front.values.sigma_sum[self.front.nondominated])) * (
            self.front.per_line
        )

    def heard(self, designs: RealArray) -> ComplexArray:
        """Return the pressure of designs (n, k) at the ears of `fleet`, (n, v, f) [Pa]."""
        return self.index.pressure(designs)[:, self.fleet.ears]

    @property
    def colours(self) -> dict[str, str]:
        """Colour of each vehicle, the same on every page of the platform."""
        by_vehicle = vehicle_colours(self.platform.fleet.names)
        fleet = self.runs.fleet
        owners = zip(fleet.response_names, fleet.vehicle_of, strict=True)
        return by_vehicle | {name: by_vehicle[fleet.names[owner]] for name, owner in owners}

    @property
    def worst_vehicle(self) -> int:
        """Row of the vehicle that best-mean helps least."""
        return self.fleet.worst_vehicle(self.front.pick_designs[Pick.best_mean])

    @cached_property
    def nominal_stiffness(self) -> RealArray:
        """Mean |K| in the band at factor 1, of `stiffness_variables` [N/mm]; nan: not measured."""
        band = (float(self.fleet.frequency[0]), float(self.fleet.frequency[-1]))
        return self.runs.stiffness(self.load_case, band) * N_PER_MM

    @cached_property
    def bracket_softness(self) -> RealArray:
        """`nominal_stiffness` over the stiffness of the mounts' brackets; 0 without one [1]."""
        band = (float(self.fleet.frequency[0]), float(self.fleet.frequency[-1]))
        return self.runs.bracket_softness(self.load_case, band)

    @property
    def stiffness_state(self) -> str:
        """State that `nominal_stiffness` holds at, in words."""
        first, last = self.fleet.frequency[[0, -1]]
        return (
            f"the mean |K| in operation, {self.load_case.title}, {first:g}–{last:g} Hz; the "
            "supplier's sheet has N/mm at the state of its test; with a box it states its own band"
        )

    @cached_property
    def freedom(self) -> DirectionFreedom:
        """How far each variable may leave best-mean before a vehicle changes noticeably."""
        return free_directions(
            self.index,
            self.front.pick_designs[Pick.best_mean],
            self.front.robust.space,
            without_effect=self.front.without_effect,
        )

    @cached_property
    def build(self) -> RealArray:
        """What shall be built: best-mean, and today's part where it does as well, (k,) [1]."""
        build = self.freedom.with_todays_parts(self.best)
        build[self.telling] = self.best[self.telling]
        return build

    @cached_property
    def telling(self) -> list[int]:
        """Variables that bring `TELLING` of best-mean's change alone, the strongest first."""
        today, best = self.front.robust.space.nominal, self.front.pick_designs[Pick.best_mean]
        alone = np.where(np.eye(len(best), dtype=bool), best, today)
        order = np.argsort(
            [self.fleet.mean(self.fleet.splv_change(design)) for design in alone], kind="stable"
        )
        whole = self.fleet.mean(self.fleet.splv_change(best))
        columns = [int(column) for column in order]
        for count in range(1, len(columns)):
            if self.fleet.mean(self.only(columns[:count])) <= TELLING * whole:
                return columns[:count]
        return columns

    def only(self, columns: list[int]) -> RealArray:
        """Change of each vehicle if only some variables go to best-mean, shape (v,) [dB]."""
        design = self.front.robust.space.nominal.copy()
        design[columns] = self.front.pick_designs[Pick.best_mean][columns]
        return self.fleet.splv_change(design)

    def edges(self, design: RealArray) -> list[int]:
        """Variables with an effect whose factor lies at a bound of the search."""
        space = self.front.robust.space
        at = (design <= space.lower + AT_THE_EDGE) | (design >= space.upper - AT_THE_EDGE)
        free = np.isin(self.front.variables, self.front.without_effect)
        return [int(column) for column in np.flatnonzero(at & ~free)]

    @property
    def beyond(self) -> float:
        """What the telling variables at an edge bring, moved on by `FURTHER` [dB]."""
        space, best = self.front.robust.space, self.front.pick_designs[Pick.best_mean]
        moved = best.copy()
        for column in set(self.edges(best)) & set(self.telling):
            moved[column] += FURTHER if best[column] > space.nominal[column] else -FURTHER
        further = self.fleet.splv_change(moved) - self.fleet.splv_change(best)
        return float(self.fleet.mean(further))

    @cached_property
    def as_softer_rubber(self) -> float:
        """Mean change by best-mean if its factors mean the rubber alone [dB]; nan: not known."""
        if factor_name(self.index) == Factor.part.value or self.index.loss_factors:
            return float("nan")
        try:
            part = self.runs.model(Motion.coupled, Factor.part)
            both = part(
                np.stack([self.front.robust.space.nominal, self.front.pick_designs[Pick.best_mean]])
            )
        except InputError:
            return float("nan")
        change = (both[1] - both[0])[self.fleet.ears]
        return float(self.fleet.mean(change) / self.index.n_lines)

    @cached_property
    def price(self) -> pd.DataFrame | str:
        """Sag, travel and modes of today's design and the picks, or why they are not known."""
        designs = {
            name: x[: len(self.stiffness_variables)] for name, x in self.front.named_designs.items()
        }
        try:
            requirements = mount_price(self.runs, self.index.factor, at_idle=True)
            numbers = requirements(np.stack(list(designs.values())))
        except InputError as error:
            return str(error)
        labels = [f"{name} [{q.unit}]" for q in requirements.quantities for name in q.names]
        return pd.DataFrame({"number": labels, **dict(zip(designs, numbers, strict=True))})

    @cached_property
    def by_load_case(self) -> pd.DataFrame:
        """Change of the mean level by each pick in each load case and vehicle, no scatter [dB]."""
        if self.every is None:
            return pd.DataFrame()
        designs, rows = np.stack(list(self.front.named_designs.values())), []
        for name in self.every.load_case_names:
            level = self.every.levels(designs, name)[:, self.fleet.ears].mean(axis=2)
            for vehicle, changes in zip(self.fleet.vehicles, (level[1:] - level[0]).T, strict=True):
                rows.append(
                    {"load case": name, "vehicle": vehicle}
                    | dict(zip((f"{pick} [dB]" for pick in self.front.picks), changes, strict=True))
                )
        return pd.DataFrame(rows)

    @cached_property
    def judged_prescribed(self) -> dict[str, RobustValues]:
        """The front of prescribed motion as this model judges it, by its label."""
        if self.prescribed is None:
            return {}
        values = self.prescribed.values
        if len(self.fleet.vehicles) > PANELS:  # each design costs as long as vehicles are many
            values = chosen(values, np.flatnonzero(unbeaten(values)))
            values = thinned(values, DRAWN_OF_PRESCRIBED)
        values = self.front.judge(values.designs)
        rows = np.flatnonzero(unbeaten(values))
        rows = rows[np.argsort(values.mean_sum[rows], kind="stable")]
        return {"found with prescribed motion": chosen(values, rows)}
