"""Stiffness of single mounts: shares of the whole, and softening with their own stroke."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares
from scipy.stats import chi2

from deboom.arrays import ComplexArray, RealArray, checked, derivatives
from deboom.compressor.identified_compressor import Identification
from deboom.compressor.model import HyperbolicAmplitude, MountsOverStroke, mount_strokes
from deboom.compressor.parameters import N_MASS, N_STIFFNESS, MinimalParameters
from deboom.compressor.routes import STATED_AT, MountsApart
from deboom.errors import InputError
from deboom.measurement.compressor_test import CompressorMount
from deboom.physics.rigid_body import forward_matrices, mount_stiffness_matrix, rotation_matrix

STIFFNESS_NUMBERS = slice(N_MASS, N_MASS + N_STIFFNESS)
"""Places of K_VP among the numbers of `MinimalParameters`."""
PER_MOUNT = 9
"""Shift, turn and logarithm of stiffness, three each."""
STEP = 1e-3
"""Of differences by standard normal numbers."""
EXACT = 1e-8
"""Variance over the largest one below which a combination of numbers counts as exact [1]."""
SMALLEST_PROBABILITY = 1e-3
"""Of test and drawing together, below which mounts of a kind are refuted."""
REFERENCE_STROKE = 20e-6
"""From which decades are counted, about the middle of what a compressor does [m]."""
SMALLEST_STROKE = 1e-7
"""Below it no rubber softens, and a mount at rest has no logarithm [m]."""
DRAWN_PLACE, DRAWN_ANGLE, DRAWN_STIFFNESS = 6.3e-3, math.radians(2.5), 0.175
"""1 σ of a drawing, half of the thesis's bounds: of a coordinate [m], of an angle [rad], and of the
logarithm of each stiffness of a mount [1]."""
DRAWN_SCALE = 0.5
"""1 σ of the logarithm common to all: drawings are static, a test sees its reference line [1]."""
DEVIATIONS = (0.3, 0.3, 0.2)
"""1 σ of change, slope per decade and curvature per decade², real and imaginary part [1]."""


@checked(values="n", by_test="n 20", by_drawing="n k", covariance="n n", prior_deviations="n")
class MountShares:
    """Single mounts, and how uncertain it is what each of them carries.

    `values` (n,): per mount shift [m], turn [rad] and logarithm of the ratio of its stiffness [1];
    last the logarithm of a common ratio [1]; `by_test` (n, 20): change of `values` per change of
    the test's K_VP, in numbers of `MinimalParameters`; `by_drawing` (n, k): the same per error of
    the drawing, in its 1 σ; `prior_deviations` (n,): 1 σ of `values` before the test; `identical`:
    whether all are one round part; `identical_probability`: of test and drawing, were they
    identical round mounts [1]; `probability`: of test and drawing as they were used [1].
    """

    drawn: tuple[CompressorMount, ...]
    values: RealArray
    by_test: RealArray
    by_drawing: RealArray
    covariance: RealArray
    prior_deviations: RealArray
    identical: bool
    identical_probability: float
    probability: float

    @property
    def mounts(self) -> tuple[CompressorMount, ...]:
        """Mounts as found, stiffness where the real part of the gain is 1."""
        return _moved_mounts(self.drawn, self.values)

    @property
    def deviations(self) -> RealArray:
        """1 σ of place, angles and ln stiffness, shape (m, 9) [m, rad, 1]."""
        m = len(self.drawn)
        variance = np.diag(self.covariance)[:-1].reshape(m, PER_MOUNT).copy()
        # the stiffness of a mount is its own ratio times the common one
        with_common = self.covariance[:-1, -1].reshape(m, PER_MOUNT)
        variance[:, 6:] += 2 * with_common[:, 6:] + self.covariance[-1, -1]
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)))

    def deviation_of_mean(self, weights: RealArray) -> float:
        """Return 1 σ of a mean stiffness over it [1].

        `weights` (m, 3): share of each stiffness in the mean, their sum 1 [1].
        """
        of_values = np.zeros((len(self.drawn), PER_MOUNT))
        of_values[:, 6:] = weights
        slopes = np.append(of_values, 1.0)  # the common ratio is in all of them
        return float(np.sqrt(max(slopes @ self.covariance @ slopes, 0.0)))

    @property
    def identical_holds(self) -> bool:
        """Whether test and drawing agree with identical round mounts."""
        return self.identical_probability >= SMALLEST_PROBABILITY

    @property
    def alarms(self) -> tuple[str, ...]:
        """Reasons not to trust them, in words; empty where there are none."""
        if self.probability >= SMALLEST_PROBABILITY:
            return ()
        return (
            "The hammer test and the drawing of the mounts contradict each other (probability "
            f"{_power(self.probability)}): check places, directions and stiffness in the drawing.",
        )

    @property
    def statement(self) -> str:
        """What the single mounts rest on, in words."""
        if self.identical_holds:
            return (
                "The hammer test agrees with identical round mounts (probability "
                f"{self.identical_probability:.2g}) and then shows what each of them carries."
            )
        return (
            "By the hammer test the mounts are not identical and round (probability "
            f"{_power(self.identical_probability)}). It shows the stiffness of all of them "
            "together. How they share it comes from their drawing, and the bands contain what that "
            "leaves open."
        )

    def at_random(
        self, stiffness: npt.ArrayLike, generator: np.random.Generator
    ) -> tuple[CompressorMount, ...]:
        """Draw mounts that test and drawing allow.

        `stiffness` (20,): change of the test's K_VP in this draw, in numbers of `MinimalParameters`
        [1].
        """
        of_drawing = self.by_drawing @ generator.standard_normal(self.by_drawing.shape[1])
        of_test = self.by_test @ np.asarray(stiffness, dtype=float)
        return _moved_mounts(self.drawn, self.values + of_test + of_drawing)


def mount_shares(
    identification: Identification,
    drawn: tuple[CompressorMount, ...],
    *,
    position: float = DRAWN_PLACE,
    identical: bool = False,
) -> MountShares:
    """Split the stiffness at the virtual point into single mounts.

    `position`: 1 σ of each coordinate of the drawing [m]; `identical`: take identical round mounts
    even where the χ² refutes them. InputError: fewer than two mounts.

    K_VP has 20 numbers and three mounts have 27, which no test at one virtual point can tell. The
    mounts sought fit K_VP, weighed with its posterior covariance, and the drawing, weighed with the
    prior. Identical round mounts have 17 numbers, which the test does show, if they are identical:
    they are taken unless the χ² of test and drawing refutes them.

    With whitened derivatives J of K_VP by the mounts, in 1 σ of the drawing, the posterior is
    ``P = (JᵀJ + 1)⁻¹``; errors of the test enter by ``P Jᵀ``, errors of the drawing by ``P``.
    """
    if len(drawn) < 2:
        raise InputError("a compressor on fewer than two mounts has nothing to share")
    per_mount = np.repeat([position, DRAWN_ANGLE, DRAWN_STIFFNESS], 3)
    any_mounts = np.diag([*np.tile(per_mount, len(drawn)), DRAWN_SCALE])
    one_part = _agreeing(identification, _round(drawn), _of_a_kind(any_mounts, len(drawn)))
    if identical or one_part.probability >= SMALLEST_PROBABILITY:
        return replace(one_part, identical=True)
    probability = one_part.probability
    return replace(_agreeing(identification, drawn, any_mounts), identical_probability=probability)


def _moved_mounts(
    drawn: tuple[CompressorMount, ...], values: RealArray
) -> tuple[CompressorMount, ...]:
    """Shift, turn and stiffen mounts; see `MountShares` for the numbers."""
    rows = values[:-1].reshape(len(drawn), PER_MOUNT)
    return tuple(
        replace(
            mount,
            position=mount.position + row[:3],
            rotation=mount.rotation + row[3:6],
            stiffness=mount.stiffness * np.exp(row[6:] + values[-1]),
        )
        for mount, row in zip(drawn, rows, strict=True)
    )


def _agreeing(
    identification: Identification,
    drawn: tuple[CompressorMount, ...],
    numbers: RealArray,
) -> MountShares:
    """Fit mounts ``numbers @ z`` away from the drawing, z standard normal beforehand."""
    stiffness_covariance = identification.calibrated.parameter_covariance[
        STIFFNESS_NUMBERS, STIFFNESS_NUMBERS
    ]
    variance, directions = np.linalg.eigh(stiffness_covariance)
    # an exact test has directions without any error: a valley too narrow for a search
    whiten = directions.T / np.sqrt(np.maximum(variance, EXACT * variance[-1]))[:, np.newaxis]
    basis = MinimalParameters(identification.length).stiffness_basis.reshape(N_STIFFNESS, -1)
    to_numbers = np.asarray(np.linalg.pinv(basis), dtype=float)
    wanted = identification.calibrated.values[STIFFNESS_NUMBERS]

    position, rotation, stiffness = (
        np.array([getattr(mount, name) for mount in drawn])
        for name in ("position", "rotation", "stiffness")
    )

    def residuals(z: RealArray) -> RealArray:
        values = z @ numbers.T
        rows = values[..., :-1].reshape(*z.shape[:-1], len(drawn), PER_MOUNT)
        whole = mount_stiffness_matrix(
            position + rows[..., :3],
            stiffness * np.exp(rows[..., 6:] + values[..., -1:, np.newaxis]),
            rotation_matrix(rotation + rows[..., 3:6]),
        )
        off = whole.reshape(*z.shape[:-1], -1) @ to_numbers - wanted
        return np.concatenate([off @ whiten.T, z], axis=-1)

    def jacobian(z: RealArray) -> RealArray:
        return derivatives(residuals, z, STEP).T

    solved = least_squares(residuals, np.zeros(numbers.shape[1]), jac=jacobian)
    slopes = np.asarray(solved.jac)[:N_STIFFNESS]
    posterior = np.linalg.inv(slopes.T @ slopes + np.eye(slopes.shape[1]))
    probability = float(chi2.sf(2 * solved.cost, N_STIFFNESS))
    return MountShares(
        drawn=drawn,
        values=numbers @ solved.x,
        by_test=numbers @ posterior @ slopes.T @ whiten,
        by_drawing=numbers @ posterior,
        covariance=numbers @ posterior @ numbers.T,
        prior_deviations=np.sqrt(np.sum(numbers**2, axis=1)),
        identical=False,
        identical_probability=probability,
        probability=probability,
    )


def _of_a_kind(numbers: RealArray, n_mount: int) -> RealArray:
    """Numbers of mounts that have one axial and one radial stiffness in common."""
    axial = [PER_MOUNT * mount + 6 for mount in range(n_mount)]
    stiffness = [place + axis for place in axial for axis in range(3)]
    ratio = numbers[:, axial].sum(axis=1, keepdims=True)
    return np.hstack([np.delete(numbers, stiffness, axis=1), ratio])


def _round(drawn: tuple[CompressorMount, ...]) -> tuple[CompressorMount, ...]:
    """Give all mounts the mean axial and the mean radial stiffness of the drawing."""
    stiffness = np.array([mount.stiffness for mount in drawn])
    radial = stiffness[:, 1:].mean()
    mean = np.array([stiffness[:, 0].mean(), radial, radial])
    return tuple(replace(mount, stiffness=mean) for mount in drawn)


def _power(probability: float) -> str:
    """Write a small probability."""
    return "below 1e-12" if probability < 1e-12 else f"{probability:.0e}"


def stiffness_of_mounts(mounts: tuple[CompressorMount, ...]) -> RealArray:
    """Compute the stiffness of each mount in fixed axes, ``R diag(k) Rᵀ``, (n, 3, 3) [N/m]."""
    turn = np.array([mount.orientation for mount in mounts])
    along = np.array([mount.stiffness for mount in mounts])[:, np.newaxis, :]
    return np.asarray((turn * along) @ np.swapaxes(turn, 1, 2))


@checked(positions="n 3", stiffness="n 6 6")
class SofteningMounts:
    """Factor ``1 + δ(s_i)`` on each mount, a parabola over the logarithm of its own stroke s_i.

    `positions` (n, 3): places of the mounts, from the virtual point [m]; `stiffness` (n, 6, 6):
    what each of them adds to K_VP [N/m, N/rad, N m/rad]. InputError: shapes that do not fit
    together.

    ``δ(s) = a + b lg(s/s₀) + c lg²(s/s₀)`` with complex a, b, c common to all mounts: linear in six
    real unknowns and close to the hyperbola of the thesis's eq. 54 and 55 over the one and a half
    decades that a run-up covers; it says nothing outside of them. The stroke is measured, not
    solved for.
    """

    positions: RealArray
    stiffness: RealArray

    def strokes(self, frequency: RealArray, motion: ComplexArray) -> RealArray:
        """Compute the `mount_strokes` of a motion.

        `frequency` (n_frequency,): lines [Hz]; `motion` (n_frequency, 6): acceleration of the
        virtual point [m/s², rad/s²]. Returns (n_frequency, n) [m].
        """
        return mount_strokes(self.positions, motion / (2 * np.pi * frequency[:, np.newaxis]) ** 2)

    def matrices(
        self, frequency: RealArray, mounts: ComplexArray, motion: ComplexArray
    ) -> ComplexArray:
        """Scale each mount by its own stroke, shape (6, n_frequency, 6, 6)."""
        over_stroke = _powers(self.strokes(frequency, motion))
        ratio = np.trace(mounts, axis1=1, axis2=2) / np.trace(self.stiffness.sum(axis=0))
        real = np.einsum("f,kfn,nab->kfab", ratio, over_stroke, self.stiffness)
        return np.stack([real, 1j * real], axis=1).reshape(-1, *mounts.shape)

    @property
    def deviations(self) -> RealArray:
        """1 σ of both parts of a, of b and of c, shape (6,) [1]."""
        return np.repeat(DEVIATIONS, 2)

    def change_at(self, values: RealArray, stroke: npt.ArrayLike) -> ComplexArray:
        """Compute the change δ of a mount's stiffness.

        `values` (6,): the unknowns [1]; `stroke` (...): of the mount [m]. Returns (...) [1].
        """
        numbers = np.asarray(values, dtype=float).view(complex)
        return np.asarray(np.tensordot(numbers, _powers(stroke), axes=1))


@checked(positions="n 3", stiffness="n 6 6", scale=">0 <inf")
class HyperbolicMounts(SofteningMounts):
    """Factors on real and imaginary part of each mount, hyperbolas over its own stroke s_i.

    `scale`: stroke s_c at which half of what can be lost is lost [m]; the rest as of
    `SofteningMounts`.

    Thesis, eq. 54 and 55: ``Re v(f, s) = Re v(f) (v_s∞ + 1/(m_s s + s_0))``, Im v alike with
    numbers of its own, here ``1 + a + b/(1 + s/s_c)``: v_s∞ = 1 + a, s_0 = 1/b, m_s = 1/(b s_c).
    Linear in four real unknowns, a and b of either part, for one s_c of both.
    """

    scale: float

    def matrices(
        self, frequency: RealArray, mounts: ComplexArray, motion: ComplexArray
    ) -> ComplexArray:
        """Scale real and imaginary part of each mount by its own stroke, (4, n_frequency, 6, 6)."""
        over_stroke = self._over(self.strokes(frequency, motion))
        ratio = np.trace(mounts, axis1=1, axis2=2) / np.trace(self.stiffness.sum(axis=0))
        parts = np.stack([ratio.real, 1j * ratio.imag])
        each = np.einsum("pf,kfn,nab->kpfab", parts, over_stroke, self.stiffness)
        return np.asarray(each.reshape(-1, *mounts.shape))

    @property
    def deviations(self) -> RealArray:
        """1 σ of a of both parts, and of b of both, shape (4,) [1]."""
        return np.repeat(DEVIATIONS[:2], 2)

    def change_at(self, values: RealArray, stroke: npt.ArrayLike) -> ComplexArray:
        """Compute the change of the real part of a mount's stiffness.

        `values` (4,): the unknowns [1]; `stroke` (...): of the mount [m]. Returns (...), the change
        of the real part over the real part [1].
        """
        numbers = np.asarray(values, dtype=float)[::2]
        return np.asarray(np.tensordot(numbers, self._over(stroke), axes=1), dtype=complex)

    def over_stroke(self, values: RealArray) -> MountsOverStroke:
        """Return the mounts that the unknowns, (4,) [1], stand for."""
        real_limit, imaginary_limit, real_drop, imaginary_drop = np.asarray(values).tolist()
        return MountsOverStroke(
            self.positions,
            self.stiffness,
            HyperbolicAmplitude(1 + real_limit, real_drop, self.scale),
            HyperbolicAmplitude(1 + imaginary_limit, imaginary_drop, self.scale),
        )

    def _over(self, stroke: npt.ArrayLike) -> RealArray:
        """One, and what is left of a softening at a stroke."""
        left = 1 / (1 + np.asarray(stroke, dtype=float) / self.scale)
        return np.stack([np.ones_like(left), left])


def softening_mounts(identification: Identification) -> SofteningMounts | None:
    """Divide the stiffness that a hammer test found among the mounts of its drawing.

    Returns None without a drawing of at least two mounts: nothing says then what is where.

    Mounts of `mount_shares`, which add up to K_VP within its uncertainty only; ``C K_i Cᵀ`` with
    ``C = L_VP L⁻¹`` of both Cholesky factors makes them add up.
    """
    drawing = identification.test.drawing
    if drawing is None or len(drawing.mounts) < 2:
        return None
    mounts = mount_shares(identification, drawing.mounts).mounts
    positions = np.array([mount.position for mount in mounts])
    rows = forward_matrices(positions).reshape(len(mounts), 3, 6)
    parts = np.swapaxes(rows, 1, 2) @ stiffness_of_mounts(mounts) @ rows
    whole = np.linalg.cholesky(identification.calibrated.model.stiffness)
    fitting = whole @ np.linalg.inv(np.linalg.cholesky(parts.sum(axis=0)))
    return SofteningMounts(positions, fitting @ parts @ fitting.T)


def changes_of_single_mounts(
    parts: SofteningMounts,
    mounts: ComplexArray,
    law: MountsApart,
    values: RealArray,
    covariance: RealArray,
    gain: complex,
) -> RealArray:
    """Split a change of the whole stiffness among single mounts.

    `parts`: what each mount adds to K_VP; `mounts` (n_frequency, 6, 6): what `law` scales [kg, kg
    m, kg m²]; `values` (n_unknown,), `covariance` (n_unknown, n_unknown): fit of `law` [1]; `gain`:
    of the mounts at `STATED_AT` [1]. Returns the relative change of the real part of each mount's
    dynamic stiffness at `STATED_AT`, (n_mount,) [1].

    Weighted least squares of ``δ + E = Σ δ_i E_i``, E_i the share of a mount, which the drawing
    says only roughly.
    """
    whole = float(np.trace(parts.stiffness.sum(axis=0)))
    shares = [law.coordinates(law.share(part / whole, mounts)) for part in parts.stiffness]
    slopes = law.coordinates(law.change_at(STATED_AT))
    both = np.concatenate([slopes.real, slopes.imag], axis=1)
    columns = np.kron(np.eye(2), np.array(shares).real)
    wanted, noise = values @ both, both.T @ covariance @ both
    weight = np.linalg.pinv(noise, hermitian=True)
    changes = np.linalg.solve(columns @ weight @ columns.T, columns @ weight @ wanted)
    storage, loss = changes.reshape(2, -1)
    # of the product of gain and change the real part, over that of the gain
    return np.asarray(storage - gain.imag / gain.real * loss)


def _powers(stroke: npt.ArrayLike) -> RealArray:
    """Zeroth, first and second power of the decades above `REFERENCE_STROKE`."""
    decades = np.log10(np.maximum(stroke, SMALLEST_STROKE) / REFERENCE_STROKE)
    return np.stack([np.ones_like(decades), decades, decades**2])
