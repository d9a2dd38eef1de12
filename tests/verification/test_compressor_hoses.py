"""Hoses of the virtual compressor: their reaction, their beams, their forces on the body."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from deboom.arrays import derivatives
from deboom.bench.choices import CalibrationLevel, HoseCase
from deboom.bench.compressor_rig import OperationPlan, measured, operation, true_sweep
from deboom.bench.compressor_truth import CompressorPlan, drawn_hoses
from deboom.bench.compressor_writer import write_compressor_test, write_operating_test
from deboom.compressor.hammer_identification import identify
from deboom.compressor.hose_identification import DRAWN, identify_hoses
from deboom.compressor.hose_presence import hose_reactions, hoses_in_hammer_test, hoses_in_sweep
from deboom.compressor.hoses import (
    BEAM_NUMBERS,
    HIT_SCATTER,
    HammerEvidence,
    SweepEvidence,
    changed_hose,
    hose_matrices,
    point_derivatives,
    port_forces,
    sweep_pairs,
)
from deboom.compressor.identified_compressor import IdentifyOptions
from deboom.compressor.model import applied
from deboom.compressor.routes import CALIBRATED_MEASUREMENT
from deboom.compressor.unbalance import UnbalanceOptions, unbalance
from deboom.files.inertance_test import read_inertance_test
from deboom.files.operating_test import read_operating_test
from deboom.measurement.channels import Spectrum
from deboom.measurement.compressor_test import HoseDrawing, HoseState
from deboom.measurement.virtual_point import virtual_point_frf
from deboom.physics.rigid_body import forward_matrix

OPTIONS = IdentifyOptions(largest_lines=36)
SLACK = 1.5
"""One compressor against a figure for the median."""
LEVER = np.repeat([1.0, 1 / 0.055], 3)


@pytest.fixture(scope="module")
def measured_test(tmp_path_factory):
    root = tmp_path_factory.mktemp("hoses")

    @cache
    def read(seed=1, hoses=HoseCase.SCATTERED, noise_free=False, softening=False):
        joined = not (noise_free or softening)
        plan = OperationPlan(hoses=hoses, hammer_with_hoses=joined, softening=softening)
        place = root / f"{seed}{hoses.value}{softening}"
        write_operating_test(place, seed, CalibrationLevel.C2, plan, noise_free=noise_free)
        test = read_operating_test(place)
        return test, identify(test.hammer, OPTIONS, hoses=test.hoses), place / "truth"

    return read


@pytest.fixture(scope="module")
def recovered(measured_test):
    """Hoses of one compressor, identified from each source once; one pressure, few lines."""
    test, identification, _ = measured_test()
    return cache(
        lambda source: identify_hoses(measured_by(source, few_lines(test)), identification)
    )


def measured_by(source, test):
    """Leave out what the hoses shall not be identified from."""
    if source == "hammer":
        return replace(test, sweeps=test.with_hoses(HoseState.SOFT))
    return replace(test, hammer_with_hoses=None) if source == "sweeps" else test


def few_lines(test, step=3):
    """One pressure, both kinds of hoses, a third of the lines or fewer."""
    kept = []
    for sweep in test.sweeps[::2]:
        lines = sweep.acceleration
        values = Spectrum(lines.frequency[::step], lines.values[::step], lines.channels, lines.unit)
        kept.append(replace(sweep, acceleration=values, deviation=sweep.deviation[::step]))
    return replace(test, sweeps=tuple(kept))


def run_again(sweep, operated, noise):
    """Run a compressor of the bench at the lines of a sweep."""
    soft = sweep.hoses is HoseState.SOFT
    true = true_sweep(operated, 7.5, soft=soft, frequency=sweep.frequency)
    values = measured(true, np.random.default_rng([1, noise]))
    return replace(sweep, acceleration=replace(sweep.acceleration, values=values))


def true_hoses(truth):
    entries = json.loads((truth / "operation.json").read_text())["hoses"]
    return tuple(
        HoseDrawing(**(entry | {key: np.array(entry[key]) for key in ("position", "direction")}))
        for entry in entries
    )


def stiffness_error(hoses, truth, lines=None):
    """Relative error of the stiffness at the virtual point above 60 Hz."""
    lines = np.arange(60.0, 151.0) if lines is None else lines
    weight = np.outer(LEVER, LEVER)
    true = hose_matrices(true_hoses(truth), lines).point * weight
    return np.linalg.norm(hose_matrices(hoses, lines).point * weight - true) / np.linalg.norm(true)


def force_levels(hoses, truth):
    """Largest level error of the force on the body, each port and line above 60 Hz [dB]."""
    sweep = np.load(truth / "0.npz")
    above = sweep["frequency"] >= 60

    def forces(load):
        return np.linalg.norm(load.reshape(-1, 2, 6)[above, :, :3], axis=2)

    applied_load = applied(hose_matrices(hoses, sweep["frequency"]).transfer, sweep["displacement"])
    return np.abs(20 * np.log10(forces(applied_load) / forces(sweep["end_load"]))).max()


@pytest.mark.slow("differentiates both evidences by differences")
def test_derivatives_of_the_stiffness_and_of_both_evidences(measured_test):
    test, identification, _ = measured_test()
    generator = np.random.default_rng(3)
    drawn, lines = test.hoses, np.array([20.0, 80.0, 120.0])
    scale = np.tile(DRAWN, (2, 1))
    numbers = 0.5 * scale * generator.standard_normal(scale.shape)
    flat = numbers.ravel()

    def stiffness(rows, lines):
        changed = [[changed_hose(*step) for step in zip(drawn, row, strict=True)] for row in rows]
        return np.array([hose_matrices(hoses, lines).point for hoses in changed])

    expected = derivatives(lambda rows: stiffness(rows.reshape(-1, 2, 11), lines), flat, 3e-4)
    slopes = point_derivatives(drawn, numbers, lines).reshape(expected.shape)
    size = np.abs(expected).max(axis=(1, 2, 3), keepdims=True)
    np.testing.assert_allclose((slopes - expected) / size, 0, atol=1e-6)
    evidences = [
        HammerEvidence(
            test.hammer, test.hammer_with_hoses, identification, band=(20, 150), largest_lines=6
        ),
        SweepEvidence(
            sweep_pairs(test, identification, (100, 110))[0], identification, test.rotor_inertia
        ),
    ]
    for evidence in evidences:
        evidence_lines, deviations = evidence.frequency, evidence.nuisance_deviations
        nuisances = 0.3 * deviations * generator.standard_normal(deviations.size)
        slopes = point_derivatives(drawn, numbers, evidence_lines).reshape(22, -1, 6, 6)

        def residuals(rows, evidence=evidence, evidence_lines=evidence_lines, slopes=slopes):
            at = stiffness(rows[:, :22].reshape(-1, 2, 11), evidence_lines)
            return np.array(
                [
                    evidence.residuals(k, slopes, row[22:])[0]
                    for k, row in zip(at, rows, strict=True)
                ]
            )

        unknowns = np.concatenate([flat, nuisances])
        exact = evidence.residuals(stiffness([numbers], evidence_lines)[0], slopes, nuisances)[1]
        expected = derivatives(residuals, unknowns, 1e-4)
        size = np.abs(expected).max(axis=1, keepdims=True)
        assert np.all(np.abs(exact - expected) <= 1e-5 * size)


def test_reaction_is_that_of_the_bench_and_its_floor_holds(measured_test):
    test, identification, truth = measured_test()
    true = np.load(truth / "0.npz")
    reaction = hose_reactions(test, identification)[0]
    source, hoses = true["load"] * LEVER, true["hose_reaction"] * LEVER
    share = np.linalg.norm(hoses, axis=1) / np.linalg.norm(source, axis=1)
    for band in reaction.bands[1:]:
        lines = (true["frequency"] >= band.low) & (true["frequency"] < band.high + 0.5)
        assert band.share == pytest.approx(np.sqrt(np.mean(share[lines] ** 2)), rel=0.08)
        assert band.floor < 0.005 * SLACK
        assert band.share > 0.01
        assert band.detected
        assert "push back" in band.statement
    above = true["frequency"] >= 60
    error = (reaction.reaction - true["hose_reaction"])[above] * LEVER
    assert np.linalg.norm(error) < 0.04 * SLACK * np.linalg.norm(hoses[above])

    # the same test without hoses: another run-up with soft ones under the other label
    operated = operation(1, CalibrationLevel.C2, OperationPlan())
    soft = next(sweep for sweep in test.sweeps if sweep.name == "soft 7.5 bar")
    repeated = replace(run_again(soft, operated, 77), name="again", hoses=HoseState.STANDARD)
    (nothing,) = hose_reactions(replace(test, sweeps=(soft, repeated)), identification)
    assert not any(band.detected for band in nothing.bands)
    assert max(band.measured for band in nothing.bands[1:]) > 0.002
    assert "no reaction" in nothing.bands[1].statement


@pytest.mark.parametrize("source", ["hammer", "sweeps", "both"])
def test_hoses_recovered(measured_test, recovered, source):
    truth, result = measured_test()[2], recovered(source)
    assert stiffness_error(result.hoses, truth) < 0.03 * SLACK
    assert force_levels(result.hoses, truth) < 0.5
    assert result.alarms == ()
    ratio = np.log(
        [
            [getattr(hose, name) / getattr(true, name) for name in BEAM_NUMBERS]
            for hose, true in zip(result.hoses, true_hoses(truth), strict=True)
        ]
    )
    assert np.all(np.abs(ratio) < 4 * result.beam_deviations)
    # torque is the hardest to see
    assert np.all(np.argmax(result.beam_deviations, axis=1) == BEAM_NUMBERS.index("torsion"))
    assert all(
        "Demonstrator" in said or "orce" in said or "drawing" in said for said in result.statements
    )


@pytest.mark.slow("identifies a compressor and its hoses once more")
def test_without_noise_and_in_place_the_truth_comes_back(measured_test):
    test, identification, truth = measured_test(2, HoseCase.DISPLACED, noise_free=True)
    assert stiffness_error(identify_hoses(test, identification).hoses, truth) < 0.005
    assert stiffness_error(test.hoses, truth) > 0.1


@pytest.mark.slow("identifies a compressor and its hoses once more")
def test_mounts_that_soften_with_their_motion_do_not_pass_for_hoses(measured_test):
    """Hoses change the motion, motion the mounts: sweeps are used from 50 Hz upwards."""
    test, identification, truth = measured_test(softening=True)
    result = identify_hoses(few_lines(test), identification)
    assert stiffness_error(result.hoses, truth) < 0.03 * SLACK
    assert result.alarms == ()


@pytest.mark.slow("identifies a compressor's hoses once more")
def test_hoses_outside_the_class_raise_the_alarm(measured_test):
    test, identification, _ = measured_test()
    operated = operation(1, CalibrationLevel.C2, OperationPlan())
    # a third hose that nobody drew, across the others
    hidden = replace(
        drawn_hoses()[0], position=np.array([0.0, 0.06, -0.04]), direction=np.eye(3)[1]
    )
    more = replace(operated.laboratory.compressor, hoses=(*drawn_hoses(), hidden))
    operated = replace(operated, laboratory=replace(operated.laboratory, compressor=more))
    standard, soft = few_lines(test, 7).sweeps
    pair = replace(test, sweeps=(run_again(standard, operated, 78), soft), hammer_with_hoses=None)
    result = identify_hoses(pair, identification)
    assert min(chi for _, chi in result.reduced_chi) > 1.5
    assert any("not straight uniform beams" in alarm for alarm in result.alarms)


def test_mounts_that_changed_one_by_one_do_not_pass_for_hoses(measured_test):
    test, identification, _ = measured_test()
    plan = OperationPlan(each_mount=(1.2, 0.85, 1.05))
    operated = operation(1, CalibrationLevel.C2, plan)
    soft, _ = test.with_hoses(HoseState.SOFT)
    again = run_again(soft, operated, 79)
    seen = hoses_in_sweep(again, test.hoses, identification, rotor_inertia=test.rotor_inertia)
    assert not seen.unexplained


def test_hoses_that_were_overlooked_are_seen(measured_test):
    test, identification, _ = measured_test()
    for sweep in test.sweeps:
        seen = hoses_in_sweep(sweep, test.hoses, identification, rotor_inertia=test.rotor_inertia)
        assert seen.visible is (sweep.hoses is HoseState.STANDARD)
        assert ("were attached" in seen.statement) is seen.visible
    assert not struck(identification, test.hammer, test.hoses).unexplained
    assert struck(identification, test.hammer_with_hoses, test.hoses).visible


@pytest.mark.slow("identifies a compressor and its loads twice")
def test_overlooked_hoses_raise_the_alarms_of_both_identifications(measured_test):
    test, identification, _ = measured_test()
    coarse = IdentifyOptions(bands=((20.0, 60.0),), largest_lines=12)
    hosed = identify(test.hammer_with_hoses, coarse, hoses=test.hoses)
    assert "whatever the label says" in hosed.alarms[0]
    assert identification.alarms == ()
    test = few_lines(test)
    options = UnbalanceOptions(routes=(CALIBRATED_MEASUREMENT,))
    clean = unbalance(test, identification, options)
    assert not any(presence.visible for presence in clean.hoses)
    assert not clean.hoses_seen
    mislabelled = tuple(
        replace(sweep, hoses=HoseState.SOFT) for sweep in test.with_hoses(HoseState.STANDARD)
    )
    overlooked = unbalance(replace(test, sweeps=mislabelled), identification, options)
    assert len(overlooked.hoses) == len(mislabelled)
    assert overlooked.hoses_seen
    assert all("whatever the label says" in alarm for alarm in overlooked.hose_alarms)
    assert set(overlooked.hose_alarms) <= set(overlooked.alarms)


def struck(identification, test, hoses):
    """Look for hoses in another hammer test with these sensors and impacts."""
    inertance = virtual_point_frf(
        test.frf, response=identification.response, excitation=identification.excitation
    )
    return hoses_in_hammer_test(test.name, inertance, identification.length, hoses)


def test_a_flexible_receiver_is_not_taken_for_hoses(measured_test, tmp_path):
    test, identification, _ = measured_test()
    write_compressor_test(tmp_path / "test", 1, plan=CompressorPlan(flexible_receiver=True))
    seen = struck(identification, read_inertance_test(tmp_path / "test"), test.hoses)
    assert seen.unexplained
    assert not seen.visible
    assert "something else" in seen.statement


def test_the_force_between_the_ports_stays_hidden(measured_test):
    test, *_ = measured_test()
    rank, hidden = port_forces(test.hoses)
    assert (rank, hidden.shape) == (5, (1, 6))
    positions = [hose.position for hose in test.hoses]
    wrench = sum(
        forward_matrix(place).T @ force
        for place, force in zip(positions, hidden.reshape(2, 3), strict=True)
    )
    np.testing.assert_allclose(wrench, 0, atol=1e-12)
    apart = positions[1] - positions[0]
    np.testing.assert_allclose(np.cross(hidden[0, :3], apart), 0, atol=1e-12)


def test_samples_have_the_posterior_covariance(recovered):
    result = recovered("sweeps")
    drawn = result.samples(400, seed=1)
    tension = np.log([sample[0].tension for sample in drawn])
    assert np.std(tension) == pytest.approx(result.beam_deviations[0, 0], rel=0.15)
    assert np.mean(tension) == pytest.approx(
        np.log(result.hoses[0].tension), abs=0.2 * result.beam_deviations[0, 0]
    )
    again = result.samples(2, seed=1)
    assert again[0][0].tension == result.samples(2, seed=1)[0][0].tension


def test_hits_of_both_tests_make_the_scatter_of_their_places(measured_test):
    test, identification, _ = measured_test()
    few, many = (
        replace(struck, n_averages=n)
        for struck, n in ((test.hammer, 3), (test.hammer_with_hoses, 6))
    )
    evidence = HammerEvidence(few, many, identification, band=(20.0, 50.0), largest_lines=3)
    expected = HIT_SCATTER * np.sqrt(1 / 3 + 1 / 6)
    np.testing.assert_allclose(evidence.nuisance_deviations, expected, rtol=1e-15)
