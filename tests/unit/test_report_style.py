"""Colours by name: stable, and told apart by colour-blind readers."""

from itertools import combinations

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.report.style import (
    MOUNT_PALETTE,
    VEHICLE_PALETTE,
    mount_colours,
    mount_of,
    signed,
    vehicle_colours,
)

# Machado, Oliveira, Fernandes (2009), severity 1.0, on linear RGB
COLOUR_VISION = {
    "normal": np.eye(3),
    "protanopia": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "tritanopia": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
}
XYZ_OF_RGB = np.array(
    [[0.41246, 0.35758, 0.18044], [0.21267, 0.71515, 0.07218], [0.01933, 0.11919, 0.95030]]
)


def linear_rgb(colour):
    encoded = np.array([int(colour[place : place + 2], 16) for place in (1, 3, 5)]) / 255.0
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def lab(rgb):
    """CIE 1976 L*a*b* of linear sRGB."""
    x, y, z = np.cbrt(np.clip(XYZ_OF_RGB @ rgb, 1e-4, None) / [0.95047, 1.0, 1.08883])
    return np.array([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])


@pytest.mark.parametrize("vision", COLOUR_VISION)
@pytest.mark.parametrize("palette", [VEHICLE_PALETTE, MOUNT_PALETTE])
def test_colours_are_told_apart_by_every_reader(palette, vision):
    seen = [lab(np.clip(COLOUR_VISION[vision] @ linear_rgb(c), 0.0, 1.0)) for c in palette]
    assert min(np.linalg.norm(a - b) for a, b in combinations(seen, 2)) > 15.0


def test_a_vehicle_keeps_its_colour_whatever_follows_it():
    names = [f"V{place}" for place in range(18)]
    assert vehicle_colours(names[:5]) == dict(list(vehicle_colours(names).items())[:5])


def test_eighteen_vehicles_have_eighteen_colours():
    colours = vehicle_colours([f"V{place}" for place in range(18)])
    assert len(set(colours.values())) == 18
    assert tuple(colours.values())[:6] == VEHICLE_PALETTE


def test_darker_shades_are_darker_and_lighter_ones_lighter():
    colours = tuple(mount_colours([f"M{place}" for place in range(18)]).values())
    for base, dark, light in zip(colours[:6], colours[6:12], colours[12:], strict=True):
        assert linear_rgb(dark).sum() < linear_rgb(base).sum() < linear_rgb(light).sum()


def test_duplicated_names_are_refused():
    with pytest.raises(InputError, match="duplicated vehicle \\['A'\\]"):
        vehicle_colours(["A", "B", "A"])


def test_mount_of_a_variable():
    assert mount_of("TSM x") == "TSM"
    assert mount_of("front left z") == "front left"
    assert mount_of("strut") == "strut"


def test_changes_carry_their_sign():
    assert signed(-3.14, 1) == "−3.1"
    assert signed(0.2, 1) == "+0.2"
    assert signed(-0.04, 1) == "0.0"
    assert signed(12.4, 0) == "+12"
    assert signed(0.4, 0) == "0"
