"""Both pages of equations name functions and tests that exist, and leave no equation out."""

import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = {
    name: (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
    for name in ("physics", "compressor-physics", "exploration")
}
EQUATIONS = {"physics": range(1, 36), "compressor-physics": range(36, 76), "exploration": ()}


def functions(page):
    """Names such as ``rigid_body.mount_stiffness_matrix`` in a page's tables and text."""
    names = re.findall(r"`((?:[a-z]\w*\.)+[A-Za-z_]\w*)`", PAGES[page])
    return sorted({name for name in names if not name.endswith((".py", ".md", ".toml", ".json"))})


def exists(name):
    """Whether a name is found in a module of that name in some package, attribute by attribute."""
    module, *attributes = name.split(".")
    for path in (ROOT / "src" / "deboom").glob(f"*/{module}.py"):
        target = importlib.import_module(f"deboom.{path.parent.name}.{module}")
        for attribute in attributes:
            target = getattr(target, attribute, None)
        if target is not None:
            return True
    return False


def defined_tests():
    texts = [path.read_text(encoding="utf-8") for path in (ROOT / "tests").glob("*/test_*.py")]
    return set(re.findall(r"^def (test_\w+)", "\n".join(texts), re.M))


@pytest.mark.parametrize("page", PAGES)
def test_functions_on_the_page_exist(page):
    names = functions(page)
    assert names
    assert [name for name in names if not exists(name)] == []


@pytest.mark.parametrize("page", PAGES)
def test_proofs_on_the_page_exist(page):
    proofs = set(re.findall(r"`(test_\w+)`", PAGES[page]))
    assert proofs
    assert proofs - defined_tests() == set()


@pytest.mark.parametrize("page", PAGES)
def test_every_equation_has_a_row(page):
    rows = set()
    for row in re.findall(r"^\| ([\d–, ]+) \|", PAGES[page], re.M):
        for part in row.split(", "):
            first, _, last = part.strip().partition("–")
            rows |= set(range(int(first), int(last or first) + 1))
    assert rows == set(EQUATIONS[page])


def test_proofs_of_the_compressors_equations_are_on_its_page():
    path = ROOT / "tests" / "verification" / "test_compressor_equations.py"
    defined = set(re.findall(r"^def (test_\w+)", path.read_text(encoding="utf-8"), re.M))
    assert defined - set(re.findall(r"`(test_\w+)`", PAGES["compressor-physics"])) == set()


def test_every_public_function_of_the_package_physics_has_its_place():
    """Functions without an equation of their own are allowed by name, so that none is forgotten."""
    without_equation = {
        "sound_level.full_scale",
        "sound_level.unweighted_level",
        "frf.CrossSpectra",
        "frf.FrfForm",
        "frf.SpectrumScaling",
    }
    for module in ("sound_level", "transfer_path", "frf", "substructuring"):
        module_of_table = importlib.import_module(f"deboom.physics.{module}")
        public = {
            f"{module}.{name}"
            for name, value in vars(module_of_table).items()
            if callable(value)
            and getattr(value, "__module__", "") == module_of_table.__name__
            and not name.startswith("_")
        }
        assert public - set(functions("physics")) <= without_equation
