import pytest

from deboom.errors import InputError
from deboom.files.tables import parse_unit


@pytest.mark.parametrize(
    ("label", "si", "factor"),
    [
        ("mm", "m", 1e-3),
        ("µm", "m", 1e-6),
        ("μm", "m", 1e-6),
        ("kN", "N", 1e3),
        ("m/s²", "m/s^2", 1.0),
        ("m/s2", "m/s^2", 1.0),
        ("g", "m/s^2", 9.80665),
        ("N·m", "N m", 1.0),
        ("Pa/N", "Pa/N", 1.0),
        ("Pa/kN", "Pa/N", 1e-3),
        ("mm/N", "m/N", 1e-3),
        ("N/mm", "N/m", 1e3),
    ],
)
def test_labels_of_files_reach_si(label, si, factor):
    unit = parse_unit(label)
    assert (unit.label, unit.si) == (label, si)
    assert unit.factor == pytest.approx(factor, rel=1e-15)


@pytest.mark.parametrize("label", ["furlong", "Pa/furlong", "M", "n"])
def test_an_unknown_label_is_refused_by_name(label):
    with pytest.raises(InputError, match=f"unknown unit '{label}'"):
        parse_unit(label)


def test_a_missing_unit_is_not_guessed():
    with pytest.raises(InputError, match="a unit is missing"):
        parse_unit("  ")
