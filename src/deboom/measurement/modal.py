"""Experimental modal analysis (the only module with sdypy-EMA), mode shapes and panels."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.linalg import toeplitz
from scipy.ndimage import uniform_filter1d
from scipy.optimize import least_squares

from deboom.arrays import PERCENT, BoolArray, ComplexArray, IntArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.physics.frf import FrfForm, mac
from deboom.tabled import Tabled

LARGEST_DAMPING = 0.3
"""Damping ratio above which a pole belongs to the polynomial, not to a structure [1]."""
STABLE_FREQUENCY, STABLE_DAMPING = 0.01, 0.2
"""Relative changes from one order to the next up to which a pole is called stable [1]. Damping
scatters ten times as much as frequency; twice that keeps the weak modes of a body at 3 % noise."""
SMALLEST_ORDER = 4
LARGEST_ORDER = 40
"""Bodies with up to a mode per 3 Hz need it between 20 and 80 Hz: order 30 leaves a fifth of those
with brackets that give way unseen, order 60 sees no more of them and makes false ones [1]."""
SHIFT = 0.75
"""Of the first line: how far a band is moved towards 0 Hz where it does not carry an order at its
place. The poles just below the band stay above 0 Hz [1]."""
WIDE_BAND, PART = 32.0, 4.0
"""Last over first frequency from which a band is divided, and of each part without its overlap: one
polynomial over 5 to 380 Hz spends its order on the many high modes and loses the low ones [1]."""
LARGEST_CONDITION = 1e14
"""Condition number of the numerators' normal equations that double precision just carries [1]."""
JUST_BELOW = 0.8
"""Over the first line: a pole from there up to it bends the lowest modes more than a residual
``−L/ω²`` describes [1]."""
LARGE_ERROR = 0.05
"""Error of a rebuilt FRF that has missed something: a mode, the form, a band too narrow [1]."""
NEARBY, LARGE_NEARBY = 1.0, 0.08
"""Half-power widths of a mode on either side that show whether it is two, and the error there from
which it may be: two modes 0.8 Hz apart at 30 Hz, taken for one, leave 10 to 50 % [1]."""
FEWEST_LINES = 2.0
"""Half-power width of a mode below which a window may have made it: Hann's is 1.44 lines wide, and
flat-top windows, wider still, blunt a peak visibly [lines]."""
NOISE_LINES, LEAST_NOISE = 25, 0.05
"""Lines over which the variance of the noise is averaged, 6 Hz at 0.25 Hz: noise that is relative
to a function follows its resonances; and the share of a function's mean variance that each line has
at least [1]."""
FIT_TOLERANCES = (1e-3, 1e-3, 1e-8)
"""Relative change of the sum of squares at which each fit by maximum likelihood ends [1]: each has
the variance of the noise that the one before leaves, which the first ones only have to find."""
LARGEST_SHIFT, LARGEST_FACTOR = 2.0, 5.0
"""How far a refinement moves a pole: in angular frequency, over its decay rate, and in decay rate,
as a factor [1]. Further off it is another mode."""
CERTAIN = 8.0
"""Standard deviations beyond the mean of noise from which the residues of a mode are none of the
noise [1]: a pole goes to the line of 240 where noise is largest, 3 to 5 of them out."""
ROUNDING = 1e-6
"""Noise of exact functions over their rms [1]."""
SAME_POLE = 1e-3
"""Distance of two poles over their size below which they are one [1]."""
PRESSURE_PER_VOLUME_ACCELERATION = "Pa/(m^3/s^2)"
_FORM_NAMES = {
    FrfForm.RECEPTANCE: "receptance",
    FrfForm.MOBILITY: "mobility",
    FrfForm.INERTANCE: "accelerance",
}


@checked(pole="p", stable="p")
class StabilisationChart(Tabled):
    """Every pole of every order inside a band.

    - `order` (n_pole,): order of the polynomial that has the pole.
    - `pole` (n_pole,) [rad/s].
    - `stable` (n_pole,): whether the order below has a pole of nearly equal frequency and damping.
    - `added_decay_rate`: decay of an exponential window that was taken off every pole; 0 without
      one [1/s].
    - `below`: the same of the poles just below the band, None where nobody asked for them.
    """

    order: IntArray
    pole: ComplexArray
    stable: BoolArray
    orders: tuple[int, ...]
    band: tuple[float, float]
    added_decay_rate: float = 0.0
    below: StabilisationChart | None = None

    @property
    def frequency(self) -> RealArray:
        """Natural frequency of each pole [Hz]."""
        return np.asarray(np.abs(self.pole) / (2 * np.pi))

    @property
    def damping(self) -> RealArray:
        """Damping ratio of each pole [1]."""
        return np.asarray(-self.pole.real / np.abs(self.pole))

    @property
    def table(self) -> pd.DataFrame:
        """One row per pole."""
        return pd.DataFrame(
            {
                "order": self.order,
                "frequency [Hz]": self.frequency,
                "damping [1]": self.damping,
                "stable": self.stable,
            }
        )


@dataclass(frozen=True)
class PoleCluster:
    """One mode as the orders agree on it.

    - `frequency`, `frequency_spread`: median natural frequency over the orders and its standard
      deviation [Hz].
    - `damping`, `damping_spread`: median damping ratio over the orders and its standard deviation
      [1]; `share`: part of the orders that agree [1].
    """

    frequency: float
    frequency_spread: float
    damping: float
    damping_spread: float
    share: float

    @property
    def pole(self) -> complex:
        """Complex pole [rad/s]."""
        omega = 2 * np.pi * self.frequency
        return complex(-self.damping * omega, omega * np.sqrt(1 - self.damping**2))


def stabilisation_chart(
    poles_by_order: dict[int, ComplexArray], band: tuple[float, float]
) -> StabilisationChart:
    """Keep the poles [rad/s] of each order that a structure may have and mark the stable ones.

    Dropped by rule: poles at 0 Hz or outside the band, with negative or excessive damping, the
    conjugates, and duplicates of one order.
    """
    rows: list[tuple[int, complex, bool]] = []
    below = np.empty(0, dtype=complex)
    for order in sorted(poles_by_order):
        possible = _physical(poles_by_order[order], band)
        rows += [(order, complex(pole), _has_twin(pole, below)) for pole in possible]
        below = possible
    return StabilisationChart(
        np.array([order for order, _, _ in rows], dtype=np.int64),
        np.array([pole for _, pole, _ in rows], dtype=complex),
        np.array([stable for _, _, stable in rows], dtype=bool),
        tuple(sorted(poles_by_order)),
        band,
    )


