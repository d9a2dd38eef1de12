"""The virtual compressor test: exact files give the truth back, errors have their stated size.

The truth is assembled here a second time: by cross products, by free parts and what joins them,
by a root finder. Nothing of the bench's own matrices is used for it but its parameters.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from bench_compressor_samples import DATA, gain, rows_along, table11
from scipy.optimize import root

from deboom.bench import compressor_rig
from deboom.bench.choices import CalibrationLevel, CompressorCase
from deboom.bench.compressor_truth import CompressorPlan, true_compressor
from deboom.bench.compressor_writer import write_compressor_test
from deboom.errors import InputError
from deboom.files.inertance_test import read_inertance_test

SHEET = compressor_rig.position_sheet()
TABLE11 = CompressorPlan(CompressorCase.TABLE11)
FEW = np.array([10.0, 17.0, 28.5, 38.0, 60.0, 150.0])


def compressor(plan=TABLE11, seed=1):
    return true_compressor(plan, np.random.default_rng(seed))


def as_stated():
    return compressor_rig.place(SHEET, compressor_rig.NO_PLACEMENT_ERRORS, np.random.default_rng(1))


def sensor_rows(sheet=SHEET):
    return rows_along([row.angles for row in sheet.sensors], sheet.sensor_positions)


def impact_rows(sheet=SHEET):
    return np.hstack(
        [sheet.impact_directions, np.cross(sheet.impact_positions, sheet.impact_directions)]
    )


@pytest.fixture(scope="module")
def exact(tmp_path_factory):
    folder = tmp_path_factory.mktemp("compressor") / "exact"
    write_compressor_test(folder, 1, plan=TABLE11, noise_free=True)
    return folder, read_inertance_test(folder)


def test_exact_files_hold_the_closed_form(exact):
    _, test = exact
    whole, axes, stiffness = table11()
    for f, values in zip(test.frf.frequency, test.frf.values, strict=True):
        dynamic = axes.T @ np.diag(gain(f) * stiffness) @ axes
        inertance = np.linalg.inv(whole - dynamic / (2 * np.pi * f) ** 2)
        expected = sensor_rows() @ inertance @ impact_rows().T
        assert np.abs(values - expected).max() < 1e-10 * np.abs(expected).max()
    assert test.coherence.min() > 1 - 1e-12
    assert test.weighed_mass == DATA["truth"]["mass_kg"]
    assert test.frf.frequency.tolist() == np.arange(10, 150.1, 0.5).tolist()


def test_truth_files_say_the_same(exact):
    folder, test = exact
    with np.load(folder / "truth/truth.npz") as truth:
        seen = truth["response_matrix"] @ truth["inertance"] @ truth["excitation_matrix"].T
        whole, axes, stiffness = table11()
        squared = (2 * np.pi * truth["frequency"]) ** 2
        static = axes.T @ np.diag(stiffness) @ axes
        apparent = whole - (gain(truth["frequency"]) / squared)[:, None, None] * static
        np.testing.assert_allclose(
            truth["apparent_mass"], apparent, rtol=0, atol=1e-12 * np.abs(apparent).max()
        )
        np.testing.assert_allclose(truth["frf"], seen, rtol=0, atol=1e-12 * np.abs(seen).max())
    size = np.abs(test.frf.values).max()
    np.testing.assert_allclose(test.frf.values, seen, rtol=0, atol=1e-10 * size)
    stated = json.loads((folder / "truth/truth.json").read_text(encoding="utf-8"))
    np.testing.assert_allclose(stated["static_stiffness"], static, rtol=1e-12, atol=1e-9)


@pytest.mark.slow("averages the noise of many hits")
def test_noisy_hits_are_the_delivered_functions(tmp_path):
    """The averages of `measurement`, which share no line of code with the bench's."""
    folder = write_compressor_test(tmp_path / "test", 2, plan=CompressorPlan(hits=True))
    delivered, made = read_inertance_test(folder), read_inertance_test(folder, from_hits=True)
    np.testing.assert_array_equal(delivered.frf.frequency, made.frf.frequency)
    assert (delivered.n_averages, made.n_averages) == (5, 5)
    size = np.abs(delivered.frf.values).max()
    assert np.abs(delivered.frf.values - made.frf.values).max() < 1e-12 * size
    assert np.abs(delivered.coherence - made.coherence).max() < 1e-11
    assert len(made.input_files) == 2 + 18 + 3
    # they are noisy, and close to what the rig would see without noise
    with np.load(folder / "truth/truth.npz") as truth:
        off = np.linalg.norm(delivered.frf.values - truth["frf"]) / np.linalg.norm(truth["frf"])
    assert 0.002 < off < 0.03
    # where only hits are delivered, they are taken
    facts = folder / "compressor_test.toml"
    keep = [
        line
        for line in facts.read_text(encoding="utf-8").splitlines()
        if not line.startswith(("frf", "coherence", "hits_per_impact"))
    ]
    facts.write_text("\n".join(keep), encoding="utf-8")
    assert read_inertance_test(folder).frf.inputs == made.frf.inputs
    points = folder / "hits/impacts.csv"
    text = points.read_text(encoding="utf-8")
    points.write_text(text.replace("0.0414477447", "0.0514477447", 1), encoding="utf-8")
    with pytest.raises(InputError, match="I01 has another place"):
        read_inertance_test(folder)
    points.write_text(text.replace("I02,", "J02,"), encoding="utf-8")
    with pytest.raises(InputError, match="no hits on I02"):
        read_inertance_test(folder)


