"""Identification of hoses as beams, from hammer tests, from sweeps or from both.

A demonstrator: it recovers hoses that are beams. Real hoses are outside this class, and the reduced
χ is there to say so.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np

from deboom.arrays import RealArray
from deboom.compressor.hose_beams import (
    BEAM_NUMBERS,
    PLACE_NUMBERS,
    changed_hose,
    hose_matrices,
    point_derivatives,
    separation_statement,
)
from deboom.compressor.hose_evidence import Changes, hammer_evidence, stack, sweep_evidence
from deboom.compressor.identifiability import Knowledge, knowledge
from deboom.compressor.unbalance_load import RotationSense
from deboom.errors import InputError
from deboom.measurement.compressor_test import HoseDrawing, HoseState

if TYPE_CHECKING:
    from deboom.compressor.hose_evidence import HoseEvidence
    from deboom.compressor.identify import Identification
    from deboom.measurement.compressor_test import OperatingTest

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


class HoseSource(Enum):
    """What hoses are identified from."""

    HAMMER = "hammer"
    """Hammer tests with and without hoses, compressor off."""
    SWEEPS = "sweeps"
    """Sweeps with standard and with soft hoses."""
    BOTH = "both"


@dataclass(frozen=True)
class HosePrior:
    """How well hoses are known from their drawing, 1 σ.

    Parameters
    ----------
    beam : float
        Of the logarithms of EA, GJ, EI, mass per length and loss factor [1].
    position : float
        Of the port, per axis [m].
    angle : float
        Of the direction, each way [rad].
    length : float
        Of its logarithm [1].

    Raises
    ------
    InputError
        A deviation that is not positive.
    """

    beam: float = 0.4
    position: float = 2e-3
    angle: float = math.radians(3.0)
    length: float = 0.02

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value > 0):
                raise InputError(f"the deviation of a hose's {field.name} must be positive")

    @property
    def deviations(self) -> RealArray:
        """In the order of `NUMBERS`, shape (11,)."""
        beam = np.full(len(BEAM_NUMBERS), self.beam)
        place = [*[self.position] * 3, *[self.angle] * 2, self.length]
        return np.concatenate([beam, place])


@dataclass(frozen=True)
class HoseOptions:
    """What the identification of hoses looks at.

    Parameters
    ----------
    source : HoseSource or None
        None takes all there is.
    band : (float, float)
        Lines of the hammer tests that are used [Hz].
    sweep_band : (float, float)
        Lines of the sweeps that are used: below 50 Hz mounts that soften with their motion, which
        the hoses change, look like hoses [Hz].
    largest_lines : int
        Of the hammer tests.
    prior : HosePrior
    sense : RotationSense
        Of the rotor in the sweeps.

    Raises
    ------
    InputError
        A band without width or fewer than 20 lines.
    """

    source: HoseSource | None = None
    band: tuple[float, float] = (20.0, 150.0)
    sweep_band: tuple[float, float] = (50.0, 150.0)
    largest_lines: int = 120
    prior: HosePrior = HosePrior()
    sense: RotationSense = RotationSense.POSITIVE

    def __post_init__(self) -> None:
        for low, high in (self.band, self.sweep_band):
            if not 0 < low < high:
                raise InputError(f"hoses: from {low:g} to {high:g} Hz is no band")
        if self.largest_lines < 20:
            raise InputError("hoses need at least 20 lines")


@dataclass(frozen=True, eq=False)
class HoseIdentification:
    """Hoses as beams that agree best with the measurements and with their drawing.

    Parameters
    ----------
    drawn, hoses : tuple of HoseDrawing
        Before and after.
    numbers : array, shape (n, 11)
        What `changed_hose` makes of the one to get the other.
    covariance : array, shape (11 n, 11 n)
        Posterior, nuisances integrated out.
    known : Knowledge
        Posterior against prior.
    reduced_chi : tuple of (str, float)
        Per measurement, residuals over noise [1].
    converged : bool
    """

    drawn: tuple[HoseDrawing, ...]
    hoses: tuple[HoseDrawing, ...]
    numbers: RealArray
    covariance: RealArray
    known: Knowledge
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
    def alarms(self) -> tuple[str, ...]:
        """Reasons not to trust it, in words; empty where there are none."""
        found = [
            f"The {name} are missed by {chi:.2f} times their noise (alarm at {ALARM:g}): the hoses "
            "are not straight uniform beams, or something else changed with them."
            for name, chi in self.reduced_chi
            if chi > ALARM
        ]
        stretch = np.abs(self.numbers.reshape(-1)) / self.known.prior
        far = [
            name
            for name, size in zip(self.known.names, stretch, strict=True)
            if size > LARGEST_STRETCH
        ]
        if far:
            found.append(f"Further from the drawing than its tolerances allow: {', '.join(far)}.")
        if not self.converged:
            found.append("The identification of the hoses stopped before it converged.")
        return tuple(found)

    @property
    def statements(self) -> tuple[str, ...]:
        """What must be said with the numbers."""
        said = [DEMONSTRATOR]
        weak = self.known.prior_dominated
        if weak:
            said.append(f"Mostly from the drawing, hardly from the measurement: {', '.join(weak)}.")
        said.append(separation_statement(self.hoses))
        return tuple(said)

    def samples(self, n: int, seed: int) -> tuple[tuple[HoseDrawing, ...], ...]:
        """Draw hoses from the posterior, for bands on whatever follows from them.

        Parameters
        ----------
        n : int
        seed : int
            From 1.

        Returns
        -------
        tuple of tuple of HoseDrawing

        Raises
        ------
        InputError
            Seed below 1.
        """
        if seed < 1:
            raise InputError(f"seed {seed} is refused: seeds are whole numbers from 1")
        factor = np.linalg.cholesky(self.covariance)
        normals = np.random.default_rng(seed).standard_normal((n, self.numbers.size))
        around = self.numbers + (normals @ factor.T).reshape(n, *self.numbers.shape)
        return tuple(_changed(self.drawn, numbers) for numbers in around)


def identify_hoses(
    test: OperatingTest, found: Identification, options: HoseOptions | None = None
) -> HoseIdentification:
    """Identify the standard hoses of an operating test.

    Parameters
    ----------
    test : OperatingTest
        With drawings of the hoses, and with what `options.source` asks for.
    found : Identification
        From the hammer test without hoses.
    options : HoseOptions, optional

    Returns
    -------
    HoseIdentification

    Raises
    ------
    InputError
        No drawing; no hammer test with hoses, no pair of sweeps.
    """
    options = options or HoseOptions()
    wanted = options.source or _available(test)
    evidence: list[HoseEvidence] = []
    if wanted is not HoseSource.SWEEPS:
        if test.hammer_with_hoses is None:
            raise InputError(
                f"{test.name} has no hammer test with hoses: identify them from sweeps, or strike "
                "the compressor with its hoses"
            )
        evidence.append(
            hammer_evidence(
                test.hammer,
                test.hammer_with_hoses,
                found,
                band=options.band,
                largest_lines=options.largest_lines,
            )
        )
    if wanted is not HoseSource.HAMMER:
        evidence += sweep_evidence(test, found, band=options.sweep_band, sense=options.sense)
    best = fit_hoses(test.hoses, evidence, options.prior, found)
    if best.worst_chi > ALARM:
        # one resonance may have been taken for another: look from stiffer and from softer hoses
        for signs in itertools.product((-1.0, 1.0), repeat=len(test.hoses)):
            start = np.outer(signs, OTHER_START)
            best = min(
                best,
                fit_hoses(test.hoses, evidence, options.prior, found, start),
                key=lambda one: one.worst_chi,
            )
    return best


def fit_hoses(
    drawn: tuple[HoseDrawing, ...],
    evidence: Sequence[HoseEvidence],
    prior: HosePrior,
    found: Identification,
    start: RealArray | None = None,
) -> HoseIdentification:
    """Fit hoses to any evidence.

    Parameters
    ----------
    drawn : tuple of HoseDrawing
        What the prior is about.
    evidence : sequence of HoseEvidence
        At least one.
    prior : HosePrior
    found : Identification
        Whose own uncertainty widens that of the hoses.
    start : array, shape (n, 11), optional
        Numbers where the search starts; by default at the drawing.

    Returns
    -------
    HoseIdentification

    Raises
    ------
    InputError
        No drawing.

    Notes
    -----
    Maximum of the posterior by `scipy.optimize.least_squares`; derivatives by the numbers of the
    beams and by the nuisances are analytic, those by the place of a hose differences of the exact
    element. Ports, directions and lengths are estimated along, so that a drawing that is wrong
    by millimetres and degrees costs little. Compressor and placement are held as identified; their
    covariance C adds ``G C Gᵀ`` with ``G = (JᵀJ)⁻¹ Jᵀ ∂r/∂θ``.
    """
    from scipy.optimize import least_squares

    hose_matrices(drawn, [1.0])
    n = len(drawn) * len(NUMBERS)
    sizes = [one.nuisance_deviations.size for one in evidence]
    hose_deviations = np.tile(prior.deviations, len(drawn))
    deviations = np.concatenate([hose_deviations, *(one.nuisance_deviations for one in evidence)])

    def nuisances_of(unknowns: RealArray) -> list[RealArray]:
        return np.split(unknowns[n:], np.cumsum(sizes)[:-1])

    latest: dict[bytes, tuple[RealArray, RealArray]] = {}

    def at(unknowns: RealArray) -> tuple[RealArray, RealArray]:
        # the optimiser asks for residuals and Jacobian of one point by turns: both cost one visit
        key = unknowns.tobytes()
        if key not in latest:
            latest.clear()
            latest[key] = measured(unknowns)
        return latest[key]

    def measured(unknowns: RealArray) -> tuple[RealArray, RealArray]:
        numbers = unknowns[:n].reshape(len(drawn), -1)
        hoses = _changed(drawn, numbers)
        slopes = {
            one.frequency.tobytes(): point_derivatives(drawn, numbers, one.frequency).reshape(
                n, -1, 6, 6
            )
            for one in evidence
        }
        values, jacobian = stack(
            [
                one.residuals(
                    hose_matrices(hoses, one.frequency).point, slopes[one.frequency.tobytes()], own
                )
                for one, own in zip(evidence, nuisances_of(unknowns), strict=True)
            ],
            n,
        )
        return (
            np.concatenate([values, unknowns / deviations]),
            np.concatenate([jacobian, np.diag(1 / deviations)]),
        )

    def residuals_at(unknowns: RealArray) -> RealArray:
        return at(unknowns)[0]

    def jacobian_at(unknowns: RealArray) -> RealArray:
        return at(unknowns)[1]

    first = np.zeros(deviations.size)
    if start is not None:
        first[:n] = start.reshape(-1)
    result = least_squares(
        residuals_at,
        first,
        jac=jacobian_at,
        x_scale=deviations,
        max_nfev=LARGEST_EVALUATIONS,
    )
    values, jacobian = at(result.x)
    numbers = result.x[:n].reshape(len(drawn), -1)
    hoses = _changed(drawn, numbers)
    by_error = _by_identification(evidence, nuisances_of(result.x), hoses, found)
    own = np.linalg.inv((jacobian * deviations).T @ (jacobian * deviations))
    own *= np.outer(deviations, deviations)
    moved = own[:n] @ jacobian[: by_error.shape[0]].T @ by_error
    covariance = own[:n, :n] + moved @ found.calibrated.covariance @ moved.T
    names = tuple(f"{hose.name} {number}" for hose in drawn for number in NUMBERS)
    return HoseIdentification(
        tuple(drawn),
        hoses,
        numbers,
        covariance,
        knowledge(names, covariance, hose_deviations),
        _reduced_chi(evidence, values),
        bool(result.status > 0),
    )


def _changed(drawn: Sequence[HoseDrawing], numbers: RealArray) -> tuple[HoseDrawing, ...]:
    return tuple(changed_hose(hose, row) for hose, row in zip(drawn, numbers, strict=True))


def _by_identification(
    evidence: Sequence[HoseEvidence],
    nuisances: Sequence[RealArray],
    hoses: tuple[HoseDrawing, ...],
    found: Identification,
) -> RealArray:
    """Differentiate all real residuals by compressor and placement, shape (n, n_unknown)."""
    calibrated = found.calibrated
    placement, errors = calibrated.placement, calibrated.errors
    n, n_errors = calibrated.values.size, errors.size
    by_response = placement.response_derivatives(errors)
    by_excitation = placement.excitation_derivatives(errors)
    split = n + by_response.shape[0]
    response = np.zeros((n + n_errors, *by_response.shape[1:]))
    excitation = np.zeros((n + n_errors, *by_excitation.shape[1:]))
    response[n:split], excitation[split:] = by_response, by_excitation
    rows = []
    for one, own in zip(evidence, nuisances, strict=True):
        mass = np.zeros((n + n_errors, one.frequency.size, 6, 6), dtype=complex)
        mass[:n] = calibrated.parametrisation.sensitivities(calibrated.values, one.frequency)
        stiffness = hose_matrices(hoses, one.frequency).point
        change = one.by_identification(stiffness, own, Changes(mass, response, excitation))
        rows.append(np.ascontiguousarray(change).view(float).T)
    return np.concatenate(rows)


def _reduced_chi(
    evidence: Sequence[HoseEvidence], values: RealArray
) -> tuple[tuple[str, float], ...]:
    """Split the residuals by measurement."""
    result, at = [], 0
    for one in evidence:
        own = values[at : at + 12 * one.frequency.size]
        at += own.size
        result.append((one.name, float(np.sqrt(np.mean(own**2)))))
    return tuple(result)


def _available(test: OperatingTest) -> HoseSource:
    pairs = test.with_hoses(HoseState.STANDARD) and test.with_hoses(HoseState.SOFT)
    if test.hammer_with_hoses is None:
        return HoseSource.SWEEPS
    return HoseSource.BOTH if pairs else HoseSource.HAMMER
