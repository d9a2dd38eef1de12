"""Powertrain data sheet, static curves and static equilibrium."""

from __future__ import annotations

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.campaign import StaticCurve
from deboom.mounts import characterised_mount
from deboom.mounts.mount import Mount
from deboom.physics.rigid_body import mass_properties
from deboom.vehicles import powertrain
from deboom.vehicles.powertrain import KinematicModel, MonotoneCurve, Powertrain, library_model

INERTIA = np.array([[11.0, -0.06, -0.26], [-0.06, 6.8, 0.53], [-0.26, 0.53, 9.6]])


def test_mass_matrix_off_the_centre_of_gravity():
    moved = Powertrain(193.5, INERTIA, np.array([0.01, -0.02, 0.03]))
    properties = mass_properties(moved.mass_matrix)
    np.testing.assert_allclose(properties.centre, [0.01, -0.02, 0.03])
    np.testing.assert_allclose(properties.inertia, INERTIA)


AXES = ("x", "y", "z")
DEFLECTION = np.linspace(-0.01, 0.01, 21)


def curve(mount="E", axis="x", force=lambda u: 2e5 * u, deflection=DEFLECTION):
    return StaticCurve(mount, axis, "M1", deflection, force(deflection), 0.03)


def progressive(u):
    return 1e5 * u + 4e9 * u**3


MOUNTS = tuple(
    Mount(name, "", ("",), (position,), AXES)
    for name, position in (("E", (0.0, 0.4, 0.2)), ("G", (0.0, -0.4, 0.2)), ("S", (0.2, 0.0, -0.3)))
)
CURVES = {f"{m.name} {a}": curve(m.name, a, progressive) for m in MOUNTS for a in AXES}


# ------------------------------------------------------------------ curves


def test_curve_passes_through_its_points_and_rises_everywhere():
    steps = np.array([0.0, 1.0, 1.1, 5.0, 5.1, 40.0])
    fitted = MonotoneCurve(StaticCurve("E", "x", "M1", np.arange(6.0), steps, 0.0))
    assert fitted.force(np.arange(6.0)) == pytest.approx(steps)
    fine = np.linspace(0.0, 5.0, 501)
    assert np.all(np.diff(fitted.force(fine)) > 0)
    assert np.all(fitted.slope(fine) > 0)


def test_slope_is_the_derivative_of_the_force():
    fitted = MonotoneCurve(curve(force=progressive))
    at, step = np.linspace(-0.0095, 0.0095, 37), 1e-8
    numeric = (fitted.force(at + step) - fitted.force(at - step)) / (2 * step)
    assert fitted.slope(at) == pytest.approx(numeric, rel=1e-5)


def test_curve_goes_on_with_its_last_secant():
    fitted = MonotoneCurve(curve(force=progressive))
    secant = np.diff(progressive(DEFLECTION[-2:]))[0] / 0.001
    for side in (-1.0, 1.0):
        beyond = fitted.force(np.array([side * 0.012]))[0]
        assert beyond == pytest.approx(side * (progressive(0.01) + 0.002 * secant))
        assert fitted.slope(np.array([side * 0.012]))[0] == pytest.approx(secant)
    assert (fitted.lowest, fitted.highest) == (-0.01, 0.01)


def test_curve_that_does_not_rise():
    with pytest.raises(InputError, match="static force of E x of M1 does not increase"):
        MonotoneCurve(curve(force=lambda u: np.abs(u)))


# ------------------------------------------------------------------ model


def test_pieces_share_a_curve():
    pair = Mount("P", "", ("left", "right"), ((0.0, 0.4, 0.2), (0.0, -0.4, 0.2)), AXES)
    mounts = (pair, MOUNTS[2])
    curves = {f"{m} {a}": curve(m, a, progressive) for m in ("P", "S") for a in AXES}
    model = KinematicModel(mounts, curves)
    single = KinematicModel(MOUNTS, CURVES).equilibrium([200.0])
    assert model.names[3] == "P right x"
    assert model.equilibrium([200.0]) == pytest.approx(single)


def test_torque_beyond_the_curves_names_the_direction():
    with pytest.raises(
        InputError, match=r"wheel torque of 9000 N m E x deflects by .* from -10.0 to 10.0 mm"
    ):
        KinematicModel(MOUNTS, CURVES).equilibrium([10.0, 9000.0])


def test_a_load_is_balanced_alone_as_among_others():
    forward = np.random.default_rng(1).normal(size=(9, 6))
    springs = lambda u: 1e5 * u + 1e12 * u**3, lambda u: 1e5 + 3e12 * u**2
    loads = np.array([[1.0, 0, 0, 0, 0, 0], [1e5, 0, 0, 0, 2e4, 0], [10.0, 3, 3, 0, 0, 0]])
    together = powertrain.balanced_deflection(loads, forward, *springs)
    for load, deflection in zip(loads, together, strict=True):
        alone = powertrain.balanced_deflection(load[np.newaxis], forward, *springs)
        np.testing.assert_array_equal(deflection, alone[0])
    np.testing.assert_allclose(springs[0](together) @ forward, loads, rtol=0, atol=1e-3)


def test_missing_curve():
    without = {name: static for name, static in CURVES.items() if name != "G y"}
    with pytest.raises(InputError, match="needs a force-deflection curve of G y"):
        KinematicModel(MOUNTS, without)


def test_mounts_that_leave_the_powertrain_free():
    with pytest.raises(InputError, match=r"\['E', 'G'\] leave the powertrain free"):
        KinematicModel(MOUNTS[:2], CURVES)


def test_unknown_direction():
    model = KinematicModel(MOUNTS, CURVES)
    with pytest.raises(InputError, match="no direction 'Du x'"):
        model.column("Du x")


# ------------------------------------------------------------------ library


def part(mount, curves=CURVES):
    none = np.empty(0)
    points = characterised_mount.MapPoints(
        none, none, none, none, none, none, np.empty(0, dtype=np.str_)
    )
    return characterised_mount.CharacterisedMount(
        characterised_mount.MountIdentity("rig", mount.name, "M1"),
        mount,
        tuple(
            characterised_mount.CharacterisedDirection(
                axis,
                points,
                characterised_mount.DirectionQuality(identified=False),
                static_curve=curves.get(f"{mount.name} {axis}"),
            )
            for axis in AXES
        ),
        {},
    )


def test_model_of_mounts_from_the_library():
    model = library_model([part(mount) for mount in MOUNTS])
    expected = KinematicModel(MOUNTS, CURVES).equilibrium([150.0])
    assert model.equilibrium([150.0]).tolist() == expected.tolist()


def test_library_mounts_twice_or_without_curve():
    with pytest.raises(InputError, match="every mount once"):
        library_model([part(MOUNTS[0]), part(MOUNTS[0])])
    with pytest.raises(InputError, match="needs a force-deflection curve of E x"):
        library_model([part(mount, {}) for mount in MOUNTS])
