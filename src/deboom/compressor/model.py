"""The rigid compressor on its rubber mounts: gain, apparent mass, modes and rigid limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import DOFS, PERCENT, ComplexArray, RealArray, RealOrComplexArray, checked
from deboom.errors import InputError
from deboom.measurement.compressor_test import CompressorMount
from deboom.physics.forced_response import SMALLEST_AMPLITUDE, ConvergenceError, forced_response
from deboom.physics.rigid_body import (
    forward_matrices,
    mass_matrix,
    mount_stiffness_matrix,
    rigid_body_modes,
)

GAIN_PARAMETERS = (
    "real limit",
    "real slope",
    "real offset",
    "imaginary limit",
    "imaginary slope",
    "imaginary offset",
)
"""Order of `GainFactor.values`."""
GAIN_SHAPE_NAMES = ("ln rise", "ln slope", "loss limit", "ln loss rise", "ln loss slope")
"""Order of the five numbers that leave the scale of the gain to the stiffness."""


@checked(limit=">-inf <inf", slope=">0 <inf", offset=">0 <inf")
class HyperbolicGain:
    """Real or imaginary part of a gain that rises to a limit.

    `limit`: value at high frequency [1]; `slope`: positive [s]; `offset`: positive; ``1/offset`` is
    the rise from 0 Hz to the limit [1]. InputError: a number that is not finite, or a slope or an
    offset that is not positive.

    ``v(f) = limit − 1/(slope·f + offset)`` with f in hertz: thesis, eq. 56 and 57, figure 54. Valid
    from 10 to 150 Hz.
    """

    limit: float
    slope: float
    offset: float

    def at(self, frequency: npt.ArrayLike) -> RealArray:
        """Compute the value at lines [Hz], shape (n_frequency,) [1]."""
        return self.limit - 1 / (self.slope * np.asarray(frequency, dtype=float) + self.offset)


@dataclass(frozen=True)
class GainFactor:
    """Complex gain common to all directions of all mounts, ``v(f) = v' + j v''``.

    Thesis, eq. 53, 56, 57, without its factor v_rel: v_rel, the scale of the gain and the scale of
    the static stiffness are one number, and only their product is seen in a measurement.
    """

    real: HyperbolicGain
    imaginary: HyperbolicGain

    @classmethod
    def of(cls, values: npt.ArrayLike) -> GainFactor:
        """Make a gain factor of six numbers in the order of `GAIN_PARAMETERS`."""
        numbers = [float(value) for value in np.asarray(values, dtype=float)]
        return cls(HyperbolicGain(*numbers[:3]), HyperbolicGain(*numbers[3:]))

    @property
    def values(self) -> RealArray:
        """The six numbers in the order of `GAIN_PARAMETERS`."""
        parts = (self.real, self.imaginary)
        return np.array([number for p in parts for number in (p.limit, p.slope, p.offset)])

    def at(self, frequency: npt.ArrayLike) -> ComplexArray:
        """Compute the complex value at lines [Hz], shape (n_frequency,) [1]."""
        return np.asarray(self.real.at(frequency) + 1j * self.imaginary.at(frequency))

    def expected_loss(self, frequency: npt.ArrayLike) -> RealArray:
        """Compute the imaginary part that causality ties to the real one, ``(π/2) dv'/d ln f``.

        `frequency` (n_frequency,): lines [Hz]. Returns (n_frequency,) [1]. A rubber whose imaginary
        part is several times smaller or larger is not plausible.

        First-order Kramers–Kronig relation, good for gains that vary slowly with ln f.
        """
        lines = np.asarray(frequency, dtype=float)
        rise = self.real.slope * lines / (self.real.slope * lines + self.real.offset) ** 2
        return np.pi / 2 * rise


@checked(limit=">-inf <inf", drop=">-inf <inf", scale=">0 <inf")
class HyperbolicAmplitude:
    """Real or imaginary part of a factor that falls from rest to a limit at large strokes.

    `limit`: factor at large strokes [1]; `drop`: what is lost from rest to there, negative where
    the part grows [1]; `scale`: stroke at which half of it is lost [m]. InputError: a number that
    is not finite, or a scale that is not positive.

    ``limit + drop/(1 + s/scale)``: ``v_s∞ + 1/(m_s s + s_0)`` of the thesis's eq. 54 and 55, with
    ``v_s∞ = limit``, ``s_0 = 1/drop``, ``m_s = 1/(drop·scale)``.
    """

    limit: float
    drop: float
    scale: float

    def at(self, stroke: npt.ArrayLike) -> RealArray:
        """Compute the factor at strokes [m], shape of the strokes [1]."""
        return np.asarray(self.limit + self.drop / (1 + np.asarray(stroke, float) / self.scale))


def mount_strokes(positions: RealArray, displacement: ComplexArray) -> RealArray:
    """Compute the largest distance of each mount from rest over a turn.

    `positions` (n, 3): of the mounts, from the virtual point [m]; `displacement` (n_frequency, 6):
    of the virtual point, complex peak [m, rad]. Returns (n_frequency, n) [m].

    ``|Re(x e^{jφ})|² = (xᴴx + Re(e^{2jφ} xᵀx))/2`` is largest at ``(xᴴx + |xᵀx|)/2``: an unbalance
    drives ellipses, whose root of the sum of squares is up to √2 times as large.
    """
    moved = (displacement @ forward_matrices(positions).T).reshape(len(displacement), -1, 3)
    squares = np.sum(np.abs(moved) ** 2, axis=2) + np.abs(np.sum(moved**2, axis=2))
    return np.asarray(np.sqrt(squares / 2))


@checked(positions="n 3", stiffness="n 6 6")
class MountsOverStroke:
    """Mounts whose stiffness depends on their own stroke s_i, thesis, eq. 52 to 55.

    - `positions` (n, 3): places of the mounts, from the virtual point [m].
    - `stiffness` (n, 6, 6): what each of them adds to K_VP [N/m, N/rad, N m/rad].
    - `real`, `imaginary`: factors on both parts of the gain, common to all mounts.
    - raises InputError: shapes that do not fit together.
    """

    positions: RealArray
    stiffness: RealArray
    real: HyperbolicAmplitude
    imaginary: HyperbolicAmplitude

    def strokes(self, displacement: ComplexArray) -> RealArray:
        """Compute the `mount_strokes` of a displacement."""
        return mount_strokes(self.positions, displacement)

    def matrices(self, gain: ComplexArray, strokes: npt.ArrayLike) -> ComplexArray:
        """Compute the dynamic stiffness at the virtual point, shape (n_frequency, 6, 6).

        `gain` (n_frequency,): under the hammer [1]; `strokes` (n_frequency, n) [m].
        """
        real = gain.real[:, np.newaxis] * self.real.at(strokes)
        imaginary = gain.imag[:, np.newaxis] * self.imaginary.at(strokes)
        return np.asarray(np.tensordot(real + 1j * imaginary, self.stiffness, axes=1))


def gain_numbers(values: npt.ArrayLike, reference: float) -> RealArray:
    """Compute the six numbers of the gain factor whose real part is 1 at the reference line.

    - `values` (..., 5): numbers in the order of `GAIN_SHAPE_NAMES` [1, ln Hz⁻¹, 1, 1, ln Hz⁻¹].
    - `reference`: line at which the real part is 1 [Hz].
    - returns: shape (..., 6), in the order of `GAIN_PARAMETERS`.

    ``v' = 1 − A/(b f + 1) + A/(b f_ref + 1)``, ``v'' = c − A''/(b'' f + 1)`` with A, b, A'', b''
    positive for any values: `HyperbolicGain` written in numbers that no optimiser can make invalid.
    """
    rise, slope, limit, loss_rise, loss_slope = np.moveaxis(np.asarray(values, dtype=float), -1, 0)
    # a search that goes astray must find back: e^±200 is neither zero nor infinite
    rise, slope, loss_rise, loss_slope = np.clip((rise, slope, loss_rise, loss_slope), -200, 200)
    at_reference = np.exp(slope) * reference + 1
    real = (1 + np.exp(rise) / at_reference, np.exp(slope - rise), np.exp(-rise))
    imaginary = (limit, np.exp(loss_slope - loss_rise), np.exp(-loss_rise))
    return np.stack([*real, *imaginary], axis=-1)


def gain_from_parameters(values: npt.ArrayLike, reference: float) -> GainFactor:
    """Build the gain factor of `gain_numbers`."""
    return GainFactor.of(gain_numbers(values, reference))


def gain_parameters(gain: GainFactor, reference: float) -> RealArray:
    """Find the five numbers of a gain factor of any scale, inverse of `gain_from_parameters`."""
    scale = float(gain.real.at(reference))
    return np.array(
        [
            -np.log(gain.real.offset * scale),
            np.log(gain.real.slope / gain.real.offset),
            gain.imaginary.limit / scale,
            -np.log(gain.imaginary.offset * scale),
            np.log(gain.imaginary.slope / gain.imaginary.offset),
        ]
    )


TRIANGLE_TOLERANCE = 1e-9
"""How far, relative to the largest, principal moments may break the triangle inequality."""
SMALLEST_LINES = 8
GRID = 1001
"""Steps in which the rigid limit is looked for, in f² from 0 to the highest line."""
NEARNESS = tuple(np.linspace(0.0, 0.95, 39))
"""Squared ratios of the highest line to the body's first resonance."""
_LARGEST_STEPS = 200
STEADY = 1e-9
"""Relative change of a stroke at which a steady state has been reached [1]."""


