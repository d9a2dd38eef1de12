"""The page of equations names functions and tests that exist, and leaves no equation out."""

import importlib
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "physics.md").read_text(encoding="utf-8")


def test_functions_on_the_page_exist():
    names = re.findall(r"`([a-z_]+)\.([a-z_]+)`", PAGE)
    assert len(names) > 20
    missing = [
        f"{module}.{function}"
        for module, function in names
        if not hasattr(importlib.import_module(f"deboom.physics.{module}"), function)
    ]
    assert missing == []


def test_proofs_on_the_page_exist():
    proofs = set(re.findall(r"`(test_\w+)`", PAGE))
    assert len(proofs) > 20
    files = (ROOT / "tests" / "verification").glob("test_physics_*.py")
    defined = set(
        re.findall(r"^def (test_\w+)", "".join(f.read_text(encoding="utf-8") for f in files), re.M)
    )
    assert proofs - defined == set()


def test_every_equation_from_1_to_35_has_a_row():
    found = set()
    for row in re.findall(r"^\| ([\d–, ]+) \|", PAGE, re.M):
        for part in row.split(", "):
            first, _, last = part.strip().partition("–")
            found |= set(range(int(first), int(last or first) + 1))
    assert found == set(range(1, 36))


def test_every_public_function_of_the_room_has_its_place():
    """Functions without an equation of their own are allowed by name, so that none is forgotten."""
    without_equation = {
        "sound_level.unweighted_level",
        "frf.CrossSpectra",
        "frf.FrfForm",
        "frf.SpectrumScaling",
    }
    for module in ("sound_level", "transfer_path", "frf"):
        room = importlib.import_module(f"deboom.physics.{module}")
        public = {
            f"{module}.{name}"
            for name, value in vars(room).items()
            if callable(value)
            and getattr(value, "__module__", "") == room.__name__
            and not name.startswith("_")
        }
        named = {name for name in public if f"`{name}`" in PAGE}
        assert public - named <= without_equation
