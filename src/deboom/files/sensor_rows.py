"""From a row of a position sheet to the sensor that it describes."""

from __future__ import annotations

import numpy as np

from deboom.files.campaign_tables import SensorRow
from deboom.measurement.sensors import Sensor, SensorKind
from deboom.physics.rigid_body import rotation_matrix


def sensor_of(row: SensorRow) -> Sensor:
    """Return the sensor, its angles made an orientation.

    Raises
    ------
    InputError
        As `Sensor`.
    """
    return Sensor(
        name=row.sensor,
        kind=SensorKind(row.kind),
        model=row.model,
        mount=row.mount,
        piece=row.piece,
        position=np.array(row.position),
        orientation=rotation_matrix(row.angles),
    )
