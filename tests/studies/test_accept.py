"""Deliveries against an acceptance box, and its file: it comes back, and nothing else is read."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from acceptance_samples import acceptance_box, variable
from scipy.stats import norm

from command_line import call, refused
from deboom.errors import InputError
from deboom.files.acceptance import (
    BoxResponse,
    DeliveredPart,
    SheetDirection,
    SupplierSpecification,
    checksum,
    read_delivered_parts,
    read_measured_sheet,
    read_solution_box,
    write_solution_box,
)
from deboom.files.platform import read_platform
from deboom.language import Language
from deboom.runs.overview import command_of
from deboom.supplier.acceptance import rounded_down, supplier_verdict
from deboom.supplier.delivery import Demand, PartVerdict, judged_delivery, limited_axes
from pinned_pages import hold

PLATFORM = Path(__file__).parents[2] / "studies" / "data" / "u06_f39_f45"
MOUNTS = ("EnM", "GeM", "TSM", "Du")
HEADER = "part,batch,mount,x [N/mm],y [N/mm],z [N/mm]"


def box_of(limit=55.5, reference=2e5):
    """Return a box of the shipped platform: 0.8 to 1.0 in x, anything in y and z."""
    limited = {"reference_stiffness_n_per_m": reference}
    variables = [
        variable(f"{mount} {axis}", 0.8, 1.0, **limited)
        if axis == "x"
        else variable(f"{mount} {axis}", 0.8, 1.2, required=False)
        for mount in MOUNTS
        for axis in "xyz"
    ]
    vehicles = [BoxResponse(name=f"U06-{n}", limit=limit, share=0.97) for n in range(1, 6)]
    return acceptance_box(variables, vehicles)


def table_of(folder, factors, mount="TSM", batch="B1"):
    """Write parts of one mount with these factors in x."""
    rows = [f"{batch}/{n},{batch},{mount},{200 * f:.6f},," for n, f in enumerate(factors)]
    path = folder / "parts.csv"
    path.write_text("\n".join([HEADER, *rows]) + "\n")
    return path


def judged(folder, factors, uncertainty=0.0, platform=None, mount="TSM"):
    demand = Demand.of_box(box_of())
    parts = read_delivered_parts(table_of(folder, factors, mount), limited_axes(demand))
    return judged_delivery(demand, parts, platform, uncertainty, seed=1)


def test_verdicts_at_the_ends_of_the_interval(tmp_path):
    delivery = judged(tmp_path, [0.8, 1.0, 0.799, 1.001, 0.9])
    verdicts = [part.verdict for part in delivery.parts]
    assert verdicts == [PartVerdict.passed] * 2 + [PartVerdict.failed] * 2 + [PartVerdict.passed]
    assert delivery.batches[0].verdict is PartVerdict.failed
    assert judged(tmp_path, [0.8, 0.78, 1.001, 0.9]).batches[0].reason() == (
        "2 of 4 parts are outside; the furthest has x outside: 156.0 N/mm, asked 160.0 to "
        "200.0 N/mm"
    )
    # with 2 % uncertainty nothing near an end is decided
    verdicts = [
        part.verdict for part in judged(tmp_path, [0.81, 0.99, 1.01, 1.03, 0.9], 0.02).parts
    ]
    assert verdicts == [PartVerdict.undecided] * 3 + [PartVerdict.failed, PartVerdict.passed]


def test_few_parts_leave_a_batch_undecided_and_many_pass_it(tmp_path):
    scatter = np.linspace(-0.03, 0.03, 4)
    few = judged(tmp_path, 0.9 + scatter).batches[0]
    assert few.verdict is PartVerdict.undecided
    assert "measure more" in few.reason()
    many = judged(tmp_path, 0.9 + np.linspace(-0.03, 0.03, 30)).batches[0]
    assert many.verdict is PartVerdict.passed
    assert many.pieces.low > 0.99
    # Cp of a uniform row: 0.2 over 6 times its standard deviation
    sigma = np.std(np.linspace(-0.03, 0.03, 30), ddof=1)
    assert many.capabilities["x"].cp == pytest.approx(0.2 / (6 * sigma), rel=1e-5)


def test_a_single_part_has_a_verdict_but_no_capability(tmp_path):
    batch = judged(tmp_path, [0.9]).batches[0]
    assert batch.parts[0].verdict is PartVerdict.passed
    assert batch.capabilities == {}
    assert batch.verdict is PartVerdict.undecided


def test_mounts_of_one_delivery_may_have_unlike_axes():
    limited = {"reference_stiffness_n_per_m": 2e5}
    names = ("TSM x", "EnM x", "EnM z")
    box = acceptance_box(
        [variable(name, 0.8, 1.0, **limited) for name in names], box_of().responses
    )
    parts = [
        DeliveredPart("1", "B1", "TSM", {"x": 1.8e5}),
        DeliveredPart("2", "B1", "EnM", {"x": 1.8e5, "z": 2.2e5}),
    ]
    table = judged_delivery(box, parts, None, 0.0, seed=1).table
    assert table["verdict"].tolist() == ["pass", "fail"]
    assert table["z [N/mm]"].isna().tolist() == [True, False]


def test_a_piece_lies_inside_with_all_of_its_axes():
    """Half of them with x, for its mean is an end of the interval; all with z."""
    limited = {"reference_stiffness_n_per_m": 2e5}
    names = ("TSM x", "TSM z")
    box = acceptance_box(
        [variable(name, 0.8, 1.0, **limited) for name in names], box_of().responses
    )
    scatter = np.random.default_rng(1).permuted(np.tile(np.linspace(-1.0, 1.0, 30), (2, 1)), axis=1)
    parts = [
        DeliveredPart(f"{n}", "B1", "TSM", {"x": 2e5 + 4e3 * x, "z": 1.8e5 + 2e3 * z})
        for n, (x, z) in enumerate(scatter.T)
    ]
    (batch,) = judged_delivery(box, parts, None, 0.0, seed=1).batches
    assert batch.pieces.middle == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize(("together", "within"), [(False, 0.2), (True, 0.0)])
def test_a_car_counts_by_vehicle_or_with_all_of_them(tmp_path, together, within):
    """The first of five vehicles keeps a limit that nothing reaches, the others keep none."""
    limits = [100.0, 0.0, 0.0, 0.0, 0.0]
    vehicles = [
        response.model_copy(update={"limit": limit})
        for response, limit in zip(box_of().responses, limits, strict=True)
    ]
    box = box_of().model_copy(update={"responses": tuple(vehicles), "together": together})
    demand = Demand.of_box(box)
    table = table_of(tmp_path, 0.9 + np.linspace(-0.03, 0.03, 5))
    parts = read_delivered_parts(table, limited_axes(demand))
    (batch,) = judged_delivery(demand, parts, read_platform(PLATFORM), 0.0, seed=1).batches
    assert batch.cars.within.middle == pytest.approx(within, abs=1e-12)


def test_parts_may_be_a_table_in_memory(tmp_path):
    axes = limited_axes(Demand.of_box(box_of()))
    path = table_of(tmp_path, [0.9, 0.95])
    table = pd.read_csv(path)
    assert read_delivered_parts(table, axes) == read_delivered_parts(str(path), axes)
    table.loc[1, "mount"] = "XXM"
    with pytest.raises(InputError, match="DataFrame line 2: part 'B1/1': the box knows no mount"):
        read_delivered_parts(table, axes)


def test_a_part_without_a_limited_direction_is_named():
    box = acceptance_box(
        [variable(f"TSM {axis}", 0.8, 1.0, reference_stiffness_n_per_m=2e5) for axis in "xz"],
        box_of().responses,
    )
    with pytest.raises(InputError, match="part '1': TSM z was not measured, and the box limits it"):
        judged_delivery(box, [DeliveredPart("1", "B1", "TSM", {"x": 1.8e5})], None, 0.0, seed=1)


def test_copied_measurements_are_named(tmp_path):
    with pytest.raises(InputError, match=r"TSM x, batch B1: all 3 pieces have the value 0\.9"):
        judged(tmp_path, [0.9, 0.9, 0.9])


def test_a_batch_in_a_corner_passes_and_the_supplier_reads_why_it_is_named(tmp_path):
    demand = Demand.of_box(box_of(limit=40.0))  # which no car keeps
    parts = read_delivered_parts(
        table_of(tmp_path, 0.9 + np.linspace(-0.03, 0.03, 30)), limited_axes(demand)
    )
    delivery = judged_delivery(demand, parts, read_platform(PLATFORM), 0.0, seed=1)
    assert delivery.batches[0].verdict is PartVerdict.passed
    failed = replace(delivery.batches[0], parts=judged(tmp_path, [0.7, 0.9]).parts)
    assert "corner" not in failed.reason()  # a part in a corner is inside
    for language, reason in (
        (Language.en, "lies in a corner of the box"),
        (Language.de, "liegt in einer Ecke"),
    ):
        page = supplier_verdict(delivery, language, "2026-11-26").html()
        assert page.count(reason) == 1
        assert demand.checksum[:12] in page
        assert "2026-11-26" in page
        assert "U06" not in page


@pytest.mark.parametrize(
    ("spread", "verdict"), [(0.002, "shown"), (0.02, "open"), (0.05, "missed")]
)
def test_a_capability_is_held_against_the_cpk_that_was_demanded(tmp_path, spread, verdict):
    demand = Demand.of_box(box_of())
    assert demand.cpk is None
    values = 0.9 + spread * np.array([-1.2, -0.9, -0.6, -0.3, 0.0, 0.0, 0.3, 0.6, 0.9, 1.2])
    measured = judged(tmp_path, values).batches[0].capabilities["x"]
    assert demand.capability_verdict(measured) is None
    sheet = SupplierSpecification(
        mount="TSM",
        revision="",
        language="en",
        box_sha256="",
        share_stated=0.95,
        uncertainty=None,
        directions=(SheetDirection(name="TSM x", duty="free", **STATELESS),),
        cpk=1.33,
    )
    assert replace(demand, sheet=sheet).capability_verdict(measured).value == verdict


def test_a_bound_just_below_the_demanded_cpk_is_not_shown_at_it():
    table = pd.DataFrame({"cpk": [1.3297, 1.33, 1.15]})
    assert rounded_down(table, ["cpk"], decimals=2)["cpk"].tolist() == [1.32, 1.33, 1.15]


STATELESS = dict.fromkeys(
    (
        "lower",
        "upper",
        "today_n_per_mm",
        "loss_factor",
        "preload_n",
        "preload_mm",
        "amplitude_mm",
        "frequency_hz",
        "static_rate_n_per_mm",
    )
)


@pytest.mark.parametrize(
    ("column", "wanted", "tolerance"),
    [("preload [N]", 800.0, 0.05), ("amplitude [mm]", 0.5, 0.1), ("frequency [Hz]", 40.0, 0.02)],
)
def test_a_sheet_counts_what_was_measured_near_its_state(tmp_path, column, wanted, tolerance):
    state = {"preload_n": 800.0, "amplitude_mm": 0.5, "frequency_hz": 40.0, "today_n_per_mm": 200.0}
    direction = SheetDirection(name="TSM x", duty="must", **STATELESS | state)
    sheet = SupplierSpecification(
        mount="TSM",
        revision="",
        language="en",
        box_sha256="",
        share_stated=0.95,
        uncertainty=None,
        directions=(direction,),
    )
    row = {"part": "P1", "batch": "B1", "direction": "TSM x", "part number": ""}
    row |= {"preload [N]": 800.0, "amplitude [mm]": 0.5, "frequency [Hz]": 40.0}
    row |= {"|K| [N/mm]": 180.0, "K' [N/mm]": "", "K'' [N/mm]": "", "loss angle [°]": ""}

    def read(off):
        table = tmp_path / "measured.csv"
        pd.DataFrame([row | {column: wanted * (1.0 + off)}]).to_csv(table, index=False)
        return read_measured_sheet(table, sheet)

    for near in (-0.99 * tolerance, 0.99 * tolerance):
        assert read(near)[0].stiffness == {"x": pytest.approx(1.8e5)}
    for far in (-1.01 * tolerance, 1.01 * tolerance):
        with pytest.raises(InputError, match=f"within {100 * tolerance:g} %: measure it there"):
            read(far)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Run the command on a good batch, with the shipped platform."""
    folder = tmp_path_factory.mktemp("delivery")
    write_solution_box(folder / "acceptance_box.json", box_of())
    parts = table_of(folder, 0.9 + np.linspace(-0.03, 0.03, 20))
    options = ["--out", folder / "out", "--platform", PLATFORM, "--uncertainty", "0.01"]
    return Path(call("accept", folder, parts, *options).stdout.strip().splitlines()[-1])


