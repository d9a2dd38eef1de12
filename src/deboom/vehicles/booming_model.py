"""The booming index of a fleet: designs of the mounts in, SPLV of every vehicle out."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray, short_repr
from deboom.errors import DataWarning, InputError
from deboom.explore.space import DesignSpace, checked_designs, stiffness_factor_space
from deboom.measurement.channels import Band, LoadCase
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.mount import Mount
from deboom.mounts.surface_forces import identified_surfaces
from deboom.physics import sound_level, transfer_path
from deboom.vehicles.amplitude_motion import AmplitudeMotion, amplitude_motion, solve_along_lines
from deboom.vehicles.coupled_motion import coupled_motion
from deboom.vehicles.design_factor import Factor
from deboom.vehicles.fleet import Fleet, PathContributions, path_contributions
from deboom.vehicles.kernels import Case, LevelSum, PullBack, level_sum
from deboom.vehicles.path_analysis import PathAnalysis
from deboom.vehicles.powertrain import KinematicModel, Powertrain
from deboom.vehicles.receivers import EAR, Receiver

PART_SUFFIX = " part"
"""What the name of a part's number adds to that of its mount."""


class Motion(Enum):
    """What the powertrain does when a stiffness changes."""

    prescribed = "prescribed"
    """It moves as measured: the thesis."""
    coupled = "coupled"
    """Its six degrees of freedom and those of the wheel ends are solved again."""
    amplitude = "amplitude"
    """So are they, and the stiffnesses follow the amplitudes that come out."""


