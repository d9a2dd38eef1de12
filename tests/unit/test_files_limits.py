"""Limits of a component and of a platform: SI inside, strict keys in the reader."""

from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.descent import Gradients, converged_front, gradients_of
from deboom.explore.robust import Robust
from deboom.explore.search import Search, nsga2
from deboom.explore.space import stiffness_factor_space
from deboom.files import design_limits
from deboom.files.design_limits import (
    LimitEntry,
    files_of_limits,
    load_limits,
    read_level_limits,
    read_mount_limits,
)
from deboom.files.limits import read_component_limits
from samples.known_truth import WithSlopes, quad2

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
SHIPPED = Path(__file__).parents[2] / "studies" / "data" / "u06_limits.toml"
SAG = '[[sag]]\nmount = "EnM"\nat_most_mm = 6.0\n'


def written(folder, text):
    path = folder / "limits.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_units_become_si(tmp_path):
    limits = read_component_limits(written(tmp_path, WHOLE))
    assert limits.risk == 0.025
    default = WHOLE.replace("risk_percent = 2.5", "")
    assert read_component_limits(written(tmp_path, default)).risk == 0.05
    assert limits.static_unbalance.at_most == pytest.approx(25e-6)
    assert limits.dynamic_unbalance.at_most == pytest.approx(1.5e-6)
    axial, turning = limits.stiffness
    assert (axial.bounds.at_least, axial.bounds.at_most) == pytest.approx((2e4, 3e4))
    assert axial.name == "dynamic stiffness x, 10–30 Hz"
    assert (axial.lines[0], axial.lines[-1], axial.lines.size) == pytest.approx((10.0, 30.0, 9))
    assert turning.bounds.at_most == 150.0
    assert turning.lines.tolist() == pytest.approx([20.0])


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('direction = "x"', 'direction = "rx"', "'direction' in ..stiffness.. 1"),
        ("from_hz = 10.0", "from_hz = 40.0", "from_hz is above to_hz"),
        ("at_least_n_per_mm = 20.0", "at_least_n_per_mm = 40.0", "no part keeps both"),
        ("at_most_n_m_per_rad = 150.0", "", "stiffness rz: a limit needs a bound"),
        ("risk_percent = 2.5", "risk_percent = 50.0", "less than 50"),
        (WHOLE, "format = 1\n", "there is no limit in it"),
    ],
)
def test_a_wrong_key_is_named(tmp_path, old, new, sentence):
    path = written(tmp_path, WHOLE.replace(old, new, 1))
    with pytest.raises(InputError, match=sentence):
        read_component_limits(path)


def test_the_shipped_example_has_every_kind_of_limit():
    content = load_limits(SHIPPED)
    assert content.kept_by == "design"
    assert content.sag[0].mount == "EnM"
    assert (content.travel[0].at_least_mm, content.travel[0].at_most_mm) == (-10.5, 10.5)
    assert content.natural_frequency[0].at_least_hz is None
    assert content.stiffness[0].variable == "GeM z"


def test_every_part_may_have_to_keep_them(tmp_path):
    assert (
        load_limits(written(tmp_path, f'format = 1\nkept_by = "every part"\n{SAG}')).kept_by
        == "every part"
    )


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("format = 1\n", "there is no limit in it"),
        (f'format = 1\nkept_by = "all"\n{SAG}', "'design' or 'every part'"),
        ("format = 1\n" + SAG.replace("sag", "sagg"), "did you mean 'sag'"),
        ('format = 1\n[[stiffness]]\nvariable = "z"\n', "give a bound"),
        (
            "format = 1\n[[natural_frequency]]\nmode = 7\nat_most_hz = 9.0\n",
            "less than or equal to 6",
        ),
        (
            "format = 1\n[[natural_frequency]]\nmode = 1\nat_least_hz = 9.0\nat_most_hz = 8.0\n",
            "at_least is above at_most",
        ),
    ],
)
def test_a_mistake_is_named(tmp_path, text, sentence):
    with pytest.raises(InputError, match=sentence):
        load_limits(written(tmp_path, text))


def test_limits_of_levels_name_the_file_where_a_vehicle_is_missing(tmp_path):
    model = SimpleNamespace(response_names=("sedan", "tourer"), response_unit="dB(A)", n_lines=41)
    path = written(
        tmp_path,
        "format = 1\n[[level]]\nat_most_db = 52.5\nvehicle = 'tourer'\n"
        "[[level]]\nstatistic = 'tail'\nat_most_db = 'today'\n",
    )
    assert not load_limits(path).of_mounts
    limits = read_level_limits(path, model)
    assert [limit.number.response for limit in limits] == ["tourer", "sedan", "tourer"]
    assert [limit.at_most for limit in limits] == [52.5 * 41, "today", "today"]
    assert read_level_limits(None, model) == ()
    assert read_level_limits(written(tmp_path, f"format = 1\n{SAG}"), model) == ()
    path = written(tmp_path, "format = 1\n[[level]]\nat_most_db = 1.0\nvehicle = 'van'\n")
    with pytest.raises(
        InputError, match=r"limits\.toml: \[\[level\]\] 1: there is no vehicle 'van'"
    ):
        read_level_limits(path, model)
    path = written(tmp_path, "format = 1\n[[level]]\nat_most_db = 'now'\n")
    with pytest.raises(InputError, match=r"'at_most_db' in \[\[level\]\] 1 is \"now\""):
        read_level_limits(path, model)


