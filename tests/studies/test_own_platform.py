"""The guide's way with a platform that nobody prepared: from an empty folder to the supplier."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from command_line import call
from deboom.bench.example import fill_platform
from deboom.supplier import numbers as supplier_numbers

MOUNTS = ("Front", "Left", "Right", "Roll")
VEHICLES = ("wagon-1", "wagon-2", "wagon-3")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Order 2, lines from 40 to 120 Hz, tables in xlsx, one group that is called family."""
    folder = tmp_path_factory.mktemp("home") / "nordic"
    names = [word for mount in MOUNTS for word in ("--mount", mount)]
    names += [word for vehicle in VEHICLES for word in ("--vehicle", vehicle)]
    call("new", "platform", folder, *names, "--group", "family", "--files", "xlsx")
    toml = folder / "platform.toml"
    text = re.sub("^# cylinders = 3", "# cylinders = 4", toml.read_text(), flags=re.M)
    toml.write_text(re.sub("^# dominant_order = 1.5", "# dominant_order = 2.0", text, flags=re.M))
    fill_platform(folder, np.arange(40.0, 120.25, 0.5))
    return folder


@pytest.mark.slow("runs six commands, from an empty folder to a supplier's page")
@pytest.mark.usefixtures("plain_loops", "no_pictures")
def test_from_an_empty_folder_to_an_anonymous_page_for_the_supplier(folder, monkeypatch, tmp_path):
    monkeypatch.setattr(supplier_numbers, "REPETITIONS", 40)
    summary = call("check", folder).stdout
    assert "4, 12 variables" in summary
    assert "3 in group family" in summary
    assert "161 lines in 40 to 120 Hz: 1200 to 3600 rpm of order 2" in summary
    budget = ("--generations", "1", "--population", "6", "--samples", "8", "--no-polish")
    budget += ("--band", "60", "70", "--checks", "64")
    options = ("--platform", folder, "--mounts", "spectra", "--out", tmp_path)
    run = Path(call("run", "front", *options, *budget).stdout.splitlines()[-1])
    assert '"group": []' in (run / "run.json").read_text()
    assert len(pd.read_csv(run / "front.csv")) >= 1
    said = " ".join(path.read_text(encoding="utf-8") for path in run.glob("*.csv"))
    assert not re.search("U06|TSM", said)
    words = ("--supplier", "--anonymous", "--mount", "Roll", "--out", tmp_path / "supplier")
    pages = call("report", run, *words).stdout.splitlines()
    for path in map(Path, pages):
        if path.suffix == ".html":
            text = re.sub(r"<style.*?</style>", "", path.read_text(encoding="utf-8"), flags=re.S)
            assert not re.search(r"\b(wagon|family|nordic)", text)
    assert call("report", run, "--interactive").stdout.strip().endswith("interactive.html")
    assert call("listen", run, "--seconds", "2").stdout.strip().endswith("listen.json")
