"""Mounts on a rig: a known stiffness comes back by both methods of ISO 10846, into the library."""

import numpy as np
import pandas as pd
import pytest

from command_line import call
from deboom.errors import InputError
from deboom.files.component_test import read_stiffness
from deboom.files.mount_rig import read_mount_rig
from deboom.mounts.library import open_library

LINES = np.arange(20.0, 201.0, 5.0)
OMEGA = 2 * np.pi * LINES
MASS = 80.0
STATIC = 1e3 * np.array([[220.0, 15.0, 0.0], [15.0, 180.0, -8.0], [0.0, -8.0, 410.0]])
STIFFNESS = STATIC * (1 + 0.12j + 0.001 * LINES[:, None, None])
HEADER = """format = 1
title = "engine mount on the rig"
campaign = "rig_1"
mount = "EnM"
variant = "M1"
part_number = "4711"
method = "{method}"
{mass}
"""


def columns(side, values, unit):
    return {
        f"{side} {axis} {part} [{unit}]": getattr(values[:, k], part)
        for k, axis in enumerate("xyz")
        for part in ("real", "imag")
    }


def write_rig(folder, method, axes="xyz", preloads=(0.0,), output=True, mass=True):
    """Write a massless mount above a block of 80 kg (indirect) or a stiff frame (direct)."""
    folder.mkdir()
    line = f"blocking_mass_kg = {MASS}" if method == "indirect" and mass else ""
    text = HEADER.format(method=method, mass=line)
    for preload in preloads:
        for k, axis in enumerate(axes):
            # the shaker is not perfectly along its axis
            pushed = 1e-5 * (np.eye(3)[:, "xyz".index(axis)] + 0.04 * np.roll([1.0, 0.5, 0.2], k))
            top = np.broadcast_to(pushed, (LINES.size, 3)).astype(complex)
            if method == "indirect":
                # −ω² m u = K (top − u)
                ground = -(OMEGA**2)[:, None, None] * MASS * np.eye(3)
            else:
                ground = 5e7 * np.ones((LINES.size, 1, 1)) * np.eye(3)
            bottom = np.linalg.solve(ground + STIFFNESS, STIFFNESS @ top[:, :, None])[:, :, 0]
            force = np.einsum("fab,fb->fa", STIFFNESS, top - bottom)
            squared = -(OMEGA**2)[:, None]
            table = {"frequency [Hz]": LINES} | columns("input", squared * top, "m/s^2")
            if method == "direct":
                table |= columns("force", force, "N")
            if output:
                table |= columns("output", squared * bottom, "m/s^2")
            name = f"{axis}_{preload:g}.csv"
            pd.DataFrame(table).to_csv(folder / name, index=False)
            text += (
                f'\n[[runs]]\nname = "{axis}, {preload:g} N"\naxis = "{axis}"\n'
                f'preload_n = [0.0, 0.0, {preload}]\ntable = "{name}"\n'
            )
    (folder / "rig.toml").write_text(text, encoding="utf-8")
    return folder


@pytest.mark.parametrize("method", ["direct", "indirect"])
def test_the_full_stiffness_comes_back(tmp_path, method):
    rig = read_mount_rig(write_rig(tmp_path / "rig", method))
    (measured,) = rig.stiffness
    assert measured.complete
    assert np.allclose(measured.stiffness, STIFFNESS, rtol=1e-9)


def test_the_indirect_method_holds_above_the_block_on_its_mount(tmp_path):
    """Block of 80 kg on 410 N/mm: 11 Hz; 20 dB of isolation need √11 times that."""
    (measured,) = read_mount_rig(write_rig(tmp_path / "rig", "indirect")).stiffness
    resonance = np.sqrt(np.diag(STATIC) / MASS) / (2 * np.pi)
    first = [LINES[measured.valid[:, k]].min() for k in range(3)]
    assert np.all(np.array(first) > 3.0 * resonance)
    assert np.all(np.array(first) < 4.5 * resonance)


def test_one_axis_gives_its_own_stiffness_alone(tmp_path):
    rig = read_mount_rig(write_rig(tmp_path / "rig", "direct", axes="z"))
    (measured,) = rig.stiffness
    assert not measured.complete
    assert np.isnan(measured.stiffness[:, 0, 0]).all()
    # the shaker pushes across as well, which one excitation cannot tell
    assert np.allclose(measured.stiffness[:, 2, 2], STIFFNESS[:, 2, 2], rtol=2e-3)
    assert [direction.axis for direction in rig.mount.directions] == ["z"]
    assert dict(rig.mount.quality) == {"valid lines [1]": 1.0}


