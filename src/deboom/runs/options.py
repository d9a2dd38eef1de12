"""Options of studies: from a dataclass to the command line, and types of options."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_type_hints

import numpy as np
from typer import Argument, CallbackParam, Option
from typer.models import ArgumentInfo, OptionInfo

from deboom.arrays import RealArray
from deboom.bench.choices import CalibrationLevel
from deboom.errors import InputError, naming
from deboom.explore.moments import SIGMA_SUM, STATISTICS, Estimator, Limit, Objective
from deboom.explore.robust import MOST_OBJECTIVES, Robust
from deboom.explore.scatter import (
    FreshGaussianSampler,
    ToleranceSampler,
    ToleranceStructure,
    gaussian_sample,
    sobol_sample,
)
from deboom.explore.space import DesignSpace, Evaluate
from deboom.files.made_parts import MadeParts, made_parts
from deboom.names import option_name
from deboom.vehicles.design_factor import factor_space
from deboom.vehicles.level_objectives import IDLE, PEAK, TAIL, level_objective, level_statistics


def at_least(least: int, *, power_of_two: bool = False) -> Callable[..., int]:
    """Return an option's callback that refuses fewer, or no power of two, before any work."""

    def check(option: CallbackParam, value: int) -> int:
        typed = f"--{option_name(str(option.name))} {value}"
        if value < least:
            raise InputError(f"{typed}: take at least {least}")
        if power_of_two and value & (value - 1):
            low = 1 << value.bit_length() - 1
            raise InputError(f"{typed} is no power of two: take {low} or {2 * low}")
        return value

    return check


Seed = Annotated[int, Option(help="Seed, 1 or higher; the same seed gives the same numbers.")]
"""Option of every study."""
StudiesFolder = Annotated[
    Path | None, Option(help="Folder with the script of the run; default: the studies of deboom.")
]
Level = Annotated[
    CalibrationLevel,
    Option(help="Errors of the virtual sensors: gain, position and angle, 1 sigma."),
]
Bounds = Annotated[float, Option(help="Half width of the range of stiffness factors around 1 [1].")]
Tolerance = Annotated[float, Option(help="Half width of the scatter of stiffness, 3 sigma [1].")]
Draws = Annotated[int, Option(help="Number of draws of the scatter per design, a power of two.")]
Checks = Annotated[
    int,
    Option(
        help="Number of draws of the verification, a power of two.",
        callback=at_least(8, power_of_two=True),
    ),
]
FrontRun = Annotated[Path | None, Option(help="Run of a front study; default: a new quick search.")]
CostTable = Annotated[
    Path | None, Option(help="Table with the columns variable, weight and reference tolerance.")
]
MountSet = Annotated[str, Option(help="Mount set on the bench.")]
CubicPieces = Annotated[
    int, Option(help="Number of cubic pieces per response surface.", callback=at_least(1))
]
SelfCalibration = Annotated[bool, Option(help="Let the measuring chains calibrate each other.")]
WithTruth = Annotated[
    bool, Option(help="Compare with truth/ of a virtual test; otherwise deboom never opens it.")
]
IdenticalMounts = Annotated[
    bool, Option(help="With a drawing, fit position and tilt of mounts that are one round part.")
]
ComponentLimitsFile = Annotated[
    Path | None, Option(help="TOML file with limits, to judge the component.")
]

_T = TypeVar("_T")


def expanded(options: Any) -> dict[str, inspect.Parameter]:
    """Return the options of a study by name, those of its groups among them.

    - `options`: dataclass, or an object of it. A field is an option, ``Annotated[type,
      Option(help=...)]``, a path that the user names, ``Annotated[Path, Argument(help=...)]``, or a
      group of options, which is a dataclass itself.
    - raises TypeError: two options of one name, a mistake in the study.
    """
    kind = options if isinstance(options, type) else type(options)
    hints = get_type_hints(kind, include_extras=True)
    parameters: dict[str, inspect.Parameter] = {}
    for item in fields(options):
        default = _value_of(options, item)
        new = {
            item.name: inspect.Parameter(
                item.name,
                inspect.Parameter.KEYWORD_ONLY,
                default=default,
                annotation=hints[item.name],
            )
        }
        if is_dataclass(default):
            new = expanded(default)
        doubled = parameters.keys() & new.keys()
        if doubled:
            raise TypeError(f"{type(options).__name__} has the option {sorted(doubled)} twice")
        parameters |= new
    return parameters


def _value_of(options: Any, item: Field[Any]) -> Any:
    """Return the value of a field in an object, or its default in a class; empty without one."""
    if not isinstance(options, type):
        return getattr(options, item.name)
    if item.default_factory is not MISSING:
        return item.default_factory()
    return inspect.Parameter.empty if item.default is MISSING else item.default


