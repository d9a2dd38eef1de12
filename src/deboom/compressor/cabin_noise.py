"""Noise of a running compressor in its car, path by path, with its bands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import pandas as pd

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.body_loads import (
    N_FORCE,
    body_receptance,
    displacement_at_virtual_point,
    holder_displacement,
    loads_by_measured_holders,
    on_rigid_foundation,
)
from deboom.compressor.hose_identification import HoseIdentification, identify_hoses
from deboom.compressor.identified_compressor import Identification
from deboom.compressor.model import GainFactor
from deboom.compressor.mount_shares import DRAWN_PLACE, STIFFNESS_NUMBERS, MountShares, mount_shares
from deboom.compressor.routes import UPDATED
from deboom.compressor.unbalance import Unbalance, UnbalanceOptions, unbalance
from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.compressor_test import (
    CompressorMount,
    HoseDrawing,
    HoseState,
    OperatingSweep,
)
from deboom.measurement.electric_car import (
    ElectricCar,
    WrenchNoiseTransfer,
    wrench_accelerance,
    wrench_noise_transfer,
)
from deboom.measurement.noise_transfer import POINT_LOADS
from deboom.physics.sound_level import spl
from deboom.physics.transfer_path import contributions
from deboom.tabled import Tabled

BAND = (20.0, 140.0)
"""Of the thesis's figures 65 and 66 [Hz]."""
TAILS = (5.0, 95.0)
"""Percentiles between which 90 % of the draws lie."""
HOSE_PASSES = 2
"""With drawn, then with identified hoses: how the body moves them depends on what they are."""

Step = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class RunningInCar:
    """All that is known of a compressor in its car.

    `source` comes from sweeps with soft hoses where there are any, the motion of the body taken
    off; `hoses` is None where their paths are left out.
    """

    car: ElectricCar
    identification: Identification
    shares: MountShares
    accelerance: Frf
    source: Unbalance
    hoses: HoseIdentification | None

    @property
    def alarms(self) -> tuple[str, ...]:
        """Reasons not to trust it, in words; empty where there are none."""
        of_hoses = () if self.hoses is None else self.hoses.alarms
        return (*self.source.alarms, *self.shares.alarms, *of_hoses)


def running_in_car(
    car: ElectricCar,
    identification: Identification,
    *,
    with_hoses: bool = True,
    step: Step | None = None,
) -> RunningInCar:
    """Find out what a compressor does on its mounts and hoses in a car.

    Parameters
    ----------
    car : ElectricCar
        Noise transfer functions, accelerances of the body and sweeps in the car.
    identification : Identification
        Identification of the hammer test on its compressor.
    with_hoses : bool
        Whether standard hoses are identified; without, their paths are left out.
    step : callable of str, optional
        Receiver of progress messages.

    Returns
    -------
    RunningInCar
        Source, mounts and hoses as they act in the car.

    Raises
    ------
    InputError
        No drawing of the mounts, or one with others than the car; standard hoses without drawing,
        or whose ends on the body were not struck; what `unbalance` and `identify_hoses` refuse.

    See Also
    --------
    deboom.unbalance, deboom.identify_hoses, deboom.read_electric_car, deboom.cabin_noise

    Examples
    --------
    See `cabin_noise`.
    """
    say = step or (lambda _: None)
    standard = bool(car.operation.with_hoses(HoseState.STANDARD))
    hoses_in_car = _struck_hoses(car) if with_hoses and standard else ()
    say("single mounts")
    # places are as good as the smaller of drawing and tape measure
    position = min(DRAWN_PLACE, car.tolerances.sensor_position or DRAWN_PLACE)
    shares = mount_shares(identification, _placed_mounts(car), position=position)
    accelerance = wrench_accelerance(car)
    say("state of the mounts in operation")
    options = UnbalanceOptions(routes=(UPDATED,), chosen=UPDATED)
    source = unbalance(
        on_rigid_foundation(car.operation, identification, shares.mounts), identification, options
    )
    change = source.state.significant
    if source.state.changed:
        # what the body does through them is known better now
        test = on_rigid_foundation(car.operation, identification, shares.mounts, change)
        source = unbalance(test, identification, options)
        change = source.state.significant
    hoses: HoseIdentification | None = None
    if hoses_in_car:
        for number in range(HOSE_PASSES):
            say(f"hoses, pass {number + 1} of {HOSE_PASSES}")
            still = on_rigid_foundation(
                car.operation, identification, shares.mounts, change, hoses_in_car, accelerance
            )
            hoses = identify_hoses(still, identification, source.sense.sense)
            hoses_in_car = hoses.hoses
    return RunningInCar(car, identification, shares, accelerance, source, hoses)