def test_preloads_and_axes_go_into_the_library(tmp_path):
    folder = write_rig(tmp_path / "rig", "direct", preloads=(0.0, -800.0))
    library, table = tmp_path / "mounts.db", tmp_path / "k.csv"
    done = call("library", "rig", library, folder, "--table", table)
    assert "EnM" in done.stdout
    with open_library(str(library)) as opened:
        mount = opened.load(opened.only(opened.identities(mount="EnM")))
    points = mount.direction("z").map_points
    assert sorted(set(points.preload)) == [-800.0, 0.0]
    assert np.allclose(points.dynamic_stiffness[: LINES.size], STIFFNESS[:, 2, 2])
    assert np.all(points.confidence == 1.0)
    lines, stiffness = read_stiffness(table)
    assert np.allclose(lines, LINES)
    assert np.allclose(stiffness, STIFFNESS)


def test_rigs_that_do_not_fit(tmp_path):
    with pytest.raises(InputError, match="'blocking_mass_kg' belongs to the indirect method"):
        read_mount_rig(write_rig(tmp_path / "no_mass", "indirect", mass=False))
    with pytest.raises(InputError, match="the file has no function 'output x'"):
        read_mount_rig(write_rig(tmp_path / "no_output", "indirect", output=False))
    partly = write_rig(tmp_path / "partly", "direct", axes="z")
    table = pd.read_csv(partly / "z_0.csv")
    rest = table.drop(columns=[name for name in table if name.startswith("output x")])
    rest.to_csv(partly / "z_0.csv", index=False)
    with pytest.raises(InputError, match="the file has no function 'output x'"):
        read_mount_rig(partly)
    twice = write_rig(tmp_path / "twice", "direct", axes="zx")
    text = (twice / "rig.toml").read_text(encoding="utf-8")
    (twice / "rig.toml").write_text(text.replace('axis = "x"', 'axis = "z"'), encoding="utf-8")
    with pytest.raises(InputError, match=r"two runs along z under the preload \(0, 0, 0\) N"):
        read_mount_rig(twice)
    alone = write_rig(tmp_path / "alone", "direct", axes="z")
    words = ("library", "rig", tmp_path / "one.db", alone, "--table", tmp_path / "k.csv")
    assert "do not excite all three axes" in call(*words, code=2).stderr
    assert not (tmp_path / "one.db").exists()


FLANGE = 1.2


def write_flanged(folder, side, stated):
    """Put a flange of 1.2 kg between specimen and force cells."""
    write_rig(folder, "direct", axes="z")
    table = pd.read_csv(folder / "z_0.csv")
    moved, sign = ("input", 1) if side == "input" else ("output", -1)
    for part in ("real", "imag"):
        table[f"force z {part} [N]"] += sign * FLANGE * table[f"{moved} z {part} [m/s^2]"]
    table.to_csv(folder / "z_0.csv", index=False)
    keys = f'force_side = "{side}"\n' + (f"flange_mass_kg = {FLANGE}\n" if stated else "")
    text = (folder / "rig.toml").read_text(encoding="utf-8")
    (folder / "rig.toml").write_text(text.replace("[[runs]]", keys + "[[runs]]", 1), "utf-8")
    return folder


@pytest.mark.parametrize("side", ["input", "output"])
def test_a_flange_beside_the_force_cells_is_taken_off(tmp_path, side):
    plain = read_mount_rig(write_rig(tmp_path / "plain", "direct", axes="z"))
    rig = read_mount_rig(write_flanged(tmp_path / "rig", side, stated=True))
    expected = plain.stiffness[0].stiffness[:, 2, 2]
    assert np.allclose(rig.stiffness[0].stiffness[:, 2, 2], expected, rtol=1e-9)
    assert rig.warnings == ()


def test_a_flange_that_is_not_stated_is_named_with_its_mass(tmp_path):
    """Re K was 0 at 93 Hz and negative beyond, with all lines valid."""
    folder = write_flanged(tmp_path / "rig", "input", stated=False)
    rig = read_mount_rig(folder)
    assert "Re K along z falls with ω² as by 1" in rig.warnings[0]
    assert "flange_mass_kg" in rig.warnings[0]
    seen = dict(rig.mount.quality)["mass seen in Re K along z [kg]"]
    # rubber that stiffens with frequency hides a part of the mass
    assert 0.7 * FLANGE < seen < 1.05 * FLANGE
    printed = call("library", "rig", tmp_path / "one.db", folder).stdout
    assert "WARNING: z, 0 N: Re K along z falls" in " ".join(printed.split())


def test_flanges_that_do_not_fit_the_method(tmp_path):
    indirect = write_rig(tmp_path / "indirect", "indirect", axes="z")
    text = (indirect / "rig.toml").read_text(encoding="utf-8")
    text = text.replace("[[runs]]", "flange_mass_kg = 1.2\n[[runs]]", 1)
    (indirect / "rig.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="its flange is part of blocking_mass_kg"):
        read_mount_rig(indirect)
    bare = write_flanged(tmp_path / "bare", "output", stated=True)
    table = pd.read_csv(bare / "z_0.csv")
    rest = table.drop(columns=[name for name in table if name.startswith("output")])
    rest.to_csv(bare / "z_0.csv", index=False)
    with pytest.raises(
        InputError, match="flange_mass_kg on the output side needs its acceleration"
    ):
        read_mount_rig(bare)
