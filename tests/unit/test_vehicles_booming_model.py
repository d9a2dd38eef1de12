"""The booming model: the same promises under every motion, and what designs and data it refuses."""

from __future__ import annotations

import pickle
from dataclasses import dataclass, replace

import numpy as np
import pytest

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf, LoadCase, Spectrum
from deboom.mounts.mount import Mount
from deboom.physics.sound_level import spl
from deboom.vehicles.booming_model import (
    BoomingModel,
    CatalogueModel,
    Motion,
    booming_model,
    checked_designs,
)
from deboom.vehicles.design_factor import Factor
from deboom.vehicles.fleet import Fleet, PathContributions, Vehicle, path_contributions
from deboom.vehicles.powertrain import Powertrain
from samples import drawn_cars

SHAPE = drawn_cars.Shape("small", 4, 3, 41, 3, 2, 4)
DESIGNS = drawn_cars.designs(SHAPE)
CASES = {
    motion: tuple(
        problem(SHAPE, seed)  # type: ignore[call-arg]
        for seed in (1, 2)
    )
    for motion, problem in drawn_cars.PROBLEMS.items()
}
PRESCRIBED, COUPLED, SOFTENING = (cases[0] for cases in CASES.values())
MOTIONS = pytest.mark.parametrize("motion", list(Motion))


def both(motion, compiled=False):
    first, second = CASES[motion]
    return BoomingModel((replace(first, load_case="g5"), second), (1.0, 3.0), compiled=compiled)


def model_of(case, **options):
    """One load case in numpy: the compiled loops have tests of their own, each shape compiles."""
    return BoomingModel((case,), (1.0,), compiled=False, **options)


@dataclass(frozen=True)
class Tilted:
    """A factor that also changes what it scales, line by line."""

    def __call__(self, designs: RealArray) -> RealArray:
        """Tilt by up to a tenth of the change."""
        slope = np.linspace(-0.1, 0.1, 41)[:, np.newaxis] * (1 + 0.2j)
        return 1 + slope * (designs[:, np.newaxis, SOFTENING.variables] - 1)

    def clipped(self, designs: RealArray) -> RealArray:
        """Ten lines of one direction."""
        beyond = np.zeros((len(designs), 41, 11), dtype=bool)
        beyond[:, :10, 6] = True
        return beyond


TILTED = replace(SOFTENING, ratio=Tilted())


@MOTIONS
def test_splv_is_the_weighted_sum_of_the_levels_of_the_lines(motion):
    model = both(motion)
    levels = [model.levels(DESIGNS, case).sum(axis=-1) for case in ("g5", "drawn 2")]
    expected = 0.25 * levels[0] + 0.75 * levels[1]
    np.testing.assert_allclose(model(DESIGNS), expected, rtol=0, atol=1e-9)
    np.testing.assert_allclose(model.design_space().upper, 1.2)
    np.testing.assert_array_equal(model.levels(DESIGNS), model.levels(DESIGNS, "g5"))
    heard = spl(model.pressure(DESIGNS), model.frequency, axis=-1)
    np.testing.assert_array_equal(heard, model.levels(DESIGNS))
    carried = pickle.loads(pickle.dumps(model))
    np.testing.assert_array_equal(carried(DESIGNS), model(DESIGNS))
    assert (model.weights, model.motion) == ((0.25, 0.75), motion)
    assert model.factor is Factor.dynamic


def test_a_load_case_of_weight_zero_takes_no_part():
    values = np.zeros_like(PRESCRIBED.values)
    silent = replace(PRESCRIBED, values=values)
    model = BoomingModel((silent, PRESCRIBED), (0.0, 2.0), compiled=False)
    assert model.weights == (1.0,)
    alone = model_of(PRESCRIBED)
    np.testing.assert_array_equal(model(DESIGNS), alone(DESIGNS))


def test_a_silenced_line_is_not_finite_for_that_design_only():
    values = np.ones((1, 2, 2), dtype=complex)
    values[0, 1, 1] = -1.0
    case = PathContributions("g5", np.array([20.0, 21.0]), values, ("A",), ("x", "y"))
    model = model_of(case)
    designs = np.array([[1.0, 1.0], [1.0, 0.5]])
    assert np.isneginf(model(designs)[0, 0])
    assert np.isfinite(model(designs)[1, 0])
    assert np.isnan(model.gradient(designs)[0]).all()
    assert np.isfinite(model.gradient(designs)[1]).all()


