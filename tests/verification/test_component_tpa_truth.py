"""Component TPA on benches that were never seen: blocked forces, sound, another receiver.

The bench solves source and bodies as one structure of beams, by mass and stiffness; the analysis
inverts functions and couples receptances. Without noise both agree to rounding.
"""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from deboom.bench import ComponentPlan, write_component_test
from deboom.bench.component import (
    ALUMINIUM,
    BEARINGS,
    Section,
    beam_matrices,
    bolted,
    draw_component,
)
from deboom.files.component_test import read_component_test, read_receiver
from deboom.measurement.component_findings import component_findings
from deboom.measurement.component_tpa import component_tpa, in_receiver, level_difference
from deboom.measurement.interface_completeness import Rest
from deboom.physics.force_inversion import PLAIN

SEED, TRUTH = 7, 11


def truth_of(folder, run):
    with np.load(folder / "truth" / f"{run.name.replace(' ', '_')}.npz") as truth:
        return dict(truth)


def error(values, truth):
    return np.linalg.norm(values - truth) / np.linalg.norm(truth)


PLAN = {"points": 2, "line_step": 4.0}


@pytest.fixture(scope="module")
def exact(tmp_path_factory):
    """Two points, no noise, sound through the air as well: the folder and its analysis."""
    folder = tmp_path_factory.mktemp("exact") / "test"
    plan = ComponentPlan(**PLAN, airborne=1.0)
    write_component_test(folder, SEED, plan=plan, truth_seed=TRUTH, noise_free=True)
    return folder, component_tpa(read_component_test(folder), PLAIN)


@pytest.fixture(scope="module")
def noisy(tmp_path_factory):
    """Three points with all errors of a laboratory."""
    folder = tmp_path_factory.mktemp("noisy") / "test"
    write_component_test(folder, SEED, plan=ComponentPlan(line_step=4.0), truth_seed=TRUTH)
    return folder, component_tpa(read_component_test(folder))


def test_a_beam_of_the_bench_is_the_printed_one():
    """Free-free bending: ω L² √(m/EI) = 4.730² (Blevins, table 8-1), by 12 elements."""
    section, length, n = Section(1e-4, 2e-9, 3e-9, ALUMINIUM), 0.9, 12
    places = np.linspace([0.1, 0.2, 0.3], [0.1 + length, 0.2, 0.3], n + 1)
    mass, stiffness = np.zeros((2, 6 * (n + 1), 6 * (n + 1)))
    for k in range(n):
        ends = slice(6 * k, 6 * k + 12)
        of_mass, of_stiffness = beam_matrices(places[k], places[k + 1], section)
        mass[ends, ends] += of_mass
        stiffness[ends, ends] += of_stiffness
    squared = np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real
    elastic = np.sort(np.sqrt(squared[squared > 1e-6 * squared.max()]))
    modulus, density = ALUMINIUM
    per_length = density * section.area
    printed = 4.7300407**2 / length**2 * np.sqrt(modulus * section.bending / per_length)
    # both bending planes alike
    assert elastic[:2] == pytest.approx([printed, printed], rel=1e-4)


def test_blocked_forces_of_the_bench_move_the_body_as_the_loads_inside_do():
    lines = np.array([31.0, 77.0, 118.0])
    truth = draw_component(ComponentPlan(points=2), lines, TRUTH)
    whole = bolted(truth.source, truth.first.body, truth.plan.joints)
    body = truth.first.body.nodes
    inside = whole.answer(lines, body, BEARINGS) @ truth.loads["steady 1"][:, :, None]
    blocked = whole.answer(lines, body, truth.plan.names) @ truth.blocked("steady 1")[:, :, None]
    assert error(blocked, inside) < 1e-10


def test_without_noise_the_truth_is_found_to_rounding(exact):
    folder, result = exact
    for run in result.runs:
        truth = truth_of(folder, run)
        assert error(run.blocked.force.values, truth["blocked"]) < 1e-5
        assert error(run.sound.values, truth["pressure"]) < 1e-7
        assert np.abs(run.on_board_level).max() < 1e-4
    assert result.completeness.median == pytest.approx(1.0, abs=1e-6)
    # half of the sound came through the air, which only the ears tell
    assert len(result.doubts) == 4
    assert all("it came through the air" in doubt for doubt in result.doubts)


def test_in_another_receiver_the_source_sounds_as_the_whole_structure_does(exact):
    folder, result = exact
    for moved in in_receiver(result, read_receiver(folder / "receiver")):
        run = result.run(moved.run)
        assert error(moved.sound.values, truth_of(folder, run)["second_pressure"]) < 1e-6
        assert error(moved.measured.values, moved.sound.values) < 1e-6


def test_contributions_add_up_and_are_those_of_the_true_forces(exact):
    folder, result = exact
    run = result.runs[0]
    truth = truth_of(folder, run)
    true = truth["transfer"][:, 0] * truth["blocked"]
    parts = run.contributions("driver ear")
    assert error(parts, true) < 1e-5
    assert np.allclose(parts.sum(axis=1), run.sound.values[:, 0])
    ranks = run.ranking("driver ear").set_index("contribution")
    energies = np.sum(np.abs(true) ** 2, axis=0)
    loudest = run.blocked.force.channels[int(np.argmax(energies))]
    loads = ranks[ranks["what"] == "load"]
    assert loads.index[0] == loudest
    assert loads["share of the energy [1]"].sum() == pytest.approx(1.0)


