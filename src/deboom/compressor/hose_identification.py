"""Identification of hoses as beams, from hammer tests, from sweeps or from both.

A demonstrator: it recovers hoses that are beams. Real hoses are outside this class, and the reduced
χ is there to say so.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from deboom.arrays import RealArray
from deboom.compressor.hoses import (
    BEAM_NUMBERS,
    BEAM_UNITS,
    PLACE_NUMBERS,
    HammerEvidence,
    HoseEvidence,
    SweepEvidence,
    changed_hose,
    hose_matrices,
    point_derivatives,
    separation_statement,
    sweep_pairs,
)
from deboom.compressor.identified_compressor import Identification
from deboom.compressor.parameter_information import Knowledge, knowledge
from deboom.compressor.self_calibration import evaluated_together
from deboom.compressor.unbalance_load import RotationSense
from deboom.measurement.compressor_test import HoseDrawing, HoseState, OperatingTest
from deboom.tabled import Tabled

ALARM = 1.5
"""Reduced χ above which the hoses are not the beams that were fitted."""
LARGEST_STRETCH = 4.0
"""Prior deviations of a number beyond which the drawing or the class is doubted."""
LARGEST_EVALUATIONS = 60
NUMBERS = (*BEAM_NUMBERS, *PLACE_NUMBERS)
OTHER_START = np.array([0.25 if name in ("tension", "bending") else 0.0 for name in NUMBERS])
"""How much stiffer or softer hoses are where the search begins again."""
DEMONSTRATOR = (
    "Demonstrator: hoses are straight uniform viscoelastic beams here. Bends, braid, pressure and "
    "coolant of real hoses are outside this class."
)


DRAWN = np.array([*[0.4] * len(BEAM_NUMBERS), *[2e-3] * 3, *[math.radians(3.0)] * 2, 0.02])
"""How well hoses are known from their drawing, 1 σ of `NUMBERS`: logarithms of what makes a beam,
port [m], direction [rad] and logarithm of the length."""
BAND, SWEEP_BAND, LARGEST_LINES = (20.0, 150.0), (50.0, 150.0), 120
"""Lines of the hammer tests and of the sweeps that are used [Hz], and how many of the former: below
50 Hz mounts that soften with their motion, which the hoses change, look like hoses in a sweep."""


@dataclass(frozen=True, eq=False)
class HoseIdentification(Tabled):
    """Hoses as beams that agree best with the measurements and with their drawing.

    `numbers` (n, 11): what `changed_hose` makes of the drawn hoses to get the identified ones;
    `covariance` (11 n, 11 n): posterior, nuisances integrated out.

    See Also
    --------
    deboom.identify_hoses, deboom.running_in_car
    """

    drawn: tuple[HoseDrawing, ...]
    hoses: tuple[HoseDrawing, ...]
    numbers: RealArray
    covariance: RealArray
    knowledge: Knowledge
    reduced_chi: tuple[tuple[str, float], ...]
    converged: bool

    @property
    def worst_chi(self) -> float:
        """Largest reduced χ of a measurement [1]."""
        return max(chi for _, chi in self.reduced_chi)

    @property
    def beam_deviations(self) -> RealArray:
        """Relative 1 σ of `BEAM_NUMBERS`, shape (n, 5) [1]."""
        deviations = np.sqrt(np.diag(self.covariance)).reshape(self.numbers.shape)
        return np.asarray(deviations[:, : len(BEAM_NUMBERS)])

    @property
    def table(self) -> pd.DataFrame:
        """Drawn and identified numbers of each hose, with the standard deviation."""
        rows = [
            (hose.name, name.replace("_", " "), unit, getattr(drawn, name), getattr(hose, name))
            for drawn, hose in zip(self.drawn, self.hoses, strict=True)
            for name, unit in zip(BEAM_NUMBERS, BEAM_UNITS, strict=True)
        ]
        names = ("hose", "number", "unit", "drawn", "identified")
        table = pd.DataFrame(dict(zip(names, zip(*rows, strict=True), strict=True)))
        table["standard deviation"] = table["identified"] * self.beam_deviations.ravel()
        return table

    @property
    def alarms(self) -> tuple[str, ...]:
        """Reasons not to trust it, in words; empty where there are none."""
        alarms = [
            f"The {name} are missed by {chi:.2f} times their noise (alarm at {ALARM:g}): the hoses "
            "are not straight uniform beams, or something else changed with them."
            for name, chi in self.reduced_chi
            if chi > ALARM
        ]
        stretch = np.abs(self.numbers.reshape(-1)) / self.knowledge.prior
        far = [
            name
            for name, size in zip(self.knowledge.names, stretch, strict=True)
            if size > LARGEST_STRETCH
        ]
        if far:
            alarms.append(f"Further from the drawing than its tolerances allow: {', '.join(far)}.")
        if not self.converged:
            alarms.append("The identification of the hoses stopped before it converged.")
        return tuple(alarms)

    @property
    def statements(self) -> tuple[str, ...]:
        """What must be said with the numbers."""
        said = [DEMONSTRATOR]
        weak = self.knowledge.prior_dominated
        if weak:
            said.append(f"Mostly from the drawing, hardly from the measurement: {', '.join(weak)}.")
        said.append(separation_statement(self.hoses))
        return tuple(said)

    def samples(self, n: int, seed: int) -> tuple[tuple[HoseDrawing, ...], ...]:
        """Draw hoses from the posterior, for bands on whatever follows from them."""
        factor = np.linalg.cholesky(self.covariance)
        normals = np.random.default_rng(seed).standard_normal((n, self.numbers.size))
        around = self.numbers + (normals @ factor.T).reshape(n, *self.numbers.shape)
        return tuple(_changed(self.drawn, numbers) for numbers in around)


def identify_hoses(
    test: OperatingTest,
    identification: Identification,
    sense: RotationSense = RotationSense.POSITIVE,
) -> HoseIdentification:
    """Identify the standard hoses of an operating test from all that shows them.

    Parameters
    ----------
    test : OperatingTest
        Hoses as drawn, and hammer tests, sweeps or both with and without them.
    identification : Identification
        Identification of the hammer test without hoses.
    sense : RotationSense
        Sense of the rotor in the sweeps.

    Returns
    -------
    HoseIdentification
        Hoses as beams, numbers (n_hose, 11) with their covariance; ``alarms``; ``table``.

    Raises
    ------
    InputError
        No drawing; neither a hammer test with hoses nor a pair of sweeps; sweeps of both kinds that
        share no pressure or lines; tests with other sensors, impacts or lines.

    See Also
    --------
    deboom.read_operating_test, deboom.compressor.hose_identification.HoseIdentification
    deboom.running_in_car

    Notes
    -----
    ``H = (AM − K_h/ω²)⁻¹`` with and without hoses; sweep: ``(AM − K_h/ω²) a_standard = AM a_soft``.
    Maximum of the posterior by `scipy.optimize.least_squares`; derivatives by the nuisances are
    analytic, those by the numbers of a hose differences of the exact element. Ports, directions and
    lengths are estimated along, so that a drawing that is wrong by millimetres and degrees costs
    little. Compressor and placement stay as identified; their covariance C adds ``G C Gᵀ`` with
    ``G = (JᵀJ)⁻¹ Jᵀ ∂r/∂θ``.

    Examples
    --------
    >>> import deboom
    >>> test = deboom.read_operating_test("running")  # doctest: +SKIP
    >>> deboom.identify_hoses(test, deboom.identify(test.hammer)).table  # doctest: +SKIP
    """
    evidence: list[HoseEvidence] = []
    struck = test.hammer_with_hoses
    if struck is not None:
        both = (test.hammer, struck)
        evidence.append(
            HammerEvidence(*both, identification, band=BAND, largest_lines=LARGEST_LINES)
        )
    swept = test.with_hoses(HoseState.STANDARD) and test.with_hoses(HoseState.SOFT)
    if swept or struck is None:
        evidence += [
            SweepEvidence(pair, identification, test.rotor_inertia, sense)
            for pair in sweep_pairs(test, identification, SWEEP_BAND)
        ]
    zero = np.zeros((len(test.hoses), len(NUMBERS)))
    best = _fit(test.hoses, evidence, identification, zero)
    if best.worst_chi > ALARM:
        # one resonance may have been taken for another: look from stiffer and from softer hoses
        for signs in itertools.product((-1.0, 1.0), repeat=len(test.hoses)):
            other = _fit(test.hoses, evidence, identification, np.outer(signs, OTHER_START))
            best = min(best, other, key=lambda fit: fit.worst_chi)
    return best


def _fit(
    drawn: tuple[HoseDrawing, ...],
    evidence: Sequence[HoseEvidence],
    identification: Identification,
    start: RealArray,
) -> HoseIdentification:
    """Most probable hoses, searched from the numbers `start`, shape (n, 11)."""
    from scipy.linalg import block_diag
    from scipy.optimize import least_squares

    hose_matrices(drawn, [1.0])  # refuses hoses that are not drawn
    n = len(drawn) * len(NUMBERS)
    sizes = [part.nuisance_deviations.size for part in evidence]
    hose_deviations = np.tile(DRAWN, len(drawn))
    deviations = np.concatenate([hose_deviations, *(part.nuisance_deviations for part in evidence)])

    def split(unknowns: RealArray) -> tuple[RealArray, list[RealArray]]:
        nuisances = np.split(unknowns[n:], np.cumsum(sizes)[:-1])
        return unknowns[:n].reshape(len(drawn), -1), nuisances

    def measured(unknowns: RealArray) -> tuple[RealArray, RealArray]:
        numbers, nuisances = split(unknowns)
        hoses = _changed(drawn, numbers)
        slopes = {
            part.frequency.tobytes(): point_derivatives(drawn, numbers, part.frequency).reshape(
                n, -1, 6, 6
            )
            for part in evidence
        }
        parts = [
            part.residuals(
                hose_matrices(hoses, part.frequency).point,
                slopes[part.frequency.tobytes()],
                nuisance,
            )
            for part, nuisance in zip(evidence, nuisances, strict=True)
        ]
        rows = [np.ascontiguousarray(by_unknown).view(float).T for _, by_unknown in parts]
        by_hoses = np.concatenate([row[:, :n] for row in rows])
        jacobian = np.hstack([by_hoses, block_diag(*(row[:, n:] for row in rows))])
        values = [missed.view(float) for missed, _ in parts]
        return (
            np.concatenate([*values, unknowns / deviations]),
            np.concatenate([jacobian, np.diag(1 / deviations)]),
        )

    residuals_at, jacobian_at = evaluated_together(measured)
    result = least_squares(
        residuals_at,
        np.concatenate([start.reshape(-1), np.zeros(sum(sizes))]),
        jac=jacobian_at,
        x_scale=deviations,
        max_nfev=LARGEST_EVALUATIONS,
    )
    values, jacobian = measured(result.x)
    numbers, nuisances = split(result.x)
    hoses = _changed(drawn, numbers)
    by_error = _by_identification(evidence, nuisances, hoses, identification)
    posterior = np.linalg.inv((jacobian * deviations).T @ (jacobian * deviations))
    posterior *= np.outer(deviations, deviations)
    moved = posterior[:n] @ jacobian[: by_error.shape[0]].T @ by_error
    covariance = posterior[:n, :n] + moved @ identification.calibrated.covariance @ moved.T
    names = tuple(f"{hose.name} {number}" for hose in drawn for number in NUMBERS)
    each = np.split(values, np.cumsum([12 * part.frequency.size for part in evidence]))
    reduced_chi = [
        (part.name, float(np.sqrt(np.mean(nuisance**2))))
        for part, nuisance in zip(evidence, each, strict=False)
    ]
    return HoseIdentification(
        tuple(drawn),
        hoses,
        numbers,
        covariance,
        knowledge(names, covariance, hose_deviations),
        tuple(reduced_chi),
        bool(result.status > 0),
    )


def _changed(drawn: Sequence[HoseDrawing], numbers: RealArray) -> tuple[HoseDrawing, ...]:
    """Hoses moved by their numbers, shape (n, 11)."""
    return tuple(changed_hose(hose, row) for hose, row in zip(drawn, numbers, strict=True))


def _by_identification(
    evidence: Sequence[HoseEvidence],
    nuisances: Sequence[RealArray],
    hoses: tuple[HoseDrawing, ...],
    identification: Identification,
) -> RealArray:
    """Differentiate all real residuals by compressor and placement, shape (n, n_unknown)."""
    calibrated = identification.calibrated
    placement, errors = calibrated.placement, calibrated.errors
    n, n_errors = calibrated.values.size, errors.size
    by_response = placement.response_derivatives(errors)
    by_excitation = placement.excitation_derivatives(errors)
    split = n + by_response.shape[0]
    response = np.zeros((n + n_errors, *by_response.shape[1:]))
    excitation = np.zeros((n + n_errors, *by_excitation.shape[1:]))
    response[n:split], excitation[split:] = by_response, by_excitation
    rows = []
    for part, nuisance in zip(evidence, nuisances, strict=True):
        mass = np.zeros((n + n_errors, part.frequency.size, 6, 6), dtype=complex)
        mass[:n] = calibrated.parametrisation.sensitivities(calibrated.values, part.frequency)
        stiffness = hose_matrices(hoses, part.frequency).point
        change = part.by_identification(stiffness, nuisance, mass, response, excitation)
        rows.append(np.ascontiguousarray(change).view(float).T)
    return np.concatenate(rows)
