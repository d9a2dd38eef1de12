"""The file of limits: strict keys with units, one sentence for what is wrong."""

from pathlib import Path

import pytest

from deboom.errors import InputError
from deboom.files.limits import load_limits

SHIPPED = Path(__file__).parents[2] / "studies" / "data" / "u06_limits.toml"
SAG = '[[sag]]\nmount = "EnM"\nat_most_mm = 6.0\n'


def load(tmp_path, text):
    path = tmp_path / "limits.toml"
    path.write_text(text, encoding="utf-8")
    return load_limits(path)


def test_the_shipped_example_has_every_kind_of_limit():
    content = load_limits(SHIPPED)
    assert content.kept_by == "design"
    assert content.sag[0].mount == "EnM"
    assert (content.travel[0].at_least_mm, content.travel[0].at_most_mm) == (-10.5, 10.5)
    assert content.natural_frequency[0].at_least_hz is None
    assert content.stiffness[0].variable == "GeM z"


def test_every_part_may_have_to_keep_them(tmp_path):
    assert load(tmp_path, f'format = 1\nkept_by = "every part"\n{SAG}').kept_by == "every part"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("format = 1\n", "there is no limit in it"),
        (f"format = 2\n{SAG}", "key 'format'"),
        (f'format = 1\nkept_by = "all"\n{SAG}', "'design' or 'every part'"),
        ("format = 1\n" + SAG.replace("sag", "sagg"), "did you mean 'sag'"),
        ("format = 1\n" + SAG.replace("at_most_mm", "at_most"), "did you mean 'at_most_mm'"),
        ("format = 1\n" + SAG.replace("6.0", "-6.0"), "greater than 0"),
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
        load(tmp_path, text)
