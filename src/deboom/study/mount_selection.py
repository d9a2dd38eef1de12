"""The best parts of a catalogue for a platform."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from deboom import plot as figures
from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.front import ParetoFront, Verification, pareto_front, verification_response
from deboom.explore.problems import SearchResult
from deboom.explore.robust import Robust, RobustResponse, RobustValues, joined
from deboom.explore.selection import pick
from deboom.explore.space import DesignSpace, stiffness_factor_space
from deboom.files.library_export import read_library_json
from deboom.files.platform import Platform
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.library import open_library
from deboom.mounts.surface_forces import Outside, surface_forces
from deboom.plot.style import signed
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.study.platform_model import (
    LIBRARY_FILE,
    Kernel,
    Motion,
    MountSource,
    Operation,
    motion_index,
    motion_report,
)
from deboom.study.result import Scalar, StudyResult
from deboom.vehicles.booming_model import (
    CatalogueIndex,
    Composed,
    composed_contributions,
    composed_motion,
)

CATALOGUE_FILE = "catalogue.library.json"
"""Further parts in a platform folder, an exported mount library."""

TODAY = "today's"
_COMPOSED: dict[Motion, Composed] = {
    Motion.prescribed: composed_contributions,
    Motion.coupled: composed_motion,
}


@dataclass(frozen=True, eq=False)
class Catalogue:
    """Parts that may stand at each mount of a platform.

    Parameters
    ----------
    parts : mapping of str to tuple of CharacterisedMount
        By mount, in the platform's order; the first one is today's.
    inputs : tuple of Path
        Files they come from.
    """

    parts: Mapping[str, tuple[CharacterisedMount, ...]]
    inputs: tuple[Path, ...]

    @property
    def n_parts(self) -> tuple[int, ...]:
        """Number of parts of each mount."""
        return tuple(len(parts) for parts in self.parts.values())

    @property
    def n_sets(self) -> int:
        """Number of sets that can be made of them."""
        return int(np.prod(self.n_parts))

    def all_sets(self) -> RealArray:
        """Return every set as part numbers, shape (n_sets, n_mount); today's is the first."""
        return np.array(list(itertools.product(*map(range, self.n_parts))), dtype=float)

    def label(self, mount: str, number: int) -> str:
        """Return what to order: the part number, or variant and serial where there is none."""
        identity = self.parts[mount][number].identity
        name = identity.part_number or f"{mount} {identity.variant} {identity.serial}".strip()
        return f"{name} ({TODAY})" if number == 0 else name

    def labels(self, numbers: RealArray) -> list[str]:
        """Return the part of each mount, from part numbers of shape (n_mount,)."""
        pairs = zip(self.parts, numbers.astype(int), strict=True)
        return [self.label(mount, number) for mount, number in pairs]

    def space(self, names: Sequence[str], retuning: float, tolerance: float) -> DesignSpace:
        """Return the space of part numbers and stiffness factors.

        Parameters
        ----------
        names : sequence of str
            Variables of the catalogue's index.
        retuning : float
            Factors run from ``1 - retuning`` to ``1 + retuning``; 0 takes parts as they are [1].
        tolerance : float
            Manufacturing scatter of each stiffness, half width [1].
        """
        n = len(self.parts)
        factors = stiffness_factor_space(names[n:], half_width=retuning, tolerance=tolerance)
        none = np.zeros(n)
        return DesignSpace(
            names=tuple(names),
            units=("1",) * len(names),
            nominal=np.concatenate([none, factors.nominal]),
            lower=np.concatenate([none, factors.lower]),
            upper=np.concatenate([np.array(self.n_parts) - 1.0, factors.upper]),
            tolerance=np.concatenate([none, factors.tolerance]),
            integer=np.arange(len(names)) < n,
        )


