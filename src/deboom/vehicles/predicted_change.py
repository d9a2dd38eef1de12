"""The interval of a predicted change: errors of measurements, and errors of the model.

A prediction errs because data were measured, and because coupled motion leaves out a body that
moves, stiffnesses that follow the amplitude, and parts that differ. The first is drawn again and
again (`deboom.vehicles.uncertain_data`); the second was found by driving designs in the flexible
cars of drawn benches (`benchmarks/predicted_change.py`) and is stated here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.stats import norm
from scipy.stats import t as student

from deboom.arrays import RealArray, checked_array
from deboom.errors import InputError


@dataclass(frozen=True)
class ModelError:
    """What coupled motion makes of a change of the level in a car, from drawn benches.

    - `brought`: part of the predicted change that a car shows, mean [1].
    - `deviation`: standard deviation of what it shows about that, over the predicted change [1].
    - `sentence`: what the term stands for.
    """

    brought: float
    deviation: float
    sentence: str


BODY_AT_REST = ModelError(
    0.94,
    0.022,
    "The interval carries what a body that gives way and amplitudes change, as found in the "
    "flexible cars of drawn benches: a car brings 0.94 of the predicted change, give or take "
    "2.2 % of it. The receptances of the bodies at the mounts would take most of that away.",
)
BODY_MOVES = ModelError(
    0.98,
    0.005,
    "Powertrain and body move together; the interval carries what amplitudes change, as found in "
    "the flexible cars of drawn benches: a car brings 0.98 of the predicted change, give or take "
    "0.5 % of it.",
)
"""From 440 cars of the fleets 7001 to 7044 and 8001 to 8044, best designs within 20 %: the mean
that cars bring, and the least spread with which 90 % intervals hold 90 % of the true changes in
either set. In 220 cars of the fleets 9001 to 9044, which took no part, they hold 95 % without
receptances and 95 % with them; errors of measurement alone, about the predicted change, 33 and
70 %."""


@dataclass(frozen=True, eq=False)
class ChangeInterval:
    """Where the change of the level in each car is expected.

    - `predicted` (v,): change that the model predicts [dB].
    - `low`, `high` (v,): bounds of the interval [dB].
    - `measurement`, `model` (v,): half widths by what measurements leave open, and by what the
      model leaves out, joined in squares [dB].
    - `share`: probability that the interval states [1].
    - `sentence`: what the interval carries besides errors of measurement.
    """

    predicted: RealArray
    low: RealArray
    high: RealArray
    measurement: RealArray
    model: RealArray
    share: float
    sentence: str


def change_interval(
    predicted: npt.ArrayLike,
    drawn: npt.ArrayLike,
    *,
    receptance: bool,
    share: float = 0.9,
) -> ChangeInterval:
    """Compose the interval of a predicted change of the mean level against today's design.

    Parameters
    ----------
    predicted : array_like, shape (v,)
        Change in each vehicle from the data as measured, coupled motion [dB].
    drawn : array_like, shape (d, v)
        The same from the data measured again, at least two draws [dB].
    receptance : bool
        Whether the vehicles brought the receptances of their bodies.
    share : float
        Probability that is stated, between 0 and 1.

    Returns
    -------
    ChangeInterval
        In each vehicle [dB].

    Raises
    ------
    InputError
        Other shapes, numbers that are not finite, fewer than two draws, a share that is none.

    Notes
    -----
    ``b Δ ± z √(σ² + τ² Δ²)``: Δ the predicted change, b the part of it that cars bring, σ the
    standard deviation over the draws, τ that of what the model leaves out over the change, z the
    quantile of the normal distribution. b and τ hold for changes of 1 to 7 dB by stiffness factors
    within 20 %.

    Examples
    --------
    >>> from deboom.vehicles.predicted_change import change_interval
    >>> interval = change_interval([-3.0], [[-3.1], [-2.9]], receptance=True)
    >>> bool(interval.low[0] < -2.94 < interval.high[0])
    True
    """
    sizes: dict[str, int] = {}
    change = checked_array(predicted, "v", "predicted changes", sizes)
    again = checked_array(drawn, "d v", "drawn changes", sizes)
    if len(again) < 2:
        raise InputError("an interval needs at least two draws of the measurements: draw more")
    if not 0.0 < share < 1.0:
        raise InputError(f"a probability of {share:g}: give a number between 0 and 1")
    error = BODY_MOVES if receptance else BODY_AT_REST
    quantile = float(norm.ppf(0.5 + share / 2.0))
    measurement = quantile * again.std(axis=0, ddof=1)
    model = quantile * error.deviation * np.abs(change)
    middle, half = error.brought * change, np.hypot(measurement, model)
    return ChangeInterval(
        predicted=change,
        low=middle - half,
        high=middle + half,
        measurement=measurement,
        model=model,
        share=share,
        sentence=error.sentence,
    )


@dataclass(frozen=True, eq=False)
class ChangeParts:
    """What the change of the level may be: in each car, in their mean, and by what it may differ.

    - `cars`: interval of each car.
    - `mean`: interval of their mean, arrays of one entry [dB].
    - `unseen`: half width by which the mean of further vehicles of the group may differ [dB]; nan
      of a single vehicle, which says nothing of others.
    - `prescribed`: mean change with prescribed motion [dB]; nan: not known.
    - `old_stops`: mean change by a softer or stiffer rubber between stops that stay as they are
      [dB]; nan: not known.
    """

    cars: ChangeInterval
    mean: ChangeInterval
    unseen: float
    prescribed: float = float("nan")
    old_stops: float = float("nan")


def change_parts(
    predicted: npt.ArrayLike,
    drawn: npt.ArrayLike,
    *,
    receptance: bool,
    prescribed: float = float("nan"),
    old_stops: float = float("nan"),
    share: float = 0.9,
    weights: RealArray | None = None,
) -> ChangeParts:
    """Compose what the change by a design may be, in each vehicle and in their mean.

    Parameters
    ----------
    predicted, drawn, receptance, share
        See `change_interval`.
    prescribed, old_stops : float
        Mean change in which the powertrain's motion, or the stops, stay as they are [dB].
    weights : array, shape (v,), optional
        Of the vehicles in the mean [1]; by default all alike.

    Returns
    -------
    ChangeParts

    Raises
    ------
    InputError
        See `change_interval`.

    Notes
    -----
    What the model leaves out counts for the mean as for one car, as if it were common to all.
    Vehicles of the group are taken for a sample of further ones: ``t s / √v`` with their standard
    deviation s and Student's t of v - 1 degrees of freedom.

    Examples
    --------
    >>> from deboom.vehicles.predicted_change import change_parts
    >>> parts = change_parts([-3.0, -2.0], [[-3.1, -2.0], [-2.9, -2.1]], receptance=False)
    >>> bool(parts.mean.low[0] < -2.35 < parts.mean.high[0])
    True
    """
    change, again = np.asarray(predicted, dtype=float), np.asarray(drawn, dtype=float)
    cars = change_interval(change, again, receptance=receptance, share=share)
    means = (np.average(each, axis=-1, weights=weights) for each in (change, again))
    predicted_mean, drawn_means = (each[..., np.newaxis] for each in means)
    mean = change_interval(predicted_mean, drawn_means, receptance=receptance, share=share)
    unseen = float("nan")
    if len(change) > 1:
        quantile = float(student.ppf(0.5 + share / 2.0, len(change) - 1))
        unseen = quantile * float(change.std(ddof=1)) / float(np.sqrt(len(change)))
    return ChangeParts(cars, mean, unseen, prescribed, old_stops)
