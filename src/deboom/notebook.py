"""A platform in a notebook: from its folder to model, front, tolerances and sensitivities.

Each function does in one call what a study does with its options; words are checked here, and the
rooms below get types. `import deboom` offers all of them.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
import pandas as pd

from deboom.errors import InputError
from deboom.explore import front as fronts
from deboom.explore.correlation import Correlations, correlations
from deboom.explore.doe import Doe, latin_hypercube, run_doe
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
from deboom.explore.space import DesignSpace, Evaluate, check_same_names, checked_model, responses
from deboom.explore.tolerance_allocation import (
    Allocation,
    Allocator,
    SigmaTarget,
    ToleranceCost,
    ToleranceEffect,
)
from deboom.explore.workers import workers_for
from deboom.files import platform as platform_files
from deboom.files.doe_table import doe_frame
from deboom.study.compare import common_judges
from deboom.study.front import Front
from deboom.study.platform_model import (
    DEMONSTRATION,
    MotionOptions,
    MountSource,
    operation,
    study_band,
)
from deboom.tabled import Tabled
from deboom.vehicles.booming_model import BoomingModel, Motion
from deboom.vehicles.fleet import Fleet

_Choice = TypeVar("_Choice", bound=Enum)


class Platform(platform_files.Platform):
    """Everything measured on one platform, and the model of its noise; made by `read_platform`.

    Parameters
    ----------
    name, title, description : str
        Short key, a name for readers, a paragraph.
    folder : Path
        Folder that it was read from.
    mounts : tuple of Mount
        Mounts in the order of the design variables, positions in m.
    powertrain : Powertrain or None
        Mass [kg] and inertia [kg m²], with tolerances; None: not stated.
    fleet : Fleet
        Vehicles with their noise transfer functions, (n_frequency, 1, n_path) [Pa/N].
    load_cases : tuple of LoadCase
        Runs: displacements [m] and forces [N] at the mounts, (n_frequency, n_channel).
    default_load_case : str
        Name of the load case that is meant when none is asked for.
    input_files, cylinders : tuple of Path, int or None
        Every file that was read; cylinders of the engine, None for an electric drive.

    Raises
    ------
    InputError
        `model` and `load_case`: a word or name that the platform does not know.

    Examples
    --------
    >>> import deboom
    >>> platform = deboom.read_platform("u06")
    >>> platform.name, len(platform.fleet.names)
    ('u06_f39_f45', 15)
    """

    def model(
        self,
        *,
        vehicles: str | Sequence[str] | None = None,
        band: tuple[float, float] | None = None,
        motion: str | Motion | None = None,
        mounts: str | MountSource = "library",
        load_cases: Sequence[str] | None = None,
    ) -> BoomingModel:
        """Return the sound pressure level of vehicles as a function of mount stiffnesses.

        Parameters
        ----------
        vehicles : str or sequence of str, optional
            Group of vehicles, or vehicles by name; by default all vehicles of the platform.
        band : (lower, upper), optional
            Lines that count, both edges included; by default 20 to 60 Hz, or all lines of data that
            do not span them [Hz].
        motion : str, optional
            ``"coupled"``, the default where the data allow it: the motion of the powertrain is
            solved again for every design; ``"prescribed"``: it moves as measured, as in the thesis;
            ``"amplitude"``: coupled, and stiffnesses follow the amplitudes, too.
        mounts : str
            ``"library"``: forces of the response surfaces in the platform's mount library;
            ``"library-inside"``: the same where they are backed by measurements, else measured
            forces; ``"spectra"``: measured forces.
        load_cases : sequence of str, optional
            Load cases such as ``"g5_wot220"`` or ``"g5_wot220=2"`` with a weight; by default the
            platform's default one.

        Returns
        -------
        BoomingModel
            Designs, shape (n, k) [1] → SPLV of each vehicle, shape (n, v) [dB(A)].

        Raises
        ------
        InputError
            An unknown word, vehicle or load case; a band that reaches beyond the measured lines;
            data that the motion needs and the platform does not have.

        Examples
        --------
        >>> import deboom
        >>> model = deboom.read_platform("u06").model(vehicles="U06", motion="coupled")
        >>> len(model.variable_names), model.response_names[0]
        (12, 'U06-1')
        """
        lines = self.load_cases[0].force.frequency
        if band is not None and not lines[0] <= band[0] < band[1] <= lines[-1]:
            raise InputError(
                f"the band from {band[0]:g} to {band[1]:g} Hz is not inside the measured "
                f"{lines[0]:g} to {lines[-1]:g} Hz: give a lower and an upper edge within them"
            )
        band = study_band(self) if band is None else band
        chosen, source = self._listening(vehicles), _choice(MountSource, mounts, "mounts")
        runs = operation(chosen, load_cases, source, None, band)
        chosen_motion = None if motion is None else _choice(Motion, motion, "motion")
        return MotionOptions(chosen_motion).index(runs)

    def _listening(self, vehicles: str | Sequence[str] | None) -> Platform:
        """Return the platform with some of its vehicles only."""
        members = self.fleet.vehicles
        if vehicles is None:
            return self
        names = [vehicles] if isinstance(vehicles, str) else list(vehicles)
        for name in names:
            _known(name, [*self.fleet.names, *(member.group for member in members)], "vehicle")
        kept = tuple(one for one in members if one.name in names or one.group in names)
        return replace(self, fleet=Fleet(kept))


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
    shipped = str(folder).lower() == "u06"
    read = platform_files.read_platform(DEMONSTRATION if shipped else Path(folder))
    return Platform(**vars(read))


def Robust(
    model: Evaluate, space: DesignSpace, *, draws: int = 128, seed: int = 1
) -> RobustResponse:
    """Wrap a model with the scatter of manufacture: ΣSPLV and Σσ(SPLV) over shared draws.

    Parameters
    ----------
    model : BoomingModel, ResponseFunction or any other evaluation
        Designs, shape (n, k) → responses, shape (n, r); called with all draws of a design at once.
    space : DesignSpace
        Bounds and tolerances of its k variables.
    draws : int
        Draws of the scatter, a power of two; every design meets the same ones.
    seed : int
        Seed of the draws, from 1.

    Returns
    -------
    RobustResponse
        Designs → mean and standard deviation of each response, shape (n, r) [unit of the
        responses], and their sums.

    Raises
    ------
    InputError
        A model without names; variables that differ; a number of draws that is no power of two; a
        seed below 1.

    Examples
    --------
    >>> import deboom
    >>> square = deboom.ResponseFunction(lambda x: x**2, ("a",), ("y",), "dB")
    >>> robust = deboom.Robust(square, square.design_space(), draws=64)
    >>> robust([[1.0]]).mean.round(3)
    array([[1.002]])
    """
    _fitting(model, space)
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
        Designs per generation, at least 4, and generations, at least 1.
    seed : int
        Seed from 1; the same seed gives the same front for any number of workers.
    workers : int
        Processes that evaluate a generation.
    verified_with : int
        Draws of the verification, a power of two.

    Returns
    -------
    Front
        ``front.table``, one row per design: sums over vehicles and lines [dB(A)], and means per
        line and vehicle; ``front.designs()`` [units of the space]; ``front.picks``.

    Raises
    ------
    InputError
        A budget, draws or a seed that cannot be; a front that fails under the new draws.

    Examples
    --------
    >>> import deboom
    >>> model = deboom.ResponseFunction(lambda x: (x - 0.9) ** 2, ("a",), ("y",), "dB")
    >>> robust = deboom.Robust(model, model.design_space(), draws=64)
    >>> front = deboom.search(robust, population=8, generations=4)
    >>> abs(front.search.front.designs[front.picks["best mean"], 0] - 0.9) < 0.1
    np.True_
    """
    with workers_for(robust, workers) as evaluation:
        searched = nsga2(evaluation, population, generations, seed=seed)
    judge = fronts.replicates(robust, verified_with, seed=seed)
    return Front(robust, searched, searched.front, judge, fronts.verify(searched.front, judge))