def platform_catalogue(
    platform: Platform, path: Path | None, mounts: Sequence[str] | None = None
) -> Catalogue:
    """Read the parts that may stand at a platform's mounts.

    Parameters
    ----------
    platform : Platform
        Its own library has today's parts.
    path : Path or None
        Exported library (JSON) or library database with further parts; None takes
        `CATALOGUE_FILE` of the platform.
    mounts : sequence of str, optional
        Mounts whose part may change; default is all.

    Raises
    ------
    InputError
        A file that is missing or no library, a mount that the platform does not have, a part of
        other pieces, two parts with one label, or no further part at all.
    """
    own = platform.folder / LIBRARY_FILE
    further = path or platform.folder / CATALOGUE_FILE
    if not further.exists():
        raise InputError(
            f"{further}: there is no catalogue of further parts: export a mount library there "
            "(deboom library export), or name one with --catalogue"
        )
    today = {part.mount.name: part for part in read_library_json(own)[1]}
    names = [mount.name for mount in platform.mounts]
    unknown = [name for name in (mounts or ()) if name not in names]
    if unknown or not set(names) <= set(today):
        raise InputError(
            f"{platform.name}: no mount {unknown or sorted(set(names) - set(today))} with a "
            f"characterised part: the mounts are {names}"
        )
    parts: dict[str, tuple[CharacterisedMount, ...]] = {name: (today[name],) for name in names}
    for part in _parts_of(further):
        name = part.mount.name
        if name in (mounts or names) and name in parts and part.identity != today[name].identity:
            if part.mount.pieces != today[name].mount.pieces:
                raise InputError(f"{further}: {part.identity} has other pieces than today's part")
            parts[name] = (*parts[name], part)
    found = Catalogue(parts, (own, further))
    for name, count in zip(names, found.n_parts, strict=True):
        labels = [found.label(name, number) for number in range(count)]
        if len(set(labels)) < count:
            raise InputError(f"{further}: parts of {name} share a name: {labels}; number them")
    if found.n_sets == 1:
        raise InputError(f"{further}: there is no further part for any of {mounts or names}")
    return found


def catalogue_index(
    runs: Operation, catalogue: Catalogue, motion: Motion, kernel: Kernel | None, outside: Outside
) -> CatalogueIndex:
    """Build the booming index of all parts of a catalogue.

    Parameters
    ----------
    runs : Operation
        With today's parts.
    catalogue : Catalogue
        Of the same platform.
    motion, kernel
        As for `deboom.study.platform_model.motion_index`.
    outside : Outside
        Whether lines outside of the region that a part was measured in are refused or keep the
        force of today's part.

    Raises
    ------
    InputError
        Another motion; lines outside, if refused; see also
        `deboom.mounts.surface_forces.surface_forces`.

    Notes
    -----
    A direction that was not identified has today's force, whatever the part.
    """
    if motion not in _COMPOSED:
        raise InputError(
            f"parts of a catalogue cannot be combined under {motion.value} motion: use one of "
            f"{[one.value for one in _COMPOSED]}"
        )
    levels = [motion_index(runs, motion, kernel)]
    for number in range(1, max(catalogue.n_parts)):
        mounts = [parts[min(number, len(parts) - 1)] for parts in catalogue.parts.values()]
        cases = [
            (surface_forces(case, mounts, outside).load_case, weight) for case, weight in runs.cases
        ]
        levels.append(motion_index(replace(runs, cases=cases), motion, kernel))
    return CatalogueIndex(runs.platform.mounts, tuple(levels), catalogue.n_parts, _COMPOSED[motion])


def outside_of(source: MountSource) -> Outside:
    """Return what becomes of lines outside of the measured region.

    Raises
    ------
    InputError
        Forces from the spectra: only one set of parts was measured in the vehicle.
    """
    if source is MountSource.spectra:
        raise InputError(
            "parts of a catalogue are known by their surfaces alone: take --mounts library or "
            "--mounts library-inside"
        )
    return Outside.REFUSE if source is MountSource.library else Outside.KEEP_MEASURED


def _parts_of(path: Path) -> tuple[CharacterisedMount, ...]:
    if path.suffix.lower() == ".json":
        return read_library_json(path)[1]
    with open_library(path) as library:
        return tuple(library.load(identity) for identity in library.identities())


BATCH = 100
"""Sets evaluated between two steps of the progress bar."""