MODEL = WithSlopes(quad2(4, seed=1))
SPACE = stiffness_factor_space(MODEL.variable_names)
ROBUST = Robust(MODEL, SPACE, draws=16)
PLATFORM = SimpleNamespace(library_file=Path("library.sqlite"))
RUNS = SimpleNamespace(variables=MODEL.variable_names, platform=PLATFORM)


@dataclass(frozen=True)
class Ratio:
    """How stiff one variable is over another one."""

    of: str
    over: str
    unit: str = "%"

    @property
    def names(self):
        """Return the one name."""
        return (f"{self.of} over {self.over}",)

    def __call__(self, factors):
        """Return the ratio, shape (n, 1)."""
        return 100 * (factors[self.of] / factors[self.over])[:, np.newaxis]

    def slopes(self, factors):
        """Return the derivatives by variable."""
        ratio = self(factors)
        return {
            self.of: ratio / factors[self.of][:, np.newaxis],
            self.over: -ratio / factors[self.over][:, np.newaxis],
        }


@pytest.fixture
def ratio_kind(monkeypatch):
    """Add a kind of limit as a module would: one class, and nothing else."""
    monkeypatch.setattr(design_limits, "LIMIT_KINDS", dict(design_limits.LIMIT_KINDS))

    @design_limits.limit_kind("ratio")
    class RatioEntry(LimitEntry):
        variable: str
        over: str
        at_least_percent: float | None = None
        at_most_percent: float | None = None

        def quantity(self, mounts):
            """Return the ratio, or refuse a variable that there is not."""
            for name in (self.variable, self.over):
                if name not in mounts.runs.variables:
                    raise InputError(f"there is no variable '{name}'")
            return Ratio(self.variable, self.over)


@pytest.mark.usefixtures("ratio_kind")
def test_a_new_kind_of_limit_is_one_class(tmp_path):
    first, second = MODEL.variable_names[:2]
    stated = f"format = 1\n[[ratio]]\nvariable = '{first}'\nover = '{second}'\n"
    path = written(tmp_path, f"{stated}at_least_percent = 105\nat_most_percent = 120\n")
    with pytest.raises(InputError, match=r"\[\[ratio\]\] 1: there is no variable 'z'"):
        read_mount_limits(written(tmp_path, path.read_text().replace(first, "z")), RUNS, SPACE)
    with pytest.raises(InputError, match=r"\[\[ratio\]\] 1: give a bound"):
        load_limits(written(tmp_path, stated))
    with pytest.raises(InputError, match=r"add \[\[sag\]\], .*\[\[ratio\]\] or \[\[level\]\]"):
        load_limits(written(tmp_path, "format = 1\n"))
    path = written(tmp_path, f"{stated}at_least_percent = 105\nat_most_percent = 120\n")
    limits = read_mount_limits(path, RUNS, SPACE)
    assert files_of_limits(path, RUNS) == (path,)
    robust = replace(ROBUST, limits=limits)
    assert robust.limits.names == (
        f"{first} over {second} at least 105 %",
        f"{first} over {second} at most 120 %",
    )
    searched = nsga2(robust, Search(20, 6, seed=1))
    assert searched.infeasible.any()
    assert gradients_of(robust) is Gradients.exact
    descended = converged_front(robust, seed=1, begin=searched.front.designs)
    for designs in (searched.front.designs, descended.designs):
        ratio = designs[:, 0] / designs[:, 1]
        assert ratio.min() > 1.05 - 1e-9
        assert ratio.max() < 1.2 + 1e-9
    assert descended.objectives[:, 0].min() <= searched.front.objectives[:, 0].min()
    design, step = np.array([[1.1, 0.9, 1.0, 1.05]]), 1e-6
    rows = design + step * np.vstack([np.eye(4), -np.eye(4)])
    requirements = limits[0].number.response
    ahead, behind = np.split(requirements(rows)[:, 0], 2)
    gradient = requirements.gradient(design)[0, 0]
    np.testing.assert_allclose(gradient, (ahead - behind) / (2 * step), rtol=1e-7, atol=1e-7)
