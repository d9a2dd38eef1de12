"""The report of a robust front: numbers, tables, figures, page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from deboom import plot as figures
from deboom.arrays import RealArray
from deboom.explore.front import Verification, verification_response
from deboom.explore.problems import SearchResult
from deboom.explore.robust import RobustResponse, RobustValues
from deboom.explore.selection import (
    at_nominal,
    indifference_intervals,
    pick,
    variables_without_effect,
)
from deboom.files.platform import Platform
from deboom.measurement.channels import LoadCase
from deboom.mounts.mount import mean_operating_stiffness
from deboom.plot.style import mount_colours, signed, vehicle_colours
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.study.options import aim_note
from deboom.study.platform_model import MotionReport, factor_name, motion_name, motion_report
from deboom.study.result import Scalar, StudyResult
from deboom.vehicles.booming_model import LoadCaseIndex, LossFactorIndex, mean_energy_level
from deboom.vehicles.booming_peaks import PeakChange, compare_peaks

ENERGY_BAND = (25.0, 40.0)
"""Band of the energy level that stands beside SPLV [Hz]."""
NOTICEABLE = 0.1
"""Change of the mean level of the lines that counts as noticeable [dB]."""
N_PER_MM = 1e-3
"""From N/m to N/mm."""


@dataclass(frozen=True, eq=False)
class RobustFront:
    """A search over a platform's mounts, verified, with everything its report needs.

    Levels are those of the first load case; objectives are those of all.

    Parameters
    ----------
    platform : Platform
        As measured.
    index : LoadCaseIndex
        What was evaluated.
    robust : RobustResponse
        How it was made robust.
    search : SearchResult
        What was found.
    verification : Verification
        The found front, re-evaluated.
    note : str
        What else there is to say about the search.
    """

    platform: Platform
    index: LoadCaseIndex[Any, Any] | LossFactorIndex
    robust: RobustResponse
    search: SearchResult
    verification: Verification
    note: str = ""

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names of the vehicles the search served."""
        return self.index.response_names

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of the design variables."""
        return self.index.variable_names

    @property
    def load_case(self) -> LoadCase:
        """The load case whose levels are shown."""
        return self.platform.load_case(self.index.load_case_names[0])

    @property
    def model(self) -> LoadCaseIndex[Any, Any]:
        """The model of the motion; behind loss factors it is that of the split stiffnesses."""
        return self.index.split if isinstance(self.index, LossFactorIndex) else self.index

    @property
    def stiffness_variables(self) -> tuple[str, ...]:
        """Variables that are stiffness factors; loss factors come after them."""
        return tuple(name for mount in self.platform.mounts for name in mount.variables)

    @property
    def named_designs(self) -> dict[str, RealArray]:
        """Today's design and the picks, each of shape (n_variable,) [1]."""
        return {"today's": self.robust.space.nominal, **self.pick_designs}

    @property
    def motion(self) -> str:
        """In a word, how the powertrain answers a design."""
        return motion_name(self.model)

    @property
    def facts(self) -> dict[str, str | int]:
        """What ``run.json`` says beside the arguments."""
        sample = self.robust.sample
        return {
            "motion": self.motion,
            "design_factor": factor_name(self.model),
            "kernel": self.index.kernel.name,
            "objectives": "; ".join(objective.name for objective in self.robust.objectives),
            "estimator": self.robust.estimator.kind,
            "tolerance_sample": sample.kind,
            "tolerance_draws": sample.n_samples,
            "verification_draws": self.verification.n_samples,
        }

    @cached_property
    def motion_report(self) -> MotionReport:
        """What there is to say about motion and stiffness factors, checked at the picks."""
        designs = np.stack([self.robust.space.nominal, *self.pick_designs.values()])
        return motion_report(self.model, designs)

    @property
    def frequency(self) -> RealArray:
        """Lines of the band, shape (n_frequency,) [Hz]."""
        return np.asarray(self.index.frequency)

    @property
    def per_line(self) -> float:
        """Factor from a sum over vehicles and lines to the mean over both [1]."""
        return 1.0 / (self.index.n_lines * len(self.vehicles))

    @cached_property
    def without_effect(self) -> tuple[str, ...]:
        """Variables that no vehicle's SPLV depends on."""
        return variables_without_effect(self.index, self.robust.space)

    @cached_property
    def picks(self) -> dict[str, int]:
        """Rows of the front by name of the pick, chosen on verified values."""
        rows = pick(self.verification.values)
        return {
            "best mean": rows.best_mean,
            "best sigma": rows.best_sigma,
            "knee": rows.knee,
        }

    @cached_property
    def pick_designs(self) -> dict[str, RealArray]:
        """Design of each pick, shape (n_variable,); variables without effect are at nominal [1]."""
        designs = at_nominal(
            self.verification.values.designs, self.robust.space, self.without_effect
        )
        return {name: designs[row] for name, row in self.picks.items()}

    @cached_property
    def _verified_response(self) -> RobustResponse:
        check = self.verification
        return verification_response(self.robust, check.n_samples, seed=check.seed)

    @cached_property
    def baseline(self) -> RobustValues:
        """The nominal design under the verification's draws; one row."""
        return self._verified_response(self.robust.space.nominal[np.newaxis, :])

    def shown_levels(self, design: RealArray) -> RealArray:
        """SPL of one design without scatter, shape (n_vehicle, n_frequency) [dB(A)]."""
        return np.asarray(self.index.levels(design[np.newaxis, :])[0])

    def splv_change(self, design: RealArray) -> RealArray:
        """Change of SPLV over the number of lines, shape (n_vehicle,) [dB]."""
        both = self.index(np.stack([self.robust.space.nominal, design]))
        return np.asarray((both[1] - both[0]) / self.index.n_lines)

    def energy_change(self, design: RealArray) -> RealArray:
        """Change of the mean energy level of `ENERGY_BAND`, shape (n_vehicle,) [dB]."""
        nominal = self.robust.space.nominal
        before, after = (
            mean_energy_level(self.shown_levels(x), self.frequency, ENERGY_BAND)
            for x in (nominal, design)
        )
        return np.asarray(after - before)

    def energy_sigma(self, design: RealArray) -> RealArray:
        """Scatter of the energy level over the verification's draws, shape (n_vehicle,) [dB]."""
        made = self._verified_response.made(design)
        level = self.index.levels(made)
        energy = mean_energy_level(level, self.frequency, ENERGY_BAND)
        return np.asarray(energy.std(axis=0, ddof=1))

    def peak_changes(self, design: RealArray) -> dict[str, tuple[PeakChange, ...]]:
        """Booming peaks of each vehicle at nominal and in one design."""
        before, after = self.shown_levels(self.robust.space.nominal), self.shown_levels(design)
        return {
            name: compare_peaks(before[row], after[row], self.frequency, self.load_case.order)
            for row, name in enumerate(self.vehicles)
        }

    @cached_property
    def nominal_stiffness(self) -> RealArray:
        """Mean |K| over the band at factor 1, shape (n_variable,) [N/mm]; nan: not measured."""
        band = (float(self.frequency[0]), float(self.frequency[-1]))
        by_mount = [
            mean_operating_stiffness(mount, self.load_case, band) for mount in self.platform.mounts
        ]
        return np.concatenate(by_mount) * N_PER_MM

    @cached_property
    def indifference(self) -> RealArray:
        """Interval of each variable around best mean without a noticeable change, shape (k, 2)."""
        change = NOTICEABLE * self.index.n_lines
        return np.column_stack(
            indifference_intervals(self.robust, self.pick_designs["best mean"], change)
        )


