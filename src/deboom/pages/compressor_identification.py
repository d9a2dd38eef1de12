"""Compressors identified from hammer tests, virtual ones compared with their truth."""

from __future__ import annotations

import json
import math
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.compressor_truth import CompressorPlan
from deboom.bench.compressor_writer import write_compressor_test
from deboom.choices import CalibrationLevel, CompressorCase, FolderKind
from deboom.compressor.identifiability import ALONE, PRIOR_DOMINATED, REFERENCE_FREQUENCY
from deboom.compressor.identification import Identification, IdentifyOptions
from deboom.compressor.identify import identify
from deboom.compressor.model import CompressorModel, GainFactor
from deboom.compressor.mount_shares import MountShares, mount_shares
from deboom.compressor.parameters import MinimalParameters, ThesisParameters
from deboom.compressor.thesis_fit import ThesisFit, fit_thesis_parameters
from deboom.errors import InputError
from deboom.files.folders import refuse_other_kind
from deboom.files.inertance_test import read_inertance_test
from deboom.files.run_folder import hash_files
from deboom.measurement.compressor_test import CompressorMount, InertanceTest

if TYPE_CHECKING:
    import numpy.typing as npt


TRUTH_FILE = Path("truth") / "truth.json"
RUBBER_LINES = np.arange(10.0, 30.5, 0.5)
"""Where the gain is judged: around the rigid-body modes [Hz]."""
STEPS = 7
"""Of `identified_test`, for progress."""
DIGITS = 4
SMALLEST_SHARE = 1e-6
"""Of a parameter in the null space, above which it is visible with others only."""
_SHOWN_UNIT = {
    "m": ("mm", 1e3),
    "rad": ("°", 180 / np.pi),
    "N/m": ("N/mm", 1e-3),
    "kg m^2": ("kg cm²", 1e4),
}


@dataclass(frozen=True, eq=False)
class CompressorTruth:
    """What the compressor truly is, and the file that says so."""

    path: Path
    model: CompressorModel
    mounts: tuple[CompressorMount, ...]


@dataclass(frozen=True, eq=False)
class IdentificationErrors:
    """How far an identification is from the truth.

    - `mass`, `inertia`, `stiffness`, `gain_real`, `gain_imaginary`: relative [1]: inertia, the
      worst moment; stiffness, the Frobenius norm of K_VP with rotations scaled by the
      characteristic length; gain, the largest in 10-30 Hz, both with a real part of 1 at
      `REFERENCE_FREQUENCY`.
    - `centre`: distance of the centre of gravity [m].
    - `scores` (n_parameters,): errors of the parameters in units of their stated standard deviation
      [1].
    """

    mass: float
    centre: float
    inertia: float
    stiffness: float
    gain_real: float
    gain_imaginary: float
    scores: RealArray


def read_compressor_truth(folder: Path) -> CompressorTruth:
    """Read the truth beside a virtual test.

    - raises InputError: a truth file that is missing or cannot be read.
    """
    path = folder / TRUTH_FILE
    try:
        truth = json.loads(path.read_text(encoding="utf-8"))
        model = CompressorModel(
            truth["mass_kg"],
            np.array(truth["centre_of_gravity_m"]),
            np.array(truth["inertia_kg_m2"]),
            np.array(truth["static_stiffness"]),
            GainFactor.of(truth["gain"]),
        )
        mounts = tuple(
            CompressorMount(
                mount["name"],
                np.array(mount["position_m"]),
                np.array(mount["rotation_rad"]),
                np.array(mount["stiffness_n_per_m"]),
            )
            for mount in truth["mounts"]
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{path}: not the truth of a virtual compressor ({error}); write the test again, or "
            "leave out --truth"
        ) from None
    return CompressorTruth(path, model, mounts)


def errors_of(identification: Identification, truth: CompressorTruth) -> IdentificationErrors:
    """Compare the result of an identification with the truth."""
    model, true = identification.calibrated.model, truth.model
    parametrisation = MinimalParameters(identification.length)
    deviation = np.sqrt(np.diag(identification.calibrated.parameter_covariance))
    unit = np.repeat([1.0, 1 / identification.length], 3)
    stiffness, true_stiffness = (
        _stated(compressor) * np.outer(unit, unit) for compressor in (model, true)
    )
    gain = _gain(model, RUBBER_LINES) / _gain(true, RUBBER_LINES) - 1
    moments = np.diag(model.inertia) / np.diag(true.inertia) - 1
    return IdentificationErrors(
        abs(model.mass / true.mass - 1),
        float(np.linalg.norm(model.centre - true.centre)),
        float(np.abs(moments).max()),
        float(np.linalg.norm(stiffness - true_stiffness) / np.linalg.norm(true_stiffness)),
        float(np.abs(gain[0]).max()),
        float(np.abs(gain[1]).max()),
        (identification.calibrated.values - parametrisation.values_of(true)) / deviation,
    )


