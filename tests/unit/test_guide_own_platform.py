"""The guide to one's own platform, followed literally; and its foreign response."""

import importlib.util
import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from deboom.cli import app
from deboom.explore.search import nsga2
from deboom.study.runner import load_study

ROOT = Path(__file__).parents[2]
GUIDE = ROOT / "docs" / "guides" / "your-own-platform.md"
pytestmark = pytest.mark.usefixtures("each_picture_once")
SMALLER = ("--generations", "2", "--population", "8", "--samples", "4", "--no-polish")


def script(name):
    path = GUIDE.with_name(f"{name}.py")
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def commands():
    text = GUIDE.read_text(encoding="utf-8")
    return [
        line
        for block in re.findall(r"```sh\n(.*?)```", text, flags=re.S)
        for line in block.splitlines()
    ]


@pytest.mark.usefixtures("plain_loops")
def test_the_guide_leads_from_an_empty_folder_to_a_front(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(load_study(ROOT / "studies/u06_robust_front.py").module, "VERIFIED", 64)
    codes, said = [], []
    for line in commands():
        program, *arguments = shlex.split(line)
        if program == "python":
            name, folder = arguments
            script(Path(name).stem).fill(Path(folder))
            continue
        if arguments[0] == "run":
            if "u06_robust_front" not in line:
                continue
            study, options = ROOT / arguments[1], arguments[2:]
            arguments = ["run", str(study), *options, *SMALLER]
        result = CliRunner().invoke(app, arguments)
        codes.append(result.exit_code)
        said.append((result.stdout, result.stderr))
    assert codes == [0, 2, 0, 0]
    guide = GUIDE.read_text(encoding="utf-8")
    for told in re.findall(r"^ {1,2}\d+  .*", guide, flags=re.M):
        assert told in said[1][1]
    assert said[2][0].strip() in guide
    run = Path(said[3][0].splitlines()[-1])
    assert json.loads((run / "summary.json").read_text(encoding="utf-8"))["n_front"] >= 1


def test_the_studies_of_the_guide_are_there_with_their_options():
    text = " ".join(commands())
    for name in re.findall(r"studies/(\w+)\.py", text):
        study = load_study(ROOT / "studies" / f"{name}.py")
        assert {"platform", "group", "mounts"} <= study.parameters.keys()


def test_a_foreign_response_gets_a_front_of_its_own():
    module = script("foreign_response")
    slopes = np.array([[6.5, 1.5, -2.0], [4.0, 5.5, 0.5]])
    values = module.robust(np.ones((1, 3)))
    assert values.mean[0] == pytest.approx([62.4, 64.1], abs=1e-2)
    # a linear response of independent factors, sigma a third of ±15 %, cut at 3 sigma
    assert values.sigma[0] == pytest.approx(0.05 * np.linalg.norm(slopes, axis=1), rel=0.05)
    front = nsga2(module.robust, population=20, generations=30, seed=1).front
    # its best mean lies in a corner: 0.8, 0.8 and 1.2
    assert front.mean_sum[0] == pytest.approx(126.5 - 0.2 * (10.5 + 7.0 + 1.5), abs=0.02)
    assert front.designs[0] == pytest.approx([0.8, 0.8, 1.2], abs=5e-3)


def test_the_guide_shows_the_example_as_it_stands():
    example = GUIDE.with_name("foreign_response.py").read_text(encoding="utf-8")
    block = re.search(r"```python\n(.*?)```", GUIDE.read_text(encoding="utf-8"), flags=re.S)[1]
    code = [line.strip() for line in block.splitlines() if line.strip()]
    assert 5 <= len(code) <= 10
    assert all(line in example for line in code)