def test_the_gradient_with_amplitudes_agrees_with_differences_of_the_model():
    model = model_of(SOFTENING)
    design = DESIGNS[:1]
    gradient = model.gradient(design)[0]
    for k in (0, 9):
        moved = np.vstack([design, design])
        moved[:, k] += (-5e-3, 5e-3)
        low, high = model(moved)
        assert gradient[:, k] == pytest.approx((high - low) / 1e-2, rel=0.05, abs=0.5)


def test_amplitudes_without_rest_are_no_result():
    """A stiffness that falls ever more with the amplitude throws the motion about."""
    few = drawn_cars.amplitude_problem(replace(SHAPE, n_lines=9))
    cubic = np.zeros_like(few.cubic)
    cubic[..., 0], cubic[..., 3] = 41.0, -40.0
    wild = replace(few, cubic=cubic, highest=np.full(few.highest.shape, np.inf))
    with np.errstate(invalid="ignore"):
        assert np.isnan(model_of(wild)(DESIGNS[:2])).any()


def test_counts_where_designs_leave_the_measurements():
    narrow = replace(TILTED, highest=np.ones(SOFTENING.highest.shape))
    model = model_of(narrow)
    amplitude, preload = model.clipped(DESIGNS)
    assert 0.1 < amplitude < 0.9
    assert preload == pytest.approx(10 / 41 / 11)
    assert model.factor is Factor.part
    still = replace(SOFTENING, cubic=np.broadcast_to([1.0, 0, 0, 0], SOFTENING.cubic.shape))
    for case in (still, COUPLED, PRESCRIBED):
        free = model_of(case)
        assert free.motion is not Motion.amplitude
        assert free.clipped(DESIGNS) == (0.0, 0.0)


SHIFTED = replace(PRESCRIBED, load_case="g7", frequency=PRESCRIBED.frequency + 0.5)
RENAMED = replace(PRESCRIBED, load_case="g7", vehicle_names=("a", "b", "c"))


@pytest.mark.parametrize(
    ("cases", "weights", "message"),
    [
        ((PRESCRIBED,), (1.0, 2.0), r"\[1.0, 2.0\] of the load cases \['drawn 1'\]: give each"),
        (CASES[Motion.prescribed], (1.0, -1.0), r"\[1.0, -1.0\] .* of at least 0"),
        ((PRESCRIBED,), (np.nan,), r"\[nan\] of"),
        (CASES[Motion.prescribed], (0.0, 0.0), "at least one above 0"),
        ((), (), r"\[\] of the load cases \[\]"),
        ((PRESCRIBED, SHIFTED), (1.0, 1.0), "drawn 1 and g7 differ"),
        ((PRESCRIBED, RENAMED), (1.0, 1.0), "drawn 1 and g7 differ"),
    ],
)
def test_refuses_weights_and_load_cases_that_do_not_fit(cases, weights, message):
    with pytest.raises(InputError, match=message):
        BoomingModel(cases, weights)


def test_refuses_a_line_to_which_nothing_contributes():
    values = PRESCRIBED.values.copy()
    values[1, 4] = 0.0
    bodies = []
    for body in COUPLED.bodies:
        transfer = body.transfer.copy()
        transfer[1, 4] = 0.0
        bodies.append(replace(body, transfer=transfer))
    silent = (replace(PRESCRIBED, values=values), replace(COUPLED, bodies=tuple(bodies)))
    for case in silent:
        with pytest.raises(InputError, match=r"drawn 1: no path .* vehicle 1 at 24 Hz"):
            model_of(case)


@pytest.mark.parametrize(
    ("designs", "message"),
    [
        (np.ones(12), r"designs of shape \(12,\).*12 columns \['m0 x', 'm0 y'"),
        (np.ones((3, 1)), r"designs of shape \(3, 1\)"),
        (np.where(np.eye(12) > 0, np.nan, 1.0)[1:2], "design 0: m0 y is nan"),
        (np.where(np.eye(12) > 0, np.inf, 1.0), "design 0: m0 x is inf"),
    ],
)
def test_designs_and_the_name_of_a_load_case_are_checked(designs, message):
    model = both(Motion.coupled)
    for evaluate in (model, model.levels, model.pressure, model.gradient):
        with pytest.raises(InputError, match=message):
            evaluate(designs)
    with pytest.raises(InputError, match=message):
        checked_designs(designs, model.variable_names)
    with pytest.raises(InputError, match=r"no load case 'g9' in the index: use one of \['g5'"):
        model.levels(DESIGNS, "g9")