def _stated(model: CompressorModel) -> RealArray:
    """K_VP at the reference line [N/m, N/rad, N m/rad]."""
    return np.asarray(model.stiffness * model.gain.real.at(REFERENCE_FREQUENCY))


def _gain(model: CompressorModel, lines: npt.ArrayLike) -> RealArray:
    """Real and imaginary part with a real part of 1 at the reference line, shape (2, f)."""
    values = model.gain.at(lines) / model.gain.real.at(REFERENCE_FREQUENCY)
    return np.stack([values.real, values.imag])


@dataclass(frozen=True)
class Beside:
    """What is fitted beside the identification itself.

    `thesis`: the thesis's 44 numbers, where there is a drawing; `identical_mounts`: identical round
    mounts.
    """

    thesis: bool = True
    identical_mounts: bool = False


@dataclass(frozen=True, eq=False)
class IdentifiedTest:
    """One test, identified.

    - `thesis`: none without a drawing, or where it was not asked for.
    - `identical`: none where it was not asked for.
    - `truth`: none where it is not known.
    - `seconds`: of the identification alone [s].
    - `inputs_sha256`: hashes of the hammer test's files; empty where they do not stay.
    """

    identification: Identification
    thesis: ThesisFit | None
    identical: MountShares | None
    truth: CompressorTruth | None
    seconds: float
    inputs_sha256: Mapping[str, str]

    @property
    def input_files(self) -> tuple[Path, ...]:
        """Every file that was read, the truth included."""
        truth = () if self.truth is None else (self.truth.path,)
        return (*self.identification.test.input_files, *truth)


def read_test(
    folder: Path, *, from_hits: bool = False, truth: bool = False
) -> tuple[InertanceTest, CompressorTruth | None]:
    """Read a test and, where asked for, the truth of a virtual one.

    - raises InputError: a folder that holds no test or truth that can be read.
    """
    if not folder.is_dir():
        raise InputError(
            f"{folder}: there is no such folder; `deboom bench compressor {folder}` writes a "
            "virtual test"
        )
    refuse_other_kind(folder, FolderKind.compressor)
    test = read_inertance_test(folder, from_hits=from_hits)
    return test, read_compressor_truth(folder) if truth else None


def identified_test(
    test: InertanceTest,
    truth: CompressorTruth | None,
    options: IdentifyOptions,
    beside: Beside,
    step: Callable[[str], None],
    relative_to: Path | None = None,
) -> IdentifiedTest:
    """Identify a test and fit what was asked for beside.

    - `truth` or None: kept for comparison.
    - `relative_to`, optional: folder from which input files are named in the saved compressor;
      without it they leave no hashes, since they do not stay.
    - raises InputError: as `identify`; identical mounts without a drawing.
    """
    if beside.identical_mounts and test.drawing is None:
        raise InputError(
            f"{test.name}: identical mounts are counted from a drawing, and the test has none: add "
            "its [drawing] and [[mounts]], or leave out --identical-mounts"
        )
    hashes = {} if relative_to is None else hash_files(test.input_files, relative_to)
    with threadpool_limits(1):  # its matrices are too small to share
        begin = time.perf_counter()
        identification = identify(test, options, step)
        seconds = time.perf_counter() - begin
        thesis, identical = None, None
        if beside.thesis and test.drawing is not None:
            step("the thesis's 44 numbers")
            thesis = fit_thesis_parameters(identification, test.drawing)
        if beside.identical_mounts and test.drawing is not None:
            step("identical mounts")
            identical = mount_shares(identification, test.drawing.mounts, identical=True)
    return IdentifiedTest(identification, thesis, identical, truth, seconds, hashes)


def identified_virtual(
    seed: int, level: CalibrationLevel, beside: Beside, step: Callable[[str], None]
) -> IdentifiedTest:
    """Measure and identify a virtual compressor; seed 1 has the mounts of the thesis's table 11."""
    plan = CompressorPlan(
        case=CompressorCase.TABLE11 if seed == 1 else CompressorCase.RANDOM,
        identical_mounts=beside.identical_mounts,
    )
    with tempfile.TemporaryDirectory(prefix="deboom-") as scratch:
        test, truth = read_test(
            write_compressor_test(Path(scratch) / "test", seed, level, plan), truth=True
        )
    return identified_test(test, truth, IdentifyOptions(), beside, step)


