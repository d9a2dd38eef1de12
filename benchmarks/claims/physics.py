"""Physics: equations against standards, published bodies and other ways of solving.

Each figure comes from a second way to the same number: a printed table, a direct solution of all
masses and springs, an integration in time, another algorithm. Seeds of the campaigns: 1 upwards.
"""

import csv
import json
from itertools import permutations
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import eigh

from claims import Claim
from deboom.physics.dynamic_stiffness import dynamic_stiffness, stiffness_hv
from deboom.physics.forced_response import forced_response
from deboom.physics.frf import FrfForm, convert, mac, msf
from deboom.physics.rigid_body import (
    mass_matrix,
    mass_properties,
    mount_stiffness_matrix,
    rigid_body_modes,
)
from deboom.physics.sound_level import a_weighting, spl
from deboom.physics.transfer_path import (
    assembled_frf,
    blocked_force,
    blocked_force_on_rig,
    interface_force,
    mounted_source,
    pressure,
)

DATA = Path(__file__).parents[2] / "tests" / "data"


def claims() -> list[Claim]:
    return [
        *_a_weighting(),
        *_level(),
        *_transfer_paths(),
        *_correlation(),
        *_rigid_body(),
        *_steady_state(),
        *_frf_forms(),
        *_stiffness_estimates(),
    ]


def _below(topic: str, bound: float, measured: float, unit: str, sample: str) -> Claim:
    measured = float(measured)
    asked, figure = (f"{value} {unit}".strip() for value in (f"≤ {bound:g}", f"{measured:.3g}"))
    return Claim(topic, asked, f"{figure}, {sample}", measured <= bound)


def _worst(ours, truth) -> float:
    """Largest difference, relative to the largest true value."""
    return float(np.max(np.abs(ours - truth)) / np.max(np.abs(truth)))


def _a_weighting() -> list[Claim]:
    folder = DATA / "iec61672-cirrus"
    with (folder / "iec_61672_1_2013.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    number, nominal, table = (
        np.array([float(row[key]) for row in rows]) for key in ("n", "nominal", "A")
    )
    exact = 1000 * 10 ** (number / 10)
    at_exact, at_nominal = (np.abs(a_weighting(f) - table) for f in (exact, nominal))

    frequency_of = dict(zip(nominal, exact, strict=True))
    errors = []
    for name in ("overall_oct_zac_comma_2dec.csv", "overall_third_zac_comma_2dec.csv"):
        with (folder / name).open(newline="") as file:
            for row in csv.DictReader(file):
                digits = row["Band"].removesuffix("Hz")
                if digits == row["Band"]:
                    continue
                band = float(digits.removesuffix("k")) * (1000 if digits.endswith("k") else 1)
                if band < 10:
                    continue
                unweighted, printed = (float(row[key].split()[0]) for key in ("Value", "A"))
                errors.append(abs(unweighted + a_weighting(frequency_of[band]) - printed))
    lines = np.arange(20, 60.1, 0.25)
    squared = lines**2
    as_printed = 12194**2 * squared**2 / (squared + 20.59**2) / (squared + 12194**2)
    as_printed /= np.sqrt((squared + 107.6**2) * (squared + 737.8**2))
    missing = float(np.mean(20 * np.log10(as_printed) - a_weighting(lines)))
    return [
        _below(
            "A-weighting against the table of IEC 61672-1, exact mid-band frequencies",
            0.05,
            at_exact.max(),
            "dB",
            f"{table.size} bands",
        ),
        _below(
            "the same at nominal frequencies (the table is not for them)",
            0.3,
            at_nominal.max(),
            "dB",
            f"worst at {nominal[at_nominal.argmax()]:g} Hz",
        ),
        _below(
            "A levels printed by a sound level meter, from its Z levels",
            0.06,
            max(errors),
            "dB",
            f"{len(errors)} readings from 10 Hz",
        ),
        Claim(
            "thesis's A(f) in decibels, as printed",
            "fails by −2.0 dB",
            f"{missing:.2f} dB, mean over 20–60 Hz",
            abs(missing + 2) < 0.02,
        ),
    ]


def _level() -> list[Claim]:
    time = np.arange(48000) / 48000
    record = np.cos(2 * np.pi * 1000 * time)
    in_time = 20 * np.log10(np.sqrt(np.mean(record**2)) / 20e-6)
    level = float(spl([1.0], [1000.0])[0])
    return [
        Claim(
            "level of 1 Pa peak at 1 kHz",
            "90.97 dB(A), as the rms of a record",
            f"{level:.3f} dB(A); record {in_time:.3f} dB",
            abs(level - in_time) < 1e-9 and abs(level - 90.97) < 0.005,
        ),
    ]


def _transfer_paths(seeds: int = 100) -> list[Claim]:
    names = (
        "mount forces",
        "pressure by interface forces and uncoupled receiver",
        "pressure by blocked forces and assembled functions",
        "blocked forces from a rig that gives way",
    )
    worst = np.max([_one_assembly(seed) for seed in range(1, seeds + 1)], axis=0)
    return [
        _below(
            f"{name}, against the direct solution",
            1e-10,
            float(value),
            "of the maximum",
            f"{seeds} random assemblies",
        )
        for name, value in zip(names, worst, strict=True)
    ]


