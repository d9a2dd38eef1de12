"""The compressor's page of equations names functions and tests that exist, and every equation."""

import importlib
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "compressor-physics.md").read_text(encoding="utf-8")


def exists(module, name):
    for room in ("compressor", "physics"):
        try:
            return hasattr(importlib.import_module(f"deboom.{room}.{module}"), name)
        except ModuleNotFoundError:
            continue
    return False


def test_functions_on_the_page_exist():
    names = re.findall(r"`([a-z_]+)\.([A-Za-z_]+)`", PAGE)
    assert len(names) > 20
    assert [f"{module}.{name}" for module, name in names if not exists(module, name)] == []


def test_proofs_on_the_page_exist():
    proofs = set(re.findall(r"`(test_\w+)`", PAGE))
    assert len(proofs) > 25
    files = (ROOT / "tests" / "verification").glob("test_*.py")
    defined = set(
        re.findall(r"^def (test_\w+)", "".join(f.read_text(encoding="utf-8") for f in files), re.M)
    )
    assert proofs - defined == set()


def test_proofs_of_the_equations_are_on_the_page():
    path = ROOT / "tests" / "verification" / "test_compressor_equations.py"
    defined = set(re.findall(r"^def (test_\w+)", path.read_text(encoding="utf-8"), re.M))
    not_an_equation = {"test_amplitude_response_refusals"}
    assert defined - set(re.findall(r"`(test_\w+)`", PAGE)) == not_an_equation


def test_every_equation_from_36_to_75_has_a_row():
    found = set()
    for row in re.findall(r"^\| ([\d–, ]+) \|", PAGE, re.M):
        for part in row.split(", "):
            first, _, last = part.strip().partition("–")
            found |= set(range(int(first), int(last or first) + 1))
    assert found == set(range(36, 76))
