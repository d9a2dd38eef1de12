"""What people do wrong in folders is named; tests/samples/mistakes.py builds many more."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from deboom.arrays import ComplexArray
from deboom.bench.campaign import CampaignPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.component import ComponentPlan
from deboom.bench.component_writer import write_component_test
from deboom.bench.families import draw_family
from deboom.bench.fleet import receptance
from deboom.errors import DataWarning, InputError
from deboom.files.check import check_folder
from deboom.files.component_test import read_component_test
from deboom.files.platform import read_platform
from deboom.measurement.component_findings import component_findings
from deboom.physics.rigid_body import box_density
from deboom.vehicles.platform import MountSource
from deboom.vehicles.plausibility import platform_findings
from samples.later_mistakes import LATER, LB
from samples.mistakes import MISTAKES, RUNS_ON_BENCH, SHORT_RUN, outcomes


@pytest.fixture(scope="module")
def platform():
    return read_platform("u06")


def findings(platform):
    return platform_findings(
        mounts=platform.mounts,
        powertrain=platform.powertrain,
        fleet=platform.fleet,
        load_cases=platform.load_cases,
        cylinders=platform.cylinders,
    )


def moved(platform, change):
    """Change the positions (n, 3) of all pieces."""
    places = np.array([place for mount in platform.mounts for place in mount.positions])
    rows = iter(map(tuple, change(places)))
    mounts = [replace(m, positions=tuple(next(rows) for _ in m.pieces)) for m in platform.mounts]
    return replace(platform, mounts=tuple(mounts))


def measured(platform, case, quantity, change):
    """Change the values (f, channel) of a quantity of the load case of a number."""
    cases = list(platform.load_cases)
    spectrum = getattr(cases[case], quantity)
    values = change(spectrum.values.copy(), spectrum.channels)
    cases[case] = replace(cases[case], **{quantity: replace(spectrum, values=values)})
    return replace(platform, load_cases=tuple(cases))


def heard(platform, number, change):
    """Change the functions (f, path) of the vehicle of a number."""
    vehicles = list(platform.fleet.vehicles)
    frf = vehicles[number].noise_transfer
    values: ComplexArray = change(frf.values[:, 0].copy(), frf.frequency)[:, np.newaxis]
    vehicles[number] = replace(vehicles[number], noise_transfer=replace(frf, values=values))
    return replace(platform, fleet=replace(platform.fleet, vehicles=tuple(vehicles)))


def dropped(first, last, value=0.0):
    def change(values, channels):
        values[first:last, channels.index("GeM y")] = value
        return values

    return change


def degrees_as_radians(values, _):
    return np.abs(values) * np.exp(1j * np.angle(values, deg=True))


def exchanged(values, _):
    values[:, [0, 8]] = values[:, [8, 0]]
    return values


def one_sign(values, _):
    values[:, 3] *= -1
    return values


def late(platform, quantity, channels, seconds):
    """Delay channels of a quantity in all load cases; no channels: all of them."""
    omega = 2 * np.pi * platform.load_cases[0].force.frequency

    def turned(values, names):
        columns = [names.index(name) for name in channels or names]
        values[:, columns] *= np.exp(-1j * omega * seconds)[:, np.newaxis]
        return values

    for case in range(len(platform.load_cases)):
        platform = measured(platform, case, quantity, turned)
    return platform


def jumping(values, _):
    values[80:] *= 10.0
    return values


def humming(values, _):
    values[120] *= 30.0
    return values


def one_path(values, _):
    values[:, 3] *= 10.0
    return values


def ringing(values, frequency):
    """Add a mode whose damping is so low that one line stands out."""
    mode = 25.5
    damped = mode**2 - frequency**2 + 2j * 0.001 * mode * frequency
    return values + 8.0 * np.outer(mode**2 * 0.002 / damped, np.abs(values).mean(axis=0))


def on_moving_body(platform):
    """Add the motion of a body to the displacements of its powertrain."""
    fleet = draw_family("attachments", 7, 7).fleet()
    names = [name for name in fleet.paths if name in platform.load_cases[0].force.channels]
    of_names = [fleet.paths.index(name) for name in names]
    cases = []
    for case in platform.load_cases:
        compliance = receptance(fleet.bodies["U06-1"], case.force.frequency)
        compliance = compliance[:, of_names][:, :, of_names]
        moved = case.displacement.values.copy()
        columns = [case.displacement.channels.index(name) for name in names]
        moved[:, columns] += np.einsum("fab,fb->fa", compliance, case.force.select(names).values)
        cases.append(replace(case, displacement=replace(case.displacement, values=moved)))
    return replace(platform, load_cases=tuple(cases))


def reversed_of(platform, channel):
    def turned(values, channels):
        values[:, channels.index(channel)] *= -1
        return values

    for case in range(len(platform.load_cases)):
        for quantity in ("displacement", "force"):
            platform = measured(platform, case, quantity, turned)
    return platform


def test_the_shipped_platform_is_plausible(platform):
    assert findings(platform) == ()


@pytest.mark.parametrize(
    ("fault", "certain", "sentence"),
    [
        (lambda p: moved(p, lambda x: x[:, [1, 0, 2]]), True, "columns x and y exchanged"),
        (lambda p: moved(p, lambda x: x * [1, -1, 1]), True, "y reversed (left is right)"),
        (lambda p: moved(p, lambda x: x * [-1, 1, 1]), True, "x reversed"),
        (lambda p: moved(p, lambda x: x[[1, 0, 2, 3, 4]]), True, "EnM and GeM exchanged"),
        (lambda p: moved(p, lambda x: x + np.array([1.3, 0, 0.4])), False, "of gravity, not"),
        (lambda p: moved(p, lambda x: x / 10), False, "that of the numbers (mm, cm, m)"),
        (lambda p: reversed_of(p, "TSM y"), False, "with 'TSM y' reversed 0.0 % are left"),
        (
            lambda p: measured(p, 2, "displacement", dropped(40, 45)),
            True,
            "load case g6_wot120: displacement of GeM y is exactly 0 from 30 to 31 Hz",
        ),
        (
            lambda p: measured(p, 2, "force", dropped(0, 241, 3 - 1j)),
            True,
            "force of GeM y is the same at all lines",
        ),
        (lambda p: measured(p, 2, "force", dropped(0, 241)), True, "GeM y is 0 at all lines"),
        (
            lambda p: measured(p, 1, "displacement", lambda x, _: np.abs(x) + 0j),
            True,
            "load case g5_wot220: displacement and force have no imaginary part",
        ),
        (
            lambda p: replace(
                p, load_cases=(p.load_cases[0], replace(p.load_cases[0], name="twin"))
            ),
            True,
            "load cases g5_wot120 and twin hold the same numbers",
        ),
        (
            lambda p: replace(p, load_cases=(replace(p.load_cases[0], order=0.3),)),
            False,
            "4000 to 16000 rpm at order 0.3",
        ),
        (
            lambda p: replace(p, powertrain=replace(p.powertrain, mass=125.0)),
            False,
            "is mass_kg that of the whole powertrain",
        ),
        (
            lambda p: replace(p, powertrain=replace(p.powertrain, mass=p.powertrain.mass / LB)),
            False,
            "is the mass in kg and not in lb",
        ),
        (lambda p: moved(p, lambda x: x[:, [1, 1, 2]]), False, "was one pasted over the other"),
        (on_moving_body, False, "are these absolute displacements of the powertrain"),
        (lambda p: heard(p, 2, lambda h, _: h.conj()), False, "transfer functions answer"),
        (lambda p: heard(p, 2, lambda h, _: 0.1 * h), False, "U06-3: its noise transfer func"),
        (lambda p: heard(p, 2, lambda h, _: np.abs(h)), True, "functions have no imaginary part"),
        (lambda p: heard(p, 2, degrees_as_radians), False, "are their phases in degrees"),
        (lambda p: heard(p, 2, one_sign), False, "functions of GeM x have the opposite sign"),
        (lambda p: heard(p, 2, exchanged), False, "of EnM x and TSM z look exchanged"),
        (
            lambda p: heard(p, 2, lambda *_: p.fleet.vehicles[3].noise_transfer.values[:, 0]),
            True,
            "vehicles U06-3 and U06-4 have the same noise transfer functions",
        ),
        # the phase of rubber counts for 0.07 ms
        (lambda p: late(p, "force", (), 0.6e-3), False, "of all mounts are 0.5 ms late"),
        (lambda p: late(p, "force", (), -0.6e-3), False, "all mounts are 0.7 ms ahead"),
        (lambda p: late(p, "force", ("TSM x",), -2e-3), False, "force of TSM x is 2.0 ms ahead"),
        (
            lambda p: late(p, "displacement", ("GeM x",), 0.6e-3),
            False,
            "'GeM x' taken for late by 0.6 ms",
        ),
        (
            lambda p: measured(p, 4, "force", lambda f, _: f * np.exp(0.8j)),
            False,
            "load case g6_wot220: 8 of 8 directions have loss factors beyond 0.02 to 0.6",
        ),
        (
            lambda p: measured(p, 4, "force", lambda *_: p.load_cases[1].force.values),
            True,
            "load cases g5_wot220 and g6_wot220 hold the same forces",
        ),
        (
            lambda p: moved(p, lambda x: x * np.insert(np.ones((4, 3)), 2, [1, 1, -1], axis=0)),
            True,
            "the positions' z of TSM reversed 0.0 % are left",
        ),
        (
            lambda p: replace(
                p, load_cases=(*p.load_cases[:5], replace(p.load_cases[5], torque_limit=162.0))
            ),
            False,
            "load case g7_wot220: its engine torque reaches",
        ),
        (
            lambda p: heard(p, 2, lambda h, _: np.abs(h) * (1 + 0.01j)),
            False,
            "U06-3: its noise transfer functions have a phase that does not change",
        ),
        (lambda p: heard(p, 2, jumping), False, "jump by a factor of"),
        (lambda p: heard(p, 2, humming), False, "a single line at 50 Hz"),
        (lambda p: heard(p, 2, one_path), False, "its noise transfer function of GeM x lies"),
        (
            lambda p: heard(p, 2, lambda h, _: h[:, [0, 0, *range(2, 10)]]),
            True,
            "(EnM x and EnM y)",
        ),
    ],
)  # fmt: skip
def test_a_mistake_is_named(platform, fault, certain, sentence):
    named = findings(fault(platform))
    assert [finding.certain for finding in named if sentence in finding.sentence] == [certain], (
        named
    )


def test_what_leaves_less_than_90_percent_rigid_is_an_alarm(platform):
    few = findings(late(platform, "displacement", ("GeM x",), 0.6e-3))
    many = findings(late(platform, "displacement", ("GeM x",), 6e-3))
    assert [finding.word for finding in few] == ["WARNING"]
    (rigid,) = [finding for finding in many if "of a rigid body" in finding.sentence]
    assert rigid.word == "ALARM"
    assert "'GeM x' taken for late by 6.0 ms" in rigid.sentence


def test_a_sharp_mode_is_no_hum(platform):
    assert findings(heard(platform, 2, ringing)) == ()


def test_the_density_of_a_box_of_steel():
    mass, sides = 7850.0 * 0.4 * 0.3 * 0.5, np.array([0.4, 0.3, 0.5])
    inertia = np.diag(mass / 12.0 * (np.sum(sides**2) - sides**2))
    assert box_density(mass, inertia) == pytest.approx(7850.0)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Write a campaign whose second run was recorded over time."""
    plan = CampaignPlan(("M1",), RUNS_ON_BENCH[:1], 1, time_run=SHORT_RUN)
    return write_campaign(tmp_path_factory.mktemp("recorded") / "campaign", 7, plan)


