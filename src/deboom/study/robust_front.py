"""The report of a robust front of mount stiffnesses: picks, levels, peaks, stiffnesses."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import RealArray
from deboom.explore.selection import indifference_intervals
from deboom.files.platform import Platform
from deboom.measurement.channels import LoadCase
from deboom.mounts.mount import mean_operating_stiffness
from deboom.plot.style import mount_colours, signed, vehicle_colours
from deboom.report import Report
from deboom.study.front import PERCENT, Front
from deboom.study.options import aim_note
from deboom.study.platform_model import MotionReport, factor_name, motion_name, motion_report
from deboom.vehicles.booming_model import mean_energy_level
from deboom.vehicles.booming_peaks import PeakChange, compare_peaks

ENERGY_BAND = (25.0, 40.0)
"""Band of the energy level that stands beside SPLV [Hz]."""
NOTICEABLE = 0.1
"""Change of the mean level of the lines that counts as noticeable [dB]."""
N_PER_MM = 1e-3
"""From N/m to N/mm."""
NO_REQUIREMENT = "no requirement"
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


@dataclass(frozen=True, eq=False, kw_only=True)
class RobustFront(Front):
    """The front of a platform's mount stiffnesses.

    Levels are those of the first load case; objectives are those of all.

    Parameters
    ----------
    platform : Platform
        As measured.
    """

    platform: Platform

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
        return motion_report(self.index, np.stack(list(self.named_designs.values())))

    @property
    def frequency(self) -> RealArray:
        """Lines of the band, shape (n_frequency,) [Hz]."""
        return np.asarray(self.index.frequency)

    def levels(self, design: RealArray) -> RealArray:
        """SPL of one design without scatter, shape (n_vehicle, n_frequency) [dB(A)]."""
        return np.asarray(self.index.levels(design[np.newaxis, :])[0])

    def energy_change(self, design: RealArray) -> RealArray:
        """Change of the mean energy level of `ENERGY_BAND`, shape (n_vehicle,) [dB]."""
        before, after = (
            mean_energy_level(self.levels(x), self.frequency, ENERGY_BAND)
            for x in (self.robust.space.nominal, design)
        )
        return np.asarray(after - before)

    def energy_sigma(self, design: RealArray) -> RealArray:
        """Scatter of the energy level over the verification's draws, shape (n_vehicle,) [dB]."""
        level = self.index.levels(self.verifying.made(design))
        energy = mean_energy_level(level, self.frequency, ENERGY_BAND)
        return np.asarray(energy.std(axis=0, ddof=1))

    def peak_changes(self, design: RealArray) -> dict[str, tuple[PeakChange, ...]]:
        """Booming peaks of each vehicle today and in one design."""
        before, after = self.levels(self.robust.space.nominal), self.levels(design)
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


