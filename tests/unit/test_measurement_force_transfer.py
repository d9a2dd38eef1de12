"""Force transfer: what is missing is refused by name."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.campaign import ShakerRun
from deboom.measurement.channels import Frf
from deboom.measurement.force_transfer import (
    force_transfer_matrix,
)
from deboom.measurement.sensors import Sensor, SensorKind

LINES = np.array([20.0, 40.0, 60.0])
CELL = Sensor("C1", SensorKind.FORCE_CELL, "9077C", "Du", "left", np.zeros(3), np.eye(3))


def run(axis, repeat=1, *, column=None, lines=LINES, channels=CELL.channels, piece="left"):
    column = np.eye(3)["xyz".index(axis)] if column is None else np.asarray(column)
    values = np.tile(column[:, np.newaxis], (len(lines), 1, 1)).astype(complex)
    name = " ".join(filter(None, ("Du", piece, axis)))
    return ShakerRun("Du", piece, axis, repeat, Frf(lines, values, channels, (name,), "N/N"))


def matrix(runs, cells=(CELL,)):
    return force_transfer_matrix(runs, cells, "Du", "left")


def test_pieces_have_names_of_their_own():
    transfer = matrix([run("x"), run("y"), run("z"), run("x", piece="right")])
    assert transfer.channels() == ("Du left x", "Du left y", "Du left z")
    assert transfer.repeats == (1, 1, 1)
    with pytest.raises(ValueError, match="read-only"):
        transfer.matrix[0, 0] = 2.0


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: matrix([run("x")]), "mount Du left: there is no shaker run along y, z"),
        (lambda: matrix([run("x"), run("y"), run("z", piece="right")]), "along z;"),
        (
            lambda: matrix([run("x"), run("x"), run("y"), run("z")]),
            r"\('x', 1\)\] \(axis, repeat\)",
        ),
        (lambda: matrix([run("x"), run("y"), run("z")], cells=()), "no force cell below it"),
        (
            lambda: matrix([run("x"), run("y"), run("z", lines=LINES + 1)]),
            "different frequency lines",
        ),
        (
            lambda: matrix([run("x"), run("y", column=[1, 0, 0]), run("z")]),
            "do not tell the directions of its shaker runs apart",
        ),
        (
            lambda: matrix([run("x"), run("y"), run("z", channels=("C1 x", "C1 y", "C9 z"))]),
            r"lacks the cell channels \['C1 z'\]",
        ),
    ],
)
def test_bad_shaker_runs_are_refused_in_words(call, words):
    with pytest.raises(InputError, match=words):
        call()