def verify(front: Front, *, draws: int = 1024, seed: int) -> Front:
    """Evaluate the designs of a front again, with draws that its search never saw.

    Parameters
    ----------
    front : Front
        As `search` found it.
    draws : int
        Draws of the scatter, a power of two.
    seed : int
        Seed from 1; take another than in `search`, whose verification it would only repeat.

    Returns
    -------
    Front
        The same designs under the new draws, with ``mean_bias`` and ``sigma_bias_percent``.

    Raises
    ------
    InputError
        A front that fails altogether under the new draws; draws or a seed that cannot be.

    Examples
    --------
    >>> import deboom
    >>> model = deboom.ResponseFunction(lambda x: (x - 0.9) ** 2, ("a",), ("y",), "dB")
    >>> robust = deboom.Robust(model, model.design_space(), draws=64)
    >>> front = deboom.search(robust, population=8, generations=4)
    >>> bool(deboom.verify(front, draws=512, seed=2).nondominated.any())
    True
    """
    judge = fronts.replicates(front.robust, draws, seed=seed)
    return replace(front, judge=judge, values=fronts.verify(front.searched, judge))


def compare(first: Front, second: Front, *, draws: int = 1024, seed: int = 1) -> fronts.Difference:
    """Say whether one front is really better than another, or whether it could be chance.

    Parameters
    ----------
    first, second : Front
        Fronts of the same variables and responses; the model of the first one judges both.
    draws : int
        Common draws of the scatter that both meet, a power of two of at least 16.
    seed : int
        Seed of these draws, from 1.

    Returns
    -------
    Difference
        First minus second, as a share of the hypervolume of their common box [1]; ``noise``, the
        largest difference that 99 % still call chance; ``verdict``.

    Raises
    ------
    InputError
        Fronts of other variables or responses; draws that cannot be.

    Examples
    --------
    >>> import deboom
    >>> model = deboom.ResponseFunction(lambda x: (x - 0.9) ** 2, ("a",), ("y",), "dB")
    >>> robust = deboom.Robust(model, model.design_space(), draws=64)
    >>> front = deboom.search(robust, population=8, generations=4)
    >>> deboom.compare(front, front).verdict.value
    'within noise'
    """
    names = [(one.variables, one.vehicles) for one in (first, second)]
    if names[0] != names[1]:
        raise InputError(f"fronts of {names[0]} and {names[1]} do not compare: search both alike")
    judges = common_judges(first.robust, draws, seed)
    by_set = [
        [values.objectives for values in judges.by_set(front.search.front.designs)]
        for front in (first, second)
    ]
    box = fronts.common_box([np.mean(values, axis=0) for values in by_set])
    return fronts.difference(
        *(
            fronts.Contestant(
                name,
                np.array([[box.hypervolume(values) for values in sets]]),
                np.array([box.share(fronts.last_gain(front.search.hypervolume))]),
            )
            for name, sets, front in zip(("first", "second"), by_set, (first, second), strict=True)
        )
    )