def front_report(front: RobustFront) -> Report:
    """Report a robust front, for a reader who builds mounts."""
    first, last = front.frequency[0], front.frequency[-1]
    half = PERCENT * front.robust.space.tolerance.max()
    report = Report(
        "Robust mount stiffnesses",
        f"Which stiffnesses make {_listed(front.vehicles)} quiet between {first:g} and {last:g} "
        f"Hz, and keep them quiet when parts scatter within ±{half:.0f} %?",
    )
    motion, check = front.motion_report, front.verification
    report.explain(*(motion.terms.get(term, term) for term in TERMS))
    report.warn(*motion.warnings, front.robust.sample.warning)
    peaks, picks = _peaks(front), _picks(front)
    best = front.pick_designs["best mean"]
    changes = front.splv_change(best)
    low, high = (signed(float(change), 1) for change in (changes.min(), changes.max()))
    report.tile(f"{low} … {high} dB", "mean level per vehicle, best mean")
    fall = float(peaks["change [dB]"].min())
    report.tile(f"{signed(fall, 1)} dB", "largest fall of a booming peak")
    drop = float(picks["change of sigma [%]"].min())
    report.tile(f"{signed(drop, 0)} %", "scatter σ, best sigma")
    bias = signed(check.sigma_bias_percent, 1)
    report.tile(f"{bias} %", "bias of the search's σ, verified")
    report.summary["n_front"] = front.counts["n_front"]
    for vehicle, splv, energy in zip(
        front.vehicles, changes, front.energy_change(best), strict=True
    ):
        report.summary[f"splv_change_db_per_line_{vehicle}"] = float(splv)
        report.summary[f"energy_25_40hz_change_db_{vehicle}"] = float(energy)
    sigma = front.values.sigma_sum[front.picks["best sigma"]] / front.baseline.sigma_sum[0]
    report.summary["sigma_change_percent_best_sigma"] = float(PERCENT * (sigma - 1.0))
    report.summary["sigma_bias_percent"] = check.sigma_bias_percent
    report.summary["mean_bias_db_per_line"] = check.mean_bias * front.per_line
    report.summary |= motion.summary | front.counts
    report.facts |= {
        "motion": motion_name(front.index),
        "design_factor": factor_name(front.index),
        "kernel": front.index.kernel,
        "objectives": "; ".join(objective.name for objective in front.robust.objectives),
        "estimator": front.robust.estimator.kind,
        "tolerance_sample": front.robust.sample.kind,
        "tolerance_draws": front.robust.sample.n_samples,
        "verification_draws": check.n_samples,
    }
    report.inputs += front.platform.input_files

    _question(report, front)
    _front(report, front, picks)
    _driver(report, front, peaks)
    _supplier(report, front)
    _vehicles(report, front)
    _search(report, front)
    return report


def _question(report: Report, front: RobustFront) -> None:
    """Say what was asked, and with which data."""
    space, sampler, case = front.robust.space, front.robust.sample, front.load_case
    cases = ", ".join(
        f"{front.platform.load_case(part.load_case).title} (weight {weight:.3g})"
        for part, weight in zip(front.index.cases, front.index.weights, strict=True)
    )
    factors = "stiffness factors"
    if len(front.variables) > len(front.stiffness_variables):
        factors = "factors of stiffness (K' and K'' alike) and of loss (K'' alone, exactly made)"
    report.section(
        "What was asked, and with which data",
        f"{front.platform.title}: {front.platform.description}\n\n"
        f"Vehicles: {_listed(front.vehicles)}. Load cases: {cases}. Lines: "
        f"{front.index.n_lines} between {front.frequency[0]:g} and {front.frequency[-1]:g} Hz, "
        f"engine order {case.order:g}.\n\n"
        f"Design variables: {len(front.variables)} {factors}, each between "
        f"{space.lower.min():g} and {space.upper.max():g}. "
        f"Manufacturing scatter: ±{PERCENT * space.tolerance.max():.0f} % of the design's own "
        f"stiffness as three standard deviations, {sampler.n_samples} draws ({sampler.kind}).\n\n"
        "Two objectives, both as small as possible: the sum over the vehicles of the mean "
        "SPLV, and the sum of its standard deviation σ. The figures show both divided by "
        "the number of vehicles and lines, so that they read as dB of one line.",
    )


def _front(report: Report, front: RobustFront, picks: pd.DataFrame) -> None:
    """Show the front as verified, and its named designs."""
    check = front.verification
    report.section(
        "The front",
        f"{front.text} All points shown were evaluated again with "
        f"{check.n_samples} independent draws: the search had its σ wrong by "
        f"{signed(check.sigma_bias_percent, 2)} % and its mean by "
        f"{signed(check.mean_bias * front.per_line, 3)} dB on average.",
    )
    report.figure(
        "pareto_front",
        front.picture,
        "Both objectives of every design of the front, with today's mounts and "
        "the named picks. Bars are ± one standard error as if the draws were "
        "independent, an upper bound for Sobol draws.",
    )
    report.table(
        "picks",
        picks,
        "Today's mounts and the named designs, per vehicle and line.",
        {"mean level [dB(A)]": 2, "sigma of the level [dB]": 3},
    )
    report.table("front", front.table)
    report.table("designs", front.designs())
    values, n_lines = front.values, front.index.n_lines
    points, vehicles = np.meshgrid(np.arange(1, len(values) + 1), front.vehicles, indexing="ij")
    per_vehicle = {
        "point": points.ravel(),
        "vehicle": vehicles.ravel(),
        "SPLV mean [dB(A)]": values.mean.ravel(),
        "SPLV sigma [dB]": values.sigma.ravel(),
        "mean level of the lines [dB(A)]": values.mean.ravel() / n_lines,
        "sigma of that level [dB]": values.sigma.ravel() / n_lines,
    }
    report.table("per_vehicle", pd.DataFrame(per_vehicle))


