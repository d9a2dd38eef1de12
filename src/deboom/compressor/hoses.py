"""Hoses as viscoelastic beams, and what sweeps and hammer tests say about their stiffness.

A demonstrator. Real hoses bend, are braided, carry pressure and coolant; none of that is in a
straight uniform beam.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray, derivatives
from deboom.compressor.identified_compressor import Identification
from deboom.compressor.inertance_fit import thinned
from deboom.compressor.routes import FactorOverFrequency
from deboom.compressor.self_calibration import deviation_from_coherence
from deboom.compressor.unbalance_load import RotationSense, gyroscopic_mass
from deboom.errors import InputError
from deboom.measurement.compressor_test import (
    HoseDrawing,
    HoseState,
    InertanceTest,
    OperatingSweep,
    OperatingTest,
)
from deboom.physics.rigid_body import forward_matrices, forward_matrix
from deboom.physics.viscoelastic_beam import (
    ViscoelasticBeam,
    beam_congruence,
    beam_stiffness,
    frame_along,
)

BEAM_NUMBERS = ("tension", "torsion", "bending", "line_mass", "loss_factor")
"""What is identified of each hose, by logarithms: EA, GJ, EI, mass per length, loss factor."""
BEAM_UNITS = ("N", "N m²", "N m²", "kg/m", "1")
"""Of `BEAM_NUMBERS`."""
PLACE_NUMBERS = ("x", "y", "z", "tilt 1", "tilt 2", "ln length")
"""What may be wrong with the drawing of each hose: port, direction, length [m, rad, 1]."""
_BEAM = [*range(len(BEAM_NUMBERS)), -1]
"""Which numbers make the beam: `BEAM_NUMBERS` and the length."""
_PLACES = slice(len(BEAM_NUMBERS), -1)
STEP = 5e-4
"""Of differences by `BEAM_NUMBERS` and `PLACE_NUMBERS` [1, m, rad]."""
RANK_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class HoseMatrices:
    """Dynamic stiffness of n hoses, seen at the virtual point and at their ends on the body.

    `point` (n_frequency, 6, 6): load on the hoses at the virtual point per its motion, body ends
    fixed [N/m, N/rad, N m/rad]; `transfer` (n_frequency, 6
    n, 6): load of the hoses on the body at their ends per motion of the virtual point; six rows per
    hose, global axes [N/m, N/rad, N m/rad]; `body` (n_frequency, 6 n, 6 n): load on the hoses at
    the body's ends per motion of these ends, virtual point fixed; block diagonal [N/m, N/rad, N
    m/rad].

    With motions u at the virtual point and b at the body's ends, the hoses push on the body with
    ``transfer u − body b`` and on the compressor with ``transferᵀ b − point u``: a beam is
    reciprocal.
    """

    point: ComplexArray
    transfer: ComplexArray
    body: ComplexArray


def hose_matrices(hoses: Sequence[HoseDrawing], frequency: npt.ArrayLike) -> HoseMatrices:
    """Compute the dynamic stiffness of hoses.

    - `hoses`: at least one hose; as drawn, or as identified.
    - `frequency` (n_frequency,): lines above 0 [Hz].
    - raises InputError: no hose, or a line at 0 Hz.
    """
    if not hoses:
        raise InputError("there is no drawing of a hose: state port, direction, length and beam")
    lines = np.asarray(frequency, dtype=float)
    n = len(hoses)
    point = np.zeros((lines.size, 6, 6), dtype=complex)
    transfer = np.zeros((lines.size, 6 * n, 6), dtype=complex)
    body = np.zeros((lines.size, 6 * n, 6 * n), dtype=complex)
    for number, hose in enumerate(hoses):
        turn = beam_congruence(frame_along(hose.direction), hose.position)
        numbers = {name: getattr(hose, name) for name in (*BEAM_NUMBERS, "length")}
        beam = ViscoelasticBeam(torsion_radius=hose.torsion_radius, **numbers)
        both = turn.T @ beam_stiffness(beam, lines) @ turn
        rows = slice(6 * number, 6 * number + 6)
        point += both[:, :6, :6]
        transfer[:, rows] = -both[:, 6:, :6]
        body[:, rows, rows] = both[:, 6:, 6:]
    return HoseMatrices(point, transfer, body)


def changed_hose(hose: HoseDrawing, numbers: npt.ArrayLike) -> HoseDrawing:
    """Move a hose by what the identification varies.

    `numbers` (11,): logarithms of the ratios of `BEAM_NUMBERS`, then `PLACE_NUMBERS`: shift of the
    port, two tilts of the direction, logarithm of the ratio of the length [1, m, rad, 1].
    """
    values = np.asarray(numbers, dtype=float)
    n = len(BEAM_NUMBERS)
    drawn = np.array([getattr(hose, name) for name in BEAM_NUMBERS])
    beam = dict(zip(BEAM_NUMBERS, (drawn * np.exp(values[:n])).tolist(), strict=True))
    shift, tilt, longer = values[n : n + 3], values[n + 3 : n + 5], values[n + 5]
    frame = frame_along(hose.direction)
    return replace(
        hose,
        position=hose.position + shift,
        direction=frame[:, 0] + frame[:, 1:] @ tilt,
        length=float(hose.length * np.exp(longer)),
        **beam,
    )


def point_derivatives(
    hoses: Sequence[HoseDrawing], numbers: npt.ArrayLike, frequency: npt.ArrayLike
) -> ComplexArray:
    """Differentiate `HoseMatrices.point` by the numbers of `changed_hose`.

    `numbers` (n, 11): where the derivatives are taken; `frequency` (n_frequency,): lines above 0
    [Hz]. Returns (n, 11, n_frequency, 6, 6).
    """
    lines = np.asarray(frequency, dtype=float)
    slopes = [
        _point_derivatives(hose, row, lines)
        for hose, row in zip(hoses, np.asarray(numbers, dtype=float), strict=True)
    ]
    return np.stack(slopes)


def _point_derivatives(hose: HoseDrawing, numbers: RealArray, lines: RealArray) -> ComplexArray:
    """Differentiate one hose: its beam where it lies, and its place with the beam as it is."""

    def stiffness(rows: RealArray) -> ComplexArray:
        ratios = np.exp(rows).T[..., np.newaxis]
        values = np.array([getattr(hose, name) for name in (*BEAM_NUMBERS, "length")])
        *beam, length = values[:, np.newaxis, np.newaxis] * ratios
        named = dict(zip(BEAM_NUMBERS, beam, strict=True))
        beams = ViscoelasticBeam(length=length, torsion_radius=hose.torsion_radius, **named)
        return beam_stiffness(beams, lines)[..., :6, :6]

    drawn = frame_along(hose.direction)

    def congruence(rows: RealArray) -> RealArray:
        frame = frame_along(drawn[:, 0] + rows[:, 3:] @ drawn[:, 1:].T)
        port = (hose.position + rows[:, :3])[:, np.newaxis]
        moved = forward_matrices(port, frame[:, np.newaxis])
        turned = forward_matrices(np.zeros_like(port), frame[:, np.newaxis])
        return np.concatenate([moved, np.roll(turned, 3, axis=-1)], axis=1)

    of_beam, of_place = numbers[_BEAM], numbers[_PLACES]
    turn, now = congruence(of_place[np.newaxis])[0], stiffness(of_beam[np.newaxis])[0]
    by_beam = turn.T @ derivatives(stiffness, of_beam, STEP) @ turn
    turned = derivatives(congruence, of_place, STEP)[:, np.newaxis]
    half = np.swapaxes(turned, -1, -2) @ (now @ turn)
    by_place = half + np.swapaxes(half, -1, -2)
    return np.concatenate([by_beam[:-1], by_place, by_beam[-1:]])


def port_forces(hoses: Sequence[HoseDrawing]) -> tuple[int, RealArray]:
    """Find the forces at the ports that a wrench at the virtual point leaves open.

    Returns the number of the 3 n forces that the wrench determines, and sets of forces at the ports
    that have no wrench, (3 n - rank, 3 n): nothing at the virtual point shows them [1].

    ``w = Σ V_iᵀ f_i``. Two ports have six forces and the wrench has six entries, yet the rank is 5:
    forces that push the ports apart along the line between them have no wrench.
    """
    positions = np.array([hose.position for hose in hoses])
    spread = float(np.abs(positions).max()) or 1.0
    wrench = np.hstack([forward_matrix(place / spread).T for place in positions])
    _, values, right = np.linalg.svd(wrench)
    rank = int(np.sum(values > RANK_TOLERANCE * values[0]))
    return rank, right[rank:]


def separation_statement(hoses: Sequence[HoseDrawing]) -> str:
    """Say in words which forces at the ports of at least one hose are not separable."""
    (rank, _), n_forces = port_forces(hoses), 3 * len(hoses)
    if rank == n_forces:
        return "The motion of the compressor determines the force at the port of the hose."
    along = ""
    if len(hoses) == 2:
        apart = hoses[1].position - hoses[0].position
        apart = apart / np.linalg.norm(apart)
        along = (
            " Forces along the line between the ports, direction "
            f"({apart[0]:.2f}, {apart[1]:.2f}, {apart[2]:.2f}), leave the compressor at rest."
        )
    return (
        f"The motion of the compressor determines {rank} of the {n_forces} forces at the "
        f"ports of {len(hoses)} hoses.{along} Each hose's own force follows from the beams that "
        "were fitted, not from the measurement alone."
    )


SAME_PRESSURE = 0.02
"""Pressures that differ by less than this part are one."""
SAME_LINE = 1e-6
"""Lines that differ by less than this part are one."""
SMALLEST_LINES = 10
HIT_SCATTER = 5e-4
"""Of the hits around their mark, per axis, 1 σ [m]."""


def running_mass(
    identification: Identification,
    frequency: npt.ArrayLike,
    *,
    change: npt.ArrayLike = 0.0,
    rotor_inertia: float | None = None,
    sense: RotationSense = RotationSense.POSITIVE,
) -> tuple[ComplexArray, ComplexArray]:
    """Turn the compressor of the hammer test into the running one, without hoses.

    `frequency` (n_frequency,): lines above 0 [Hz]; `change` (n_frequency,) or (): δ of the mounts'
    dynamic stiffness against the hammer test [1]; `rotor_inertia`: polar moment of the rotor;
    without it the gyroscopic moment is left out [kg m²]. Returns the apparent mass at the virtual
    point, ``AM = M − (1 + δ) v K/ω² + j J skew(e_x)`` in the rotational block, and the part of the
    mounts, ``(1 + δ) v K/ω²``, both (n_frequency, 6, 6) [kg, kg m, kg m²].
    """
    lines = np.asarray(frequency, dtype=float)
    model = identification.calibrated.model
    factor = (1 + np.asarray(change)) * np.ones(lines.size)
    mounts = factor[:, np.newaxis, np.newaxis] * model.mount_part(lines)
    mass = model.mass_matrix - mounts + gyroscopic_mass(rotor_inertia, sense)
    return mass, np.asarray(mounts)


@dataclass(frozen=True, eq=False)
class SweepPair:
    """Motion of the virtual point with soft and with standard hoses at one pressure.

    `soft_name`, `standard_name`: names of the sweeps; `frequency` (n_frequency,): lines of both
    [Hz]; `soft`, `standard` (n_frequency, 6): accelerations [m/s², rad/s²]; `covariance`
    (n_frequency, 6, 6): of the difference of both, of the real as of the imaginary part; `inverse`
    (6, n_channel): channels → motion of the virtual point, by which they were found.
    """

    soft_name: str
    standard_name: str
    pressure: float
    frequency: RealArray
    soft: ComplexArray
    standard: ComplexArray
    covariance: RealArray
    inverse: RealArray


def sweep_pairs(
    test: OperatingTest, identification: Identification, band: tuple[float, float] = (17.0, 150.0)
) -> tuple[SweepPair, ...]:
    """Find for each sweep with standard hoses the one with soft hoses that goes with it.

    `band`: lines that are kept [Hz]. Returns at least one, in the order of the sweeps with standard
    hoses. InputError: no pressure at which both were run over common lines.

    Rotor and gas are those of the pressure and the speed, whatever the hoses: the two motions
    differ by the hoses alone, as long as the mounts kept their temperature.
    """
    pairs = []
    for standard in test.with_hoses(HoseState.STANDARD):
        partners = [
            (soft, _common_lines(soft, standard, band))
            for soft in test.with_hoses(HoseState.SOFT)
            if abs(soft.pressure / standard.pressure - 1) < SAME_PRESSURE
        ]
        partners = [(soft, lines) for soft, lines in partners if lines[0].size >= SMALLEST_LINES]
        if not partners:
            continue
        soft, (first, second) = max(partners, key=lambda partner: partner[1][0].size)
        motion, covariance = motion_at_virtual_point(soft, identification)
        other, other_covariance = motion_at_virtual_point(standard, identification)
        pairs.append(
            SweepPair(
                soft.name,
                standard.name,
                standard.pressure,
                soft.frequency[first],
                motion[first],
                other[second],
                covariance[first] + other_covariance[second],
                _calibrated_inverse(identification),
            )
        )
    if not pairs:
        raise InputError(
            f"{test.name}: no pressure was run with standard and with soft hoses over common lines "
            f"between {band[0]:g} and {band[1]:g} Hz: what the hoses do cannot be told from what "
            "the rotor does"
        )
    return tuple(pairs)


def motion_at_virtual_point(
    sweep: OperatingSweep, identification: Identification
) -> tuple[ComplexArray, RealArray]:
    """Project the channels of a sweep on the calibrated virtual point.

    Returns `motion` (n_frequency, 6) acceleration [m/s², rad/s²], `covariance` (n_frequency, 6, 6)
    of the real as of the imaginary part. InputError: channels of other sensors than those of the
    hammer test.
    """
    if sweep.acceleration.channels != identification.test.frf.outputs:
        raise InputError(
            f"sweep {sweep.name} has other accelerometers than {identification.test.name}: the "
            "sensors must stay where they were struck"
        )
    inverse = _calibrated_inverse(identification)
    covariance = (inverse * sweep.deviation[:, np.newaxis] ** 2) @ inverse.T
    return np.asarray(sweep.acceleration.values @ inverse.T), np.asarray(covariance)


def _calibrated_inverse(identification: Identification) -> RealArray:
    """Channels → motion of the virtual point, as the hammer test calibrated them [1, 1/m]."""
    return np.asarray(np.linalg.pinv(identification.calibrated.response_matrix))


def _common_lines(
    soft: OperatingSweep, standard: OperatingSweep, band: tuple[float, float]
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Lines that both sweeps have: their indices in each of them."""
    lines, other = soft.frequency, standard.frequency
    nearest = np.abs(other - lines[:, np.newaxis]).argmin(axis=1)
    same = np.abs(other[nearest] / lines - 1) < SAME_LINE
    kept = np.flatnonzero(same & (lines >= band[0]) & (lines <= band[1]))
    return kept, nearest[kept]


