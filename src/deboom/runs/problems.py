"""The searches of deboom as problems of pymoo, by name: any algorithm of pymoo takes them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.compressor.cabin_index import DATUM
from deboom.compressor.mounted_fleet import (
    CompressorFleet,
    mount_space,
    mounted_fleet,
    travel_limit,
)
from deboom.errors import InputError, choice
from deboom.explore.robust import Robust
from deboom.explore.search import RobustProblem
from deboom.files.catalogue import platform_catalogue
from deboom.measurement.electric_car import ElectricCar
from deboom.mounts.surface_forces import Outside
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.catalogue import catalogue_index
from deboom.vehicles.platform import LoadCases, MountSource, Platform


class BoomingProblem(RobustProblem):
    """Stiffness factors of a platform's mounts as a pymoo problem with mean and scatter.

    One variable per mount and axis [1], 12 on the shipped platform. Two objectives, both as small
    as possible: ``Σ mean(SPLV)`` and ``Σ σ(SPLV)``, the sums over the vehicles [dB(A), dB].

    Parameters
    ----------
    platform : Platform
        As `deboom.read_platform` returns it.
    vehicles : str or sequence of str, optional
        Names of vehicles or groups; by default all.
    nominal : bool
        Take SPLV of the design itself in place of the mean, as the thesis does literally.
    bounds, tolerance : float
        Factors run within ``1 ± bounds``; half width of their scatter, three standard deviations
        [1].
    draws, seed : int
        Draws of the scatter, a power of two, and their seed, from 1.
    band, motion, load_cases
        As for `deboom.Platform.model`.

    Raises
    ------
    InputError
        An unknown vehicle or word; a number of draws that is no power of two; data that the model
        needs and the platform does not have.

    See Also
    --------
    deboom.RobustProblem, deboom.CatalogueProblem, deboom.CompressorProblem, deboom.read_platform

    Examples
    --------
    >>> import deboom
    >>> from pymoo.algorithms.moo.nsga2 import NSGA2
    >>> from pymoo.optimize import minimize
    >>> platform = deboom.read_platform("u06")
    >>> problem = deboom.BoomingProblem(platform, vehicles="U06", band=(24, 30), draws=16)
    >>> problem.n_var, problem.n_obj
    (12, 2)
    >>> result = minimize(problem, NSGA2(8), ("n_gen", 2), seed=1)
    >>> result.F.shape[1], result.pop.get("sigma").shape
    (2, (8, 5))
    """

    def __init__(
        self,
        platform: Platform,
        vehicles: str | Sequence[str] | None = None,
        *,
        nominal: bool = False,
        bounds: float = 0.20,
        tolerance: float = 0.15,
        draws: int = 128,
        seed: int = 1,
        band: tuple[float, float] | None = None,
        motion: str | Motion | None = None,
        load_cases: LoadCases | None = None,
    ) -> None:
        model = platform.model(vehicles, band=band, motion=motion, load_cases=load_cases)
        space = model.design_space(bounds=bounds, tolerance=tolerance)
        super().__init__(Robust(model, space, nominal_mean=nominal, draws=draws, seed=seed))


class CatalogueProblem(RobustProblem):
    """Parts of a mount library as a pymoo problem: part and re-tuning of each mount.

    The variables are one whole part number per mount, where 0 is today's part, and then the
    stiffness factors [1]. The objectives are those of `BoomingProblem`. Operators of pymoo give
    broken part numbers, which are rounded; `deboom.search` treats part numbers as choices without
    order. `parts` names the parts of a design.

    Parameters
    ----------
    platform : Platform
        As `deboom.read_platform` returns it.
    vehicles : str or sequence of str, optional
        Names of vehicles or groups; by default all.
    library : path, optional
        Library with further parts, a database or its JSON; by default the platform's catalogue.
    retuning : float
        Factors run within ``1 ± retuning``; 0: parts as they are [1].
    nominal, tolerance, draws, seed, band
        As for `BoomingProblem`.
    motion : str
        ``"coupled"`` or ``"prescribed"``.

    Raises
    ------
    InputError
        No catalogue or no further part in it; see also `BoomingProblem`.

    See Also
    --------
    deboom.BoomingProblem, deboom.open_library, deboom.RobustProblem

    Examples
    --------
    >>> import deboom
    >>> from pymoo.algorithms.moo.nsga2 import NSGA2
    >>> from pymoo.optimize import minimize
    >>> platform = deboom.read_platform("u06")
    >>> problem = deboom.CatalogueProblem(
    ...     platform, vehicles="U06", band=(24, 30), draws=16, motion="prescribed"
    ... )
    >>> result = minimize(problem, NSGA2(8), ("n_gen", 2), seed=1)
    >>> sorted(problem.parts(result.X[0]))
    ['Du', 'EnM', 'GeM', 'TSM']
    """

    def __init__(
        self,
        platform: Platform,
        vehicles: str | Sequence[str] | None = None,
        *,
        library: str | Path | None = None,
        retuning: float = 0.05,
        nominal: bool = False,
        tolerance: float = 0.15,
        draws: int = 128,
        seed: int = 1,
        band: tuple[float, float] | None = None,
        motion: str | Motion = Motion.coupled,
    ) -> None:
        runs = platform.runs(
            fleet=platform.listeners(vehicles), mounts=MountSource.library_inside, band=band
        )
        self.catalogue = platform_catalogue(
            runs.platform, None if library is None else Path(library)
        )
        model = catalogue_index(
            runs, self.catalogue, choice(Motion, motion, "motion"), Outside.KEEP_MEASURED
        )
        space = self.catalogue.space(model.variable_names, retuning, tolerance)
        super().__init__(Robust(model, space, nominal_mean=nominal, draws=draws, seed=seed))

    def parts(self, design: RealArray) -> dict[str, str]:
        """Return what to order for each mount of a design, shape (k,)."""
        names = self.catalogue.labels(np.asarray(design)[: len(self.catalogue.parts)])
        return dict(zip(self.catalogue.parts, names, strict=True))


class CompressorProblem(RobustProblem):
    """Mounts of a refrigerant compressor as a pymoo problem over cars, with a limit of travel.

    The variables are axial and radial stiffness factors [1]; with `identical` all mounts have the
    same factors. Pieces and positions of the mounts scatter. The objectives are those of
    `BoomingProblem`, summed over the cars; the largest travel of a mount under 1 g is a constraint.

    Parameters
    ----------
    cars : ElectricCar or sequence of ElectricCar
        As `deboom.read_electric_car` returns them; the compressor is that of the first.
    identical : bool
        Whether all mounts are of one part number.
    reach : float
        Factors run within ``1 ± reach`` [1].
    travel : float
        Largest travel under 1 g, over today's [1].
    tolerance, batch : float
        Half width of a piece's stiffness, three standard deviations, and the share of its batch in
        that variance [1].
    place_tolerance : float
        Half width of the mounts' coordinates; 0: places do not scatter [mm].
    nominal, draws, seed
        As for `BoomingProblem`.
    band, line_step : (float, float), float
        Lines that count [Hz].

    Raises
    ------
    InputError
        No car; lines that were not measured; see also `deboom.identify`.

    See Also
    --------
    deboom.BoomingProblem, deboom.unbalance, deboom.read_electric_car, deboom.RobustProblem

    Examples
    --------
    >>> import deboom
    >>> from pymoo.algorithms.moo.nsga2 import NSGA2
    >>> from pymoo.optimize import minimize
    >>> car = deboom.read_electric_car("car")  # doctest: +SKIP
    >>> problem = deboom.CompressorProblem(car)  # doctest: +SKIP
    >>> result = minimize(problem, NSGA2(24), ("n_gen", 20), seed=1)  # doctest: +SKIP
    """

    def __init__(
        self,
        cars: ElectricCar | Sequence[ElectricCar],
        *,
        identical: bool = True,
        reach: float = 0.4,
        travel: float = 1.2,
        tolerance: float = 0.15,
        batch: float = 0.5,
        place_tolerance: float = 1.0,
        nominal: bool = False,
        draws: int = 32,
        seed: int = 1,
        band: tuple[float, float] = (20.0, 140.0),
        line_step: float = 2.0,
    ) -> None:
        every = (cars,) if isinstance(cars, ElectricCar) else tuple(cars)
        if not every:
            raise InputError("no car: give at least one, as deboom.read_electric_car returns it")
        if not (line_step > 0.0 and 0.0 < band[0] < band[1]):
            raise InputError(
                f"lines from {band[0]:g} to {band[1]:g} Hz every {line_step:g} Hz: give a band "
                "that rises from above 0 Hz, and a step above 0"
            )
        if not 0.0 <= place_tolerance < DATUM:
            raise InputError(f"place_tolerance {place_tolerance:g}: mounts are placed to some mm")
        mounted = mounted_fleet(
            CompressorFleet(every, ()),
            np.arange(band[0], band[1] * (1.0 + 1e-6), line_step),
            {},
            lambda _: None,
            identical=identical,
            with_hoses=False,
            places=place_tolerance > 0.0,
        )
        space = mount_space(
            mounted.index.variables,
            reach=reach,
            tolerance=tolerance,
            batch=batch,
            place_tolerance=place_tolerance,
        )
        super().__init__(
            Robust(
                mounted.index,
                space,
                nominal_mean=nominal,
                draws=draws,
                seed=seed,
                limits=[travel_limit(mounted, space, travel)],
            )
        )