def _picks(front: RobustFront) -> pd.DataFrame:
    """Tabulate today's design and the picks, verified."""
    rows = {name: (front.values, row) for name, row in front.picks.items()}
    return front.compared({"baseline": (front.baseline, 0), **rows})


def _driver(report: Report, front: RobustFront, peaks: pd.DataFrame) -> None:
    """Show the levels at the driver's ear before and after, with their booming peaks."""
    best = front.pick_designs["best mean"]
    changes = front.peak_changes(best)
    report.section(
        "What the driver hears",
        f"{front.load_case.title}. Best mean against today's mounts, without scatter.",
    )
    report.figure(
        "spl_curves",
        plot.spl_curves(
            front.frequency,
            front.load_case.order,
            front.levels(front.robust.space.nominal),
            front.levels(best),
            front.vehicles,
            [[c.before.frequency for c in changes[v] if c.before] for v in front.vehicles],
            [[c.after.frequency for c in changes[v] if c.after] for v in front.vehicles],
            vehicle_colours(front.platform.fleet.names),
        ),
        "Sound pressure level at the driver's ear, one panel per vehicle: "
        "frequency below, engine speed above.",
    )
    report.table(
        "peaks",
        peaks,
        "Booming peaks: local maxima with a prominence of 6 dB or more, before and "
        "after. A dash: no such peak within 1.5 Hz any more, the level is the "
        "highest one there.",
        {"prominence before [dB]": 1, "change [dB]": 1},
        shown=peaks.drop(columns=["speed after [rpm]", "prominence after [dB]"]),
    )


def _peaks(front: RobustFront) -> pd.DataFrame:
    """Tabulate today's booming peaks and what becomes of them in best mean."""
    rows = []
    for vehicle, changes in front.peak_changes(front.pick_designs["best mean"]).items():
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


def _supplier(report: Report, front: RobustFront) -> None:
    """Show the stiffnesses of the picks, and what is left open."""
    nominal, variables = front.nominal_stiffness, front.stiffness_variables
    n = len(variables)
    space, interval = front.robust.space, front.indifference[:n]
    free = np.isin(variables, front.without_effect)
    first, last = front.frequency[0], front.frequency[-1]
    report.section(
        "What the supplier should build",
        "The stiffnesses of best mean within their bounds, and beside them those of the "
        "other picks. Nominal is the mean magnitude of the dynamic stiffness measured in "
        f"operation ({front.load_case.title}).",
    )
    report.figure(
        "stiffness_bars",
        plot.stiffness_bars(
            variables,
            front.pick_designs["best mean"][:n],
            space.lower[:n],
            space.upper[:n],
            nominal,
            free.tolist(),
            interval,
            mount_colours([mount.name for mount in front.platform.mounts]),
            stiffness_label=f"mean |K|, {first:g}–{last:g} Hz [N/mm]",
        ),
        "Chosen stiffness of every mount and axis. The thin bracket spans the "
        f"range within which the mean level stays within {NOTICEABLE} dB.",
    )
    table: dict[str, object] = {"variable": list(variables), "nominal [N/mm]": nominal}
    for name, design in front.pick_designs.items():
        table[f"{name} factor [1]"] = design[:n]
        table[f"{name} [N/mm]"] = nominal * design[:n]
    for column, end in (("from", 0), ("to", 1)):
        table[f"best mean {column} [N/mm]"] = np.where(free, np.nan, nominal * interval[:, end])
    anywhere = (interval[:, 0] <= space.lower[:n]) & (interval[:, 1] >= space.upper[:n])
    table["requirement"] = np.select(
        [free, anywhere], [NO_REQUIREMENT, "any in bounds"], "as chosen"
    )
    stiffness = pd.DataFrame(table)
    columns = [
        "variable",
        "nominal [N/mm]",
        "best mean [N/mm]",
        "best mean from [N/mm]",
        "best mean to [N/mm]",
        "best sigma [N/mm]",
        "knee [N/mm]",
        "requirement",
    ]
    report.table(
        "stiffness",
        stiffness,
        "Stiffnesses of the named designs. From and to: the range around best mean "
        f"within which the mean level stays within {NOTICEABLE} dB.",
        {column: 0 for column in columns if column.endswith("[N/mm]")},
        shown=stiffness[columns],
    )
    if len(front.variables) > n:
        names, interval = front.variables[n:], front.indifference[n:]
        free = np.isin(names, front.without_effect)
        losses: dict[str, object] = {"variable": list(names)}
        losses |= {f"{name} factor [1]": x[n:] for name, x in front.pick_designs.items()}
        for column, end in (("from", 0), ("to", 1)):
            losses[f"best mean {column} [1]"] = np.where(free, np.nan, interval[:, end])
        report.table(
            "loss_factors",
            pd.DataFrame(losses),
            "Factors on the loss factor K''/K' at unchanged K'; a dash: no requirement.",
        )


