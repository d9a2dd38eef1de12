"""The file of an acceptance box: what is written comes back, and nothing else is read."""

import json
from dataclasses import replace

import pytest

from deboom.errors import InputError
from deboom.files.acceptance import (
    AcceptanceBox,
    BoxResponse,
    BoxVariable,
    read_solution_box,
    write_solution_box,
)

BOX = AcceptanceBox(
    title="Compact platform: acceptance box",
    platform="u06",
    platform_sha256="0" * 64,
    group="U06",
    motion="prescribed",
    mounts="library-inside",
    load_cases=(("g5_wot220", 1.0), ("g3_wot220", 0.5)),
    band=(20.0, 60.0),
    quantity="mean level of the lines",
    unit="dB(A)",
    together=False,
    variables=(
        BoxVariable("EnM x", 0.81, 1.125, 0.9, 323451.7, "mean over 20 to 60 Hz", 1.0, True),
        BoxVariable("Du y", 0.68, 1.38, 1.0, None, "not measured", 2.0, False),
    ),
    responses=(BoxResponse("U06-1", 54.25, 0.97), BoxResponse("U06-2", 54.25, 0.932)),
    share_stated=0.95,
    share_verified=0.951,
    share_bound=0.9502,
    confidence=0.95,
    n_parts=131072,
    law="uniform in the box",
    seed=1,
)


@pytest.fixture
def path(tmp_path):
    file = tmp_path / "box.json"
    write_solution_box(file, BOX)
    return file


def test_a_box_comes_back(path):
    assert read_solution_box(path) == BOX
    first, second = BOX.variables
    assert first.upper_stiffness == pytest.approx(363883.2, abs=0.1)
    assert first.lower_stiffness == pytest.approx(0.81 * 323451.7)
    assert second.lower_stiffness is None
    assert second.upper_stiffness is None
    assert BOX.variable("Du y") is second
    with pytest.raises(InputError, match="no variable 'Du z'"):
        BOX.variable("Du z")


def test_units_stand_in_the_keys(path):
    document = json.loads(path.read_text(encoding="utf-8"))
    assert document["band_hz"] == [20.0, 60.0]
    assert document["variables"][0]["reference_stiffness_n_per_m"] == 323451.7
    assert (document["format"], document["version"]) == ("deboom acceptance box", 1)


def changed(path, change):
    document = json.loads(path.read_text(encoding="utf-8"))
    change(document)
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda d: d.update(format="other"), "no acceptance box"),
        (lambda d: d.update(version=2), "version 2"),
        (lambda d: d.pop("seed"), "lacks the entry 'seed'"),
        (lambda d: d.update(colour="red"), "unknown 'colour'"),
        (lambda d: d.update(seed=True), "no whole number"),
        (lambda d: d.update(together=1), "neither true nor false"),
        (lambda d: d.update(title=3), "no text"),
        (lambda d: d.update(share_bound="0.95"), "no finite number"),
        (lambda d: d.update(share_bound=1.2), "from 0 to 1"),
        (lambda d: d.update(variables=[]), "at least one entry"),
        (lambda d: d.update(responses={}), "no list"),
        (lambda d: d.update(band_hz=[20.0]), "two edges"),
        (lambda d: d.update(load_cases=[{"name": "a"}]), "name and weight"),
        (lambda d: d.update(variables=["EnM x"]), "variable 1 is no object"),
        (lambda d: d["variables"][0].update(upper=0.5), "interval 0.81 to 0.5"),
        (lambda d: d["variables"][0].pop("condition"), "variable 1 lacks the entry 'condition'"),
        (lambda d: d["variables"][1].update(name="EnM x"), "'EnM x' appears 2 times"),
        (
            lambda d: d["variables"][0].update(reference_stiffness_n_per_m=-1.0),
            "not above 0",
        ),
    ],
)
def test_a_spoilt_file_is_refused_by_name(path, change, sentence):
    with pytest.raises(InputError, match=sentence) as caught:
        read_solution_box(changed(path, change))
    assert str(path) in str(caught.value)


def test_a_missing_or_broken_file_is_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_solution_box(tmp_path / "none.json")
    broken = tmp_path / "broken.json"
    broken.write_text("{", encoding="utf-8")
    with pytest.raises(InputError, match="not JSON"):
        read_solution_box(broken)
    with pytest.raises(InputError, match="at least one response"):
        replace(BOX, responses=())
