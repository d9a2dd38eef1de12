"""Each fault of a platform's files, through the command line: one sentence, nothing written.

The sentences themselves are tested in the files room; here it is the whole way that counts.
"""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from deboom.cli import app
from deboom.files.uff import read_uff, write_uff

ROOT = Path(__file__).parents[2]
STUDY = ROOT / "studies" / "u06_robust_front.py"
PLATFORM = ROOT / "studies" / "data" / "u06_f39_f45"


def replaced(name, old, new, count=1):
    """Return a fault: change a text in one file."""

    def fault(folder):
        path = folder / name
        text = path.read_bytes()
        assert old.encode() in text, f"{old} is not in {name}"
        path.write_bytes(text.replace(old.encode(), new.encode(), count))

    return fault


def removed(name):
    """Return a fault: a file is gone."""
    return lambda folder: (folder / name).unlink()


def cut(name, share):
    """Return a fault: a file ends early."""

    def fault(folder):
        path = folder / name
        content = path.read_bytes()
        path.write_bytes(content[: int(share * len(content))])

    return fault


def forces_turned(name, node):
    """Return a fault: all forces of one node have the opposite sign."""

    def fault(folder):
        path = folder / name
        functions = [
            replace(f, values=-f.values) if f.response_node == node and f.ordinate == "force" else f
            for f in read_uff(path)
        ]
        write_uff(path, functions)

    return fault


VEHICLE = "noise_transfer/U06-2.uff"
FAULTS = {
    "missing vehicle file": (removed(VEHICLE), ["U06-2.uff"]),
    "truncated UFF": (cut(VEHICLE, 0.55), ["U06-2.uff"]),
    "unknown key": (replaced("platform.toml", "gear = 5", "gaer = 5"), ["gaer", "gear"]),
    "other frequency axis": (
        replaced(VEHICLE, "2.50000e-01", "2.50100e-01", count=-1),
        ["U06-2.uff"],
    ),
    "negative stiffness": (
        forces_turned("operating/g5_wot220.uff", node=103),
        ["TSM x", "negative stiffness", "sign"],
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_fault_is_named_and_nothing_is_written(name, tmp_path):
    fault, words = FAULTS[name]
    platform = tmp_path / "platform"
    shutil.copytree(PLATFORM, platform, ignore=shutil.ignore_patterns("truth"))
    fault(platform)
    out = tmp_path / "results"
    result = CliRunner().invoke(
        app, ["run", str(STUDY), "--platform", str(platform), "--out", str(out)]
    )
    assert result.exit_code == 2, result.output
    assert 1 <= len(result.stderr.strip().splitlines()) <= 11, result.stderr
    for word in words:
        assert word in result.stderr
    assert not out.exists()
