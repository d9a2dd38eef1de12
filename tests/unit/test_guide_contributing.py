"""The worked changes of the contributor's page work as they stand there."""

import runpy
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

import deboom
from deboom.mounts.response_surface import KelvinVoigtModel, StiffnessSamples

DOCS = Path(__file__).parents[2] / "docs"


def example(name):
    return runpy.run_path(str(DOCS / "guides" / f"example_{name}.py"))


def test_the_figure_takes_axes_and_refuses_nan():
    draw = example("figure")["level_over_factor"]
    _, axes = plt.subplots()
    assert draw([0.9, 1.0], [60.0, 61.0], ax=axes) is axes
    plt.close("all")
    with pytest.raises(deboom.InputError, match="level"):
        draw([0.9, 1.0], [60.0, np.nan])


def test_the_format_reads_what_numpy_wrote_and_refuses_the_rest(tmp_path):
    read = example("format")["from_npz"]
    good = {
        "frequency": np.array([20.0, 21.0]),
        "names": np.array(["TSM x", "TSM z"]),
        "values": np.array([[1j, 2.0], [3.0, 4.0]]),
        "units": np.array(["Pa/N", "Pa/N"]),
    }
    np.savez(tmp_path / "car.npz", **good)
    table = read(tmp_path / "car.npz")
    unit, values = table.functions["TSM x"]
    assert (unit, values.tolist(), table.frequency.tolist()) == ("Pa/N", [1j, 3.0], [20.0, 21.0])
    damaged = {
        "short": (good | {"values": good["values"][:1]}, "do not fit together"),
        "nameless": ({k: v for k, v in good.items() if k != "names"}, "no array 'names'"),
        "pickled": (good | {"names": np.array([{}, {}])}, "no npz file of numbers"),
    }
    for name, (content, sentence) in damaged.items():
        np.savez(tmp_path / f"{name}.npz", **content)
        with pytest.raises(deboom.InputError, match=sentence):
            read(tmp_path / f"{name}.npz")
    (tmp_path / "text.npz").write_text("frequency", encoding="utf-8")
    with pytest.raises(deboom.InputError, match="no npz file"):
        read(tmp_path / "text.npz")


def test_the_mount_model_finds_its_own_law_and_is_compared():
    model = example("mount_model")["HystereticModel"](preload_unit="N m")
    rng = np.random.default_rng(1)
    points = rng.uniform([0, 1e-5, 20], [800, 5e-4, 80], (400, 3))
    stiffness = 2e5 * (1 + (points[:, 0] / 800) ** 2) * (1 + 0.12j)
    halves = [StiffnessSamples(*points[k::2].T, stiffness[k::2]) for k in (0, 1)]
    others = {"Kelvin-Voigt": KelvinVoigtModel(preload_unit="N m")}
    table = deboom.compare_models({"hysteretic": model} | others, *halves).set_index("model")
    assert table.loc["hysteretic", "rms error [%]"] < 1e-6
    assert table.loc["Kelvin-Voigt", "rms error [%]"] > 1
    model.fit(points, stiffness)
    assert model.loss_factor_ == pytest.approx(0.12)