def allocate_tolerances(
    robust: RobustResponse,
    design: npt.ArrayLike,
    *,
    sigma: float | None = None,
    tightest: float = 0.05,
    widest: float = 0.30,
) -> Allocation:
    """Return the cheapest tolerances of a design that keep the scatter of its responses.

    Parameters
    ----------
    robust : RobustResponse
        Model with a gradient, and draws of the scatter.
    design : array, shape (k,)
        Design that is made [units of the space].
    sigma : float, optional
        Sum of the standard deviations that is kept [unit of the responses]; by default that of
        today's tolerances.
    tightest, widest : float
        Bounds of every tolerance, half widths of three standard deviations [1].

    Returns
    -------
    Allocation
        ``tolerance``, shape (k,) [1]; the price of each is today's tolerance over it, so that
        today's costs 1.

    Raises
    ------
    InputError
        A model without gradient; bounds that cannot be; a scatter that the tightest ones miss.

    Examples
    --------
    >>> import deboom
    >>> model = deboom.read_platform("u06").model(vehicles="U06", motion="prescribed")
    >>> robust = deboom.Robust(model, model.design_space(), draws=64)
    >>> table = deboom.allocate_tolerances(robust, robust.space.nominal).table
    >>> table.loc[table["tolerance [%]"].idxmin(), "variable"]
    'TSM x'
    """
    space = robust.space
    cost = ToleranceCost(space.names, np.ones(space.n_variables), space.tolerance)
    effect = ToleranceEffect(robust, np.asarray(design, dtype=float))
    allocator = Allocator(effect, cost, np.asarray(tightest), np.asarray(widest))
    kept = allocator.at(allocator.today).sigma_sum if sigma is None else sigma
    return allocator.cheapest(SigmaTarget(kept))


