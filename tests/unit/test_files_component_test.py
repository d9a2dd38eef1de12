"""Folders of component TPA: what they hold, and one sentence for each way to be wrong."""

import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from command_line import call, refused
from deboom.bench import ComponentPlan, write_component_test
from deboom.errors import InputError
from deboom.files.component_test import (
    read_component_test,
    read_receiver,
)
from deboom.files.uff import read_uff, write_uff
from deboom.measurement.component_test import MountJoint
from deboom.measurement.component_tpa import component_tpa, in_receiver
from deboom.measurement.interface_completeness import completeness


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("component") / "test"
    plan = ComponentPlan(points=1, line_step=4.0)
    return write_component_test(folder, 3, plan=plan, truth_seed=2, noise_free=True)


@pytest.fixture(scope="module")
def held(written):
    return read_component_test(written)


@pytest.fixture(scope="module")
def result(held):
    return component_tpa(held)


@pytest.fixture
def folder(written, tmp_path):
    """Copy the folder, so that a test may spoil it."""
    return shutil.copytree(written, tmp_path / "test")


def edited(folder, *changes, file="component.toml"):
    path = folder / file
    text = path.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    return folder


def test_what_a_folder_holds(held):
    assert [point.name for point in held.points] == ["point 1"]
    assert held.points[0].load_names[3:] == ("point 1 mx", "point 1 my", "point 1 mz")
    assert len(held.indicator_channels) == 18
    assert len(held.on_board_channels) == 6
    assert [hit.name for hit in held.source_hits][:2] == ["H1 x", "H1 y"]
    assert held.ears == ("driver ear", "passenger ear")
    assert held.free.values.shape == (31, 9, 9)
    assert all(path.exists() for path in held.input_files)


def test_forces_are_in_newton_and_moments_in_newton_metre(result):
    assert result.runs[0].blocked.force.units == ("N",) * 3 + ("N m",) * 3
    assert result.runs[0].transfer.unit.inputs == ("N",) * 3 + ("N m",) * 3
    assert result.runs[0].table.columns[4] == "point 1 mx [N m]"
    with pytest.raises(InputError, match=r"no run 'idle', there are \['steady 1', 'steady 2'\]"):
        result.run("idle")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ([('"P1 S3"]', '"P1 S4"]')], "sensor 'P1 S4' is not in positions.xlsx"),
        ([('["P1 S1", "P1 S2", "P1 S3"]', '["P1 S1", "P1 S2"]')], "show only 5 of 6 motions"),
        ([(', "H2 z"]', "]")], "impact 'H2 z' belongs to no point and is not among"),
        ([('on_board = ["V4"', 'on_board = ["P1 S1"')], "two [[points]] and on_board have"),
        ([("position_m = [0.55,", "position_m = [9.55,")], "lies 9"),
        ([("degrees_of_freedom = 6", "degrees_of_freedom = 5")], "degrees_of_freedom"),
        ([("microphone_db = 0.2", "microphone_db = 20.0")], "no microphone is that far off"),
    ],
)  # fmt: skip
def test_sheets_and_points_that_do_not_fit(folder, changes, words):
    with pytest.raises(InputError) as caught:
        read_component_test(edited(folder, *changes))
    assert words in str(caught.value)


def test_unlike_lines_are_refused(folder):
    path = folder / "runs" / "steady_1.uff"
    shifted = [replace(function, abscissa=function.abscissa + 1.0) for function in read_uff(path)]
    write_uff(path, shifted, binary=True)
    with pytest.raises(InputError, match="run steady 1 has unlike lines, 31 from 21 to 141 Hz"):
        read_component_test(folder)


def test_a_missing_channel_is_named(folder):
    path = folder / "runs" / "steady_1.uff"
    node = read_uff(path)[0].response_node
    write_uff(
        path,
        [function for function in read_uff(path) if function.response_node != node],
        binary=True,
    )
    with pytest.raises(InputError, match=r"'P1 S1 x' .* is not in it: export it"):
        read_component_test(folder)


def test_another_order_of_rotations_is_named(folder):
    """Angles of a sensor that stands askew, written as Cardan angles that turn along."""
    edited(folder, ('sensor_table = "positions.xlsx"', 'sensor_table = "sensors.csv"'))
    sheet = pd.read_excel(folder / "positions.xlsx", sheet_name="sensors")
    sheet.assign(rotation_order="RxRyRz").to_csv(folder / "sensors.csv", index=False)
    with pytest.raises(InputError) as caught:
        read_component_test(folder)
    assert "point point 1: its sensors contradict each other" in str(caught.value)
    assert "were read as RxRyRz; read as RzRyRx the disagreement falls" in str(caught.value)


def test_functions_of_another_assembly_are_refused(written, folder):
    """The functions of a car in which another hose and another body stand."""
    other = folder.parent / "other"
    plan = ComponentPlan(points=1, line_step=4.0)
    write_component_test(other, 3, plan=plan, truth_seed=9, noise_free=True)
    for name in ("accelerance.uff", "coherence.uff", "pressure.uff"):
        shutil.copy(other / name, folder / name)
    with pytest.raises(InputError, match="are those of another assembly than the one that ran"):
        component_tpa(read_component_test(folder))


