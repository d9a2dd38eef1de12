"""Modal analysis of the body.

The loudspeaker at each ear in turn, accelerometers at the mounts and on the panels, sdypy-EMA's
LSCF behind a guard, poles refined by maximum likelihood. Vehicles of the bench with the errors of a
good laboratory, their bodies the same on all days unless stated. Bodies of the first rows are of
the family brackets: eight modes each, with damping ratios of 1.3 % and more.

Other bodies follow: those of the bench's other families, which have up to a mode per 3 Hz and
ratios from 0.3 %, and four kinds that are drawn here, 21 outputs under two loads with noise of 2 %
of each function. Their modes count where the own peak in at least one function is three times the
noise there, and where the next mode lies the mean of both half-power widths away. A mode is found
with a frequency within 0.5 % and a MAC above 0.9; a pole is false where no mode of body or air lies
within its damping ratio. Modes that miss stand within 1 to 2 Hz of one several times as strong, or
beside two of them just below the first line.

A loudspeaker excites what an ear hears: a mode that hardly reaches an ear leaves no trace in these
FRFs, so neither the poles nor the rebuilt FRFs can tell of it. The hammer does excite it, but its
accelerations show mostly how the body gives way right under the mount: they do not stabilise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.ndimage import uniform_filter1d

from claims import CASES, Claim, draws, reported
from deboom.arrays import RealArray
from deboom.bench.families import KINDS, draw_family
from deboom.bench.fleet import NO_SPREAD, load_fleet, panel_pressure
from deboom.bench.layout import FREQUENCY
from deboom.bench.vehicle_writer import NO_VEHICLE_ERRORS, VehicleErrors, write_vehicle
from deboom.files.vehicle import read_vehicle
from deboom.measurement.body_modes import BAND, BodyModes, body_modes
from deboom.measurement.channels import Frf
from deboom.measurement.modal import (
    LARGE_ERROR,
    ModalModel,
    auxiliary_clusters,
    mac_matrix,
    modal_model,
    pole_clusters,
    poles_over_orders,
    refined_poles,
)
from deboom.physics.frf import FrfForm

N_MODES = 5


@dataclass(frozen=True)
class _Judged:
    """How the lowest modes of a vehicle compare with its true ones.

    - `holds`: all three limits; `flagged`: the rebuilt FRFs tell that the model lacks something.
    - `damping_error` (n_mode,): of the damping ratio [1]; `mac` (n_mode,): the lower one of all
      outputs and of the mount points [1].
    """

    holds: bool
    flagged: bool
    damping_error: RealArray
    mac: RealArray


def _judged(vehicle: str, seed: int) -> tuple[_Judged, _Judged]:
    """Judge modes with the poles of the orders, and with those that maximum likelihood refines."""
    with TemporaryDirectory() as folder:
        errors = VehicleErrors(state=NO_SPREAD)
        options = {"errors": errors, "load_cases": (), "accelerance": False}
        path = write_vehicle(Path(folder) / "car", seed, vehicle, **options)
        car = read_vehicle(path)
        with np.load(path / "truth/vehicle.npz") as truth:
            at_points = truth["shapes_at_interfaces"][:, :, :3]
            shapes = np.hstack([at_points.reshape(len(at_points), -1), truth["shapes_at_panels"]])
            measured = truth["natural_frequencies"] >= FREQUENCY[0]
            true = truth["natural_frequencies"][measured], truth["damping_ratios"][measured]
    refined = body_modes(car)
    of_orders = modal_model(
        refined.measured,
        FrfForm.RECEPTANCE,
        refined.chart.band,
        pole_clusters(refined.chart),
        auxiliary_clusters(refined.chart),
    )
    judged = []
    for part in (replace(refined, model=of_orders), refined):
        frequency_error, damping_error = (
            np.abs(estimated[:N_MODES] / exact[:N_MODES] - 1)
            for estimated, exact in zip(
                (part.model.frequency, part.model.damping), true, strict=True
            )
        )
        mac = np.min([np.diag(part.mac(shapes[measured], only)) for only in (False, True)], axis=0)
        holds = frequency_error.max() <= 0.005 and damping_error.max() <= 0.15 and mac.min() >= 0.95
        judged.append(
            _Judged(bool(holds), part.model.total_error > LARGE_ERROR, damping_error, mac)
        )
    return judged[0], judged[1]


@dataclass(frozen=True)
class _DrawnKind:
    """Bodies that are drawn here: modes, and bounds of their frequencies [Hz] and dampings [1].

    `pair`: how far over each mode another one lies [1]; 0 for none.
    """

    modes: int
    frequency: tuple[float, float]
    damping: tuple[float, float]
    pair: float = 0.0


DRAWN = {
    "twelve modes of 1 to 5 %": _DrawnKind(12, (18.0, 85.0), (0.01, 0.05)),
    "pairs 1.5 % apart of 0.4 to 1.5 %": _DrawnKind(4, (18.0, 85.0), (0.004, 0.015), 0.015),
    "eight modes of 0.3 to 1 %": _DrawnKind(8, (18.0, 85.0), (0.003, 0.01)),
    "24 modes of 0.3 to 3 %": _DrawnKind(24, (12.0, 100.0), (0.003, 0.03)),
}
N_OUTPUT, N_LOAD, NOISE, FLOOR = 21, 2, 0.02, 0.005
"""Of drawn bodies; noise over each function, and over its rms [1]."""
VISIBLE = 3.0
FIRST_SEED = 51


@dataclass(frozen=True)
class _TrueModes:
    """Modes of a body, and the poles that are none of its own.

    - `peak` (n_mode,): largest over all functions of the mode's own peak over the noise there [1].
    - `of_air`: natural frequencies of the cavity, which the functions have as well [Hz].
    """

    frequency: RealArray
    damping: RealArray
    shapes: RealArray
    peak: RealArray
    of_air: tuple[float, ...] = ()

    @property
    def counted(self) -> RealArray:
        """Say which modes count, (n_mode,)."""
        f, width = self.frequency, 2 * self.damping * self.frequency
        apart = np.abs(f[:, np.newaxis] - f) >= (width[:, np.newaxis] + width) / 2
        apart |= np.eye(f.size, dtype=bool)
        inside = (f >= BAND[0]) & (f <= BAND[1])
        return np.asarray(inside & apart.all(axis=1) & (self.peak >= VISIBLE))


def _drawn(kind: _DrawnKind, seed: int) -> tuple[ModalModel, _TrueModes]:
    """Identify a body that is drawn here."""
    draw = np.random.default_rng([seed, kind.modes])
    f = draw.uniform(*kind.frequency, kind.modes)
    z = np.exp(draw.uniform(*np.log(kind.damping), kind.modes))
    if kind.pair:
        f, z = np.append(f, f * (1 + kind.pair)), np.append(z, z * draw.uniform(0.7, 1.4, z.size))
    f, z = f[np.argsort(f)], z[np.argsort(f)]
    shapes, loads = (draw.normal(size=(f.size, n)) for n in (N_OUTPUT, N_LOAD))
    s, natural = 2j * np.pi * FREQUENCY[:, np.newaxis], 2 * np.pi * f
    exact = np.einsum("fm,mo,mi->foi", 1 / (natural**2 + 2 * z * natural * s + s**2), shapes, loads)
    size = np.sqrt(np.mean(np.abs(exact) ** 2, axis=0))
    exact = exact + 0.2 * size * draw.normal(size=size.shape)  # modes above
    noise = np.sqrt((NOISE * np.abs(exact)) ** 2 + (FLOOR * size) ** 2)
    real, imaginary = draw.normal(size=(2, *exact.shape)) / np.sqrt(2)
    names = tuple(f"point {number}" for number in range(N_OUTPUT))
    values = exact + noise * (real + 1j * imaginary)
    frf = Frf(FREQUENCY, values, names, ("left", "right"), "m/N")
    own = np.abs(shapes[:, :, np.newaxis] * loads[:, np.newaxis])
    truth = _TrueModes(f, z, shapes, _peak(own, f, z, noise))
    form = FrfForm.RECEPTANCE
    chart = poles_over_orders(frf, form, BAND)
    poles = refined_poles(frf, form, BAND, pole_clusters(chart), auxiliary_clusters(chart))
    return modal_model(frf, form, BAND, *poles), truth


def _peak(own: RealArray, f: RealArray, z: RealArray, noise: RealArray) -> RealArray:
    """Return the largest own peak over the noise, (n_mode,), of residues (n_mode, n_out, n_in)."""
    line = np.abs(FREQUENCY[:, np.newaxis] - f).argmin(axis=0)
    at_peak = own / (2 * z * (2 * np.pi * f) ** 2)[:, np.newaxis, np.newaxis]
    return np.asarray((at_peak / noise[line]).max(axis=(1, 2)))


def _of_family(kind: str, seed: int) -> tuple[ModalModel, _TrueModes]:
    """Identify a car of a family of the bench."""
    fleet = draw_family(kind, seed, 1).fleet()
    name = list(fleet.bodies)[seed % len(fleet.bodies)]
    identified = []
    for errors in (VehicleErrors(state=NO_SPREAD), NO_VEHICLE_ERRORS):
        with TemporaryDirectory() as folder:
            options = {"errors": errors, "load_cases": (), "accelerance": False, "family": kind}
            path = write_vehicle(Path(folder) / "car", seed, name, **options)
            identified.append(body_modes(read_vehicle(path), n_modes=1))
            with np.load(path / "truth/vehicle.npz") as truth:
                f, z = truth["natural_frequencies"], truth["damping_ratios"]
                at_panels = truth["shapes_at_panels"]
                at_points = truth["shapes_at_interfaces"][:, :, :3].reshape(f.size, -1)
    shapes = np.hstack([at_points, at_panels])
    of_ears = np.einsum("mep,mp->me", panel_pressure(fleet.cabin, f), at_panels)
    own = np.abs(shapes[:, :, np.newaxis] * of_ears[:, np.newaxis])
    peak = _peak(own, f, z, _noise(*identified))
    of_air = tuple(mode.frequency for mode in fleet.cabin.modes)
    return identified[0].model, _TrueModes(f, z, shapes, peak, of_air)


def _noise(measured: BodyModes, exact: BodyModes) -> RealArray:
    """Return what scatters from line to line, (n_line, n_out, n_in): calibration does not."""
    error = measured.measured.values - exact.measured.values
    parts = np.stack([error.real, error.imag])
    scatter = np.sum((parts - uniform_filter1d(parts, 9, axis=1)) ** 2, axis=0)
    return np.asarray(np.sqrt(9 / 8 * uniform_filter1d(scatter, 15, axis=0)))


def _found(model: ModalModel, truth: _TrueModes) -> tuple[RealArray, int]:
    """Return the damping errors of the counted modes, nan where one is missed, and false poles."""
    off = np.abs(model.frequency[:, np.newaxis] / truth.frequency - 1)
    alike = (off <= 0.005) & (mac_matrix(model.shapes, truth.shapes) > 0.9)
    error = np.full(truth.frequency.size, np.nan)
    used: set[int] = set()
    for pole, mode in sorted(np.argwhere(alike).tolist(), key=lambda pair: off[*pair]):
        if pole not in used and np.isnan(error[mode]):
            used.add(pole)
            error[mode] = abs(model.damping[pole] / truth.damping[mode] - 1)
    near = (off <= np.maximum(0.005, truth.damping)).any(axis=1)
    for frequency in truth.of_air:
        near |= np.abs(model.frequency / frequency - 1) < 0.05
    return error[truth.counted], int(np.sum(~near))


def _other_bodies() -> list[Claim]:
    seeds = range(FIRST_SEED, FIRST_SEED + draws(6))
    bodies = {
        **{f"family {kind}": [_of_family(kind, seed) for seed in seeds] for kind in KINDS},
        **{name: [_drawn(kind, seed) for seed in seeds] for name, kind in DRAWN.items()},
    }
    claimed = []
    for name, cases in bodies.items():
        found = [_found(model, truth) for model, truth in cases]
        error = np.concatenate([each for each, _ in found])
        false, poles = sum(each for _, each in found), sum(len(model.shapes) for model, _ in cases)
        share, median = float(np.mean(~np.isnan(error))), float(np.nanmedian(error))
        claimed.append(
            Claim(
                f"{name}, {len(cases)} bodies: modes found of those that count; error of damping, "
                "median; false poles of all",
                "≥ 80 %; ≤ 1 %; ≤ 1 in 20",
                f"{np.sum(~np.isnan(error))} of {error.size}; {100 * median:.2f} %; {false} of "
                f"{poles}",
                share >= 0.8 and median <= 0.01 and false <= poles / 20,
            )
        )
    return claimed


def claims() -> list[Claim]:
    judged: dict[str, tuple[_Judged, _Judged]] = {}
    for seed in CASES:
        names = list(load_fleet(seed).bodies)
        for place in (2 * seed, 2 * seed + 1):
            name = names[place % len(names)]
            judged[f"{name} of fleet {seed}"] = _judged(name, seed)
    total = len(judged)
    missed = {name: after for name, (_, after) in judged.items() if not after.holds}
    of_orders = sum(before.holds for before, _ in judged.values())
    held = [pair for pair in judged.values() if pair[0].holds]
    damping = [_rms([pair[which].damping_error for pair in held]) for which in (0, 1)]
    likeness = [1 - float(np.median([pair[which].mac for pair in held])) for which in (0, 1)]
    return [
        Claim(
            f"of {total} vehicles, two of each of {len(CASES)} fleets: whose five lowest modes "
            f"above the first line, {FREQUENCY[0]:g} Hz, all hold the three limits",
            "≥ 80 %",
            f"{total - len(missed)}; not {', '.join(missed)}; "
            f"{sum(each.flagged for each in missed.values())} of these flagged by the rebuilt FRFs",
            total - len(missed) >= 0.8 * total,
        ),
        reported(
            "the same with the poles of the orders, without maximum likelihood after it; rms error "
            "of damping of those that hold then, before and after; 1 − MAC, median",
            f"{of_orders}; {100 * damping[0]:.1f} and {100 * damping[1]:.1f} %; "
            f"{likeness[0]:.5f} and {likeness[1]:.5f}",
        ),
        *_other_bodies(),
    ]


def _rms(errors: list[RealArray]) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))