def condition_at_100_hz(test: IdentifiedTest) -> float:
    """Condition number of the inertance near 100 Hz, rotations times the radius of gyration [1]."""
    nearest = int(np.argmin(np.abs(test.identification.inertance.frequency - 100.0)))
    return float(condition_numbers(test.identification, test.identification.length)[nearest])


def condition_numbers(identification: Identification, length: float) -> RealArray:
    """Condition number of the measured inertance, rotations times a length, shape (f,) [1].

    - `length`: that counts as one radian [m]; 1 for SI units.
    """
    unit = np.repeat([1.0, length], 3)
    return np.asarray(np.linalg.cond(identification.inertance.values * np.outer(unit, unit)))


def calibrated_inertance(identification: Identification) -> ComplexArray:
    """Measured inertance at the virtual point by self-calibrated sensors and impacts, (f, 6, 6)."""
    response, excitation = (
        np.linalg.pinv(matrix)
        for matrix in (
            identification.calibrated.response_matrix,
            identification.calibrated.excitation_matrix,
        )
    )
    return np.asarray(response @ identification.raw.frf.values @ excitation.T)


def identifiability_table(test: IdentifiedTest, thesis: ThesisFit) -> pd.DataFrame:
    """Put the thesis's numbers side by side with their bounds and what the test says of each."""
    parametrisation = thesis.fit.parametrisation
    assert isinstance(parametrisation, ThesisParameters)
    shown = [_SHOWN_UNIT.get(unit, (unit, 1.0)) for unit in parametrisation.units]
    factor = np.array([scale for _, scale in shown])
    held = set(thesis.fit.at_bound)
    table = {
        "parameter": parametrisation.names,
        "unit": [unit for unit, _ in shown],
        "start": factor * thesis.start,
        "lower bound": factor * thesis.bounds.lower,
        "upper bound": factor * thesis.bounds.upper,
        "fitted": factor * thesis.fit.values,
        "at its bound": ["yes" if name in held else "" for name in parametrisation.names],
        "share in the null space [1]": thesis.seen.participation,
        "posterior deviation": factor * thesis.knowledge.posterior,
        "posterior over prior [1]": thesis.knowledge.ratio,
        "verdict": verdicts(thesis),
    }
    if test.truth is not None:
        names = tuple(mount.name for mount in test.truth.mounts)
        true = ThesisParameters(names).values_of(test.truth.model, test.truth.mounts)
        table["truth"] = factor * true
    return pd.DataFrame(table)


def verdicts(thesis: ThesisFit) -> list[str]:
    """Say of each of the thesis's numbers whether the test knows it."""
    words = []
    for share, ratio in zip(thesis.seen.participation, thesis.knowledge.ratio, strict=True):
        if share >= ALONE:
            words.append("invisible")
        elif ratio > PRIOR_DOMINATED:
            words.append("prior-dominated")
        elif share > SMALLEST_SHARE:
            words.append("with others only")
        else:
            words.append("identified")
    return words


def placement_table(test: IdentifiedTest) -> pd.DataFrame:
    """List errors of gain, place and angle of sensors and impacts, with what was known before."""
    calibration = test.identification.calibrated
    prior = calibration.placement.deviations(test.identification.test.tolerances)
    posterior = np.sqrt(np.diag(calibration.covariance)[calibration.values.size :])
    units = [_placement_unit(name) for name in calibration.placement.names]
    factor = np.array([scale for _, scale in units])
    return pd.DataFrame(
        {
            "error of": calibration.placement.names,
            "unit": [unit for unit, _ in units],
            "found": factor * calibration.errors,
            "posterior deviation": factor * posterior,
            "prior deviation": factor * prior,
            "posterior over prior [1]": posterior / prior,
        }
    )


def _placement_unit(name: str) -> tuple[str, float]:
    if " position " in name:
        return "mm", 1e3
    return ("°", 180 / np.pi) if " angle " in name else ("%", 100.0)


def in_words(table: pd.DataFrame) -> pd.DataFrame:
    """Write numbers of different units in one column with equally many digits."""
    words = table.copy()
    for name in table.columns:
        if table[name].dtype.kind == "f" and not str(name).endswith("]"):
            digits = 2 if "deviation" in str(name) else DIGITS
            words[name] = [_digits(float(value), digits) for value in table[name]]
    return words


def alarms_in_words(alarms: Sequence[str]) -> str:
    """Count alarms: ``no alarm``, ``1 alarm``, ``2 alarms``."""
    return f"{len(alarms) or 'no'} {'alarms' if len(alarms) > 1 else 'alarm'}"


def _digits(value: float, digits: int) -> str:
    if not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    decimals = max(digits - 1 - math.floor(math.log10(abs(value))), 0)
    return f"{value:.{min(decimals, 6)}f}".replace("-", "−")