@dataclass(frozen=True, eq=False)
class BoomingModel:
    """SPLV of every vehicle over weighted load cases, as a function of the stiffness factors.

    An exploration needs only ``model(designs)``. The object is a value: it can be pickled into a
    process pool, and a design gives the same bits in every batch and order of designs.

    Parameters
    ----------
    cases : sequence of PathContributions, CoupledMotion or AmplitudeMotion
        Load cases of the same vehicles, lines and variables: motion prescribed, coupled, or coupled
        with stiffnesses that follow the amplitude.
    weights : sequence of float
        Weights of the load cases, not negative; kept normalised to a sum of 1, without load cases
        of weight 0 [1].
    loss_factors : bool
        Whether the cases are split into elastic and lossy parts: designs are stiffness factors x,
        then loss factors y, and the parts have the factors x and x y.
    receivers : sequence of Receiver, optional
        Receiver of each response; by default the ears of the vehicles.
    idle : sequence of callable, optional
        Levels of the same receivers at idle, functions of the same designs; they are in no sum,
        see `deboom.vehicles.idle.IdleModel`.
    compiled : bool, optional
        Whether compiled loops sum the levels; otherwise numpy does, as a reference, in 27 times
        the time with coupled motion and 178 times with amplitude-dependent stiffness.

    Raises
    ------
    InputError
        Weights that are negative or all zero, load cases that differ in vehicles, lines or
        variables, or a line to which no path of a vehicle contributes; another number of receivers
        than of responses.

    See Also
    --------
    deboom.Platform, deboom.Robust, deboom.search, deboom.analyse_paths

    Notes
    -----
    ``SPLV_v = Σ_c w_c Σ_f [20 lg(|p_cvf| / (√2 p0)) + A(f)]``, thesis, eq. 35, as the mean over
    load cases. A sum of decibels counts 1 dB in a notch like 1 dB at a peak. A design whose
    amplitudes do not come to rest has an SPLV of NaN, so it counts as failed.

    A loss factor ``EnM x loss`` multiplies K'' alone: ``K → x (K' + j y K'')``. The ratio K''/K' is
    multiplied by it and K' stays; the magnitude of K changes by the square root of ``1 + (yη)²``
    over that of ``1 + η²``, 0.8 % for η = 0.2 and y = 1.2.

    Examples
    --------
    >>> import deboom, numpy as np
    >>> model = deboom.read_platform("u06").model(vehicles="U06", motion="coupled")
    >>> today = np.ones((1, 12))
    >>> model(today).shape, model.levels(today).shape, model.gradient(today).shape
    ((1, 5), (1, 5, 161), (1, 5, 12))
    >>> model.paths(today[0], "U06-1").table["path"][0]
    'TSM x'
    """

    cases: tuple[Case, ...]
    weights: tuple[float, ...]
    loss_factors: bool = False
    receivers: tuple[Receiver, ...] = ()
    idle: tuple[Any, ...] = ()
    compiled: bool = True
    _level_sums: tuple[LevelSum, ...] = field(init=False, repr=False)
    _one_pascal: float = field(init=False, repr=False)
    """SPLV of 1 Pa at every line: the A-weighting and the reference of all lines at once."""

    __repr__ = short_repr

    def __post_init__(self) -> None:
        weights = _normalised(self.weights, [case.load_case for case in self.cases])
        pairs = zip(self.cases, weights, strict=True)
        used = [(case, weight) for case, weight in pairs if weight > 0]
        cases = tuple(case for case, _ in used)
        for case in cases:
            _check_same_axes(case, cases[0])
            _refuse_silent_lines(case)
        n_responses = len(cases[0].vehicle_names)
        receivers = tuple(self.receivers) or (EAR,) * n_responses
        if len(receivers) != n_responses:
            raise InputError(
                f"{len(receivers)} receivers of {n_responses} responses: give one of each"
            )
        sums = [level_sum(case, compiled=self.compiled) for case in cases]
        lines = cases[0].frequency
        one_pascal = sound_level.splv(sound_level.spl(np.ones(lines.size), lines))
        object.__setattr__(self, "cases", cases)
        object.__setattr__(self, "receivers", receivers)
        object.__setattr__(self, "weights", tuple(weight for _, weight in used))
        object.__setattr__(self, "_level_sums", tuple(sums))
        object.__setattr__(self, "_one_pascal", float(one_pascal))

    @property
    def kernel(self) -> str:
        """Name of what sums the levels, for the run's record: ``numba`` or ``numpy``."""
        return "numba" if self.compiled else "numpy"

    @property
    def smooth(self) -> bool:
        """Whether its responses have derivatives, so that a search may follow them."""
        return self.motion is not Motion.amplitude

    @property
    def motion(self) -> Motion:
        """What the powertrain does when a stiffness changes."""
        if isinstance(self.cases[0], PathContributions):
            return Motion.prescribed
        follows = [case.follows.any() for case in self.cases if isinstance(case, AmplitudeMotion)]
        return Motion.amplitude if any(follows) else Motion.coupled

    @property
    def factor(self) -> Factor:
        """What a stiffness factor means."""
        first = self.cases[0]
        settles = isinstance(first, AmplitudeMotion) and first.ratio is not None
        return Factor.part if settles else Factor.dynamic

    @property
    def load_case_names(self) -> tuple[str, ...]:
        """Names of the load cases that count."""
        return tuple(case.load_case for case in self.cases)

    @property
    def frequency(self) -> RealArray:
        """Lines of the band, shape (f,) [Hz]."""
        return self.cases[0].frequency

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Names of the columns of the designs, ``<mount> <axis>``, then ``<mount> <axis> loss``."""
        return self.cases[0].variable_names

    @property
    def response_names(self) -> tuple[str, ...]:
        """Names of the vehicles; of further receivers such as ``U06-1, seat rail z``."""
        return self.cases[0].vehicle_names

    @property
    def response_unit(self) -> str:
        """``dB(A)``; with vibrations, the unit of each response."""
        units = [receiver.level_unit for receiver in self.receivers]
        return units[0] if len(set(units)) == 1 else ", ".join(units)

    @property
    def response_weights(self) -> RealArray | None:
        """Weights of the receivers in sums, 0 of vibrations, (v,) [1]; None: all alike."""
        weights = np.array([each.weight * each.is_sound for each in self.receivers])
        return None if np.all(weights == 1.0) else weights

    @property
    def n_lines(self) -> int:
        """Number of lines in each sum: SPLV over it is the mean level of the lines."""
        return self.frequency.size

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return SPLV of each design in each vehicle.

        - `designs` (n, k): stiffness factors, then loss factors if there are any [1].
        - returns (n, v): [dB(A), `Receiver.level_unit` of vibrations]; minus infinity where a
          design silences a line completely.
        - raises InputError: designs of another shape, or not finite.
        """
        factors = self.case_factors(designs)
        total = np.full((len(factors), len(self.response_names)), self._one_pascal)
        for weight, summed in zip(self.weights, self._level_sums, strict=True):
            total += weight * summed(factors)
        return total

    @property
    def is_linearisable(self) -> bool:
        """Whether SPLV has exact derivatives: motion prescribed or coupled, parts that stay."""
        return not any(isinstance(case, AmplitudeMotion) for case in self.cases)

    def linearised(self, designs: npt.ArrayLike) -> tuple[RealArray, PullBack]:
        """Return SPLV of each design in each vehicle, and the pull-back of weights.

        - `designs` (n, k): stiffness factors, then loss factors if there are any [1].
        - returns (n, v) [dB(A)], and a function from weights (o, n, v) to ``Σ_v w_onv
          ∂SPLV_nv/∂x_nk``, shape (o, n, k) [dB(A) per unit factor].
        - raises InputError: designs of another shape, or not finite.
        """
        factors = self.case_factors(designs)
        total = np.full((len(factors), len(self.response_names)), self._one_pascal)
        pulls = []
        for weight, summed in zip(self.weights, self._level_sums, strict=True):
            level, pull = summed.linearised(factors)
            total += weight * level
            pulls.append((weight, pull))

        def pull_back(weights: RealArray) -> RealArray:
            slopes = np.zeros((len(weights), *factors.shape))
            for weight, pull in pulls:
                slopes += weight * pull(weights)
            return self._by_stated_factors(designs, slopes)

        return total, pull_back

    def compile_slopes(self) -> None:
        """Compile what `linearised` needs, in a process beside one that tries designs first."""
        for summed in self._level_sums:
            summed.compile_slopes()

    def pressure(self, designs: npt.ArrayLike, load_case: str | None = None) -> ComplexArray:
        """Return the pressure at the ears, and the motion at other receivers, in one load case.

        - `designs` (n, k): stiffness factors, then loss factors if there are any [1].
        - `load_case`, optional: name of the load case; by default the first one.
        - returns (n, v, f): complex peak amplitudes, unweighted [Pa; m/s², m/s or m of
          vibrations].
        - raises InputError: a load case that does not count here; designs of another shape, or not
          finite.
        """
        pressure = self._case(load_case).pressure(self.case_factors(designs))
        for response, receiver in enumerate(self.receivers):
            if not receiver.is_sound:
                pressure[:, response] /= receiver.pressure_of_same_level(self.frequency)
        return pressure

    def paths(
        self, design: npt.ArrayLike, vehicle: str, load_case: str | None = None
    ) -> PathAnalysis:
        """Split a response into the contributions of the mounts' directions.

        That of a vibration is told as the pressure of the same level,
        `Receiver.pressure_of_same_level`.

        - `design` (k,): stiffness factors, then loss factors if there are any [1].
        - `vehicle`: one of the responses.
        - `load_case`, optional: name of the load case; by default the first one.
        - raises InputError: an unknown vehicle or load case; a design of another shape.
        """
        if vehicle not in self.response_names:
            raise InputError(f"no vehicle {vehicle!r}: use one of {list(self.response_names)}")
        place, case = self.response_names.index(vehicle), self._case(load_case)
        row = self.case_factors(np.atleast_2d(design))
        if isinstance(case, PathContributions):
            return PathAnalysis(
                vehicle, self.frequency, case.values[place] * row[0], case.variable_names
            )
        columns = [np.flatnonzero(case.variables == k).tolist() for k in range(row.shape[1])]
        by_direction = transfer_path.partial_sums(
            case.transfer[place] * case.force_in(row, place)[0], columns
        )
        return PathAnalysis(vehicle, self.frequency, by_direction, case.variable_names)

    def design_space(self, *, bounds: float = 0.20, tolerance: float = 0.15) -> DesignSpace:
        """Return the space of the factors within 1 ± `bounds`, see `stiffness_factor_space`."""
        return stiffness_factor_space(self.variable_names, bounds, tolerance)

    def _case(self, load_case: str | None) -> Case:
        names = self.load_case_names
        if load_case is not None and load_case not in names:
            raise InputError(f"no load case {load_case!r} in the index: use one of {list(names)}")
        return self.cases[names.index(load_case) if load_case is not None else 0]

    def levels(self, designs: npt.ArrayLike, load_case: str | None = None) -> RealArray:
        """Return the level of every line in one load case, see `pressure`.

        - returns (n, v, f): [dB(A), `Receiver.level_unit` of vibrations]; the sum over the lines is
          SPLV in that load case.
        """
        pressure = self._case(load_case).pressure(self.case_factors(designs))
        return sound_level.spl(pressure, self.frequency, axis=-1)

    def gradient(self, designs: npt.ArrayLike) -> RealArray:
        """Return the derivative of SPLV by each factor.

        - `designs` (n, k): stiffness factors, then loss factors if there are any [1].
        - returns (n, v, k): [dB(A) per unit factor]; NaN where a design silences a line completely.
        - raises InputError: designs of another shape, or not finite.

        ``∂SPLV/∂x_k = 20/ln 10 Σ_f Re(∂p_f/∂x_k / p_f)``, exact; by differences of fourth order
        where stiffnesses follow the amplitude or parts settle elsewhere. In a notch p is small and
        the derivative large, and good for small steps only. With loss factors and ``z = x y``:
        ``∂/∂x = ∂/∂x|_z + y ∂/∂z``, ``∂/∂y = x ∂/∂z``.
        """
        factors = self.case_factors(designs)
        total = np.zeros((len(factors), len(self.response_names), factors.shape[1]))
        for weight, case in zip(self.weights, self.cases, strict=True):
            with np.errstate(divide="ignore", invalid="ignore"):
                total += weight * case.neper_gradient(factors)
        total *= 20.0 / np.log(10.0)
        # vehicles stand where the pull-back has its sets of weights
        return np.moveaxis(self._by_stated_factors(designs, np.moveaxis(total, 1, 0)), 0, 1)

    def _by_stated_factors(self, designs: npt.ArrayLike, slopes: RealArray) -> RealArray:
        """Return derivatives (..., n, k) by stiffness and loss factors, from those by x and x y."""
        if not self.loss_factors:
            return slopes
        stiffness, loss = np.split(np.asarray(designs, dtype=float), 2, axis=-1)
        elastic, lossy = np.split(slopes, 2, axis=-1)
        return np.concatenate([elastic + loss * lossy, stiffness * lossy], axis=-1)

    def clipped(self, designs: RealArray) -> tuple[float, float]:
        """Return how often designs (n, k) leave what the mounts' measurements back [1].

        Shares of lines and directions whose amplitude, and whose preload, lies beyond. Directions
        without a surface are left out of the first share and count as inside in the second. Beyond,
        the stiffness keeps its value at the bound (amplitude), or follows the quasi-static curve
        (preload), see `deboom.vehicles.design_factor.PartRatio`. Prescribed and coupled motion take
        the stiffness as measured: both shares are 0.
        """
        amplitude, preload = [], []
        for case in self.cases:
            if isinstance(case, AmplitudeMotion):
                if case.follows.any():
                    ratio = solve_along_lines(case, designs).ratio
                    amplitude.append(case.clipped(ratio)[..., case.follows].mean())
                preload.append(0.0 if case.ratio is None else case.ratio.clipped(designs).mean())
        return float(np.mean(amplitude or 0.0)), float(np.mean(preload or 0.0))

    def case_factors(self, designs: npt.ArrayLike) -> RealArray:
        """Return checked factors of the cases' variables, of designs (n, k)."""
        rows = checked_designs(designs, self.variable_names)
        if not self.loss_factors:
            return rows
        stiffness, loss = np.split(rows, 2, axis=1)
        return np.hstack([stiffness, stiffness * loss])