def test_the_command_writes_a_run(run):
    hold(run, "accept")
    record = json.loads((run / "run.json").read_text())
    assert "--uncertainty 0.01 --no-over-today --seed 1" in command_of(record)


def test_levels_are_those_of_the_model_at_the_middle(run):
    # U06-1 with x at 0.9 of all mounts, the middle of the box
    from deboom.vehicles.booming_model import Motion

    platform = read_platform(PLATFORM)
    runs = platform.runs(fleet=platform.fleet.group("U06"))
    index = runs.model(Motion.prescribed)
    middle = index(np.full((1, 12), 0.9))[0, 0] / index.n_lines
    median = pd.read_csv(run / "levels.csv")["median [dB(A)]"][0]
    assert median == pytest.approx(middle, abs=0.25)


def test_ratios_to_todays_part_need_no_reference(tmp_path):
    box = Demand.of_box(box_of(reference=None))
    with pytest.raises(
        InputError, match=r"EnM x, whose stiffness nobody knows in N/mm.*--over-today"
    ):
        limited_axes(box)
    axes = limited_axes(box, over_today=True)
    path = tmp_path / "ratios.csv"
    path.write_text("part,batch,mount,x [1],y [1],z [1]\n1,B1,TSM,0.9,,\n2,B1,TSM,1.02,,\n")
    parts = read_delivered_parts(path, axes, over_today=True)
    delivery = judged_delivery(box, parts, None, 0.0, seed=1, over_today=True)
    assert [part.verdict for part in delivery.parts] == [PartVerdict.passed, PartVerdict.failed]
    assert delivery.parts[1].reason() == "x outside: 1.020 of today's, asked 0.800 to 1.000"
    with pytest.raises(InputError, match="asks nothing of 'XY x', only of EnM x"):
        judged_delivery(box, [replace(parts[0], mount="XY")], None, 0.0, 1, over_today=True)
    with pytest.raises(InputError, match="N/mm"):
        read_delivered_parts(table_of(tmp_path, [0.9]), axes, over_today=True)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (f"{HEADER}\n1,B1,TSM,,,\n", "TSM x was not measured"),
        (f"{HEADER}\n1,B1,CTSM,180,,\n", "no mount 'CTSM'"),
        (f"{HEADER}\n1,B1,TSM,180,,\n1,B1,TSM,181,,\n", "part '1'"),
        (f"{HEADER}\n1,B1,TSM,-180,,\n", "a stiffness is above 0"),
        ("part,batch,mount,x [mm],y [N/mm],z [N/mm]\n1,B1,TSM,180,,\n", "x"),
        ("part,batch,mount,x,y,z\n1,B1,TSM,180,,\n", "has no unit"),
        ("part,batch,mount,x [N/mm]\n1,B1,TSM,180\n", "'y"),
    ],
)
def test_bad_tables_are_one_sentence(tmp_path, text, sentence):
    path = tmp_path / "parts.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=sentence) as caught:
        read_delivered_parts(path, limited_axes(Demand.of_box(box_of())))
    assert "parts.csv" in str(caught.value)


