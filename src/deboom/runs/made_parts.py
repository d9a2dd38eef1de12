"""Parts as made: their tolerances, measured or stated, what they share, and what they cost."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
from typer import Option

from deboom.arrays import RealArray
from deboom.common import PERCENT
from deboom.errors import InputError
from deboom.explore.moments import Limit
from deboom.explore.robust import Robust
from deboom.explore.scatter import (
    PartNumber,
    ToleranceSampler,
    ToleranceStructure,
    part_structure,
    sobol_sample,
)
from deboom.explore.space import SIGMAS_PER_TOLERANCE, DesignSpace, Evaluate
from deboom.explore.tolerance_allocation import (
    Allocation,
    Allocator,
    ShareTarget,
    SigmaTarget,
    Target,
    ToleranceCost,
)
from deboom.files.library_export import library_parts
from deboom.files.limits import MeasuredEntry, PartScatterFile, load_parts
from deboom.files.tables import Row, read_rows
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.part_scatter import LibraryScatter, ScatterPrior, library_scatter
from deboom.report import Report
from deboom.runs.options import AimOptions, Bounds, Tolerance, robust_response
from deboom.vehicles.design_factor import factor_space

REFERENCE = 0.15
"""Tolerance whose price is 1 per direction unless a table says otherwise [1]."""
ROUNDS = 5
"""Searches at most: if new draws do not confirm a share, the next search asks for another one."""
CLOSE = 0.002
"""How much more than the wanted share is not worth another round [1]."""
ONE_SIDED_95 = 1.644854
"""Lower 95 % bound in standard errors [1]."""
NOTHING_SHARED = (
    "Every direction of every mount scatters on its own, left and right piece of a mount as one."
)


@dataclass(frozen=True, eq=False)
class MadeParts:
    """How the parts of a study scatter.

    - `space`: with their tolerances.
    - `structure`: what their scatter has in common; None without a file: nothing.
    - `scatter` or None: what was measured.
    - `inputs`: files read.
    """

    space: DesignSpace
    structure: ToleranceStructure | None = None
    scatter: LibraryScatter | None = None
    inputs: tuple[Path, ...] = ()

    @property
    def n_draws(self) -> int:
        """Columns that a tolerance sample needs."""
        return self.space.n_variables if self.structure is None else self.structure.n_draws

    def response(
        self,
        evaluate: Evaluate,
        sample: ToleranceSampler,
        *,
        aims: AimOptions = AimOptions(),
        limits: Sequence[Limit] = (),
    ) -> Robust:
        """Wrap a model with this scatter; see `deboom.runs.options.robust_response`."""
        return robust_response(
            evaluate, self.space, sample, aims=aims, structure=self.structure, limits=limits
        )

    @property
    def table(self) -> pd.DataFrame:
        """One row per variable that scatters: its tolerance and where that comes from."""
        rows = []
        for name, tolerance in zip(self.space.names, self.space.tolerance, strict=True):
            if tolerance == 0.0:
                continue
            row: dict[str, object] = {"variable": name, "tolerance ± [%]": PERCENT * tolerance}
            if self.scatter is not None:
                direction = self.scatter.direction(name)
                interval = (
                    (direction.sigma, direction.lower, direction.upper)
                    if direction
                    else (np.nan,) * 3
                )
                columns = ("sigma measured [%]", "from [%]", "to [%]")
                row |= dict(zip(columns, (PERCENT * value for value in interval), strict=True))
                row |= {
                    "parts": direction.n_parts if direction else 0,
                    "note": direction.note if direction else "",
                }
            rows.append(row)
        return pd.DataFrame(rows)

    @property
    def text(self) -> str:
        """What parts have in common, in words."""
        if self.structure is None:
            return NOTHING_SHARED
        correlation = self.structure.loadings @ self.structure.loadings.T
        size = np.sqrt(np.diag(correlation))
        linked = np.triu(correlation / np.outer(size, size), 1)
        words = [
            f"{self.n_draws} independent draws make one set of parts for {len(size)} variables; "
            f"the largest correlation of two variables is {linked.max():.2f}."
        ]
        even = [n for n, wide in zip(self.space.names, size, strict=True) if wide < 1.0 - 1e-9]
        if even:
            words.append(
                f"{', '.join(even)}: the mean of several pieces, which even out to "
                f"{PERCENT * size.min():.0f} % of the tolerance of one."
            )
        if self.scatter is not None and self.scatter.hardness is not None:
            share = self.scatter.hardness
            words.append(
                f"Measured share of the variance that the axes of a part have in common: "
                f"{share.value:.2f}, 95 % interval {share.lower:.2f} to {share.upper:.2f}."
            )
        return " ".join(words)


@dataclass(frozen=True)
class ScatterOptions:
    """Options of a study: how parts scatter, and how many are drawn."""

    samples: Annotated[int, Option(help="Number of draws per design, a power of two.")] = 128
    tolerance: Tolerance = 0.15
    bounds: Bounds = 0.20
    parts: Annotated[
        Path | None, Option(help="TOML file with part numbers, batches and scatter of parts.")
    ] = None

    def made(self, variables: Sequence[str]) -> MadeParts:
        """Return the space of a study's factors, ``1 ± bounds``, with this scatter.

        - `variables`: names of the factors; loss factors do not scatter.
        - raises InputError: see `made_parts`.
        """
        return made_parts(self.parts, factor_space(variables, self.bounds, self.tolerance))


def made_parts(path: Path | None, space: DesignSpace) -> MadeParts:
    """Read how parts scatter.

    - `path`: see `deboom.files.limits`; None: variables scatter independently, with the tolerances
      of the space.
    - `space`: variables ``<mount> <axis>``. What is exactly made stays so unless the file says.
    - raises InputError: a file or library that cannot be read, a variable or place that there is
      not, or a place with two part numbers.
    """
    if path is None:
        return MadeParts(space)
    content = load_parts(path)
    scatter, inputs = None, [path]
    if content.measured is not None:
        inputs.append(path.parent / content.measured.library)
        scatter = _measured(inputs[-1], content, content.measured)
    try:
        structure = _structure(content, space, scatter)
        tolerance = _tolerance(content, space, scatter)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return MadeParts(replace(space, tolerance=tolerance), structure, scatter, tuple(inputs))


def _measured(library: Path, content: PartScatterFile, entry: MeasuredEntry) -> LibraryScatter:
    """Estimate the scatter from a library, of the part numbers that the file names."""
    numbers = {place: part.number for part in content.parts for place in part.places}
    parts = [candidate for candidate in library_parts(library) if _wanted(candidate, numbers)]
    try:
        return library_scatter(parts, ScatterPrior(entry.prior_sigma, entry.prior_weight))
    except InputError as error:
        raise InputError(f"{library}: {error}") from None


def report_parts(report: Report, made: MadeParts) -> None:
    """Add a section and a table ``parts`` to a report; nothing without a file."""
    if made.structure is None:
        return
    report.section("How parts scatter", made.text)
    caption = "Half widths of the scatter are three standard deviations."
    report.table("parts", made.table, caption)
    report.inputs += made.inputs


def _wanted(part: CharacterisedMount, numbers: Mapping[str, str]) -> bool:
    """Whether a part may be of the number that its mount takes."""
    wanted, stated = numbers.get(part.mount.name, ""), part.identity.part_number
    return not wanted or stated in ("", wanted)


def _structure(
    content: PartScatterFile, space: DesignSpace, scatter: LibraryScatter | None
) -> ToleranceStructure:
    hardness = content.hardness_share
    if hardness is None:
        hardness = scatter.hardness.value if scatter and scatter.hardness else 0.0
    parts = []
    for entry in content.parts:
        batch = entry.batch_share if entry.batch_share is not None else content.batch_share
        if batch is None:
            batch = _measured_batch(entry.places, scatter)
        hardness_share = hardness if entry.hardness_share is None else entry.hardness_share
        parts.append(PartNumber(entry.number, entry.places, entry.pieces, hardness_share, batch))
    return part_structure(space.names, parts, hardness)


def _measured_batch(places: Sequence[str], scatter: LibraryScatter | None) -> float:
    """Mean of the batch shares of the mounts where they were measured; 0 if nowhere."""
    batches = scatter.batches if scatter else {}
    measured = [batches[place].value for place in places if place in batches]
    return float(np.mean(measured)) if measured else 0.0


def _tolerance(
    content: PartScatterFile, space: DesignSpace, scatter: LibraryScatter | None
) -> np.ndarray:
    stated = {entry.variable: entry.tolerance for entry in content.tolerances}
    unknown = [name for name in stated if name not in space.names]
    if unknown:
        raise InputError(
            f"there is a tolerance of '{unknown[0]}', which is no variable: use "
            f"{', '.join(space.names)}"
        )
    tolerance = space.tolerance.copy()
    for place, name in enumerate(space.names):
        direction = scatter.direction(name) if scatter else None
        if tolerance[place] > 0.0 and direction is not None:
            tolerance[place] = SIGMAS_PER_TOLERANCE * direction.sigma
        if name in stated:
            tolerance[place] = stated[name]
    return tolerance


def tolerance_cost(path: Path | None, variables: Sequence[str]) -> ToleranceCost:
    """Return the price of tolerances, by default 1 per direction at the tolerance `REFERENCE`.

    - `path` or None: table with the columns ``variable, weight, reference tolerance``, one row per
      variable, in any order; the weight is in any unit of money, the tolerance a plain number such
      as 0.15.
    - `variables`: of the stiffness factors.
    - raises InputError: a table that cannot be read, lacks a variable or names it twice.
    """
    if path is None:
        unit_cost = np.ones(len(variables))
        return ToleranceCost(tuple(variables), unit_cost, REFERENCE * unit_cost)
    rows = rows_of(path, ("variable", "weight", "reference tolerance"), {}, variables)
    weight, reference = (
        np.array([row.number(column) for row in rows])
        for column in ("weight", "reference tolerance")
    )
    return ToleranceCost(tuple(variables), weight, reference)


def rows_of(
    path: Path, plain: Sequence[str], with_unit: Mapping[str, str], names: Sequence[str]
) -> list[Row]:
    """Return the row of each name in a table, whose first plain column names them.

    - raises InputError: as `read_rows`; a name that is unknown, comes twice or has no row.
    """
    rows: dict[str, Row] = {}
    for row in read_rows(path, plain, with_unit):
        name = row.filled(plain[0])
        if name in rows or name not in names:
            raise row.error(f"'{name}' is named twice or is none of {list(names)}")
        rows[name] = row
    missing = [name for name in names if name not in rows]
    if missing:
        raise InputError(f"{path}: there is no row for {missing}: give every {plain[0]} one")
    return [rows[name] for name in names]


def target_limits(
    wanted: Sequence[str] | None, vehicles: Sequence[str], levels: RealArray
) -> RealArray | None:
    """Return the limit of each vehicle, shape (v,) [dB(A)], from its own level; None if none.

    ``52.5`` is a limit for all, ``U06-1=52.5`` for one [dB(A)], ``+0.5`` above the own level [dB].

    - raises InputError: an unknown vehicle, one without a limit or with two, or no number.
    """
    if not wanted:
        return None
    limits: dict[str, float] = {}
    for text in wanted:
        name, has_name, number = text.rpartition("=")
        try:
            value = float(number)
        except ValueError:
            value = np.nan
        if not np.isfinite(value) or (has_name and name not in vehicles):
            raise InputError(
                f"limit '{text}': write a level in dB(A), +dB above the design's own, or "
                f"vehicle=level with one of {', '.join(vehicles)}"
            )
        for vehicle, level in zip(vehicles, levels, strict=True):
            if has_name and vehicle != name:
                continue
            if vehicle in limits:
                raise InputError(f"limit '{text}': {vehicle} has one already, give it one")
            limits[vehicle] = value + float(level) * number.startswith("+")
    missing = [vehicle for vehicle in vehicles if vehicle not in limits]
    if missing:
        raise InputError(f"there is no limit of {', '.join(missing)}: give every vehicle one")
    return np.array([limits[vehicle] for vehicle in vehicles])


@dataclass(frozen=True, eq=False)
class Verified:
    """σ of the mean level [dB], share within the limits and its lower 95 % bound, nan without."""

    sigma: float
    share: float
    share_lower: float


@dataclass(frozen=True, eq=False)
class ToleranceTask:
    """One design whose tolerances shall reach a σ, or a share within limits (v,) of SPLV.

    `sigma`: of the mean level [dB], today's by default; `share`: of parts × vehicles within the
    limits [1]; `draws`: with which tolerances are verified; `seed`: from 1.
    """

    robust: Robust
    allocator: Allocator
    limits: RealArray | None
    sigma: float | None
    share: float
    draws: int
    seed: int

    @property
    def per_line(self) -> float:
        """Factor from a sum over vehicles and lines to the mean over both [1]."""
        index: Any = self.robust.evaluate
        return float(1.0 / (index.n_lines * len(index.response_names)))

    def reached(self, find: Callable[[Target], Allocation]) -> Allocation:
        """Return what is found for the target.

        A share is asked for a little higher, or lower, until new draws show the wanted share with
        95 % confidence and hardly more: what is chosen by few draws suits these draws best.
        """
        if self.limits is None:
            wanted = self.sigma
            today = self.allocator.at(self.allocator.today).sigma_sum
            return find(self._sigma(today if wanted is None else wanted / self.per_line))
        tried: list[tuple[float, Allocation]] = []
        share = self._share(self.share)
        for _ in range(ROUNDS):
            try:
                allocation = find(share)
            except InputError:
                if not tried:
                    raise
                break
            lower = self.verified(allocation.tolerance, "allocation check").share_lower
            over = lower - self.share
            tried.append((over, allocation))
            if 0.0 <= over <= CLOSE or not 0.0 < share.share - over < 1.0:
                break
            share = replace(share, share=share.share - over + 0.5 * CLOSE)
        confirmed = [row for row in tried if row[0] >= 0.0]
        if confirmed:
            return min(confirmed, key=lambda row: row[1].total_cost)[1]
        return max(tried, key=lambda row: row[0])[1]

    def verified(self, tolerance: RealArray, purpose: str) -> Verified:
        """Evaluate tolerances, shape (k,), with draws that nothing was chosen by."""
        robust = with_draws(self.robust, purpose, self.draws, self.seed)
        whole = robust.space.tolerance.copy()
        whole[[robust.space.names.index(name) for name in self.allocator.names]] = tolerance
        robust = replace(robust, space=replace(robust.space, tolerance=whole))
        values = robust.made_responses(self.allocator.effect.design)[1]
        sigma = float(values.std(axis=0, ddof=1).sum() * self.per_line)
        if self.limits is None:
            return Verified(sigma, np.nan, np.nan)
        good = (values <= self.limits).mean(axis=1)
        error = float(good.std(ddof=1) / np.sqrt(self.draws))
        share = float(good.mean())
        return Verified(sigma, share, share - ONE_SIDED_95 * error)

    def _sigma(self, total: float) -> SigmaTarget:
        return SigmaTarget(total, self.per_line, "σ of the mean level [dB]")

    def _share(self, share: float) -> ShareTarget:
        index: Any = self.robust.evaluate
        return ShareTarget(np.asarray(self.limits), share, scale=1.0 / index.n_lines, unit="dB")


def with_draws(robust: Robust, purpose: str, n_samples: int, seed: int) -> Robust:
    """Return a model with other draws, for choosing tolerances or for checking them."""
    sample = sobol_sample(robust.n_draws, n_samples, seed=seed, purpose=purpose)
    return replace(robust, sample=sample)