@dataclass(frozen=True, eq=False)
class MountSelection:
    """A search over the parts of a catalogue, verified.

    Parameters
    ----------
    platform : Platform
        Whose mounts they are.
    catalogue : Catalogue
        Parts to choose from.
    index : CatalogueIndex
        What was evaluated.
    robust : RobustResponse
        How it was made robust.
    search : SearchResult
        What was found.
    verification : Verification
        The found front, re-evaluated.
    sets : RobustValues or None
        Every set of parts at factors 1, in the order of `Catalogue.all_sets`; None if there were
        too many to evaluate.
    """

    platform: Platform
    catalogue: Catalogue
    index: CatalogueIndex
    robust: RobustResponse
    search: SearchResult
    verification: Verification
    sets: RobustValues | None

    @property
    def per_line(self) -> float:
        """Factor from a sum over vehicles and lines to the mean over both [1]."""
        return 1.0 / (self.index.n_lines * len(self.index.response_names))

    @property
    def retuning(self) -> float:
        """Half width of the stiffness factors [1]."""
        return float(self.robust.space.upper[-1] - 1.0)

    @property
    def n_mounts(self) -> int:
        """Number of part choices at the head of each design."""
        return len(self.catalogue.parts)

    @cached_property
    def picks(self) -> dict[str, int]:
        """Rows of the front by name of the pick, chosen on verified values."""
        rows = pick(self.verification.values)
        return {"best mean": rows.best_mean, "best sigma": rows.best_sigma, "knee": rows.knee}

    @cached_property
    def baseline(self) -> RobustValues:
        """Today's set under the verification's draws; one row."""
        return self._verified(self.robust.space.nominal[np.newaxis, :])

    @cached_property
    def set_front(self) -> ParetoFront | None:
        """Front of all sets of parts as they are, from the draws of the search."""
        return None if self.sets is None else pareto_front(self.sets)

    @cached_property
    def best_set(self) -> RobustValues | None:
        """The quietest set of parts as they are, verified; one row."""
        if self.set_front is None:
            return None
        return self._verified(self.set_front.designs[:1])

    @property
    def found_percent(self) -> float:
        """Sets of the enumerated front that the search found or beat; nan if not enumerated [%]."""
        if self.set_front is None:
            return float("nan")
        found = [
            np.any(np.all(self.search.front.objectives <= wanted, axis=1))
            for wanted in self.set_front.objectives
        ]
        return float(100.0 * np.mean(found))

    def splv_change(self, design: RealArray) -> RealArray:
        """Change of SPLV over the number of lines against today's set, shape (n_vehicle,) [dB]."""
        both = self.index(np.stack([self.robust.space.nominal, design]))
        return np.asarray((both[1] - both[0]) / self.index.n_lines)

    def _verified(self, designs: RealArray) -> RobustValues:
        check = self.verification
        return verification_response(self.robust, check.n_samples, seed=check.seed)(designs)


def evaluate_sets(
    robust: Robust, catalogue: Catalogue, at_most: int, progress: Callable[[int, int, str], None]
) -> RobustValues | None:
    """Evaluate every set of parts as they are.

    Parameters
    ----------
    robust : Robust
        Of the catalogue's index.
    catalogue : Catalogue
        Its parts.
    at_most : int
        None is returned where there are more sets.
    progress : callable
        ``progress(done, total, text)``.

    Raises
    ------
    InputError
        A set that cannot be computed.
    """
    if catalogue.n_sets > at_most:
        return None
    sets = catalogue.all_sets()
    factors = np.tile(robust.space.nominal[sets.shape[1] :], (len(sets), 1))
    designs = np.hstack([sets, factors])
    parts = []
    for start in range(0, len(designs), BATCH):
        parts.append(robust(designs[start : start + BATCH]))
        progress(min(start + BATCH, len(designs)), len(designs), "sets of parts")
    values = joined(parts)
    if values.failed.any():
        raise InputError(f"the parts {catalogue.labels(sets[values.failed][0])} cannot be computed")
    return values


TERMS = ("booming noise", "SPLV", "dynamic stiffness", "tolerance", "σ", "Pareto front", "knee")
WARNING = (
    "A direction that a part's characterisation could not identify keeps the force of today's "
    "part, and so does a line outside of the region that the part was measured in."
)


def mount_selection_result(study: MountSelection) -> StudyResult:
    """Make tables, figures, headline numbers and page of a mount selection.

    Parameters
    ----------
    study : MountSelection
        Searched and verified.

    Returns
    -------
    StudyResult
        Tables ``front``, ``designs``, ``picks``, ``vehicles`` and, if enumerated, ``part_sets``.
    """
    tables = {
        "front": front_table(study),
        "designs": design_table(study),
        "picks": pick_table(study),
        "vehicles": vehicle_table(study),
    }
    if study.sets is not None:
        tables["part_sets"] = set_table(study, study.sets)
    pictures = selection_figures(study)
    summary = selection_summary(study)
    return StudyResult(
        tables=tables,
        figures=pictures,
        summary=summary,
        page=_page(study, tables, pictures),
        inputs=(*study.platform.input_files, *study.catalogue.inputs),
        facts={"kernel": study.index.levels[0].kernel.name},
    )


