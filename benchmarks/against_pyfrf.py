"""H1, H2, Hv and coherence against pyFRF on the same blocks: an outside judge, run by hand.

pyFRF draws pylint and pytest into every environment, so it is no dependency, not even of the
tests. In an environment of its own (deboom's physics needs numpy and scipy only)::

    python -m venv /somewhere/pyfrf && /somewhere/pyfrf/bin/pip install pyFRF
    PYTHONPATH=src /somewhere/pyfrf/bin/python benchmarks/against_pyfrf.py

Leaves with 1 where a difference is above 1e-10.
"""

from __future__ import annotations

import sys

import numpy as np
from pyFRF import FRF

from deboom.physics.frf import CrossSpectra, cross_spectra, h1, h2, hv, multiple_coherence

RATE, N_SAMPLE, N_BLOCK = 1024, 1024, 12
LINES = slice(5, 500)
LARGEST = 1e-10


def blocks(n_input: int, n_output: int) -> tuple[np.ndarray, np.ndarray]:
    """Noise through filters of three samples, noise at both ends."""
    generator = np.random.default_rng(1)
    inputs = generator.normal(size=(N_BLOCK, N_SAMPLE, n_input))
    filters = generator.normal(size=(3, n_output, n_input))
    outputs = sum(np.roll(inputs, lag, axis=1) @ filters[lag].T for lag in range(3))
    inputs = inputs + 0.2 * generator.normal(size=inputs.shape)
    return inputs, outputs + 0.5 * generator.normal(size=outputs.shape)


def judge(inputs: np.ndarray, outputs: np.ndarray) -> FRF:
    """Blocks as pyFRF wants them: measurement, channel, time; FRF as acceleration per force."""
    return FRF(
        sampling_freq=RATE,
        exc=inputs.transpose(0, 2, 1),
        resp=outputs.transpose(0, 2, 1),
        exc_type="f",
        resp_type="a",
        window="none",
        fft_len=N_SAMPLE,
    )


def difference(ours: np.ndarray, theirs: np.ndarray) -> float:
    """Largest difference over the largest value."""
    theirs = np.moveaxis(theirs, -1, 0)
    return float(np.abs(ours[LINES] - theirs[LINES]).max() / np.abs(theirs[LINES]).max())


def main() -> int:
    rows: list[tuple[str, float]] = []
    for n_input, n_output in ((1, 1), (1, 3), (2, 2), (2, 3)):
        inputs, outputs = blocks(n_input, n_output)
        spectra: CrossSpectra = cross_spectra(inputs, outputs, RATE)
        other = judge(inputs, outputs)
        case = f"{n_output} x {n_input}"

        def theirs(estimator: str, other: FRF = other) -> np.ndarray:
            return other.get_FRF(frf_estimator=estimator, frf_form="accelerance")

        # 0 Hz and rate/2, which pyFRF's forms divide by or ours does not need, are left out
        part = spectra.on_lines(np.arange(spectra.frequency.size) < N_SAMPLE // 2)
        rows.append((f"H1 {case}", difference(h1(part), theirs("H1"))))
        if n_input in (1, n_output):
            rows.append((f"H2 {case}", difference(h2(part), theirs("H2"))))
        if n_input == 1:
            # its noise ratio is 1 in whatever units the channels have
            rows.append((f"Hv {case}", difference(hv(part, 1.0), theirs("Hv"))))
        gamma2 = np.real(other.get_coherence())
        rows.append((f"coherence {case}", difference(multiple_coherence(part), gamma2)))
    for name, value in rows:
        print(f"{name:16} {value:.1e}  {'ok' if value <= LARGEST else 'DIFFERS'}")
    return int(any(value > LARGEST for _, value in rows))


if __name__ == "__main__":
    sys.exit(main())
