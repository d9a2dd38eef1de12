"""Electric cars from files: what is missing, mixed up or stated in another unit is refused."""

import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from broken_files import edited, edits, functions, refused

from deboom.bench.compressor_rig import OperationPlan
from deboom.bench.compressor_truth import CompressorPlan
from deboom.bench.electric_car_writer import write_electric_car
from deboom.errors import InputError
from deboom.files.electric_car import read_electric_car
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.electric_car import PointKind, refuse_contradictions_of_car


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    return write_electric_car(tmp_path_factory.mktemp("car") / "EV-1", 1)


@pytest.fixture(scope="module")
def car(written):
    return read_electric_car(written)


@pytest.fixture
def folder(written, tmp_path):
    """Give a folder whose files may be replaced; replacing breaks the link, the original stays."""
    return Path(shutil.copytree(written, tmp_path / "car", copy_function=_link))


def _link(source, target):
    Path(target).hardlink_to(source)


@pytest.mark.parametrize(
    ("fault", "sentence"),
    [
        *edits(
            """
"M1 S1" | "M2 S1" | two [[points]] have the sensor 'M2 S1'
"M1 I1x" | "M1 I9x" | impact 'M1 I9x' is not in positions.xlsx: add it there
node = 901 | node = 902 | pressure 'driver ear' per M1 I1x ... is not in it: export it
"MIC2101" | "MIC2102" | of microphone 'MIC2101', but 'driver ear' is 'MIC2102'
""",
            "car.toml",
        ),
        (edited("car.toml", '"M1 I1x", ', ""), "impact 'M1 I1x' belongs to no point of car.toml:"),
    ],
)
def test_facts_that_do_not_fit(folder, fault, sentence):
    fault(folder)
    refused(read_electric_car, folder, sentence)


def test_a_point_far_from_its_sensors_is_refused(folder):
    path = folder / "car.toml"
    text = path.read_text(encoding="utf-8")
    place = re.search(r"position_m = \[(.*?),", text)[1]
    path.unlink()
    path.write_text(text.replace(f"[{place},", f"[{float(place) + 3.0},", 1), encoding="utf-8")
    with pytest.raises(InputError, match=r"M1 S1 lies (2\.9|3\.0)\d* m from mount 1"):
        read_electric_car(folder)


def test_conjugated_accelerances_are_refused(car):
    values = car.accelerance.values.conj()
    conjugated = replace(car, accelerance=replace(car.accelerance, values=values))
    refuse_contradictions_of_car(car)
    with pytest.raises(InputError, match=r"EV-1: the functions are no inertance .* conjugated"):
        refuse_contradictions_of_car(conjugated)


def test_ear_that_no_sweep_has(folder):
    edited("car.toml", 'name = "driver ear"', 'name = "passenger ear"')(folder)
    words = "sweep standard 7.5 bar has no pressure at 'passenger ear' ... record that"
    refused(read_electric_car, folder, words)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (
            lambda f: replace(f, denominator="displacement", denominator_unit="m"),
            "in 'Pa/m': export it in Pa/N",
        ),
        (None, "coherence: function 'driver ear' per M1 I1x ... 501 +x) is not in it"),
    ],
)
def test_functions_of_another_unit_or_without_coherence(folder, change, sentence):
    def changed(functions):
        if change is None:
            return [functions[0], *functions[2:]]
        return [change(f) if f.ordinate == "pressure" else f for f in functions]

    functions("ntf/pressure.uff", changed)(folder)
    refused(read_electric_car, folder, sentence)


def test_noise_transfer_for_two_of_three_mounts(car):
    with pytest.raises(
        InputError,
        match="functions for mount 1, mount 3, but the compressor stands on mount 1, mount 2, "
        "mount 3: measure mount 2 as well",
    ):
        _with_points(car, tuple(point for point in car.points if point.name != "mount 2"))


def test_mount_without_its_holder(car):
    sweeps = tuple(
        replace(
            sweep,
            holder=None if sweep.holder is None else sweep.holder.select(sweep.holder.channels[:8]),
        )
        for sweep in car.operation.sweeps
    )
    with pytest.raises(InputError, match="no body-side acceleration of mount 3 along z: record it"):
        replace(car, operation=replace(car.operation, sweeps=sweeps))
    none = tuple(replace(sweep, holder=None) for sweep in car.operation.sweeps)
    with pytest.raises(InputError, match="the force of a mount needs both of its sides"):
        replace(car, operation=replace(car.operation, sweeps=none))


def test_hoses_may_be_left_out(car):
    without = _with_points(car, car.mounts)
    assert without.hoses == ()
    assert [point.kind for point in without.points] == 3 * [PointKind.MOUNT]


def test_values_that_do_not_fit(car):
    frf = car.pressure
    with pytest.raises(InputError, match="coherence lies between 0 and 1"):
        replace(car, coherence=2 * np.ones_like(car.coherence))
    shorter = Frf(frf.frequency[1:], frf.values[1:], frf.outputs, frf.inputs, frf.unit)
    with pytest.raises(InputError, match="different lines"):
        replace(car, pressure=shorter)
    with pytest.raises(InputError, match="every point of car EV-1 needs a name of its own"):
        replace(car, points=(car.points[0], *car.points))
    sweep = car.operation.sweeps[0]
    silent = replace(
        sweep, sound=Spectrum(sweep.frequency, np.ones((sweep.frequency.size, 1)), ("boot",), "Pa")
    )
    with pytest.raises(InputError, match="no pressure at 'driver ear'"):
        replace(car, operation=replace(car.operation, sweeps=(silent,)))


def test_points_need_enough_sensors_and_impacts(car):
    point = car.points[0]
    with pytest.raises(InputError, match=r"2 triaxial .* motions of mount 1"):
        _with_points(car, (replace(point, sensors=point.sensors[:2]), *car.points[1:]))
    with pytest.raises(InputError, match=r"5 impacts .* motions of mount 1"):
        _with_points(car, (replace(point, impacts=point.impacts[:5]), *car.points[1:]))


def test_plans_that_a_car_cannot_have(tmp_path):
    carried = OperationPlan(CompressorPlan(flexible_receiver=True))
    for plan in (OperationPlan(softening=True), OperationPlan(time_record=True), carried):
        with pytest.raises(InputError, match="leave softening, receiver and time record out"):
            write_electric_car(tmp_path / "car", 1, plan=plan)
    assert not any(tmp_path.iterdir())


def _with_points(car, points):
    impacts = [name for point in points for name in point.impact_names]
    channels = [name for point in points for name in point.channels]
    columns = [car.pressure.inputs.index(name) for name in impacts]
    return replace(
        car,
        points=points,
        pressure=car.pressure.select(inputs=impacts),
        coherence=car.coherence[:, :, columns],
        accelerance=car.accelerance.select(channels, impacts),
    )
