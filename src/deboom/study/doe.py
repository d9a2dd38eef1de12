"""The designs of a study: which plan, which bounds, and whether an earlier DOE goes on."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.classical_plans import (
    box_behnken,
    central_composite,
    fractional_factorial,
    full_factorial,
    resolution,
    within_bounds,
)
from deboom.explore.design_space import DesignSpace
from deboom.explore.doe import Doe, continue_doe, run_doe
from deboom.explore.evaluate import Evaluate
from deboom.explore.space_filling import latin_hypercube, sobol_designs
from deboom.files.doe_table import read_designs, read_doe
from deboom.study.mount_source import Operation


class Plan(Enum):
    """How designs are laid out within their bounds."""

    latin_hypercube = "latin-hypercube"
    """Space-filling, maximin; any number of designs."""
    sobol = "sobol"
    """Space-filling, scrambled Sobol points; a power of two."""
    full_factorial = "full-factorial"
    """All corners."""
    fractional_factorial = "fractional-factorial"
    """The corners that ``--generators`` keep."""
    box_behnken = "box-behnken"
    """Edges and middle, no corner."""
    central_composite = "central-composite"
    """Corners (those of ``--generators``, if given), star and middle."""


@dataclass(frozen=True)
class DoeRequest:
    """What a study was asked to evaluate.

    Parameters
    ----------
    plan : Plan
        Of the new designs.
    n_designs : int
        Of a space-filling plan; the classical ones have their own number.
    seed : int
        Of a space-filling plan, from 1.
    generators : str, optional
        Of a fractional factorial, see `deboom.explore.classical_plans.fractional_factorial`.
    table : Path, optional
        A user's own designs instead of a plan, see `deboom.files.doe_table.read_designs`.
    append_to : Path, optional
        ``doe.csv`` of an earlier run; its designs come first and are not evaluated again.
    """

    plan: Plan
    n_designs: int
    seed: int
    generators: str | None = None
    table: Path | None = None
    append_to: Path | None = None

    @property
    def inputs(self) -> tuple[Path, ...]:
        """Files that the designs come from."""
        return tuple(path for path in (self.table, self.append_to) if path is not None)

    @property
    def words(self) -> str:
        """What the designs are, in words."""
        if self.table is not None:
            return f"table {self.table.name}"
        if self.plan in (Plan.latin_hypercube, Plan.sobol):
            kind = {Plan.latin_hypercube: "Latin hypercube (maximin)", Plan.sobol: "Sobol"}
            return f"{kind[self.plan]}, seed {self.seed}"
        if self.plan is Plan.fractional_factorial:
            return f"fractional factorial of resolution {resolution(self._generators)}"
        return str(self.plan.value).replace("-", " ")

    @property
    def _generators(self) -> str:
        if self.generators is None:
            raise InputError(
                "a fractional factorial needs --generators: one word of letters per variable, such "
                "as 'a b c abc'"
            )
        return self.generators

    def designs(self, space: DesignSpace) -> RealArray:
        """Return the asked designs, shape (n, k) [units of the space].

        Raises
        ------
        InputError
            See the plans and `deboom.files.doe_table.read_designs`; a fractional factorial without
            generators.
        """
        if self.table is not None:
            return read_designs(self.table, space)
        if self.plan is Plan.latin_hypercube:
            return latin_hypercube(space, self.n_designs, seed=self.seed)
        if self.plan is Plan.sobol:
            return sobol_designs(space, self.n_designs, seed=self.seed)
        return within_bounds(space, self._coded(space.n_variables))

    def _coded(self, n_variables: int) -> RealArray:
        if self.plan is Plan.box_behnken:
            return box_behnken(n_variables)
        if self.plan is Plan.fractional_factorial:
            return fractional_factorial(self._generators)
        if self.plan is Plan.full_factorial:
            return full_factorial(n_variables)
        if self.generators is None:
            return central_composite(full_factorial(n_variables))
        return central_composite(fractional_factorial(self.generators))


def doe_name(runs: Operation, motion: str, space: DesignSpace) -> str:
    """Return the name under which a study's DOE may be continued: all that its values follow from.

    Parameters
    ----------
    runs : Operation
        Platform, load cases and band.
    motion : str
        Of the powertrain.
    space : DesignSpace
        Its bounds.
    """
    cases = " ".join(f"{case.name}={weight:g}" for case, weight in runs.cases)
    forces = "spectra" if runs.check is None else "library"
    return (
        f"{runs.platform.name}: {cases}; {runs.band[0]:g}-{runs.band[1]:g} Hz; {forces}; {motion}; "
        f"{space.lower.min():g} to {space.upper.max():g}"
    )


def study_doe(
    evaluate: Evaluate, space: DesignSpace, request: DoeRequest, name: str
) -> tuple[Doe, int]:
    """Evaluate what was asked, or add it to an earlier DOE.

    Parameters
    ----------
    evaluate : Evaluate
        The model.
    space : DesignSpace
        Its bounds.
    request : DoeRequest
        Which designs.
    name : str
        See `doe_name`.

    Returns
    -------
    doe : Doe
        All designs with their responses.
    n_known : int
        Asked designs that were known already.

    Raises
    ------
    InputError
        See `deboom.explore.doe.continue_doe` and `deboom.files.doe_table.read_doe`.
    """
    designs = request.designs(space)
    if request.append_to is None:
        doe = run_doe(evaluate, space, designs, name=name, plan=request.words)
        return doe, len(designs) - len(doe)
    earlier = read_doe(
        request.append_to, space, evaluate.response_names, evaluate.response_unit, name=name
    )
    try:
        return continue_doe(earlier, evaluate, space, designs, name=name, plan=request.words)
    except InputError as error:
        raise InputError(f"{request.append_to}: {error}") from None
