"""A wide fleet on a page: those that gain least as curves, the others as a map, all in tables."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from deboom.errors import listed
from deboom.explore.robust import RobustValues, chosen
from deboom.explore.sensitivity import SobolIndices
from deboom.pages.front import PANELS, curve_rows, drawn_rows, left_out, report_cells, report_heard
from deboom.pages.interactive_front import with_evaluated
from deboom.pages.platform_front import DRAWN_OF_PRESCRIBED, PlatformFront
from deboom.pages.sensitivity import index_figures, most_changed
from deboom.plot.style import vehicle_colours
from deboom.report import Report

LINES = np.linspace(20.0, 60.0, 21)


class Fleet:
    """Levels of vehicles; the later one gains more."""

    order, frequency, today = 1.5, LINES, np.ones(2)

    def __init__(self, count):
        self.vehicles = [f"V-{number:02d}" for number in range(count)]

    def splv_change(self, design):
        """Fall by a tenth of a decibel more in each vehicle."""
        return -0.1 * np.arange(len(self.vehicles)) * (1.0 - design[0])

    def levels(self, design):
        """Fall by the change in every line."""
        return 60.0 + 5.0 * np.sin(LINES / 4.0) + self.splv_change(design)[:, np.newaxis]

    def peak_changes(self, _design):
        """No vehicle has a peak."""
        return dict.fromkeys(self.vehicles, ())


def robust_values(objectives):
    """Return a front of one response whose designs are its objectives."""
    n, zeros = len(objectives), np.zeros(len(objectives))
    return RobustValues(
        designs=objectives,
        mean=objectives[:, :1],
        sigma=objectives[:, 1:],
        mean_sum=objectives[:, 0],
        sigma_sum=objectives[:, 1],
        standard_error_mean_sum=zeros,
        standard_error_sigma_sum=zeros,
        failed=np.zeros(n, dtype=bool),
    )


def shown(count):
    fleet, report = Fleet(count), Report("Wide")
    report.section("Levels")
    colours = vehicle_colours(fleet.vehicles)
    report_heard(report, fleet, np.zeros(2), colours, "Curves.", change=np.arange(float(count)))
    return report


def test_a_fleet_that_fits_is_drawn_as_curves_alone():
    report = shown(3)
    assert list(report.figures) == ["spl_curves"]
    assert report.pictures["spl_curves"].caption == "Curves."


def test_the_largest_are_drawn_and_a_caption_says_where_all_are():
    values = np.arange(30.0)
    assert drawn_rows(values) == list(range(30 - PANELS, 30))
    assert drawn_rows(-values) == list(range(PANELS))
    assert drawn_rows(values[:3]) == [0, 1, 2]
    assert left_out(PANELS, "that gain least", "vehicles") == ""
    assert left_out(30, "that gain least", "vehicles") == (
        " The 24 of 30 vehicles that gain least; vehicles.csv has all."
    )


@pytest.mark.parametrize(("count", "judged"), [(PANELS, 90), (PANELS + 1, DRAWN_OF_PRESCRIBED)])
def test_the_front_of_prescribed_motion_is_judged_in_part_where_a_fleet_is_wide(count, judged):
    place = np.linspace(0.0, 1.0, 90)
    values = robust_values(np.column_stack([place, 1.0 - np.sqrt(place)]))
    asked = []

    def judge(designs):
        asked.append(designs)
        return chosen(values, np.arange(len(designs)))

    view = SimpleNamespace(
        prescribed=SimpleNamespace(values=values),
        fleet=Fleet(count),
        front=SimpleNamespace(judge=judge),
    )
    PlatformFront.judged_prescribed.func(view)
    assert len(asked[0]) == judged
    assert {0.0, 1.0} <= set(asked[0][:, 0])  # both ends stay


def test_of_a_wide_fleet_those_that_gain_least_are_curves_and_the_others_a_map():
    assert curve_rows(Fleet(30), np.zeros(2)) == list(range(PANELS))
    report = shown(30)
    assert list(report.figures) == ["spl_curves", "spl_maps"]
    assert report.failures == []
    assert report.pictures["spl_curves"].caption.startswith("The 24 of 30 vehicles that gain least")
    assert report.pictures["spl_maps"].caption.startswith("The other 6 vehicles")


def test_a_sentence_names_no_two_hundred_vehicles():
    assert listed(("a", "b", "c")) == "a, b and c"
    assert listed([f"V-{k}" for k in range(200)]) == "V-0, V-1, V-2 and 197 others"


def test_vehicles_without_an_interval_are_cells_with_its_ends():
    names = [f"V-{number:02d}" for number in range(30)]
    change = -np.linspace(0.3, 2.0, 30) + np.array([[0.0], [-0.2], [0.3]])
    rows, report = ("best-mean", "best-mean, from", "best-mean, to"), Report("Wide")
    report.section("Levels")
    for count in (PANELS, 30):
        drawn, name = drawn_rows(change[0, :count]), f"changes_{count}"
        report_cells(
            report, name, "change", rows, names[:count], change[:, :count], drawn, unit="dB"
        )
    assert list(report.figures) == ["changes_30"]
    assert report.failures == []
    assert report.pictures["changes_30"].caption == "Change of the other 6 vehicles."


def indices_of(count):
    """Return indices of three mounts; the later vehicle's level changes more."""
    total = np.tile(np.linspace(0.1, 0.9, count), (3, 1))
    nothing = np.zeros_like(total)
    names = tuple(f"V-{number:02d}" for number in range(count))
    indices = SobolIndices(
        ("TSM x", "EnM z", "Du x"), names, 64, 20, total, total, nothing, nothing, nothing, nothing
    )
    slope = np.outer([0.1, -1.0, 0.2], 1.0 + np.arange(count))
    return indices, SimpleNamespace(vehicles=names, slope=slope)


