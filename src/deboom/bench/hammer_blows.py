"""The hammer around one mount as time blocks: what the recorder holds before any averaging."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.bench.body import Body, Cabin
from deboom.bench.ears import EARS
from deboom.bench.parameters import VirtualBench
from deboom.bench.vehicle_acquisition import Setup, struck_pressure
from deboom.bench.vehicle_layout import EAR_NODES, ImpactPlace, impact_places
from deboom.errors import InputError
from deboom.files.hammer_test_tables import HammerChannel, HammerPoint
from deboom.files.hammer_test_writer import HammerSheet, write_hammer_test
from deboom.files.units import parse_unit


@dataclass(frozen=True)
class BlowPlan:
    """How the hammer strikes and how it is recorded.

    Parameters
    ----------
    hits : int
        Per blow of the position sheet.
    rate : float
        [Hz].
    duration : float
        Of a block [s]; its inverse is the spacing of the lines.
    pretrigger : float
        [s].
    contact : float
        Of the tip [s]; a half sine.
    lightest, hardest : float
        Peak force, even between them [N].
    force_noise, pressure_noise : float
        Standard deviation per sample [N], [Pa].
    """

    hits: int = 5
    rate: float = 512.0
    duration: float = 4.0
    pretrigger: float = 0.25
    contact: float = 8e-3
    lightest: float = 150.0
    hardest: float = 400.0
    force_noise: float = 0.05
    pressure_noise: float = 2e-3


def blows(
    setup: Setup,
    body: Body,
    cabin: Cabin,
    columns: list[int],
    plan: BlowPlan,
    generator: np.random.Generator,
) -> tuple[RealArray, RealArray]:
    """Record force and pressure at the ears of some blows.

    Parameters
    ----------
    setup : Setup
        Of the vehicle, with its true places and gains.
    body, cabin
        Of the vehicle.
    columns : list of int
        Places of the blows in `impact_places`.
    plan : BlowPlan
        How.
    generator : Generator
        Draws the hits and the noise.

    Returns
    -------
    force : array, shape (n_blow, n_hit, n_sample)
        As the hammer's cell states it [N].
    pressure : array, shape (n_blow, n_hit, n_sample, n_ear)
        As the microphones state it [Pa].

    Notes
    -----
    The answer is the inverse Fourier transform of function times spectrum of the push: exact for
    the sampled push, since a block of some seconds outlasts every mode.
    """
    n_sample = round(plan.rate * plan.duration)
    time = np.arange(n_sample) / plan.rate
    shape = (len(columns), plan.hits)
    begin = plan.pretrigger + generator.uniform(0, 1 / plan.rate, shape)
    peak = generator.uniform(plan.lightest, plan.hardest, shape)
    since = (time - begin[..., None]) / plan.contact
    push = peak[..., None] * np.sin(np.pi * since) * ((since >= 0) & (since <= 1))
    frequency = np.asarray(np.fft.rfftfreq(n_sample, 1 / plan.rate), dtype=np.float64)
    function = struck_pressure(setup, body, cabin, frequency)[:, :, columns]
    spectrum = np.fft.rfft(push)
    answer = np.fft.irfft(np.einsum("fec,chf->chfe", function, spectrum), n_sample, axis=2)
    answer = answer * setup.hammer  # the function is per stated force, the push is the true one
    force = setup.hammer * push + generator.normal(0, plan.force_noise, push.shape)
    return force, answer + generator.normal(0, plan.pressure_noise, answer.shape)


def write_blows(
    folder: Path,
    bench: VirtualBench,
    setup: Setup,
    body: Body,
    cabin: Cabin,
    point: str,
    generator: np.random.Generator,
    plan: BlowPlan | None = None,
) -> None:
    """Write the blows around one mount as a hammer test.

    Parameters
    ----------
    folder : Path
        Of the hammer test; made if it is not there.
    bench, setup, body, cabin
        The vehicle.
    point : str
        Mount, or mount and piece, such as ``TSM`` or ``Du left``.
    generator : Generator
        Draws the hits and the noise.
    plan : BlowPlan, optional
        How it is struck.

    Raises
    ------
    InputError
        No such point.
    """
    plan = plan or BlowPlan()
    places = impact_places(bench)
    around = [_point(place) for place in places]
    if point not in around:
        known = ", ".join(dict.fromkeys(around))
        raise InputError(f"no mount or piece '{point}' to strike: use {known}")
    columns = [number for number, name in enumerate(around) if name == point]
    force, pressure = blows(setup, body, cabin, columns, plan, generator)
    struck = [places[column] for column in columns]
    sheet = HammerSheet(
        title=f"hammer around {point}, pressure at the ears",
        rate=plan.rate,
        pretrigger=plan.pretrigger,
        points=tuple(
            HammerPoint(
                impact=place.name,
                node=place.node,
                file=f"hits/{place.name.replace(' ', '')}.uff",
                position=_three(place.position),
                direction=_three(place.vector),
            )
            for place in struck
        ),
        channels=tuple(
            HammerChannel(ear, "pressure", EAR_NODES[ear], "scalar", parse_unit("Pa"))
            for ear in EARS
        ),
    )
    hits = {place.name: (force[k], pressure[k]) for k, place in enumerate(struck)}
    write_hammer_test(folder, sheet, hits)


def _point(place: ImpactPlace) -> str:
    return f"{place.mount} {place.piece}".strip()


def _three(vector: RealArray) -> tuple[float, float, float]:
    x, y, z = np.round(vector, 4).tolist()
    return x, y, z
