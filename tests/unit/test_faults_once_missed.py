"""Single faults that the tests of their package once let through: one exact number each."""

from types import SimpleNamespace

import numpy as np
import pytest

from deboom.compressor.hoses import HIT_SCATTER, HammerEvidence
from deboom.compressor.identification import HosePresence
from deboom.compressor.sources import Band, unbalance_curve
from deboom.explore.box import bernstein_gap
from deboom.explore.front import thinned
from deboom.explore.robust import RobustValues
from deboom.explore.scatter import capability
from deboom.measurement.campaign import StaticCurve
from deboom.measurement.channels import Frf
from deboom.measurement.impact_test import HammerMeasurement, check_hits
from deboom.measurement.quality import quality_in_operation
from deboom.measurement.tacho import repair_pulses
from deboom.measurement.virtual_point import sensor_geometry, virtual_point
from deboom.mounts.mount import Mount
from deboom.mounts.part_scatter import ENOUGH, ScatterPrior, direction_scatter
from deboom.physics.frf import phase_error
from deboom.vehicles.design_factor import Factor
from deboom.vehicles.limits import GRAVITY, MountRequirements, TorqueTravel, WeightSag
from deboom.vehicles.powertrain import KinematicModel, Powertrain
from deboom.vehicles.uncertain_data import MeasuredArrays, transfer_floor, transfer_paths
from samples.hammer_test import draw_hammer_test, measure

LINES = np.arange(20.0, 24.0)


def test_the_more_certain_of_y_and_z_has_the_larger_weight():
    """Inverse variances: half widths of 1 and 3 make weights of 0.9 and 0.1."""
    received = []

    def band(weights):
        received.append(weights)
        half = np.full(4, 1.0 if len(received) == 1 else 3.0)
        return Band(np.ones(4, dtype=complex), half, half, half, half, half, half)

    from_y, from_z = np.ones((4, 6)), np.zeros((4, 6))
    unexplained = np.zeros(4, dtype=bool)
    uncertainty = SimpleNamespace(band=band)
    unbalance_curve(uncertainty, LINES, from_y, from_z, unexplained)
    np.testing.assert_allclose(received[2], 0.9 * from_y + 0.1 * from_z, rtol=1e-15)


def hammered(n_averages):
    rng = np.random.default_rng(n_averages)
    values = rng.standard_normal((4, 7, 6)) + 1j * rng.standard_normal((4, 7, 6))
    names = tuple(f"A{k}" for k in range(7)), tuple(f"I{k}" for k in range(6))
    return SimpleNamespace(
        name=f"{n_averages} hits",
        frf=Frf(LINES, values, *names, "m/s^2/N"),
        coherence=np.full((4, 7, 6), 0.9),
        n_averages=n_averages,
    )


def test_hits_of_both_tests_make_the_scatter_of_their_places():
    tests, rng = (hammered(3), hammered(6)), np.random.default_rng(1)
    calibrated = SimpleNamespace(
        response_matrix=rng.standard_normal((7, 6)),
        excitation_matrix=rng.standard_normal((6, 6)),
        model=SimpleNamespace(apparent_mass=lambda lines: np.zeros((lines.size, 6, 6))),
    )
    identification = SimpleNamespace(test=tests[0], calibrated=calibrated)
    evidence = HammerEvidence(*tests, identification, band=(20.0, 23.0), largest_lines=9)
    expected = HIT_SCATTER * np.sqrt(1 / 3 + 1 / 6)
    np.testing.assert_allclose(evidence.nuisance_deviations, expected, rtol=1e-15)


def arrays(transfer):
    return MeasuredArrays(
        **{
            name: None
            for name in MeasuredArrays.__dataclass_fields__
            if name not in ("transfer", "frequency", "transfer_around")
        },
        transfer=transfer,
        frequency=np.arange(float(transfer.shape[1])),
        transfer_around=np.abs(transfer),
    )


def test_the_noise_floor_is_that_of_the_real_and_of_the_imaginary_part():
    quiet = arrays(np.zeros((1, 200, 200), dtype=complex))
    drawn = transfer_floor("stated", 2e-5).measured_again(quiet, np.random.default_rng(1)).transfer
    assert drawn.real.std() == pytest.approx(2e-5, rel=0.02)
    assert drawn.imag.std() == pytest.approx(2e-5, rel=0.02)


def test_an_error_known_from_few_measurements_is_students():
    """Mean square of Student's t with 6 degrees of freedom: 6/4 of the stated."""
    data, rng = arrays(np.ones((1, 3, 40), dtype=complex)), np.random.default_rng(1)
    paths = transfer_paths("found", 0.01, 1e-3, degrees_of_freedom=6.0)
    drawn = (paths.measured_again(data, rng).transfer for _ in range(3000))
    squares = [np.mean(np.abs(transfer - 1) ** 2) for transfer in drawn]
    assert np.mean(squares) / 0.01**2 == pytest.approx(1.5, rel=0.06)


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


def test_bissells_bound_counts_every_piece():
    cpk = 2.0 / 3.0  # of 1, 2, 3 between 0 and 4
    bound = cpk - 1.6448536269514722 * np.sqrt(1 / 27 + cpk**2 / 4)
    assert capability([1.0, 2.0, 3.0], 0.0, 4.0).cpk_bound == pytest.approx(bound, rel=1e-12)


def test_bernsteins_bound_of_equal_shares():
    assert bernstein_gap(0.0, 10, 0.95) == pytest.approx(7 * np.log(40) / 27, rel=1e-14)


