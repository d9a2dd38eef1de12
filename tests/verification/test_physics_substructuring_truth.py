"""Substructuring against beams in closed form, masses and springs, and a direct solution."""

import doctest

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.physics import substructuring
from deboom.physics.rigid_body import forward_matrix, mass_matrix
from deboom.physics.substructuring import (
    Component,
    Joint,
    assembled_stiffness,
    couple,
    decouple,
    singular_vectors,
)

FREQUENCY = np.linspace(20.0, 400.0, 60)
OMEGA = 2 * np.pi * FREQUENCY
BENDING, MASS_PER_LENGTH = 210e9 * (1 + 0.02j) * 2e-9, 1.2
"""Bending stiffness [N m²] and mass per length [kg/m] of a slender beam."""


def beam_stiffness(length):
    """Dynamic stiffness of a free beam at (w, slope) of both ends, Euler-Bernoulli, closed form."""
    wave = (OMEGA**2 * MASS_PER_LENGTH / BENDING) ** 0.25
    # each end's motion and load from the four waves cos, sin, cosh, sinh
    motion = np.empty((len(OMEGA), 4, 4), complex)
    load = np.empty_like(motion)
    for place, x in ((0, 0.0), (2, length)):
        a = wave * x
        motion[:, place] = np.array([np.cos(a), np.sin(a), np.cosh(a), np.sinh(a)]).T
        motion[:, place + 1] = (wave * np.array([-np.sin(a), np.cos(a), np.sinh(a), np.cosh(a)])).T
        third = np.array([np.sin(a), -np.cos(a), np.sinh(a), np.cosh(a)])
        second = np.array([-np.cos(a), -np.sin(a), np.cosh(a), np.sinh(a)])
        outward = 1.0 if place else -1.0
        load[:, place] = (-outward * BENDING * wave**3 * third).T
        load[:, place + 1] = (outward * BENDING * wave**2 * second).T
    return load @ np.linalg.inv(motion)


def free_beam(length, prefix):
    names = tuple(f"{prefix} {name}" for name in ("w left", "slope left", "w right", "slope right"))
    return Component(names, names, np.linalg.inv(beam_stiffness(length)))


def deviation(values, truth):
    return np.abs(values - truth).max() / np.abs(truth).max()


def test_tip_of_a_free_beam_is_the_printed_receptance():
    """Bishop and Johnson: α = −F5 / (EI λ³ F3) at a free end; the samples below rest on it."""
    length = 0.7
    a = (OMEGA**2 * MASS_PER_LENGTH / BENDING) ** 0.25 * length
    f5 = np.cos(a) * np.sinh(a) - np.sin(a) * np.cosh(a)
    f3 = np.cos(a) * np.cosh(a) - 1
    printed = -f5 / (BENDING * (a / length) ** 3 * f3)
    assert deviation(free_beam(length, "beam").receptance[:, 0, 0], printed) < 1e-9


def test_two_beams_coupled_at_their_ends_are_the_long_beam():
    left, right = free_beam(0.5, "A"), free_beam(0.9, "B")
    joint = Joint(["A w right", "A slope right"], ["B w left", "B slope left"])
    assembly = couple([left, right], [joint])
    long = free_beam(1.4, "whole").receptance
    outer = [0, 1, 6, 7]
    assert deviation(assembly.receptance[:, outer][:, :, outer], long) < 1e-8
    # both sides of a rigid joint move alike
    assert deviation(assembly.receptance[:, 2], assembly.receptance[:, 4]) < 1e-8


def test_primal_and_dual_form_agree():
    names = [("a", "b", "c", "d"), ("c", "d", "e", "f")]
    every, total = assembled_stiffness([beam_stiffness(0.5), beam_stiffness(0.9)], names)
    assert every == ("a", "b", "c", "d", "e", "f")
    primal = np.linalg.inv(total)
    joint = Joint(["A w right", "A slope right"], ["B w left", "B slope left"])
    dual = couple([free_beam(0.5, "A"), free_beam(0.9, "B")], [joint]).receptance
    kept = [0, 1, 2, 3, 6, 7]
    assert deviation(dual[:, kept][:, :, kept], primal) < 1e-8


@pytest.mark.parametrize("shared", [["c", "d"], ["a", "b", "c", "d"]])
def test_decoupling_returns_the_other_beam(shared):
    """With the interface alone, and with the removed beam's far end beside it (extended)."""
    names, total = assembled_stiffness(
        [beam_stiffness(0.5), beam_stiffness(0.9)],
        [("a", "b", "c", "d"), ("c", "d", "e", "f")],
    )
    assembly = Component(names, names, np.linalg.inv(total))
    removed = Component(names[:4], names[:4], np.linalg.inv(beam_stiffness(0.5)))
    rest = decouple(assembly, removed, shared)
    remaining = [names.index(name) for name in ("c", "d", "e", "f")]
    truth = np.linalg.inv(beam_stiffness(0.9))
    assert deviation(rest.receptance[:, remaining][:, :, remaining], truth) < 1e-6