def _placed_mounts(car: ElectricCar) -> tuple[CompressorMount, ...]:
    """Mounts of the drawing, where the car's sheet has them."""
    drawing = car.operation.hammer.drawing
    if drawing is None:
        raise InputError(
            f"car {car.name}: the hammer test has no drawing, and no test at one virtual point "
            "shows what a single mount carries: state directions and stiffness of the mounts"
        )
    drawn = {mount.name: mount for mount in drawing.mounts}
    names = [point.name for point in car.mounts]
    if sorted(drawn) != sorted(names):
        raise InputError(
            f"car {car.name}: the drawing has {', '.join(drawn)}, the car {', '.join(names)}: call "
            "each mount by one name, and draw all of them"
        )
    return tuple(replace(drawn[point.name], position=point.position) for point in car.mounts)


def _struck_hoses(car: ElectricCar) -> tuple[HoseDrawing, ...]:
    """Drawn hoses, whose ends must be points of the car."""
    drawn = car.operation.hoses
    if not drawn:
        raise InputError(
            f"car {car.name} ran with standard hoses, of which there is no drawing: add [[hoses]] "
            "to operation.toml, or leave their paths out"
        )
    struck = [point.name for point in car.hoses]
    missing = [hose.name for hose in drawn if hose.name not in struck]
    if missing:
        raise InputError(
            f"car {car.name}: no noise transfer functions at the body's end of "
            f"{', '.join(missing)}: measure them, or leave the paths of the hoses out"
        )
    return drawn


@dataclass(frozen=True, eq=False)
class SweepNoise(Tabled):
    """Sound at the ear over the speed of one sweep, path by path.

    `frequency` (n_frequency,): frequency of the rotation [Hz]; `paths`: ``<point> x y z`` and, of
    hoses, ``mx my mz`` as well; `loads` (n_frequency, n_path): on the body, complex peak [N, N m];
    `contributions` (n_frequency, n_path): sound of each path, complex peak [Pa]; `n_mount_paths`:
    number of paths of the mounts; they come first; `measured` (n_frequency,): at the ear, complex
    peak [Pa]; `pressure`: that of the gas [Pa].

    See Also
    --------
    deboom.cabin_noise, deboom.running_in_car
    """

    sweep: str
    hoses: HoseState
    pressure: float
    frequency: RealArray
    paths: tuple[str, ...]
    loads: ComplexArray
    contributions: ComplexArray
    n_mount_paths: int
    measured: ComplexArray

    @property
    def table(self) -> pd.DataFrame:
        """Measured and synthesised level over the speed."""
        columns = {"frequency [Hz]": self.frequency, "speed [rpm]": 60 * self.frequency}
        for name, pressure in (
            ("measured", self.measured),
            ("synthesised", self.total),
            ("mounts alone", self.by_mounts),
        ):
            columns[f"{name} [dB(A)]"] = self.level(pressure)
        return pd.DataFrame(columns)

    @property
    def total(self) -> ComplexArray:
        """Sound of all paths, shape (n_frequency,) [Pa]."""
        return np.asarray(self.contributions.sum(axis=1))

    @property
    def by_mounts(self) -> ComplexArray:
        """Sound of the mounts' paths alone, shape (n_frequency,) [Pa]."""
        return np.asarray(self.contributions[:, : self.n_mount_paths].sum(axis=1))

    @property
    def complete(self) -> bool:
        """Whether no path was left out: standard hoses are modelled, others cut."""
        modelled = self.contributions.shape[1] > self.n_mount_paths
        return modelled or self.hoses is not HoseState.STANDARD

    @property
    def points(self) -> tuple[str, ...]:
        """Mounts, then hoses."""
        return tuple(dict.fromkeys(path.rpartition(" ")[0] for path in self.paths))

    @property
    def by_point(self) -> ComplexArray:
        """Sound by each of `points`, shape (n_frequency, n_point) [Pa]."""
        owners = [path.rpartition(" ")[0] for path in self.paths]
        belongs = np.array([[owner == point for point in self.points] for owner in owners])
        return np.asarray(self.contributions @ belongs)

    def level(self, pressure: npt.ArrayLike) -> RealArray:
        """Compute the A-weighted level of any of the pressures, (n_frequency, ...) [dB(A)]."""
        return spl(pressure, self.frequency)