def test_a_phase_error_is_the_angle_and_not_its_sine():
    """Coherence 2/3 of two hits: half the magnitude by chance, so 30 degrees."""
    assert phase_error(2 / 3, 2) == pytest.approx(np.pi / 6, rel=1e-12)


def test_late_is_a_share_of_the_block():
    """A peak at 0.6 s of a block of 2 s is not late, one at 1.2 s is."""
    rate, time = 1024.0, np.arange(2048) / 1024.0
    forces = [np.where(abs(time - at) < 3e-3, 100.0, 0.0) for at in (0.6, 1.2)]
    ringing = np.sin(2 * np.pi * 40 * time)[:, np.newaxis] * np.exp(-3 * time)[:, np.newaxis]
    measured = HammerMeasurement(
        impact="I1",
        force=np.array(forces),
        response=np.stack([ringing, ringing]),
        channels=("A1 x",),
        units=("m/s^2",),
        ranges=(np.inf,),
        rate=rate,
        pretrigger=0.5,
    )
    first, second = (" ".join(hit.reasons) for hit in check_hits(measured))
    assert "late" not in first
    assert "late: its peak comes 1.2 s into a block of 2 s" in second


def test_the_limit_of_the_overall_consistency_lies_halfway_from_chance():
    """Of 18 channels the 6 rigid motions keep 1/3 of the energy of noise, √(1/3) of its size."""
    test = draw_hammer_test(np.random.default_rng(21))
    point = virtual_point(sensor_geometry(test.sensors))
    measured = measure(test, np.random.default_rng(1))
    checks = quality_in_operation(point, measured)
    (overall,) = (c for c in checks if c.name == "overall consistency of sensors, mean")
    assert overall.limit == pytest.approx((1 + np.sqrt(6 / 18)) / 2, rel=1e-12)


def test_a_front_is_thinned_in_its_box_and_not_in_the_units_of_its_objectives():
    """Whatever the units are, the same designs stay."""
    x = np.linspace(0.0, 1.0, 17)
    arc = np.c_[x, (1.0 - x) ** 3]
    designs = np.zeros((17, 1))
    stay = [
        thinned(
            RobustValues(arc, designs, designs, *sums.T, *sums.T, np.zeros(17, bool)), 5
        ).designs
        for sums in (arc * scale for scale in ((1.0, 1.0), (1.0, 1024.0), (1024.0, 1.0)))
    ]
    assert len(stay[0]) == 5
    np.testing.assert_array_equal(stay[0][[0, -1]], arc[[0, -1]])
    np.testing.assert_array_equal(stay[1], stay[0])
    np.testing.assert_array_equal(stay[2], stay[0])


def test_a_front_of_three_objectives_is_thinned_in_its_box_too():
    """The reference point lies beyond the box: numbers far above 1 would all lie outside."""
    x, y = np.random.default_rng(1).uniform(size=(2, 40))
    plane = np.c_[x, y, 2.0 - x - y]
    zeros = np.zeros(40)
    stay = [
        thinned(
            RobustValues(
                plane, plane, plane, *[zeros] * 4, np.zeros(40, bool), objectives=plane * scale
            ),
            9,
        ).designs
        for scale in ((1.0, 1.0, 1.0), (1024.0, 1.0, 1.0), (1.0, 1024.0, 1024.0))
    ]
    np.testing.assert_array_equal(stay[1], stay[0])
    np.testing.assert_array_equal(stay[2], stay[0])


def test_hoses_that_halve_a_misfit_explain_three_quarters_of_its_square():
    assert HosePresence("sweep", misfit=4.0, misfit_with_hoses=2.0).explained == 0.75
    assert HosePresence("sweep", misfit=4.0, misfit_with_hoses=4.0).explained == 0.0


def test_the_variance_of_measuring_is_no_scatter_of_parts():
    """One part tells nothing: the assumption stays. Of enough parts the rest is their variance."""
    alone = direction_scatter("x", np.array([0.1]), np.array([0.07]), prior=ScatterPrior(0.05))
    np.testing.assert_allclose(alone.sigma, 0.05, rtol=1e-12)
    values = 0.05 * np.where(np.arange(ENOUGH) % 2, 1.0, -1.0)
    many = direction_scatter("x", values, np.full(ENOUGH, 0.03))
    observed = 0.05**2 * ENOUGH / (ENOUGH - 1)
    np.testing.assert_allclose([many.observed, many.measurement], [observed**0.5, 0.03], rtol=1e-12)
    np.testing.assert_allclose(many.sigma, (observed - 0.03**2) ** 0.5, rtol=1e-12)
    without_error = direction_scatter("x", values)
    np.testing.assert_allclose(without_error.sigma, observed**0.5, rtol=1e-12)
    bounds = [each**2 + 0.03**2 for each in (many.lower, many.upper)]
    np.testing.assert_allclose(bounds, [without_error.lower**2, without_error.upper**2], rtol=1e-12)


def test_pulses_with_normal_jitter_are_all_kept():
    """The farthest of 20 000 from its cubic: 4.5 deviations, 6.7 medians of unsigned deviations."""
    even = np.arange(20_000)
    jitter = np.random.default_rng(2).standard_normal(even.size)
    train = repair_pulses(1e-2 * (even + 0.004 * jitter))
    np.testing.assert_array_equal(train.number, even)
    assert train.dropped.size == 0
