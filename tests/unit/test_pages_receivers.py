"""The first screen of a front with seats and wheel, and data measured again with receivers."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

import deboom
from deboom.bench.operating_run import PlannedRun
from deboom.bench.platform_writer import FELT_FLOOR, write_platform
from deboom.errors import InputError
from deboom.files.check import check_platform
from deboom.files.platform import read_platform
from deboom.files.uncertain_index import uncertain_index
from deboom.pages.driven import Drives
from deboom.pages.front_answer import report_loudest, weights_sentence
from deboom.pages.live_model import Start, live_page
from deboom.pages.platform_front import PlatformFront
from deboom.pages.receivers import (
    idle_table,
    orders_table,
    report_vibrations,
    vibration_table,
    worse_sentence,
)
from deboom.report import Picture, Report
from deboom.runs.options import AimOptions
from deboom.runs.platform_options import PlatformOptions
from deboom.runs.runner import load_study
from deboom.vehicles import expected_change
from deboom.vehicles.expected_change import Information
from deboom.vehicles.fleet import Fleet
from deboom.vehicles.fleet_front import FleetFront
from deboom.vehicles.free_directions import largest_changes
from deboom.vehicles.idle import IdleModel
from deboom.vehicles.level_objectives import level_limits
from deboom.vehicles.platform import MountSource
from deboom.vehicles.uncertain_data import CALIBRATION, DAY, FLOOR

RUN = PlannedRun(5, 220.0, full_load=True)


@pytest.fixture(scope="module")
def view(tmp_path_factory):
    folder = tmp_path_factory.mktemp("receivers") / "p"
    write_platform(folder, 1, receivers=True, groups=("U06-1",), load_cases=(RUN,))
    runs = read_platform(folder).runs(mounts="spectra", band=(20.0, 40.0))
    model = runs.model("coupled")
    robust = deboom.Robust(model, model.design_space(), draws=8)
    front = deboom.search(robust, population=8, generations=1, polish=False)
    return PlatformFront(front=front, runs=runs)


def test_vehicles_of_a_front_are_ears_and_objectives_sum_them_alone(view):
    assert view.fleet.vehicles == ("U06-1", "U06-1, rear ear")
    model, robust = view.index, view.front.robust
    assert robust.weights.tolist() == [2.0, 2.0, 0.0, 0.0]
    values = robust(np.ones((1, 12)))
    assert values.mean_sum[0] == pytest.approx(2.0 * values.mean[0, :2].sum(), rel=1e-12)
    change = np.diff(model(np.stack([np.ones(12), view.best])), axis=0)[0] / model.n_lines
    np.testing.assert_allclose(view.fleet.splv_change(view.best), change[:2], rtol=1e-12)
    assert float(view.fleet.mean(change[:2])) == pytest.approx(change[:2].mean(), rel=1e-12)


def test_a_page_with_sliders_has_the_ears_and_names_the_vibrations_that_it_leaves_out(view):
    start = Start("today", np.ones(12))
    live, refusal = live_page(view.front.robust, view.runs, [start], {})
    assert refusal == ""
    assert [vehicle["name"] for vehicle in live.header["vehicles"]] == list(view.fleet.vehicles)
    left_out = [name for name in view.index.response_names if name not in view.fleet.vehicles]
    assert len(left_out) == 2
    assert live.header["notes"]["vibration"] == f"not in this page: {'; '.join(left_out)}"


def test_weights_of_ears_are_told_without_those_of_vibrations(view):
    model, robust = view.index, view.front.robust
    weighted = deboom.Robust(model, robust.space, robust.sample, weights=[2.0, 1.0, 0.0, 0.0])
    fleet = FleetFront(replace(view.front, robust=weighted), view.load_case.order)
    assert weights_sentence(fleet).endswith("the weights are U06-1 2, every other one 1. ")
    assert float(fleet.mean(np.array([3.0, 0.0]))) == pytest.approx(2.0)


def test_a_check_names_receivers_and_takes_the_level_of_ears(view):
    lines = check_platform(view.platform.folder).summary.splitlines()
    said = [line.split(maxsplit=1)[1] for line in lines if line.startswith("receivers")]
    assert said == [
        "rear ear, sound [dB(A)], in U06-1",
        "seat rail z, acceleration [dB(Wk) re 1 µm/s²], in U06-1",
        "wheel y, acceleration [dB(Wh) re 1 µm/s²], in U06-1",
    ]
    (level,) = [line for line in lines if line.startswith("level")]
    assert float(level.split()[3]) < 80.0
    (idle,) = [line.split(maxsplit=1)[1] for line in lines if line.startswith("idle")]
    assert idle.startswith(
        "idle: idle in drive, 900 rpm; 900 rpm, orders 1.5, 2, 2.5, 3, 3.5, 4, 4.5, 5; orders 0.5, "
        "1, 5.5, 6 are left out, because no functions were measured there; largest level of all "
        "orders "
    )
    assert "dB(Wk) re 1 µm/s² in U06-1, seat rail z" in idle


def test_the_shade_of_the_loudest_ear_is_about_its_own_curve(view):
    # an ear that is not the first response: the driver's is not asked for
    fleet = FleetFront(view.front, view.load_case.order)
    vars(fleet)["ears"] = np.array([1])
    report = Report("title", "question")
    report.answer("verdict")
    report_loudest(report, fleet, view.best, lambda x: view.index.pressure(x)[:, [1]], "run-up")
    (picture,) = (block for block in report.panels[0].blocks if isinstance(block, Picture))
    axes = picture.drawing().axes[0]
    (shade,) = axes.collections
    _, line = axes.lines  # today, new
    frequency, level = shade.get_paths()[0].vertices.T
    for x, y in line.get_xydata():
        ends = level[np.isclose(frequency, x)]
        assert ends.min() - 0.5 < y < ends.max() + 0.5


def test_what_vibrates_more_stands_first(view):
    # seats feel what they felt less of today
    mean = view.front.baseline.mean.copy()
    mean[0, 2:] -= view.index.n_lines * np.array([10.0, 20.0])
    louder = replace(view.front)
    vars(louder)["baseline"] = replace(view.front.baseline, mean=mean)
    worse = replace(view, front=louder)
    table = vibration_table(worse)
    assert list(table["receiver"]) == ["U06-1, wheel y", "U06-1, seat rail z"]
    assert table["change [dB]"].is_monotonic_decreasing
    assert table["level is"].tolist() == ["dB(Wh) re 1 µm/s²", "dB(Wk) re 1 µm/s²"]
    rms = float(table["rms today"][0].removesuffix(" mm/s²"))
    assert rms == pytest.approx(1e-3 * 10 ** (table["level today [dB]"][0] / 20.0), rel=5e-3)
    assert worse_sentence(worse).startswith("More vibration: U06-1, wheel y (+")
    report = Report("title", "question")
    report.answer("verdict")
    report_vibrations(report, worse)
    assert [panel.title for panel in report.panels] == ["Seats and wheel", "At idle"]
    assert not report.failures


def test_a_page_shows_idle_order_by_order_and_names_what_gets_worse_there(view):
    (idle,) = view.index.idle
    designs = np.stack([view.fleet.today, view.best])
    every = idle(designs)
    table = idle_table(view).set_index("receiver")
    assert table["level today [dB]"]["U06-1, seat rail z"] == pytest.approx(every[0, 2])
    assert table["change [dB]"]["U06-1"] == pytest.approx(every[1, 0] - every[0, 0])
    assert table["change [dB]"].is_monotonic_decreasing
    assert table["rms today"]["U06-1"] == ""
    orders = orders_table(view).set_index(["receiver", "design"]).loc[("U06-1, wheel y", "today")]
    of_orders = orders[[f"order {order:g} [dB]" for order in idle.orders]].to_numpy(float)
    assert 10 * np.log10(np.sum(10 ** (of_orders / 10))) == pytest.approx(every[0, 3])
    assert orders["all orders [dB]"] == pytest.approx(every[0, 3])

    # everything is felt more at idle than today
    louder = replace(view.index, idle=(Raised(idle, view.best),))
    front = replace(view.front, robust=replace(view.front.robust, evaluate=louder))
    worse = replace(view, front=front)
    assert "U06-1, wheel y at idle (+9.0 dB)" in worse_sentence(worse)


@dataclass(frozen=True)
class Raised:
    """Idle whose levels are 9 dB above today's in one design."""

    idle: IdleModel
    design: np.ndarray

    def __call__(self, designs):
        """Return levels, shape (n, v)."""
        today = self.idle(np.ones((1, len(self.design))))
        return today + 9.0 * np.all(designs == self.design, axis=1)[:, np.newaxis]


