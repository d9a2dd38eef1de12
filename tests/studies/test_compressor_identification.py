"""The compressor's study with one virtual compressor, through the same door as a user."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from deboom.study.runner import load_study, run_study

STUDY = load_study(Path(__file__).parents[2] / "studies" / "compressor_identification.py")


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """One run that several tests look at."""
    return run_study(STUDY, tmp_path_factory.mktemp("results"), {})


def test_a_compressor_is_identified(finished):
    summary = json.loads((finished / "summary.json").read_text(encoding="utf-8"))
    # 1.5 times what twenty compressors reach in nine of ten cases
    assert summary["cog_error_mm"] < 1.8
    assert summary["jacobian_rank"] == 35
    assert summary["condition_scaled_100hz"] == pytest.approx(2.0, abs=0.2)


def test_tables_say_what_is_known(finished):
    parameters = pd.read_csv(finished / "parameters.csv").set_index("parameter")
    columns = ["unit", "start", "identified", "standard deviation", "truth"]
    assert list(parameters.columns) == columns
    score = (parameters["identified"] - parameters["truth"]) / parameters["standard deviation"]
    assert np.sqrt(np.mean(score**2)) < 2.5
    numbers = pd.read_csv(finished / "identifiability.csv").set_index("parameter")
    assert len(numbers) == 44
    assert numbers.loc["mass", "verdict"] == "identified"
    assert numbers.loc["mount 1 rotation x", "verdict"] == "invisible"
    assert numbers["posterior over prior [1]"].between(0, 1).all()
