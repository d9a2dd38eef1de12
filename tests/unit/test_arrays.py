"""Checked dataclasses: shapes, finiteness, copies that are read-only."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from deboom.arrays import ComplexArray, RealArray, checked, checked_array, derivatives
from deboom.errors import InputError
from deboom.files.platform import read_platform


@checked(frequency="f", values="f n 3", weights="n")
class _Curves:
    name: str
    channels: tuple[str, ...]
    frequency: RealArray
    values: ComplexArray
    weights: RealArray | None = None

    def __post_init__(self) -> None:
        if len(self.channels) != self.values.shape[1]:
            raise InputError(f"{self.name}: one channel per column")


def _curves(**changes: object) -> _Curves:
    fields = {
        "name": "engine",
        "channels": ["a", "b"],
        "frequency": np.arange(4.0),
        "values": np.ones((4, 2, 3)),
        "weights": [1.0, 2.0],
    }
    return _Curves(**(fields | changes))


def test_arrays_are_read_only_copies_of_their_type() -> None:
    frequency = np.arange(4.0)
    curves = _curves(frequency=frequency)
    frequency[0] = 9.0
    assert curves.frequency[0] == 0.0
    assert curves.values.dtype == complex
    assert curves.channels == ("a", "b")
    with pytest.raises(ValueError, match="read-only"):
        curves.frequency[0] = 1.0


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"frequency": np.arange(3.0)}, r"engine: values: shape \(3, 2, 3\) is needed"),
        ({"values": np.ones((4, 2, 2))}, r"engine: values: shape \(4, 2, 3\) is needed"),
        ({"values": np.ones((4, 2))}, "engine: values: shape"),
        ({"frequency": [0.0, 1.0, 2.0, np.nan]}, "engine: frequency: a number is not finite"),
        ({"weights": [1.0]}, r"engine: weights: shape \(2\) is needed"),
        ({"channels": ["a"]}, "engine: one channel per column"),
    ],
)
def test_wrong_arrays_are_refused_by_name(changes: dict[str, object], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        _curves(**changes)


def test_an_absent_array_is_no_error() -> None:
    assert _curves(weights=None).weights is None


def test_leading_axes_and_gaps_are_allowed_where_said() -> None:
    assert checked_array(np.zeros((5, 4, 3)), "... 3", "motion").shape == (5, 4, 3)
    assert np.isnan(checked_array([np.nan], "n ?", "level")[0])
    with pytest.raises(InputError, match="motion: shape"):
        checked_array(np.zeros((5, 4)), "... 3", "motion")


def test_derivatives_are_exact_up_to_fourth_powers() -> None:
    point = np.array([0.7, -2.0])
    slopes = derivatives(lambda x: (x[:, :1] ** 4 + x[:, 1:] ** 3) * [1.0, 2j], point, [0.1, 0.3])
    expected = np.outer([4 * 0.7**3, 3 * 2.0**2], [1.0, 2j])
    np.testing.assert_allclose(slopes, expected, rtol=1e-13)
    waves = derivatives(np.sin, point, 1e-3)
    np.testing.assert_allclose(waves, np.diag(np.cos(point)), rtol=1e-12, atol=1e-15)


def test_a_dataclass_with_large_arrays_has_a_short_repr() -> None:
    @checked(values="n", names="n")
    class Measured:
        values: RealArray
        names: tuple[str, ...]
        title: str

    short = Measured([1.0, 2.0], ["a", "b"], "today")
    assert repr(short).endswith("Measured(values=[1.0, 2.0], names=('a', 'b'), title='today')")
    long = repr(Measured(range(400), ["channel"] * 400, "t" * 200))
    assert "values=<400 float64>, names=<400 str>" in long
    assert len(long) < 200


def test_a_platform_and_its_model_fit_into_a_prompt() -> None:
    platform = read_platform(Path(__file__).parents[2] / "studies" / "data" / "u06_f39_f45")
    for value in (platform, platform.fleet, platform.model(vehicles="U06", band=(20.0, 21.0))):
        assert len(repr(value)) < 500
    assert "u06_f39_f45" in repr(platform)
    assert "15 Vehicle" in repr(platform.fleet)
