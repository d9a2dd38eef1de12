import numpy as np
import pytest

from deboom.errors import InputError
from deboom.physics.transfer_path import (
    assembled_frf,
    blocked_force,
    blocked_force_on_rig,
    contributions,
    energy_share,
    interface_force,
    mount_force,
    mounted_source,
    partial_sums,
    rms_contribution,
)

BODY = np.broadcast_to(np.diag([2.0, 4.0]), (5, 2, 2))


@pytest.mark.parametrize(
    ("ntf", "force"),
    [((4, 2), (4, 3)), ((4, 2), (5, 2)), ((4,), (4,)), ((4, 1, 2), (4, 1, 2)), ((4, 2, 3), (4, 2))],
)
def test_paths_that_do_not_belong_together_are_refused(ntf, force):
    with pytest.raises(InputError, match="of the paths: shape"):
        contributions(np.ones(ntf), np.ones(force))


@pytest.mark.parametrize(
    "groups", [[[0, 1]], [[0, 1], [1, 2]], [[0, 1], [2, 3]], [[0], [1, 2, -1]]]
)
def test_groups_hold_every_path_once(groups):
    with pytest.raises(InputError, match="paths 0 to 2 exactly once"):
        partial_sums(np.ones((4, 3)), groups)


@pytest.mark.parametrize(
    "call",
    [
        lambda: mounted_source(np.ones((5, 2)), np.ones((5, 2))),
        lambda: mounted_source(BODY, np.ones((5, 3))),
        lambda: interface_force(np.ones((5, 2, 3)), BODY, np.ones((5, 2))),
        lambda: interface_force(BODY, BODY[:4], np.ones((5, 2))),
        lambda: interface_force(BODY, BODY, np.ones((5, 3))),
        lambda: blocked_force(BODY, np.ones(5)),
        lambda: blocked_force_on_rig(BODY, np.ones((4, 2)), np.ones((5, 2))),
        lambda: assembled_frf(BODY[:, :, :1], BODY, BODY, BODY),
        lambda: assembled_frf(BODY, BODY, BODY, BODY[:, :1]),
    ],
)
def test_shapes_that_do_not_belong_together_are_refused(call):
    with pytest.raises(InputError, match="shape"):
        call()


def test_a_mount_without_stiffness_is_refused():
    with pytest.raises(InputError, match="carries no force"):
        mounted_source(BODY, np.zeros((5, 2)))


@pytest.mark.parametrize(
    ("stiffness", "above", "below"),
    [((4, 2), (4, 2), (4, 3)), ((4, 3), (4, 2), (4, 2)), ((4, 2, 3), (4, 2), (4, 2)), ((2,),) * 3],
)
def test_mounts_and_motions_that_do_not_belong_together_are_refused(stiffness, above, below):
    with pytest.raises(InputError, match="shape"):
        mount_force(np.ones(stiffness), np.ones(above), np.ones(below))


def test_mounts_may_couple_paths():
    stiffness = np.array([[[2.0, 1j], [1j, 3.0]]])
    force = mount_force(stiffness, [[2.0, 1.0]], [[1.0, 0.0]])
    np.testing.assert_allclose(force, [[2 + 1j, 3 + 1j]])


@pytest.mark.parametrize("ask", [energy_share, rms_contribution])
@pytest.mark.parametrize(("shape", "weight"), [((4, 2), (3,)), ((4,), (4,))])
def test_weights_that_do_not_belong_to_the_lines_are_refused(ask, shape, weight):
    with pytest.raises(InputError, match="shape"):
        ask(np.ones(shape), np.ones(weight))


def test_silence_has_no_energy_to_share():
    with pytest.raises(InputError, match="no energy to share"):
        energy_share([[1.0, -1.0]])
