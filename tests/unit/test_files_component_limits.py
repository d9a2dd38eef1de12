"""Limits of a component: SI inside, strict keys at the door."""

from pathlib import Path

import pytest

from deboom.errors import InputError
from deboom.files.limits import read_component_limits

WHOLE = """
format = 1
risk_percent = 2.5

[static_unbalance]
at_most_g_mm = 25.0

[dynamic_unbalance]
at_most_g_mm2 = 1500.0

[[stiffness]]
direction = "x"
from_hz = 10.0
to_hz = 30.0
at_least_n_per_mm = 20.0
at_most_n_per_mm = 30.0

[[rotational_stiffness]]
direction = "rz"
from_hz = 20.0
to_hz = 20.0
at_most_n_m_per_rad = 150.0
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "limits.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_units_become_si(tmp_path):
    limits = read_component_limits(written(tmp_path, WHOLE))
    assert limits.risk == 0.025
    assert limits.static_unbalance.at_most == pytest.approx(25e-6)
    assert limits.dynamic_unbalance.at_most == pytest.approx(1.5e-6)
    axial, turning = limits.stiffness
    assert (axial.bounds.at_least, axial.bounds.at_most) == pytest.approx((2e4, 3e4))
    assert axial.name == "dynamic stiffness x, 10–30 Hz"
    assert (axial.lines[0], axial.lines[-1], axial.lines.size) == pytest.approx((10.0, 30.0, 9))
    assert turning.bounds.at_most == 150.0
    assert turning.lines.tolist() == pytest.approx([20.0])


def test_the_risk_has_a_default(tmp_path):
    text = "format = 1\n[static_unbalance]\nat_most_g_mm = 1.0\n"
    assert read_component_limits(written(tmp_path, text)).risk == 0.05


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("at_most_g_mm =", "at_most_gmm =", "unknown key 'at_most_gmm' in .static_unbalance."),
        ("at_most_g_mm = 25.0", "at_most_g_mm = -1.0", "greater than 0"),
        ('direction = "x"', 'direction = "rx"', "'direction' in ..stiffness.. 1"),
        ("from_hz = 10.0", "from_hz = 40.0", "from_hz is above to_hz"),
        ("at_least_n_per_mm = 20.0", "at_least_n_per_mm = 40.0", "no part keeps both"),
        ("at_most_n_m_per_rad = 150.0", "", "stiffness rz: a limit needs a bound"),
        ("risk_percent = 2.5", "risk_percent = 50.0", "less than 50"),
        ("format = 1", "format = 2", "'format'"),
    ],
)
def test_a_wrong_key_is_named(tmp_path, old, new, sentence):
    path = written(tmp_path, WHOLE.replace(old, new, 1))
    with pytest.raises(InputError, match=sentence):
        read_component_limits(path)


def test_an_empty_file_is_no_limit(tmp_path):
    with pytest.raises(InputError, match="there is no limit in it"):
        read_component_limits(written(tmp_path, "format = 1\n"))
