"""What each package says that it may import, against its imports and layers; studies compose."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

from deboom.report import Report

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "deboom"
STUDIES = sorted((ROOT / "studies").glob("[!_]*.py"))
PACKAGES = sorted(path.parent.name for path in SOURCE.glob("*/__init__.py"))


def layers():
    """Return packages by layer, the highest first, as import-linter holds them."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = settings["tool"]["importlinter"]["contracts"]
    (order,) = (contract["layers"] for contract in contracts if contract["type"] == "layers")
    return [[name.strip() for name in layer.split("|")] for layer in order]


def stated(package):
    """Return packages that a package's docstring allows; there is one sentence that says so."""
    text = ast.get_docstring(ast.parse((SOURCE / package / "__init__.py").read_text("utf-8")))
    (sentence,) = re.findall(r"May import [^.;]*[.;]", " ".join(text.split()))
    return set(re.findall(r"`(\w+)`", sentence))


def imported(package):
    """Return packages of deboom that the modules of a package import."""
    names = set()
    for path in (SOURCE / package).glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("deboom"):
                whole = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
                names |= {name.split(".")[1] for name in whole if "." in name}
    return names & set(PACKAGES) - {package}


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_imports_what_it_says_that_it_may(package):
    assert imported(package) <= stated(package)


@pytest.mark.parametrize("package", PACKAGES)
def test_what_a_package_may_import_lies_below_it(package):
    place = {name: number for number, layer in enumerate(layers()) for name in layer}
    upwards = {name for name in stated(package) if place[name] <= place[package]}
    # a front draws itself, when a notebook asks for it
    assert upwards == ({"plot"} if package == "explore" else set())


def written(path):
    """Return what a file writes on a page: calls of `Report`, and of what a report shows."""
    shows = {name for name in vars(Report) if not name.startswith("_")} - {"attach"}
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Call):
            match node.func:
                case ast.Name("Report"):
                    yield node.lineno
                case ast.Attribute(ast.Name("report"), name) if name in shows:
                    yield node.lineno


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_a_study_composes_and_leaves_its_page_to_the_pages(path):
    assert not list(written(path))


def test_a_study_that_writes_on_its_page_is_seen():
    assert list(written(ROOT / "docs" / "guides" / "example_study.py"))
