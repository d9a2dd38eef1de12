"""Mounts of one bench or several, characterised, beside the truth where it is known."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt
from threadpoolctl import threadpool_limits

from deboom.arrays import ComplexArray
from deboom.bench.campaign_plan import (
    LOW_GEAR_RUNS,
    NO_ERRORS,
    TRAINING_RUNS,
    CampaignErrors,
    CampaignPlan,
)
from deboom.bench.campaign_writer import write_campaign
from deboom.errors import InputError
from deboom.files.campaign import read_campaign
from deboom.measurement.campaign import OperatingRun
from deboom.mounts.alignment_estimate import AlignmentEstimate, stated_alignment
from deboom.mounts.body_record import body_record
from deboom.mounts.characterisation import Characterisation, CharacteriseOptions
from deboom.mounts.characterise import STEPS, characterise, training_runs
from deboom.mounts.cubic_fit import PieceOptions
from deboom.mounts.operating_map import OperatingMap, operating_maps
from deboom.mounts.response_surface import DynamicStiffnessSurface
from deboom.study.characterisation_truth import SetTruth, read_set_truth
from deboom.study.progress import Progress

CHECK_CASES = ((5, 120.0), (5, 220.0), (6, 120.0), (6, 160.0), (6, 220.0), (7, 220.0))
"""Gear and torque limit [N m] of the full-load runs that surfaces are judged with: thesis, 3.5."""

STEPS_PER_BENCH = 2 + len(STEPS)
"""Measuring, reading, and the steps of the characterisation."""


@dataclass(frozen=True)
class MeasuredSo:
    """What virtual benches measure beside the training runs, and how well.

    Parameters
    ----------
    low_gears : bool
        Full load in gears 3 and 4 as well.
    noise_free : bool
        Without noise and with every sensor as stated: what is left is the error of the method.
    third_cell : bool
        Three cells below each powertrain mount, and pushes beside its virtual point: force transfer
        matrices with moments.
    """

    low_gears: bool = False
    noise_free: bool = False
    third_cell: bool = False


TRAINING = MeasuredSo()


@dataclass(frozen=True, eq=False)
class CharacterisedBench:
    """One bench whose mounts were characterised.

    Parameters
    ----------
    title : str
        Such as ``bench 1``.
    result : Characterisation
        Of one mount set.
    truth : SetTruth or None
        None where nobody knows it.
    seconds : float
        That the characterisation took, with its error budget [s].
    """

    title: str
    result: Characterisation
    truth: SetTruth | None
    seconds: float

    @property
    def input_files(self) -> tuple[Path, ...]:
        """Every file that was read, the truth included."""
        truth = () if self.truth is None else (self.truth.path,)
        return (*self.result.campaign.input_files, *truth)

    @property
    def surfaces(self) -> dict[str, DynamicStiffnessSurface]:
        """Of every direction that has one."""
        found = ((name, one.surface) for name, one in self.result.directions.items())
        return {name: surface for name, surface in found if surface is not None}

    @cached_property
    def check_runs(self) -> tuple[OperatingRun, ...]:
        """Runs of `CHECK_CASES`; all full-load runs where the campaign has none of them."""
        full_load = [run for run in self.result.runs if run.full_load]
        named = [run for run in full_load if (run.gear, run.torque_limit) in CHECK_CASES]
        return tuple(named or full_load or self.result.runs)

    def in_check_runs(self, measured: OperatingMap) -> npt.NDArray[np.bool_]:
        """Say which lines of a map belong to the check runs, shape (n,)."""
        names = {run.name for run in self.check_runs}
        return np.array([str(label).partition(" ")[0] in names for label in measured.run])

    @cached_property
    def stated_maps(self) -> dict[str, OperatingMap]:
        """Maps with all chains as their position sheet states them, without self-calibration."""
        stated = [stated_alignment(chain.alignment) for chain in self.result.chains]
        return self._maps(stated, self.result.runs)

    @cached_property
    def all_gears_maps(self) -> dict[str, OperatingMap]:
        """Maps of every run with rising torque, whatever its gear."""
        options = replace(self.result.options, gears=None)
        runs = training_runs(self.result.campaign, self.result.mount_set, options)
        return self._maps(self.result.chains, runs)

    def _maps(
        self, chains: Sequence[AlignmentEstimate], runs: Sequence[OperatingRun]
    ) -> dict[str, OperatingMap]:
        tolerances = self.result.campaign.tolerances
        records = [body_record(chain.alignment.body, runs, tolerances) for chain in chains]
        return operating_maps(chains, records, self.result.options.estimate)

    def modelled(self, surface: DynamicStiffnessSurface, measured: OperatingMap) -> ComplexArray:
        """Stiffness of a surface at every line of a map, shape (n,) [N/m]."""
        preload = measured.preload(self.result.options.preload)
        return surface.predict_masked(preload, measured.amplitude, measured.frequency)[0]

    def fitted_to(
        self, measured: OperatingMap, pieces: PieceOptions | None = None
    ) -> DynamicStiffnessSurface:
        """Fit a surface to a map, in pieces as the campaign's unless stated otherwise."""
        samples = measured.samples(self.result.options.preload)
        return DynamicStiffnessSurface.fit(
            *samples.lines,
            preload_unit=self.result.options.preload.unit,
            options=pieces or self.result.options.pieces,
            run=samples.run,
        )