def is_positional(parameter: inspect.Parameter) -> bool:
    """Say whether an option is typed by its place, without a name: its type has an `Argument`."""
    return any(isinstance(mark, ArgumentInfo) for mark in _marks(parameter))


def is_hidden(parameter: inspect.Parameter) -> bool:
    """Say whether the help of a study does not show an option."""
    return any(isinstance(mark, OptionInfo) and mark.hidden for mark in _marks(parameter))


def hidden(parameter: inspect.Parameter) -> inspect.Parameter:
    """Return an option that the help does not show."""
    marks = [copy(mark) for mark in _marks(parameter)]
    for mark in marks:
        if isinstance(mark, OptionInfo):
            mark.hidden = True
    return parameter.replace(annotation=Annotated[(parameter.annotation.__origin__, *marks)])


def argument_for(parameter: inspect.Parameter, *, named: str) -> inspect.Parameter:
    """Return an argument that is typed by its place, for an option that is a path.

    - `named`: name of the argument, another one than that of the option.
    """
    help_ = next(mark.help for mark in _marks(parameter) if isinstance(mark, OptionInfo))
    argument = Argument(metavar=parameter.name.upper(), help=help_)
    return inspect.Parameter(
        named, parameter.kind, default=None, annotation=Annotated[Path | None, argument]
    )


def is_lone_flag(parameter: inspect.Parameter) -> bool:
    """Say whether an option is a flag that can only be set, such as ``--free``."""
    names: list[str] = []
    for mark in _marks(parameter):
        if isinstance(mark, OptionInfo):  # typer takes the first name for a default at first
            given = (mark.default, *(mark.param_decls or ()))
            names += [name for name in given if isinstance(name, str)]
    return isinstance(parameter.default, bool) and bool(names) and "/" not in "".join(names)


def _marks(parameter: inspect.Parameter) -> tuple[Any, ...]:
    return getattr(parameter.annotation, "__metadata__", ())


def filled(options: type[_T] | _T, arguments: Mapping[str, Any]) -> _T:
    """Return options with other values, by the names that `expanded` gives.

    - `options`: dataclass, or an object of it.
    - raises TypeError: no value for a path that the user names.
    """
    values: dict[str, Any] = {}
    for item in fields(options):  # type: ignore[arg-type]
        value = _value_of(options, item)
        if is_dataclass(value):
            value = filled(value, arguments)
        elif item.name in arguments:  # the name of a group may be that of an option in it
            value = arguments[item.name]
        if value is not inspect.Parameter.empty:
            values[item.name] = value
    return (options if isinstance(options, type) else type(options))(**values)


BAND = "FROM TO"
"""How the help of a command writes a band of frequency."""
_BAND_OPTIONS = ("--band", "--bands")
_NUMBER = r"\d+\.?\d*|\.\d+"
_JOINED = re.compile(rf"({_NUMBER})\s*[-,–]\s*({_NUMBER})")


def bands_as_declared(arguments: Sequence[str], widths: Mapping[str, int]) -> list[str]:
    """Return a command line in which ``--band`` has one value, or two, as its option declares.

    A band may be typed ``20 60``, ``20-60`` or ``20,60``, also behind an equals sign; whatever else
    follows the option is left to the option.

    - `widths`: number of values of each option, by its name.
    """
    words, done = list(arguments), list[str]()
    while words:
        name, equals, value = words.pop(0).partition("=")
        if name not in _BAND_OPTIONS or name not in widths:
            done.append(name + equals + value)
            continue
        values = [value] if equals else words[:1]
        del words[: 0 if equals else 1]
        if match := _JOINED.fullmatch("".join(values)):
            values = list(match.groups())
        elif words and all(re.fullmatch(_NUMBER, each) for each in (*values, words[0])):
            values.append(words.pop(0))
        joined = ["-".join(values)] if values else []
        done += [name, *(values if widths[name] == len(values) else joined)]
    return done


def band_of(text: str) -> tuple[float, float]:
    """Read ``10-30`` [Hz]; InputError if it is no band that rises from above 0 Hz."""
    try:
        low, high = (float(part) for part in text.split("-"))
    except ValueError:
        raise InputError(f"--band {text}: write it as {BAND} in Hz, such as 10 30") from None
    if not (0 < low < high and math.isfinite(high)):
        raise InputError(f"--band {text}: the band must rise from above 0 Hz")
    return low, high


def aims() -> dict[str, tuple[Objective, Objective]]:
    """Return the first two objectives of a search by name.

    - returns: sums over the vehicles of a statistic of their levels and of sigma, mean and sigma
      being those of the thesis; ``worst``: mean of the loudest vehicle, and largest sigma.
    """
    of_sums = {
        name: (Objective(statistic, share=TAIL), SIGMA_SUM)
        for name, statistic in level_statistics().items()
        if name not in (PEAK, IDLE) and STATISTICS[statistic].is_level
    }
    return {**of_sums, "worst": (Objective("mean", worst=True), Objective("sigma", worst=True))}


