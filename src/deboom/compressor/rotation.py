"""Which way the rotor turns, from the sweeps themselves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from deboom.compressor.operating_load import applied, noise_covariance
from deboom.compressor.source_structure import N_GAS, gas_columns, rotor_columns
from deboom.compressor.unbalance_load import RotationSense
from deboom.errors import InputError

if TYPE_CHECKING:
    from deboom.compressor.operating_load import OperatingLoad
    from deboom.compressor.route_model import RouteModel

DECISIVE = 10.0
"""Logarithm of the likelihood ratio from which one sense is certain."""
BEYOND_DOUBT = 100.0
"""The same, from which its size says nothing more."""
MOUNTS_OFF = 0.3
"""Change of the mounts' stiffness that the judgement bears [1]."""
_WORDS = {RotationSense.POSITIVE: "from y to z", RotationSense.NEGATIVE: "from z to y"}


@dataclass(frozen=True)
class SenseOfRotation:
    """Sense of the rotor and how certain it is.

    Parameters
    ----------
    sense : RotationSense
    log_likelihood_ratio : float
        In favour of `sense`, natural logarithm.
    statement : str
        The same in words.
    """

    sense: RotationSense
    log_likelihood_ratio: float
    statement: str


def sense_of_rotation(
    model: RouteModel,
    loads: Sequence[OperatingLoad],
    expected: RotationSense | None = None,
) -> SenseOfRotation:
    """Fit both senses to every sweep and keep the likelier one.

    Parameters
    ----------
    model : RouteModel
        That the loads were made with; the gyroscopic moment of the rotor is far too small to matter
        here.
    loads : sequence of OperatingLoad
        One per sweep.
    expected : RotationSense, optional
        As the data sheet states it.

    Returns
    -------
    SenseOfRotation

    Raises
    ------
    InputError
        Sweeps that turn in different senses, no decision, or another sense than expected.

    Notes
    -----
    Linear fit of unbalance and gas to each sweep, with the route's errors and mounts off by
    `MOUNTS_OFF` as if they were independent from line to line. With the wrong sense y and z
    contradict each other by 180°: the likelihood decides by far.
    """
    ratios = [_in_favour_of_positive(model, load) for load in loads]
    total = sum(ratios)
    sense = RotationSense.POSITIVE if total > 0 else RotationSense.NEGATIVE
    against = [
        load.name
        for load, ratio in zip(loads, ratios, strict=True)
        if ratio * sense.value < -DECISIVE
    ]
    if against:
        raise InputError(
            f"sweep {against[0]} turns against the others, which turn {_WORDS[sense]}: check the "
            "sign of its phases (tacho, channels) or the wiring of the motor"
        )
    if abs(total) < DECISIVE:
        raise InputError(
            "the sweeps fit one sense of rotation as badly as the other: a rotor's load is not "
            "visible in them; check the phase reference"
        )
    if expected is not None and expected is not sense:
        raise InputError(
            f"the sweeps turn {_WORDS[sense]}, the data sheet says {_WORDS[expected]}: the "
            "phases are conjugate, the x axis points the other way, or the motor is wired backwards"
        )
    certainty = (
        "beyond doubt"
        if abs(total) > BEYOND_DOUBT
        else f"logarithm of the likelihood ratio {abs(total):.0f}"
    )
    return SenseOfRotation(
        sense,
        abs(total),
        f"The rotor turns {_WORDS[sense]} ({certainty}).",
    )


def _in_favour_of_positive(model: RouteModel, load: OperatingLoad) -> float:
    """Logarithm of the likelihood ratio of both senses."""
    covariance = noise_covariance(model, (load,), (model.apparent_mass[load.lines],))
    held = MOUNTS_OFF * applied(model.mounts[load.lines], load.motion)
    covariance += np.einsum("fa,fb->fab", held, held.conj())
    errors = applied(model.by_error[:, load.lines], load.motion)
    covariance += np.einsum("kfa,kfb->fab", errors, errors.conj())
    whitener = np.linalg.inv(np.linalg.cholesky(covariance))
    right = (whitener @ load.load[..., np.newaxis]).ravel()
    cost = {}
    for sense in RotationSense:
        gas = np.broadcast_to(gas_columns(sense), (load.frequency.size, 6, N_GAS))
        columns = np.concatenate([rotor_columns(load.frequency, sense), gas], axis=-1)
        rows = (whitener @ columns).reshape(right.size, -1)
        scaled = rows / np.linalg.norm(rows, axis=0)
        found, *_ = np.linalg.lstsq(scaled, right)
        cost[sense] = float(np.sum(np.abs(right - scaled @ found) ** 2))
    return 0.5 * (cost[RotationSense.NEGATIVE] - cost[RotationSense.POSITIVE])