def booming_model(
    fleet: Fleet,
    mounts: Sequence[Mount],
    load_cases: Sequence[tuple[LoadCase, float]],
    band: Band,
    *,
    motion: Motion = Motion.prescribed,
    powertrain: Powertrain | None = None,
    parts: Sequence[CharacterisedMount] = (),
    settling: KinematicModel | None = None,
    loss_factors: bool = False,
) -> BoomingModel:
    """Return the booming model of a fleet over weighted load cases.

    Parameters
    ----------
    fleet : Fleet
        One response per receiver.
    mounts : sequence of Mount
        Three design variables per mount.
    load_cases : sequence of (LoadCase, weight)
        Weights are not negative and are normalised to a sum of 1 [1].
    band : (lower, upper)
        Lines that count, both edges included [Hz].
    motion : Motion
        What the powertrain does when a stiffness changes.
    powertrain : Powertrain, optional
        Mass and inertia from the data sheet; needed unless the motion is prescribed.
    parts : sequence of CharacterisedMount
        The same mounts, characterised over wheel torque; needed where stiffnesses follow the
        amplitude or parts settle elsewhere.
    settling : KinematicModel, optional
        Where given, a stiffness factor means the part itself, which settles elsewhere on these
        quasi-static curves (`Factor.part`).
    loss_factors : bool
        Whether the loss factors are variables, too.

    Raises
    ------
    InputError
        Coupled motion without a powertrain; loss factors together with amplitude-dependent motion
        or settling parts, settling parts with prescribed motion; see also
        `deboom.vehicles.fleet.path_contributions`, `deboom.vehicles.coupled_motion.coupled_motion`,
        `deboom.vehicles.amplitude_motion.amplitude_motion` and `BoomingModel`.

    Warns
    -----
    DataWarning
        Brackets or rubber of the car with prescribed motion, where they do not count.
    """
    by_surface = motion is Motion.amplitude or settling is not None
    if loss_factors and by_surface:
        raise InputError(
            "loss factors are variables with prescribed or coupled motion and dynamic factors: "
            "there the mounts stay where they are"
        )
    if settling is not None and motion is Motion.prescribed:
        raise InputError(
            "a part that settles elsewhere moves otherwise too: take coupled or amplitude motion"
        )
    in_car = [mount.name for mount in mounts if mount.brackets or mount.rubber]
    if in_car and motion is Motion.prescribed:
        warnings.warn(
            f"with prescribed motion brackets and rubber of {', '.join(in_car)} in the car do not "
            "count: it takes every deflection as measured; coupled motion has them",
            DataWarning,
            stacklevel=2,
        )
    surfaces = identified_surfaces(parts) if by_surface else {}
    cases: list[Case] = []
    for load_case, _ in load_cases:
        if motion is Motion.prescribed:
            cases.append(
                path_contributions(fleet, mounts, load_case, band, loss_factors=loss_factors)
            )
            continue
        coupled = coupled_motion(fleet, mounts, powertrain, load_case, band)
        if by_surface:
            follow = motion is Motion.amplitude
            cases.append(amplitude_motion(coupled, surfaces, load_case, settling, follow=follow))
        else:
            cases.append(coupled.with_loss_factors() if loss_factors else coupled)
    weights = tuple(weight for _, weight in load_cases)
    return BoomingModel(tuple(cases), weights, loss_factors, fleet.receivers)