class _Listening:
    """What all syntheses of one sweep share: lines of the band, paths and the body.

    InputError: no line in the band.
    """

    def __init__(
        self, running: RunningInCar, sweep: OperatingSweep, band: tuple[float, float]
    ) -> None:
        self.inside = (sweep.frequency >= band[0]) & (sweep.frequency <= band[1])
        if not self.inside.any():
            raise InputError(
                f"sweep {sweep.name} goes from {sweep.frequency[0]:g} to {sweep.frequency[-1]:g} "
                f"Hz and has no line between {band[0]:g} and {band[1]:g} Hz: choose another band"
            )
        self.lines = sweep.frequency[self.inside]
        modelled = running.hoses is not None and sweep.hoses is HoseState.STANDARD
        self.hoses = running.hoses.hoses if running.hoses is not None and modelled else ()
        mounts, ends = [m.name for m in running.shares.drawn], [hose.name for hose in self.hoses]
        self.paths = (
            *(f"{name} {load}" for name in mounts for load in POINT_LOADS[:N_FORCE]),
            *(f"{name} {load}" for name in ends for load in POINT_LOADS),
        )
        self.receptance = body_receptance(running.accelerance, self.lines, mounts, ends)
        self.holder = holder_displacement(sweep, running.shares.mounts)[self.inside]

    def loads(
        self,
        mounts: tuple[CompressorMount, ...],
        factor: ComplexArray,
        displacement: ComplexArray,
        hoses: tuple[HoseDrawing, ...],
        holder_gain: RealArray | float = 1.0,
    ) -> ComplexArray:
        """Compute the loads on the body, shape (n_frequency, n_path) [N, N m]."""
        holder = holder_gain * self.holder
        loads, _ = loads_by_measured_holders(
            mounts, factor, displacement, holder, hoses, self.lines, self.receptance
        )
        return loads


def cabin_noise(
    running: RunningInCar,
    transfer: WrenchNoiseTransfer | None = None,
    band: tuple[float, float] = BAND,
) -> tuple[SweepNoise, ...]:
    """Synthesise the sound at the ear for every sweep of a car.

    Parameters
    ----------
    running : RunningInCar
        Compressor, mounts and hoses.
    transfer : WrenchNoiseTransfer, optional
        Noise transfer of the car [Pa/N, Pa/(N m)]; computed if left out.
    band : (float, float)
        Lines that are kept [Hz].

    Returns
    -------
    tuple of SweepNoise
        Contributions of all paths, (n_frequency, n_path), complex peak [Pa], in the order of the
        sweeps; hoses contribute where the sweep had standard ones.

    Raises
    ------
    InputError
        A sweep without lines in the band, or with lines at which no transfer function was measured.

    See Also
    --------
    deboom.running_in_car, deboom.compressor.cabin_noise.SweepNoise, deboom.CompressorProblem

    Notes
    -----
    ``p = Σ H_i F_i`` with ``F_i = v(f) (1 + δ) K_i (T_i x − y_i)`` of the mounts and the loads of
    the hoses as beams; thesis, 4.5, in which y and the hoses are missing.

    Examples
    --------
    >>> import deboom
    >>> car = deboom.read_electric_car("car")  # doctest: +SKIP
    >>> running = deboom.running_in_car(
    ...     car, deboom.identify(car.operation.hammer)
    ... )  # doctest: +SKIP
    >>> deboom.cabin_noise(running)[0].table  # doctest: +SKIP
    """
    transfer = transfer or wrench_noise_transfer(running.car)
    return tuple(
        _sweep_noise(running, transfer, sweep, band) for sweep in running.car.operation.sweeps
    )