def test_bad_calls_leave_nothing(tmp_path):
    write_solution_box(tmp_path / "box.json", box_of())
    parts = table_of(tmp_path, [0.9, 0.91])
    out = tmp_path / "out"
    for box, options, sentence in (
        (tmp_path, [], "holds no acceptance_box.json"),
        (tmp_path / "box.json", ["--uncertainty", "0.7"], "from 0 to below 0.5"),
    ):
        refused(("accept", box, parts, "--out", out, *options), sentence)
        assert not list(out.rglob("summary.json"))


BOX = acceptance_box(
    (
        variable("EnM x", 0.81, 1.125, reference_stiffness_n_per_m=323451.7),
        variable("Du y", 0.5, 1.2, weight=2.0, required=False),
    ),
    (
        BoxResponse(name="U06-1", limit=54.25, share=0.97),
        BoxResponse(name="U06-2", limit=54.25, share=0.932),
    ),
    share_measured_again=(0.91, 0.99),
)


@pytest.fixture
def box_file(tmp_path):
    file = tmp_path / "box.json"
    write_solution_box(file, BOX)
    return file


def test_a_box_comes_back(box_file):
    assert read_solution_box(box_file) == read_solution_box(str(box_file)) == BOX
    first, second = BOX.variables
    assert (first.set_by_limit, second.set_by_limit) == ("from and to", "to")
    assert BOX.variable("Du y") is second
    with pytest.raises(InputError, match="no variable 'Du z'"):
        BOX.variable("Du z")


