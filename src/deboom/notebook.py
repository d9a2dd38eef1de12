"""A platform in a notebook: from its folder to model, front, correlation and sensitivities.

Each function does in one call what a study does with its options; words are checked here, and the
rooms below get types. `import deboom` offers all of them.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any, TypeVar

import pandas as pd

from deboom.errors import InputError
from deboom.explore.correlation import Correlations, correlations
from deboom.explore.doe import Doe, latin_hypercube, run_doe
from deboom.explore.front import verify
from deboom.explore.robust import RobustResponse
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import nsga2
from deboom.explore.sensitivity import (
    MorrisEffects,
    SobolIndices,
    design_inputs,
    morris_analysis,
    morris_designs,
    salib_problem,
    sobol_designs,
    sobol_indices,
)
from deboom.explore.space import DesignSpace, Evaluate, responses, stiffness_factor_space
from deboom.explore.workers import workers_for
from deboom.files.doe_table import doe_frame
from deboom.files.platform import Platform
from deboom.files.platform import read_platform as read_folder
from deboom.study.front import Front
from deboom.study.platform_model import (
    DEMONSTRATION,
    MotionOptions,
    MountSource,
    operation,
)
from deboom.vehicles.booming_model import BoomingModel, Motion

_Choice = TypeVar("_Choice", bound=Enum)


def read_platform(folder: str | Path) -> Platform:
    """Read a platform: the shipped demonstration, or a folder of your own.

    Parameters
    ----------
    folder : str or Path
        ``"u06"`` for the demonstration, a virtual platform of 15 vehicles in three groups on one
        powertrain with four mounts; otherwise a folder with ``platform.toml``.

    Returns
    -------
    Platform
        Mounts, vehicles and load cases in SI.

    Raises
    ------
    InputError
        A file that is missing, damaged or does not fit the others; the sentence names it.

    Examples
    --------
    >>> import deboom
    >>> deboom.read_platform("u06").fleet.names[:2]
    ('U06-1', 'U06-2')
    """
    if str(folder).lower() == "u06":
        return read_folder(DEMONSTRATION)
    return read_folder(Path(folder))


def booming_model(
    platform: Platform,
    *,
    vehicles: str | None = None,
    band: tuple[float, float] = (20.0, 60.0),
    motion: str | Motion = "prescribed",
    mounts: str | MountSource = "library",
    load_cases: Sequence[str] | None = None,
) -> BoomingModel:
    """Return the sound pressure level of a group of vehicles as a function of mount stiffnesses.

    Parameters
    ----------
    platform : Platform
        As read by `read_platform`.
    vehicles : str, optional
        Group of vehicles; by default all vehicles of the platform.
    band : (lower, upper)
        Lines that count, both edges included [Hz].
    motion : str
        ``"prescribed"``: the powertrain moves as measured; ``"coupled"``: its motion is solved
        again for every design; ``"amplitude"``: stiffnesses follow the amplitudes, too.
    mounts : str
        ``"library"``: forces of the response surfaces in the platform's mount library;
        ``"library-inside"``: the same where they are backed by measurements, else measured forces;
        ``"spectra"``: measured forces.
    load_cases : sequence of str, optional
        Load cases such as ``"g5_wot220"`` or ``"g5_wot220=2"`` with a weight; by default the
        platform's default one.

    Returns
    -------
    BoomingModel
        Callable: designs of stiffness factors, shape (n, k) [1] → SPLV, the sum of the levels over
        the lines, shape (n, n_vehicle) [dB(A)].

    Raises
    ------
    InputError
        An unknown word, group or load case; a band without lines; data that the motion needs and
        the platform does not have.

    Examples
    --------
    >>> import deboom
    >>> model = deboom.booming_model(deboom.read_platform("u06"), vehicles="U06")
    >>> len(model.variable_names), model.response_names[0]
    (12, 'U06-1')
    """
    source = _choice(MountSource, mounts, "mounts")
    runs = operation(platform, load_cases, source, vehicles, band)
    return MotionOptions(_choice(Motion, motion, "motion")).index(runs)


def design_space(model: Evaluate, *, bounds: float = 0.20, tolerance: float = 0.15) -> DesignSpace:
    """Return the design space of stiffness factors around today's mounts, 1.

    Parameters
    ----------
    model : BoomingModel or any other evaluation
        Its variables.
    bounds : float
        Factors are searched within 1 ± this [1].
    tolerance : float
        Half width of the manufacturing scatter, three standard deviations, relative to the
        factor [1].

    Raises
    ------
    InputError
        Bounds or a tolerance that are not between 0 and 1.

    Examples
    --------
    >>> import deboom
    >>> square = deboom.ResponseFunction(lambda x: x**2, ("a",), ("y",), "dB")
    >>> deboom.design_space(square, bounds=0.1).upper
    array([1.1])
    """
    return stiffness_factor_space(model.variable_names, half_width=bounds, tolerance=tolerance)


def robust_response(
    model: Evaluate, space: DesignSpace, *, draws: int = 128, seed: int = 1
) -> RobustResponse:
    """Wrap a model with the scatter of manufacture: ΣSPLV and Σσ(SPLV) over shared draws.

    Parameters
    ----------
    model : BoomingModel or any other evaluation
        Called with all draws of a design at once.
    space : DesignSpace
        Bounds and tolerances of its variables.
    draws : int
        Draws of the scatter, a power of two; every design meets the same ones.
    seed : int
        Seed of the draws, from 1.

    Raises
    ------
    InputError
        Variables that differ, a number of draws that is no power of two, a seed below 1.

    Examples
    --------
    >>> import deboom
    >>> square = deboom.ResponseFunction(lambda x: x**2, ("a",), ("y",), "dB")
    >>> robust = deboom.robust_response(square, deboom.design_space(square), draws=64)
    >>> robust.n_objectives
    2
    """
    return RobustResponse(model, space, sobol_sample(space.n_variables, draws, seed=seed))


def search(
    robust: RobustResponse,
    *,
    population: int = 100,
    generations: int = 100,
    seed: int = 1,
    workers: int = 1,
    verified_with: int = 1024,
) -> Front:
    """Search the robust front with NSGA-II, and evaluate it again with draws it never saw.

    Parameters
    ----------
    robust : RobustResponse
        Mean and scatter of the responses.
    population, generations : int
        Budget of the search.
    seed : int
        Seed from 1; the same seed gives the same front for any number of workers.
    workers : int
        Processes that evaluate a generation.
    verified_with : int
        Draws of the verification, a power of two.

    Returns
    -------
    Front
        ``front.table()`` (pandas), ``front.picks``, ``front.compared``, ``front.picture()``.

    Raises
    ------
    InputError
        A budget or seed that makes no sense, or a front that fails under the new draws.

    Examples
    --------
    >>> import deboom
    >>> model = deboom.ResponseFunction(lambda x: (x - 0.9) ** 2, ("a",), ("y",), "dB")
    >>> robust = deboom.robust_response(model, deboom.design_space(model), draws=64)
    >>> front = deboom.search(robust, population=8, generations=4)
    >>> abs(front.search.front.designs[front.picks["best mean"], 0] - 0.9) < 0.1
    np.True_
    """
    with workers_for(robust, workers) as evaluation:
        searched = nsga2(evaluation, population, generations, seed=seed)
    return Front(robust, searched, verify(searched.front, robust, verified_with, seed=seed))


@dataclass(frozen=True, eq=False)
class Experiment:
    """Designs with their responses.

    Parameters
    ----------
    doe : Doe
        Designs, responses, failures.
    """

    doe: Doe

    @property
    def table(self) -> pd.DataFrame:
        """One row per design, columns ``name [unit]``."""
        return doe_frame(self.doe)

    def _repr_html_(self) -> str:
        return str(self.table.to_html(max_rows=12))


def doe(model: Evaluate, space: DesignSpace, *, n: int = 256, seed: int = 1) -> Experiment:
    """Evaluate a Latin hypercube of designs.

    Parameters
    ----------
    model : BoomingModel or any other evaluation
        Designs, shape (n, k) → responses, shape (n, r).
    space : DesignSpace
        Bounds of the designs.
    n : int
        Number of designs.
    seed : int
        Seed from 1.

    Raises
    ------
    InputError
        Variables that differ, or a seed below 1.

    Examples
    --------
    >>> import deboom
    >>> square = deboom.ResponseFunction(lambda x: x**2, ("a",), ("y",), "dB")
    >>> deboom.doe(square, deboom.design_space(square), n=16).table.shape[0]
    16
    """
    designs = latin_hypercube(space, n, seed=seed)
    return Experiment(
        run_doe(model, space, designs, name="notebook", plan=f"{n} designs, seed {seed}")
    )


def correlation(experiment: Experiment, *, seed: int = 1, resamples: int = 1000) -> Correlations:
    """Correlate all pairs of responses over the designs of a DOE (thesis, figures 44 and 45).

    Parameters
    ----------
    experiment : Experiment
        Of at least two responses, see `doe`.
    seed, resamples : int
        Bootstrap of the intervals.

    Returns
    -------
    Correlations
        Pearson's and Spearman's coefficients with their 95 % intervals, shape (r, r) [1].

    Raises
    ------
    InputError
        One response, too few designs, or a response that does not vary.

    Examples
    --------
    >>> import deboom, numpy as np
    >>> two = deboom.ResponseFunction(lambda x: np.c_[x, 2 * x], ("a",), ("y", "z"), "dB")
    >>> experiment = deboom.doe(two, deboom.design_space(two), n=16)
    >>> round(float(deboom.correlation(experiment, resamples=100).pearson[0, 1]), 6)
    1.0
    """
    computed = experiment.doe
    return correlations(computed.computed, computed.response_names, seed=seed, resamples=resamples)


@dataclass(frozen=True, eq=False)
class Sensitivities:
    """Indices of an analysis by SALib.

    Parameters
    ----------
    problem : mapping
        SALib's own problem dictionary.
    indices : SobolIndices or MorrisEffects
        As arrays, (factor, output).
    unit : str
        Unit of the responses.
    """

    problem: Mapping[str, Any]
    indices: SobolIndices | MorrisEffects
    unit: str

    @property
    def table(self) -> pd.DataFrame:
        """One row per variable and response."""
        found = self.indices
        if isinstance(found, SobolIndices):
            columns = {
                "first [1]": found.first,
                "total [1]": found.total,
                "total ± 95 % [1]": found.total_interval,
            }
        else:
            columns = {f"mu* [{self.unit}]": found.mu_star, f"sigma [{self.unit}]": found.sigma}
        rows = pd.MultiIndex.from_product(
            (found.factors, found.outputs), names=("variable", "response")
        ).to_frame(index=False)
        return rows.assign(**{name: values.ravel() for name, values in columns.items()})

    def _repr_html_(self) -> str:
        return str(self.table.to_html(max_rows=12))


def sobol(
    model: Evaluate, space: DesignSpace, *, n: int = 1024, seed: int = 1, resamples: int = 100
) -> Sensitivities:
    """Return Sobol indices of every response, computed by SALib.

    Parameters
    ----------
    model : BoomingModel or any other evaluation
        Designs, shape (n, k) → responses, shape (n, r).
    space : DesignSpace
        Range of the variables.
    n : int
        Base points, a power of two; n (k + 2) designs are evaluated.
    seed, resamples : int
        Seed from 1 and bootstrap resamples of the intervals.

    Raises
    ------
    InputError
        A response that does not vary or is not finite, by name.

    Examples
    --------
    >>> import deboom, numpy as np
    >>> add = deboom.ResponseFunction(lambda x: x @ [[1.0], [2.0]], ("a", "b"), ("y",), "dB")
    >>> table = deboom.sobol(add, deboom.design_space(add), n=256).table
    >>> table["total [1]"].round(1).tolist()
    [0.2, 0.8]
    """
    inputs = design_inputs(space)
    designs = sobol_designs(inputs, n, seed=seed, second_order=False)
    values = responses(model, designs)
    names, outputs = space.names, model.response_names
    indices = sobol_indices(
        values, names, outputs, seed=seed, second_order=False, n_resamples=resamples
    )
    return Sensitivities(salib_problem(inputs), indices, model.response_unit)


def morris(
    model: Evaluate, space: DesignSpace, *, trajectories: int = 50, seed: int = 1
) -> Sensitivities:
    """Return the elementary effects of Morris of every response, computed by SALib.

    Parameters
    ----------
    model : BoomingModel or any other evaluation
        Designs, shape (n, k) → responses, shape (n, r).
    space : DesignSpace
        Range of the variables.
    trajectories : int
        Trajectories; each takes k + 1 designs.
    seed : int
        Seed from 1.

    Raises
    ------
    InputError
        A response that does not vary or is not finite, by name.

    Examples
    --------
    >>> import deboom
    >>> add = deboom.ResponseFunction(lambda x: x @ [[1.0], [2.0]], ("a", "b"), ("y",), "dB")
    >>> table = deboom.morris(add, deboom.design_space(add), trajectories=8).table
    >>> (table["mu* [dB]"] / table["mu* [dB]"][0]).round(6).tolist()
    [1.0, 2.0]
    """
    inputs = design_inputs(space)
    designs = morris_designs(inputs, trajectories, seed=seed)
    values = responses(model, designs)
    effects = morris_analysis(inputs, designs, values, model.response_names, seed=seed)
    return Sensitivities(salib_problem(inputs), effects, model.response_unit)


def _choice(kind: type[_Choice], word: str | _Choice, item: str) -> _Choice:
    """Return the member of an Enum that a word names."""
    if isinstance(word, kind):
        return word
    words = [str(member.value) for member in kind]
    if word in words:
        return kind(word)
    close = difflib.get_close_matches(str(word), words, n=1)
    hint = f"did you mean '{close[0]}'?" if close else f"use one of {', '.join(words)}"
    raise InputError(f"{item} '{word}' is unknown: {hint}")