def front_table(study: MountSelection) -> pd.DataFrame:
    """One row per design of the front: parts, and both objectives as verified."""
    front, check = study.search.front, study.verification
    names = {row: name for name, row in reversed(study.picks.items())}
    return pd.DataFrame(
        {
            "point": np.arange(1, len(front) + 1),
            "pick": [names.get(row, "") for row in range(len(front))],
            **_parts(study, front.designs),
            "SPLV mean sum [dB(A)]": check.values.mean_sum,
            "SPLV sigma sum [dB]": check.values.sigma_sum,
            "SPLV mean sum in search [dB(A)]": front.mean_sum,
            "SPLV sigma sum in search [dB]": front.sigma_sum,
            "non-dominated when verified": check.nondominated,
        }
    )


def design_table(study: MountSelection) -> pd.DataFrame:
    """One row per design of the front: its stiffness factors."""
    factors = study.search.front.designs[:, study.n_mounts :]
    names = study.index.variable_names[study.n_mounts :]
    columns = {f"{name} [1]": factors[:, place] for place, name in enumerate(names)}
    return pd.DataFrame({"point": np.arange(1, len(factors) + 1), **columns})


def pick_table(study: MountSelection) -> pd.DataFrame:
    """Today's set, the quietest set as it is, and the named designs, verified."""
    base, values = study.baseline, study.verification.values
    rows = [("today's parts", base, 0)]
    if study.best_set is not None:
        rows.append(("quietest parts as they are", study.best_set, 0))
    rows += [(name, values, row) for name, row in study.picks.items()]
    designs = np.stack([source.designs[row] for _, source, row in rows])
    sigma = np.array([source.sigma_sum[row] for _, source, row in rows])
    mean = np.array([source.mean_sum[row] for _, source, row in rows])
    return pd.DataFrame(
        {
            "design": [name for name, *_ in rows],
            **_parts(study, designs),
            "mean level [dB(A)]": mean * study.per_line,
            "change [dB]": (mean - base.mean_sum[0]) * study.per_line,
            "sigma of the level [dB]": sigma * study.per_line,
            "change of sigma [%]": 100.0 * (sigma / base.sigma_sum[0] - 1.0),
        }
    )


def vehicle_table(study: MountSelection) -> pd.DataFrame:
    """One row per vehicle: what the parts of best mean change, without scatter."""
    design = study.verification.values.designs[study.picks["best mean"]]
    table = {"vehicle": list(study.index.response_names)}
    if study.best_set is not None:
        change = study.splv_change(study.best_set.designs[0])
        table["change, quietest parts as they are [dB]"] = change.tolist()
    return pd.DataFrame(table | {"change, best mean [dB]": study.splv_change(design)})


def set_table(study: MountSelection, sets: RobustValues) -> pd.DataFrame:
    """One row per set of parts as they are, in the draws of the search."""
    assert study.set_front is not None
    on_front = {tuple(row) for row in study.set_front.designs.tolist()}
    return pd.DataFrame(
        {
            **_parts(study, sets.designs),
            "SPLV mean sum [dB(A)]": sets.mean_sum,
            "SPLV sigma sum [dB]": sets.sigma_sum,
            "on the front": [tuple(row) in on_front for row in sets.designs.tolist()],
        }
    )


def selection_summary(study: MountSelection) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    picks = pick_table(study).set_index("design")
    best = study.verification.values.designs[study.picks["best mean"]]
    parts = study.catalogue.labels(best[: study.n_mounts])
    summary: dict[str, Scalar] = {
        f"part_{mount}": part for mount, part in zip(study.catalogue.parts, parts, strict=True)
    }
    summary["change_db_per_line"] = float(picks["change [dB]"]["best mean"])
    summary["sigma_change_percent_best_sigma"] = float(picks["change of sigma [%]"]["best sigma"])
    if study.set_front is not None and study.best_set is not None:
        change = picks["change [dB]"]["quietest parts as they are"]
        summary["change_parts_as_they_are_db_per_line"] = float(change)
        summary["n_set_front"] = len(study.set_front)
        summary["set_front_found_percent"] = study.found_percent
    summary["n_sets"] = study.catalogue.n_sets
    summary["n_front"] = len(study.search.front)
    summary["n_evaluated"] = study.search.n_evaluated
    summary["sigma_bias_percent"] = study.verification.sigma_bias_percent
    summary["seconds_search"] = round(study.search.seconds, 3)
    return summary