def _physical(poles: ComplexArray, band: tuple[float, float]) -> ComplexArray:
    """Poles above 0 Hz inside the band with positive, moderate damping, each once."""
    frequency = np.abs(poles) / (2 * np.pi)
    inside = (frequency >= band[0]) & (frequency <= band[1]) & (frequency > 0)
    damping = -poles.real / np.where(inside, np.abs(poles), 1.0)
    inside &= (poles.imag > 0) & (damping > 0) & (damping < LARGEST_DAMPING)
    kept = poles[inside]
    kept = kept[np.argsort(np.abs(kept))]
    apart = np.ones(kept.size, dtype=bool)
    apart[1:] = np.abs(np.diff(kept)) > 1e-6 * np.abs(kept[1:])
    return np.asarray(kept[apart])


def _has_twin(pole: complex, others: ComplexArray) -> bool:
    near = np.abs(np.abs(others) - abs(pole)) <= STABLE_FREQUENCY * abs(pole)
    damping, theirs = -pole.real / abs(pole), -others.real / np.abs(others)
    return bool(np.any(near & (np.abs(theirs - damping) <= STABLE_DAMPING * damping)))


def pole_clusters(
    chart: StabilisationChart, width: float = 0.01, smallest_share: float = 0.25
) -> tuple[PoleCluster, ...]:
    """Gather the stable poles into modes, increasing in frequency.

    Parameters
    ----------
    chart : StabilisationChart
        Poles of all orders.
    width : float
        Largest relative gap in frequency between neighbours of one cluster [1]. Where modes lie
        closer, so that one order has two poles in a cluster, it is divided at its widest gap.
    smallest_share : float
        Part of the orders that must agree [1].

    Returns
    -------
    tuple of PoleCluster
        Frequency [Hz] and damping ratio [1] of each mode, with their spread over the orders.

    Raises
    ------
    InputError
        No cluster: a band without modes, too low an order, or too much noise.

    See Also
    --------
    deboom.poles_over_orders, deboom.refined_poles, deboom.modal_model

    Examples
    --------
    See `poles_over_orders`.
    """
    sequence = np.flatnonzero(chart.stable)
    sequence = sequence[np.argsort(chart.frequency[sequence])]
    frequency, damping = chart.frequency[sequence], chart.damping[sequence]
    order = chart.order[sequence]
    cuts = np.flatnonzero(np.diff(frequency) > width * frequency[1:]) + 1
    clusters = []
    for group in np.split(np.arange(frequency.size), cuts):
        for members in _one_pole_per_order(group, frequency, order):
            share = len(set(order[members].tolist())) / len(chart.orders)
            if members.size and share >= smallest_share:
                clusters.append(
                    PoleCluster(
                        float(np.median(frequency[members])),
                        float(np.std(frequency[members])),
                        float(np.median(damping[members])),
                        float(np.std(damping[members])),
                        share,
                    )
                )
    if not clusters:
        low, high = chart.band
        raise InputError(
            f"no pole between {low:g} and {high:g} Hz is stable over "
            f"{PERCENT * smallest_share:.0f} % of the orders: widen the band, raise the order, or "
            "measure with less noise"
        )
    return tuple(np.array(clusters, dtype=object)[_without_doubles(clusters)])


def _without_doubles(clusters: Sequence[PoleCluster]) -> BoolArray:
    """Say which clusters stay, (n_cluster,): of two with one pole, that of more orders."""
    pole, share = (np.array([getattr(c, name) for c in clusters]) for name in ("pole", "share"))
    sequence = np.argsort(-share, kind="stable")
    stays = np.ones(pole.size, dtype=bool)
    for before, number in enumerate(sequence):
        better = sequence[:before][stays[sequence[:before]]]
        stays[number] = np.all(np.abs(pole[better] - pole[number]) >= SAME_POLE * abs(pole[number]))
    return stays


def auxiliary_clusters(chart: StabilisationChart) -> tuple[PoleCluster, ...]:
    """Gather the stable poles just below the band, which `modal_model` fits and does not return.

    A mode at 0.9 of the first line is not measured, and yet its slope is most of the motion there:
    left to the residual, it turns the shape of the lowest mode.
    """
    if chart.below is None:
        return ()
    try:
        return pole_clusters(chart.below)
    except InputError:  # no mode there
        return ()


def _one_pole_per_order(
    members: npt.NDArray[np.intp], frequency: RealArray, order: IntArray
) -> list[npt.NDArray[np.intp]]:
    """Divide a cluster at its widest gap until no order has two poles in a part."""
    if len(set(order[members].tolist())) == members.size:
        return [members]
    widest = int(np.argmax(np.diff(frequency[members]))) + 1
    return [
        part
        for half in (members[:widest], members[widest:])
        for part in _one_pole_per_order(half, frequency, order)
    ]