def _one_assembly(seed: int, n_path: int = 4, n_lines: int = 31) -> list[float]:
    """Random source (8 masses, free), mounts, receiver (9, grounded) and rig (4, grounded)."""
    generator = np.random.default_rng(seed)
    frequency = np.linspace(20, 80, n_lines)
    omega = (2 * np.pi * frequency)[:, np.newaxis, np.newaxis]

    def network(n: int, grounded: bool):
        mass = np.diag(generator.uniform(3, 40, n))
        springs = np.triu(generator.uniform(2e5, 3e6, (n, n)), 1)
        springs += springs.T
        stiffness = np.diag(springs.sum(0)) - springs
        if grounded:
            stiffness += np.diag(generator.uniform(1e5, 2e6, n))
        return stiffness * (1 + 1j * generator.uniform(0.01, 0.08)) - omega**2 * mass

    source, receiver, rig = network(8, False), network(9, True), network(n_path, True)
    ears = generator.normal(size=(2, 9))
    mounts = generator.uniform(1e5, 1e6, (n_lines, n_path)) * (1 + 0.1j)
    inside = np.zeros((n_lines, 8), dtype=complex)
    inside[:, n_path:] = generator.normal(size=(n_lines, 8 - n_path, 2)) @ [1, 1j]

    def operate(other):
        n_other = other.shape[1]
        matrix = np.zeros((n_lines, 8 + n_other, 8 + n_other), dtype=complex)
        matrix[:, :8, :8], matrix[:, 8:, 8:] = source, other
        above = np.arange(n_path)
        below = above + 8
        for row, column, sign in (
            (above, above, 1),
            (below, below, 1),
            (above, below, -1),
            (below, above, -1),
        ):
            matrix[:, row, column] += sign * mounts
        force = np.concatenate([inside, np.zeros((n_lines, n_other))], axis=1)
        motion = np.linalg.solve(matrix, force[..., np.newaxis])[..., 0]
        return mounts * (motion[:, above] - motion[:, below]), motion[:, 8:]

    true_force, true_receiver = operate(receiver)
    cell, rig_motion = operate(rig)
    held = source.copy()
    held[:, np.arange(n_path), np.arange(n_path)] += mounts
    held_force = mounts * np.linalg.solve(held, inside[..., np.newaxis])[:, :n_path, 0]
    alone, body = np.linalg.inv(source), np.linalg.inv(receiver)
    mounted = mounted_source(alone[:, :n_path, :n_path], mounts)
    at_interface, ntf = body[:, :n_path, :n_path], ears @ body[:, :, :n_path]
    free = (alone @ inside[..., np.newaxis])[:, :n_path, 0]
    force, blocked = interface_force(mounted, at_interface, free), blocked_force(mounted, free)
    assembled = assembled_frf(ntf, at_interface, mounted, mounted)
    return [
        _worst(force, true_force),
        _worst(pressure(ntf, force), true_receiver @ ears.T),
        _worst(pressure(assembled, blocked), true_receiver @ ears.T),
        _worst(blocked_force_on_rig(mounted, cell, rig_motion), held_force),
    ]


def _correlation(seeds: int = 500) -> list[Claim]:
    factor_error, mac_error = [], []
    for seed in range(1, seeds + 1):
        generator = np.random.default_rng(seed)
        curve, other = generator.normal(size=(2, 161, 2)) @ [1, 1j]
        factor = generator.normal(size=2) @ [1, 1j]
        factor_error.append(abs(msf(factor * curve, curve) - factor) / abs(factor))
        columns = np.column_stack([np.r_[c.real, c.imag] for c in (other, 1j * other)])
        whole = np.r_[curve.real, curve.imag]
        unexplained = np.linalg.lstsq(columns, whole)[1][0] / (whole @ whole)
        mac_error.append(abs(1 - mac(curve, other) - unexplained))
    sample = f"{seeds} random curves"
    return [
        _below(
            "MSF returns a complex scale factor", 1e-10, max(factor_error), "of the factor", sample
        ),
        _below(
            "1 − MAC against the residual of a least-squares fit", 1e-10, max(mac_error), "", sample
        ),
    ]


def _random_body(generator):
    sides = generator.uniform(0.2, 0.6, 3)
    turn = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    mass = generator.uniform(5, 250)
    inertia = turn @ np.diag(mass / 12 * (np.sum(sides**2) - sides**2)) @ turn.T
    positions = generator.uniform(-0.5, 0.5, (4, 3))
    springs = generator.uniform(5e4, 8e5, (4, 3))
    return mass_matrix(mass, inertia, generator.uniform(-0.1, 0.1, 3)), positions, springs


