"""Force transfer: what is missing is refused by name."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.campaign import ShakerRun
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.force_transfer import (
    force_transfer_matrix,
    force_transfer_matrix_with_moments,
    operating_force,
    without_moments,
)
from deboom.measurement.sensors import Impact, Sensor, SensorKind

LINES = np.array([20.0, 40.0, 60.0])
CELL = Sensor("C1", SensorKind.FORCE_CELL, "9077C", "Du", "left", np.zeros(3), np.eye(3))


def run(axis, repeat=1, *, column=None, lines=LINES, channels=CELL.channels, piece="left"):
    column = np.eye(3)["xyz".index(axis)] if column is None else np.asarray(column)
    values = np.tile(column[:, np.newaxis], (len(lines), 1, 1)).astype(complex)
    name = " ".join(filter(None, ("Du", piece, axis)))
    return ShakerRun("Du", piece, axis, repeat, Frf(lines, values, channels, (name,), "N/N"))


def matrix(runs, cells=(CELL,), **options):
    return force_transfer_matrix(runs, cells, "Du", "left", **options)


def test_pieces_have_names_of_their_own():
    transfer = matrix([run("x"), run("y"), run("z"), run("x", piece="right")])
    assert transfer.channels() == ("Du left x", "Du left y", "Du left z")
    assert transfer.repeats == (1, 1, 1)
    assert not transfer.has_moments
    force = Spectrum(LINES, np.ones((3, 3)), CELL.channels, "N")
    found = operating_force(transfer, force)
    assert found.channels == transfer.channels()
    assert found.unit == "N"
    with pytest.raises(ValueError, match="read-only"):
        transfer.matrix[0, 0] = 2.0
    with pytest.raises(InputError, match="no moments to leave out"):
        without_moments(transfer)


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
            lambda: matrix([run("x"), run("y"), run("z")], band=(100.0, 200.0)),
            "no line of its shaker runs lies in 100.0–200.0 Hz",
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


def test_moments_need_three_cells_and_pushes_that_make_them():
    cells = [
        Sensor(f"C{k}", SensorKind.FORCE_CELL, "", "EnM", "", place, np.eye(3))
        for k, place in enumerate(0.05 * np.eye(3))
    ]
    pushes = [
        Impact(f"P{k}{axis}", place, direction)
        for k, place in enumerate(0.1 * np.eye(3))
        for axis, direction in zip("xyz", np.eye(3), strict=True)
    ]
    names = tuple(push.name for push in pushes)
    channels = tuple(c for cell in cells for c in cell.channels)
    frf = Frf(LINES, np.ones((3, 9, 9)), channels, names, "N/N")
    zero = np.zeros(3)

    def build(pushed, repeats, used):
        return force_transfer_matrix_with_moments(pushed, repeats, used, "EnM", zero)

    with pytest.raises(InputError, match="no measurement for its force transfer matrix"):
        build(pushes, [], cells)
    with pytest.raises(InputError, match="show 5 of six loads; three triaxial cells"):
        build(pushes, [frf], cells[:2])
    with pytest.raises(InputError, match="show only 3 of 6 motions"):
        build([Impact(f"P{k}", zero + 1e-9, d) for k, d in enumerate(np.eye(3))], [frf], cells)
    with pytest.raises(InputError, match="has no inverse"):
        build(pushes, [frf], cells)