def test_too_few_indicators_are_refused(held):
    three = replace(held.points[0], sensors=held.points[0].sensors[:1], motions=("x", "y", "z"))
    assert len(replace(held, points=(three,)).indicator_channels) == 12
    words = "3 loads at the interface and 3 indicators: more channels than loads are needed"
    with pytest.raises(InputError, match=words):
        replace(held, points=(three,), indicators=())


def test_without_hits_on_the_source_completeness_is_not_known(held):
    with pytest.raises(InputError, match="strike its housing, and name the hits"):
        completeness(replace(held, source_hits=()))
    result = component_tpa(replace(held, source_hits=(), on_board=()))
    assert result.completeness is None
    assert any("is not known" in doubt for doubt in result.doubts)
    assert any("no sensor was left out" in doubt for doubt in result.doubts)


def test_a_receiver_with_other_points_is_refused(held, result, written):
    receiver = read_receiver(written / "receiver")
    with pytest.raises(InputError, match="these are functions of another assembly"):
        in_receiver(result, replace(receiver, points=(replace(receiver.points[0], name="else"),)))
    with pytest.raises(InputError, match="measure it hung up freely"):
        in_receiver(replace(result, test=replace(held, free=None)), receiver)
    three = replace(receiver.points[0], motions=("x", "y", "z"))
    rigid = {"point 1": MountJoint()}
    with pytest.raises(InputError, match="joined along 6 degrees of freedom"):
        in_receiver(result, replace(receiver, points=(three,), joints=rigid))


def test_mounts_are_rigid_parametric_or_measured(result, written, folder):
    """A measured stiffness gives the sound of the parametric one that it equals; rigid does not."""
    parametric = read_receiver(written / "receiver")
    stiffness = parametric.joints["point 1"].stiffness[0]
    lines = parametric.accelerance.frequency
    table = pd.DataFrame({"frequency [Hz]": lines})
    for row, a in enumerate("xyz"):
        for column, b in enumerate("xyz"):
            table[f"{a}{b} real [N/mm]"] = 1e-3 * stiffness[row, column].real
            table[f"{a}{b} imag [N/mm]"] = 1e-3 * stiffness[row, column].imag
    path = folder / "receiver" / "mount.csv"
    table.to_csv(path, index=False)
    text = (folder / "receiver" / "receiver.toml").read_text(encoding="utf-8")
    kept = [line for line in text.splitlines() if not line.startswith(("stiffness", "loss"))]
    rigid = "\n".join(kept)
    (folder / "receiver" / "receiver.toml").write_text(rigid, encoding="utf-8")
    stiff = read_receiver(folder / "receiver")
    named = rigid.replace('name = "point 1"', 'name = "point 1"\nstiffness_table = "mount.csv"')
    (folder / "receiver" / "receiver.toml").write_text(named, encoding="utf-8")
    measured = read_receiver(folder / "receiver")
    sounds = [in_receiver(result, mount)[0].sound.values for mount in (parametric, measured, stiff)]
    assert np.allclose(sounds[1], sounds[0])
    assert not np.allclose(sounds[2], sounds[0], rtol=0.1)
    table.iloc[1:].to_csv(path, index=False)
    with pytest.raises(InputError, match="its lines are not those of the functions"):
        read_receiver(folder / "receiver")
    for part in ("real", "imag"):
        table.loc[3, [f"z{axis} {part} [N/mm]" for axis in "xyz"]] = 0.0
    table.to_csv(path, index=False)
    with pytest.raises(InputError, match=r"mount\.csv: the stiffness of line 4 leaves a direction"):
        read_receiver(folder / "receiver")


def test_a_stiffness_stated_by_half_is_refused(folder):
    path = folder / "receiver" / "receiver.toml"
    lines = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join(line for line in lines if "loss_factor" not in line), "utf-8")
    with pytest.raises(InputError, match="'stiffness_n_per_m' and 'loss_factor' come together"):
        read_receiver(folder / "receiver")


def test_plans_that_cannot_be_built():
    with pytest.raises(InputError, match="the body has brackets for 1 to 3"):
        ComponentPlan(points=4)
    with pytest.raises(InputError, match=r"give one of 0\.5, 1, 2, 4 Hz"):
        ComponentPlan(line_step=3.0)


def test_the_bench_writes_by_command(tmp_path):
    folder = tmp_path / "drive"
    done = call("bench", "component", folder, "--points", 1, "--unmeasured-rotations")
    assert done.stdout.strip() == folder.as_posix()
    assert read_component_test(folder).points[0].motions == ("x", "y", "z")
    refused(("bench", "component", tmp_path / "no", "--points", 4), "brackets for 1 to 3")


def test_options_of_the_study_are_held_against_each_other():
    refused(("run", "component_tpa", "--receiver", "x"), "--receiver needs --test")
    refused(("run", "component_tpa", "--regularisation", "much"), "use one of cross-validation")