def test_runs_over_time_are_checked_with_the_others(recorded):
    faults, _, summary = check_folder(recorded)
    assert faults == ()
    assert "g5_wot220_time: 23 lines of order 1.5" in summary
    assert "losses    M1, 2 runs: loss factors" in summary
    assert "WARNING" not in summary
    assert "ALARM" not in summary


@pytest.mark.parametrize(
    ("stated", "wrong", "sentence"),
    [
        ("rising = true", "rising = false", "g5_wot220_time: the speed rises"),
        ("gear = 5", "gear = 6", "run g5_wot220_time of M1: its static forces have"),
    ],
)
def test_a_mistake_in_a_run_over_time_is_named(recorded, tmp_path, stated, wrong, sentence):
    folder = Path(shutil.copytree(recorded, tmp_path / "wrong"))
    head, section, entry = (folder / "campaign.toml").read_text().partition("[[time_runs]]")
    (folder / "campaign.toml").write_text(head + section + entry.replace(stated, wrong))
    faults, _, summary = check_folder(folder)
    assert sentence in "\n".join((*faults, summary))


@pytest.fixture(scope="module")
def component(tmp_path_factory):
    folder = tmp_path_factory.mktemp("component") / "test"
    return read_component_test(write_component_test(folder, plan=ComponentPlan(line_step=4.0)))