def changed(path, change):
    """Change a box and its checksum, as somebody would who knows how."""
    document = json.loads(path.read_text(encoding="utf-8"))
    change(document)
    entries = {k: v for k, v in document.items() if k not in ("format", "version", "sha256")}
    document["sha256"] = checksum(entries)
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda d: d.update(format="other"), "no acceptance box"),
        (lambda d: d.update(version=1), "version 1"),
        (lambda d: d.pop("seed"), "key 'seed' in the top level is missing"),
        (lambda d: d.update(colour="red"), "unknown key 'colour'"),
        (lambda d: d.update(seed=True), "'seed' in the top level is true"),
        (lambda d: d.update(together=1), "valid boolean"),
        (lambda d: d.update(share_bound=1.2), "less than or equal to 1"),
        (lambda d: d.update(confidence=0.0), "greater than 0"),
        (lambda d: d.update(variables=[]), "at least 1 item"),
        (lambda d: d["variables"][0].update(upper=0.5), "the interval 0.81 to 0.5"),
        (lambda d: d["variables"][0].update(upper=99.0), "the interval 0.81 to 99"),
        (lambda d: d["variables"][1].update(name="EnM x"), "two [[variables]] are named 'EnM x'"),
    ],
)
def test_a_spoilt_file_is_refused_by_name(box_file, change, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)) as caught:
        read_solution_box(changed(box_file, change))
    assert str(box_file) in str(caught.value)