@checked(
    residues="m o i",
    shapes="m o",
    lower_residual="o i",
    upper_residual="o i",
    rank_one="m",
    nearby_error="m",
    error="o i",
)
class ModalModel(Tabled):
    """Modes of a structure and how well they rebuild what was measured.

    - `residues` (n_mode, n_output, n_input): complex modal constants of the receptance-like form.
    - `shapes` (n_mode, n_output): complex, largest entry 1: the residues' part that all inputs
      share.
    - `lower_residual`, `upper_residual` (n_output, n_input): modes below the band, L in ``−L/ω²``,
      and above it, U, of the receptance-like form.
    - `rank_one` (n_mode,): share of the residues' energy that is one shape times one participation;
      far below 1 two modes share a pole [1].
    - `nearby_error` (n_mode,): rms deviation of the rebuilt FRFs within `NEARBY` half-power widths
      of the mode over the rms of the measured ones there; large where two modes were taken for one
      [1].
    - `error` (n_output, n_input): rms deviation of the rebuilt FRF from the measured one over the
      rms of the latter; near 1 where a channel shows noise only [1].
    - `added_decay_rate`: decay of an exponential window that is taken off the damping, and still in
      `rebuilt`, which stands beside the functions as measured; 0 without one [1/s].

    See Also
    --------
    deboom.modal_model, deboom.refined_poles
    """

    clusters: tuple[PoleCluster, ...]
    form: FrfForm
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    residues: ComplexArray
    shapes: ComplexArray
    lower_residual: ComplexArray
    upper_residual: ComplexArray
    rank_one: RealArray
    nearby_error: RealArray
    rebuilt: Frf
    error: RealArray
    total_error: float
    added_decay_rate: float = 0.0

    @property
    def frequency(self) -> RealArray:
        """Natural frequencies, shape (n_mode,) [Hz]."""
        return np.array([cluster.frequency for cluster in self.clusters])

    @property
    def damping(self) -> RealArray:
        """Damping ratios, shape (n_mode,) [1]."""
        return np.array([cluster.damping for cluster in self.clusters])

    @property
    def table(self) -> pd.DataFrame:
        """One row per mode."""
        return pd.DataFrame(
            {
                "frequency [Hz]": self.frequency,
                "damping [1]": self.damping,
                "complexity of the shape [1]": self.complexity,
                "half-power width [lines]": self.lines_per_width,
                "one shape [1]": self.rank_one,
                "unexplained nearby [1]": self.nearby_error,
            }
        )

    @property
    def complexity(self) -> RealArray:
        """How far each shape is from one phase, 1 − MPC, shape (n_mode,) [1]."""
        return 1 - phase_collinearity(self.shapes)

    @property
    def lines_per_width(self) -> RealArray:
        """Half-power width of each mode as measured over the spacing of lines, (n_mode,) [1].

        The decay of an exponential window, which is taken off the damping, is part of the width.
        """
        spacing = np.diff(self.rebuilt.frequency).min()
        width = 2 * self.damping * self.frequency + self.added_decay_rate / np.pi
        return np.asarray(width / spacing)

    @property
    def verdict(self) -> str:
        """One sentence on whether modes and residuals stand for what was measured."""
        share = f"modes and residuals leave {100 * self.total_error:.1f} % of the FRFs unexplained"
        narrow = self.frequency[self.lines_per_width < FEWEST_LINES]
        if narrow.size:
            at = ", ".join(f"{value:.1f}" for value in narrow)
            share += (
                f"; at {at} Hz the half-power width is below {FEWEST_LINES:g} lines: where the "
                "spectra had a window such as Hann, this is resolution, not damping, and one mode "
                "may stand as several; measure with longer blocks, for finer lines"
            )
        large = self.frequency[self.nearby_error > LARGE_NEARBY]
        if large.size:
            near = ", ".join(f"{value:.1f}" for value in large)
            share += (
                f"; near {near} Hz more than {100 * LARGE_NEARBY:g} %: two modes stand as one "
                "there, or noise prevails"
            )
        if self.added_decay_rate:
            share += (
                f"; the {self.added_decay_rate:g} 1/s of the exponential window are taken off the "
                "damping"
            )
        if self.total_error <= LARGE_ERROR:
            return f"{share}."
        return (
            f"{share}, more than {100 * LARGE_ERROR:g} %: a mode is missing, the FRF is of another "
            "form than stated, or noise prevails; compare the rebuilt FRFs before using the shapes."
        )


def poles_over_orders(
    frf: Frf,
    form: FrfForm,
    band: tuple[float, float],
    largest_order: int | None = None,
) -> StabilisationChart:
    """Estimate poles by least squares on a common denominator (LSCF) for growing orders.

    Parameters
    ----------
    frf : Frf
        Functions on equidistant lines at whole multiples of their step,
        (n_frequency, n_output, n_input); every pair of output and input takes part.
    form : FrfForm
        Form of the FRF, a ratio of displacement, velocity or acceleration.
    band : (float, float)
        First and last frequency; lines outside are not used [Hz].
    largest_order : int, optional
        Order of the polynomial; twice as many poles. Left out, as high as the band carries, 40 at
        most; a band of more than five octaves is then divided into parts.

    Returns
    -------
    StabilisationChart
        ``pole``, shape (n_pole,) [rad/s], the order of each, and which are stable.

    Raises
    ------
    InputError
        sdypy-EMA is not installed; lines that are not equidistant; a band outside the lines or with
        fewer lines than unknowns; an order that the band does not carry; apparent mass or another
        inverse form.

    See Also
    --------
    deboom.pole_clusters, deboom.refined_poles, deboom.modal_model

    Notes
    -----
    Which form? Modes come as ``Σ R_n/(jω − s_n)`` where motion stands over load. A displacement per
    force, a pressure per force (`Pa/N`: the air follows displacements) and an acceleration per
    volume acceleration (two derivatives above and below) are all receptance-like; an acceleration
    per force is an inertance.

    The decay that an exponential window added, `Frf.added_decay_rate`, is taken off every pole,
    ``s = s_fitted + 1/τ``; see `deboom.physics.frf.exponential_window`.

    The lines below the band are unknown to the polynomial in ``z``, whose numerators are fixed by
    the band alone: the closer the band begins to its end, the lower the order that it carries.
    Where that is too low, the band is moved towards 0 Hz first (zoom; Verboven 2002, section
    5.3.3). Poles then lack the conjugates of the structure, whose smooth part in the band the
    polynomial takes over but for some 0.1 % of a frequency: `refined_poles` takes that off.

    Examples
    --------
    >>> import deboom, numpy as np
    >>> from deboom.physics.frf import FrfForm
    >>> lines = np.arange(1, 201.0)
    >>> s, squares = 2j * np.pi * lines, (2 * np.pi * np.array([[40.0], [90.0]])) ** 2
    >>> values = (1 / (squares + 0.02 * np.sqrt(squares) * s + s**2)).sum(axis=0)
    >>> frf = deboom.Frf(lines, values[:, None, None], ("tip",), ("hammer",), "m/N")
    >>> chart = deboom.poles_over_orders(frf, FrfForm.RECEPTANCE, (10.0, 150.0), 10)
    >>> modes = deboom.pole_clusters(chart)
    >>> [round(mode.frequency, 1) for mode in modes], round(modes[0].damping, 3)
    ([40.0, 90.0], 0.01)
    >>> deboom.modal_model(frf, FrfForm.RECEPTANCE, (10.0, 150.0), modes).total_error < 1e-3
    True
    """
    if largest_order is not None:
        return _chart(frf, form, band, largest_order)
    parts = _parts(band, 5 * LARGEST_ORDER * _lines_of(frf, band)[2])
    charts = [_chart(frf, form, part, _order_carried(frf, part)) for part in parts]
    return charts[0] if len(charts) == 1 else _joined(charts, band)