def _sweep_noise(
    running: RunningInCar,
    transfer: WrenchNoiseTransfer,
    sweep: OperatingSweep,
    band: tuple[float, float],
) -> SweepNoise:
    """Synthesise one sweep."""
    part = _Listening(running, sweep, band)
    lines, mounts = part.lines, running.shares.mounts
    factor = running.identification.calibrated.model.gain.at(lines)
    factor = factor * (1 + running.source.state.significant(lines))
    displacement = displacement_at_virtual_point(sweep, running.identification)[part.inside]
    functions = transfer.at(lines).transfer.select(inputs=part.paths).values[:, 0]

    loads = part.loads(mounts, factor, displacement, part.hoses)
    assert sweep.sound is not None  # the reader of a car insists on it
    return SweepNoise(
        sweep=sweep.name,
        hoses=sweep.hoses,
        pressure=sweep.pressure,
        frequency=lines,
        paths=part.paths,
        loads=loads,
        contributions=np.asarray(contributions(functions, loads)),
        n_mount_paths=N_FORCE * len(mounts),
        measured=sweep.sound.select([running.car.ear]).values[part.inside, 0],
    )


@dataclass(frozen=True, eq=False)
class NoiseBand:
    """Levels that a microphone would show in 90 % of the draws, with and without paths of hoses.

    Lines of a car share the errors of its calibration, so that a band holds nearly all of them or
    few. What moves them together is stated by itself, as the median over the lines of a draw.

    `lower`, `upper` (n_frequency,): of all paths [dB(A)]; `lower_mounts`, `upper_mounts`
    (n_frequency,): of the mounts' paths alone [dB(A)]; `common` (2,): ends of the part that all
    lines of all paths share, against `middle` [dB]; `besides` (2, n_frequency): of what each line
    may be off besides [dB]; `middle` (n_frequency,): median of the draws [dB(A)].
    """

    lower: RealArray
    upper: RealArray
    lower_mounts: RealArray
    upper_mounts: RealArray
    common: RealArray
    besides: RealArray
    middle: RealArray

    @property
    def common_half_width(self) -> float:
        """Half of the width of `common` [dB]."""
        return float(np.ptp(self.common)) / 2

    @property
    def line_half_width(self) -> float:
        """Half of the width of `besides`, median over the lines [dB]."""
        return float(np.median(self.besides[1] - self.besides[0])) / 2


@dataclass(frozen=True, eq=False)
class _Draw:
    """One compressor that the measurements allow."""

    gain: GainFactor
    mounts: tuple[CompressorMount, ...]
    inverse: RealArray
    hoses: tuple[HoseDrawing, ...]
    state: complex
    holder_gain: RealArray


