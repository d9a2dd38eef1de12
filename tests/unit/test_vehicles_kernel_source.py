"""The written-out elimination, run by Python itself: no compiler needed."""

from __future__ import annotations

import numpy as np
import pytest

from deboom.vehicles.kernel_ldlt_source import factorise_and_solve
from deboom.vehicles.kernel_source import CoupledPattern, source

DENSE = [(i, j) for i in range(6) for j in range(i + 1)]
MOUNTS = [(k, k) for k in range(6)] + [(4, 0), (5, 0), (3, 1), (5, 1), (3, 2), (4, 2)]
MOUNTS += [(4, 3), (5, 3), (5, 4)]
ARROW = [(k, k) for k in range(6)] + [(k, 0) for k in range(1, 6)]


@pytest.mark.parametrize("nonzero", [DENSE, MOUNTS, ARROW], ids=["dense", "mounts", "fill-in"])
def test_written_out_elimination_solves_what_lapack_solves(nonzero):
    rng = np.random.default_rng(1)
    for _ in range(20):
        matrix = np.zeros((6, 6), dtype=complex)
        for i, j in nonzero:
            matrix[i, j] = matrix[j, i] = complex(*rng.normal(size=2)) + 8 * (i == j)
        load = rng.normal(size=6) + 1j * rng.normal(size=6)
        names = {"one": 1.0}
        for i, j in nonzero:
            names[f"r{i}{j}"], names[f"i{i}{j}"] = matrix[i, j].real, matrix[i, j].imag
        for k in range(6):
            names[f"b{k}"], names[f"d{k}"] = load[k].real, load[k].imag
        exec("\n".join(factorise_and_solve(nonzero)), {}, names)
        found = [complex(names[f"b{k}"], names[f"d{k}"]) for k in range(6)]
        np.testing.assert_allclose(found, np.linalg.solve(matrix, load), rtol=1e-12)


def test_zeros_cost_nothing():
    assert len(factorise_and_solve(MOUNTS)) < 0.7 * len(factorise_and_solve(DENSE))


@pytest.mark.parametrize(
    "pattern",
    [
        1,
        31,
        CoupledPattern(((0, 4, 5), (1, 3, 5), (2, 3, 4)), tuple(MOUNTS), (0, 2), ((0, 1), (2,))),
        CoupledPattern(((0, 4), (1, 3), (2,)), tuple(DENSE), (), ((0,),)),
        CoupledPattern(((0, 4), (1, 3), (2,)), tuple(MOUNTS), (1,), ()),
    ],
)
def test_every_shape_gives_valid_and_distinct_text(pattern):
    compile(source(pattern), "test", "exec")
    assert source(pattern) == source(pattern)
    assert source(pattern) != source(2)