def test_mount_between_two_masses_in_closed_form():
    light, heavy, stiffness = 2.0, 30.0, 4e5 * (1 + 0.1j)
    squared = OMEGA**2
    bodies = [
        Component([name], [name], -1 / (mass * squared)[:, np.newaxis, np.newaxis])
        for name, mass in (("light", light), ("heavy", heavy))
    ]
    mounted = couple(bodies, [Joint(["light"], ["heavy"], compliance=[[[1 / stiffness]]])])
    z_light, z_heavy = stiffness - light * squared, stiffness - heavy * squared
    determinant = z_light * z_heavy - stiffness**2
    truth = np.array([[z_heavy, stiffness + 0 * squared], [stiffness + 0 * squared, z_light]])
    assert deviation(mounted.receptance, np.moveaxis(truth / determinant, 2, 0)) < 1e-12


def rigid_block(mass, name, places):
    """Receptance of a rigid block at the three directions of several places."""
    body = mass_matrix(mass, np.diag([0.02, 0.03, 0.04]) * mass, [0.0, 0.0, 0.0])
    forward = np.vstack([forward_matrix(place) for place in places])
    inverse = forward @ np.linalg.inv(body) @ forward.T
    names = tuple(f"{name} {i}{axis}" for i in range(len(places)) for axis in "xyz")
    receptance = -inverse / (OMEGA**2)[:, np.newaxis, np.newaxis]
    return Component(names, names, receptance), forward, body


PLACES = [[0.1, 0.0, 0.02], [0.0, 0.12, 0.0], [-0.1, 0.0, -0.03]]


@pytest.fixture(scope="module")
def blocks():
    first, forward, first_mass = rigid_block(3.0, "A", PLACES)
    second, _, second_mass = rigid_block(8.0, "B", PLACES)
    joined = forward @ np.linalg.inv(first_mass + second_mass) @ forward.T
    return first, second, forward, -joined / (OMEGA**2)[:, np.newaxis, np.newaxis]


def test_many_channels_on_a_rigid_interface_are_refused_unreduced(blocks):
    first, second, _, _ = blocks
    with pytest.raises(InputError, match="reduce them by a virtual point or by singular vectors"):
        couple([first, second], [Joint(first.outputs, second.outputs)])


def test_a_virtual_point_joins_rigid_blocks(blocks):
    first, second, forward, truth = blocks
    inverse = np.linalg.pinv(forward)
    joint = Joint(
        first.outputs,
        second.outputs,
        compatibility=inverse[np.newaxis],
        equilibrium=inverse.T[np.newaxis],
    )
    assembly = couple([first, second], [joint])
    n = len(first.outputs)
    assert deviation(assembly.receptance[:, :n, :n], truth) < 1e-9


def test_singular_vectors_join_rigid_blocks(blocks):
    first, second, _, truth = blocks
    left, right = singular_vectors(first.receptance, 6)
    joint = Joint(first.outputs, second.outputs, compatibility=left, equilibrium=right)
    n = len(first.outputs)
    assembly = couple([first, second], [joint])
    assert deviation(assembly.receptance[:, :n, :n], truth) < 1e-9


@pytest.mark.parametrize(
    ("components", "joints", "message"),
    [
        ([], [], "at least one component"),
        ([("a", 3), ("b", 4)], [], "bring them on the same lines"),
        ([("a", 3), ("a", 3)], [], "name them apart"),
        ([("a", 3), ("b", 3)], [Joint(["a"], ["c"])], r"a joint names \['c'\]"),
        (
            [("a", 3), ("b", 3)],
            [Joint(["a"], ["b"], compliance=np.ones((2, 1, 1)))],
            "a joint has 2 lines and the components 3",
        ),
        (
            [("a", 3), ("b", 3)],
            [Joint(["a"], ["b"], equilibrium=np.ones((1, 1, 2)))],
            "2 forces for 1 conditions",
        ),
    ],
)
def test_bad_input_is_one_sentence(components, joints, message):
    bodies = [Component([name], [name], np.ones((n, 1, 1))) for name, n in components]
    with pytest.raises(InputError, match=message):
        couple(bodies, joints)


def test_bad_decoupling_is_one_sentence():
    body = Component(["a"], ["a"], np.ones((3, 1, 1)))
    with pytest.raises(InputError, match="the removed component does not have it"):
        decouple(body, Component(["b"], ["b"], np.ones((3, 1, 1))), ["a"])
    with pytest.raises(InputError, match="bring both on the same lines"):
        decouple(body, Component(["a"], ["a"], np.ones((4, 1, 1))), ["a"])
    with pytest.raises(InputError, match="as many lists of names as matrices"):
        assembled_stiffness([np.ones((3, 1, 1))], [])
    with pytest.raises(InputError, match="no 2 singular vectors"):
        singular_vectors(np.ones((3, 1, 1)), 2)


def test_the_example_of_the_docstring_holds():
    results = doctest.testmod(substructuring)
    assert results.attempted > 0
    assert results.failed == 0
