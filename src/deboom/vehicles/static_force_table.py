"""Static force of every mount direction over gears and engine torque, as a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.vehicles.kinematic_model import KinematicModel

if TYPE_CHECKING:
    import pandas as pd


def static_force_table(
    models: Mapping[str, KinematicModel],
    total_ratios: Sequence[float],
    engine_torque: npt.ArrayLike,
) -> pd.DataFrame:
    """List the static force of every direction by configuration, gear and engine torque.

    Parameters
    ----------
    models : mapping of str to KinematicModel
        Configurations: powertrains, mount sets, places of the strut.
    total_ratios : sequence of float
        Engine speed over wheel speed, gear 1 first [1].
    engine_torque : array, shape (n,)
        [N m].

    Returns
    -------
    pandas.DataFrame
        Columns ``configuration``, ``gear``, ``engine torque [N m]``, ``wheel torque [N m]``,
        ``direction``, ``static force [N]`` and ``deflection [m]``.

    Raises
    ------
    InputError
        A torque that needs more deflection than a curve was measured to.
    """
    import pandas as pd

    torques = np.atleast_1d(np.asarray(engine_torque, dtype=float))
    rows = []
    for configuration, model in models.items():
        for gear, ratio in enumerate(total_ratios, 1):
            state = model.equilibrium(torques * ratio)
            for line, torque in enumerate(torques.tolist()):
                for place, name in enumerate(state.names):
                    rows.append(
                        {
                            "configuration": configuration,
                            "gear": gear,
                            "engine torque [N m]": torque,
                            "wheel torque [N m]": state.wheel_torque[line],
                            "direction": name,
                            "static force [N]": state.force[line, place],
                            "deflection [m]": state.deflection[line, place],
                        }
                    )
    return pd.DataFrame(rows)