def test_free_functions_that_are_the_coupled_ones_are_named(component):
    assert component_findings(component, None) == ()
    (sentence,) = component_findings(replace(component, free=component.accelerance), None)
    assert sentence.startswith("the functions of the free source are those of the source on the")


def test_a_channel_of_a_point_is_doubted_by_its_tolerances(component):
    frf = component.accelerance
    gains = np.where(np.array(frf.outputs) == "P2 S1 x", 2.0, 1.0)[:, np.newaxis]
    wrong = replace(component, accelerance=replace(frf, values=gains * frf.values))
    (sentence,) = component_findings(wrong, None)
    assert sentence.startswith("point 2: its sensors contradict a rigid motion: with 'P2 S1 x'")
    wide = replace(component.tolerances, sensor_gain=0.1, sensor_angle=0.1)
    allowed = component_findings(replace(wrong, tolerances=wide), None)
    assert not any("rigid motion" in sentence for sentence in allowed)


def test_a_study_refuses_what_is_certain_and_warns_of_the_rest(platform):
    mirrored = moved(platform, lambda x: x * [1, -1, 1])
    with pytest.raises(InputError, match="left is right"):
        mirrored.runs(mounts=MountSource.spectra)
    low = heard(platform, 2, lambda h, _: 0.1 * h)
    with pytest.warns(DataWarning, match="vehicle U06-3: its noise .* dB below those"):
        low.runs(mounts=MountSource.spectra)