def model_of_other_data(
    model: BoomingModel,
    fleet: Fleet,
    mounts: Sequence[Mount],
    powertrain: Powertrain | None,
    load_cases: Sequence[LoadCase],
) -> BoomingModel:
    """Return a model of the same kind from data that were measured again, with errors drawn.

    - `model`: model whose motion, weights and meaning of a factor stay.
    - `fleet`: other noise transfer functions.
    - `mounts`: mounts of the platform.
    - `powertrain`: mass and inertia from the data sheet; needed unless motion is prescribed.
    - `load_cases`: other forces and motions of the load cases that count, in the model's order.

    Stiffnesses that follow the amplitude do so over its ratio to the nominal one, as in `model`:
    the softening stays as measured.
    """
    band = (float(model.frequency[0]), float(model.frequency[-1]))
    cases: list[Case] = []
    for case, load_case in zip(model.cases, load_cases, strict=True):
        if isinstance(case, PathContributions):
            loss = model.loss_factors
            cases.append(path_contributions(fleet, mounts, load_case, band, loss_factors=loss))
            continue
        coupled = coupled_motion(fleet, mounts, powertrain, load_case, band, with_drawn_errors=True)
        if isinstance(case, AmplitudeMotion):
            cases.append(replace(case, **vars(coupled)))
        else:
            cases.append(coupled.with_loss_factors() if model.loss_factors else coupled)
    return replace(model, cases=tuple(cases))