@dataclass(frozen=True, eq=False)
class Experiment(Tabled):
    """Designs with their responses.

    Parameters
    ----------
    doe : Doe
        Designs, responses, failures.
    n_lines : int
        Lines that each response is the sum of.
    """

    doe: Doe
    n_lines: int = 1

    @property
    def table(self) -> pd.DataFrame:
        """One row per design: variables, responses, their sum, and mean per response and line."""
        unit, names = self.doe.response_unit, self.doe.response_names
        table = doe_frame(self.doe)
        total = table[[f"{name} [{unit}]" for name in names]].sum(axis=1, skipna=False)
        mean = total / (len(names) * self.n_lines)
        return table.assign(**{f"sum [{unit}]": total, f"mean per line [{unit}]": mean})


def doe(model: Evaluate, space: DesignSpace, *, n: int = 256, seed: int = 1) -> Experiment:
    """Evaluate a Latin hypercube of designs.

    Parameters
    ----------
    model : BoomingModel or any other evaluation
        Designs, shape (n, k) → responses, shape (n, r).
    space : DesignSpace
        Bounds of the designs.
    n : int
        Number of designs, at least 2.
    seed : int
        Seed from 1.

    Returns
    -------
    Experiment
        ``table``: variables [units of the space], responses, their sums; ``doe``: the arrays.

    Raises
    ------
    InputError
        A model without names; variables that differ; fewer than 2 designs; a seed below 1.

    Examples
    --------
    >>> import deboom
    >>> square = deboom.ResponseFunction(lambda x: x**2, ("a",), ("y",), "dB")
    >>> deboom.doe(square, square.design_space(), n=16).table.shape[0]
    16
    """
    _fitting(model, space)
    designs = latin_hypercube(space, n, seed=seed)
    run = run_doe(model, space, designs, name="notebook", plan=f"{n} designs, seed {seed}")
    return Experiment(run, getattr(model, "n_lines", 1))


def correlation(experiment: Experiment, *, seed: int = 1, resamples: int = 1000) -> Correlations:
    """Correlate all pairs of responses over the designs of a DOE (thesis, figures 44 and 45).

    Parameters
    ----------
    experiment : Experiment
        Of at least two responses and ten designs, see `doe`.
    seed, resamples : int
        Seed from 1 and resamples, at least 100, of the bootstrap behind the intervals.

    Returns
    -------
    Correlations
        Pearson's coefficients with 95 % intervals, and Spearman's, shape (r, r) [1].

    Raises
    ------
    InputError
        One response, too few designs or resamples, or a response that does not vary.

    Examples
    --------
    >>> import deboom, numpy as np
    >>> two = deboom.ResponseFunction(lambda x: np.c_[x, 2 * x], ("a",), ("y", "z"), "dB")
    >>> experiment = deboom.doe(two, two.design_space(), n=16)
    >>> round(float(deboom.correlation(experiment, resamples=100).pearson[0, 1]), 6)
    1.0
    """
    computed = experiment.doe
    return correlations(computed.computed, computed.response_names, seed=seed, resamples=resamples)