@pytest.mark.slow("checks a folder for every mistake that there is")
def test_folders_with_mistakes_of_each_kind_are_told_where():
    names = {
        ("platform", "a vehicle missing in the list"),
        ("platform", "files of two load cases exchanged"),
        ("compressor", "acceleration in g labelled m/s2"),
        ("compressor", "drawn rotation of the mounts in radians"),
    }
    wanted = [mistake for mistake in MISTAKES if (mistake.folder.value, mistake.name) in names]
    assert len(wanted) == len(names)
    missed = [
        (outcome.mistake.name, outcome.sentences)
        for outcome in outcomes(41, wanted)
        if not outcome.named
    ]
    assert missed == []


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("campaign", "gear of a run off by one"),
        ("campaign", "static forces of one mount in kN labelled N"),
        ("campaign", "one accelerometer channel late by 4 to 10 ms"),
        ("campaign", "a static curve in kN under a header in N"),
        ("compressor", "one sensor 30 mm off along x"),
        ("compressor", "weighed with its bracket"),
        ("compressor", "a hidden old sheet before the right one"),
        ("component", "sensors of two points exchanged"),
    ],
)
def test_a_mistake_in_a_folder_is_named_by_its_check(kind, name):
    wanted = [each for each in LATER if (each.folder.value, each.name) == (kind, name)]
    (outcome,) = outcomes(41, wanted)
    assert outcome.named, outcome.sentences


@pytest.mark.filterwarnings("ignore::deboom.files.uff.AxisDriftWarning")
@pytest.mark.slow("checks 70 folders")
def test_most_later_mistakes_are_named():
    missed = [
        (outcome.mistake.folder.value, outcome.mistake.name)
        for outcome in outcomes(141, [each for each in LATER if each.visible])
        if not outcome.named
    ]
    visible = sum(each.visible for each in LATER)
    assert len(missed) <= 0.15 * visible, missed
