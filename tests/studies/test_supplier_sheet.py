"""The sheet of a mount supplier: its numbers, its words, what it never tells, and its way back."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import openpyxl
import pandas as pd
import pytest
from acceptance_samples import acceptance_box, variable
from scipy.stats import norm

from command_line import call, refused
from deboom.bench.powertrain import load_bench
from deboom.errors import InputError
from deboom.explore.choices import Pick
from deboom.explore.scatter import capability
from deboom.files import acceptance
from deboom.files.platform import platform_sha256
from deboom.files.run_folder import hash_files
from deboom.language import Language
from deboom.mounts.mount import Bracket, mean_operating_stiffness
from deboom.runs.rebuilt import supplier_study
from deboom.supplier import numbers as supplier_numbers
from deboom.supplier import page as supplier_page
from deboom.supplier import sources
from deboom.supplier.mount_sheet import MountSheet
from deboom.supplier.numbers import LABORATORY, SupplierEffects, machine_states
from deboom.supplier.page import documents
from deboom.supplier.sheet import measured_capability, proving_parts, required_capability
from deboom.vehicles.free_directions import Need
from pinned_pages import hold

STUDIES = Path(__file__).parents[2] / "studies"
UNKNOWN = ("EnM y", "GeM y", "TSM y")
FREE = ("Du y", "Du z")
INTERVALS = {"TSM x": (0.70, 0.84), "Du x": (0.70, 1.05)}
SEARCHED = (0.68, 1.38)
NO_SOURCES = sources.SheetSources(acceptance.Programme(), None, {}, None, None)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    return tmp_path_factory.mktemp("results")


@pytest.fixture(scope="module")
def study(front_run):
    return supplier_study(front_run, STUDIES, Pick.best_mean)


@pytest.fixture(scope="module")
def few_draws():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(supplier_numbers, "REPETITIONS", 40)
        yield


def run_folder(folder, inputs, tables, arguments=None):
    """Write what other commands look at in the folder of a finished run."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, table in tables.items():
        table.to_csv(folder / name, index=False)
    files = [path for path in folder.iterdir() if path.name != "run.json"]
    record = {
        "study": folder.parent.name,
        "arguments": arguments or {},
        "inputs_sha256": inputs,
        "files_sha256": hash_files(files, relative_to=folder),
    }
    (folder / "run.json").write_text(json.dumps(record), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def box_run(study, results):
    """Write a box as solution_box does, with intervals that nobody has searched for."""
    case, _ = study.load_cases[0]
    today = np.concatenate(
        [mean_operating_stiffness(m, case, study.band) for m in study.platform.mounts]
    )
    variables = [
        variable(
            d.name,
            *INTERVALS.get(d.name, SEARCHED),
            searched=SEARCHED,
            nominal=float(study.picked[d.column]),
            reference_stiffness_n_per_m=float(k) if np.isfinite(k) else None,
            required=d.name not in (*UNKNOWN, *FREE),
        )
        for d, k in zip(study.directions, today, strict=True)
    ]
    vehicles = [acceptance.BoxResponse(name=n, limit=54.4, share=1.0) for n in study.vehicles]
    stated = {"title": f"{study.platform.title}: acceptance box", "band_hz": study.band}
    stated |= {"platform_sha256": platform_sha256(study.platform)}
    box = acceptance_box(variables, vehicles, platform=study.platform.name, **stated)
    folder = results / "solution_box" / "box"
    folder.mkdir(parents=True)
    acceptance.write_solution_box(folder / "acceptance_box.json", box)
    return run_folder(folder, {}, {})


@pytest.fixture(scope="module")
def tolerance_run(front_run, results):
    record = hash_files([front_run / "run.json"], relative_to=front_run)
    names = [f"{mount} {axis}" for mount in ("EnM", "GeM", "TSM", "Du") for axis in "xyz"]
    table = pd.DataFrame({"variable": names, "cheapest ± [%]": np.linspace(8.0, 30.0, 12)})
    folder = results / "tolerance_allocation" / "done"
    arguments = {"pick": "best-mean", "point": None}
    return run_folder(folder, record, {"allocation.csv": table}, arguments)


@pytest.fixture(scope="module")
def sharing_run(study, results):
    """Two strut mounts, the second one for a vehicle that the front knows nothing of."""
    rows = []
    for direction in study.directions:
        numbers = {"A": (0.8, ", ".join(study.vehicles))}
        if direction.mount.name == "TSM":
            numbers = {"A": (0.9, "U06-1, U06-2, F39-1"), "B": (0.8, "F45-4")}
        for number, (factor, vehicles) in numbers.items():
            rows.append(
                {
                    "part number": f"{direction.mount.name} {number}",
                    "direction": direction.name,
                    "stiffness factor [1]": factor,
                    "vehicles": vehicles,
                }
            )
    inputs = hash_files(study.platform.input_files, relative_to=study.platform.folder)
    folder = results / "commonality" / "shared"
    return run_folder(folder, inputs, {"part_numbers.csv": pd.DataFrame(rows)})


def sheet_of(study, mount="TSM", files=None, language=Language.en, **changes):
    given = sources.sheet_sources(study, files or sources.SheetFiles())
    given = replace(given, **changes)
    middle = sources.middle_design(study, sources.bands(study, given))
    chosen_mount = next(m for m in study.platform.mounts if m.name == mount)
    return MountSheet(
        study=study,
        sources=given,
        effects=SupplierEffects(study, middle),
        mount=chosen_mount,
        secrets=(),
        language=language,
        issued="2026-11-26",
    )


@pytest.fixture(scope="module")
def sheet(study, box_run, sharing_run, few_draws):
    return sheet_of(study, files=sources.SheetFiles(box=box_run, sharing=sharing_run))


def test_a_sheet_says_what_a_factor_of_the_rubber_makes_of_it_with_its_brackets(study, few_draws):
    plain = sheet_of(study)
    stiffness = mean_operating_stiffness(plain.mount, study.load_cases[0][0], study.band)
    of_body = Bracket("body", [], [np.nan_to_num(2.0 * stiffness, nan=1e9)])
    held = replace(plain, mount=replace(plain.mount, brackets=(of_body,)))
    wanted = float(plain.effects.middle[study.of("TSM")[0].column])
    both = 1.5 / (1.0 / wanted + 0.5)
    words = f"TSM x {plain.percent(round(wanted, 2))} → {plain.percent(round(both, 2))}"
    assert any(words in note for note in held.notes)
    assert not any("bracket" in note for note in plain.notes)


def report(*words, **code):
    return call("report", *words, "--supplier", "--studies", STUDIES, **code)


def test_nothing_is_asked_where_nothing_is_known_or_todays_part_will_do(study):
    need = {direction.name: direction.need for direction in study.directions}
    assert all(need[name] is Need.unknown for name in UNKNOWN)
    assert all(need[name] is Need.nothing for name in FREE)
    back = [study.space.names.index(name) for name in (*UNKNOWN, *FREE)]
    assert np.array_equal(study.wanted[back], np.ones(len(back)))
    for direction in study.directions:
        low, high = study.freedom.interval[direction.column]
        if direction.need in (Need.wanted, Need.today):
            assert (direction.need is Need.wanted) == (not low <= 1.0 <= high)
        if direction.need is Need.anything:
            assert (low, high) == pytest.approx((0.8 * 0.85, 1.2 * 1.15))


def test_only_this_part_is_what_the_model_says_directly(sheet, study):
    design = np.ones(12)
    of_mount = [k for k, name in enumerate(study.space.names) if name.startswith("TSM ")]
    design[of_mount] = sheet.effects.middle[of_mount]
    now, then = (study.index(x[np.newaxis])[0] / study.index.n_lines for x in (np.ones(12), design))

    assert np.allclose(sheet.effects.change["TSM"], then - now, atol=1e-12)
    table = sheet.levels.set_index("design")
    alone = table.loc["only this part new"]
    assert alone["change"] == pytest.approx((then - now).mean())
    assert 0.0 < alone["change_half_width"] < 0.3 * abs(alone["change"])
    assert table.loc["today", "level"] == pytest.approx(now.mean())
    expected = alone[["expected_low", "expected_change", "expected_high"]].to_list()
    assert expected == sorted(expected)
    # a car brings less than its model promises, and the interval is not that of measurements
    assert alone["change"] < alone["expected_change"] < 0.0
    assert expected[2] - expected[0] > 2 * alone["change_half_width"]
    assert np.isnan(table.loc["today", "expected_change"])


def test_slope_and_tolerance_gain_are_differences_of_the_model(sheet, study):
    effects, column = sheet.effects, study.space.names.index("TSM x")
    stiffer, softer = np.array(effects.middle), np.array(effects.middle)
    stiffer[column] *= 1.001
    softer[column] *= 0.999
    levels = study.index(np.stack([softer, stiffer])).mean(axis=1) * study.per_vehicle
    assert effects.slope[column] == pytest.approx(50.0 * (levels[1] - levels[0]), rel=1e-3)
    row = sheet.worth.set_index("direction").loc["TSM x"]
    assert row["slope"] == effects.slope[column]
    assert row["gain"] > 0.0
    weights = np.arange(1.0, 1.0 + len(study.vehicles))
    weighted = replace(study, run=SimpleNamespace(model=replace(study.model, weights=weights)))
    effects = SupplierEffects(weighted, effects.middle)
    both = np.stack([softer, stiffer])
    levels = np.average(study.index(both), axis=1, weights=weights) * study.per_vehicle
    assert effects.slope[column] == pytest.approx(50.0 * (levels[1] - levels[0]), rel=1e-3)


def test_one_nominal_and_one_band_at_the_state_of_the_test(sheet):
    block = sheet.block.set_index("direction")
    x, state = block.loc["TSM x"], sheet.states["TSM x"]
    today = abs(state.stiffness) * 1e-3

    shares = x[["lower_share", "nominal_share", "upper_share"]].to_list()
    assert shares == pytest.approx([70.0, 77.0, 84.0])
    assert x[["lower", "nominal", "upper"]].to_list() == pytest.approx(
        [0.70 * today, 0.77 * today, 0.84 * today]
    )
    assert x["half_width"] == pytest.approx(100 * 0.07 / 0.77)
    assert x["set_by_limit"] == "both ends"
    assert block.loc["TSM y", "duty"] == "not identified"
    assert np.isnan(block.loc["TSM y", "nominal"])
    assert list(sheet.specification.musts) == ["x"]


def test_a_state_is_backed_by_measurements_and_has_a_usual_amplitude(sheet):
    state = sheet.states["TSM x"]
    surface = state.direction.characterised.surface
    point = [state.wheel_torque, state.amplitude, state.frequency]
    assert surface.supported(np.array([point]))[0]
    assert state.laboratory == (state.amplitude in LABORATORY)
    assert state.stiffness == pytest.approx(surface.predict(point))
    assert -1600 < state.preload < -300
    assert -15e-3 < state.deflection < 0.0


def test_a_bush_under_wheel_torque_is_stated_in_newtons(study, few_draws):
    (direction,) = [d for d in study.directions if d.name == "Du x"]
    state = machine_states(study, [direction], acceptance.Programme(), {"Du x": 1.0})["Du x"]
    true = load_bench().driveline.preload(state.wheel_torque)
    assert state.preload == pytest.approx(true, rel=0.01)
    mount = acceptance.ProgrammeMount(name="Du", force_per_wheel_torque=(2.0, 0.0, 0.0))
    stated = machine_states(
        study, [direction], acceptance.Programme(mounts=(mount,)), {"Du x": 1.0}
    )["Du x"]
    assert stated.preload == pytest.approx(2.0 * state.wheel_torque)


def test_weight_and_torque_act_together(study):
    (direction,) = [d for d in study.directions if d.name == "TSM z"]

    def state(**arguments):
        programme = acceptance.Programme(
            mounts=(acceptance.ProgrammeMount(name="TSM", **arguments),)
        )
        return machine_states(study, [direction], programme, {"TSM z": 1.0})["TSM z"]

    alone, weight = state(), (0.0, 0.0, -150.0)
    softer = machine_states(study, [direction], acceptance.Programme(), {"TSM z": 0.8})["TSM z"]
    assert (softer.preload, 0.8 * softer.deflection) == pytest.approx(
        (alone.preload, alone.deflection)
    )
    assert 0.0 < alone.other_axes < 0.03
    under = state(weight_force_n=weight, curve_zero="under weight")
    unloaded = state(weight_force_n=weight, curve_zero="unloaded")
    assert not alone.with_weight
    assert under.preload == pytest.approx(alone.preload - 150.0)
    assert under.deflection == alone.deflection
    assert unloaded.preload == under.preload
    assert unloaded.deflection < alone.deflection
    curve = direction.characterised.static_curve
    assert np.interp(unloaded.deflection, curve.deflection, curve.force) == pytest.approx(
        unloaded.preload, rel=0.01
    )


def test_a_frequency_that_was_not_measured_is_refused(study):
    (direction,) = [d for d in study.directions if d.name == "TSM x"]
    programme = acceptance.Programme.model_validate({"test": {"frequencies_hz": [300.0]}})
    with pytest.raises(InputError, match="at 300 Hz nothing was measured"):
        machine_states(study, [direction], programme, {"TSM x": 1.0})


def test_a_band_is_the_allocations_or_the_searchs_where_no_box_was_made(study, tolerance_run):
    allocated = sheet_of(study, files=sources.SheetFiles(tolerances=tolerance_run))
    searched = sheet_of(study)
    pick = study.wanted[study.space.names.index("TSM x")]
    place = [d.name for d in study.directions].index("TSM x")
    half = np.linspace(0.08, 0.30, 12)[place]
    assert allocated.bands["TSM x"] == pytest.approx((pick * (1 - half), pick * (1 + half)))
    assert searched.bands["TSM x"] == pytest.approx((0.85 * pick, 1.15 * pick))
    assert "tolerance allocation" in allocated.rests_on
    assert searched.rests_on == "tolerance of ± 15 % about the wanted design; no limit demands it"
    assert searched.specification.musts == {}


def test_without_a_box_the_sheet_says_how_parts_are_tested_and_that_nothing_is_judged(
    study, few_draws
):
    sheet = sheet_of(study)
    state, value, part = sheet.rules
    assert state.startswith("State: a row counts if its preload is within ± 5 %")
    assert "loss factor and static rate are reported" in value
    assert part.startswith("Part: no direction is a must, so no part fails by this sheet.")
    html, _ = documents(sheet, "")
    assert "Raise the preload, a force, from zero without overshoot" in html
    assert "How a delivery is judged" in html
    regions = re.findall(r'role="region" aria-label="([^"]*)"', html)
    assert len(regions) == len(set(regions)) > 3


def test_conditions_that_nobody_stated_are_to_be_agreed_and_stated_ones_are_shown(study, few_draws):
    sheet = sheet_of(study)
    due = {"ageing and relaxation", "fixture", "sampling", "first articles"}
    assert due | {"tolerance of the loss factor"} <= set(sheet.missing)
    test = acceptance.TestEntry(
        temperature_c=23.0,
        temperature_tolerance_c=2.0,
        loss_factor_tolerance=0.2,
        fixture="steel, above 50 kN/mm",
    )
    programme = sheet.agreed.model_copy(update={"test": test})
    stated = sheet_of(study, programme=programme)
    assert (stated.head["temperature"], stated.head["loss_tolerance"]) == ("23 ± 2", "± 20 %")
    assert stated.head["fixture"] == "steel, above 50 kN/mm"
    assert "reported and not judged: loss factor ± 20 %." in documents(stated, "")[0]


def test_the_test_point_lies_on_the_curve_of_the_new_part(sheet):
    panel = next(panel for panel in sheet.curves.panels if panel.title == "TSM x")
    (force,), (stiffness,) = panel.points["new"]
    at = np.interp(force, panel.abscissa, panel.curves["new"])
    assert stiffness == pytest.approx(at, rel=0.01)
    demand = next(d for d in sheet.specification.directions if d.name == "TSM x")
    assert panel.note == f"{demand.amplitude_mm:g} mm, {demand.frequency_hz:g} Hz"


def test_the_new_part_over_frequency_is_what_its_surface_says(sheet, study):
    table = sheet.over_frequency
    x = table[table["direction"] == "TSM x"].set_index(["amplitude_mm", "frequency_hz"])
    state, factor = sheet.states["TSM x"], 0.77
    surface = state.direction.characterised.surface
    assert sorted(set(x.index.get_level_values(1))) == [20.0, 30.0, 40.0, 50.0, 60.0]
    for (amplitude, frequency), row in x.iterrows():
        point = [[state.wheel_torque, 1e-3 * amplitude, frequency]]
        if not surface.supported(point)[0]:
            assert row.isna()[["lower", "nominal", "upper", "loss_factor"]].all()
            continue
        today = complex(surface.predict(point)[0])
        assert row["nominal"] == pytest.approx(factor * abs(today) * 1e-3)
        assert row["upper"] == pytest.approx(0.84 * abs(today) * 1e-3)
        assert row["loss_factor"] == pytest.approx(today.imag / today.real)
    assert len(set(x.index.get_level_values(0))) == 2
    assert x["nominal"].notna().sum() > len(x) / 2  # measured on the whole range by two amplitudes

    test = acceptance.TestEntry(frequencies_hz=(30.0, 45.0, 66.5), second_amplitude_mm=0.05)
    stated = sheet_of(study, programme=sheet.agreed.model_copy(update={"test": test}))
    asked = stated.over_frequency
    assert set(asked["frequency_hz"]) == {30.0, 45.0, 66.5}
    # beyond the band of the noise, and measured
    last = asked[(asked["direction"] == "TSM x") & (asked["frequency_hz"] == 66.5)]
    torque = stated.states["TSM x"].wheel_torque
    beyond = abs(surface.predict([[torque, 0.05e-3, 66.5]])[0]) * 1e-3
    new = stated.effects.middle[study.space.names.index("TSM x")]
    amplitude = last.loc[last["amplitude_mm"].round(6) == 0.05, "nominal"]
    assert amplitude.tolist() == pytest.approx([new * beyond])


def test_where_only_spectra_were_measured_no_stiffness_over_frequency_is_claimed(study):
    spectra = replace(study, runs=replace(study.runs, parts=()))
    assert sheet_of(spectra).over_frequency.empty


def test_a_german_sheet_names_the_part_in_german_and_decibels_can_be_left_out(study):
    mount = next(m for m in study.platform.mounts if m.name == "TSM")
    german = replace(
        sheet_of(study, language=Language.de),
        mount=replace(mount, description_de="Drehmomentstütze"),
    )
    assert german.description == "Drehmomentstütze"
    assert sheet_of(study).description == mount.description
    silent, workbook = documents(replace(german, decibels=False), "")
    assert "Drehmomentstütze" in silent
    assert "Nutzen im Innenraum" not in silent
    words = sources.workbook_text(workbook)
    assert "10 % steifer" not in words
    assert "alle Teile neu" not in words


def test_the_test_has_specification_and_guarded_limits(sheet, study, box_run):
    row = sheet.test.set_index("direction").loc["TSM x"]
    low, high = row["test_lower"], row["test_upper"]
    assert row["guarded_lower"] == pytest.approx(low / 0.98)
    assert row["guarded_upper"] == pytest.approx(high / 1.02)
    assert row["nominal_real"] ** 2 + row["nominal_imaginary"] ** 2 == pytest.approx(
        (0.5 * (low + high)) ** 2
    )
    part = {"name": "TSM", "conditioning_force_n": [-1500.0, 0.0, 0.0]}
    programme = acceptance.Programme.model_validate(
        {"test": {"uncertainty": 0.2}, "mounts": [part]}
    )
    unsure = sheet_of(study, files=sources.SheetFiles(box=box_run), programme=programme)
    assert unsure.test["decides"].tolist() == ["no: this test cannot decide"]
    conditioned = "conditioned up to x, y, z [N]"
    assert unsure.programme.set_index("field").loc[conditioned, "value"] == "−1500; 0; 0"
    assert conditioned in sheet.missing


def test_the_required_capability_leaves_the_stated_share_inside(sheet):
    needed = required_capability(0.95, 3)
    inside = norm.cdf(3 * needed) - norm.cdf(-3 * needed)
    assert inside**3 == pytest.approx(0.95)
    sample = np.random.default_rng(3).normal(1.0, 0.05, 20)
    half = 3.0 * measured_capability(needed, 20, 0.95) * sample.std(ddof=1)
    required = capability(sample, sample.mean() - half, sample.mean() + half)
    assert required.cpk_bound == pytest.approx(needed)
    n = proving_parts(0.8, 1.33, 0.95)
    assert measured_capability(0.8, n, 0.95) <= 1.33 < measured_capability(0.8, n - 1, 0.95)
    assert sheet.process["demanded_by"].tolist() == ["acoustics", "usual"]
    assert sheet.process["cpk"].tolist() == [required_capability(0.95, 2), 1.33]
    assert sheet.specification.cpk == 1.33


def numbers(text):
    return re.findall(r"(?<![\w.,])[−-]?\d+(?:[.,]\d+)?(?![\w])", text.replace("\u202f", ""))


@pytest.mark.parametrize("language", list(Language))
def test_every_number_of_the_page_stands_in_a_table_of_the_workbook(
    study, box_run, sharing_run, tmp_path, few_draws, language
):
    files = sources.SheetFiles(box=box_run, sharing=sharing_run)
    content = sheet_of(study, files=files, language=language)
    html, data = documents(content, "")
    path, page = tmp_path / "sheet.xlsx", tmp_path / "sheet.html"
    path.write_bytes(data)
    page.write_text(html, encoding="utf-8")
    hold(page, f"supplier_{language.value}")
    foot = supplier_page.provenance(study.run.entry, content, files)
    assert f"deboom report {study.run.entry.folder.name} --supplier" in foot
    assert f"--box {box_run.name} --sharing {sharing_run.name}" in foot
    everything = "\n".join([html, foot, sources.workbook_text(data)])
    assert str(tmp_path.parents[1]) not in everything
    assert str(STUDIES.parent) not in everything
    values, words = [], []
    tables = openpyxl.load_workbook(path).worksheets
    for table in tables:
        if table.title in ("curves", "Kennlinien"):
            continue  # so many points that any number is one of them
        for row in table.iter_rows(values_only=True):
            values += [v for v in row if isinstance(v, int | float)]
            words += [v for v in row if isinstance(v, str)]
    tabulated = {n.replace(",", ".") for n in numbers(" ".join(words))}
    tabulated |= {
        "14253",
        "10846",
        "1",
        "2",
        "3",
        "5",
        "95",
        "90",
        "10",
        "-1",
        "-2",
        "-5",
    }  # of standards
    shown = numbers(sources.page_text(html).partition("\n")[2])
    assert len(shown) > 80
    untraced = []
    for text in shown:
        plain = text.replace("−", "-").replace(",", ".")
        digits = len(plain.partition(".")[2])
        if plain not in tabulated and not any(
            abs(float(plain) - v) <= 0.5000001 * 10.0**-digits for v in values
        ):
            untraced.append(text)
    assert untraced == []


@pytest.fixture(scope="module")
def anonymous(front_run, box_run, tmp_path_factory, few_draws):
    out = tmp_path_factory.mktemp("supplier")
    result = report(front_run, "--mount", "TSM", "--anonymous", "--box", box_run, "--out", out)
    assert "to be agreed, not in programme.toml: conditioned" in result.stderr
    return tuple(Path(line) for line in result.stdout.splitlines()[-2:])


def test_an_anonymous_sheet_tells_no_name_no_limit_and_no_command(anonymous, front_run, study):
    page, workbook = anonymous
    hold(page, "supplier_anonymous", like="supplier_en")
    html = page.read_text(encoding="utf-8")
    fleet = study.platform.fleet.vehicles
    secrets = [
        *{vehicle.name for vehicle in fleet},
        *{vehicle.group for vehicle in fleet},
        "u06_f39_f45",
        "Compact platform,",
        "robust_front",
        str(front_run),
        str(STUDIES),
        "54.4",
        "deboom report",
        "EnM",
        "GeM",
        "three cylinders",
        study.run.entry.name,
        "dB(A)",
        "prescribed",
        "best design",
    ]
    read = "\n".join([html, sources.workbook_text(workbook.read_bytes()), page.name, workbook.name])
    read = re.sub(r"\b[0-9a-f]{12,}\b|base64,[\w+/=]*", "", read).lower()
    assert [secret for secret in secrets if secret.lower() in read] == []
    assert not re.search(r"(src|href)=\"(?!data:|#)", html)


def test_a_description_that_names_a_vehicle_is_refused_when_anonymous(sheet, study):
    secret = replace(sheet, secrets=sources.secrets_of(study), sources=NO_SOURCES)
    documents(secret, "")  # as it is, it tells nothing
    told = replace(sheet.mount, description="strut of U06-1")
    with pytest.raises(InputError, match="would show 'U06"):
        documents(replace(secret, mount=told), "")


def filled(path, out, stiffness, language="measured", **cells):
    """Fill in the table of a sheet: a stiffness per part [N/mm], and changed cells of its state."""
    book = openpyxl.load_workbook(path)
    table = book[language]
    header = [cell.value for cell in table[1]]
    state = [cell.value for cell in table[2]]
    table.delete_rows(2, table.max_row)
    for number, value in enumerate(stiffness, 1):
        row = dict(zip(header, state, strict=True))
        row |= {header[0]: f"P{number}", header[1]: "B1", "|K| [N/mm]": value} | cells
        table.append([row[name] for name in header])
    book.save(out)
    return out


def everything_stated(programme, name):
    """Return a programme in which nothing is to be agreed any more."""
    test = acceptance.TestEntry(
        temperature_c=23.0,
        temperature_tolerance_c=2.0,
        frequencies_hz=(29.0, 35.0, 45.0, 55.0),
        second_amplitude_mm=0.1,
        loss_factor_tolerance=0.2,
        static_rate_tolerance=0.15,
        ageing="168 h bei 80 °C, danach 24 h bei 23 °C",
        fixture="Stahl, steifer als 50 kN/mm je Richtung",
        sampling="fünf Teile je Charge, über alle Nester verteilt",
        first_articles="zwanzig Teile aus Serienwerkzeug",
        conditioning_cycles=3,
        uncertainty=0.02,
    )
    part = acceptance.ProgrammeMount(
        name=name,
        part_number=f"{name}-001-4711",
        drawing_number="D-1001-22",
        revision="A",
        state="released",
        parts_per_year=240000,
        weight_force_n=(0.0, 0.0, -150.0),
        conditioning_force_n=(-1500.0, 0.0, -400.0),
        curve_zero="under weight",
    )
    variant = acceptance.VariantEntry(
        name="three cylinders", mounts=(name,), vehicles_per_year=240000
    )
    changes = {"test": test, "mounts": (part,), "variants": (variant,)}
    return programme.model_copy(update=changes)


def test_a_sheet_is_two_pages_of_paper(study, box_run, sharing_run, few_draws, browser, tmp_path):
    """With and without box, anonymous and not, in both languages; counted by a browser."""
    of_box = sources.SheetFiles(box=box_run, sharing=sharing_run)
    secrets, pages = sources.secrets_of(study), {}
    for language, mount, files, hidden, stated in (
        (Language.en, "TSM", of_box, (), False),
        (Language.de, "TSM", of_box, (), True),
        (Language.de, "EnM", of_box, secrets, False),
        (Language.de, "GeM", supplier_page.NOTHING, (), True),
        (Language.en, "Du", supplier_page.NOTHING, secrets, False),
    ):
        content = replace(sheet_of(study, mount, files=files, language=language), secrets=hidden)
        if stated:
            programme = everything_stated(content.agreed, mount)
            content = replace(content, sources=replace(content.sources, programme=programme))
            assert content.missing == ()
        html, _ = documents(content, supplier_page.provenance(study.run.entry, content, files))
        page = tmp_path / f"{mount}_{language.value}.html"
        page.write_text(html, encoding="utf-8")
        browser.open(page)
        pages[page.stem] = browser.printed_pages()
        browser.resize(400)
        browser.wait("document.documentElement.clientWidth === 400")
        assert browser.value("document.documentElement.scrollWidth") == 400
    assert pages == dict.fromkeys(pages, 2)


def test_a_filled_in_sheet_comes_back_as_verdicts_on_two_pages(anonymous, box_run, tmp_path):
    _, workbook = anonymous
    line = openpyxl.load_workbook(workbook)["test"]
    head, row = ([cell.value for cell in line[k]] for k in (1, 2))
    row = dict(zip(head, row, strict=True))
    low, high = row["accepted |K| from [N/mm]"], row["accepted |K| to [N/mm]"]
    middle = 0.5 * (low + high)
    values = [*np.linspace(0.99, 1.01, 18) * middle, 1.005 * high, 1.1 * high]
    path = filled(workbook, tmp_path / "back.xlsx", values)
    platform = STUDIES / "data" / "u06_f39_f45"

    result = call("accept", box_run, path, "--platform", platform, "--out", tmp_path)
    run = Path(result.stdout.strip().splitlines()[-1])
    summary = json.loads((run / "summary.json").read_text())
    counts = [summary[f"n_{what}"] for what in ("passed", "undecided", "failed")]
    assert counts == [18, 1, 1]
    assert len(pd.read_csv(run / "levels.csv")) == 5
    supplier = sources.page_text((run / "supplier.html").read_text(encoding="utf-8"))
    sent = acceptance.read_specification(workbook)
    told = ("P20", "TSM-001", "D-1001", "State of the test", sent.checksum[:12], sent.issued)
    told += ("Cpk asked for 1", "1.33", "missed")
    assert [words for words in told if words not in supplier] == []
    assert "1 of 20 parts are outside" in supplier
    assert "Corner of the box" in supplier
    assert "U06" not in supplier
    assert "dB" not in supplier
    # the supplier judges with the sheet alone, by K' and K''
    angle = 0.1
    parts = {"|K| [N/mm]": None, "K' [N/mm]": middle * np.cos(angle)}
    parts |= {"K'' [N/mm]": middle * np.sin(angle)}
    path = filled(workbook, tmp_path / "own.xlsx", [0.0, 0.0], **parts)
    refused(("accept", workbook, path, "--out", tmp_path), "all 2 pieces have the value")


def test_a_german_sheet_comes_back_with_ratios_to_todays_part(study, box_run, few_draws, tmp_path):
    content = sheet_of(study, files=sources.SheetFiles(box=box_run), language=Language.de)
    path = tmp_path / "blatt.xlsx"
    path.write_bytes(documents(content, "")[1])
    today = content.specification.musts["x"].today_n_per_mm
    values = today * 1.04 * np.array([1.0, 0.76, 0.77, 0.78])
    back = filled(path, tmp_path / "zurueck.xlsx", values, "gemessen")
    book = openpyxl.load_workbook(back)
    table = book["gemessen"]
    table.cell(5, table.max_column - 3).value = 2.0 * today
    for row, name in enumerate(("heute", "T1", "T2", "T3"), 2):
        table.cell(row, 1, name)
        table.cell(row, 2, "C1")
    book.save(back)
    first, *_ = acceptance.read_measured_sheet(back, content.specification)
    assert first.stiffness["x"] == pytest.approx(0.76e3 * today)
    result = call("accept", path, back, "--out", tmp_path)
    run = Path(result.stdout.strip().splitlines()[-1])
    page = (run / "supplier.html").read_text(encoding="utf-8")
    read = sources.page_text(page)
    assert all(word in read for word in ("bestanden", "Cpk mindestens", "Charge", "Lager TSM"))
    assert re.search(r"x außerhalb: [\d,]+ N/mm, gefordert [\d,]+ bis [\d,]+ N/mm", read)
    english = ("outside", "asked", "pass", "fail", "batch", "mount", "parts", "of today", "mean")
    assert [word for word in english if re.search(rf"\b{word}\b", read)] == []


@pytest.mark.parametrize(
    ("cells", "sentence"),
    [
        ({"preload [N]": -600}, "was measured at -600 N preload, the sheet asks for"),
        ({"amplitude [mm]": 2.0}, "was measured at 2 mm amplitude, the sheet asks for"),
        ({"frequency [Hz]": 41}, "was measured at 41 Hz frequency, the sheet asks for"),
        ({"direction": "TSM w"}, "the sheet has no direction 'TSM w'"),
        ({"|K| [N/mm]": None}, "give |K| or both K' and K''"),
        ({"K' [N/mm]": 100.0, "K'' [N/mm]": 1.0}, "correct the wrong one"),
        ({"|K| [N/mm]": -5.0}, "a stiffness is above 0"),
        ({"part number": "TSM-002"}, "its part number is 'TSM-002', the sheet is of TSM-001"),
    ],
)
def test_a_delivery_at_another_state_is_one_sentence(anonymous, box_run, tmp_path, cells, sentence):
    path = filled(anonymous[1], tmp_path / "back.xlsx", [300.0, 301.0], **cells)
    refused(("accept", box_run, path, "--out", tmp_path), sentence)


def test_missing_units_and_edited_sheets_are_refused(anonymous, box_run, tmp_path):
    path = filled(anonymous[1], tmp_path / "back.xlsx", [300.0, 301.0])
    book = openpyxl.load_workbook(path)
    place = [cell.value for cell in book["measured"][1]].index("preload [N]")
    book["measured"].cell(1, place + 1).value = "preload"
    book.save(tmp_path / "unit.xlsx")
    refused(("accept", box_run, tmp_path / "unit.xlsx", "--out", tmp_path), "has no unit")
    book = openpyxl.load_workbook(path)
    cell = book["deboom"]["B2"]
    cell.value = cell.value.replace('"upper": 0.84', '"upper": 0.99')
    book.save(tmp_path / "edited.xlsx")
    edited = tmp_path / "edited.xlsx"
    refused(("accept", box_run, edited, "--out", tmp_path), "its specification has been edited")


def test_a_sheet_of_another_box_is_refused(anonymous, box_run, tmp_path):
    box = acceptance.read_solution_box(box_run)
    acceptance.write_solution_box(tmp_path / "box.json", box.model_copy(update={"seed": 2}))
    path = filled(anonymous[1], tmp_path / "back.xlsx", [300.0, 301.0])
    refused(("accept", tmp_path / "box.json", path, "--out", tmp_path), "was made with the box")


def test_a_sheet_of_another_version_is_refused(anonymous, tmp_path):
    path = filled(anonymous[1], tmp_path / "back.xlsx", [300.0, 301.0])
    book = openpyxl.load_workbook(path)
    cell = book["deboom"]["B2"]
    cell.value = cell.value.replace('"version": 2', '"version": 1')
    book.save(path)
    with pytest.raises(InputError, match="sheet of version 1, this deboom reads version 2: issue"):
        acceptance.read_specification(path)


def test_an_edited_box_of_a_finished_run_is_refused(anonymous, box_run, tmp_path):
    copy = tmp_path / "solution_box" / "copy"
    shutil.copytree(box_run, copy)
    box = copy / "acceptance_box.json"
    box.write_text(box.read_text().replace('"upper": 0.84', '"upper": 1.3'))
    path = filled(anonymous[1], tmp_path / "back.xlsx", [300.0, 301.0])
    for edited in (copy, box):
        refused(("accept", edited, path, "--out", tmp_path), "has been edited")
    alone = tmp_path / "alone.json"
    shutil.copy(box, alone)
    refused(("accept", alone, path, "--out", tmp_path), "checksum is not that of its entries")


@pytest.mark.slow("issues a third sheet and draws its uncertainty")
def test_an_older_sheet_marks_what_moved(
    front_run, box_run, anonymous, results, tmp_path, few_draws
):
    other = acceptance.read_solution_box(box_run)
    moved = tuple(
        v.model_copy(update={"upper": 0.80}) if v.name == "TSM x" else v for v in other.variables
    )
    path = tmp_path / "box.json"
    acceptance.write_solution_box(path, other.model_copy(update={"variables": moved}))
    words = ("--mount", "TSM", "--box", path, "--since", anonymous[1], "--out", tmp_path)
    report(front_run, *words)
    html = (tmp_path / "supplier_sheet_TSM.html").read_text(encoding="utf-8")
    # nominal and upper end as share and in N/mm, ±, preload in mm, static rate
    assert html.count(' moved"') == 7
    assert "moves the other side: TSM x forward, TSM z down;" in html
    changes = openpyxl.load_workbook(tmp_path / "supplier_sheet_TSM.xlsx")["changes"]
    fields = [row[1] for row in changes.iter_rows(values_only=True, min_row=2)]
    assert "accepted to [N/mm]" in fields
    assert "accepted from [N/mm]" not in fields
    issued = (tmp_path / "supplier_sheet_TSM.xlsx").read_bytes()
    again = report(front_run, "--mount", "TSM", "--out", tmp_path, code=2)
    assert "a sheet that was issued is not overwritten" in again.stderr
    assert (tmp_path / "supplier_sheet_TSM.xlsx").read_bytes() == issued


def test_an_older_sheet_of_another_mount_or_of_none_is_refused(front_run, anonymous, tmp_path):
    wrong = report(front_run, "--mount", "Du", "--since", anonymous[1], "--out", tmp_path, code=2)
    assert "that sheet is of mount TSM" in wrong.stderr
    assert "say --mount" in report(front_run, "--since", anonymous[1], code=2).stderr
    unknown = report(front_run, "--mount", "TMS", "--out", tmp_path / "out", code=2)
    assert "no mount 'TMS': use EnM, GeM, TSM, Du" in unknown.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("format = 1\nvolume = 3\n", "unknown key 'volume'"),
        ('format = 1\n[[mounts]]\nname = "TMS"\n', "there is no mount 'TMS' on this platform"),
        (
            'format = 1\n[[mounts]]\nname = "A"\n[[mounts]]\nname = "A"\n',
            "[[mounts]] are named 'A'",
        ),
        (
            'format = 1\n[[mounts]]\nname = "A"\nstate = "released"\nrevision = "B"\n',
            "the mount 'A' is released without part_number, drawing_number: state them",
        ),
        ("format = 1\n[test]\nuncertainty = 2.0\n", "key 'uncertainty' in [test] is 2.0"),
    ],
)
def test_a_programme_with_unknown_fields_is_one_sentence(tmp_path, text, sentence):
    (tmp_path / "programme.toml").write_text(text)
    with pytest.raises(InputError, match=re.escape(sentence)):
        acceptance.read_programme(tmp_path, ("A", "B"))
    (tmp_path / "programme.toml").unlink()
    assert acceptance.read_programme(tmp_path, ("A",)) == acceptance.Programme()