def noise_bands(
    running: RunningInCar,
    transfer: WrenchNoiseTransfer,
    band: tuple[float, float] = BAND,
    *,
    draws: int = 64,
    seed: int = 1,
) -> tuple[NoiseBand, ...]:
    """Draw the sound of every sweep many times.

    - `running`, `transfer`: compressor, mounts and hoses; noise transfer of the same car.
    - `band` (float, float): lines that are kept [Hz].
    - `draws`, `seed`: number of draws, and their seed.
    - raises InputError: as `cabin_noise`.

    Every draw has its own compressor from the joint posterior of model and placement, its own
    single mounts, hoses, state of the mounts in operation, gains of the holders' accelerometers,
    noise transfer functions, whose hammer and places are wrong alike at every line, and noise of
    the microphone as the test states it. Left out: noise of the accelerations, which is a hundredth
    of these, and places of the holders' accelerometers.
    """
    drawn = _draws(running, draws, seed)
    bands = []
    for number, sweep in enumerate(running.car.operation.sweeps):
        generator = np.random.default_rng([seed, 2, number])
        both = _levels(running, transfer, sweep, band, drawn, generator)
        (lower, lower_mounts), (upper, upper_mounts) = _ends(both)
        middle = np.median(both[:, 0], axis=0)
        off = both[:, 0] - middle
        together = np.median(off, axis=1)
        besides = _ends(off - together[:, np.newaxis])
        bands.append(
            NoiseBand(lower, upper, lower_mounts, upper_mounts, _ends(together), besides, middle)
        )
    return tuple(bands)


def _ends(drawn: RealArray) -> RealArray:
    """Return values between which a further draw lies with 90 %, shape (2, ...)."""
    return np.asarray(np.percentile(drawn, TAILS, axis=0, method="weibull"))


def _draws(running: RunningInCar, count: int, seed: int) -> list[_Draw]:
    """Compressors, mounts, hoses and states of the mounts that agree with the measurements."""
    calibrated = running.identification.calibrated
    n = calibrated.values.size
    variance, directions = np.linalg.eigh(calibrated.covariance)
    spread = directions * np.sqrt(np.maximum(variance, 0.0))
    sampled = [()] * count if running.hoses is None else running.hoses.samples(count, seed)
    generator = np.random.default_rng([seed, 1])
    result = []
    for hoses in sampled:
        off = spread @ generator.standard_normal(variance.size)
        forward = calibrated.placement.response_matrix(calibrated.errors + off[n:])
        result.append(
            _Draw(
                gain=calibrated.parametrisation.model(calibrated.values + off[:n]).gain,
                mounts=running.shares.at_random(off[:n][STIFFNESS_NUMBERS], generator),
                inverse=np.asarray(np.linalg.pinv(forward), dtype=float),
                hoses=hoses,
                state=complex(*generator.standard_normal(2)) / np.sqrt(2),
                holder_gain=1
                + running.car.tolerances.sensor_gain
                * generator.standard_normal(N_FORCE * len(running.shares.drawn)),
            )
        )
    return result


def _levels(
    running: RunningInCar,
    transfer: WrenchNoiseTransfer,
    sweep: OperatingSweep,
    band: tuple[float, float],
    drawn: Sequence[_Draw],
    generator: np.random.Generator,
) -> RealArray:
    """Levels of all paths and of the mounts' alone, shape (n_draw, 2, n_frequency) [dB(A)]."""
    part = _Listening(running, sweep, band)
    lines = part.lines
    at_lines = transfer.at(lines)
    columns = [at_lines.transfer.inputs.index(path) for path in part.paths]
    square = (2 * np.pi * lines[:, np.newaxis]) ** 2
    recorded = -sweep.acceleration.values[part.inside] / square
    state = running.source.state
    change = state.significant(lines)
    unsure = np.interp(lines, state.frequency, state.curve_deviation)
    noise = running.car.operation.sound_deviation.get(running.car.ear, 0.0)
    levels = []
    for draw in drawn:
        factor = draw.gain.at(lines) * (1 + change + unsure * draw.state)
        hoses = draw.hoses if part.hoses else ()
        moved = recorded @ draw.inverse.T
        loads = part.loads(draw.mounts, factor, moved, hoses, draw.holder_gain)
        heard = at_lines.drawn(generator)[:, columns] * loads
        n = N_FORCE * len(draw.mounts)
        sounds: ComplexArray = np.stack([heard.sum(axis=1), heard[:, :n].sum(axis=1)], axis=1)
        sounds += noise * (generator.standard_normal((lines.size, 1, 2)) @ [1, 1j])
        levels.append(spl(sounds, lines).T)
    return np.array(levels)