def test_of_a_wide_fleet_the_sensitivities_of_those_that_change_most_are_panels():
    indices, study = indices_of(30)
    assert most_changed(study) == list(range(30 - PANELS, 30))
    report = Report("Wide")
    report.section("Indices")
    index_figures(report, study, "sobol", indices, "Indices.")
    assert list(report.figures) == ["sobol", "sobol_others"]
    assert report.failures == []
    assert report.pictures["sobol"].caption == (
        "Indices. The 24 of 30 vehicles that a stiffness changes most; sobol.csv has all."
    )
    assert report.pictures["sobol_others"].caption == "Total index of the other 6 vehicles."


def test_the_sensitivities_of_a_fleet_that_fits_are_panels_alone():
    indices, study = indices_of(PANELS)
    report = Report("Narrow")
    report.section("Indices")
    index_figures(report, study, "sobol", indices, "Indices.")
    assert list(report.figures) == ["sobol"]
    assert report.pictures["sobol"].caption == "Indices."


@dataclass(frozen=True)
class Values:
    """A quantity of a page."""

    name: str
    values: np.ndarray


@dataclass(frozen=True)
class Page:
    """What evaluated designs are added to."""

    axes: tuple[Values, ...]
    facts: tuple[str, ...] = ()


@pytest.mark.parametrize(("failed", "facts"), [(0, ()), (1, ("1 of 3 evaluated designs",))])
def test_evaluated_designs_that_failed_are_counted(tmp_path, failed, facts):
    level, sigma = np.array([60.0, 59.0, 58.0]), np.array([0.5, 0.6, 0.7])
    level[:failed] = np.nan
    columns = {
        "TSM x [1]": [0.9, 1.0, 1.1],
        "mean level in search [dB(A)]": level,
        "sigma in search [dB]": sigma,
        "Wagon in search [dB(A)]": level,
    }
    pd.DataFrame(columns).to_csv(tmp_path / "evaluated.csv", index=False)
    entry = SimpleNamespace(folder=tmp_path, record={"files_sha256": {"evaluated.csv": ""}})
    study = SimpleNamespace(
        run=SimpleNamespace(entry=entry),
        vehicles=("Wagon",),
        space=SimpleNamespace(names=("TSM x",)),
        without_effect=(),
    )
    names = ("TSM x", "mean level", "\u03c3", "Wagon level")
    page = with_evaluated(Page(tuple(Values(name, np.zeros(1)) for name in names)), study)
    assert [len(axis.values) for axis in page.axes] == [4 - failed] * 4
    assert len(page.facts) == len(facts)
    assert all(map(str.startswith, page.facts, facts))
