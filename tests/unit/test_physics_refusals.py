"""What no equation of the physics can answer is refused in a sentence."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.physics import dynamic_stiffness as mount
from deboom.physics import frf, rigid_body
from deboom.physics import order_tracking as orders
from deboom.physics import sound_level as sound
from deboom.physics import transfer_path as paths
from deboom.physics.elastic_centre import (
    centre_of_compliance,
    centre_of_stiffness,
    residual_coupling,
)
from deboom.physics.force_inversion import PLAIN, Inversion, Regularisation, invert_for_forces
from deboom.physics.forced_response import (
    amplitude_dependent_response,
    forced_response,
    modal_superposition,
)
from deboom.physics.frf import CrossSpectra, FrfForm, convert

NAN, INF = np.nan, np.inf
LINES = np.array([20.0, 30.0, 40.0])
DRAWN = np.random.default_rng(5).normal(size=(2, 3, 4, 4))
MATRICES = DRAWN[0] + 1j * DRAWN[1]
SINGULAR = MATRICES[:, :3, :3].copy()
SINGULAR[1] = 1.0
BLOCKS = np.random.default_rng(1).normal(size=(4, 8, 3))
CURVES = BLOCKS[0] + 1j * BLOCKS[1]

PLACES = np.array([[0.05, 0.43, 0.20], [-0.034, -0.45, 0.19], [0.20, -0.06, -0.27]])
RATES = np.array([[110e3, 90e3, 150e3], [190e3, 140e3, 220e3], [75e3, 50e3, 55e3]])
MASS = rigid_body.mass_matrix(193.5, np.diag([11.0, 6.8, 9.6]))
SPRINGS = rigid_body.mount_stiffness_matrix(PLACES, RATES)
BENT = SPRINGS + np.eye(6, k=1) * 1e5

RATE = 500.0
TIME = np.arange(1000) / RATE
ANGLE = 2 * np.pi * 20 * TIME
PHASE = ANGLE[:, np.newaxis]
RECORD = np.cos(1.5 * PHASE)
TURNS_BACK = np.where(TIME < 1, ANGLE, 2 * ANGLE[500] - ANGLE)
NOT_FINITE = np.where(np.arange(1000) == 7, NAN, ANGLE)

BODY = np.broadcast_to(np.diag([2.0, 4.0]), (5, 2, 2))


def spectra(n_input=1, n_block=4, blocks=BLOCKS):
    return frf.cross_spectra(blocks[:n_block, :, :n_input], blocks[:n_block, :, n_input:], 8.0)


def steady(**options):
    """Solve for the steady state of a body whose stiffness does not change at all."""
    return amplitude_dependent_response(
        MASS, lambda _: SPRINGS, np.ones((3, 6)), LINES, np.eye(6), **options
    )


def vold_kalman(values=RECORD, phase=PHASE, bandwidth=2.0):
    return orders.vold_kalman(values, phase, RATE, bandwidth)


SILENT_INPUT, SILENT_OUTPUT = BLOCKS * [0, 1, 1], BLOCKS * [1, 0, 0]
ONE = np.ones((2, 1, 1))
COMPARED = (frf.mac, frf.msf, frf.corr_f, frf.corr_s)
CENTRES = (centre_of_stiffness, centre_of_compliance, residual_coupling)
RESPONSES = np.ones((3, 4))

REFUSED = [
    # dynamic stiffness
    ("above 0 Hz", lambda: mount.displacement_from_acceleration(LINES, LINES - 20)),
    ("differ in lines", lambda: mount.displacement_from_acceleration([1.0], LINES)),
    (r"is 0 at index \(1, 1\)", lambda: mount.dynamic_stiffness(np.ones((2, 2)), [[1, 1], [1, 0]])),
    *(
        ("noise ratio", lambda r=r: mount.stiffness_hv([1.0], [1.0], r))
        for r in (0.0, -1.0, INF, NAN)
    ),
    ("differ", lambda: mount.stiffness_h1(np.ones(3), np.ones(4))),
    ("displacement is 0", lambda: mount.stiffness_h1(np.ones(3), np.zeros(3))),
    ("of force and displacement is 0", lambda: mount.stiffness_h2([1.0, 1.0], [1.0, -1.0])),
    ("of force and displacement is 0", lambda: mount.stiffness_hv([1.0, 1.0], [1.0, -1.0], 1.0)),
    ("real part", lambda: mount.loss_factor([1e5, 1e3j])),
    ("no inverse", lambda: mount.force_at_virtual_point(np.diag([1.0, 0.0, 1.0]), np.ones(3))),
    (r"shape \(3, 3\)", lambda: mount.force_at_virtual_point(np.eye(6), np.ones(6))),
    # forced response
    ("loads have shape", lambda: forced_response(MASS, SPRINGS, np.ones((3, 3)), LINES)),
    ("loads have shape", lambda: forced_response(MASS, SPRINGS, np.ones((2, 6)), LINES)),
    ("resonance", lambda: forced_response([[1.0]], [[(40 * np.pi) ** 2]], [[1.0]], [20.0])),
    (
        "real part",
        lambda: modal_superposition(MASS, 1j * SPRINGS, np.ones(3), np.ones((3, 6)), LINES),
    ),
    ("relaxation", lambda: steady(relaxation=0.0)),
    ("relaxation", lambda: steady(relaxation=1.5)),
    ("above 0", lambda: steady(start=0.0)),
    ("above 0", lambda: steady(start=NAN)),
    ("above 0", lambda: steady(start=[1e-4] * 5 + [0.0])),
    # rigid bodies and elastic centres
    (r"positions have shape \(n, 3\)", lambda: rigid_body.forward_matrices(np.zeros(3))),
    (r"positions have shape \(n, 3\)", lambda: rigid_body.forward_matrices(np.zeros((2, 2)))),
    ("orientations of 3 points", lambda: rigid_body.forward_matrices(PLACES, np.eye(3))),
    *(
        ("3 mounts need stiffnesses", lambda k=k: rigid_body.mount_stiffness_matrix(PLACES, k))
        for k in (1.0, np.ones(3), np.ones((3, 2)), np.ones((4, 3)))
    ),
    ("real part", lambda: rigid_body.rigid_body_modes(MASS, SPRINGS * (1 + 0.1j))),
    ("mass matrix is not positive", lambda: rigid_body.rigid_body_modes(-MASS, SPRINGS)),
    ("negative direction", lambda: rigid_body.rigid_body_modes(MASS, -SPRINGS)),
    ("stiffness is not symmetric", lambda: rigid_body.rigid_body_modes(MASS, BENT)),
    ("shape", lambda: rigid_body.mass_properties(np.eye(3))),
    ("not positive definite", lambda: rigid_body.mass_properties(-MASS)),
    ("not positive definite", lambda: rigid_body.mass_properties(MASS - 8 * np.eye(6))),
    *(("shape", lambda f=f: f(SPRINGS[:3, :3])) for f in CENTRES),
    *(("real part", lambda f=f: f(SPRINGS * (1 + 0.1j))) for f in CENTRES),
    *(("not symmetric", lambda f=f: f(BENT)) for f in CENTRES),
    *(("not positive", lambda f=f: f(np.diag([1e5, 1e5, 1e5, 1e3, 1e3, 0]))) for f in CENTRES),
    # forms, spectra and windows
    (
        "4 outputs by 3 inputs",
        lambda: convert(MATRICES[:, :, :3], LINES, FrfForm.MOBILITY, FrfForm.IMPEDANCE),
    ),
    (
        r"first at 30.0 Hz \(rank 1 of 3\)",
        lambda: convert(SINGULAR, LINES, FrfForm.INERTANCE, FrfForm.APPARENT_MASS),
    ),
    ("0 Hz", lambda: convert(MATRICES, LINES - 20, FrfForm.INERTANCE, FrfForm.RECEPTANCE)),
    *(
        (
            "n_frequency, n_output, n_input",
            lambda v=v: convert(v, LINES, FrfForm.RECEPTANCE, FrfForm.MOBILITY),
        )
        for v in (np.ones(3), np.ones((3, 3)), np.ones((2, 3, 3)))
    ),
    *(
        (
            "characteristic length",
            lambda x=x: frf.scaled_condition_number(np.eye(6), FrfForm.APPARENT_MASS, x),
        )
        for x in (0.0, -1.0, NAN)
    ),
    ("6×6", lambda: frf.scaled_condition_number(np.eye(3), FrfForm.INERTANCE, 0.1)),
    ("input blocks: shape", lambda: frf.cross_spectra(BLOCKS[0], BLOCKS, 8.0)),
    ("output blocks: shape", lambda: frf.cross_spectra(BLOCKS, BLOCKS[:2], 8.0)),
    ("output blocks: shape", lambda: frf.cross_spectra(BLOCKS, BLOCKS[:, :7], 8.0)),
    ("at least two samples", lambda: frf.cross_spectra(BLOCKS[:, :1], BLOCKS[:, :1], 8.0)),
    ("is not positive", lambda: frf.cross_spectra(BLOCKS, BLOCKS, 0.0)),
    (
        "output blocks: a number is not finite",
        lambda: frf.cross_spectra(BLOCKS, np.where(BLOCKS[2, 3, 1] == BLOCKS, NAN, BLOCKS), 8.0),
    ),
    *(
        ("window", lambda w=w: frf.cross_spectra(BLOCKS, BLOCKS, 8.0, input_window=w))
        for w in (np.ones(7), np.zeros(8), np.full(8, NAN))
    ),
    ("do not fit a record", lambda: frf.overlapping_blocks(BLOCKS[0], 9, 1)),
    ("start 1 to 4 apart", lambda: frf.overlapping_blocks(BLOCKS[0], 4, 0)),
    ("start 1 to 4 apart", lambda: frf.overlapping_blocks(BLOCKS[0], 4, 5)),
    ("average nothing", lambda: frf.effective_averages(np.ones(8), 4, 0)),
    ("n_averages is 0: give", lambda: CrossSpectra(np.arange(2), ONE, ONE, ONE, 0)),
    ("output_input: shape", lambda: CrossSpectra(np.arange(2), np.ones((2, 2, 2)), ONE, ONE, 3)),
    ("1 average.*whatever was measured", lambda: frf.coherence(spectra(n_block=1))),
    ("1 average.*whatever was measured", lambda: frf.multiple_coherence(spectra(n_block=1))),
    ("2 input.* over 2 average", lambda: frf.multiple_coherence(spectra(2, 2))),
    ("at least as many averages, not 1", lambda: frf.h1(spectra(2, 1))),
    ("H2 of 2 inputs needs as many outputs, not 1", lambda: frf.h2(spectra(2))),
    ("the outputs depend on each other", lambda: frf.h2(spectra(2, 4, BLOCKS[..., [0, 1, 2, 2]]))),
    ("noise ratio is positive", lambda: frf.hv(spectra(), 0.0)),
    ("no input at 0 Hz in channel 1", lambda: frf.h1(spectra(blocks=SILENT_INPUT))),
    ("in common with the input at 0 Hz", lambda: frf.h2(spectra(blocks=SILENT_INPUT))),
    ("no output at 0 Hz in channel 1", lambda: frf.hv(spectra(blocks=SILENT_OUTPUT))),
    (
        "output 1 has nothing in common",
        lambda: frf.hv(CrossSpectra([1.0], [[[1.0]]], [[[0.0]]], [[[2.0]]], 3), 0.5),
    ),
    *(
        ("a coherence is from 0 to 1", lambda c=c: frf.magnitude_error(c, 5))
        for c in (-0.1, 1.1, NAN)
    ),
    ("no random error that could be told", lambda: frf.magnitude_error(0.5, 2, 2)),
    ("average more", lambda: frf.coherence_bias(0.5, 1)),
    ("holds no sample", lambda: frf.force_window(8, 8.0, 2.0, 3.0)),
    ("taper of -1", lambda: frf.force_window(8, 8.0, 0.0, 1.0, -1.0)),
    ("time constant of an exponential", lambda: frf.exponential_window(8, 8.0, 0.0)),
    ("time constant of an exponential", lambda: frf.corrected_pole(-1 + 9j, 0.0)),
    ("time constant of an exponential", lambda: frf.corrected_damping_ratio(0.1, 5.0, -1.0)),
    ("decays more slowly", lambda: frf.corrected_pole([-20 + 300j, -5 + 100j], 0.1)),
    *((r"\(8, 3\) and \(7, 3\) cannot", lambda f=f: f(CURVES, CURVES[1:])) for f in COMPARED),
    *(("cannot be compared", lambda f=f: f(1.0, 2.0)) for f in COMPARED),
    *(("zero on all lines", lambda f=f: f(CURVES, 0 * CURVES)) for f in COMPARED),
    *(("zero on all lines", lambda f=f: f(0 * CURVES, CURVES)) for f in COMPARED),
    # orders
    ("time record: shape", lambda: vold_kalman(RECORD[:, 0])),
    ("phase of the orders: shape", lambda: vold_kalman(phase=ANGLE)),
    ("too few", lambda: vold_kalman(phase=np.empty((1000, 0)))),
    ("too few for the filter", lambda: vold_kalman(RECORD[:4], PHASE[:4])),
    ("not finite", lambda: vold_kalman(phase=NOT_FINITE[:, np.newaxis])),
    ("bandwidths of the orders: shape", lambda: vold_kalman(bandwidth=[2.0, 3.0])),
    ("must not turn back", lambda: vold_kalman(phase=TURNS_BACK[:, np.newaxis])),
    ("not between 0 and the rate, 500 Hz", lambda: vold_kalman(bandwidth=0.0)),
    ("not between 0 and the rate", lambda: vold_kalman(bandwidth=600.0)),
    ("wider than the lowest frequency of its order, 20", lambda: vold_kalman(bandwidth=21.0)),
    ("too narrow for 500 Hz", lambda: vold_kalman(bandwidth=5e-5)),
    ("500 Hz is too low for 150 Hz: it needs 600", lambda: orders.lower_rate(RECORD, RATE, 150.0)),
    ("30 samples are too few", lambda: orders.lower_rate(RECORD[:30], RATE, 5.0)),
    *(
        ("cycles per revolution", lambda f=f, order=order: f(1000, order))
        for f in (orders.frequency_of_order, orders.rpm_of_frequency)
        for order in (0, -1.5, NAN, INF)
    ),
    *(
        ("whole number of at least 1", lambda n=n: orders.dominant_order(n))
        for n in (0, -3, 2.5, NAN)
    ),
    # levels
    *(
        ("positive, finite frequencies", lambda f=f: sound.a_weighting([30.0, f]))
        for f in (0.0, -20.0, NAN, INF)
    ),
    (
        r"no line between 100.0 and 200.0 Hz.*20.0 to 40.0 Hz",
        lambda: sound.band_energy_level([50.0, 70.0, 60.0], LINES, (100.0, 200.0)),
    ),
    ("lower edge first", lambda: sound.band_energy_level(np.ones(3), LINES, (40.0, 20.0))),
    (r"axis 0 of shape \(2, 3\)", lambda: sound.spl(np.ones((2, 3)), LINES)),
    ("axis that holds the lines", lambda: sound.band_energy_level(np.ones(4), LINES, (20, 40))),
    ("two lines or more", lambda: sound.run_up_sound(np.ones(1), [20.0], 1.0, 1e3)),
    ("in rising order", lambda: sound.run_up_sound(np.ones(2), [30.0, 20.0], 1.0, 1e3)),
    ("give a time above 0", lambda: sound.run_up_sound(np.ones(2), [20.0, 30.0], 0.0, 1e3)),
    ("more than 120 samples", lambda: sound.run_up_sound(np.ones(2), [20.0, 30.0], 1.0, 120.0)),
    # transfer paths and force inversion
    *(
        ("of the paths: shape", lambda a=a, b=b: paths.contributions(np.ones(a), np.ones(b)))
        for a, b in (
            ((4, 2), (4, 3)),
            ((4, 2), (5, 2)),
            ((4,), (4,)),
            ((4, 1, 2), (4, 1, 2)),
            ((4, 2, 3), (4, 2)),
        )
    ),
    *(
        ("paths 0 to 2 exactly once", lambda g=g: paths.partial_sums(np.ones((4, 3)), g))
        for g in ([[0, 1]], [[0, 1], [1, 2]], [[0, 1], [2, 3]], [[0], [1, 2, -1]])
    ),
    ("shape", lambda: paths.mounted_source(np.ones((5, 2)), np.ones((5, 2)))),
    ("shape", lambda: paths.mounted_source(BODY, np.ones((5, 3)))),
    ("shape", lambda: paths.interface_force(np.ones((5, 2, 3)), BODY, np.ones((5, 2)))),
    ("shape", lambda: paths.interface_force(BODY, BODY[:4], np.ones((5, 2)))),
    ("shape", lambda: paths.interface_force(BODY, BODY, np.ones((5, 3)))),
    ("shape", lambda: paths.blocked_force(BODY, np.ones(5))),
    ("shape", lambda: paths.blocked_force_on_rig(BODY, np.ones((4, 2)), np.ones((5, 2)))),
    ("shape", lambda: paths.assembled_frf(BODY[:, :, :1], BODY, BODY, BODY)),
    ("shape", lambda: paths.assembled_frf(BODY, BODY, BODY, BODY[:, :1])),
    *(
        ("shape", lambda k=k, b=b: paths.mount_force(np.ones(k), np.ones((4, 2)), np.ones(b)))
        for k, b in (((4, 2), (4, 3)), ((4, 3), (4, 2)), ((4, 2, 3), (4, 2)), ((2,), (2,)))
    ),
    ("carries no force", lambda: paths.mounted_source(BODY, np.zeros((5, 2)))),
    ("only together", lambda: paths.blocked_force(np.ones((3, 2, 2)), np.ones((3, 2)))),
    *(
        ("shape", lambda f=f, n=n, w=w: f(np.ones(n), np.ones(w)))
        for f in (paths.energy_share, paths.rms_contribution)
        for n, w in (((4, 2), 3), ((4,), 4))
    ),
    ("no energy to share", lambda: paths.energy_share([[1.0, -1.0]])),
    ("responses: shape", lambda: invert_for_forces(MATRICES[..., :2], RESPONSES[:2], PLAIN)),
    ("responses: .* not finite", lambda: invert_for_forces(MATRICES, RESPONSES * NAN, PLAIN)),
    ("above 0", lambda: invert_for_forces(MATRICES, RESPONSES, PLAIN, np.zeros(4))),
    ("of the indicators: shape", lambda: invert_for_forces(MATRICES, RESPONSES, PLAIN, LINES)),
    ("4 unknown forces from as many indicators", lambda: invert_for_forces(MATRICES, RESPONSES)),
    ("0 to 1", lambda: Inversion(Regularisation.TIKHONOV, 1.5)),
]


@pytest.mark.parametrize(("sentence", "call"), REFUSED)
def test_what_has_no_answer_is_refused(sentence, call):
    with pytest.raises(InputError, match=sentence):
        call()
