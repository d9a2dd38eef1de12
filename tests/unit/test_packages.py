"""What each package says that it may import, held against its imports and the layers."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "deboom"
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
