"""The compressor of a car: its mounts one by one, their state while it runs, its hoses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.hose_identification import HoseOptions, identify_hoses
from deboom.compressor.mount_shares import MountPrior, MountShares, mount_shares
from deboom.compressor.rigid_foundation import Neighbours, on_rigid_foundation
from deboom.compressor.routes import UpdatedRoute
from deboom.compressor.unbalance import UnbalanceOptions, unbalance
from deboom.errors import InputError
from deboom.measurement.operating_sweep import HoseState
from deboom.measurement.wrench_noise_transfer import wrench_accelerance

if TYPE_CHECKING:
    from deboom.compressor.hose_identification import HoseIdentification
    from deboom.compressor.identify import Identification
    from deboom.compressor.unbalance import Unbalance
    from deboom.measurement.channels import Frf
    from deboom.measurement.electric_car import ElectricCar
    from deboom.measurement.inertance_test import CompressorMount
    from deboom.measurement.operating_sweep import HoseDrawing

Step = Callable[[str], None]

HOSE_PASSES = 2
"""With drawn, then with identified hoses: how the body moves them depends on what they are."""


@dataclass(frozen=True, eq=False)
class RunningInCar:
    """All that is known of a compressor in its car.

    Parameters
    ----------
    car : ElectricCar
    found : Identification
        Of its hammer test.
    shares : MountShares
        What each mount carries.
    accelerance : Frf
        Of the free body between all points.
    source : Unbalance
        By sweeps with soft hoses where there are any, the motion of the body taken off.
    hoses : HoseIdentification or None
        None where they are left out.
    """

    car: ElectricCar
    found: Identification
    shares: MountShares
    accelerance: Frf
    source: Unbalance
    hoses: HoseIdentification | None

    def change(self, frequency: npt.ArrayLike) -> ComplexArray:
        """Change of the mounts' stiffness since the hammer test, 0 where none is significant [1].

        Parameters
        ----------
        frequency : array, shape (n_frequency,)
            Of the rotation [Hz].

        Returns
        -------
        array, shape (n_frequency,)
        """
        return _change(self.source, np.asarray(frequency, dtype=float))

    def change_deviation(self, frequency: npt.ArrayLike) -> RealArray:
        """1 σ of `change`, shape (n_frequency,) [1]."""
        state = self.source.state
        lines = np.asarray(frequency, dtype=float)
        return np.asarray(np.interp(lines, state.frequency, state.curve_deviation))

    @property
    def alarms(self) -> tuple[str, ...]:
        """Reasons not to trust it, in words; empty where there are none."""
        of_hoses = () if self.hoses is None else self.hoses.alarms
        return (*self.source.alarms, *self.shares.alarms, *of_hoses)


def running_in_car(
    car: ElectricCar,
    found: Identification,
    prior: MountPrior | None = None,
    *,
    with_hoses: bool = True,
    step: Step | None = None,
) -> RunningInCar:
    """Find out what a compressor does on its mounts and hoses in a car.

    Parameters
    ----------
    car : ElectricCar
    found : Identification
        Of the hammer test on its compressor.
    prior : MountPrior, optional
        Of single mounts; the places where the car's sheet has them replace those of the drawing.
    with_hoses : bool
        Whether standard hoses are identified; without, their paths are left out.
    step : callable of str, optional
        Told what is being done, for progress.

    Returns
    -------
    RunningInCar

    Raises
    ------
    InputError
        No drawing of the mounts, or one with others than the car; standard hoses without drawing,
        or whose ends on the body were not struck; what `unbalance` and `identify_hoses` refuse.
    """
    say = step or (lambda _: None)
    standard = bool(car.operation.with_hoses(HoseState.STANDARD))
    known = _struck_hoses(car) if with_hoses and standard else ()
    say("single mounts")
    shares = mount_shares(found, _placed(car), _by_sheet(car, prior or MountPrior()))
    accelerance = wrench_accelerance(car)
    say("state of the mounts in operation")
    options = UnbalanceOptions(routes=(UpdatedRoute(),), chosen=UpdatedRoute())
    test = on_rigid_foundation(car.operation, found, shares.mounts)
    source = unbalance(test, found, options)
    if source.state.changed:
        # what the body does through them is known better now
        change = partial(_change, source)
        test = on_rigid_foundation(car.operation, found, shares.mounts, change=change)
        source = unbalance(test, found, options)
    hoses: HoseIdentification | None = None
    if known:
        seen = HoseOptions(sense=source.sense.sense)
        for number in range(HOSE_PASSES):
            say(f"hoses, pass {number + 1} of {HOSE_PASSES}")
            beside = Neighbours(known, accelerance)
            still = on_rigid_foundation(
                car.operation, found, shares.mounts, beside, partial(_change, source)
            )
            hoses = identify_hoses(still, found, seen)
            known = hoses.hoses
    return RunningInCar(car, found, shares, accelerance, source, hoses)


def _change(source: Unbalance, lines: RealArray) -> ComplexArray:
    """Change of the mounts as the sweeps show it, 0 where none is significant."""
    state = source.state
    if not state.changed:
        return np.zeros(lines.size, dtype=complex)
    return np.asarray(np.interp(lines, state.frequency, state.curve))


def _placed(car: ElectricCar) -> tuple[CompressorMount, ...]:
    """Mounts of the drawing, where the car's sheet has them."""
    drawing = car.operation.hammer.drawing
    if drawing is None:
        raise InputError(
            f"car {car.name}: the hammer test has no drawing, and no test at one virtual point "
            "shows what a single mount carries: state directions and stiffness of the mounts"
        )
    drawn = {mount.name: mount for mount in drawing.mounts}
    there = [point.name for point in car.mounts]
    if sorted(drawn) != sorted(there):
        raise InputError(
            f"car {car.name}: the drawing has {', '.join(drawn)}, the car {', '.join(there)}: call "
            "each mount by one name, and draw all of them"
        )
    return tuple(replace(drawn[point.name], position=point.position) for point in car.mounts)


def _by_sheet(car: ElectricCar, prior: MountPrior) -> MountPrior:
    """Places are as good as the smaller of drawing and tape measure."""
    measured = car.tolerances.sensor_position
    return replace(prior, position=min(prior.position, measured)) if measured > 0 else prior


def _struck_hoses(car: ElectricCar) -> tuple[HoseDrawing, ...]:
    """Drawn hoses, whose ends must be points of the car."""
    drawn = car.operation.hoses
    if not drawn:
        raise InputError(
            f"car {car.name} ran with standard hoses, of which there is no drawing: add [[hoses]] "
            "to operation.toml, or leave their paths out"
        )
    struck = [point.name for point in car.hoses]
    missing = [hose.name for hose in drawn if hose.name not in struck]
    if missing:
        raise InputError(
            f"car {car.name}: no noise transfer functions at the body's end of "
            f"{', '.join(missing)}: measure them, or leave the paths of the hoses out"
        )
    return drawn
