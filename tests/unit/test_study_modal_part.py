"""The modal part of a study: its tables, figures, and what it refuses."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.bench.fleet import NO_SPREAD
from deboom.bench.vehicle_writer import VehicleErrors, write_vehicle
from deboom.errors import InputError
from deboom.files.vehicle import read_vehicle
from deboom.measurement.channels import Frf
from deboom.study.synthesis_validation import (
    body_motion,
    modal_figures,
    modal_part,
    modal_tables,
    summary,
    truth_mac,
)

pytest.importorskip("sdypy.EMA", reason="modal analysis is an extra")


@pytest.fixture(scope="module")
def car(tmp_path_factory):
    errors = VehicleErrors(state=NO_SPREAD)
    folder = tmp_path_factory.mktemp("part") / "car"
    return read_vehicle(write_vehicle(folder, 1, errors=errors, load_cases=(), accelerance=False))


@pytest.fixture(scope="module")
def part(car):
    return modal_part(car)


def test_outputs_are_mount_points_and_panels(part):
    assert part.model.outputs[:3] == ("EnM x", "EnM y", "EnM z")
    assert part.model.outputs[-1] == "windshield"
    assert part.model.inputs == ("driver ear", "passenger ear")
    assert [place.label for place in part.places][3:6] == ["Du left", "Du right", "trunk floor"]
    assert [place.is_panel for place in part.places] == [False] * 5 + [True] * 8


def test_motion_is_along_the_directions_of_the_outputs(part):
    roof = [place.label for place in part.places].index("roof")
    moved = part.motion[:, roof]
    assert np.all(moved[:, :2] == 0)
    drawn = body_motion(part)
    assert np.asarray(drawn.normals)[roof].tolist() == [0.0, 0.0, -1.0]
    assert drawn.titles[0] == "23.7 Hz, ζ 2.8 %"


def test_tables_and_summary_with_and_without_a_truth(part):
    tables = modal_tables(part)
    assert list(tables) == ["modes", "panel_contributions"]
    assert "MAC with the truth [1]" not in tables["modes"]
    assert list(summary(part)) == [f"mode_{n}_hz" for n in range(1, 6)]
    itself = part.model.shapes
    assert modal_tables(part, itself)["modes"]["MAC with the truth [1]"].to_numpy() == (
        pytest.approx(1.0)
    )
    assert summary(part, itself)["mode_5_mac"] == pytest.approx(1.0)


def test_figures_are_named_by_what_is_known(part):
    few = replace(part, n_modes=2)
    assert list(modal_figures(replace(few, panels=None))) == [
        "stabilisation",
        "mode_shapes",
        "rebuilt",
    ]


def test_a_vehicle_without_panels_has_modes_all_the_same(car):
    bare = modal_part(replace(car, panels=None))
    assert bare.panels is None
    assert len(bare.model.outputs) == 15
    assert list(modal_tables(bare)) == ["modes"]


def test_what_cannot_be_answered_is_refused(car, part):
    with pytest.raises(InputError, match=r"modes from 20 to 80 Hz .* 12 asked for"):
        modal_part(car, n_modes=12)
    with pytest.raises(InputError, match="one column for each of the 23 outputs"):
        truth_mac(part, np.ones((5, 15)))
    motion = car.panels.motion
    other = Frf(motion.frequency + 1, motion.values, motion.outputs, motion.inputs, motion.unit)
    with pytest.raises(InputError, match="other lines"):
        modal_part(replace(car, panels=replace(car.panels, motion=other)))
