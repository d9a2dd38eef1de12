"""Whether loads at the stated interface stand for any load in the source.

Two questions are put to all sensors: how alike is what the loads predict and what was measured
(coherence), and is what they leave no more than noise (χ²)? Gain, place and angle of a sensor, and
of a hit, leave what the stated loads can move as it is, so that noise alone is left of a complete
interface. The second question is by far the sharper: half a percent of the response that no load
explains may stand beside forces that are wrong by a third, as the inversion magnifies it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from deboom.arrays import BoolArray, ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.component_test import ComponentTest, InterfacePoint, functions_at_points
from deboom.measurement.path_forces import blocked_forces_in_situ
from deboom.physics.force_inversion import CROSS_VALIDATED, Inversion

MOST_ATTENUATED = 0.15
"""Attenuation above which the interval of a blocked force does not hold [1]: near a resonance of
the source with its interface at rest, or far below its first elastic mode, some loads move no
indicator."""
LARGEST_CHI_SQUARED = 1.3
"""χ² per degree of freedom, mean over the lines, from which a rest is no noise [1]: 0.9 to
1.1 where an interface is complete, see docs/validation.md."""
FALSE_ALARM = 1e-3
"""Probability with which noise alone may exceed the limit where lines and sensors are few [1]."""
MOST_COHERENT = 1.0 - 1e-12
"""Coherence above which rounding is the noise [1]."""


def coherence_of(predicted: ComplexArray, measured: ComplexArray, axis: int) -> RealArray:
    """Return ``|Σ p* m|² / (Σ|p|² Σ|m|²)`` over an axis: 1 where they differ by one factor only.

    Over the channels of a line it is the interface completeness criterion, see `completeness`.
    """
    cross = np.abs(np.sum(predicted.conj() * measured, axis=axis)) ** 2
    energies = [np.sum(np.abs(values) ** 2, axis=axis) for values in (predicted, measured)]
    return np.asarray(cross / (energies[0] * energies[1]))


@checked(per_line="f", resolved="f", spare=">0")
class Rest:
    """What loads at the interface leave of the sensors' response, over its stated noise.

    - `per_line` (n_frequency,): χ² per degree of freedom; 1 where noise alone is left [1].
    - `resolved` (n_frequency,): lines that are judged. On the others noise of the functions shrinks
      a load, and with it the noise that it is said to bring.
    - `spare`: channels beyond the loads, complex degrees of freedom of each line.
    """

    per_line: RealArray
    resolved: BoolArray
    spare: int

    @property
    def chi_squared(self) -> float:
        """Mean over the resolved lines; not a number where there are none [1]."""
        return float(np.mean(self.per_line[self.resolved])) if self.resolved.any() else np.nan

    @property
    def limit(self) -> float:
        """What noise does not exceed: `LARGEST_CHI_SQUARED`, or more with few lines [1]."""
        freedom = 2 * self.spare * max(int(self.resolved.sum()), 1)
        return max(LARGEST_CHI_SQUARED, float(chi2.isf(FALSE_ALARM, freedom)) / freedom)

    @property
    def is_noise(self) -> bool:
        """Whether noise explains it; so it does where no line can be judged."""
        return not self.chi_squared > self.limit


def rest_of(
    functions: ComplexArray, response: ComplexArray, variance: RealArray, resolved: BoolArray
) -> Rest:
    """Project a response out of all that the loads can move, in units of its noise.

    `functions` (n_frequency, n_channel, n_load); `response` (n_frequency, n_channel); `variance`
    (n_frequency, n_channel): mean square of the noise of response and functions together;
    `resolved` (n_frequency,): lines to be judged.

    ``χ² = ‖(I − QQᴴ) W a‖² / (n_channel − n_load)`` with ``QR = W Y``, W one over the deviations.
    """
    # a channel without any signal has no noise to state, and nothing to explain
    weight = 1.0 / np.sqrt(np.maximum(variance, np.finfo(float).tiny))
    directions, _ = np.linalg.qr(functions * weight[:, :, np.newaxis])
    white = response * weight
    along = np.einsum("fcp,fc->fp", directions.conj(), white)
    left = white - np.einsum("fcp,fp->fc", directions, along)
    spare = functions.shape[1] - functions.shape[2]
    return Rest(np.sum(np.abs(left) ** 2, axis=1) / spare, resolved, spare)


def function_variance(
    functions: Frf,
    coherence: RealArray,
    n_averages: int,
    outputs: Sequence[str],
    hits: Sequence[str],
) -> RealArray:
    """Return the mean square of the noise of functions to hits, (n_frequency, n_output, n_hit).

    ``|H|² (1 − γ²)/(n γ²)`` of n averages (Bendat and Piersol, Random Data, 4th ed., eq. 9.90).
    """
    rows = [functions.outputs.index(name) for name in outputs]
    columns = [functions.inputs.index(name) for name in hits]
    size = np.abs(functions.values[:, rows][:, :, columns]) ** 2
    least = np.finfo(float).tiny
    coherent = np.clip(coherence[:, rows][:, :, columns], least, MOST_COHERENT)
    return np.asarray(size * (1 - coherent) / (n_averages * coherent))


def prediction_variance(
    points: Sequence[InterfacePoint], of_functions: RealArray, force: ComplexArray
) -> RealArray:
    """Return the mean square of what noise of the functions to hits does to ``Y f``.

    `of_functions` (n_frequency, n_output, n_hit): see `function_variance`; `force` (n_frequency,
    n_load). Returns (n_frequency, n_output).
    """
    of_hits = np.abs(np.stack(list(hit_forces(points, force).values()), axis=1)) ** 2
    return np.asarray(np.einsum("foi,fi->fo", of_functions, of_hits))


def shrinking_noise(points: Sequence[InterfacePoint], of_functions: RealArray) -> RealArray:
    """Return the mean of ``δYᴴ (I − YY⁺) δY`` for noise δY of functions per load.

    `of_functions` (n_frequency, n_indicator, n_hit): see `function_variance`. Returns (n_frequency,
    n_load, n_load). Of what noise does to the rows, the part along the matrix's own columns does
    not shrink what is divided by them.
    """
    per_hit = of_functions.sum(axis=1)
    n_load = sum(len(point.motions) for point in points)
    summed = np.zeros((len(per_hit), n_load, n_load))
    hit = load = 0
    for point in points:
        inverse = point.struck().inverse
        n, m = inverse.shape
        part = per_hit[:, hit : hit + m]
        summed[:, load : load + n, load : load + n] = np.einsum(
            "ai,fi,bi->fab", inverse, part, inverse
        )
        hit, load = hit + m, load + n
    return np.asarray(summed * (1.0 - n_load / of_functions.shape[1]))


def attenuation_of(matrix: ComplexArray, of_noise: RealArray) -> RealArray:
    """Return by which share noise shrinks the loads along the direction seen least, (f,) [1].

    `matrix` (n_frequency, n_indicator, n_load); `of_noise`: see `shrinking_noise`.
    """
    normal = np.swapaxes(matrix.conj(), 1, 2) @ matrix
    scale = 1.0 / np.sqrt(np.einsum("fpp->fp", normal).real)
    scaled = [values * scale[:, :, None] * scale[:, None, :] for values in (normal, of_noise)]
    directions = np.linalg.eigh(scaled[0])
    weakest = directions.eigenvectors[:, :, 0]
    shrinks = np.einsum("fp,fpq,fq->f", weakest.conj(), scaled[1], weakest).real
    return np.asarray(shrinks / directions.eigenvalues[:, 0])


def hit_forces(points: Sequence[InterfacePoint], force: ComplexArray) -> dict[str, ComplexArray]:
    """Return the forces of hits that make up loads at the points, ``(U⁺)ᵀ f``."""
    forces: dict[str, ComplexArray] = {}
    first = 0
    for point in points:
        struck = point.struck()
        part = force[:, first : first + len(point.motions)] @ struck.inverse
        forces |= dict(zip(struck.channels, part.T, strict=True))
        first += len(point.motions)
    return forces


@checked(frequency="f", per_line="f", error="f")
class Completeness:
    """How far loads at the stated interface stand for any load in the source.

    - `per_line` (n_frequency,): coherence of predicted and measured response of sensors left out,
      and of ears, to all hits on the source; 1 where the interface is complete [1].
    - `error` (n_frequency,): at the sensors left out, norm of predicted minus measured over that of
      the measured responses to these hits [1].
    - `rest`: what the loads leave at all sensors, mean over these hits.
    """

    frequency: RealArray
    per_line: RealArray
    error: RealArray
    rest: Rest

    @property
    def median(self) -> float:
        """Median over the lines [1]."""
        return float(np.median(self.per_line))


def completeness(test: ComponentTest, inversion: Inversion = CROSS_VALIDATED) -> Completeness:
    """Ask of hits on the source whether loads at the stated interface stand for them.

    The responses of the indicators to a hit are inverted for loads at the interface as if it were
    an operation, and these predict sensors that were left out, and ears. Raises InputError: no hit
    on the source.

    Notes
    -----
    Interface completeness criterion (Meggitt, Moorhouse and Elliott, "On the problem of describing
    the coupling interface between sub-structures: an experimental test for 'completeness'", IMAC
    2018), with the assembly's functions inverted in place of the interface's. A point or a moment
    that is missing lowers it where it matters; a path through the air does not, as hits excite
    none. Where eighteen loads stand for a missing bracket the criterion stays near 1, and only the
    `rest` tells: χ² of what no load at the interface can move, by the noise that coherences state.
    """
    if not test.source_hits:
        raise InputError(
            f"{test.name}: nobody struck the source beside its interface, so that nothing says "
            "whether the interface is complete: strike its housing, and name the hits in "
            "source_impacts"
        )
    lines = test.accelerance.frequency
    at_points = functions_at_points(test.accelerance, test.points)
    indicators = at_points.select(outputs=test.indicator_channels)
    left_out = at_points.select(outputs=test.on_board_channels or test.indicator_channels)
    to_ears = functions_at_points(test.pressure, test.points)
    channels = test.all_channels
    functions = at_points.select(outputs=channels).values
    of_functions, of_hits = (
        function_variance(test.accelerance, test.coherence, test.n_averages, channels, hits)
        for hits in (
            [name for point in test.points for name in point.impact_names],
            [hit.name for hit in test.source_hits],
        )
    )
    of_noise = shrinking_noise(test.points, of_functions[:, : len(indicators.outputs)])
    resolved = attenuation_of(indicators.values, of_noise) <= MOST_ATTENUATED
    cross, energies = np.zeros(lines.size, complex), np.zeros((2, lines.size))
    missed, whole = np.zeros((2, lines.size))
    rests = []
    for number, hit in enumerate(test.source_hits):
        seen = test.accelerance.select(inputs=(hit.name,))
        heard = test.pressure.select(inputs=(hit.name,)).values[:, :, 0]
        response = Spectrum(lines, seen.values[:, :, 0], seen.outputs, "m/s^2")
        blocked = blocked_forces_in_situ(indicators, response, inversion)
        measured = response.select(left_out.outputs).values
        # ears and accelerometers count alike
        for predicted, truth in (
            ((left_out @ blocked.force).values, measured),
            ((to_ears @ blocked.force).values, heard),
        ):
            scale = 1.0 / np.sum(np.abs(truth) ** 2)
            cross += scale * np.sum(predicted.conj() * truth, axis=1)
            for place, values in enumerate((predicted, truth)):
                energies[place] += scale * np.sum(np.abs(values) ** 2, axis=1)
        missed += np.sum(np.abs((left_out @ blocked.force).values - measured) ** 2, axis=1)
        whole += np.sum(np.abs(measured) ** 2, axis=1)
        of_prediction = prediction_variance(test.points, of_functions, blocked.force.values)
        variance = of_hits[:, :, number] + of_prediction
        at_sensors = response.select(channels).values
        rests.append(rest_of(functions, at_sensors, variance, resolved))
    return Completeness(
        frequency=lines,
        per_line=np.abs(cross) ** 2 / (energies[0] * energies[1]),
        error=np.sqrt(missed / whole),
        rest=replace(rests[0], per_line=np.mean([rest.per_line for rest in rests], axis=0)),
    )