def _vehicles(report: Report, front: RobustFront) -> None:
    """Show what best mean changes in each vehicle."""
    design, row = front.pick_designs["best mean"], front.picks["best mean"]
    values, n_lines = front.values, front.index.n_lines
    low, high = (f"{edge:g}" for edge in ENERGY_BAND)
    change, energy = front.splv_change(design), front.energy_change(design)
    report.section(
        "Per vehicle",
        "What best mean changes in each vehicle, and how much the manufacturing scatter moves it.",
    )
    report.figure(
        "per_vehicle_change",
        plot.per_vehicle_change(
            front.vehicles,
            change,
            values.sigma[row] / n_lines,
            energy,
            front.energy_sigma(design),
            vehicle_colours(front.platform.fleet.names),
            level_label="change of the mean level [dB]",
            energy_label=f"change of energy {low}–{high} Hz [dB]",
        ),
        "Change against today's mounts; whiskers are ± one σ of the scatter.",
    )
    table = {
        "vehicle": list(front.vehicles),
        "level before [dB(A)]": front.baseline.mean[0] / n_lines,
        "level after [dB(A)]": values.mean[row] / n_lines,
        "change [dB]": change,
        "sigma before [dB]": front.baseline.sigma[0] / n_lines,
        "sigma after [dB]": values.sigma[row] / n_lines,
        "energy change [dB]": energy,
        "sigma of energy [dB]": front.energy_sigma(design),
    }
    report.table(
        "vehicles",
        pd.DataFrame(table),
        "Before: today's mounts; after: best mean. Levels are means over the lines "
        "and over the scatter, changes are those of the designs without scatter; "
        f"energy is that of {low} to {high} Hz.",
    )


def _search(report: Report, front: RobustFront) -> None:
    """Say how the search went."""
    motion, search = front.motion_report, front.search
    report.section(
        "How the search went",
        f"NSGA-II, {search.hypervolume.size} generations, {search.seconds:.1f} s. Motion: "
        f"{motion_name(front.index)}; meaning of a stiffness factor: "
        f"{motion.summary['design_factor']}; kernel: {front.index.kernel}.\n\n"
        "\n\n".join((motion.text, aim_note(front.robust), front.note)).strip(),
    )
    report.figure(
        "convergence",
        front.convergence_picture(),
        "Hypervolume of the front over the generations; flat means that more "
        "generations would not have helped.",
    )
    report.table("convergence", front.convergence())


def _listed(names: tuple[str, ...]) -> str:
    """Write names with commas and an ``and``."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