def test_a_missing_or_broken_file_is_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_solution_box(tmp_path / "none.json")
    broken = tmp_path / "broken.json"
    broken.write_text("{", encoding="utf-8")
    with pytest.raises(InputError, match="not JSON"):
        read_solution_box(broken)


def batches_of(factors):
    parts = [
        DeliveredPart(f"B{k}/{n}", f"B{k}", "TSM", {"x": 2e5 * factor})
        for k, batch in enumerate(factors)
        for n, factor in enumerate(batch)
    ]
    return judged_delivery(Demand.of_box(box_of()), parts, None, 0.0, seed=1)


def test_batches_that_drift_through_the_interval_are_named_with_their_ppk():
    """Each batch alone shows a Cpk above 3 or is far from one end only."""
    within = 0.002 * norm.ppf((np.arange(20) + 0.5) / 20)
    delivery = batches_of([mean + within for mean in np.linspace(0.83, 0.97, 5)])
    (process,) = delivery.processes
    assert process.smallest_within > 3
    everything = np.concatenate([mean + within for mean in np.linspace(0.83, 0.97, 5)])
    ppk = (1.0 - everything.mean()) / (3 * everything.std(ddof=1))
    assert process.overall.cpk == pytest.approx(ppk)
    assert ppk < 1
    assert process.drift == pytest.approx(0.035 / 0.9)
    assert "TSM x drifts by +3.9 % from batch to batch over 5 batches: Ppk" in process.words(
        Language.en
    )
    page = supplier_verdict(delivery, Language.en, "2026-11-28").html()
    assert "TSM x drifts by +3.9 %" in page
    assert "all 5 batches (Pp, Ppk)" in page
    german = supplier_verdict(delivery, Language.de, "2026-11-28").html()
    assert "Trend der Mittelwerte über die Chargen, über heute: TSM x von 0,830 (B0)" in german


def test_batches_that_are_alike_do_not_drift():
    random = np.random.default_rng(1)
    delivery = batches_of([0.9 + 0.01 * random.standard_normal(20) for _ in range(5)])
    assert [process.words(Language.en) for process in delivery.processes] == [""]


def test_two_cavities_contradict_the_normal_law_that_shares_rest_on():
    """A normal law has 7 % outside of an interval that two tight cavities keep."""
    cavity = 0.004 * norm.ppf((np.arange(20) + 0.5) / 20)
    (batch,) = batches_of([np.concatenate([0.845 + cavity, 0.955 + cavity])]).batches
    assert batch.capabilities["x"].expected_outside > 0.05
    assert not batch.capabilities["x"].normal
    assert batch.verdict is PartVerdict.undecided
    assert "x: the parts contradict the normal law" in batch.reason()
    alone = batches_of([0.845 + cavity, 0.955 + cavity]).batches
    assert all(each.capabilities["x"].normal for each in alone)
    assert [each.verdict for each in alone] == [PartVerdict.passed] * 2