def selection_figures(study: MountSelection) -> dict[str, bytes]:
    """Draw all pictures of the page; file stem → PNG."""
    scale, front = study.per_line, study.search.front
    curves = {"front of the search": (front.mean_sum * scale, front.sigma_sum * scale)}
    points = {}
    if study.sets is not None and study.set_front is not None:
        sets, best = study.sets, study.set_front
        points["every set of parts as they are"] = (sets.mean_sum * scale, sets.sigma_sum * scale)
        curves["front of these sets"] = (best.mean_sum * scale, best.sigma_sum * scale)
    labels = [
        [study.catalogue.label(mount, number) for number in range(count)]
        for mount, count in zip(study.catalogue.parts, study.catalogue.n_parts, strict=True)
    ]
    base = study.robust(study.robust.space.nominal[np.newaxis, :])
    today = (float(base.mean_sum[0]) * scale, float(base.sigma_sum[0]) * scale)
    return {
        "fronts": figures.fronts(
            curves,
            points,
            {"today's parts": today},
            mean_label="mean level over vehicles and lines [dB(A)]",
            sigma_label="its σ over the tolerance [dB]",
        ),
        "parts": figures.part_choices(
            tuple(study.catalogue.parts),
            labels,
            front.designs[:, : study.n_mounts].astype(int),
            point_label="design of the front, quietest first",
        ),
        "convergence": figures.convergence(
            np.arange(1, study.search.hypervolume.size + 1),
            study.search.hypervolume * scale**2,
            hypervolume_label="hypervolume [dB²]",
        ),
    }


def _parts(study: MountSelection, designs: np.ndarray) -> dict[str, list[str]]:
    mounts = list(study.catalogue.parts)
    return {
        f"{mount} part": [study.catalogue.label(mount, int(row[place])) for row in designs]
        for place, mount in enumerate(mounts)
    }


def _page(
    study: MountSelection, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Page:
    summary, search, check = selection_summary(study), study.search, study.verification
    counts = ", ".join(
        f"{count} of {mount}"
        for mount, count in zip(study.catalogue.parts, study.catalogue.n_parts, strict=True)
    )
    headlines = [
        Headline(f"{signed(float(summary['change_db_per_line']), 2)} dB", "mean level, best mean")
    ]
    compared = f"{study.catalogue.n_sets} sets are too many to evaluate one by one."
    if "set_front_found_percent" in summary:
        as_they_are = float(summary["change_parts_as_they_are_db_per_line"])
        found = float(summary["set_front_found_percent"])
        headlines += [
            Headline(f"{signed(as_they_are, 2)} dB", "mean level, quietest parts as they are"),
            Headline(f"{found:.0f} %", "of the best sets found or beaten by the search"),
        ]
        compared = (
            f"All {study.catalogue.n_sets} sets were evaluated as they are: "
            f"{summary['n_set_front']} are on their front, and the search found or beat "
            f"{found:.0f} % of these."
        )
    tuned = (
        f"Each part may be re-tuned within ±{100 * study.retuning:.0f} % per axis."
        if study.retuning
        else "Parts are taken as they are."
    )
    level = study.index.levels[0]
    motion = motion_report(level, np.ones((1, len(level.variable_names)))).warnings
    half = float(study.robust.space.tolerance.max())
    return Page(
        title="Mounts from the catalogue",
        question=(
            "Which parts of the catalogue make "
            f"{', '.join(study.index.response_names)} quiet, and keep them quiet when stiffnesses "
            f"scatter within ±{100 * half:.0f} %?"
        ),
        headlines=tuple(headlines),
        terms=TERMS,
        warnings=(WARNING, *motion),
        sections=(
            Section(
                "What to order",
                f"Parts to choose from: {counts}. {tuned}",
                tables=(
                    Table(
                        tables["picks"],
                        "Today's and the named designs, per vehicle and line, evaluated with "
                        f"{check.n_samples} independent draws.",
                        {"mean level [dB(A)]": 2, "change [dB]": 2, "sigma of the level [dB]": 3},
                    ),
                    Table(tables["vehicles"], "Change of the mean level without scatter."),
                ),
            ),
            Section(
                "The front",
                f"{search.n_evaluated} designs were evaluated, {search.n_failed} failed; "
                f"{len(search.front)} are on the front. {compared}",
                figures=(
                    _picture(pictures, "fronts", "Both objectives, in the draws of the search."),
                    _picture(pictures, "parts", "Which part each design of the front has."),
                ),
            ),
            Section(
                "How the search went",
                f"NSGA-II over part numbers and stiffness factors, {search.hypervolume.size} "
                f"generations, {search.seconds:.1f} s.",
                figures=(
                    _picture(pictures, "convergence", "Hypervolume of the front over generations."),
                ),
            ),
        ),
    )


def _picture(pictures: Mapping[str, bytes], stem: str, caption: str) -> Picture:
    return Picture(pictures[stem], alt=caption, caption=caption)
