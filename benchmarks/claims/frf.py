"""FRF estimation: from hits and blocks of time to functions with their worth.

An analyzer's export of 2014, one struck mass in closed form, and repetition with known truth. The
agreement with pyFRF is shown by `benchmarks/against_pyfrf.py`, in an environment of its own.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from time import perf_counter

import numpy as np

from claims import Claim
from deboom.errors import InputError
from deboom.files.hammer_test import HammerSheet, read_hammer_test, write_hammer_test
from deboom.files.rows import HammerChannel, HammerPoint
from deboom.files.tables import parse_unit
from deboom.measurement.channels import Frf
from deboom.measurement.impact_test import (
    HammerOptions,
    check_hits,
    hammer_frf,
    hammer_frfs,
)
from deboom.measurement.modal import require_coherence
from deboom.physics.frf import (
    LARGEST_VALID_ERROR,
    CrossSpectra,
    coherence,
    corrected_damping_ratio,
    h1,
    magnitude_error,
    phase_error,
)
from filtered_hits import blows
from struck_mass import DAMPING, NATURAL, fitted_pole, inertance, measured

DATA = Path(__file__).parents[2] / "tests" / "data" / "vibrationtesting-analyzer"
N_LINE = 20000
N_BLOWS = 500
SEEDS = range(1, 31)


def analyzer() -> list[Claim]:
    """Both identities, the factor df between them, and the refusal."""
    off_h1, off_gamma2, refused = 0.0, 0.0, []
    for case in ("case1", "case2"):
        with np.load(DATA / f"{case}.npz", allow_pickle=False) as file:
            export = {name: file[name] for name in file.files}
        printed = export["Hf_coh_chan_2"].astype(float)
        lines = (np.arange(printed.size) >= 5) & (np.arange(printed.size) < 1600) & (printed <= 1)
        step = float(export["PSD_DeltaF"])
        auto = [export[f"PSD_chan_{i}"].astype(float) * step for i in (1, 2)]
        spectra = CrossSpectra(
            export["Freq_domain"],
            auto[0][:, None, None],
            export["Hf_Cross_Spec_chan_2"][:, None, None],
            auto[1][:, None, None],
            2,
        ).on_lines(lines)
        ratio = h1(spectra)[:, 0, 0] / export["Hf_chan_2"][lines]
        off_h1 = max(off_h1, float(np.abs(ratio - 1).max()))
        found = coherence(spectra)[:, 0, 0]
        off_gamma2 = max(off_gamma2, float(np.abs(found - printed[lines]).max()))
        values = export["Hf_chan_2"][lines, None, None]
        frf = Frf(export["Freq_domain"][lines], values, ("out",), ("in",), "V/V")
        try:
            require_coherence(frf, printed[lines, None, None], (5.0, 400.0))
        except InputError as reason:
            refused.append(str(reason).split("median coherence ")[1][:4])
    return [
        Claim(
            "Analyzer's H1 and coherence out of its densities and cross power, two cases",
            "within 1e-6 where its coherence is at most 1",
            f"{off_h1:.1g}, {off_gamma2:.1g}",
            max(off_h1, off_gamma2) <= 1e-6,
        ),
        Claim(
            "The same exports as a basis of identification",
            "both refused, with the median coherence",
            f"{len(refused)} refused, median {' and '.join(refused)}",
            len(refused) == 2,
        ),
    ]


def struck_mass() -> list[Claim]:
    band = (10.0, 150.0)
    plain = hammer_frf(measured(), HammerOptions(band=band))
    s = 2j * np.pi * plain.frequency
    largest = float(np.abs(inertance(s)).max())
    off_plain = float(np.abs(plain.values[:, 0, 0] - inertance(s)).max()) / largest
    windowed, damping = 0.0, 0.0
    for tau in (0.05, 0.1, 0.3):
        found = hammer_frf(measured(), HammerOptions(band=band, time_constant=tau))
        off = np.abs(found.values[:, 0, 0] - inertance(s + 1 / tau)).max() / largest
        windowed = max(windowed, float(off))
        pole = fitted_pole(found.frequency, found.values[:, 0, 0])
        ratio = corrected_damping_ratio(-pole.real / abs(pole), abs(pole) / (2 * np.pi), tau)
        damping = max(damping, abs(float(ratio) / DAMPING - 1))
    return [
        Claim(
            "Inertance of a struck mass (37 Hz, 2 %), 10 to 150 Hz, against closed form with sign",
            "within 1e-3 of the peak",
            f"{off_plain:.1g}",
            off_plain <= 1e-3,
        ),
        Claim(
            "With exponential windows of 0.05, 0.1, 0.3 s: distance to H(jω + 1/τ)",
            "within 1e-5 of the peak",
            f"{windowed:.1g}",
            windowed <= 1e-5,
        ),
        Claim(
            "Damping ratio after the correction of the fitted pole, the same windows",
            "within 0.1 %",
            f"{100 * damping:.2g} %",
            damping <= 1e-3,
        ),
    ]


def random_error() -> list[Claim]:
    """Formulas against the scatter of independent lines, wherever they say 20 % or less."""
    generator = np.random.default_rng(1)
    worst_size = worst_phase = 0.0
    n_case = 0
    for n_average in (3, 5, 10, 20, 50):
        for gamma2 in (0.3, 0.5, 0.8, 0.9, 0.99):
            stated = float(magnitude_error(gamma2, n_average))
            if stated > LARGEST_VALID_ERROR:
                continue
            shape = (2, N_LINE, n_average)
            draw = generator.normal(size=shape) + 1j * generator.normal(size=shape)
            y = draw[0] + draw[1] * np.sqrt(1 / gamma2 - 1)
            found = np.mean(y * draw[0].conj(), axis=1) / np.mean(np.abs(draw[0]) ** 2, axis=1)
            n_case += 1
            worst_size = max(worst_size, float(np.abs(found).std()) / stated, key=_off)
            expected = float(phase_error(gamma2, n_average))
            worst_phase = max(worst_phase, float(np.angle(found).std()) / expected, key=_off)
    covered = []
    for seed in SEEDS:
        noisy = hammer_frf(
            measured(5, response_noise=2.0, seed=seed), HammerOptions(band=(15.0, 100.0))
        )
        truth = np.abs(inertance(2j * np.pi * noisy.frequency))
        away = np.abs(noisy.frequency - NATURAL / 2 / np.pi) > 3.0
        off = np.abs(np.abs(noisy.values[:, 0, 0]) / truth - 1)
        sound = away & (noisy.random_error[:, 0, 0] < LARGEST_VALID_ERROR)
        covered.append(off[sound] <= 2 * noisy.random_error[sound, 0, 0])
    share = float(np.mean(np.concatenate(covered)))
    return [
        Claim(
            f"Scatter of the size of H1 over the stated random error, {n_case} cases of 3 to 50 "
            "averages, coherence 0.3 to 0.99, stated at most 20 %",
            "0.9 to 1.1",
            f"worst {worst_size:.2f}",
            0.9 <= worst_size <= 1.1,
        ),
        Claim(
            "Scatter of the phase over the stated one, the same cases",
            "0.9 to 1.1",
            f"worst {worst_phase:.2f}",
            0.9 <= worst_phase <= 1.1,
        ),
        Claim(
            f"Truth within two stated errors of the size of H1, 5 noisy hits, {len(SEEDS)} seeds",
            "about 92 %, as 8 degrees of freedom have it: at least 90 %",
            f"{100 * share:.0f} %",
            share >= 0.90,
        ),
    ]


def _off(ratio: float) -> float:
    return abs(np.log(ratio)) if ratio > 0 else -1.0


def double_hits() -> list[Claim]:
    """Single and double blows behind the filters of analyzers; a second push of 5 % to all."""

    def doubled(*, double: bool) -> float:
        records = check_hits(blows(N_BLOWS, double=double, seed=1))
        return float(np.mean(["double hit" in " ".join(record.reasons) for record in records]))

    found, false = doubled(double=True), doubled(double=False)
    return [
        Claim(
            f"{N_BLOWS} double hits, second one 5 to 100 %, 50 samples later or more, behind steep "
            "filters: found",
            "at least 99 %",
            f"{100 * found:.1f} %",
            found >= 0.99,
        ),
        Claim(
            f"{N_BLOWS} single hits behind the same filters: taken for double",
            "at most 1 %",
            f"{100 * false:.1f} %",
            false <= 0.01,
        ),
    ]


def folder() -> Claim:
    """Read and evaluate an impact test of the size of the compressor's."""
    generator = np.random.default_rng(1)
    metres = parse_unit("m/s^2")
    channels = tuple(
        HammerChannel(f"A{i} {a}", "acceleration", i, f"+{a}", metres)
        for i in range(1, 7)
        for a in "xyz"
    )
    points = tuple(
        HammerPoint(f"I{i:02}", 100 + i, f"hits/I{i:02}.uff", (0.0, 0.1, 0.0), (0.0, 0.0, -1.0))
        for i in range(1, 19)
    )
    push = np.zeros((3, 4096))
    push[:, 200:220] = 100 * np.sin(np.pi * np.arange(20) / 20) ** 2
    hits = {p.impact: (push, generator.normal(size=(3, 4096, 18))) for p in points}
    with tempfile.TemporaryDirectory() as path:
        write_hammer_test(path, HammerSheet("size", 4096.0, 0.05, points, channels), hits)
        begin = perf_counter()
        estimate = hammer_frfs(read_hammer_test(path), HammerOptions(band=(10.0, 200.0)))
        seconds = perf_counter() - begin
    return Claim(
        "18 impacts × 3 hits × 18 channels × 4096 samples: folder read, FRFs of all",
        "at most 5 s",
        f"{seconds:.1f} s, {estimate.values.shape[1]} × {estimate.values.shape[2]} functions",
        seconds <= 5,
    )


def claims() -> list[Claim]:
    return [*analyzer(), *struck_mass(), *random_error(), *double_hits(), folder()]