def test_a_receiver_is_its_own_degrees_of_freedom():
    """Mount by mount a spring from the body to a foot, and the foot on its receptance."""
    body = compressor(replace(TABLE11, flexible_receiver=True))
    whole, axes, stiffness = table11()
    law = DATA["operation"]["flexible_receiver"]
    for f, inertance in zip(FEW, body.inertance(FEW), strict=True):
        squared = (2 * np.pi * f) ** 2
        modal = law["mass"] * (
            (2 * np.pi * law["frequency"]) ** 2 * (1 + 1j * law["loss"]) - squared
        )
        residual = law["residual"] * (1 + 1j * law["residual_loss"])
        springs = np.diag(gain(f) * stiffness)
        foot = springs + np.eye(9) / (1 / modal + 1 / residual)
        both = np.block(
            [
                [axes.T @ springs @ axes - squared * whole, -axes.T @ springs],
                [-springs @ axes, foot],
            ]
        )
        expected = -squared * np.linalg.inv(both)[:6, :6]
        assert np.abs(inertance - expected).max() < 1e-10 * np.abs(expected).max()


def test_a_body_of_two_parts_is_two_free_bodies_coupled_by_a_joint():
    """The dual way; rigid in the limit, and off by the square of the frequency below its mode."""
    swinging = compressor(replace(TABLE11, flexible_body=400.0))
    whole, axes, stiffness = table11()
    share, loss = swinging.joint.share, swinging.joint.loss
    joint = (2 * np.pi * 400.0) ** 2 * (1 + 1j * loss) * share * (1 - share) * whole
    for f, inertance in zip(FEW, swinging.inertance(FEW), strict=True):
        squared = (2 * np.pi * f) ** 2
        held = axes.T @ np.diag(gain(f) * stiffness) @ axes - squared * (1 - share) * whole
        receptance = np.zeros((12, 12), dtype=complex)
        receptance[:6, :6] = np.linalg.inv(held)
        receptance[6:, 6:] = np.linalg.inv(-squared * share * whole)
        gap = np.hstack([np.eye(6), -np.eye(6)])
        through = np.linalg.inv(gap @ receptance @ gap.T + np.linalg.inv(joint))
        coupled = receptance - receptance @ gap.T @ through @ gap @ receptance
        expected = -squared * coupled
        assert np.abs(inertance - expected).max() < 1e-10 * np.abs(expected).max()
    rigid = compressor().inertance(FEW)
    stiff = compressor(replace(TABLE11, flexible_body=1e6)).inertance(FEW)
    for block in (stiff[:, :6, :6], stiff[:, :6, 6:], stiff[:, 6:, 6:]):
        np.testing.assert_allclose(block, rigid, rtol=0, atol=1e-6 * np.abs(rigid).max())
    # far above its mounts a free body of two shares: common motion, and the relative mode
    loose = replace(swinging, stiffness=1e-9 * swinging.stiffness, centre=np.zeros(3))
    felt = loose.inertance(np.array([150.0]))[0, 6, 6] * loose.mass
    ratio = (150.0 / 400.0) ** 2
    expected = 1 - (1 - share) / share * ratio / (1 + 1j * loss - ratio)
    assert felt == pytest.approx(expected, rel=1e-9)
    assert abs(expected - 1) > 0.1


