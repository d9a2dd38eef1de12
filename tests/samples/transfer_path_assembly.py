"""A source, mounts and a receiver of masses and springs, solved directly: truth for TPA.

All forces, accelerations and the pressure come out of one dynamic stiffness of all masses, springs
and mounts. What an analysis gets are accelerances of separate measurements.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

N_PATH, N_SOURCE, N_RECEIVER = 9, 14, 40
INTERFACE = np.arange(N_PATH)  # first masses of both bodies
INDICATORS, VALIDATION = np.arange(N_PATH, 31), np.arange(31, 35)
FREQUENCY = np.arange(20, 80.1, 2.0)
OMEGA = 2 * np.pi * FREQUENCY


def accelerance(displacement):
    """Acceleration, or accelerance, of a displacement per line."""
    return -(OMEGA**2).reshape(-1, *[1] * (displacement.ndim - 1)) * displacement


def body(n_mass, rng, ground):
    """Dynamic stiffness of masses joined at random by damped springs, shape (f, n, n) [N/m]."""
    stiffness = np.diag(ground * rng.uniform(0.5, 1.5, n_mass))
    for first in range(n_mass):
        for second in rng.choice(n_mass, 5, replace=False):
            if first != second:
                between = np.zeros(n_mass)
                between[first], between[second] = 1, -1
                stiffness += rng.uniform(1e4, 4e5) * np.outer(between, between)
    mass = np.diag(rng.uniform(3, 12, n_mass))
    return stiffness * (1 + 0.05j) - OMEGA[:, np.newaxis, np.newaxis] ** 2 * mass


@dataclass
class Source:
    """A source with its mounts [N/m] and what drives it inside [N]."""

    stiffness: np.ndarray
    mounts: np.ndarray
    drive: np.ndarray

    def joined(self, below):
        """Dynamic stiffness of the source, its mounts and what stands below them."""
        n = N_SOURCE + below.shape[1]
        matrix = np.zeros((FREQUENCY.size, n, n), dtype=complex)
        matrix[:, :N_SOURCE, :N_SOURCE] = self.stiffness
        matrix[:, N_SOURCE:, N_SOURCE:] = below
        for path in INTERFACE:
            ends = [path, N_SOURCE + path]
            block = self.mounts[:, path, np.newaxis, np.newaxis] * np.array([[1, -1], [-1, 1]])
            matrix[np.ix_(range(FREQUENCY.size), ends, ends)] += block
        return matrix

    def run(self, below):
        """Motion of the source's interface and of what stands below, and the forces on it."""
        load = np.zeros((FREQUENCY.size, N_SOURCE + below.shape[1], 1), dtype=complex)
        load[:, :N_SOURCE, 0] = self.drive
        motion = np.linalg.solve(self.joined(below), load)[:, :, 0]
        source, receiver = motion[:, :N_SOURCE], motion[:, N_SOURCE:]
        # what accelerates and deflects the body below, not what its mounts do
        force = np.einsum("fij,fj->fi", below, receiver)[:, INTERFACE]
        return source[:, INTERFACE], receiver, force

    def receptance_below(self, below):
        """Receptance of what stands below with the source mounted on it."""
        return np.linalg.inv(self.joined(below))[:, N_SOURCE:, N_SOURCE:]

    @property
    def mounted_receptance(self):
        """Receptance of the source at the far ends of its mounts."""
        alone = np.linalg.inv(self.stiffness)[:, INTERFACE][:, :, INTERFACE]
        return alone + np.eye(N_PATH) / self.mounts[:, np.newaxis, :]

    @property
    def blocked_force(self):
        """Reaction of the mounts with their far ends held."""
        held = self.stiffness.copy()
        held[:, INTERFACE, INTERFACE] += self.mounts
        motion = np.linalg.solve(held, self.drive[:, :, np.newaxis])[:, INTERFACE, 0]
        return self.mounts * motion


def source(seed):
    """Draw a source, its mounts and its drive."""
    rng = np.random.default_rng([seed, 1])
    mounts = rng.uniform(1e5, 6e5, N_PATH) * (1 + 0.002 * FREQUENCY[:, np.newaxis] + 0.12j)
    drive = np.zeros((FREQUENCY.size, N_SOURCE), dtype=complex)
    turning = np.exp(1j * np.outer(FREQUENCY / 15, rng.uniform(1, 5, N_SOURCE - N_PATH)))
    drive[:, N_PATH:] = turning * rng.uniform(20, 80, N_SOURCE - N_PATH)
    return Source(body(N_SOURCE, rng, 0.0), mounts, drive)


def receiver(seed):
    """Draw the dynamic stiffness of a receiver, and the pressure per motion at its ear [Pa/m]."""
    rng = np.random.default_rng([seed, 2])
    return body(N_RECEIVER, rng, 4e4), rng.normal(size=N_RECEIVER) * 40.0


def rig(seed):
    """Draw the dynamic stiffness of a test rig that gives way."""
    return body(N_PATH, np.random.default_rng([seed, 3]), 8e6)


def with_noise(values, rng, share=0.01):
    """Add complex noise of a share of every value."""
    noise = rng.normal(size=(2, *values.shape)) / np.sqrt(2)
    return values * (1 + share * (noise[0] + 1j * noise[1]))
