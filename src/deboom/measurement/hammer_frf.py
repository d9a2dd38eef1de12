"""FRFs out of an impact test: hits checked, chosen, windowed and averaged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.block_records import chosen_blocks, summary
from deboom.measurement.frf_estimate import Estimator, FrfEstimate, estimated, join_estimates
from deboom.measurement.hammer_measurement import HammerMeasurement, HammerTest
from deboom.measurement.hit_checks import HitChecks, check_hits
from deboom.physics.cross_spectra import SpectrumScaling, cross_spectra
from deboom.physics.impact_windows import exponential_window, force_window


@dataclass(frozen=True)
class ForceWindow:
    """Part of the block in which the hammer may touch; the force outside is taken for noise.

    Parameters
    ----------
    before, after : float
        Flat from so long before the trigger until so long after it [s].
    taper : float
        Cosine at both ends [s].
    """

    before: float
    after: float
    taper: float = 0.0


@dataclass(frozen=True)
class HammerOptions:
    """How hits become an FRF.

    Parameters
    ----------
    estimator : Estimator
        H1 by default: a hammer's force cell is quieter than the responses.
    force_window : ForceWindow, optional
        By default none.
    time_constant : float, optional
        τ of an exponential window on force and response; by default none [s]. It moves every pole
        by 1/τ; the result states it as `added_decay_rate`, and the values are left as measured.
    band : (float, float), optional
        First and last frequency of the result [Hz]; by default from above 0 to rate/2.56, above
        which anti-aliasing filters work.
    minimum_hits : int
        Fewer good hits are refused. With 1, allow an FRF whose coherence is not known.
    checks : HitChecks
        Limits of a good hit.

    Raises
    ------
    InputError
        Less than one hit.
    """

    estimator: Estimator = Estimator.H1
    force_window: ForceWindow | None = None
    time_constant: float | None = None
    band: tuple[float, float] | None = None
    minimum_hits: int = 2
    checks: HitChecks = field(default_factory=HitChecks)

    def __post_init__(self) -> None:
        if self.minimum_hits < 1:
            raise InputError(f"an FRF needs at least one hit, not {self.minimum_hits}")


def hammer_frf(
    measurement: HammerMeasurement,
    options: HammerOptions | None = None,
    *,
    hits: Sequence[int] | None = None,
    count: int | None = None,
) -> FrfEstimate:
    """FRFs of all responses to one impact.

    Parameters
    ----------
    measurement : HammerMeasurement
        Hits on one point.
    options : HammerOptions, optional
        By default `HammerOptions()`.
    hits : sequence of int, optional
        Numbers of the hits to choose from, 1 is the first; by default all.
    count : int, optional
        How many good ones of them to average, the first ones; by default all.

    Returns
    -------
    FrfEstimate
        One column; `records` says which hits were rejected and why.

    Raises
    ------
    InputError
        Too few good hits, one hit without having allowed it, a push outside the force window, no
        line in the band.

    Notes
    -----
    The mean of each channel before the push is taken out of the block first; a window would make
    a step of it. Spectra are energy densities: an impact has energy, no power.
    """
    options = HammerOptions() if options is None else options
    records = chosen_blocks(check_hits(measurement, options.checks), hits, count)
    used = [record.number - 1 for record in records if record.used]
    if len(used) < options.minimum_hits:
        why = ""
        if len(used) == 1:
            why = "; the coherence of one hit is 1 whatever was measured, and says nothing"
        raise InputError(
            f"impact {measurement.impact}: {len(used)} of {len(records)} hits can be averaged, "
            f"{options.minimum_hits} are needed ({summary(records)}){why}: strike again"
        )
    force = _without_offset(measurement.force[used][:, :, np.newaxis], measurement)
    response = _without_offset(measurement.response[used], measurement)
    decay = np.ones(measurement.n_sample)
    if options.time_constant is not None:
        decay = exponential_window(
            measurement.n_sample, measurement.rate, options.time_constant, measurement.pretrigger
        )
    spectra = cross_spectra(
        force,
        response,
        measurement.rate,
        input_window=decay * _touching(measurement, used, options.force_window),
        output_window=decay,
        scaling=SpectrumScaling.ENERGY_DENSITY,
    )
    return estimated(
        spectra,
        outputs=measurement.channels,
        inputs=(measurement.impact,),
        output_units=measurement.units,
        input_units=("N",),
        estimator=options.estimator,
        band=options.band,
        n_averages=len(used),
        added_decay_rate=0.0 if options.time_constant is None else 1.0 / options.time_constant,
        records=records,
    )


def hammer_frfs(test: HammerTest, options: HammerOptions | None = None) -> FrfEstimate:
    """FRFs of all responses to all impacts of a test, one column per impact.

    Parameters
    ----------
    test : HammerTest
        With the same responses at each impact.
    options : HammerOptions, optional
        By default `HammerOptions()`.

    Returns
    -------
    FrfEstimate
        All good hits averaged.

    Raises
    ------
    InputError
        As `hammer_frf` and `join_estimates`; the impact is named.
    """
    return join_estimates([hammer_frf(one, options) for one in test.measurements])


def _without_offset(blocks: RealArray, measurement: HammerMeasurement) -> RealArray:
    if measurement.n_before == 0:
        return blocks
    return np.asarray(blocks - blocks[:, : measurement.n_before].mean(axis=1, keepdims=True))


def _touching(
    measurement: HammerMeasurement, used: list[int], window: ForceWindow | None
) -> RealArray:
    if window is None:
        return np.ones(measurement.n_sample)
    begin = measurement.pretrigger - window.before
    end = measurement.pretrigger + window.after
    for index in used:
        peak = int(np.argmax(measurement.force[index])) / measurement.rate
        if not begin <= peak <= end:
            raise InputError(
                f"impact {measurement.impact}, hit {index + 1}: the push peaks "
                f"{peak - measurement.pretrigger:.3g} s after the trigger, outside the force "
                "window: widen the window or leave the hit out"
            )
    return force_window(measurement.n_sample, measurement.rate, begin, end, window.taper)
