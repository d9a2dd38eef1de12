"""How sure the share of an acceptance box is, as far as the measurements behind it go."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from deboom.explore.solution_box_share import box_sample
from deboom.measurement.propagated_interval import Interval, pivotal_interval
from deboom.study.solution_box import BoxStudy
from deboom.study.uncertain_index import uncertain_index
from deboom.vehicles.limit_responses import MeanLevel, PeakLevel

DRAWS, PARTS = 60, 2048
"""Measurements that are drawn again, and parts that each of them judges."""


def share_measured_again(study: BoxStudy) -> Interval:
    """Return the share of the box with the interval that the measurements leave open.

    Parameters
    ----------
    study : BoxStudy

    Returns
    -------
    Interval
        Of parts and vehicles, or parts, that keep the limit, 90 % [1].

    Raises
    ------
    InputError
        Measurements without a stated uncertainty, see `uncertain_index`.

    Notes
    -----
    Noise transfer functions, stiffnesses, motions and forces are drawn again with their errors and
    the box stays as it is. The interval is pivotal, then cut to 0 and 1.
    """
    question = study.question
    places = box_sample(
        len(study.variables), PARTS, seed=study.seed, purpose="parts of a box measured again"
    )
    parts = question.parts(study.box, places)

    def share(response: MeanLevel | PeakLevel) -> float:
        within = np.asarray(response(parts)) <= question.limit
        return float(within.all(axis=1).mean() if question.together else within.mean())

    uncertain = uncertain_index(study.index, study.runs.platform, study.runs.parts)
    again = [
        share(
            PeakLevel(drawn, study.band)
            if isinstance(study.response, PeakLevel)
            else MeanLevel(drawn)
        )
        for drawn in uncertain.draws(DRAWS, seed=study.seed)
    ]
    found = pivotal_interval(share(study.response), np.array(again), coverage=0.9)
    return replace(
        found, lower=np.clip(found.lower, 0.0, 1.0), upper=np.clip(found.upper, 0.0, 1.0)
    )
