"""Examples that read measured data run as they are downloaded, their data in the same folder."""

import re
import runpy
import shutil
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"
DATA = re.compile(r":download:\s*`[^`]*?<\.\./\.\./\.\./(\S+?)>`")
WITH_DATA = {
    path: files
    for path in sorted(EXAMPLES.rglob("plot_*.py"))
    if (files := DATA.findall(path.read_text(encoding="utf-8")))
}


@pytest.mark.parametrize("example", WITH_DATA, ids=lambda path: path.stem)
def test_an_example_runs_beside_its_downloaded_data(example, tmp_path, monkeypatch):
    for file in (example, *(EXAMPLES.parent / name for name in WITH_DATA[example])):
        shutil.copyfile(file, tmp_path / file.name)
    monkeypatch.chdir(tmp_path)
    runpy.run_path(example.name)
    plt.close("all")


def test_no_other_example_leaves_its_folder():
    leaves = {path for path in EXAMPLES.rglob("plot_*.py") if '"../' in path.read_text("utf-8")}
    assert leaves == set(WITH_DATA)