def test_idle_is_limited_receiver_by_receiver_and_searched_for(view):
    model = view.index
    felt = level_limits(model, "idle", "today")
    assert [limit.number.name for limit in felt] == [
        "mean of the level at idle, U06-1, seat rail z",
        "mean of the level at idle, U06-1, wheel y",
    ]
    objectives = AimOptions(also=["idle=U06-1, seat rail z"]).objectives(model)
    exact = replace(view.front.robust.space, tolerance=np.zeros(12))
    robust = deboom.Robust(model, exact, draws=8, objectives=objectives, limits=felt)
    designs = np.ones((2, 12))
    designs[1, :9] = 1.2
    levels, values = model.idle[0](designs), robust(designs)
    np.testing.assert_allclose(values.objectives[:, 2], levels[:, 2], rtol=1e-12)
    assert robust.unit_of(objectives[2]) == "dB(Wk) re 1 µm/s²"
    rise = np.maximum(levels[1, 2:] - levels[0, 2:], 0.0)
    np.testing.assert_allclose(values.excess, [[0.0, 0.0], rise], atol=1e-9)
    with pytest.raises(InputError, match=r"not compared: name the receiver, such as 'U06-1, wheel"):
        level_limits(model, "idle", 80.0)
    with pytest.raises(InputError, match="the target of a receiver is a mean level over lines"):
        level_limits(model, "idle", "target")
    with pytest.raises(InputError, match='state a load case with kind = "idle"'):
        level_limits(replace(model, idle=()), "idle", "today")
    with pytest.raises(InputError, match=r"load case 'idle' is at idle, whose level is in no sum"):
        view.platform.runs(["idle"], mounts="spectra")