@pytest.mark.slow("measures a noisy drive unit")
def test_with_all_errors_of_a_laboratory(noisy):
    """Trusted lines; docs/validation.md has twenty benches."""
    folder, result = noisy
    for run in result.runs:
        truth, kept = truth_of(folder, run), run.resolved
        assert kept.mean() > 0.5
        assert error(run.blocked.force.values[kept], truth["blocked"][kept]) < 0.15
        assert np.abs(level_difference(run.sound.values, truth["pressure"], 0)).max() < 1.0
        assert np.abs(run.on_board_level).max() < 1.5
        assert np.median(run.by_line) > 0.99
        held = run.force_interval().holds(np.abs(truth["blocked"]))[kept]
        assert 0.65 < held.mean() <= 1.0
    assert result.completeness.median > 0.99
    assert all(check.passed is not False for checks in result.quality.values() for check in checks
               if check.name.startswith("conditioning"))  # fmt: skip


def test_hits_in_other_places_move_forces_but_not_the_sound(exact):
    """The sound carries the errors of the same hits in force and function: they cancel."""
    _, result = exact
    run = result.runs[0]
    forces, sound = run.force_interval(), run.sound_interval()
    width = [np.median(levels.upper / levels.lower) for levels in (forces, sound)]
    assert width[0] > 1.1
    assert width[1] < width[0]


@pytest.fixture(scope="module")
def two_points(tmp_path_factory):
    """Two points with all errors of a laboratory, and the same with a bracket of a fifth."""
    tests = []
    for bracket in (0.0, 0.2):
        folder = tmp_path_factory.mktemp("bracket") / "test"
        plan = ComponentPlan(**PLAN, unmeasured_point=bracket)
        write_component_test(folder, SEED, plan=plan, truth_seed=TRUTH)
        tests.append((folder, read_component_test(folder)))
    return tests


def test_an_unmeasured_bracket_is_told_by_what_no_load_explains(two_points):
    """Completeness hardly moves, forces err, and the rest of all sensors is no noise."""
    (_, without), (folder, bracketed) = two_points
    complete, incomplete = component_tpa(without), component_tpa(bracketed)
    assert complete.doubts == ()
    for rest in (complete.completeness.rest, *(run.rest for run in complete.runs)):
        assert 0.8 < rest.chi_squared < 1.2
    assert all(run.trusted.any() for run in complete.runs)
    assert incomplete.completeness.median > 0.99
    assert incomplete.completeness.rest.chi_squared > 2.0
    assert "The interface is incomplete" in incomplete.doubts[0]
    for run in incomplete.runs:
        truth, kept = truth_of(folder, run), run.resolved
        assert error(run.blocked.force.values[kept], truth["blocked"][kept]) > 0.15
        assert not run.trusted.any()
    assert component_findings(without, None) == ()
    assert "The interface is incomplete" in component_findings(bracketed, None)[0]


def test_what_moves_the_sensors_in_one_run_alone_denies_this_run(two_points):
    _, test = two_points[0]
    first, second = test.runs
    shaken = first.acceleration.values.copy()
    shaken[:, ::3] += 0.03 * np.abs(shaken).mean()
    foreign = replace(first, acceleration=replace(first.acceleration, values=shaken))
    result = component_tpa(replace(test, runs=(foreign, second)))
    assert [run.complete for run in result.runs] == [False, True]
    assert "Run steady 1: what the loads leave" in result.doubts[0]
    assert "though it is noise under hits on the source" in result.doubts[0]


def test_few_lines_are_judged_by_what_noise_may_do_there():
    """χ² of one spare channel at three lines: 99.9 % of noise lies below 22.46/6 (tables)."""
    assert Rest(np.ones(3), np.ones(3, bool), 1).limit == pytest.approx(22.458 / 6, rel=1e-4)
    assert Rest(np.ones(61), np.ones(61, bool), 24).limit == 1.3


def test_without_rotations_the_interface_is_incomplete(exact, tmp_path):
    """Three degrees of freedom per point are stated where moments act as well."""
    folder = tmp_path / "three"
    shutil.copytree(exact[0], folder)
    path = folder / "component.toml"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("degrees_of_freedom = 6", "degrees_of_freedom = 3"), "utf-8")
    result = component_tpa(read_component_test(folder))
    run = result.runs[0]
    assert set(run.blocked.force.units) == {"N"}
    assert run.blocked.force.values.shape[1] == 6
    assert result.completeness.median < 0.95
    assert "The interface is incomplete" in result.doubts[0]


def test_noise_of_functions_shrinks_forces_as_stated(exact):
    """Noise in the functions, none in operation: the mean of many inversions."""
    _, result = exact
    generator = np.random.default_rng(3)
    parts = generator.standard_normal((2, 12, 3)) @ np.diag([1.0, 0.5, 0.1])
    matrix, force = parts[0] + 1j * parts[1], np.array([1.0, -2.0j, 3.0])
    deviation = 0.006
    noise = generator.standard_normal((2, 20000, 12, 3))
    noisy = matrix + deviation * (noise[0] + 1j * noise[1]) / np.sqrt(2)
    mean_force = (np.linalg.pinv(noisy) @ (matrix @ force)).mean(axis=0)
    outside = (12 - 3) * deviation**2
    shrunk = np.linalg.solve(matrix.conj().T @ matrix, outside * force)
    assert mean_force - force == pytest.approx(-shrunk, rel=0.05, abs=0.02 * np.abs(shrunk).max())
    # in the analysis: the same functions with a coherence that says how noisy they are
    test = result.test
    noisier = replace(test, coherence=np.full(test.coherence.shape, 0.999))
    first = component_tpa(noisier, PLAIN).runs[0]
    assert np.median(first.repeated.attenuation) > 0.01
    assert np.all(result.runs[0].repeated.attenuation < 1e-6)
