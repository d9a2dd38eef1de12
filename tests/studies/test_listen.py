"""Run-ups of a tiny front as sound: what the files hold is what the model says."""

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import wavfile
from scipy.signal import hilbert
from typer.testing import CliRunner

from deboom.choices import Pick
from deboom.cli import app
from deboom.study.rebuilt import compared_run

STUDIES = Path(__file__).parents[2] / "studies"


@pytest.fixture(scope="module")
def folder(front_run, tmp_path_factory):
    copy = tmp_path_factory.mktemp("results") / front_run.parent.name / front_run.name
    return shutil.copytree(front_run, copy)


def listen(*words):
    return CliRunner().invoke(app, ["listen", *map(str, words), "--studies", str(STUDIES)])


def test_every_vehicle_sounds_as_loud_as_the_model_says(folder):
    result = listen(folder, "--seconds", 8)
    assert result.exit_code == 0, result.output
    *sounds, facts = map(Path, result.stdout.split("\n")[:-1])
    stated = json.loads(facts.read_text())
    model = compared_run(folder, STUDIES).model
    index = model.evaluate
    assert len(sounds) == 2 * len(index.response_names)
    rate, signal = wavfile.read(folder / "listen" / "U06-2 today.wav")
    heard = np.abs(hilbert(signal)) / 32767 * stated["full_scale_Pa"]
    line = int(np.argmax(np.abs(index.pressure(model.space.nominal[None, :])[0, 1, 20:-20]))) + 20
    share = (index.frequency[line] - stated["first_Hz"]) / (stated["last_Hz"] - stated["first_Hz"])
    wanted = np.abs(index.pressure(model.space.nominal[None, :])[0, 1, line])
    assert heard[round(share * 8 * rate)] == pytest.approx(wanted, rel=0.03)
    peaks = [np.abs(wavfile.read(path)[1].astype(int)).max() for path in sounds]
    assert max(peaks) == pytest.approx(32767 / 1.25, rel=1e-3)


def test_what_cannot_be_heard_is_refused(folder, tmp_path):
    short = listen(folder, "--seconds", "0.1")
    assert short.exit_code == 2
    assert "--seconds from 1 to 120" in short.stderr
    front = pd.read_csv(folder / "front.csv")
    names = {name for cell in front["pick"].dropna() for name in cell.split(" = ")}
    for pick in Pick:
        name = pick.value.replace("-", " ")
        result = listen(folder, "--design", pick.value, "--seconds", 1)
        assert result.exit_code == (0 if name in names else 2), result.output
    (tmp_path / "file").write_text("")
    taken = listen(folder, "--out", tmp_path / "file")
    assert "choose another --out" in taken.stderr