TERMS = (
    "booming noise",
    "SPL",
    "SPLV",
    "booming peak",
    "stiffness factor",
    "dynamic stiffness",
    "tolerance",
    "σ",
    "Pareto front",
    "knee",
    "no requirement",
    "no noticeable difference",
    "noise transfer function",
    "prescribed motion",
)

PEAK_COLUMNS = (
    "vehicle",
    "frequency before [Hz]",
    "speed before [rpm]",
    "SPL before [dB(A)]",
    "prominence before [dB]",
    "frequency after [Hz]",
    "SPL after [dB(A)]",
    "change [dB]",
)
STIFFNESS_COLUMNS = (
    "variable",
    "nominal [N/mm]",
    "best mean [N/mm]",
    "best mean from [N/mm]",
    "best mean to [N/mm]",
    "best sigma [N/mm]",
    "knee [N/mm]",
    "requirement",
)


def front_figures(study: RobustFront) -> dict[str, bytes]:
    """Draw all pictures of the page; file stem → PNG."""
    values, scale = study.verification.values, study.per_line
    design = study.pick_designs["best mean"]
    nominal = study.robust.space.nominal
    all_vehicles = vehicle_colours(study.platform.fleet.names)
    peaks = study.peak_changes(design)
    row, n_lines = study.picks["best mean"], study.index.n_lines
    n_stiffness = len(study.stiffness_variables)
    low, high = (f"{edge:g}" for edge in ENERGY_BAND)
    first, last = study.frequency[0], study.frequency[-1]
    return {
        "pareto_front": figures.pareto_front(
            values.mean_sum * scale,
            values.sigma_sum * scale,
            values.standard_error_mean_sum * scale,
            values.standard_error_sigma_sum * scale,
            (float(study.baseline.mean_sum[0]) * scale, float(study.baseline.sigma_sum[0]) * scale),
            {
                name: (float(values.mean_sum[at]) * scale, float(values.sigma_sum[at]) * scale)
                for name, at in study.picks.items()
            },
            mean_label="mean level over vehicles and lines [dB(A)]",
            sigma_label="its σ over the tolerance [dB]",
        ),
        "spl_curves": figures.spl_curves(
            study.frequency,
            study.load_case.order,
            study.shown_levels(nominal),
            study.shown_levels(design),
            study.vehicles,
            [[c.before.frequency for c in peaks[v] if c.before] for v in study.vehicles],
            [[c.after.frequency for c in peaks[v] if c.after] for v in study.vehicles],
            all_vehicles,
        ),
        "stiffness_bars": figures.stiffness_bars(
            study.stiffness_variables,
            design[:n_stiffness],
            study.robust.space.lower[:n_stiffness],
            study.robust.space.upper[:n_stiffness],
            study.nominal_stiffness,
            [name in study.without_effect for name in study.stiffness_variables],
            study.indifference[:n_stiffness],
            mount_colours([mount.name for mount in study.platform.mounts]),
            stiffness_label=f"mean |K|, {first:g}–{last:g} Hz [N/mm]",
        ),
        "per_vehicle_change": figures.per_vehicle_change(
            study.vehicles,
            study.splv_change(design),
            values.sigma[row] / n_lines,
            study.energy_change(design),
            study.energy_sigma(design),
            all_vehicles,
            level_label="change of the mean level [dB]",
            energy_label=f"change of energy {low}–{high} Hz [dB]",
        ),
        "convergence": figures.convergence(
            np.arange(1, study.search.hypervolume.size + 1),
            study.search.hypervolume * scale**2,
            hypervolume_label="hypervolume [dB²]",
        ),
    }