def _parts(band: tuple[float, float], width: float) -> list[tuple[float, float]]:
    """Divide a wide band into parts of at least a width [Hz] that overlap by an octave."""
    low, high = band
    if high <= WIDE_BAND * low:
        return [band]
    n_parts = int(np.ceil(np.log(high / low) / np.log(PART)))
    edges = np.geomspace(low, high, n_parts + 1)
    begins, ends = edges[:-1] / np.sqrt(2), edges[1:] * np.sqrt(2)
    return [
        (float(max(begin, low)), float(min(max(end, begin + width), high)))
        for begin, end in zip(begins, ends, strict=True)
    ]


def _joined(charts: Sequence[StabilisationChart], band: tuple[float, float]) -> StabilisationChart:
    """Join the charts of overlapping bands where no mode is: in the widest gap of both."""
    kept, begin = [], band[0]
    for chart, following in zip(charts, [*charts[1:], None], strict=True):
        end = np.inf
        if following is not None:
            low, high = following.band[0], chart.band[1]
            both = np.concatenate([each.frequency[each.stable] for each in (chart, following)])
            places = np.sort([low, *both[(both > low) & (both < high)], high])
            widest = int(np.argmax(np.diff(np.log(places))))
            end = float(np.sqrt(places[widest] * places[widest + 1]))
        inside = (chart.frequency >= begin) & (chart.frequency < end)
        kept.append((chart.order[inside], chart.pole[inside], chart.stable[inside]))
        begin = end
    order, pole, stable = (np.concatenate(columns) for columns in zip(*kept, strict=True))
    orders = max((chart.orders for chart in charts), key=len)
    decay, below = charts[0].added_decay_rate, charts[0].below
    return StabilisationChart(order, pole, stable, orders, band, decay, below)


def _chart(
    frf: Frf, form: FrfForm, band: tuple[float, float], largest_order: int
) -> StabilisationChart:
    """Compute the chart of one polynomial per order."""
    unknown, total, step = _lines_of(frf, band)
    shift = _shift(unknown, total, largest_order)
    model = _ema_model(frf, form, band, largest_order, shift)
    model.get_poles("lscf", show_progress=False)
    # a pole that a window alone would move further than it lies has no decay left and is dropped
    moved = frf.added_decay_rate + 2j * np.pi * shift * step
    by_order = {
        len(poles) // 2: np.asarray(poles[poles.imag > 0] + moved, dtype=complex)
        for poles in model.all_poles
        if len(poles) // 2 >= SMALLEST_ORDER
    }
    below = stabilisation_chart(by_order, (JUST_BELOW * band[0], float(np.nextafter(band[0], 0))))
    chart = stabilisation_chart(by_order, band)
    return replace(chart, added_decay_rate=frf.added_decay_rate, below=below)


def modal_model(
    frf: Frf,
    form: FrfForm,
    band: tuple[float, float],
    clusters: Sequence[PoleCluster],
    auxiliary: Sequence[PoleCluster] = (),
) -> ModalModel:
    """Estimate modal constants and residuals for known poles, and rebuild the FRF from them.

    Least squares in the frequency domain (LSFD), each line weighed with the variance that the fit
    leaves there, with a lower and an upper residual for the modes outside the band: what a strong
    mode beside the band leaves does not turn the shapes of the others. Shapes are the leading left
    singular vectors of the residues.

    Parameters
    ----------
    frf : Frf
        Functions on equidistant lines, (n_frequency, n_output, n_input).
    form : FrfForm
        Form of the FRF, see `poles_over_orders`.
    band : (float, float)
        First and last frequency [Hz].
    clusters : sequence of PoleCluster
        Modes that are kept.
    auxiliary : sequence of PoleCluster
        Modes outside of the band that take part in the fit only, see `auxiliary_clusters`.

    Returns
    -------
    ModalModel
        ``shapes``, (n_mode, n_output) [1], residues, residuals and the rebuilt FRF.

    Raises
    ------
    InputError
        No mode, two modes with one pole, or fewer lines than unknowns; see also
        `poles_over_orders`.

    See Also
    --------
    deboom.poles_over_orders, deboom.pole_clusters, deboom.refined_poles
    deboom.measurement.modal.ModalModel

    Examples
    --------
    See `poles_over_orders`.
    """
    kept = tuple(clusters)
    if not kept:
        raise InputError("a modal model needs at least one mode")
    for first, second in itertools.pairwise(kept):
        if abs(second.pole - first.pole) < SAME_POLE * abs(first.pole):
            raise InputError(
                f"two modes share the pole at {first.frequency:.2f} Hz: keep one of them"
            )
    fit = _pole_fit(frf, form, band)
    poles = np.array([cluster.pole for cluster in (*kept, *auxiliary)])
    if fit.s.size < poles.size + 2:
        raise InputError(
            f"{fit.s.size} lines between {band[0]:g} and {band[1]:g} Hz do not fix {poles.size} "
            "modes: use a wider band, more lines or fewer modes"
        )
    for _ in FIT_TOLERANCES:
        fit = fit.reweighted(poles)
    linear = fit.linear(poles)
    pairs = len(frf.outputs), len(frf.inputs)
    residues = np.moveaxis(linear.residues[:, : len(kept)].reshape(*pairs, -1), -1, 0)
    lines = (frf.frequency >= band[0]) & (frf.frequency <= band[1])
    values = (fit.measured - fit.deviation(poles)).T.reshape(-1, *pairs)
    left, singular, _ = np.linalg.svd(residues, full_matrices=False)
    leading = left[:, :, 0]
    largest = np.take_along_axis(leading, np.abs(leading).argmax(axis=1)[:, np.newaxis], axis=1)
    measured = frf.values[lines]
    by_line = np.abs(values - measured) ** 2, np.abs(measured) ** 2
    deviation, energy = (each.sum(axis=0) for each in by_line)
    nearby = []
    for cluster in kept:
        width = cluster.damping * cluster.frequency + frf.added_decay_rate / (2 * np.pi)
        reach = max(2 * NEARBY * width, 2 * np.diff(frf.frequency)[0])
        near = np.abs(frf.frequency[lines] - cluster.frequency) <= reach
        nearby.append(np.sqrt(by_line[0][near].sum() / by_line[1][near].sum()))
    return ModalModel(
        clusters=kept,
        form=form,
        outputs=frf.outputs,
        inputs=frf.inputs,
        residues=residues,
        shapes=leading / largest,
        lower_residual=linear.lower.reshape(pairs),
        upper_residual=linear.upper.reshape(pairs),
        rank_one=singular[:, 0] ** 2 / np.sum(singular**2, axis=1),
        rebuilt=replace(frf, frequency=frf.frequency[lines], values=values),
        nearby_error=np.array(nearby),
        error=np.sqrt(deviation / np.where(energy > 0, energy, 1.0)),
        total_error=float(np.sqrt(deviation.sum() / energy.sum())),
        added_decay_rate=frf.added_decay_rate,
    )


