"""Runs of a small campaign."""

from deboom.bench.operating_run import PlannedRun

SEVEN_RUNS = tuple(
    PlannedRun(gear, torque, full_load)
    for gear, torque, full_load in (
        (5, 120.0, True),
        (5, 220.0, True),
        (5, 60.0, False),
        (5, 180.0, False),
        (6, 140.0, False),
        (7, 220.0, True),
        (7, 100.0, False),
    )
)
"""Three ramps at full load and four at part load, in three gears."""
