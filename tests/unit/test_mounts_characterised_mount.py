"""What may be kept of a mount, and what is refused before it reaches a library."""

import pickle
from dataclasses import MISSING, fields, replace

import numpy as np
import pytest
from mounts_library_samples import (
    assert_same,
    campaign,
    every_kind_of_array,
    map_points,
    mount,
    surface,
    wishbone,
)

from deboom.errors import InputError
from deboom.measurement.campaign import StaticCurve
from deboom.mounts.characterised_direction import (
    CharacterisedDirection,
    DirectionQuality,
    FittedSurface,
)
from deboom.mounts.characterised_mount import CampaignRecord, MountIdentity
from deboom.mounts.mount import Mount


def test_an_identity_reads_like_a_label():
    full = MountIdentity("spring", "TSM", "M3", "4711", "Rubber Ltd", "A7")
    assert str(full) == (
        "TSM M3 of campaign spring, part number 4711, supplier Rubber Ltd, serial A7"
    )
    assert str(MountIdentity("spring", "TSM", "M3")) == "TSM M3 of campaign spring"


@pytest.mark.parametrize(
    ("name", "text"),
    [("campaign", ""), ("variant", ""), ("serial", "a\0b"), ("supplier", "x" * 256)],
)
def test_text_that_cannot_be_kept_is_refused(name, text):
    content = {"campaign": "spring", "mount": "TSM", "variant": "M3", name: text}
    with pytest.raises(InputError, match=rf"{name} .* cannot be kept: use [01] to 255 printable"):
        MountIdentity(**content)


def test_arrays_are_copies_that_nobody_can_change():
    value = mount()
    points = value.direction("x").map_points
    arrays = value.direction("x").surface.arrays
    for array in (points.preload, points.dynamic_stiffness, points.run, *arrays.values()):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = array
    assert_same(pickle.loads(pickle.dumps(value)), value)  # a worker process may return it


def test_map_points_need_equal_lengths_finite_values_and_a_confidence_from_0_to_1():
    points = map_points(1)
    with pytest.raises(InputError, match="arrays of one equal length"):
        replace(points, amplitude=points.amplitude[:-1])
    with pytest.raises(InputError, match="MapPoints: preload holds a value that is not finite"):
        replace(points, preload=np.full(len(points), np.nan))
    with pytest.raises(InputError, match="confidence lies between 0 and 1"):
        replace(points, confidence=points.confidence + 1)


def test_a_surface_states_variables_units_and_ranges():
    kept = FittedSurface.of(surface(), {"pieces": np.int64(2)})
    assert kept.variables == ("preload", "amplitude", "frequency")
    assert kept.units == ("N", "m", "Hz")
    assert kept.settings == {"pieces": 2}
    assert type(kept.settings["pieces"]) is int
    points = map_points(3)
    assert kept.lower.tolist() == [points.preload.min(), points.amplitude.min(), 20.0]
    with pytest.raises(InputError, match="3 variables need as many units and bounds, it has 2"):
        replace(kept, units=("N", "m"))
    with pytest.raises(InputError, match="array bad is of object, not of numbers"):
        replace(kept, arrays={"bad": np.array([None])})
    with pytest.raises(InputError, match="setting split is of list, not plain"):
        replace(kept, settings={"split": [1.0]})
    with pytest.raises(InputError, match="threshold is inf"):
        replace(kept, settings={"threshold": np.inf})


def test_only_the_model_that_was_kept_is_built_again():
    kept = FittedSurface.of(surface(), {})
    with pytest.raises(InputError, match="a surface of model Spline cannot be built"):
        replace(kept, model="Spline").response_surface()
    with pytest.raises(InputError, match="lacks the arrays"):
        replace(kept, arrays=every_kind_of_array()).response_surface()


def test_a_direction_is_x_y_or_z_and_identified_only_with_a_surface():
    with pytest.raises(InputError, match="unknown axis 'rx', use x, y, z"):
        CharacterisedDirection("rx", map_points(1), DirectionQuality(False))
    with pytest.raises(InputError, match="direction x is identified, but it has no surface"):
        CharacterisedDirection("x", map_points(1), DirectionQuality(True))
    with pytest.raises(InputError, match="r2_real is nan; leave out what is not known"):
        DirectionQuality(False, r2_real=float("nan"))


def test_the_parts_of_a_mount_belong_together():
    value = mount()
    x = value.direction("x")
    with pytest.raises(InputError, match="its geometry is that of mount TSM"):
        replace(value, identity=replace(value.identity, mount="EnM"))
    with pytest.raises(InputError, match=r"needs every axis once, it has \['x', 'x'\]"):
        replace(value, directions=(x, x))
    with pytest.raises(InputError, match="direction z has the static curve of TSM x"):
        replace(value, directions=(replace(x, axis="z"),))
    with pytest.raises(InputError, match="it has no direction 'y', use x"):
        replace(value, directions=(x,)).direction("y")
    with pytest.raises(InputError, match=r"text .* cannot be kept"):
        replace(value, mount=replace(value.mount, description="two\nlines"))


@pytest.mark.parametrize(
    "build",
    [
        lambda numbers: campaign(tolerances=numbers),
        lambda numbers: replace(mount(), quality=numbers),
    ],
)
def test_numbers_carry_their_unit_in_the_name(build):
    with pytest.raises(InputError, match="'position' lacks its unit; write it as in 'position"):
        build({"position": 0.002})
    with pytest.raises(InputError, match=r"position \[m\] is inf"):
        build({"position [m]": float("inf")})


def test_types_are_values_not_views():
    preload = np.zeros(150)
    points = replace(map_points(1), preload=preload)
    preload[0] = 5.0
    assert points.preload[0] == 0.0


def test_the_samples_leave_no_field_at_its_default():
    """A field that a store forgets comes back as its default: the samples must show it."""
    seen = [mount(part_number="7", supplier="S", serial="1"), wishbone()]
    parts = {
        Mount: [value.mount for value in seen],
        MountIdentity: [value.identity for value in seen],
        DirectionQuality: [d.quality for value in seen for d in value.directions],
        CharacterisedDirection: [d for value in seen for d in value.directions],
        StaticCurve: [seen[0].direction("x").static_curve],
        CampaignRecord: [campaign()],
    }
    for kind, values in parts.items():
        for field in fields(kind):
            if field.default is not MISSING:
                assert any(getattr(value, field.name) != field.default for value in values), field