def applied(matrices: RealOrComplexArray, vectors: RealOrComplexArray) -> ComplexArray:
    """Multiply matrices, shape (..., n, a, b), with vectors, shape (n, b), line by line."""
    return np.asarray(np.einsum("...fab,fb->...fa", matrices, vectors), dtype=complex)


def mounts_at_virtual_point(mounts: Sequence[CompressorMount]) -> RealArray:
    """Add up the static 6×6 stiffness of all mounts at the virtual point.

    Returns (6, 6) symmetric stiffness [N/m, N/rad, N m/rad].

    ``K_VP = Σ T_iᵀ R_i diag(k_i) R_iᵀ T_i``; the thesis gives one mount (eq. 44) and leaves the sum
    unwritten. Mounts without rotational stiffness of their own make the trace of the coupling block
    zero, so that K_VP has 20 free entries, not 21.
    """
    return np.asarray(
        mount_stiffness_matrix(
            np.array([mount.position for mount in mounts]),
            np.array([mount.stiffness for mount in mounts]),
            np.array([mount.orientation for mount in mounts]),
        ),
        dtype=float,
    )


@checked(centre="3", inertia="3 3", stiffness="6 6")
class CompressorModel:
    """Rigid body, static stiffness at the virtual point and one gain factor.

    - `mass` [kg].
    - `centre` (3,): centre of gravity, from the virtual point [m].
    - `inertia` (3, 3): inertia about the centre of gravity, products with their sign as matrix
      elements [kg m²].
    - `stiffness` (6, 6): K_VP, static, real and symmetric [N/m, N/rad, N m/rad].
    - `gain`: gain common to all mounts; ``v(f) K_VP`` is the dynamic stiffness under the hammer.
    - `mounts`: how each mount's stiffness depends on its stroke, ``v(f, s)`` (thesis, eq. 52 to
      55); None where nothing is known of it.
    - raises InputError: shapes; asymmetry; a mass or principal moment that is not positive;
      principal moments that no distribution of mass can have (one is larger than the sum of the
      other two).
    """

    mass: float
    centre: RealArray
    inertia: RealArray
    stiffness: RealArray
    gain: GainFactor
    mounts: MountsOverStroke | None = None

    def __post_init__(self) -> None:
        for matrix, name in ((self.inertia, "inertia"), (self.stiffness, "stiffness")):
            if not np.allclose(matrix, matrix.T, rtol=0, atol=1e-9 * np.abs(matrix).max()):
                raise InputError(f"the {name} of the compressor is not symmetric")
        if not self.mass > 0:
            raise InputError(f"the compressor has a mass of {self.mass:g} kg: it must be positive")
        moments = np.linalg.eigvalsh(self.inertia)
        if moments[0] <= 0 or moments[2] > (moments[0] + moments[1]) * (1 + TRIANGLE_TOLERANCE):
            raise InputError(
                "no body has the principal moments "
                + ", ".join(f"{moment:.4g}" for moment in moments)
                + " kg m²: each must be positive and at most the sum of the other two"
            )

    @property
    def mass_matrix(self) -> RealArray:
        """Mass matrix at the virtual point, shape (6, 6) [kg, kg m, kg m²]."""
        return mass_matrix(self.mass, self.inertia, self.centre)

    def dynamic_stiffness(
        self, frequency: npt.ArrayLike, strokes: npt.ArrayLike | None = None
    ) -> ComplexArray:
        """Compute the dynamic stiffness of all mounts at the virtual point, (n_frequency, 6, 6).

        `frequency` (n_frequency,): lines [Hz]; `strokes` (n_frequency, n): peak of each mount [m];
        left out, the mounts are as under the hammer. InputError: strokes for a model without
        `mounts`.
        """
        gain = self.gain.at(frequency)
        if strokes is None:
            return np.asarray(gain[:, np.newaxis, np.newaxis] * self.stiffness)
        if self.mounts is None:
            raise InputError(
                "nothing is known of how the mounts of this compressor soften: leave the strokes "
                "out, or take the model of `deboom unbalance --softening hyperbola`"
            )
        return self.mounts.matrices(gain, strokes)

    def mount_part(
        self, frequency: npt.ArrayLike, strokes: npt.ArrayLike | None = None
    ) -> ComplexArray:
        """Compute what the mounts take off the mass matrix, ``v K_VP/ω²``, (n_frequency, 6, 6)."""
        square = (2 * np.pi * np.asarray(frequency, dtype=float)) ** 2
        stiffness = self.dynamic_stiffness(frequency, strokes)
        return np.asarray(stiffness / square[:, np.newaxis, np.newaxis])

    def apparent_mass(
        self, frequency: npt.ArrayLike, strokes: npt.ArrayLike | None = None
    ) -> ComplexArray:
        """Compute force per acceleration at the virtual point.

        `frequency` (n_frequency,): lines above 0 [Hz]; `strokes` as of `dynamic_stiffness`. Returns
        (n_frequency, 6, 6) [kg, kg m, kg m²]. InputError: a line at or below 0 Hz.

        ``AM = M − v(f, s) K_VP/ω²``, from the thesis's eq. 48-61 with the sign of its damping term
        mended.
        """
        if np.any(np.asarray(frequency, dtype=float) <= 0):
            raise InputError("a line at 0 Hz has no apparent mass: start above it")
        return np.asarray(self.mass_matrix - self.mount_part(frequency, strokes))

    def inertance(
        self, frequency: npt.ArrayLike, strokes: npt.ArrayLike | None = None
    ) -> ComplexArray:
        """Compute acceleration per force, the inverse of `apparent_mass` line by line."""
        return np.asarray(np.linalg.inv(self.apparent_mass(frequency, strokes)))

    def motion(self, load: npt.ArrayLike, frequency: npt.ArrayLike) -> ComplexArray:
        """Compute how the virtual point moves under loads, on mounts that soften with their stroke.

        `load` (n_frequency, 6): at the virtual point, complex peak [N, N m]; `frequency`
        (n_frequency,): lines above 0 [Hz]. Returns displacements, (n_frequency, 6), complex peak
        [m, rad]. InputError: loads that do not fit the lines; ConvergenceError: no steady state.

        A fixed point per line, taken half-way at a time, since near a resonance stiffness and
        stroke drive each other. Without `mounts` it is what `inertance` says.
        """
        lines = np.asarray(frequency, dtype=float)
        force = np.asarray(load, dtype=complex)
        struck = self.dynamic_stiffness(lines)
        displacement = forced_response(self.mass_matrix, struck, force, lines)
        if self.mounts is None:
            return displacement
        strokes = self.mounts.strokes(displacement)
        for _ in range(_LARGEST_STEPS):
            stiffness = self.dynamic_stiffness(lines, strokes)
            displacement = forced_response(self.mass_matrix, stiffness, force, lines)
            step = self.mounts.strokes(displacement) - strokes
            strokes = strokes + step / 2
            if np.all(np.abs(step) <= STEADY * (strokes + SMALLEST_AMPLITUDE)):
                return displacement
        worst = lines[int(np.abs(step).max(axis=1).argmax())]
        raise ConvergenceError(f"stroke and stiffness of the mounts find no rest at {worst:g} Hz")