def test_a_softening_mount_is_as_soft_as_its_stroke_makes_it():
    """Amplitudes by a root finder, with the motion of the mounts from the closed form."""
    plan = replace(compressor_rig.without_noise(compressor_rig.hit_plan()), hits=1)
    body, placed = compressor(replace(TABLE11, softening=True)), as_stated()
    blows = compressor_rig.strike(body, placed, plan, np.random.default_rng(3))
    law = DATA["operation"]["amplitude_law"]
    whole, axes, stiffness = table11()
    lines = plan.spectrum_lines
    squared = (2 * np.pi * lines)[:, None, None] ** 2

    def factor(amplitude):
        fall = 1 / (1 + amplitude / law["scale"]) - 1 / (1 + law["reference"] / law["scale"])
        return 1 + law["share"] * fall

    for impact in (0, 8):
        load = np.fft.rfft(blows.force[impact, 0])[:, None] * impact_rows()[impact]

        def motion(amplitude, load=load):
            scaled = np.repeat(factor(amplitude), 3) * stiffness
            held = np.einsum("f,ka,k,kb->fab", gain(lines), axes, scaled, axes)
            return np.linalg.solve(held - squared * whole, load[:, :, None])[:, :, 0]

        def unbalanced(microns, motion=motion):
            over_time = np.fft.irfft(motion(1e-6 * microns) @ axes.T, plan.n_sample, axis=0)
            stroke = np.linalg.norm(over_time.reshape(-1, 3, 3), axis=2).max(axis=0)
            return 1e6 * stroke - microns

        solved = root(unbalanced, np.full(3, 100.0), tol=1e-10)
        assert solved.success
        np.testing.assert_allclose(blows.factors[impact, 0], factor(1e-6 * solved.x), rtol=1e-9)
        acceleration = -squared[:, :, 0] * motion(1e-6 * solved.x) @ sensor_rows().T
        expected = np.fft.irfft(acceleration, plan.n_sample, axis=0)
        answer = blows.response[impact, 0]
        assert np.abs(answer - expected).max() < 1e-8 * np.abs(expected).max()
    assert blows.factors.std() > 0.005


def test_noise_has_the_size_of_the_study():
    """0.7 % of the mass line at 100 Hz and 1.4 % near 10 Hz, per part of an FRF."""
    plan = replace(compressor_rig.hit_plan(), scatter=0.0)
    placed = compressor_rig.place(
        SHEET, compressor_rig.placement_errors(CalibrationLevel.C2), np.random.default_rng(4)
    )
    body = compressor()
    blows = compressor_rig.strike(body, placed, plan, np.random.default_rng(5))
    averaged, coherence = compressor_rig.averaged(blows, plan)
    ones = np.ones((18, 3))
    off = averaged - compressor_rig.exact_inertance(body, placed, plan.lines, ones)
    for low, high in ((10, 12), (90, 110)):
        band = (plan.lines >= low) & (plan.lines <= high)
        f = plan.lines[band].mean()
        push = abs(np.cos(np.pi * f * 4e-3) / (1 - (2 * f * 4e-3) ** 2))
        density = 4e-4 * np.sqrt(1 + (20 / f) ** 2)
        # 5 hits of 2 s; strengths of 0.7 to 1.3 weigh as their squares
        expected = density * np.sqrt(2.0 / 2) / np.sqrt(2) / (0.15 * push) / np.sqrt(5 * 1.03)
        parts = np.concatenate([off[band].real.ravel(), off[band].imag.ravel()])
        # resonances add noise of the force, which is relative
        assert parts.std() == pytest.approx(expected, rel=0.08)
    assert 0.0065 < expected * 7.2 < 0.0085
    assert 0.99 < np.median(coherence) < 1


