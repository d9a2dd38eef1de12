"""Part numbers, batches, pieces and hardness as the correlation that was stated."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.design_space import stiffness_factor_space
from deboom.explore.fronts import verification_response
from deboom.explore.known_truth import quad2
from deboom.explore.moments import ControlVariate
from deboom.explore.own_parts import OwnParts
from deboom.explore.part_numbers import PartNumber, part_structure
from deboom.explore.robust import RobustResponse, joined
from deboom.explore.tolerance_samples import cut_normal_moments, gaussian_sample, sobol_sample
from deboom.explore.tolerance_structure import averaged, beside, blended, independent

NAMES = tuple(f"{mount} {axis}" for mount in ("EnM", "GeM", "Du") for axis in "xz")
H, B = 0.6, 0.3
PARTS = (
    PartNumber("bush", ("EnM", "GeM"), 1, H, B),
    PartNumber("wishbone bush", ("Du",), 2, H, B),
)


def covariance(structure):
    return structure.loadings @ structure.loadings.T


def stated():
    """Correlation by hand: axes h, pieces of a batch b; left and right even out."""
    axes = np.array([[1.0, H], [H, 1.0]])
    two_places = np.array([[1.0, B], [B, 1.0]])
    found = np.zeros((6, 6))
    found[:4, :4] = np.kron(two_places, axes)
    found[4:, 4:] = (B + (1.0 - B) / 2.0) * axes
    return found


def test_covariance_is_that_of_the_hand_calculation():
    np.testing.assert_allclose(covariance(part_structure(NAMES, PARTS)), stated(), atol=1e-12)


def test_sample_covariance_is_the_stated_one_within_statistics():
    structure = part_structure(NAMES, PARTS)
    count = 40_000
    scatter = structure.scatter(gaussian_sample(structure.n_draws, count, seed=4).values)
    second = cut_normal_moments()[0]
    found = np.cov(scatter.T)
    wanted = second * stated()
    # variance of a sample covariance of normal data; cut draws scatter a little less
    error = np.sqrt((np.outer(np.diag(wanted), np.diag(wanted)) + wanted**2) / count)
    assert np.all(np.abs(found - wanted) < 4.0 * error)


class Linear:
    """One response, a sum of slopes times variables."""

    response_names = ("level",)
    response_unit = "dB"

    def __init__(self, slope):
        self.slope, self.variable_names = np.asarray(slope), NAMES

    def __call__(self, designs):
        """Return the response."""
        return (designs @ self.slope)[:, None]

    def gradient(self, designs):
        """Return its slopes."""
        return np.tile(self.slope, (len(designs), 1, 1))


def test_sigma_of_a_linear_response_is_the_closed_form():
    structure = part_structure(NAMES, PARTS)
    slope = np.array([1.0, -2.0, 0.5, 3.0, 2.0, -1.0])
    space = replace(stiffness_factor_space(NAMES), tolerance=np.linspace(0.06, 0.18, 6))
    robust = RobustResponse(
        Linear(slope),
        space,
        sobol_sample(structure.n_draws, 128, seed=1),
        structure=structure,
        estimator=ControlVariate(1),
    )
    design = np.linspace(0.8, 1.2, 6)
    pull = slope * design * space.relative_sigma
    exact = np.sqrt(cut_normal_moments()[0] * pull @ stated() @ pull)
    assert robust(design[None]).sigma_sum[0] == pytest.approx(exact, rel=1e-9)
    # the verification draws as many columns as the structure has
    check = verification_response(robust, 256, seed=1)
    assert check.sample.n_variables == structure.n_draws == robust.n_draws
    assert check(design[None]).sigma_sum[0] == pytest.approx(exact, rel=1e-9)


def test_parts_without_anything_in_common_are_independent():
    structure = part_structure(NAMES, ())
    assert structure.draw_names == NAMES
    np.testing.assert_array_equal(structure.loadings, np.eye(6))


def test_the_batch_of_a_single_piece_adds_no_draw():
    alone = part_structure(NAMES[:2], (PartNumber("bush", ("EnM",), 1, H, B),))
    assert alone.n_draws == 3
    np.testing.assert_allclose(covariance(alone), [[1.0, H], [H, 1.0]], atol=1e-12)


@pytest.mark.parametrize(("h", "b"), [(0.0, 1.0), (1.0, 0.0), (1.0, 1.0)])
def test_shares_at_their_ends(h, b):
    structure = part_structure(NAMES[:4], (PartNumber("bush", ("EnM", "GeM"), 1, h, b),))
    expected = np.kron([[1.0, b], [b, 1.0]], [[1.0, h], [h, 1.0]])
    np.testing.assert_allclose(covariance(structure), expected, atol=1e-12)


def test_what_a_worker_gets_gives_the_same_bits():
    structure = part_structure(NAMES, PARTS)
    space = stiffness_factor_space(NAMES)
    sample = sobol_sample(structure.n_draws, 32, seed=1)
    robust = RobustResponse(Linear(np.arange(1.0, 7.0)), space, sample, structure=structure)
    designs = np.random.default_rng(1).uniform(0.8, 1.2, (7, 6))
    sent = pickle.loads(pickle.dumps(robust))
    chunks = joined([sent(part) for part in np.array_split(designs, 3)])
    assert chunks.objectives.tobytes() == robust(designs).objectives.tobytes()


def test_vehicles_with_parts_of_their_own():
    model = quad2(2, seed=3)
    own = OwnParts(model)
    assert own.variable_names == ("y1 x1", "y1 x2", "y2 x1", "y2 x2")
    rng = np.random.default_rng(2)
    same = rng.uniform(0.8, 1.2, (5, 2))
    np.testing.assert_array_equal(own(np.hstack([same, same])), model(same))
    designs = rng.uniform(0.8, 1.2, (3, 4))
    gradient, step = own.gradient(designs), 1e-6
    for column in range(4):
        moved = designs.copy()
        moved[:, column] += step
        difference = (own(moved) - own(designs)) / step
        np.testing.assert_allclose(gradient[:, :, column], difference, atol=1e-5)
    space = own.widened(stiffness_factor_space(model.variable_names))
    assert space.names == own.variable_names
    assert space.tolerance.tolist() == [0.15] * 4


def test_one_number_in_two_vehicles_leaves_each_sigma_and_links_both():
    """Vehicles of one batch: sigmas as ever, their correlation times the batch's share."""
    model = quad2(2, seed=3)
    own, share = OwnParts(model), 0.7
    names = tuple(f"{v} M {a}" for v in ("y1", "y2") for a in ("x1", "x2"))
    number = PartNumber("bush", ("y1 M", "y2 M"), 1, 0.5, share)
    structure = replace(part_structure(names, (number,)), names=own.variable_names)
    tight = replace(stiffness_factor_space(model.variable_names), tolerance=np.full(2, 0.015))
    apart = RobustResponse(
        own,
        own.widened(tight),
        sobol_sample(structure.n_draws, 8192, seed=1),
        structure=structure,
    )
    single = replace(
        part_structure(("M x1", "M x2"), (), hardness_share=0.5), names=model.variable_names
    )
    same = RobustResponse(
        model, tight, sobol_sample(single.n_draws, 8192, seed=1), structure=single
    )
    design = np.array([0.9, 1.1])
    both = np.tile(design, 2)
    np.testing.assert_allclose(apart(both[None]).sigma, same(design[None]).sigma, rtol=0.01)
    linked, whole = (
        np.corrcoef(values.T)[0, 1] for values in (own(apart.made(both)), model(same.made(design)))
    )
    assert abs(whole) > 0.1
    assert linked == pytest.approx(share * whole, abs=0.02)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: PartNumber("a", ()), "name every place once"),
        (lambda: PartNumber("a", ("EnM", "EnM")), "name every place once"),
        (lambda: PartNumber("a", ("EnM",), 0), "0 pieces"),
        (lambda: PartNumber("a", ("EnM",), 1, 1.2), "hardness share of 1.2"),
        (lambda: PartNumber("a", ("EnM",), 1, 0.5, -0.1), "batch share of -0.1"),
        (lambda: part_structure(NAMES, (PartNumber("a", ("TSM",)),)), "sits at 'TSM', which no"),
        (
            lambda: part_structure(NAMES, (PartNumber("a", ("Du",)), PartNumber("b", ("Du",)))),
            "takes the part numbers 'a' and 'b': give it one",
        ),
        (lambda: blended([]), "sum to 1"),
        (lambda: blended([(0.5, independent(NAMES))]), "sum to 1"),
        (lambda: blended([(0.5, independent("a")), (0.5, independent("b"))]), "same variables"),
        (lambda: beside([independent("a"), independent("a")]), "variables of their own"),
        (lambda: averaged(independent("ab"), {"x": ()}), "'x' has no pieces"),
        (lambda: averaged(independent("ab"), {"x": ("c",)}), r"unknown ones \['c'\]"),
    ],
)
def test_what_cannot_be_made_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()
