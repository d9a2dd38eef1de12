"""The file of an acceptance box: what is written comes back, and nothing else is read."""

import json
import re

import pytest
from acceptance_samples import acceptance_box, variable

from deboom.errors import InputError
from deboom.files import acceptance

BOX = acceptance_box(
    (
        variable("EnM x", 0.81, 1.125, reference_stiffness_n_per_m=323451.7),
        variable("Du y", 0.5, 1.2, weight=2.0, required=False),
    ),
    (
        acceptance.BoxResponse(name="U06-1", limit=54.25, share=0.97),
        acceptance.BoxResponse(name="U06-2", limit=54.25, share=0.932),
    ),
    share_measured_again=(0.91, 0.99),
)


@pytest.fixture
def path(tmp_path):
    file = tmp_path / "box.json"
    acceptance.write_solution_box(file, BOX)
    return file


def test_a_box_comes_back(path):
    assert acceptance.read_solution_box(path) == BOX
    first, second = BOX.variables
    assert (first.set_by_limit, second.set_by_limit) == ("from and to", "to")
    assert BOX.variable("Du y") is second
    with pytest.raises(InputError, match="no variable 'Du z'"):
        BOX.variable("Du z")


def test_units_stand_in_the_keys(path):
    document = json.loads(path.read_text(encoding="utf-8"))
    assert document["band_hz"] == [20.0, 60.0]
    assert document["variables"][0]["reference_stiffness_n_per_m"] == 323451.7
    assert (document["format"], document["version"]) == ("deboom acceptance box", 2)


def changed(path, change):
    """Change a box and its checksum, as somebody would who knows how."""
    document = json.loads(path.read_text(encoding="utf-8"))
    change(document)
    entries = {k: v for k, v in document.items() if k not in ("format", "version", "sha256")}
    document["sha256"] = acceptance.checksum(entries)
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
def test_a_spoilt_file_is_refused_by_name(path, change, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)) as caught:
        acceptance.read_solution_box(changed(path, change))
    assert str(path) in str(caught.value)


def test_a_missing_or_broken_file_is_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        acceptance.read_solution_box(tmp_path / "none.json")
    broken = tmp_path / "broken.json"
    broken.write_text("{", encoding="utf-8")
    with pytest.raises(InputError, match="not JSON"):
        acceptance.read_solution_box(broken)