def test_pieces_of_something_else_are_refused(study, box_run, tolerance_run, front_run, tmp_path):
    def refused(sentence, wanted=study, **files):
        with pytest.raises(InputError, match=sentence):
            sources.sheet_sources(wanted, sources.SheetFiles(**files))

    box, path = acceptance.read_solution_box(box_run), tmp_path / "box.json"
    acceptance.write_solution_box(path, box.model_copy(update={"platform_sha256": "0" * 64}))
    refused("found with other files", box=path)
    other = tuple(acceptance.BoxResponse(name=n, limit=54.0, share=1.0) for n in ("F39-1", "F39-2"))
    acceptance.write_solution_box(path, box.model_copy(update={"responses": other}))
    refused("its vehicles are F39-1, F39-2", box=path)
    refused("holds no acceptance_box.json", box=front_run)
    refused("has no allocation.csv", tolerances=front_run)
    refused("has no part_numbers.csv", sharing=tolerance_run)
    refused("another design: run", replace(study, pick=Pick.best_sigma), tolerances=tolerance_run)
    foreign = pd.DataFrame({"direction": [], "part number": []})
    copy = run_folder(tmp_path / "commonality" / "x", {"a": "0"}, {"part_numbers.csv": foreign})
    refused("other files of the platform", sharing=copy)
    (copy / "part_numbers.csv").write_text("nothing")
    refused("has been edited", sharing=copy)