@pytest.mark.parametrize("level", list(CalibrationLevel))
def test_levels_have_their_stated_errors(level):
    stated = DATA["rig"]["calibration_levels_gain_position_m_angle_deg_hammer"][level.value]
    drawn = [
        compressor_rig.place(
            SHEET, compressor_rig.placement_errors(level), np.random.default_rng(seed)
        )
        for seed in range(200)
    ]
    size = {
        "gain": np.std([operation_drawn.sensor_gain for operation_drawn in drawn]),
        "position": np.std([operation_drawn.sensor_offset for operation_drawn in drawn]),
        "angle": np.rad2deg(np.std([operation_drawn.sensor_turn for operation_drawn in drawn])),
        "hammer": np.std([operation_drawn.hammer_gain for operation_drawn in drawn]),
    }
    np.testing.assert_allclose(list(size.values())[:3], stated[:3], rtol=0.04)
    assert size["hammer"] == pytest.approx(stated[3], rel=0.16)
    offsets = np.array([operation_drawn.impact_offset for operation_drawn in drawn])
    along = np.einsum("nma,ma->nm", offsets, SHEET.impact_directions)
    assert np.abs(along).max() < 1e-15
    assert np.sqrt((offsets**2).sum(axis=2).mean() / 2) == pytest.approx(stated[1], rel=0.04)
    lean = [
        np.einsum("ma,ma->m", operation_drawn.impact_directions, SHEET.impact_directions)
        for operation_drawn in drawn
    ]
    tilt = np.rad2deg(np.sqrt((np.arccos(np.minimum(lean, 1)) ** 2).mean() / 2))
    assert tilt == pytest.approx(stated[2], rel=0.04)


def test_random_cases_stay_inside_the_tolerances():
    start, spread = DATA["start_table10"], DATA["random_case_spread"]
    for seed in range(1, 30):
        body = compressor(CompressorPlan(), seed)
        assert abs(body.mass - start["mass_kg"]) <= spread["mass_kg"]
        assert np.abs(body.centre).max() <= spread["centre_of_gravity_m"]
        off = body.positions - np.array(start["mount_position_m"])
        assert np.abs(off).max() <= spread["position_m"]
        turned = np.rad2deg(body.rotations) - np.array(start["mount_rotation_deg"])
        assert np.abs(turned).max() <= spread["rotation_deg"] + 1e-9
        ratio = body.stiffness / np.array(
            start["mount_static_stiffness_N_per_m_axial_radial1_radial2"]
        )
        assert np.abs(ratio - 1).max() <= spread["stiffness_relative"]
    same = compressor(CompressorPlan(identical_mounts=True), 3).stiffness
    assert np.ptp(same, axis=0).max() == 0
    assert same[0, 1] == same[0, 2] != same[0, 0]


def test_a_seed_is_one_compressor_at_any_level(tmp_path):
    levels = (CalibrationLevel.C2, CalibrationLevel.C05)
    folders = [write_compressor_test(tmp_path / level.value, 3, level) for level in levels]
    truths = [json.loads((f / "truth/truth.json").read_text("utf-8")) for f in folders]
    assert truths[0]["static_stiffness"] == truths[1]["static_stiffness"]
    ratio = np.array(truths[0]["sensor_gain"]) / truths[1]["sensor_gain"]
    np.testing.assert_allclose(ratio, 4.0)


def test_drawn_sources_differ_in_their_gas_forces():
    """A third to three times the frozen ones, of any phase, each by itself; seed 1 is frozen."""
    frozen, *drawn = (compressor_rig.true_source(1, seed) for seed in range(1, 61))
    assert frozen.gas_force == complex(*DATA["operation"]["gas_force_x_N"])
    for name in ("gas_force", "gas_moment", "rotating_gas_force"):
        ratios = np.array([getattr(source, name) for source in drawn]) / getattr(frozen, name)
        assert 1 / 3 <= np.abs(ratios).min() < 0.5
        assert 2 < np.abs(ratios).max() <= 3
        assert np.abs(np.mean(ratios / np.abs(ratios))) < 0.35