def _rigid_body(seeds: int = 300) -> list[Claim]:
    errors = []
    for seed in range(1, seeds + 1):
        mass, positions, springs = _random_body(np.random.default_rng(seed))
        # strain energy of the springs under unit motions, by cross products
        ends = np.concatenate(
            [
                np.broadcast_to(np.eye(3)[:, np.newaxis], (3, 4, 3)),
                np.cross(np.eye(3)[:, None], positions),
            ]
        )
        energy = np.einsum("ima,ma,jma->ij", ends, springs, ends)
        expected = np.sqrt(eigh(energy, mass, eigvals_only=True)) / (2 * np.pi)
        found = rigid_body_modes(mass, mount_stiffness_matrix(positions, springs))[0]
        errors.append(_worst(found, expected))
    return [
        _below(
            "modes of a body on four mounts against strain energy and LAPACK's pencil",
            1e-10,
            max(errors),
            "of the frequency",
            f"{seeds} random bodies",
        ),
        *_published_bodies(),
    ]


def _published_bodies() -> list[Claim]:
    file = DATA / "benchmarks" / "benchmarks.json"
    cases = json.loads(file.read_text(encoding="utf-8"))["rigid_mass_matrix_to_cg"]["cases"]
    error = max(
        float(np.abs(mass_properties(case["M_struc"], 1e-3).centre - case["rCG"]).max())
        for case in cases.values()
    )
    sample = f"{len(cases)} floating platforms"
    return [_below("centre of gravity of published 6×6 mass matrices", 1e-6, error, "m", sample)]


def _steady_state(seeds: int = 4) -> list[Claim]:
    errors = []
    for seed in range(1, seeds + 1):
        generator = np.random.default_rng(seed)
        mass, positions, springs = _random_body(generator)
        static = mount_stiffness_matrix(positions, springs)
        slowest = 2 * np.pi * rigid_body_modes(mass, static)[0][0]
        dampers = static * 0.3 / slowest  # damping ratio of each mode at least 0.15
        frequency = generator.uniform(10, 40)
        omega = 2 * np.pi * frequency
        load = generator.normal(size=(1, 6, 2)) @ [1, 1j]

        def motion(time, state, mass=mass, static=static, dampers=dampers, omega=omega, load=load):
            force = (load[0] * np.exp(1j * omega * time)).real
            moving = np.linalg.solve(mass, force - static @ state[:6] - dampers @ state[6:])
            return np.concatenate([state[6:], moving])

        end = 25 / (0.15 * slowest)
        times = np.linspace(end - 2 * np.pi / omega, end, 33)[:-1]
        record = solve_ivp(motion, (0, end), np.zeros(12), "LSODA", times, rtol=1e-9, atol=1e-14)
        in_time = 2 * np.mean(record.y[:6] * np.exp(-1j * omega * times), axis=1)
        stiffness = (static + 1j * omega * dampers)[np.newaxis]
        errors.append(_worst(forced_response(mass, stiffness, load, [frequency])[0], in_time))
    return [
        _below(
            "steady motion of a body against integration in time",
            1e-5,
            max(errors),
            "of the maximum",
            f"{seeds} random bodies",
        )
    ]


def _frf_forms(seeds: int = 20) -> list[Claim]:
    errors = []
    frequency = np.linspace(10, 140, 14)
    for seed in range(1, seeds + 1):
        values = np.random.default_rng(seed).normal(size=(14, 6, 6, 2)) @ [1, 1j]
        errors += [
            _worst(convert(convert(values, frequency, a, b), frequency, b, a), values)
            for a, b in permutations(FrfForm, 2)
        ]
    return [
        _below(
            "forms of frequency response functions, there and back",
            1e-10,
            max(errors),
            "of the maximum",
            f"{len(errors)} conversions",
        )
    ]


def _stiffness_estimates(seeds: int = 200, repeats: int = 20) -> list[Claim]:
    """Repeated records, noise of 20 % in the motion and 5 % in the force."""
    truth = 4e5 * (1 + 0.15j)
    plain, joined = [], []
    for seed in range(1, seeds + 1):
        generator = np.random.default_rng(seed)
        noise = generator.normal(size=(2, repeats, 2)) @ [1, 1j] / np.sqrt(2)
        motion = 1e-4 * (1 + 0.2 * noise[0])
        force = truth * 1e-4 + 0.05 * abs(truth) * 1e-4 * noise[1]
        ratio = 0.05 * abs(truth) / 0.2
        plain.append(np.mean(force * motion.conj()) / np.mean(np.abs(motion) ** 2))
        joined.append(complex(stiffness_hv(force, motion, ratio)))
    exact = dynamic_stiffness(truth * 1e-4, 1e-4)
    bias = [100 * abs(np.mean(values) / truth - 1) for values in (plain, joined)]
    return [
        Claim(
            "bias of the dynamic stiffness over noisy repeats, Hv-type estimate",
            "≤ 0.5 %, where H1 loses about 4 %",
            f"{bias[1]:.2f} % (H1 {bias[0]:.1f} %), {seeds} × {repeats} records",
            bool(bias[1] <= 0.5 and abs(exact - truth) <= 1e-9 * abs(truth)),
        )
    ]
