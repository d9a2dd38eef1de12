"""Campaigns and virtual vehicles: which car drives with which parts, progress, and summaries."""

from types import SimpleNamespace
from unittest.mock import Mock

import pytest

from deboom.runs import campaigns


def test_every_vehicle_drives_with_every_set_and_is_struck_with_one(monkeypatch):
    """Three parts of the bench are measured and characterised, two cars drive with two sets."""
    cars, told = [], []

    def characterise(campaign, gear, torque, progress):
        progress(1, 3, "EnM")
        progress(3, 3, "Du")
        return ()

    def drive(folder, seed, name, parts, *, load_cases, accelerance, truth_seed, family):
        cars.append((name, parts, accelerance))

    monkeypatch.setattr(campaigns, "write_campaign", Mock())
    monkeypatch.setattr(campaigns, "read_campaign", Mock())
    monkeypatch.setattr(campaigns, "bench_sets", characterise)
    monkeypatch.setattr(campaigns, "write_vehicle", drive)
    monkeypatch.setattr(campaigns, "_driven", Mock())
    run = campaigns.LOAD_CASES[1].name
    campaigns.virtual_vehicles(1, 2, 2, run, lambda *step: told.append(step))
    assert [(done, total) for done, total, _ in told] == [
        (done, 10) for done in (0, 4, 6, 6, 7, 8, 9, 10)
    ]
    assert [text for *_, text in told[-3:]] == ["U06-2 with M1", "U06-2 with M2", ""]
    assert cars == [
        ("U06-1", "M1", True),
        ("U06-1", "M2", False),
        ("U06-2", "M1", False),
        ("U06-2", "M2", True),
    ]
    for written in campaigns.write_campaign.call_args_list:
        assert written.args[2].mount_sets == ("M1", "M2", "EnM1-GeM2-TSM1-Du2")


def test_a_platform_library_tells_each_step_of_its_making(monkeypatch, tmp_path):
    told = []

    def characterise(campaign, drawing, progress):
        progress(3, 9, "Du")
        raise RuntimeError("stop")

    for name in ("write_campaign", "read_campaign", "load_bench"):
        monkeypatch.setattr(campaigns, name, Mock())
    monkeypatch.setattr(campaigns, "characterise", characterise)
    with pytest.raises(RuntimeError, match="stop"):
        campaigns.write_platform_library(tmp_path / "a.json", 1, lambda *step: told.append(step))
    steps = [(done, text) for done, _, text in told]
    assert steps == [(0, "measuring the mounts"), (1, "reading"), (5, "mounts: Du")]
    assert not (tmp_path / "a.json").exists()


def test_lines_of_a_characterisation_state_the_half_width_in_percent():
    budget = SimpleNamespace(contradicted=False, identified=True, half_width_95=0.123)
    directions = {
        "EnM x": SimpleNamespace(budget=budget, complaint=""),
        "GeM y": SimpleNamespace(budget=None, complaint="too few runs"),
    }
    result = SimpleNamespace(
        mount_set="M1",
        runs=range(9),
        alarms=("χ² is 3",),
        campaign=SimpleNamespace(assumed=()),
        directions=directions,
    )
    assert campaigns.described(result).split("\n") == [
        "mount set M1, 9 runs",
        "  ALARM: χ² is 3",
        "  EnM x    ± 12.3 % of |K| (95 %), identified",
        "  GeM y    not identified: too few runs",
    ]
