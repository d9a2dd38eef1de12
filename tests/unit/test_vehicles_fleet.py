from __future__ import annotations

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.channels import Frf, LoadCase, Spectrum
from deboom.mounts.mount import Mount
from deboom.vehicles.fleet import Fleet, Vehicle, path_contributions, path_forces

LINES = np.array([18.0, 20.0, 40.0, 60.0, 62.0])
STRUT = Mount("TSM", "torque strut", ("",), ((0.2, 0.0, -0.3),), ("x", "z"))
WISHBONE = Mount("Du", "wishbone", ("left", "right"), ((0.0, -0.7, 0.0), (0.0, 0.7, 0.0)), ("x",))
MOUNTS = (STRUT, WISHBONE)
CHANNELS = ("TSM x", "TSM y", "TSM z", "Du left x", "Du right x")
PATHS = ("TSM x", "TSM z", "Du x")


def _random(shape, seed):
    rng = np.random.default_rng(seed)
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


def _load_case(frequency=LINES, channels=CHANNELS, name="g5"):
    shape = (frequency.size, len(channels))
    displacement = Spectrum(frequency, _random(shape, 1), channels, "m")
    force = Spectrum(frequency, _random(shape, 2), channels, "N")
    return LoadCase(name, "5th gear", 5, 3.4, 220.0, 1.5, displacement, force)


def _vehicle(name="A-1", group="A", frequency=LINES, paths=PATHS, seed=3):
    values = _random((frequency.size, 1, len(paths)), seed)
    return Vehicle(name, group, Frf(frequency, values, ("ear",), paths, "Pa/N"))


def test_pieces_with_functions_of_their_own_keep_them():
    """Left and right pull against each other: the mean function times their sum hears little."""
    case, pieces = _load_case(), ("Du left x", "Du right x")
    vehicle = _vehicle(paths=("TSM x", "TSM z", *pieces))
    contributions = path_contributions(Fleet((vehicle,)), MOUNTS, case)
    ntf, force = vehicle.noise_transfer.values[1:4, 0], case.force.values[1:4]
    expected = ntf[:, 2] * force[:, 3] + ntf[:, 3] * force[:, 4]
    np.testing.assert_allclose(contributions.values[0, :, 3], expected, rtol=1e-15)
    inputs = vehicle.noise_transfer.inputs
    assert path_forces(MOUNTS, case, inputs).channels == inputs


def test_order_of_the_paths_in_a_vehicle_does_not_matter():
    vehicle = _vehicle()
    turned = vehicle.noise_transfer.select(inputs=PATHS[::-1])
    other = Vehicle("A-1", "A", turned)
    case = _load_case()
    first, second = (path_contributions(Fleet((v,)), MOUNTS, case) for v in (vehicle, other))
    np.testing.assert_array_equal(first.values, second.values)


def test_vehicles_may_be_measured_beyond_the_band_as_they_like():
    wide, narrow = LINES, LINES[1:4]
    fleet = Fleet((_vehicle(frequency=narrow),))
    assert path_contributions(fleet, MOUNTS, _load_case(frequency=wide)).frequency.size == 3


def test_group_keeps_the_members_in_order():
    fleet = Fleet((_vehicle("A-1"), _vehicle("B-1", group="B"), _vehicle("A-2")))
    assert fleet.group("A").names == ("A-1", "A-2")
    with pytest.raises(InputError, match=r"no vehicle of group 'C' .*\['A', 'B'\]"):
        fleet.group("C")


@pytest.mark.parametrize(
    ("vehicles", "message"),
    [
        ((), "vehicles: give at least one"),
        ((_vehicle("A-1"), _vehicle("A-1")), r"vehicles: duplicated \['A-1'\]"),
    ],
)
def test_fleet_refuses(vehicles, message):
    with pytest.raises(InputError, match=message):
        Fleet(vehicles)


def test_vehicle_refuses_another_unit_and_several_ears():
    frf = _vehicle().noise_transfer
    with pytest.raises(InputError, match=r"vehicle A-1: .*in m/s²/N, convert them to Pa/N"):
        Vehicle("A-1", "A", Frf(frf.frequency, frf.values, frf.outputs, frf.inputs, "m/s²/N"))
    two = np.concatenate([frf.values, frf.values], axis=1)
    with pytest.raises(InputError, match=r"vehicle A-1: .*\['left', 'right'\].*select"):
        Vehicle("A-1", "A", Frf(frf.frequency, two, ("left", "right"), frf.inputs, "Pa/N"))


def contributed(vehicle=None, mounts=MOUNTS, case=None, band=(20.0, 60.0)):
    fleet = Fleet((vehicle or _vehicle(),))
    return path_contributions(fleet, mounts, case or _load_case(), band)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            {"vehicle": _vehicle(paths=("TSM x", "Du x"))},
            r"vehicle A-1: no noise transfer function of \['TSM z'\]",
        ),
        (
            {"vehicle": _vehicle(paths=(*PATHS, "Du y"))},
            r"vehicle A-1: noise transfer functions of \['Du y'\] belong to no transfer axis",
        ),
        (
            {"case": _load_case(channels=CHANNELS[:4])},
            r"load case g5: no force of \['Du right x'\] for mount Du",
        ),
        (
            {"vehicle": _vehicle(frequency=LINES * (1 + 1e-15)), "band": (19.0, 61.0)},
            r"vehicle A-1: .*load case g5 between 19 and 61 Hz: .*nothing is interpolated",
        ),
        ({"vehicle": _vehicle(frequency=LINES[:3])}, r"vehicle A-1: .*other lines than load case"),
        ({"band": (41.0, 59.0)}, r"load case g5: no line between 41 and 59 Hz.*18 to 62 Hz"),
        (
            {"vehicle": _vehicle(frequency=LINES + 0.5), "band": (40.0, 40.0)},
            r"vehicle A-1: no line between 40 and 40 Hz",
        ),
        ({"mounts": (STRUT, STRUT)}, r"duplicated design variable \['TSM x', 'TSM y', 'TSM z'\]"),
        (
            {"mounts": (Mount("TSM", "strut", ("",), ((0.0, 0.0, 0.0),), ()),)},
            "no mount transmits anything",
        ),
    ],
)
def test_path_contributions_refuse(given, message):
    with pytest.raises(InputError, match=message):
        contributed(**given)