# a small measured platform

RNG = np.random.default_rng(5)
FREQUENCY = np.arange(20.0, 41.0)
MOUNTS = (
    Mount("A", "", ("",), ((0.0, 0.4, 0.2),), ("x", "y", "z")),
    Mount("B", "", ("left", "right"), ((0.1, -0.4, 0.2), (0.1, 0.4, 0.2)), ("x",)),
)
CHANNELS = tuple(name for mount in MOUNTS for axis in "xyz" for name in mount.channels(axis))
PATHS = tuple(path for mount in MOUNTS for path in mount.paths)
BAND = (20.0, 40.0)


def drawn(*shape):
    return RNG.normal(size=shape) + 1j * RNG.normal(size=shape)


DISPLACEMENT = drawn(FREQUENCY.size, len(CHANNELS)) * 1e-4
STIFFNESS = (1.0 + RNG.random((FREQUENCY.size, len(CHANNELS)))) * (1e5 + 2e4j)
FLEET = Fleet(
    tuple(
        Vehicle(name, "G", Frf(FREQUENCY, drawn(21, 1, len(PATHS)), ("ear",), PATHS, "Pa/N"))
        for name in ("one", "two")
    )
)
FACTORS = 0.8 + 0.4 * RNG.random((5, 12))  # six of stiffness, six of loss


def load_case(stiffness=STIFFNESS, displacement=DISPLACEMENT):
    return LoadCase(
        "run",
        "",
        5,
        4.0,
        220.0,
        1.5,
        Spectrum(FREQUENCY, displacement, CHANNELS, "m"),
        Spectrum(FREQUENCY, stiffness * displacement, CHANNELS, "N"),
    )


def measured(stiffness=STIFFNESS, **options):
    model = booming_model(FLEET, MOUNTS, [(load_case(stiffness), 1.0)], BAND, **options)
    return replace(model, compiled=False)


def test_options_that_do_not_go_together_are_refused():
    with pytest.raises(InputError, match="loss factors are variables with prescribed or coupled"):
        measured(motion=Motion.amplitude, loss_factors=True)
    with pytest.raises(InputError, match="mass and inertia of the powertrain"):
        measured(motion=Motion.coupled)
    with pytest.raises(InputError, match="take coupled or amplitude motion"):
        measured(settling=object())
    with pytest.raises(InputError, match="% of the motion of the powertrain's mounts is not"):
        measured(motion=Motion.coupled, powertrain=Powertrain(200.0, np.eye(3)))


# loss factors


def coupled_losses(motion=COUPLED):
    return model_of(motion.with_loss_factors(), loss_factors=True)


def test_without_a_change_of_losses_it_is_the_model_without_them():
    stiffness = FACTORS[:, :6]
    unchanged = np.hstack([stiffness, np.ones_like(stiffness)])
    levels = measured(loss_factors=True)(unchanged)
    np.testing.assert_allclose(levels, measured()(stiffness), atol=1e-9)
    exact = model_of(COUPLED)
    unchanged = np.hstack([DESIGNS, np.ones_like(DESIGNS)])
    np.testing.assert_allclose(coupled_losses()(unchanged), exact(DESIGNS), atol=1e-9)


def test_a_loss_factor_multiplies_the_imaginary_part_of_its_direction_alone():
    """Mount A in z, measured with 1.2 times its K'': the loss factor 1.2 says the same."""
    lossier = STIFFNESS.copy()
    column = CHANNELS.index("A z")
    lossier[:, column] = STIFFNESS[:, column].real + 1.2j * STIFFNESS[:, column].imag
    model, design = measured(loss_factors=True), np.ones((1, 12))
    design[0, model.variable_names.index("A z loss")] = 1.2
    other = measured(lossier, loss_factors=True)
    np.testing.assert_allclose(model(design), other(np.ones((1, 12))), atol=1e-9)
    stiffness = COUPLED.stiffness.real + 1.3j * COUPLED.stiffness.imag
    ones = np.ones((1, 12))
    levels = coupled_losses()(np.hstack([ones, 1.3 * ones]))
    lossier = model_of(COUPLED.with_stiffness(stiffness))
    np.testing.assert_allclose(levels, lossier(ones), atol=1e-9)