class HammerEvidence:
    """Two hammer tests of one compressor: inertance with hoses less inertance without.

    In coordinates of white noise. `band`: lines that are used [Hz]. InputError: other sensors,
    impacts or lines, or no line in the band.

    `frequency` (n_frequency,): lines [Hz]; `difference` (n_frequency, 6, 6):
    ``Q_Vᵀ (Y_with − Y_without) Q_U``, with the calibrated ``V = Q_V R_V``, ``U = Q_U R_U`` [1/kg];
    `deviation` (n_frequency,): of the real as of the imaginary part of each entry [1/kg];
    `apparent_mass` (n_frequency, 6, 6): identified compressor without hoses [kg, kg m, kg m²];
    `response`, `excitation` (6, 6): R_V and R_U [1, m]; `channels`, `impacts` (n_channel, 6) and
    (n_impact, 6): Q_V and Q_U [1]; `nuisance_deviations` (18,): moments per newton by hits that
    strike elsewhere the second time, 1 σ [m].

    Errors of sensors, hammer and model are the same in both tests and leave the difference but for
    a share of itself. The hits do not strike where they struck before: 18 nuisances, moments in the
    columns of U.
    """

    name = "hammer tests"

    def __init__(
        self,
        without: InertanceTest,
        with_hoses: InertanceTest,
        identification: Identification,
        *,
        band: tuple[float, float],
        largest_lines: int,
    ) -> None:
        struck = identification.test.frf
        for test in (without, with_hoses):
            if test.frf.outputs != struck.outputs or test.frf.inputs != struck.inputs:
                raise InputError(
                    f"{test.name} has other sensors or impacts than {identification.test.name}: "
                    "keep the sensors, strike the same points"
                )
        lines = without.frf.frequency
        if not np.array_equal(lines, with_hoses.frf.frequency):
            raise InputError(
                f"{without.name} and {with_hoses.name} have other lines: record both with one "
                "setting"
            )
        kept = thinned((lines >= band[0]) & (lines <= band[1]), largest_lines)
        if not kept.any():
            raise InputError(f"{without.name} has no line between {band[0]:g} and {band[1]:g} Hz")
        calibrated = identification.calibrated
        self.frequency = lines[kept]
        self.apparent_mass = calibrated.model.apparent_mass(self.frequency)
        self.channels, self.response = np.linalg.qr(calibrated.response_matrix)
        self.impacts, self.excitation = np.linalg.qr(calibrated.excitation_matrix)
        change = (with_hoses.frf.values - without.frf.values)[kept]
        self.difference: ComplexArray = self.channels.T @ change @ self.impacts
        variance = sum(
            np.mean(
                deviation_from_coherence(test.frf, test.coherence, test.n_averages)[kept] ** 2,
                (1, 2),
            )
            for test in (without, with_hoses)
        )
        floor = (1e-9 * np.abs(without.frf.values).max()) ** 2
        self.deviation = np.sqrt(np.maximum(variance, floor))
        hits = 1 / without.n_averages + 1 / with_hoses.n_averages
        self.nuisance_deviations = np.full(18, HIT_SCATTER * np.sqrt(hits))

    def residuals(
        self, stiffness: ComplexArray, slopes: ComplexArray, nuisances: RealArray
    ) -> tuple[ComplexArray, ComplexArray]:
        """Compare a stiffness of the hoses, ``H_with = (AM − K_h/ω²)⁻¹``, with both tests.

        `stiffness` (n_frequency, 6, 6) at the virtual point [N/m, N/rad, N m/rad]; `slopes` (k,
        n_frequency, 6, 6): its derivatives by the numbers of the hoses; `nuisances`: numbers of no
        interest. Returns complex deviations (n,) in units of their noise, and their derivatives (k
        + n_nuisance, n) by the numbers of the hoses, then by the nuisances.
        """
        with_hoses, without = self._inertances(stiffness)
        seen, struck = self.response @ with_hoses, self._struck(nuisances)
        predicted = seen @ struck.T - self.response @ without @ self.excitation.T
        scale = self.deviation[:, np.newaxis, np.newaxis]
        by_hose = seen @ (slopes / _squared(self.frequency)) @ (with_hoses @ struck.T)
        by_scatter = np.zeros((6, 3, *seen.shape), dtype=complex)
        for impact in range(6):
            by_scatter[impact, :, :, :, impact] = np.moveaxis(seen[:, :, 3:], -1, 0)
        derivatives = np.concatenate([by_hose, by_scatter.reshape(18, *seen.shape)]) / scale
        deviation: ComplexArray = (predicted - self.difference) / scale
        rows = np.asarray(derivatives.reshape(len(derivatives), -1), dtype=complex)
        return deviation.reshape(-1), rows

    def by_identification(
        self,
        stiffness: ComplexArray,
        nuisances: RealArray,
        by_mass: ComplexArray,
        by_response: RealArray,
        by_excitation: RealArray,
    ) -> ComplexArray:
        """Differentiate the residuals by k errors of the identification, shape (k, n).

        They change the apparent mass (k, n_frequency, 6, 6), the calibrated sensors (k, n_channel,
        6) and impacts (k, n_impact, 6); both inertances answer.
        """
        with_hoses, without = self._inertances(stiffness)
        answer = without @ by_mass @ without - with_hoses @ by_mass @ with_hoses
        difference, struck = with_hoses - without, self._struck(nuisances).T
        seen = (self.channels.T @ by_response)[:, np.newaxis]
        moved = np.swapaxes(self.impacts.T @ by_excitation, -1, -2)[:, np.newaxis]
        change = (self.response @ answer + seen @ difference) @ struck
        change = change + self.response @ difference @ moved
        scaled = change / self.deviation[:, np.newaxis, np.newaxis]
        return np.asarray(scaled.reshape(scaled.shape[0], -1))

    def _inertances(self, stiffness: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Inertance with hoses and without, shape (n_frequency, 6, 6) each."""
        with_hoses = np.linalg.inv(self.apparent_mass - stiffness / _squared(self.frequency))
        return np.asarray(with_hoses), np.asarray(np.linalg.inv(self.apparent_mass))

    def _struck(self, nuisances: RealArray) -> RealArray:
        """R_U with the hits where they struck the second time."""
        return self.excitation + np.hstack([np.zeros((6, 3)), nuisances.reshape(6, 3)])


class SweepEvidence:
    """Motion with standard hoses as predicted from that with soft ones at one pressure.

    `frequency` (n_frequency,): lines of the pair [Hz]; `apparent_mass`, `mounts` (n_frequency, 6,
    6): from `running_mass`; `whitening` (n_frequency, 6, 6): ``L⁻¹`` of the covariance of both
    motions; `basis` (n_unknown, n_frequency): change δ of the mounts in operation per real unknown,
    complex [1]; `nuisance_deviations` (n_unknown,): 1 σ of each [1].

    ``(AM − K_h/ω²) a_standard = AM a_soft``: rotor and gas drop out, no unbalance is needed, and
    the apparent mass counts in the product ``AM⁻¹ K_h`` only.
    """

    def __init__(
        self,
        pair: SweepPair,
        identification: Identification,
        rotor_inertia: float | None,
        sense: RotationSense = RotationSense.POSITIVE,
    ) -> None:
        self.name = f"sweeps {pair.standard_name} and {pair.soft_name}"
        self.pair, self.frequency = pair, pair.frequency
        self.apparent_mass, self.mounts = running_mass(
            identification, pair.frequency, rotor_inertia=rotor_inertia, sense=sense
        )
        self.whitening = np.linalg.inv(np.linalg.cholesky(pair.covariance))
        mounts = FactorOverFrequency()
        self.basis, self.nuisance_deviations = mounts.basis(pair.frequency), mounts.deviations

    def residuals(
        self, stiffness: ComplexArray, slopes: ComplexArray, nuisances: RealArray
    ) -> tuple[ComplexArray, ComplexArray]:
        """Compare a stiffness of the hoses with both motions; as `HammerEvidence.residuals`."""
        now = self._apparent_mass(nuisances)
        coupled = np.linalg.solve(now, stiffness / _squared(self.frequency))
        answer = np.linalg.inv(np.eye(6) - coupled)
        predicted = answer @ self.pair.soft[..., np.newaxis]
        deviation = self.whitening @ (predicted - self.pair.standard[..., np.newaxis])
        pushed = self.whitening @ answer @ np.linalg.inv(now)
        by_hose = (pushed @ ((slopes / _squared(self.frequency)) @ predicted))[..., 0]
        by_change = (pushed @ self.mounts @ (coupled @ predicted))[..., 0]
        derivatives = np.concatenate([by_hose, self.basis[:, :, np.newaxis] * by_change])
        return deviation.reshape(-1), derivatives.reshape(len(derivatives), -1)

    def by_identification(
        self,
        stiffness: ComplexArray,
        nuisances: RealArray,
        by_mass: ComplexArray,
        by_response: RealArray,
        by_excitation: RealArray,  # noqa: ARG002  nothing is struck in a sweep
    ) -> ComplexArray:
        """Differentiate ``a = (AM − K_h/ω²)⁻¹ AM a_soft``, with ``∂V⁺ = −V⁺ ∂V V⁺``."""
        now = self._apparent_mass(nuisances)
        loaded = now - stiffness / _squared(self.frequency)
        soft, standard = (
            motion[..., np.newaxis] for motion in (self.pair.soft, self.pair.standard)
        )
        misread = -(self.pair.inverse @ by_response)[:, np.newaxis]
        pushed = by_mass @ (soft - np.linalg.solve(loaded, now @ soft))
        answer = np.linalg.solve(loaded, pushed + now @ (misread @ soft)) - misread @ standard
        return np.asarray((self.whitening @ answer).reshape(answer.shape[0], -1))

    def _apparent_mass(self, nuisances: RealArray) -> ComplexArray:
        """Apparent mass with the change of the mounts, shape (n_frequency, 6, 6)."""
        change = nuisances @ self.basis
        return self.apparent_mass - change[:, np.newaxis, np.newaxis] * self.mounts


HoseEvidence: TypeAlias = HammerEvidence | SweepEvidence


def _squared(frequency: RealArray) -> RealArray:
    """ω² of lines, shape (n_frequency, 1, 1) [1/s²]."""
    return ((2 * np.pi * frequency) ** 2)[:, np.newaxis, np.newaxis]