def front_page(
    study: RobustFront, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Page:
    """Compose the page from the study's tables and figures."""
    check, search = study.verification, study.search
    changes = study.splv_change(study.pick_designs["best mean"])
    peaks = tables["peaks"]["change [dB]"]
    sigma_drop = tables["picks"]["change of sigma [%]"].min()
    motion = study.motion_report
    first, last = study.frequency[0], study.frequency[-1]
    sampler = study.robust.sample
    half = study.robust.space.tolerance.max()
    cases = ", ".join(
        f"{study.platform.load_case(case.load_case).title} (weight {weight:.3g})"
        for case, weight in zip(study.index.contributions, study.index.weights, strict=True)
    )
    return Page(
        title="Robust mount stiffnesses",
        question=(
            f"Which stiffnesses make {_listed(study.vehicles)} quiet between {first:g} and "
            f"{last:g} Hz, and keep them quiet when parts scatter within ±{100 * half:.0f} %?"
        ),
        headlines=(
            Headline(
                f"{signed(float(changes.min()), 1)} … {signed(float(changes.max()), 1)} dB",
                "mean level per vehicle, best mean",
            ),
            Headline(f"{signed(float(peaks.min()), 1)} dB", "largest fall of a booming peak"),
            Headline(f"{signed(float(sigma_drop), 0)} %", "scatter σ, best sigma"),
            Headline(
                f"{signed(check.sigma_bias_percent, 1)} %",
                "bias of the search's σ, verified",
            ),
        ),
        terms=tuple(motion.terms.get(term, term) for term in TERMS),
        warnings=tuple(filter(None, (*motion.warnings, sampler.warning))),
        sections=(
            Section(
                "What was asked, and with which data",
                f"{study.platform.title}: {study.platform.description}\n\n"
                f"Vehicles: {_listed(study.vehicles)}. Load cases: {cases}. Lines: "
                f"{study.index.n_lines} between {first:g} and {last:g} Hz, engine order "
                f"{study.load_case.order:g}.\n\n"
                f"Design variables: {len(study.variables)} {_factors(study)}, each between "
                f"{study.robust.space.lower.min():g} and {study.robust.space.upper.max():g}. "
                f"Manufacturing scatter: ±{100 * half:.0f} % of the design's own stiffness as "
                f"three standard deviations, {sampler.n_samples} draws ({sampler.kind}).\n\n"
                "Two objectives, both as small as possible: the sum over the vehicles of the mean "
                "SPLV, and the sum of its standard deviation σ. The figures show both divided by "
                "the number of vehicles and lines, so that they read as dB of one line.",
            ),
            Section(
                "The front",
                f"{search.n_evaluated} designs were evaluated, {search.n_failed} failed; "
                f"{len(search.front)} are on the front. All points shown were evaluated again with "
                f"{check.n_samples} independent draws: the search had its σ wrong by "
                f"{signed(check.sigma_bias_percent, 2)} % and its mean by "
                f"{signed(check.mean_bias * study.per_line, 3)} dB on average.",
                figures=(
                    _picture(
                        pictures,
                        "pareto_front",
                        "Both objectives of every design of the front, with today's mounts and "
                        "the named picks. Bars are ± one standard error as if the draws were "
                        "independent, an upper bound for Sobol draws.",
                    ),
                ),
                tables=(
                    Table(
                        tables["picks"],
                        "Today's mounts and the named designs, per vehicle and line.",
                        {"mean level [dB(A)]": 2, "sigma of the level [dB]": 3},
                    ),
                ),
            ),
            Section(
                "What the driver hears",
                f"{study.load_case.title}. Best mean against today's mounts, without scatter.",
                figures=(
                    _picture(
                        pictures,
                        "spl_curves",
                        "Sound pressure level at the driver's ear, one panel per vehicle: "
                        "frequency below, engine speed above.",
                    ),
                ),
                tables=(
                    Table(
                        tables["peaks"][list(PEAK_COLUMNS)],
                        "Booming peaks: local maxima with a prominence of 6 dB or more, before and "
                        "after. A dash: no such peak within 1.5 Hz any more, the level is the "
                        "highest one there.",
                        {"prominence before [dB]": 1, "change [dB]": 1},
                    ),
                ),
            ),
            Section(
                "What the supplier should build",
                "The stiffnesses of best mean within their bounds, and beside them those of the "
                "other picks. Nominal is the mean magnitude of the dynamic stiffness measured in "
                f"operation ({study.load_case.title}).",
                figures=(
                    _picture(
                        pictures,
                        "stiffness_bars",
                        "Chosen stiffness of every mount and axis. The thin bracket spans the "
                        f"range within which the mean level stays within {NOTICEABLE} dB.",
                    ),
                ),
                tables=(
                    Table(
                        tables["stiffness"][list(STIFFNESS_COLUMNS)],
                        "Stiffnesses of the named designs. From and to: the range around best mean "
                        f"within which the mean level stays within {NOTICEABLE} dB.",
                        {c: 0 for c in STIFFNESS_COLUMNS if c.endswith("[N/mm]")},
                    ),
                    *_loss_factors(tables),
                ),
            ),
            Section(
                "Per vehicle",
                "What best mean changes in each vehicle, and how much the manufacturing scatter "
                "moves it.",
                figures=(
                    _picture(
                        pictures,
                        "per_vehicle_change",
                        "Change against today's mounts; whiskers are ± one σ of the scatter.",
                    ),
                ),
                tables=(
                    Table(
                        tables["vehicles"],
                        "Before: today's mounts; after: best mean. Levels are means over the lines "
                        "and over the scatter, changes are those of the designs without scatter; "
                        f"energy is that of {ENERGY_BAND[0]:g} to {ENERGY_BAND[1]:g} Hz.",
                    ),
                ),
            ),
            Section(
                "How the search went",
                f"NSGA-II, {search.hypervolume.size} generations, {search.seconds:.1f} s. Motion: "
                f"{study.motion}; meaning of a stiffness factor: "
                f"{motion.summary['design_factor']}; kernel: {study.index.kernel.name}.\n\n"
                "\n\n".join((motion.text, aim_note(study.robust), study.note)).strip(),
                figures=(
                    _picture(
                        pictures,
                        "convergence",
                        "Hypervolume of the front over the generations; flat means that more "
                        "generations would not have helped.",
                    ),
                ),
            ),
        ),
    )


def _factors(study: RobustFront) -> str:
    """Say what the variables are."""
    if len(study.variables) == len(study.stiffness_variables):
        return "stiffness factors"
    return "factors of stiffness (K' and K'' alike) and of loss (K'' alone, exactly made)"


def _loss_factors(tables: Mapping[str, pd.DataFrame]) -> tuple[Table, ...]:
    if "loss_factors" not in tables:
        return ()
    return (
        Table(
            tables["loss_factors"],
            "Factors on the loss factor K''/K' at unchanged K'; a dash: no requirement.",
        ),
    )


def _picture(pictures: Mapping[str, bytes], stem: str, caption: str) -> Picture:
    return Picture(pictures[stem], alt=caption, caption=caption)


def _listed(names: tuple[str, ...]) -> str:
    if len(names) == 1:
        return names[0]
    return f"{', '.join(names[:-1])} and {names[-1]}"


NO_REQUIREMENT = "no requirement"


def front_table(study: RobustFront) -> pd.DataFrame:
    """One row per design of the front: objectives as searched and as verified."""
    front, check = study.search.front, study.verification
    names = {row: name for name, row in reversed(study.picks.items())}
    return pd.DataFrame(
        {
            "point": np.arange(1, len(front) + 1),
            "pick": [names.get(row, "") for row in range(len(front))],
            "SPLV mean sum [dB(A)]": check.values.mean_sum,
            "SPLV sigma sum [dB]": check.values.sigma_sum,
            "standard error of mean sum [dB]": check.values.standard_error_mean_sum,
            "standard error of sigma sum [dB]": check.values.standard_error_sigma_sum,
            "SPLV mean sum in search [dB(A)]": front.mean_sum,
            "SPLV sigma sum in search [dB]": front.sigma_sum,
            "non-dominated when verified": check.nondominated,
        }
    )


def design_table(study: RobustFront) -> pd.DataFrame:
    """One row per design of the front: its stiffness factors."""
    designs = study.search.front.designs
    columns = {f"{name} [1]": designs[:, place] for place, name in enumerate(study.variables)}
    return pd.DataFrame({"point": np.arange(1, len(designs) + 1), **columns})


def convergence_table(study: RobustFront) -> pd.DataFrame:
    """One row per generation: hypervolume of the front so far, as the search saw it."""
    volume = study.search.hypervolume
    return pd.DataFrame({"generation": np.arange(1, len(volume) + 1), "hypervolume [dB²]": volume})


def per_vehicle_table(study: RobustFront) -> pd.DataFrame:
    """One row per design of the front and vehicle, verified."""
    values, n_lines = study.verification.values, study.index.n_lines
    points, vehicles = np.meshgrid(np.arange(1, len(values) + 1), study.vehicles, indexing="ij")
    return pd.DataFrame(
        {
            "point": points.ravel(),
            "vehicle": vehicles.ravel(),
            "SPLV mean [dB(A)]": values.mean.ravel(),
            "SPLV sigma [dB]": values.sigma.ravel(),
            "mean level of the lines [dB(A)]": values.mean.ravel() / n_lines,
            "sigma of that level [dB]": values.sigma.ravel() / n_lines,
        }
    )


def pick_table(study: RobustFront) -> pd.DataFrame:
    """Baseline and named designs: both objectives, per vehicle and line."""
    rows = []
    base, values = study.baseline, study.verification.values
    for name, source, row in [
        ("baseline", base, 0),
        *((name, values, row) for name, row in study.picks.items()),
    ]:
        sigma = source.sigma_sum[row]
        rows.append(
            {
                "design": name,
                "mean level [dB(A)]": source.mean_sum[row] * study.per_line,
                "change [dB]": (source.mean_sum[row] - base.mean_sum[0]) * study.per_line,
                "sigma of the level [dB]": sigma * study.per_line,
                "change of sigma [%]": 100.0 * (sigma / base.sigma_sum[0] - 1.0),
            }
        )
    return pd.DataFrame(rows)


def stiffness_table(study: RobustFront) -> pd.DataFrame:
    """One row per stiffness factor: today's stiffness and that of each pick."""
    nominal, variables = study.nominal_stiffness, study.stiffness_variables
    designs = {name: design[: len(variables)] for name, design in study.pick_designs.items()}
    interval = study.indifference[: len(variables)]
    free = np.isin(variables, study.without_effect)
    table = {
        "variable": list(variables),
        "nominal [N/mm]": nominal,
    }
    for name, design in designs.items():
        table[f"{name} factor [1]"] = design
        table[f"{name} [N/mm]"] = nominal * design
    for column, end in (("from", 0), ("to", 1)):
        table[f"best mean {column} [N/mm]"] = np.where(free, np.nan, nominal * interval[:, end])
    lower, upper = (
        bounds[: len(variables)] for bounds in (study.robust.space.lower, study.robust.space.upper)
    )
    anywhere = (interval[:, 0] <= lower) & (interval[:, 1] >= upper)
    table["requirement"] = np.select(
        [free, anywhere], [NO_REQUIREMENT, "any in bounds"], "as chosen"
    )
    return pd.DataFrame(table)


def loss_factor_table(study: RobustFront) -> pd.DataFrame:
    """One row per loss factor that is a variable: its factor in each pick."""
    first = len(study.stiffness_variables)
    columns = {f"{name} factor [1]": x[first:] for name, x in study.pick_designs.items()}
    interval = study.indifference[first:]
    free = np.isin(study.variables[first:], study.without_effect)
    for column, end in (("from", 0), ("to", 1)):
        columns[f"best mean {column} [1]"] = np.where(free, np.nan, interval[:, end])
    return pd.DataFrame({"variable": list(study.variables[first:]), **columns})


def vehicle_change_table(study: RobustFront) -> pd.DataFrame:
    """One row per vehicle: what best mean changes, and how far the tolerance scatters it."""
    design = study.pick_designs["best mean"]
    row = study.picks["best mean"]
    values, n_lines = study.verification.values, study.index.n_lines
    return pd.DataFrame(
        {
            "vehicle": list(study.vehicles),
            "level before [dB(A)]": study.baseline.mean[0] / n_lines,
            "level after [dB(A)]": values.mean[row] / n_lines,
            "change [dB]": study.splv_change(design),
            "sigma before [dB]": study.baseline.sigma[0] / n_lines,
            "sigma after [dB]": values.sigma[row] / n_lines,
            "energy change [dB]": study.energy_change(design),
            "sigma of energy [dB]": study.energy_sigma(design),
        }
    )


def peak_table(study: RobustFront) -> pd.DataFrame:
    """Booming peaks at nominal and what became of them in best mean."""
    rows = []
    for vehicle, changes in study.peak_changes(study.pick_designs["best mean"]).items():
        for change in changes:
            before, after = change.before, change.after
            rows.append(
                {
                    "vehicle": vehicle,
                    "frequency before [Hz]": before.frequency if before else np.nan,
                    "speed before [rpm]": before.rpm if before else np.nan,
                    "SPL before [dB(A)]": change.level_before,
                    "prominence before [dB]": before.prominence if before else np.nan,
                    "frequency after [Hz]": after.frequency if after else np.nan,
                    "speed after [rpm]": after.rpm if after else np.nan,
                    "SPL after [dB(A)]": change.level_after,
                    "prominence after [dB]": after.prominence if after else np.nan,
                    "change [dB]": change.level_after - change.level_before,
                }
            )
    return pd.DataFrame(rows)


def front_summary(study: RobustFront) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    design = study.pick_designs["best mean"]
    changes = zip(
        study.vehicles, study.splv_change(design), study.energy_change(design), strict=True
    )
    summary: dict[str, Scalar] = {"n_front": len(study.search.front)}
    for vehicle, splv, energy in changes:
        summary[f"splv_change_db_per_line_{vehicle}"] = float(splv)
        summary[f"energy_25_40hz_change_db_{vehicle}"] = float(energy)
    check = study.verification
    best = study.picks["best sigma"]
    summary["sigma_change_percent_best_sigma"] = float(
        100.0 * (check.values.sigma_sum[best] / study.baseline.sigma_sum[0] - 1.0)
    )
    summary["sigma_bias_percent"] = check.sigma_bias_percent
    summary["mean_bias_db_per_line"] = check.mean_bias * study.per_line
    summary |= study.motion_report.summary
    summary["n_evaluated"] = study.search.n_evaluated
    summary["n_failed"] = study.search.n_failed
    summary["seconds_search"] = round(study.search.seconds, 3)
    return summary


def robust_front_result(study: RobustFront) -> StudyResult:
    """Make tables, figures, headline numbers and page of a robust front.

    Parameters
    ----------
    study : RobustFront
        Searched and verified.

    Returns
    -------
    StudyResult
        Tables ``front``, ``designs``, ``convergence``, ``per_vehicle``, ``picks``, ``stiffness``,
        ``vehicles``, ``peaks``; with loss factors as variables also ``loss_factors``.
    """
    tables = {
        "front": front_table(study),
        "designs": design_table(study),
        "convergence": convergence_table(study),
        "per_vehicle": per_vehicle_table(study),
        "picks": pick_table(study),
        "stiffness": stiffness_table(study),
        "vehicles": vehicle_change_table(study),
        "peaks": peak_table(study),
    }
    if len(study.variables) > len(study.stiffness_variables):
        tables["loss_factors"] = loss_factor_table(study)
    figures = front_figures(study)
    return StudyResult(
        tables=tables,
        figures=figures,
        summary=front_summary(study),
        page=front_page(study, tables, figures),
        inputs=study.platform.input_files,
        facts=study.facts,
    )