def test_levels_and_gradient_of_losses_are_those_of_the_model():
    designs = np.hstack([DESIGNS, DESIGNS[::-1]])
    for model, rows in ((measured(loss_factors=True), FACTORS), (coupled_losses(), designs)):
        np.testing.assert_allclose(model(rows), model.levels(rows).sum(axis=-1), atol=1e-9)
        step = 1e-5 * np.eye(rows.shape[1])
        slopes = (model(rows[:1] + step) - model(rows[:1] - step)) / 2e-5
        gradient = model.gradient(rows[:1])[0]
        np.testing.assert_allclose(gradient, slopes.T, rtol=1e-4, atol=1e-4 * np.abs(slopes).max())
    names = measured(loss_factors=True).variable_names
    assert (names[:2], names[6:8]) == (("A x", "A y"), ("A x loss", "A y loss"))


def test_a_direction_at_rest_has_no_loss_factor():
    still = DISPLACEMENT.copy()
    still[3, 0] = 0.0
    with pytest.raises(InputError, match="displacement"):
        path_contributions(FLEET, MOUNTS, load_case(displacement=still), BAND, loss_factors=True)


# parts of a catalogue

TRIO = tuple(Mount(name, "", ("",), ((0.0, 0.0, 0.0),), ("x", "y", "z")) for name in "ABC")
NAMES = tuple(name for mount in TRIO for name in mount.variables)
VALUES = drawn(3, 2, 21, 9)
N_PARTS = (3, 2, 3)


def with_values(values):
    return model_of(PathContributions("run", FREQUENCY, values, ("one", "two"), NAMES))


def catalogue():
    return CatalogueModel(TRIO, tuple(with_values(values) for values in VALUES), N_PARTS)


def test_a_set_is_the_model_of_its_parts():
    model = catalogue()
    sets = np.array([[0, 0, 0], [2, 1, 0], [1, 0, 2], [2, 1, 0]], dtype=float)
    factors = 0.8 + 0.4 * RNG.random((4, 9))
    sums = model(np.hstack([sets, factors]))
    for row, numbers, design in zip(sums, sets.astype(int), factors, strict=True):
        columns = [VALUES[number][:, :, 3 * m : 3 * m + 3] for m, number in enumerate(numbers)]
        alone = with_values(np.concatenate(columns, axis=2))
        np.testing.assert_array_equal(row, alone(design[None])[0])
    levels = model.levels(np.hstack([sets, factors]))
    assert levels.shape == (4, 2, model.frequency.size)
    np.testing.assert_allclose(levels.sum(axis=-1), sums, rtol=1e-12)
    carried = pickle.loads(pickle.dumps(model))
    np.testing.assert_array_equal(carried(np.hstack([sets, factors])), sums)
    assert model.variable_names == ("A part", "B part", "C part", *NAMES)
    assert (model.response_names, model.n_lines) == (("one", "two"), 21)


def test_coupled_sets_have_their_stiffness_and_todays_load():
    stiffer = COUPLED.with_stiffness(1.3 * COUPLED.stiffness)
    louder = replace(stiffer, bodies=tuple(replace(b, load=2.0 * b.load) for b in stiffer.bodies))
    part = np.zeros(len(COUPLED.variable_names), dtype=np.intp)
    part[:6] = 1
    mixed = COUPLED.with_parts([COUPLED, louder], part)
    np.testing.assert_array_equal(mixed.bodies[0].load, COUPLED.bodies[0].load)
    levels = model_of(mixed)(np.ones((1, part.size)))
    scaled = np.where(part == 1, 1.3, 1.0)[np.newaxis]
    np.testing.assert_allclose(levels, model_of(COUPLED)(scaled), atol=1e-9)


@pytest.mark.parametrize(
    ("parts", "sentence"), [([0, 2, 0], "no set of parts"), ([0.5, 0, 0], "part numbers are whole")]
)
def test_numbers_of_no_part_are_refused(parts, sentence):
    with pytest.raises(InputError, match=sentence):
        catalogue()(np.array([[*parts, *np.ones(9)]]))