def test_data_measured_again_have_all_receivers(view):
    index = uncertain_index(view.index, view.platform, ())
    (again,) = index.draws(1, seed=1)
    assert again.response_names == view.index.response_names
    assert again.receivers == view.index.receivers
    change = again(np.ones((1, 12))) - view.index(np.ones((1, 12)))
    assert np.all(np.abs(change) / view.index.n_lines < 6.0)
    assert np.unique(change).size == 4
    kept = index.data.measured[0].vehicles[0]
    for receiver, frf in view.platform.fleet.vehicles[0].transfers.items():
        inside = np.isin(frf.frequency, view.index.frequency)
        np.testing.assert_allclose(kept.transfers[receiver].values, frf.values[inside], rtol=1e-12)


def test_receivers_of_a_vehicle_share_calibration_and_day_and_leave_its_ear_alone(view):
    index = uncertain_index(view.index, view.platform, ())
    shared = index.data.drawn(0, 1, only=(CALIBRATION, DAY))[0].vehicles[0]
    measured = index.data.measured[0].vehicles[0]
    factors = [
        shared.transfers[receiver].values / frf.values
        for receiver, frf in measured.transfers.items()
    ]
    assert np.ptp(np.abs(factors[0])) > 0.01
    for factor in factors[1:]:
        np.testing.assert_allclose(factor, factors[0], rtol=1e-9)

    alone = Fleet((replace(index.data.fleet.vehicles[0], receivers={}),))
    of_ear = replace(index.data, fleet=alone).drawn(0, 1)[0].vehicles[0]
    with_all = index.data.drawn(0, 1)[0].vehicles[0]
    assert np.array_equal(of_ear.noise_transfer.values, with_all.noise_transfer.values)
    # noise of an accelerometer, as its functions show it: that of the bench
    noisy = index.data.drawn(0, 1, only=(FLOOR,))[0].vehicles[0]
    for receiver, frf in list(measured.transfers.items())[2:]:
        noise = noisy.transfers[receiver].values - frf.values
        assert noise.real.std() == pytest.approx(FELT_FLOOR, rel=0.3)


@pytest.fixture(scope="module")
def two_cars(tmp_path_factory):
    folder = tmp_path_factory.mktemp("two") / "p"
    write_platform(folder, 1, receivers=True, groups=("U06-1", "U06-2"), load_cases=(RUN,))
    runs = read_platform(folder).runs(mounts="spectra", band=(20.0, 25.0))
    return SimpleNamespace(folder=folder, runs=runs, index=runs.model("coupled"))


EARS = ("U06-1", "U06-1, rear ear", "U06-2", "U06-2, rear ear")


