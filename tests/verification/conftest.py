"""Virtual folders that tests of several packages read, written once in a session."""

import pytest

from deboom.bench.layout import LOAD_CASES
from deboom.bench.vehicle_writer import NO_VEHICLE_ERRORS, write_vehicle
from deboom.files.vehicle import read_vehicle


@pytest.fixture(scope="session")
def exact_vehicle(tmp_path_factory):
    """Folder of a vehicle that was measured without errors in one load case, and what is read."""
    folder = tmp_path_factory.mktemp("vehicle") / "exact"
    cases = tuple(case for case in LOAD_CASES if case.name == "g5_wot220")
    write_vehicle(folder, 1, errors=NO_VEHICLE_ERRORS, load_cases=cases)
    return folder, read_vehicle(folder)