@dataclass(frozen=True, eq=False)
class CatalogueModel:
    """SPLV of every vehicle, as a function of the parts chosen and of their stiffness factors.

    Designs are one part number per mount, from 0, then one stiffness factor per mount and axis.

    - `mounts`: mounts in the order of the factors.
    - `models`: model number o has part number o at every mount; a mount with fewer parts repeats
      any. Number 0 has today's parts. Motion is prescribed or coupled.
    - `n_parts`: number of parts for each mount.
    """

    mounts: tuple[Mount, ...]
    models: tuple[BoomingModel, ...]
    n_parts: tuple[int, ...]

    @property
    def variable_names(self) -> tuple[str, ...]:
        """``<mount> part`` of every mount, then the stiffness factors."""
        choices = tuple(f"{mount.name}{PART_SUFFIX}" for mount in self.mounts)
        return (*choices, *self.models[0].variable_names)

    @property
    def response_names(self) -> tuple[str, ...]:
        """Names of the vehicles."""
        return self.models[0].response_names

    @property
    def response_unit(self) -> str:
        """Unit of the responses."""
        return self.models[0].response_unit

    @property
    def receivers(self) -> tuple[Receiver, ...]:
        """Receiver of each response."""
        return self.models[0].receivers

    @property
    def response_weights(self) -> RealArray | None:
        """Weights of the receivers in sums, see `BoomingModel.response_weights`."""
        return self.models[0].response_weights

    @property
    def n_lines(self) -> int:
        """Number of lines in each sum."""
        return self.models[0].n_lines

    @property
    def frequency(self) -> RealArray:
        """Lines of the band, shape (n_frequency,) [Hz]."""
        return self.models[0].frequency

    @property
    def load_case_names(self) -> tuple[str, ...]:
        """Names of the load cases."""
        return self.models[0].load_case_names

    @property
    def weights(self) -> tuple[float, ...]:
        """Weights of the load cases, their sum 1 [1]."""
        return self.models[0].weights

    def of_parts(self, parts: Sequence[int]) -> BoomingModel:
        """Return the model of one set of parts, as a function of the stiffness factors.

        - raises InputError: a number that is no part's; motion by response surfaces.
        """
        numbers = list(parts)
        if any(k not in range(count) for k, count in zip(numbers, self.n_parts, strict=True)):
            raise InputError(
                f"there is no set of parts {numbers}: give each mount a number below "
                f"{list(self.n_parts)}"
            )
        per_mount = [len(mount.variables) for mount in self.mounts]
        part = np.repeat(np.array(numbers, dtype=np.intp), per_mount)
        cases: list[Case] = []
        for first, *others in zip(*(model.cases for model in self.models), strict=True):
            if isinstance(first, AmplitudeMotion):
                raise InputError("parts of a catalogue need prescribed or coupled motion")
            cases.append(first.with_parts([first, *others], part))
        return replace(self.models[0], cases=tuple(cases))

    def __call__(self, designs: npt.ArrayLike) -> RealArray:
        """Return SPLV of each design in each vehicle.

        - `designs` (n, n_mount + k): part numbers and stiffness factors [1].
        - returns (n, v) [dB(A)].
        - raises InputError: designs of another shape or not finite; a part number with a fraction,
          or of no part.
        """
        splv = np.empty((len(np.atleast_2d(designs)), len(self.response_names)))
        for rows, model, factors in self.sets(designs):
            splv[rows] = model(factors)
        return splv

    def levels(self, designs: npt.ArrayLike, load_case: str | None = None) -> RealArray:
        """Return the sound pressure level of every line in one load case.

        - `designs` (n, n_mount + k), see `__call__`; `load_case`: by default the first.
        - returns (n, v, f) [dB(A)].
        """
        shape = len(np.atleast_2d(designs)), len(self.response_names), self.n_lines
        levels = np.empty(shape)
        for rows, model, factors in self.sets(designs):
            levels[rows] = model.levels(factors, load_case)
        return levels

    def sets(
        self, designs: npt.ArrayLike
    ) -> Iterator[tuple[npt.NDArray[np.intp], BoomingModel, RealArray]]:
        """Yield rows of the designs that have the same parts, their model and their factors."""
        rows = checked_designs(designs, self.variable_names)
        parts, factors = rows[:, : len(self.mounts)], rows[:, len(self.mounts) :]
        if np.any(parts != np.floor(parts)):
            raise InputError("part numbers are whole: round them, or search whole-number variables")
        sets, set_of_row = np.unique(parts, axis=0, return_inverse=True)
        for number, chosen in enumerate(sets.astype(int).tolist()):
            at = np.flatnonzero(set_of_row.ravel() == number)
            yield at, self.of_parts(chosen), factors[at]


def _normalised(weights: Sequence[float], names: Sequence[str]) -> list[float]:
    usable = all(np.isfinite(weight) and weight >= 0 for weight in weights)
    if len(weights) != len(names) or not usable or not sum(weights) > 0:
        raise InputError(
            f"weights {list(weights)} of the load cases {list(names)}: give each one of at least "
            "0, and at least one above 0"
        )
    return [float(weight / sum(weights)) for weight in weights]


def _check_same_axes(case: Case, first: Case) -> None:
    same = (
        case.vehicle_names == first.vehicle_names
        and case.variable_names == first.variable_names
        and np.array_equal(case.frequency, first.frequency)
    )
    if not same:
        raise InputError(
            f"load cases {first.load_case} and {case.load_case} differ in vehicles, variables or "
            "lines: compute their contributions with the same fleet, mounts and band"
        )


def _refuse_silent_lines(case: Case) -> None:
    silent = np.argwhere(~case.transmits)
    if silent.size:
        vehicle, line = silent[0]
        raise InputError(
            f"load case {case.load_case}: no path contributes to the pressure in vehicle "
            f"{case.vehicle_names[vehicle]} at {case.frequency[line]:g} Hz: repair the measurement "
            "or choose a band without that line"
        )