def refined_poles(
    frf: Frf,
    form: FrfForm,
    band: tuple[float, float],
    clusters: Sequence[PoleCluster],
    auxiliary: Sequence[PoleCluster] = (),
) -> tuple[tuple[PoleCluster, ...], tuple[PoleCluster, ...]]:
    """Refine poles by maximum likelihood, after least squares on a common denominator.

    The polynomial of `poles_over_orders` weighs each line with its denominator, which makes it
    linear and biased: damping of a mode that is weak or has a near neighbour errs by 20 % at 3 %
    noise. Here the modes themselves are fitted, each line weighed with the variance of its noise.

    Parameters
    ----------
    frf : Frf
        Functions on equidistant lines, (n_frequency, n_output, n_input).
    form : FrfForm
        Form of the FRF, see `poles_over_orders`.
    band : (float, float)
        First and last frequency [Hz].
    clusters : sequence of PoleCluster
        Modes from which the fit begins.
    auxiliary : sequence of PoleCluster
        Modes outside of the band that are fitted as well, see `auxiliary_clusters`.

    Returns
    -------
    clusters, auxiliary : tuple of PoleCluster
        The modes, increasing in frequency, with frequency [Hz] and damping ratio [1] of the fit;
        spreads and shares are those of the orders. Modes whose residues noise could have made are
        left out, and of two whose poles meet in the fit that of fewer orders. A pole that would go
        further than `LARGEST_SHIFT` and `LARGEST_FACTOR` allow is as it was given; one that leaves
        the band, or lies between its last lines on either side, is an auxiliary one.

    Raises
    ------
    InputError
        No mode, or none that stands out of the noise; lines and band as for `poles_over_orders`.

    See Also
    --------
    deboom.pole_clusters, deboom.modal_model

    Notes
    -----
    The model is that of `modal_model`, as in the MLMM of El-Kafafy et al. (2013), which the thesis
    names in section 3.7.1, without its one participation per mode: minimise, over poles, residues
    and residuals, ``Σ |H − Σ_n (R_n/(s − s_n) + R_n*/(s − s_n*)) − U − L/s²|²/σ²``. Noise is
    independent from line to line; σ² is what the fit before leaves of each function, averaged over
    `NOISE_LINES` lines. Residues and residuals are linear and projected out (Golub and Pereyra),
    `scipy.optimize.least_squares` moves the poles alone. It adds no mode that the orders lack.

    Noise alone makes residues whose squares over their variance are 1 on average over the
    functions. A mode stays whose mean exceeds that by `CERTAIN` standard deviations, ``1/√n`` of n
    functions.

    Examples
    --------
    >>> import deboom, numpy as np
    >>> from dataclasses import replace
    >>> from deboom.physics.frf import FrfForm
    >>> lines = np.arange(1, 201.0)
    >>> s, squares = 2j * np.pi * lines, (2 * np.pi * np.array([[40.0], [90.0]])) ** 2
    >>> values = (1 / (squares + 0.02 * np.sqrt(squares) * s + s**2)).sum(axis=0)
    >>> frf = deboom.Frf(lines, values[:, None, None], ("tip",), ("hammer",), "m/N")
    >>> chart = deboom.poles_over_orders(frf, FrfForm.RECEPTANCE, (10.0, 150.0), 10)
    >>> rough = [replace(mode, damping=0.013) for mode in deboom.pole_clusters(chart)]
    >>> modes, _ = deboom.refined_poles(frf, FrfForm.RECEPTANCE, (10.0, 150.0), rough)
    >>> [round(mode.damping, 4) for mode in modes]
    [0.01, 0.01]
    """
    given = (*clusters, *auxiliary)
    if not given:
        raise InputError("refined poles need at least one mode to begin from")
    fit = _pole_fit(frf, form, band)
    origin = poles = np.array([cluster.pole for cluster in given])
    for tolerance in FIT_TOLERANCES:
        fit = fit.reweighted(poles)
        poles, at_limit = fit.best(poles, origin, tolerance)
    poles = np.where(at_limit, origin, poles)
    refined = [
        replace(cluster, frequency=abs(pole) / (2 * np.pi), damping=-pole.real / abs(pole))
        for cluster, pole in zip(given, poles.tolist(), strict=True)
    ]
    stays = _without_doubles(refined)
    if stays.all():
        stays = fit.strength(poles).mean(axis=0) >= 1 + CERTAIN / np.sqrt(len(fit.measured))
    # seen from one side only: two modes below the band make one between its first lines
    low, high = band[0] + _lines_of(frf, band)[2], band[1] - _lines_of(frf, band)[2]
    inside = np.array([low <= cluster.frequency <= high for cluster in refined])
    modes, outside = (
        tuple(sorted(itertools.compress(refined, part), key=lambda cluster: cluster.frequency))
        for part in (stays & inside, stays & ~inside)
    )
    if not modes:
        raise InputError(
            f"no mode between {band[0]:g} and {band[1]:g} Hz stands out of the noise: excite the "
            "body more, or average more"
        )
    return (modes, outside) if stays.all() else refined_poles(frf, form, band, modes, outside)