@dataclass(frozen=True)
class AimOptions:
    """Options of a study: what its search minimises, and how mean and sigma are computed."""

    objective: Annotated[
        str,
        Option(help="First two objectives of the search.", metavar="|".join(aims())),
    ] = "mean"
    also: Annotated[
        list[str] | None,
        Option(
            help="Further objective, as STATISTIC=VEHICLE, or STATISTIC for the worst vehicle; "
            f"STATISTIC is {', '.join(level_statistics())}; repeatable, at most "
            f"{MOST_OBJECTIVES - 2}."
        ),
    ] = None
    weight: Annotated[
        list[str] | None,
        Option(
            help="Weight of a vehicle in the sums, as VEHICLE=WEIGHT, such as its share of "
            "production; repeatable; others have 1."
        ),
    ] = None
    nominal_mean: Annotated[
        bool, Option(help="Take the level of the design itself in place of the mean.")
    ] = False
    control_variate: Annotated[
        bool, Option(help="Compute mean and sigma with a control variate (regression).")
    ] = False

    def __post_init__(self) -> None:
        if self.objective not in aims():
            raise InputError(f"--objective {self.objective}: take one of {', '.join(aims())}")

    def objectives(self, model: Evaluate) -> tuple[Objective, ...]:
        """Return the objectives; InputError for a statistic or a vehicle that there is not."""
        further = []
        for text in self.also or ():
            statistic, of_vehicle, vehicle = text.partition("=")
            if statistic not in level_statistics():
                raise InputError(
                    f"--also {text}: write STATISTIC or STATISTIC=VEHICLE, with one of "
                    f"{', '.join(level_statistics())}"
                )
            with naming(f"--also {text}"):
                whose = vehicle if of_vehicle else None
                further.append(level_objective(model, statistic, whose))
        return (*aims()[self.objective], *further)

    def weights(self, model: Evaluate) -> list[float] | None:
        """Return the weight of each response, None if none is stated; InputError for a wrong text.

        Others keep that of the model's data, or 1.
        """
        vehicles = model.response_names
        weights: dict[str, float] = {}
        for text in self.weight or ():
            name, _, number = text.rpartition("=")
            if name in weights:
                raise InputError(f"--weight {text}: {name} has a weight already; state it once")
            try:
                weights[name] = float(number)
            except ValueError:
                name = ""
            if name not in vehicles:
                raise InputError(
                    f"--weight {text}: write VEHICLE=WEIGHT with one of {', '.join(vehicles)}"
                )
        if not weights:
            return None
        given = getattr(model, "response_weights", None)
        usual = np.ones(len(vehicles)) if given is None else given
        return [weights.get(name, float(w)) for name, w in zip(vehicles, usual, strict=True)]


def robust_response(
    evaluate: Evaluate,
    space: DesignSpace,
    sample: ToleranceSampler,
    *,
    aims: AimOptions = AimOptions(),
    structure: ToleranceStructure | None = None,
    limits: Sequence[Limit] = (),
) -> Robust:
    """Wrap a model with scatter as a study's options ask for; see `Robust` for the rest.

    - `aims`: what the search minimises; by default the sums over the vehicles of mean and sigma.
    - `structure`: what the scatter of the variables has in common.
    - `limits`: what designs must keep.
    - raises InputError: see `AimOptions`.
    """
    return Robust(
        evaluate,
        space,
        sample,
        nominal_mean=aims.nominal_mean,
        # a parabola of the draws
        estimator=Estimator(degree=2 if aims.control_variate else 0),
        objectives=aims.objectives(evaluate),
        structure=structure,
        limits=limits,
        weights=aims.weights(evaluate),
    )


class Sampler(Enum):
    """How manufacturing scatter is drawn."""

    sobol = "sobol"
    """Scrambled Sobol points, shared by all designs."""
    gaussian = "gaussian"
    """Gaussian draws, shared by all designs."""
    fresh = "fresh"
    """Gaussian draws of its own for every design: the literal thesis."""


_MAKERS: dict[Sampler, Callable[..., ToleranceSampler]] = {
    Sampler.sobol: sobol_sample,
    Sampler.gaussian: gaussian_sample,
    Sampler.fresh: FreshGaussianSampler,
}


def tolerance_sample(
    sampler: Sampler, n_variables: int, n_samples: int, *, seed: int
) -> ToleranceSampler:
    """Draw the manufacturing scatter of a study: `n_samples` of `n_variables`, seed from 1.

    - raises InputError: seed 0, or a number of draws that the sampler refuses.
    """
    return _MAKERS[sampler](n_variables, n_samples, seed=seed)


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