@checked(frequency="6", loss_factor="6", shapes="6 6", energy="6 6")
class ModalTable:
    """Natural frequencies, loss factors and shapes.

    `frequency` (6,): undamped, where the stiffness is that of the mode's own frequency [Hz];
    `loss_factor` (6,): imaginary over real part of the gain at that frequency [1]; `shapes` (6, 6):
    mass-normalised, one mode per column; `energy` (6, 6): share of each motion in the kinetic
    energy, one mode per column; coupling through the mass matrix can make a share negative [1].
    """

    frequency: RealArray
    loss_factor: RealArray
    shapes: RealArray
    energy: RealArray

    @property
    def leading(self) -> tuple[str, ...]:
        """Motion with the largest share of each mode."""
        return tuple(DOFS[int(np.argmax(column))] for column in self.energy.T)


def modal_table(model: CompressorModel) -> ModalTable:
    """Solve for the six rigid-body modes.

    InputError: a stiffness with a negative direction, or a gain that is not positive at a mode.

    With one gain for all directions the shapes are those of the static stiffness, and each
    frequency solves ``f = f_s √v'(f)``; exact for the common gain only.
    """
    from scipy.optimize import fixed_point

    static, shapes = rigid_body_modes(model.mass_matrix, model.stiffness)

    def following(frequency: RealArray) -> RealArray:
        gain = model.gain.real.at(frequency)
        if np.any(gain <= 0):
            raise InputError("the gain factor is not positive at a natural frequency")
        return static * np.sqrt(gain)

    frequency = fixed_point(
        following, static, xtol=1e-12, maxiter=_LARGEST_STEPS, method="iteration"
    )
    dynamic = model.gain.at(frequency)
    energy = shapes * (model.mass_matrix @ shapes)
    return ModalTable(frequency, dynamic.imag / dynamic.real, shapes, energy)


