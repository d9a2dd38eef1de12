"""Random generators: one explicit seed, one independent stream per purpose."""

from __future__ import annotations

import zlib

import numpy as np

from deboom.errors import InputError


def checked_seed(seed: int) -> int:
    """Return the seed, or refuse it.

    Raises
    ------
    InputError
        Anything but an integer from 1 upwards; some libraries read 0 as "no seed".
    """
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 1:
        raise InputError(f"seed {seed!r} is not an integer from 1 upwards: choose one, such as 1")
    return int(seed)


def generator(seed: int, purpose: str, *words: int) -> np.random.Generator:
    """Return the generator of one purpose.

    Parameters
    ----------
    seed : int
        From 1 upwards.
    purpose : str
        Such as ``"search sample"``. Streams of different purposes are independent, so that the
        verification never meets the numbers of the search although both are given one seed.
    *words : int
        Further entropy, such as the bytes of one design.

    Raises
    ------
    InputError
        A seed that is not an integer from 1 upwards.
    """
    entropy = [checked_seed(seed), *words]
    key = zlib.crc32(purpose.encode())
    return np.random.default_rng(np.random.SeedSequence(entropy, spawn_key=(key,)))
