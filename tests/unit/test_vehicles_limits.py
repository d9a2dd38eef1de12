"""Quantities that limits are stated for, against the model, differences and closed forms."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from deboom.arrays import derivatives
from deboom.errors import InputError
from deboom.files.platform import read_platform
from deboom.measurement.campaign import StaticCurve
from deboom.mounts.mount import Mount
from deboom.physics.rigid_body import mount_stiffness_matrix, rigid_body_modes
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.design_factor import Factor
from deboom.vehicles.idle import IdleRun
from deboom.vehicles.limits import (
    GRAVITY,
    MeanLevel,
    MountRequirements,
    NaturalFrequencies,
    OperatingStiffness,
    PeakLevel,
    ScatteredLevel,
    TorqueTravel,
    WeightSag,
    mount_price,
)
from deboom.vehicles.powertrain import KinematicModel, Powertrain

PLATFORM = Path(__file__).parents[2] / "studies" / "data" / "u06_f39_f45"
BAND = (25.0, 40.0)


@pytest.fixture(scope="module")
def runs():
    cases = ["g5_wot220", "g6_wot160=0.5"]
    platform = read_platform(PLATFORM)
    return platform.runs(cases, fleet=platform.fleet.group("F39"), mounts="spectra")


@pytest.fixture(scope="module", params=[Motion.prescribed, Motion.coupled])
def index(request, runs):
    return runs.model(request.param)


def designs(index, count):
    return np.random.default_rng(1).uniform(0.8, 1.2, (count, len(index.variable_names)))


def differences(response, rows):
    steps = 1e-6 * np.eye(rows.shape[1])
    return np.stack(
        [(response(rows + step) - response(rows - step)) / 2e-6 for step in steps], axis=-1
    )


def test_the_peak_is_the_loudest_line_of_all_load_cases(index):
    rows = designs(index, 7)
    inside = (index.frequency >= BAND[0]) & (index.frequency <= BAND[1])
    levels = [index.levels(rows, name)[:, :, inside] for name in index.load_case_names]
    expected = np.maximum(*(level.max(axis=-1) for level in levels))
    assert PeakLevel(index, BAND)(rows) == pytest.approx(expected, abs=1e-10)


def test_a_peak_has_the_derivative_of_its_line(index):
    peak, rows = PeakLevel(index, BAND), designs(index, 3)
    assert peak.gradient(rows) == pytest.approx(differences(peak, rows), abs=1e-5)


def test_the_mean_level_is_splv_over_the_lines(index):
    mean, rows = MeanLevel(index), designs(index, 3)
    assert mean(rows) == pytest.approx(index(rows) / 161, rel=1e-14)
    assert mean.gradient(rows) == pytest.approx(differences(mean, rows), abs=1e-5)
    assert mean.response_unit == "dB(A)"
    levels, pull_back = mean.linearised(rows)
    assert levels == pytest.approx(mean(rows), rel=1e-12)
    weights = np.random.default_rng(4).random((2, *levels.shape))
    expected = np.einsum("onv,nvk->onk", weights, mean.gradient(rows))
    assert pull_back(weights) == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_scatter_adds_its_mean_energy_to_each_line(index):
    # prescribed motion is linear in the stiffness, so that its scatter may be large
    size = 0.2 if index.motion is Motion.prescribed else 0.02
    today, sigma = np.ones(len(index.variable_names)), np.full(len(index.variable_names), size)
    level = ScatteredLevel(index, today, sigma)
    draws = np.random.default_rng(2).standard_normal((1000, today.size))
    expected = np.zeros(len(index.response_names))
    for name, weight in zip(index.load_case_names, index.weights, strict=True):
        energy = np.mean(10.0 ** (index.levels(1.0 + sigma * draws, name) / 10.0), axis=0)
        expected += weight * 10.0 * np.log10(energy).mean(axis=-1)
    assert level(today[np.newaxis])[0] == pytest.approx(expected, abs=0.04)
    nothing = ScatteredLevel(index, today, 0.0 * sigma)
    rows = designs(index, 3)
    assert nothing(rows) == pytest.approx(MeanLevel(index)(rows), abs=1e-9)
    assert level.gradient(rows) == pytest.approx(differences(level, rows), abs=1e-5)


def test_a_band_without_lines_is_refused(index):
    with pytest.raises(InputError, match="no line between 70 and 80 Hz"):
        PeakLevel(index, (70.0, 80.0))(np.ones((1, 12)))


def test_a_motion_that_follows_the_amplitude_is_refused():
    platform = read_platform(PLATFORM)
    runs = platform.runs(fleet=platform.fleet.group("F39"))
    follows = runs.model(Motion.amplitude)
    with pytest.raises(InputError, match="prescribed or coupled motion"):
        PeakLevel(follows, BAND)(np.ones((1, 12)))
    with pytest.raises(InputError, match="levels with scatter need prescribed"):
        ScatteredLevel(follows, np.ones(12), np.zeros(12))(np.ones((1, 12)))


POSITIONS = {"E": (0.0, 0.5, 0.0), "G": (0.0, -0.5, 0.0), "S": (0.3, 0.0, 0.0)}
MOUNTS = tuple(Mount(name, "", ("",), (r,), ("x", "y", "z")) for name, r in POSITIONS.items())
NAMES = tuple(name for mount in MOUNTS for name in mount.variables)
REACH = np.linspace(-20e-3, 20e-3, 401)
POWERTRAIN = Powertrain(200.0, np.diag([10.0, 8.0, 12.0]))


def model(cubic=0.0):
    """Springs of 100 kN/m with a stop that stiffens them."""
    force = 1e5 * REACH + cubic * REACH**3
    curves = {n: StaticCurve(*n.split(" "), "M1", REACH, force, 0.03) for n in NAMES}
    return KinematicModel(MOUNTS, curves)


def of(*quantities, names=NAMES):
    return MountRequirements(names, quantities)


def test_sag_is_the_share_of_the_weight_over_the_stiffness():
    """E and G carry all: the centre of gravity is on the line between them."""
    sag = of(WeightSag(model(), POWERTRAIN, ("E", "G", "S")))
    design = np.ones((2, 9))
    design[1, [2, 5]] = 0.8, 1.25
    carried = 200.0 * GRAVITY / 2
    expected = 1e3 * carried / 1e5 * np.array([[1, 1], [1 / 0.8, 1 / 1.25]])
    np.testing.assert_allclose(sag(design)[:, :2], expected, rtol=1e-9)
    assert sag.response_names == ("E sag", "G sag", "S sag")


def test_a_mount_sinks_downwards_however_it_stands():
    """Springs alike along all three axes are the same springs in any position."""
    turned = tuple(replace(mount, rotations=((0.3, -0.5, 0.4),)) for mount in MOUNTS)
    upright = model()
    sag = of(WeightSag(KinematicModel(turned, upright.curves), POWERTRAIN, ("E", "G")))
    expected = 1e3 * 200.0 * GRAVITY / 2 / 1e5
    np.testing.assert_allclose(sag(np.ones((1, 9))), [[expected] * 2], rtol=1e-9)


def test_travel_at_nominal_is_that_of_the_kinematic_model():
    modelled = model(cubic=5e9)
    travel = of(TorqueTravel(modelled, 900.0, modelled.names))
    expected = 1e3 * modelled.equilibrium(900.0)
    np.testing.assert_allclose(travel(np.ones((1, 9))), expected, atol=1e-9)


def test_derivatives_of_sag_and_travel_are_those_of_closed_forms():
    """Two springs of 100 kN/m halve a weight: sag 1/x; a common dynamic factor x divides travel."""
    with_loss = (*NAMES, "E x loss")
    modelled = model(cubic=5e9)
    sag = WeightSag(model(), POWERTRAIN, ("E", "G"))
    travel = TorqueTravel(modelled, 900.0, modelled.names)
    requirements = of(sag, travel, names=with_loss)
    designs = np.vstack([np.ones(10), np.r_[np.full(9, 0.8), 1.1]])
    values, gradient = requirements(designs), requirements.gradient(designs)
    assert gradient.shape == (2, 2 + 9, 10)
    np.testing.assert_allclose(gradient[:, 0, 2], -values[:, 0] / designs[:, 2], rtol=1e-12)
    np.testing.assert_allclose(gradient[:, 0, 5], 0.0, atol=1e-12)
    along = (gradient[..., :9] * designs[:, np.newaxis, :9]).sum(axis=-1)
    np.testing.assert_allclose(along, -values, rtol=1e-9, atol=1e-9)
    assert not gradient[..., 9].any()


@pytest.mark.parametrize("factor", list(Factor))
def test_derivatives_of_all_quantities_are_those_of_differences(factor):
    """Two pieces share the factors of one mount, another one is tilted, one direction is fixed."""
    pair = Mount("E", "", ("left", "right"), ((0.0, 0.5, 0.1), (0.0, 0.4, -0.2)), ("x", "y", "z"))
    tilted = replace(MOUNTS[2], rotations=((0.1, 0.4, -0.3),))
    mounts = (pair, MOUNTS[1], tilted)
    stiff = {name: 1e5 * (1.0 + 0.2 * k) for k, name in enumerate(NAMES)}
    # four points: no step of a difference leaves the cubic between two of them
    reach = np.linspace(-20e-3, 20e-3, 4)
    curves = {
        name: StaticCurve(*name.split(" "), "M1", reach, k * (reach + 2e3 * reach**3), 0.03)
        for name, k in stiff.items()
    }
    modelled = KinematicModel(mounts, curves)
    requirements = MountRequirements(
        (*NAMES[:-1], "E x loss"),
        (
            WeightSag(modelled, POWERTRAIN, ("E left", "G", "S")),
            TorqueTravel(modelled, 900.0, modelled.names, factor),
            NaturalFrequencies(mounts, POWERTRAIN, stiff),
            OperatingStiffness(stiff, {"E z": ["E z"], "all z": ["E z", "E z", "G z", "S z"]}),
        ),
    )
    rows = np.random.default_rng(3).uniform(0.8, 1.2, (3, len(NAMES)))
    values, gradient = requirements(rows), requirements.gradient(rows)
    expected = np.stack([derivatives(requirements, row, 3e-4).T for row in rows])
    size = np.abs(values).max(axis=0)[:, np.newaxis]
    np.testing.assert_allclose(gradient / size, expected / size, atol=1e-8)
    assert np.abs(gradient[..., :-1]).max(axis=(0, 2)).min() > 0.0
    assert not gradient[..., -1].any()
    np.testing.assert_array_equal(requirements.gradient(rows[1:2])[0], gradient[1])


def test_beyond_a_measured_curve_a_travel_has_no_derivative():
    modelled = model()
    travel = of(TorqueTravel(modelled, 9e4, modelled.names))
    assert np.isnan(travel(np.ones((1, 9)))).all()
    assert np.isnan(travel.gradient(np.ones((1, 9)))).all()


def test_a_common_dynamic_factor_divides_the_travel_and_a_part_rides_into_its_stop():
    modelled = model(cubic=5e9)
    today, soft = np.ones((1, 9)), np.full((1, 9), 0.8)
    dynamic = of(TorqueTravel(modelled, 900.0, modelled.names))
    np.testing.assert_allclose(dynamic(soft), dynamic(today) / 0.8, atol=1e-9)
    part = of(TorqueTravel(modelled, 900.0, modelled.names, Factor.part))
    scaled = modelled.deflections([900.0], soft)[0]
    np.testing.assert_allclose(part(soft), 1e3 * scaled, atol=1e-9)
    place = modelled.names.index("S z")
    assert abs(part(soft)[0, place]) < abs(dynamic(soft)[0, place])


def test_natural_frequencies_are_those_of_the_rigid_body():
    stiffness = dict(zip(NAMES, 1e5 * np.arange(1.0, 10.0), strict=True))
    modes = of(NaturalFrequencies(MOUNTS, POWERTRAIN, stiffness))
    design = 0.8 + 0.4 * np.random.default_rng(1).random((4, 9))
    for row, frequencies in zip(design, modes(design), strict=True):
        matrix = mount_stiffness_matrix(list(POSITIONS.values()), row * list(stiffness.values()))
        expected, _ = rigid_body_modes(POWERTRAIN.mass_matrix, matrix)
        np.testing.assert_allclose(frequencies, expected, rtol=1e-12)
    np.testing.assert_allclose(modes(4 * design), 2 * modes(design), rtol=1e-12)


def test_stiffness_of_a_variable_and_of_a_sum():
    stiffness = dict.fromkeys(NAMES, 2e5)
    sums = {"E z": ["E z"], "z": ["E z", "G z", "S z"]}
    values = of(OperatingStiffness(stiffness, sums))(np.array([np.full(9, 1.1)]))
    np.testing.assert_allclose(values, [[220.0, 660.0]])


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: of(WeightSag(model(), POWERTRAIN, ("Q",)))(np.ones((1, 9))), "no direction 'Q z'"),
        (lambda: of(TorqueTravel(model(), 1.0, ("E w",)))(np.ones((1, 9))), "no direction 'E w'"),
        (lambda: NaturalFrequencies(MOUNTS, POWERTRAIN, {}, (1,)), "need the stiffness of E x"),
        (
            lambda: NaturalFrequencies(MOUNTS, POWERTRAIN, dict.fromkeys(NAMES, 1.0), (7,)),
            "modes 1 to 6",
        ),
        (lambda: OperatingStiffness({"E z": 1.0}, {"a": ["G z"]}), "no measured stiffness of G z"),
        (lambda: of(WeightSag(model(), POWERTRAIN, ("E",)))(np.zeros((1, 9))), "carries nothing"),
    ],
)
def test_what_does_not_exist_is_refused(make, sentence):
    with pytest.raises(InputError, match=sentence):
        make()


POSITIONS = {"E": (0.0, 0.5, 0.0), "G": (0.0, -0.5, 0.0), "S": (0.3, 0.0, 0.0)}
MOUNTS = tuple(Mount(name, "", ("",), (at,), ("x", "y", "z")) for name, at in POSITIONS.items())
REACH = np.linspace(-20e-3, 20e-3, 41)
"""Three springs of 100 kN/m that were measured over 20 mm either way."""


def three_springs():
    curves = {
        name: StaticCurve(*name.split(" "), "M1", REACH, 1e5 * REACH, 0.03)
        for mount in MOUNTS
        for name in mount.variables
    }
    return KinematicModel(MOUNTS, curves), tuple(curves)


def test_a_centre_of_gravity_beside_the_mounts_loads_the_nearer():
    """A third of the way from E and G to S: S carries a third of the weight."""
    model, names = three_springs()
    engine = Powertrain(200.0, np.diag([10.0, 8.0, 12.0]), (0.1, 0.0, 0.0))
    sag = MountRequirements(names, (WeightSag(model, engine, ("E", "G", "S")),))
    weight = 200.0 * GRAVITY
    expected = 1e3 * weight / 3 / 1e5
    np.testing.assert_allclose(sag(np.ones((1, 9))), [[expected] * 3], rtol=1e-9)


def test_travel_ends_with_the_measured_curve():
    """1500 N m over 0.3 m push S by 5000 N: 19 mm are measured, 21 mm and 38 mm are not."""
    model, names = three_springs()
    travel = MountRequirements(names, (TorqueTravel(model, 1500.0, ("S z",), Factor.part),))
    factors = np.array([[50 / 19], [50 / 21], [50 / 38]]) * np.ones((3, 9))
    travelled = travel(factors)[:, 0]
    assert abs(travelled[0]) == pytest.approx(19.0, rel=1e-9)
    assert np.isnan(travelled[1:]).all()


def test_travel_at_the_torque_of_idle_is_a_price_where_it_is_asked_for(runs):
    case = runs.cases[0][0]
    at = np.arange(3)
    lines = np.array([7.5, 15.0, 22.5])
    orders = [
        replace(each, frequency=lines, values=each.values[at])
        for each in (case.displacement, case.force)
    ]
    idle = replace(case, displacement=orders[0], force=orders[1], engine_torque=np.full(3, 25.0))
    platform = replace(runs.platform, idle=(IdleRun(idle, 900.0),))
    both = replace(runs, platform=platform)
    plain, price = (
        mount_price(both, Factor.dynamic),
        mount_price(both, Factor.dynamic, at_idle=True),
    )
    assert plain.response_names == mount_price(runs, Factor.dynamic).response_names
    further = [name for name in price.response_names if name not in plain.response_names]
    torque = round(25.0 * case.total_ratio)
    assert further[0] == f"EnM x travel at {torque} N m"
    values = dict(zip(price.response_names, price(np.ones((1, 12)))[0], strict=True))
    full = round(float(case.wheel_torque.max()))
    assert 0.0 < abs(values[further[0]]) < abs(values[f"EnM x travel at {full} N m"])