@dataclass(frozen=True, eq=False)
class _Linear:
    """Residues and residuals that fit best to given poles.

    - `basis` (n_pair, 2 n_line, n): orthonormal, of what n coefficients reach.
    - `residues` (n_pair, n_pole); `upper`, `lower` (n_pair,): residuals.
    - `root` (n_pair, n, n): of the covariance of the coefficients for unit variance of each real
      number.
    - `deviation` (n_pair, 2 n_line): weighted, real parts, then imaginary parts.
    """

    basis: RealArray
    residues: ComplexArray
    upper: ComplexArray
    lower: ComplexArray
    deviation: RealArray
    root: RealArray


@dataclass(frozen=True, eq=False)
class _PoleFit:
    """Modes and residuals against functions, residues and residuals being the best for each poles.

    - `s` (n_line,): jω, plus the decay of a window [rad/s]; `derivative`: of the form.
    - `measured`, `weight` (n_pair, n_line): functions, and one over their noise.
    """

    s: ComplexArray
    derivative: int
    measured: ComplexArray
    weight: RealArray

    def reweighted(self, poles: ComplexArray) -> _PoleFit:
        """Weigh each line with the variance that given poles leave there."""
        left = np.abs(self.deviation(poles)) ** 2
        local = uniform_filter1d(left, NOISE_LINES, axis=1, mode="nearest")
        smallest = ROUNDING**2 * float(np.mean(np.abs(self.measured) ** 2))
        variance = local + LEAST_NOISE * left.mean(axis=1, keepdims=True) + smallest
        return replace(self, weight=1 / np.sqrt(variance))

    def deviation(self, poles: ComplexArray) -> ComplexArray:
        """Return what the best residues and residuals leave, (n_pair, n_line)."""
        real, imaginary = np.split(self.linear(poles).deviation, 2, axis=1)
        return np.asarray((real + 1j * imaginary) / self.weight)

    def best(
        self, poles: ComplexArray, origin: ComplexArray, tolerance: float
    ) -> tuple[ComplexArray, BoolArray]:
        """Move poles [rad/s], begun at an origin, until the weighted deviation is least.

        Returns which of them stand at the limit of what may be moved, too.
        """
        decay = -origin.real

        def moved(x: RealArray) -> ComplexArray:
            real, imaginary = np.split(x, 2)
            return np.asarray(origin + decay * (real + 1j * imaginary))

        latest: tuple[RealArray, _Linear] | None = None

        def at(x: RealArray) -> _Linear:
            """Fit once for deviation and slope at the same poles: it takes most of the time."""
            nonlocal latest
            if latest is None or not np.array_equal(latest[0], x):
                latest = x.copy(), self.linear(moved(x))
            return latest[1]

        def deviation(x: RealArray) -> RealArray:
            return at(x).deviation.ravel()

        def jacobian(x: RealArray) -> RealArray:
            return self._slope(moved(x), at(x), np.concatenate([decay, 1j * decay]))

        shift = np.repeat([1 - LARGEST_FACTOR, -LARGEST_SHIFT], poles.size)
        limits = shift, np.repeat([1 - 1 / LARGEST_FACTOR, LARGEST_SHIFT], poles.size)
        begin = np.concatenate([((poles - origin) / decay).real, ((poles - origin) / decay).imag])
        begin = np.clip(begin, *limits)
        solution = least_squares(deviation, begin, jacobian, bounds=limits, ftol=tolerance)
        at_limit = (solution.active_mask != 0).reshape(2, -1).any(axis=0)
        return moved(solution.x), at_limit

    def strength(self, poles: ComplexArray) -> RealArray:
        """Return the residues' squares over their variance, (n_pair, n_pole): 1 for noise [1]."""
        linear = self.linear(poles)
        both = np.stack([linear.residues.real, linear.residues.imag], axis=-1)
        parts = np.stack([np.arange(poles.size), np.arange(poles.size) + poles.size], axis=1)
        root = linear.root[:, parts]
        # a line of unit variance has one half in its real and one in its imaginary part, which
        # makes the sum over both parts of a residue 1
        covariance = root @ np.swapaxes(root, -1, -2)
        solved = np.linalg.solve(covariance, both[..., np.newaxis])[..., 0]
        return np.asarray(np.sum(both * solved, axis=-1))

    def linear(self, poles: ComplexArray) -> _Linear:
        """Fit residues and residuals, which are linear, to given poles."""
        factor, ones = self.s**self.derivative, np.ones_like(self.s)
        of_pole, of_conjugate = self._per_residue(poles)
        outside = factor * np.stack([ones, 1j * ones, 1 / self.s**2, 1j / self.s**2])
        columns = [of_pole + of_conjugate, 1j * (of_pole - of_conjugate), outside]
        real = _apart(np.concatenate(columns))
        size = np.linalg.norm(real, axis=1)
        weight = np.concatenate([self.weight, self.weight], axis=1)
        basis, triangle = np.linalg.qr(weight[:, :, np.newaxis] * (real.T / size))
        target = _apart(self.weight * self.measured)[:, :, np.newaxis]
        explained = basis.transpose(0, 2, 1) @ target
        root = np.linalg.inv(triangle) / size[:, np.newaxis]
        coefficients = (root @ explained)[:, :, 0]
        n = 2 * poles.size
        return _Linear(
            basis=basis,
            residues=coefficients[:, : poles.size] + 1j * coefficients[:, poles.size : n],
            upper=coefficients[:, n] + 1j * coefficients[:, n + 1],
            lower=coefficients[:, n + 2] + 1j * coefficients[:, n + 3],
            deviation=(target - basis @ explained)[:, :, 0],
            root=root,
        )

    def _per_residue(self, poles: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Return what a residue and its conjugate are multiplied by, (n_pole, n_line) each."""
        factor = self.s**self.derivative
        pole = poles[:, np.newaxis]
        return factor / (self.s - pole), factor / (self.s - pole.conj())

    def _slope(self, poles: ComplexArray, linear: _Linear, steps: ComplexArray) -> RealArray:
        """Find the weighted deviation per step of the poles, (2 n_line n_pair, n_step).

        Steps are of the poles in their order, over and over. The basis turns with the poles, too:
        that part is left out (Kaufman 1975), which moves no minimum.
        """
        of_pole, of_conjugate = self._per_residue(poles)
        # d/ds_n of R_n/(s - s_n) is R_n/(s - s_n)^2
        turned = linear.residues[:, :, np.newaxis]
        of_pole = turned * of_pole / (self.s - poles[:, np.newaxis])
        of_conjugate = turned.conj() * of_conjugate / (self.s - poles.conj()[:, np.newaxis])
        step = steps.reshape(-1, poles.size, 1)
        moved = step * of_pole[:, np.newaxis] + step.conj() * of_conjugate[:, np.newaxis]
        flat = moved.reshape(len(linear.residues), steps.size, -1)
        slope = _apart(self.weight[:, np.newaxis] * flat)
        slope = slope - (slope @ linear.basis) @ linear.basis.transpose(0, 2, 1)
        return np.asarray(-np.moveaxis(slope, 1, 2).reshape(-1, steps.size))


def _pole_fit(frf: Frf, form: FrfForm, band: tuple[float, float]) -> _PoleFit:
    """Gather the functions of a band for a fit, every line of one weight."""
    _refuse_inverse(form)
    _lines_of(frf, band)
    lines = (frf.frequency >= band[0]) & (frf.frequency <= band[1])
    measured = frf.values[lines].reshape(int(lines.sum()), -1).T
    s = np.asarray(2j * np.pi * frf.frequency[lines] + frf.added_decay_rate)
    return _PoleFit(s, form.derivative, measured, np.ones(measured.shape))


def _refuse_inverse(form: FrfForm) -> None:
    if form not in _FORM_NAMES:
        name = form.name.lower().replace("_", " ")
        raise InputError(
            f"modal analysis reads motion per load, not {name}: convert() the whole matrix first"
        )


def _apart(values: ComplexArray) -> RealArray:
    """Return real parts, then imaginary parts, along the last axis."""
    return np.concatenate([values.real, values.imag], axis=-1)


def _lines_of(frf: Frf, band: tuple[float, float]) -> tuple[int, int, float]:
    """Lines from 0 Hz to the band's first line, and to its last, and their step [Hz]; checked."""
    steps = np.diff(frf.frequency)
    if not steps.size or not np.allclose(steps, steps[0], rtol=1e-6, atol=0):
        raise InputError("modal analysis needs equidistant lines: interpolating would bend modes")
    step = float(steps.mean())
    number = frf.frequency / step
    if np.abs(number - np.round(number)).max() > 0.01:
        raise InputError(
            f"modal analysis needs lines on whole multiples of their step, {step:g} Hz, but the "
            f"first one is at {frf.frequency[0]:g} Hz"
        )
    low, high = band
    if not 0 < low < high:
        raise InputError(f"a band from {low:g} to {high:g} Hz: it begins above 0 Hz and ends later")
    if not frf.frequency[0] <= low < high <= frf.frequency[-1]:
        raise InputError(
            f"the band {low:g}-{high:g} Hz does not lie within the lines, "
            f"{frf.frequency[0]:g}-{frf.frequency[-1]:g} Hz"
        )
    inside = frf.frequency[(frf.frequency >= low) & (frf.frequency <= high)]
    if not inside.size:
        raise InputError(f"there is no line between {low:g} and {high:g} Hz: use a wider band")
    return round(inside[0] / step), round(inside[-1] / step), step


def _condition(unknown: int, total: int, order: int) -> float:
    """Condition number of the numerators' normal equations when the first lines are unknown."""
    lines = np.zeros(total + 1)
    lines[:unknown] = 1.0
    first = -np.fft.irfft(lines, n=2 * total)[: 2 * order + 1]
    first[0] += 1.0
    return float(np.linalg.cond(toeplitz(first)))


def _shift(unknown: int, total: int, order: int) -> int:
    """Return by how many lines the band is moved towards 0 Hz for a polynomial of an order."""
    if order <= SMALLEST_ORDER or _condition(unknown, total, order) <= LARGEST_CONDITION:
        return 0
    return int(SHIFT * unknown)


def _order_carried(frf: Frf, band: tuple[float, float]) -> int:
    unknown, total, _ = _lines_of(frf, band)
    largest = min(LARGEST_ORDER, (total - unknown) // 4)
    for order in range(largest, SMALLEST_ORDER, -1):
        shift = _shift(unknown, total, order)
        if _condition(unknown - shift, total - shift, order) <= LARGEST_CONDITION:
            return order
    raise InputError(
        f"the band {band[0]:g}-{band[1]:g} Hz carries no polynomial above order {SMALLEST_ORDER}: "
        "begin lower, or take more lines"
    )


def _ema_model(
    frf: Frf, form: FrfForm, band: tuple[float, float], order: int, shift: int = 0
) -> Any:
    """Model of sdypy-EMA behind checks of what it takes for granted.

    Its lines begin at 0 Hz, those below the band with zeros that it does not read, and are `shift`
    lines lower than the true ones.
    """
    try:
        from sdypy import EMA
    except ImportError:
        raise InputError(
            'modal analysis needs sdypy-EMA: install deboom with the extra "modal"'
        ) from None
    _refuse_inverse(form)
    unknown, total, step = _lines_of(frf, band)
    low, high = band
    n_line = total - unknown + 1
    if n_line < 2 * order:
        raise InputError(
            f"{n_line} lines between {low:g} and {high:g} Hz do not fix a polynomial of order "
            f"{order}: use a wider band, more lines or a lower order"
        )
    condition = _condition(unknown - shift, total - shift, order)
    if order > SMALLEST_ORDER and condition > LARGEST_CONDITION:
        raise InputError(
            f"the band {low:g}-{high:g} Hz does not carry a polynomial of order {order} in double "
            "precision: begin lower, or use a lower order"
        )
    inside = (frf.frequency >= low) & (frf.frequency <= high)
    values = frf.values[inside]
    values = values * _between_forms(frf.frequency[inside], form, frf.added_decay_rate)
    # the library drops the line at its upper limit: it gets one more, which it never reads
    frequency = step * np.arange(total - shift + 2)
    rows = np.zeros((values[0].size, frequency.size), dtype=complex)
    rows[:, unknown - shift : -1] = values.reshape(len(values), -1).T
    return EMA.Model(
        frf=rows,
        freq=frequency,
        lower=float(frequency[unknown - shift]),
        upper=float(frequency[-1]),
        pol_order_high=order,
        frf_form=_FORM_NAMES[form],
    )


def _between_forms(frequency: RealArray, form: FrfForm, added_decay_rate: float) -> ComplexArray:
    """Return (jω)^n over (jω + 1/τ)^n for the n derivatives of a form, shape (f, 1, 1).

    A library that divides by jω gets the receptance at jω + 1/τ, which has the window's poles only.
    """
    if not added_decay_rate:
        return np.ones((1, 1, 1), dtype=complex)
    s = 2j * np.pi * frequency
    factor = s / (s + added_decay_rate)
    return np.asarray(factor**form.derivative)[:, np.newaxis, np.newaxis]


def mac_matrix(first: npt.ArrayLike, second: npt.ArrayLike) -> RealArray:
    """Return the modal assurance criterion of every shape of one set with every one of another [1].

    Shapes are rows, (n_first, n_output) and (n_second, n_output), of outputs in one order and of
    one unit, since the largest ones count. Raises InputError: other numbers of outputs, a shape of
    zeros.
    """
    rows, columns = np.atleast_2d(first), np.atleast_2d(second)
    if rows.shape[1] != columns.shape[1]:
        raise InputError(
            f"shapes of {rows.shape[1]} and of {columns.shape[1]} outputs cannot be compared: give "
            "the same outputs in the same order"
        )
    return mac(rows.T[:, :, np.newaxis], columns.T[:, np.newaxis, :])


def phase_collinearity(shapes: npt.ArrayLike) -> RealArray:
    """Return how nearly the entries of each shape, (..., n_output), share one phase (MPC) [1].

    ``|φᵀφ|² / (φᴴφ)²``, without the mean removed, after Pappa, Elliott and Schenk (1993): 1 for a
    real shape times any factor, 0 for a wave that only travels. A body whose damping is spread like
    its mass and stiffness has real shapes; noise and modes that overlap lower it.
    """
    values = np.asarray(shapes, dtype=complex)
    alike = np.abs(np.sum(values**2, axis=-1)) ** 2
    return np.asarray(alike / np.sum(np.abs(values) ** 2, axis=-1) ** 2)


def in_common_phase(shapes: npt.ArrayLike) -> ComplexArray:
    """Turn each shape, (..., n_output), to the phase in which it is as real as it can be.

    The largest entry is positive and of size 1; what stays imaginary is what travels.
    """
    values = np.asarray(shapes, dtype=complex)
    turned = values * np.exp(-0.5j * np.angle(np.sum(values**2, axis=-1, keepdims=True)))
    place = np.abs(turned).argmax(axis=-1)[..., np.newaxis]
    largest = np.take_along_axis(turned, place, axis=-1)
    sign = np.where(largest.real < 0, -1.0, 1.0)
    return np.asarray(sign * turned / np.abs(largest))


@checked(positions="p 3", normals="p 3", areas="p")
class PanelMeasurement:
    """Panels of the trimmed body, with the loudspeaker at each ear in turn.

    - `positions` (n_panel, 3): from the powertrain's centre of gravity [m].
    - `normals` (n_panel, 3): unit vectors into the cabin [1].
    - `areas` (n_panel,): areas with which the motion of each accelerometer changes the volume of
      the cabin [m²].
    - `motion`, `pressure`: outputs are the panels, inputs the ears: acceleration inwards
      [(m/s²)/(m³/s²)] and pressure at the panel [Pa/(m³/s²)].
    """

    names: tuple[str, ...]
    positions: RealArray
    normals: RealArray
    areas: RealArray
    motion: Frf
    pressure: Frf


@checked(frequency="m", values="m p")
class PanelContributions:
    """Pressure at one ear from each panel, mode by mode.

    - `frequency` (n_mode,): natural frequencies [Hz].
    - `values` (n_mode, n_panel): complex pressure at the ear, with the modes moving as the
      loudspeaker at this ear moves them: modal constants per volume displaced [Pa/m³ · 1/s].
    """

    ear: str
    panels: tuple[str, ...]
    frequency: RealArray
    values: ComplexArray

    @property
    def pressure(self) -> ComplexArray:
        """What all panels of a mode bring to the ear, shape (n_mode,)."""
        return np.asarray(self.values.sum(axis=1))

    @property
    def shares(self) -> RealArray:
        """Part of each panel in phase with the sum, shape (n_mode, n_panel); a row adds up to 1.

        Negative for a panel that works against the others.
        """
        return np.asarray((self.values / self.pressure[:, np.newaxis]).real)


def panel_contributions(
    model: ModalModel, panels: PanelMeasurement, ear: str
) -> PanelContributions:
    """Multiply the modes at the panels by what each panel transfers to the ear.

    Raises InputError: a panel or ear without modal constants, a mode outside the lines of the
    panels' pressure, a model that is not receptance-like.

    - `model`: model of accelerations per volume acceleration; outputs hold the panels, inputs the
      ear.

    A still panel that a loudspeaker at the ear meets with ``p_k/Q̇`` raises, when it moves inwards
    with ``a_k``, at the ear ``p = (p_k/Q̇) A_k a_k`` by reciprocity. Of mode n that is
    ``c_nk = (jω_n)² (p_k/Q̇)(ω_n) A_k R_nk``, with the residue ``R_nk`` of the displacement-like
    ``a_k/Q̇``. Valid for light damping, where ``p_k/Q̇`` changes little over a resonance, and for
    panels that radiate into a cabin of long waves.
    """
    if model.form is not FrfForm.RECEPTANCE:
        raise InputError(
            "panel contributions need a modal model of accelerations per volume acceleration, "
            "which are receptance-like"
        )
    missing = [name for name in (*panels.names, ear) if name not in (*model.outputs, *model.inputs)]
    if missing:
        raise InputError(f"the modal model knows nothing of {missing}: measure them with the rest")
    transfer = panels.pressure.select(inputs=(ear,)).values[:, :, 0]
    lines, at = panels.pressure.frequency, model.frequency
    if at.min() < lines[0] or at.max() > lines[-1]:
        raise InputError(
            f"modes from {at.min():.2f} to {at.max():.2f} Hz, but pressure at the panels from "
            f"{lines[0]:g} to {lines[-1]:g} Hz only"
        )
    at_modes = np.stack([np.interp(at, lines, column) for column in transfer.T], axis=1)
    rows = [model.outputs.index(name) for name in panels.names]
    constants = model.residues[:, rows, model.inputs.index(ear)]
    squared = -((2 * np.pi * at) ** 2)[:, np.newaxis]
    return PanelContributions(ear, panels.names, at, squared * at_modes * panels.areas * constants)