def characterise_folder(
    folder: Path,
    mount_set: str,
    options: CharacteriseOptions,
    title: str,
    progress: Callable[[int, str], None],
) -> CharacterisedBench:
    """Characterise one mount set of a campaign and find the truth, if there is any.

    Parameters
    ----------
    folder : Path
        Of the campaign.
    mount_set : str
        Parts on the bench.
    options : CharacteriseOptions
        How.
    title : str
        Of the bench.
    progress : callable
        Called with steps done out of `STEPS_PER_BENCH`, and what comes next.

    Raises
    ------
    InputError
        A campaign that cannot be read or characterised.
    """
    progress(1, f"{title}: reading")
    campaign = read_campaign(folder, (mount_set,))

    def step(done: int, _total: int, text: str) -> None:
        progress(2 + done, f"{title}: {text}")

    begin = time.perf_counter()
    with threadpool_limits(1):  # its matrices are too small to share
        result = characterise(campaign, mount_set, options, step)
    seconds = time.perf_counter() - begin
    return CharacterisedBench(title, result, read_set_truth(folder, mount_set), seconds)


def characterise_given(
    folder: Path, mount_set: str, options: CharacteriseOptions, progress: Progress
) -> CharacterisedBench:
    """Characterise one mount set of a campaign that is there, under its own name.

    Raises
    ------
    InputError
        As `characterise_folder`.
    """

    def step(done: int, text: str) -> None:
        progress(done, STEPS_PER_BENCH, text)

    return characterise_folder(folder, mount_set, options, Path(folder).name, step)


def characterise_benches(
    seeds: Sequence[int],
    mount_set: str,
    options: CharacteriseOptions,
    progress: Progress,
    measured: MeasuredSo = TRAINING,
) -> tuple[CharacterisedBench, ...]:
    """Measure the training runs on virtual benches, characterise them, and keep no files.

    Parameters
    ----------
    seeds : sequence of int
        One bench each, from 1.
    mount_set : str
        Parts on all benches.
    options : CharacteriseOptions
        How they are characterised.
    progress : callable
        ``progress(done, total, text)``.
    measured : MeasuredSo
        What the benches measure.

    Raises
    ------
    InputError
        No seed, a seed below 1, or an unknown mount set.
    """
    if not seeds:
        raise InputError("there is no bench to characterise: ask for at least one")
    total = len(seeds) * STEPS_PER_BENCH
    runs = (*(LOW_GEAR_RUNS if measured.low_gears else ()), *TRAINING_RUNS)
    plan = CampaignPlan((mount_set,), runs, third_cell=measured.third_cell)
    errors = NO_ERRORS if measured.noise_free else CampaignErrors()
    benches = []
    for place, seed in enumerate(seeds):

        def step(done: int, text: str, before: int = place * STEPS_PER_BENCH) -> None:
            progress(before + done, total, text)

        title = f"bench {seed}"
        step(0, f"{title}: measuring")
        with tempfile.TemporaryDirectory(prefix="deboom-") as temporary:
            folder = Path(temporary) / "campaign"
            write_campaign(folder, seed, plan, errors)
            benches.append(characterise_folder(folder, mount_set, options, title, step))
    return tuple(benches)
