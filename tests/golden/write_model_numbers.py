"""Writes `model_numbers.json`: what the models say of fixed designs and fixed measurements.

Everything goes through the command line, so that no inner name is pinned, and nothing is searched:
a search forks where a last bit differs. Run `python -m golden.write_model_numbers` in `tests` only
when a change of these numbers is meant, and say in the changelog why.
"""

import json
import re
import tempfile
from contextlib import chdir, contextmanager
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from command_line import call
from deboom.files.uff import read_uff

BENCHES = [
    ("campaign", "--truth-seed", "2", "--mount-set", "EnM1-GeM2-TSM3-Du4", "--time-run"),
    ("vehicle", "--truth-seed", "2", "--mount-set", "M2"),
    ("compressor", "--softening", "--flexible-receiver", "--level", "C1"),
    ("operation", "--truth-seed", "2", "--time-record", "--hammer-with-hoses"),
    ("electric-car", "--fleet", "2"),
]
PATH = Path(__file__).with_name("model_numbers.json")
STUDIES = Path(__file__).parents[2] / "studies"
VEHICLES = [f"U06-{number} [dB(A)]" for number in range(1, 6)]
DESIGNS = 0.85 + 0.3 * np.random.default_rng(7).random((12, 12)).round(3)


def levels(motion):
    """Levels of five vehicles for twelve designs, and surfaces against spectra."""
    names = [f"{mount} {axis} [1]" for mount in ("EnM", "GeM", "TSM", "Du") for axis in "xyz"]
    pd.DataFrame(DESIGNS, columns=names).to_csv("designs.csv", index=False)
    few = ("--resamples", "100", "--draws", "4", "--motion", motion)
    run = _study("correlation", "--group", "U06", "--table", "designs.csv", *few)
    check = _columns(run / "surface_check.csv", ["rms difference [dB]"])
    return _columns(run / "doe.csv", VEHICLES) | (check if motion == "prescribed" else {})


def sobol_indices():
    """First order and total indices of a fixed sample, all variables of all vehicles."""
    run = _study("sensitivity", "--n", "32", "--resamples", "100", "--motion", "prescribed")
    return _columns(run / "sobol.csv", ["first order [1]", "total [1]"])


def characterised_stiffness():
    """Quality and operating stiffness of every direction of one mount set."""
    _command("bench", "campaign", "campaign", "--mount-set", "M1", "--seed", "3")
    _command("characterise", "campaign", "--library", "mounts.db", "--gear", "5", "--gear", "6")
    _command("library", "export", "mounts.db", "mounts.json")
    library = json.loads(Path("mounts.json").read_text(encoding="utf-8"))
    numbers = {}
    for mount in library["mounts"]:
        for direction in mount["directions"]:
            name = f"{mount['identity']['mount']} {direction['axis']}"
            quality = direction["quality"]
            numbers[f"{name} quality"] = [float(value) for value in quality.values()]
            for key, points in direction["map_points"].items():
                if key.startswith("dynamic_stiffness"):
                    values = np.asarray(points["values"], dtype=float).reshape(-1)
                    numbers[f"{name} {key}"] = values[:: max(1, values.size // 20)].tolist()
    return numbers


def bench_files(kind, *words):
    """Two numbers for every file that the bench writes: how large its columns are, and where."""
    folder = _command("bench", kind, "written", "--seed", "2", *words)
    files = sorted(
        path
        for path in folder.rglob("*")
        if path.suffix in (".uff", ".npz", ".csv", ".json", ".toml")
    )
    return {path.relative_to(folder).as_posix(): _fingerprint(path) for path in files}


def _fingerprint(path):
    if path.suffix == ".uff":
        columns = [column for f in read_uff(path) for column in (f.abscissa, f.values)]
    elif path.suffix == ".npz":
        with np.load(path, allow_pickle=False) as kept:
            columns = [kept[name] for name in kept.files if kept[name].dtype.kind in "fic"]
    else:
        words = re.findall(r"-?\d+\.?\d*(?:e[+-]?\d+)?", path.read_text(encoding="utf-8"))
        columns = [np.array(words, dtype=float)]
    columns = [np.ravel(column).astype(complex).view(float) for column in columns]
    size = np.array([np.linalg.norm(column) for column in columns])
    place = [column @ np.cos(np.arange(column.size)) for column in columns]
    filled = size > 0.0
    return [np.log(size[filled]).mean(), (np.array(place)[filled] / size[filled]).sum()]


NUMBERS = {
    "levels, prescribed motion": lambda: levels("prescribed"),
    "levels, coupled motion": lambda: levels("coupled"),
    "levels, amplitude-dependent motion": lambda: levels("amplitude"),
    "Sobol indices": sobol_indices,
    "characterised stiffness": characterised_stiffness,
    **{f"bench {words[0]}": partial(bench_files, *words) for words in BENCHES},
}


def compute(name):
    """Return the numbers of one part, computed in a folder that is left behind empty."""
    with tempfile.TemporaryDirectory() as folder, chdir(folder), _no_pictures():
        return NUMBERS[name]()


def _columns(path, names, step=1):
    table = pd.read_csv(path)
    return {
        f"{path.stem}: {name}": table[name].iloc[::step].astype(float).tolist() for name in names
    }


def _study(name, *words):
    return _command("run", str(STUDIES / f"{name}.py"), *words)


def _command(*words):
    """Run a command line; return the folder that its last line names."""
    result = call(*words)
    return Path((result.stdout.strip().splitlines() or ["."])[-1])


@contextmanager
def _no_pictures():
    """Draw nothing: pictures are most of a small study's time, and no number comes from them."""
    from deboom.report import Report

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Report, "figure", lambda *_, **__: None)
        yield


def main():
    numbers = {name: compute(name) for name in NUMBERS}
    PATH.write_text(json.dumps(numbers, indent=0, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
