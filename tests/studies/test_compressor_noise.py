"""The study of the compressor's cabin noise with one car, through the same door as a user."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from deboom.study.runner import load_study, run_study

STUDY = Path(__file__).parents[2] / "studies" / "compressor_noise.py"


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """One run that several tests look at."""
    return run_study(load_study(STUDY), tmp_path_factory.mktemp("results"), {"draws": 20})


def test_the_sound_is_synthesised(finished, numbers_stay):
    numbers_stay(finished, levels=15)
    summary = json.loads((finished / "summary.json").read_text(encoding="utf-8"))
    assert summary["spl_peak_deviation_db"] < 1.0
    assert summary["spl_90_140_p90_db_with_hoses"] < 3.0
    assert summary["spl_90_140_p90_db_by_mounts"] > 3.0
    assert summary["identical_mounts"] == "no"
    assert summary["n_alarms"] == 0


def test_tables_hold_the_paths_with_their_phases(finished):
    paths = pd.read_csv(finished / "contributions.csv")
    levels = pd.read_csv(finished / "levels.csv")
    one = paths[(paths["sweep"] == "standard 7.5 bar") & (paths["frequency [Hz]"] == 100.0)]
    assert len(one) == 9 + 12
    sound = one["real"].sum() + 1j * one["imaginary"].sum()
    row = levels[(levels["sweep"] == "standard 7.5 bar") & (levels["frequency [Hz]"] == 100.0)]
    unweighted = 20 * np.log10(np.abs(sound) / np.sqrt(2) / 2e-5)
    # A-weighting of 100 Hz, IEC 61672-1
    assert row["synthesised [dB(A)]"].item() == pytest.approx(unweighted - 19.1, abs=0.06)
    assert (levels["synthesised from [dB(A)]"] <= levels["synthesised to [dB(A)]"]).all()
    assert set(pd.read_csv(finished / "hoses.csv")["hose"]) == {"suction hose", "discharge hose"}
    assert len(pd.read_csv(finished / "mounts.csv")) == 27
