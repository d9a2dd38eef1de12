"""A platform with its runs: from what was measured to the model of its noise."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import TypeAlias

import numpy as np

from deboom.arrays import RealArray, short_repr
from deboom.errors import DataWarning, Finding, InputError, choice, listed, word_of
from deboom.measurement.channels import Band, LoadCase
from deboom.mounts.characterised_mount import ASSUMED, CharacterisedDirection, CharacterisedMount
from deboom.mounts.mount import (
    Mount,
    bracket_softness,
    in_mount_axes,
    mean_operating_stiffness,
    refuse_active_mounts,
)
from deboom.mounts.surface_forces import Outside, surface_forces
from deboom.vehicles.booming_model import BoomingModel, Motion, booming_model
from deboom.vehicles.coupled_motion import coupled_motion, refuse_reversed_channel
from deboom.vehicles.design_factor import Factor
from deboom.vehicles.fleet import Fleet
from deboom.vehicles.idle import IdleRun, idle_model
from deboom.vehicles.plausibility import platform_findings
from deboom.vehicles.powertrain import KinematicModel, Powertrain, library_model
from deboom.vehicles.surface_check import SurfaceCheck, surface_check

LoadCases: TypeAlias = Sequence[str] | Mapping[str, float]
"""Names of load cases, also as ``name=weight``, or weights by name."""

PLATFORM_FILE = "platform.toml"
LIBRARY_FILE = "mounts.library.json"
"""Exported mount library in a platform folder."""
BAND = (20.0, 60.0)
"""Lines that count unless a band is given; both edges belong to it [Hz]."""


class MissingLibrary(InputError):
    """There is no mount library beside a platform."""


class MountSource(Enum):
    """Where the forces of the mounts come from.

    ``library`` refuses lines outside of the region that a mount was measured in; at those lines
    ``library_inside`` takes the measured force.
    """

    library = "library"
    library_inside = "library-inside"
    spectra = "spectra"


@dataclass(frozen=True, eq=False)
class Platform:
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
        Nominal mass [kg] and inertia [kg m²] with tolerances, as the data sheet states them; None:
        not stated.
    fleet : Fleet
        Vehicles with their noise transfer functions from a force at each path, inputs ``<mount>
        <axis>``, to the pressure at the driver's ear, (n_frequency, 1, n_path) [Pa/N].
    load_cases : tuple of LoadCase
        Runs on the lines of the noise transfer functions: displacements [m] and forces [N] at the
        mounts, (n_frequency, n_channel).
    idle : tuple of IdleRun
        Runs at idle, a line per engine order; levels at idle are in no sum over load cases.
    default_load_case : str
        Name of the load case that is meant when none is asked for.
    input_files : tuple of Path
        Every file that the numbers come from.
    cylinders : int or None
        Cylinders of the engine, None for an electric drive.
    library : tuple of CharacterisedMount
        Mounts of the library beside the platform, as they stand there; empty if there is none or it
        cannot be read.
    library_fault : InputError or None
        Why the library cannot be used, kept until it is needed.
    doubts : tuple of str
        Sentences on what the files themselves leave in doubt, such as names in their ID lines.

    Raises
    ------
    InputError
        `model`, `runs` and `load_case`: a word or name that the platform does not know.

    See Also
    --------
    deboom.read_platform, deboom.BoomingModel, deboom.vehicles.platform.Runs, deboom.analyse_paths

    Examples
    --------
    >>> import deboom
    >>> platform = deboom.read_platform("u06")
    >>> platform.name, len(platform.fleet.names)
    ('u06_f39_f45', 15)
    """

    name: str
    title: str
    description: str
    folder: Path
    mounts: tuple[Mount, ...]
    powertrain: Powertrain | None
    fleet: Fleet
    load_cases: tuple[LoadCase, ...]
    default_load_case: str
    input_files: tuple[Path, ...]
    cylinders: int | None = None
    library: tuple[CharacterisedMount, ...] = ()
    library_fault: InputError | None = None
    doubts: tuple[str, ...] = ()
    idle: tuple[IdleRun, ...] = ()

    __repr__ = short_repr

    @cached_property
    def findings(self) -> tuple[Finding, ...]:
        """What contradicts in the data, certain or likely, with the likely mistake of each."""
        doubts = tuple(Finding(sentence) for sentence in self.doubts)
        return doubts + platform_findings(
            mounts=self.mounts,
            powertrain=self.powertrain,
            fleet=self.fleet,
            load_cases=self.load_cases,
            cylinders=self.cylinders,
        )

    def refuse_contradictions(self) -> None:
        """Refuse what `findings` is certain of, and warn of the rest.

        - raises InputError: a certain finding; a channel whose reversal makes the motion rigid.
        - warns DataWarning: a likely one.
        """
        certain = [finding.sentence for finding in self.findings if finding.certain]
        for case in (*self.load_cases, *(run.case for run in self.idle)):
            try:
                refuse_reversed_channel(self.mounts, case)
            except InputError as error:
                certain.append(str(error))
        if certain:
            raise InputError("\n".join(certain))
        for finding in self.findings:
            warnings.warn(f"{self.folder}: {finding.sentence}", DataWarning, stacklevel=2)

    @property
    def library_file(self) -> Path:
        """Where the mount library lies, if there is one."""
        return self.folder / LIBRARY_FILE

    @property
    def band(self) -> Band:
        """Lines that count by default: `BAND`, or all of data that do not span it [Hz]."""
        lines = self.load_cases[0].force.frequency
        return BAND if self.spans_band else (float(lines[0]), float(lines[-1]))

    @property
    def spans_band(self) -> bool:
        """Whether the lines reach both edges of `BAND`, or miss one by less than a line spacing."""
        lines = self.load_cases[0].force.frequency
        if lines.size < 2:
            return False
        missed = lines[0] - BAND[0], BAND[1] - lines[-1]
        spacings = lines[1] - lines[0], lines[-1] - lines[-2]
        return all(gap <= 0 or gap < step for gap, step in zip(missed, spacings, strict=True))

    def load_case(self, name: str) -> LoadCase:
        """Return a load case by its name.

        - raises InputError: no such load case.
        """
        for case in self.load_cases:
            if case.name == name:
                return case
        if name in [run.name for run in self.idle]:
            raise InputError(
                f"{self.folder / PLATFORM_FILE}: load case '{name}' is at idle, whose level is in "
                'no sum: limit it (--limits, statistic = "idle") or search for it as well (--also '
                "idle=RECEIVER)"
            )
        names = ", ".join(case.name for case in self.load_cases)
        raise InputError(
            f"{self.folder / PLATFORM_FILE}: there is no load case '{name}': use {names}"
        )

    def model(
        self,
        vehicles: str | Sequence[str] | None = None,
        *,
        band: Band | None = None,
        motion: str | Motion | None = None,
        mounts: str | MountSource = MountSource.library,
        load_cases: LoadCases | None = None,
        factor: str | Factor = Factor.dynamic,
        loss_factors: bool = False,
    ) -> BoomingModel:
        """Return the model that says how loud a design of the mounts is.

        Parameters
        ----------
        vehicles : str or sequence of str, optional
            Names of vehicles or groups of vehicles; by default all.
        band : (float, float), optional
            Lines that count, both edges included [Hz]; by default 20 to 60 Hz, or all lines of
            data that do not span them.
        motion : str, optional
            ``"prescribed"``: the powertrain moves as measured; ``"coupled"``: it answers the new
            stiffnesses, by default wherever the data allow it; ``"amplitude"``: coupled, and
            stiffnesses follow the amplitudes, too.
        mounts : str
            ``"library"``: forces of the response surfaces in the platform's mount library;
            ``"library-inside"``: the same where they are backed by measurements, else measured
            forces; ``"spectra"``: measured forces.
        load_cases : sequence of str or mapping of str to float, optional
            Load cases such as ``"g5_wot220"``, or ``"g5_wot220=2"`` and ``{"g5_wot220": 2}`` with a
            weight; by default the platform's default one.
        factor : str
            ``"dynamic"``: a factor scales the whole curve of stiffness over preload; ``"part"``:
            the rubber, with its stops where they were.
        loss_factors : bool
            Whether the loss factors are variables, too.

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
        runs = self.runs(load_cases, fleet=self.listeners(vehicles), mounts=mounts, band=band)
        return runs.model(motion, factor, loss_factors=loss_factors)

    def listeners(self, vehicles: str | Sequence[str] | None) -> Fleet:
        """Return some of the vehicles, by their names and those of their groups; None: all.

        - raises InputError: no such vehicle or group.
        """
        members = self.fleet.vehicles
        if vehicles is None:
            return self.fleet
        names = [vehicles] if isinstance(vehicles, str) else list(vehicles)
        for name in names:
            word_of(name, [*self.fleet.names, *(member.group for member in members)], "vehicle")
        return Fleet(
            tuple(vehicle for vehicle in members if vehicle.name in names or vehicle.group in names)
        )

    @property
    def assumed(self) -> tuple[str, ...]:
        """Which defaults the mounts of the library rest on, in words."""
        settings = [each.settings for part in self.library for each in part.directions]
        said = dict.fromkeys(str(each[ASSUMED]) for each in settings if ASSUMED in each)
        return tuple(f"{self.library_file}: its mounts rest on defaults: {each}" for each in said)

    def runs(
        self,
        load_cases: LoadCases | None = None,
        *,
        fleet: Fleet | None = None,
        mounts: str | MountSource = MountSource.library,
        band: Band | None = None,
    ) -> Runs:
        """Look up load cases and give them the forces of the mounts' response surfaces.

        - `load_cases`: as for `weighted_load_cases`.
        - `fleet`: vehicles to listen in; by default all of them.
        - `mounts`: whether forces come from the library, and are compared with the measured ones.
        - `band`: lower and upper edge, both inside; by default `band` of the platform [Hz].
        - warns DataWarning: something in the platform that looks like a mistake, see `findings`;
          mounts of the library that rest on defaults.
        - raises InputError: a certain mistake in the platform, see `Platform.findings`; an unknown
          load case; a platform without a mount library; a run without
          engine torque, or with lines outside of the region that a mount was measured in.
        """
        fleet, band = fleet or self.fleet, band or self.band
        source = choice(MountSource, mounts, "mounts")
        self.refuse_contradictions()
        cases = self.weighted_load_cases(load_cases)
        if source is MountSource.spectra:
            return Runs(platform=self, fleet=fleet, cases=cases, band=band)
        if self.library_fault is not None:
            raise self.library_fault
        for sentence in self.assumed:
            warnings.warn(sentence, DataWarning, stacklevel=2)
        outside = Outside.REFUSE if source is MountSource.library else Outside.KEEP_MEASURED
        try:
            pairs = [(case, surface_forces(case, self.library, outside)) for case, _ in cases]
        except InputError as error:
            raise InputError(
                f"{self.library_file}: {error} (--mounts library-inside keeps the measured force "
                "at lines outside, --mounts spectra everywhere)"
            ) from None
        modelled = {case.name: forces.load_case for case, forces in pairs}
        changed = replace(
            self,
            load_cases=tuple(modelled.get(case.name, case) for case in self.load_cases),
            input_files=(*self.input_files, self.library_file),
        )
        return Runs(
            platform=changed,
            fleet=fleet,
            cases=[(modelled[case.name], weight) for case, weight in cases],
            band=band,
            check=surface_check(fleet, self.mounts, pairs, band),
            parts=self.library,
        )

    def weighted_load_cases(self, requests: LoadCases | None) -> list[tuple[LoadCase, float]]:
        """Look up load cases with their weights, in the order asked for, not yet normalised [1].

        - `requests`: ``name`` (weight 1) or ``name=weight``, or weights by name; None or empty:
          the default.
        - raises InputError: an unknown or repeated name, a weight that is no number above 0, or a
          load case in which a mount has a negative stiffness or a negative loss.
        """
        chosen: dict[str, float] = {}
        if isinstance(requests, Mapping):
            requests = [f"{name}={weight}" for name, weight in requests.items()]
        for request in (
            [requests] if isinstance(requests, str) else requests or [self.default_load_case]
        ):
            name, has_weight, text = request.partition("=")
            try:
                weight = float(text) if has_weight else 1.0
            except ValueError:
                weight = -1.0
            if not 0.0 < weight < float("inf"):
                raise InputError(f"load case '{request}': write name=weight with a weight above 0")
            if name in chosen:
                raise InputError(f"load case '{name}' is asked for twice: give it one weight")
            chosen[name] = weight
        cases = [(self.load_case(name), weight) for name, weight in chosen.items()]
        for case, _ in cases:
            refuse_active_mounts(in_mount_axes(self.mounts, case))
        return cases

    def static_curves(self) -> KinematicModel:
        """Return how the powertrain rides on the static curves of the mounts that carry it.

        - raises InputError: a library that cannot be read, or a direction without its curve.
        """
        if self.library_fault is not None:
            raise self.library_fault
        return library_model(self.carrying(self.library))

    def carrying(self, parts: Sequence[CharacterisedMount]) -> list[CharacterisedMount]:
        """Return those parts that carry the powertrain."""
        names = {mount.name for mount in self.mounts if mount.carries_powertrain}
        return [part for part in parts if part.mount.name in names]


@dataclass(frozen=True, eq=False, kw_only=True)
class Runs:
    """Load cases of a platform with the forces that count, and who listens; see `Platform.runs`.

    - `platform`: with these runs, and every file that they come from.
    - `fleet`: vehicles that listen.
    - `cases`: runs with their weights.
    - `band`: lower and upper edge, both inside [Hz].
    - `check`: surfaces against spectra; None if the forces are the measured ones.
    - `parts`: the library's mounts that the forces come from; empty if they are the measured ones.
    - `not_judged`: which receivers are left out and why, in a sentence; empty if none is.

    See Also
    --------
    deboom.Platform, deboom.BoomingModel
    """

    platform: Platform
    fleet: Fleet
    cases: list[tuple[LoadCase, float]]
    band: Band
    check: SurfaceCheck | None = None
    parts: tuple[CharacterisedMount, ...] = ()
    not_judged: str = ""

    def heard(self, reason: str, *, by_driver: bool = False) -> Runs:
        """Return these runs without receivers that vibrate, or with the drivers' ears alone.

        - `reason`: why the others are not judged, after a colon.
        """

        def heard(fleet: Fleet) -> Fleet:
            return Fleet(tuple(each.heard(by_driver=by_driver) for each in fleet.vehicles))

        fleet = heard(self.fleet)
        names = [each.name for each in self.fleet.receivers if each not in fleet.receivers]
        if not names:
            return self
        platform = replace(self.platform, fleet=heard(self.platform.fleet))
        sentence = f"Not judged here: {listed(tuple(dict.fromkeys(names)))}, because {reason}."
        return replace(self, platform=platform, fleet=fleet, not_judged=sentence)

    @property
    def assumed(self) -> tuple[str, ...]:
        """Which defaults the forces rest on, in words; see `Platform.assumed`."""
        return self.platform.assumed if self.parts else ()

    @cached_property
    def not_coupled(self) -> str:
        """What coupled motion lacks in these data, in a sentence; empty if nothing."""
        platform = self.platform
        try:
            for case, _ in self.cases:
                coupled_motion(self.fleet, platform.mounts, platform.powertrain, case, self.band)
        except InputError as error:
            return f"These data do not allow coupled motion: {error}."
        return ""

    def model(
        self,
        motion: str | Motion | None = None,
        factor: str | Factor = Factor.dynamic,
        *,
        loss_factors: bool = False,
    ) -> BoomingModel:
        """Build the booming model of the runs; see `Platform.model`.

        - raises InputError: options that do not go together, or data that do not fit together.
        """
        if motion is None:
            # prescribed motion would hide why these do not go with coupled motion
            in_car = any(mount.brackets or mount.rubber for mount in self.platform.mounts)
            coupled = in_car or not self.not_coupled
            motion = Motion.coupled if coupled else Motion.prescribed
        motion, factor = choice(Motion, motion, "motion"), choice(Factor, factor, "factor")
        by_surface = motion is Motion.amplitude or factor is Factor.part
        if loss_factors and by_surface:
            raise InputError(
                "loss factors are variables with --motion prescribed or coupled and --factor "
                "dynamic: there the mounts stay where they are"
            )
        if factor is Factor.part and motion is Motion.prescribed:
            raise InputError(
                "a part that settles elsewhere moves otherwise too: --factor part goes with "
                "--motion coupled or amplitude"
            )
        if by_surface and not self.parts:
            raise InputError(
                "amplitude-dependent motion and --factor part need the surfaces and static curves "
                "of the mount library: take --mounts library"
            )
        settles = factor is Factor.part
        model = booming_model(
            self.fleet,
            self.platform.mounts,
            self.cases,
            self.band,
            motion=motion,
            powertrain=self.platform.powertrain,
            parts=self.parts,
            settling=library_model(self.platform.carrying(self.parts)) if settles else None,
            loss_factors=loss_factors,
        )
        if by_surface:
            return model  # at idle nobody has measured how stiffness follows the amplitude
        idle = [
            idle_model(
                run,
                self.fleet,
                self.platform.mounts,
                motion=motion,
                powertrain=self.platform.powertrain,
                loss_factors=loss_factors,
            )
            for run in self.platform.idle
        ]
        return replace(model, idle=tuple(idle)) if idle else model

    def characterised(self, mount: str, axis: str) -> CharacterisedDirection | None:
        """Return a direction of the library's mounts; None if it is not among them."""
        directions = (d for part in self.parts if part.mount.name == mount for d in part.directions)
        return next((direction for direction in directions if direction.axis == axis), None)

    def identified(self, mount: str, axis: str) -> bool:
        """Whether a direction's stiffness is known well enough to be asked for in N/m."""
        characterised = self.characterised(mount, axis)
        return (
            characterised is not None
            and characterised.surface is not None
            and characterised.quality.identified
        )

    def stiffness(self, case: LoadCase, band: Band) -> RealArray:
        """Return the mean ``|K|`` of a run in a band by variable, (k,) [N/m]; nan: not measured."""
        mounts = self.platform.mounts
        return np.concatenate([mean_operating_stiffness(mount, case, band) for mount in mounts])

    def bracket_softness(self, case: LoadCase, band: Band) -> RealArray:
        """Return mean stiffnesses over those of the brackets by variable, as `stiffness`, (k,)."""
        mounts = self.platform.mounts
        return np.concatenate([bracket_softness(mount, case, band) for mount in mounts])