@dataclass(frozen=True)
class RigidLimit:
    """Drift of the measured mass line: up to which frequency the compressor is rigid.

    `drift`: change of the apparent mass, less that of the mounts, from 0 Hz to the highest line:
    norm of the 6×6 matrix relative to the mass matrix, rotations scaled by the radius of gyration
    [1]; `holds_to`: frequency at which the drift reaches the tolerance; infinite where it never
    does [Hz]; `highest`: highest line judged [Hz].
    """

    drift: float
    holds_to: float
    highest: float

    @property
    def is_rigid(self) -> bool:
        """Whether the model holds on all lines."""
        return self.holds_to >= self.highest

    @property
    def statement(self) -> str:
        """One sentence for the report."""
        if self.is_rigid:
            return (
                f"The mass line does not drift: the compressor is rigid to {self.highest:.0f} Hz."
            )
        return (
            f"The apparent mass drifts by {PERCENT * self.drift:.1f} % to {self.highest:.0f} Hz: "
            f"the rigid model holds to {self.holds_to:.0f} Hz; fit lines below it only."
        )


def rigid_limit(
    model: CompressorModel,
    frequency: npt.ArrayLike,
    apparent_mass: npt.ArrayLike,
    *,
    above: float = 60.0,
    tolerance: float = 0.03,
) -> RigidLimit:
    """Judge whether the apparent mass above the mount modes is constant.

    `frequency` (n_frequency,): lines [Hz]; `apparent_mass` (n_frequency, 6, 6): measured, at the
    virtual point [kg, kg m, kg m²]; `above`: lowest line judged: below it the mounts dominate [Hz];
    `tolerance`: relative change that still counts as rigid [1]. InputError: fewer than eight lines
    above `above`.

    Towards a first resonance f_n of the body its apparent mass drifts as ``f²/(1 − (f/f_n)²)``,
    while that of a rigid body is constant: ``M_meas + v K/ω² = A + B f²/(1 − (f/f_n)²)`` is fitted
    to all 36 elements, since parts that swing against each other show in the products and the
    coupling as well as on the diagonal; f_n is looked for above the highest line. Three standard
    deviations count as none.
    """
    lines = np.asarray(frequency, dtype=float)
    judged = lines >= above
    if np.count_nonzero(judged) < SMALLEST_LINES:
        raise InputError(
            f"fewer than {SMALLEST_LINES} lines lie above {above:g} Hz: the drift of the mass line "
            "cannot be judged"
        )
    lines = lines[judged]
    left = np.asarray(apparent_mass)[judged].real + model.mount_part(lines).real
    length = np.sqrt(np.trace(model.inertia) / (3 * model.mass))
    scale = np.repeat([1.0, 1 / length], 3)
    elements = (left * np.outer(scale, scale)).reshape(lines.size, 36)
    squared = (lines / lines[-1]) ** 2
    fits = [_drift_fit(squared, elements, nearness) for nearness in NEARNESS]
    best = int(np.argmin([scatter for *_, scatter in fits]))
    level, growth, spread, scatter = fits[best]
    deviation = float(np.sqrt(scatter * spread) / level)
    # at the highest line itself the growth is that of the fitted law
    drift = float(growth / level * _drift_law(1.0, NEARNESS[best]))
    seen = drift > 3 * deviation and drift > tolerance
    grid = np.linspace(0, 1, GRID)
    beyond = growth / level * _drift_law(grid, NEARNESS[best]) > tolerance
    holds_to = float(lines[-1] * np.sqrt(grid[np.argmax(beyond)])) if seen else np.inf
    return RigidLimit(drift, holds_to, float(lines[-1]))


def _drift_law(squared: npt.ArrayLike, nearness: float) -> RealArray:
    """Growth ``f²/(1 − (f/f_n)²)`` with f and f_n relative to the highest line."""
    share = np.asarray(squared, dtype=float)
    return np.asarray(share / (1 - nearness * share))


def _drift_fit(
    squared: RealArray, elements: RealArray, nearness: float
) -> tuple[float, float, float, float]:
    """Norms of constant and growth, variance of the growth at the top over a line's, the line's."""
    columns = np.stack([np.ones_like(squared), _drift_law(squared, nearness)], axis=1)
    fit, *_ = np.linalg.lstsq(columns, elements)
    scatter = float(np.sum((elements - columns @ fit) ** 2)) / (squared.size - 2)
    variance = np.linalg.inv(columns.T @ columns)[1, 1] * float(_drift_law(1.0, nearness)) ** 2
    level, growth = np.linalg.norm(fit, axis=1)
    return float(level), float(growth), float(variance), scatter