@dataclass(frozen=True, eq=False)
class Sensitivities(Tabled):
    """Indices of an analysis by SALib.

    Parameters
    ----------
    problem : mapping
        SALib's own problem dictionary.
    indices : SobolIndices or MorrisEffects
        As arrays, (factor, output).
    unit : str
        Unit of the responses.
    n_lines : int
        Lines that each response is the sum of.
    """

    problem: Mapping[str, Any]
    indices: SobolIndices | MorrisEffects
    unit: str
    n_lines: int = 1

    @property
    def table(self) -> pd.DataFrame:
        """One row per variable and response."""
        indices = self.indices
        if isinstance(indices, SobolIndices):
            columns = {
                "first [1]": indices.first,
                "total [1]": indices.total,
                "total ± 95 % [1]": indices.total_interval,
            }
        else:
            columns = {
                f"mu* [{self.unit}]": indices.mu_star,
                f"sigma [{self.unit}]": indices.sigma,
                f"mu* per line [{self.unit}]": indices.mu_star / self.n_lines,
            }
        rows = pd.MultiIndex.from_product(
            (indices.factors, indices.outputs), names=("variable", "response")
        ).to_frame(index=False)
        return rows.assign(**{name: values.ravel() for name, values in columns.items()})


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
        Base points, a power of two from 8; n (k + 2) designs are evaluated.
    seed, resamples : int
        Seed from 1 and bootstrap resamples of the intervals, at least 2.

    Returns
    -------
    Sensitivities
        First and total indices, shape (k, r) [1], with 95 % intervals; ``problem`` is SALib's
        dictionary.

    Raises
    ------
    InputError
        Wrong names, counts or seed; a response that does not vary or is not finite, by name.

    Examples
    --------
    >>> import deboom, numpy as np
    >>> add = deboom.ResponseFunction(lambda x: x @ [[1.0], [2.0]], ("a", "b"), ("y",), "dB")
    >>> table = deboom.sobol(add, add.design_space(), n=256).table
    >>> table["total [1]"].round(1).tolist()
    [0.2, 0.8]
    """
    _fitting(model, space)
    inputs = design_inputs(space)
    designs = sobol_designs(inputs, n, seed=seed)
    values = responses(model, designs)
    names, outputs = space.names, model.response_names
    indices = sobol_indices(values, names, outputs, seed=seed, n_resamples=resamples)
    lines = getattr(model, "n_lines", 1)
    return Sensitivities(salib_problem(inputs), indices, model.response_unit, lines)


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
        Trajectories, at least 2; each takes k + 1 designs.
    seed : int
        Seed from 1.

    Returns
    -------
    Sensitivities
        ``mu*`` and ``sigma``, shape (k, r) [unit of the responses]; ``problem`` is SALib's
        dictionary.

    Raises
    ------
    InputError
        Wrong names, counts or seed; a response that does not vary or is not finite, by name.

    Examples
    --------
    >>> import deboom
    >>> add = deboom.ResponseFunction(lambda x: x @ [[1.0], [2.0]], ("a", "b"), ("y",), "dB")
    >>> table = deboom.morris(add, add.design_space(), trajectories=8).table
    >>> (table["mu* [dB]"] / table["mu* [dB]"][0]).round(6).tolist()
    [1.0, 2.0]
    """
    _fitting(model, space)
    inputs = design_inputs(space)
    designs = morris_designs(inputs, trajectories, seed=seed)
    values = responses(model, designs)
    effects = morris_analysis(inputs, designs, values, model.response_names, seed=seed)
    lines = getattr(model, "n_lines", 1)
    return Sensitivities(salib_problem(inputs), effects, model.response_unit, lines)


def _fitting(model: Evaluate, space: DesignSpace) -> None:
    """Refuse a model that does not say its names, or has not the variables of the space."""
    names = checked_model(model).variable_names
    check_same_names("the model has the variables", names, space.names)


def _choice(kind: type[_Choice], word: str | _Choice, item: str) -> _Choice:
    """Return the member of an Enum that a word names."""
    if isinstance(word, kind):
        return word
    return kind(_known(str(word), [str(member.value) for member in kind], item))


def _known(word: str, words: Sequence[str], item: str) -> str:
    """Return a word that is one of those known, or refuse it with the nearest one."""
    if word in words:
        return word
    close = difflib.get_close_matches(word, words, n=1)
    known = ", ".join(dict.fromkeys(words))
    hint = f"did you mean '{close[0]}'?" if close else f"use one of {known}"
    raise InputError(f"{item} '{word}' is unknown: {hint}")