def test_an_expected_change_has_all_receivers_and_means_of_ears(two_cars, monkeypatch):
    monkeypatch.setattr(expected_change, "N_DRAWS", dict.fromkeys(Information, 6))
    monkeypatch.setattr("deboom.files.uncertain_index.REPETITIONS", 2)
    runs, pick = two_cars.runs, np.where(np.arange(12) < 9, 0.85, 1.0)
    weights = np.array([3.0, 1.0, 0.0, 0.0, 2.0, 1.0, 0.0, 0.0])

    def expected(runs, weights):
        uncertain = uncertain_index(runs.model("coupled"), runs.platform, ())
        return uncertain.expected_change(pick, weights=weights).of(0)

    every = expected(runs, weights)
    ears = [0, 1, 4, 5]
    assert every.cars.expected.shape == (8,)
    assert np.all(every.cars.low < every.cars.high)
    assert np.flatnonzero(np.isfinite(every.peaks.low)).tolist() == ears
    assert every.mean.expected == pytest.approx(
        np.average(every.cars.expected[ears], weights=weights[ears]), rel=1e-9
    )
    # drivers' ears are told what they are told where nobody measured a seat
    heard = expected(runs.heard("a test", by_driver=True), weights[[0, 4]])
    for name in ("expected", "low", "high"):
        of_ears = getattr(every.cars, name)[[0, 4]]
        np.testing.assert_allclose(of_ears, getattr(heard.cars, name), rtol=1e-9)


def test_a_study_that_leaves_receivers_out_says_which_and_why(two_cars):
    heard = two_cars.runs.heard("means are of sounds")
    assert heard.not_judged == (
        "Not judged here: seat rail z and wheel y, because means are of sounds."
    )
    assert heard.model("coupled").response_names == EARS
    alone = two_cars.runs.heard("a car has one set", by_driver=True)
    assert alone.fleet.response_names == ("U06-1", "U06-2")
    assert alone.heard("nothing is left to leave out") is alone
    options = PlatformOptions(
        platform=two_cars.folder, band=(20.0, 25.0), mounts=MountSource.spectra
    )
    for name, names in {
        "commonality": ("U06-1", "U06-2"),
        "measured_uncertainty": EARS,
    }.items():
        study = load_study(name).module
        model = study.prepare(study.Options(platform=options))
        assert model.runs.fleet.response_names == names
        assert "seat rail z and wheel y, because" in model.runs.not_judged


def test_drives_are_compared_ear_by_ear(two_cars):
    driven, index = load_study("driven").module, two_cars.index
    today, new = np.ones(12), np.where(np.arange(12) < 9, 0.85, 1.0)
    levels = index.levels(np.stack([today, new]))[:, [0, 1, 4, 5]]
    study = SimpleNamespace(
        index=index,
        ears=np.array([0, 1, 4, 5]),
        vehicles=EARS,
        space=index.design_space(),
        picked=new,
    )
    drives = Drives(study, {"today": levels[:1], "new": levels[1:]})
    table = driven._vehicle_table(drives, "nothing is expected")
    assert tuple(table["vehicle"]) == EARS
    np.testing.assert_allclose(table["measured change [dB]"], table["model [dB]"], rtol=1e-12)
    assert np.unique(table["model [dB]"]).size == 4


def test_indices_and_free_directions_name_seats_and_judge_idle(two_cars):
    index = two_cars.index
    result = deboom.sobol(index, index.design_space(), n=8, seed=1)
    assert "U06-1, seat rail z" in result.table["response"].unique()
    moved = np.ones((1, 12))
    moved[0, 0] = 1.1
    changes = largest_changes(index, moved, np.ones(12))[0]
    assert changes.shape == (8,)
    at_idle = np.abs(np.diff(index.idle[0](np.vstack([np.ones(12), moved])), axis=0))[0]
    assert np.all(changes >= at_idle - 1e-12)
    assert largest_changes(replace(index, idle=()), moved, np.ones(12))[0].max() < 5.0


@pytest.mark.slow("descends along gradients of eight responses, and of four")
def test_a_front_with_seats_and_wheels_converges_as_that_of_their_ears(two_cars):
    """Receivers that no objective asks for change neither the end of a search nor its spread."""
    ends = []
    for model in (two_cars.index, two_cars.runs.heard("a test").model("coupled")):
        robust = deboom.Robust(model, model.design_space(), draws=8, weights=model.response_weights)
        for seed in (1, 2):
            front = deboom.search(robust, population=8, generations=2, seed=seed, verified_with=8)
            ends.append(np.min(front.search.front.objectives, axis=0) / len(model.response_names))
    of_all, of_ears = np.array(ends[:2]) * 8, np.array(ends[2:]) * 4
    per_line = 1.0 / (4 * two_cars.index.n_lines)
    # weights have a mean of 1: those of four ears among eight responses are 2
    assert np.all(np.ptp(of_all, axis=0) * per_line < [0.02, 0.01])
    np.testing.assert_allclose(of_all[0] / 2.0 * per_line, of_ears[0] * per_line, atol=0.01)
