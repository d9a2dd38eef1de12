"""What a running compressor gives: accelerations of first order over its speed."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Spectrum
from deboom.measurement.inertance_test import InertanceTest, freeze_field


class HoseState(Enum):
    """What was joined to the compressor."""

    ABSENT = "absent"
    """Nothing: possible in a hammer test only."""
    STANDARD = "standard"
    """The hoses of the vehicle."""
    SOFT = "soft"
    """Long soft hoses with masses on them, which cut the path through the hoses."""


@dataclass(frozen=True, eq=False)
class OperatingSweep:
    """First order of one run-up at one pressure.

    Parameters
    ----------
    name : str
        Such as ``standard 7.5 bar``.
    hoses : HoseState
    pressure : float
        Of the gas at the outlet [Pa].
    acceleration : Spectrum
        One line per rotational frequency, channels of the accelerometers on the compressor;
        complex peak, the phase from the pulse of the tacho, which stands at the rotor's y axis
        [m/s^2].
    deviation : array, shape (n_frequency, n_channel)
        Standard deviation of the real and of the imaginary part of `acceleration` [m/s^2].
    holder : Spectrum or None
        The same of triaxial accelerometers on the body side of the mounts, ``<mount> x`` …
        [m/s^2]; None where there were none.
    sound : Spectrum or None
        The same of microphones [Pa]; None where there were none.

    Raises
    ------
    InputError
        A pressure or a deviation that is not positive, shapes or lines that do not fit together.
    """

    name: str
    hoses: HoseState
    pressure: float
    acceleration: Spectrum
    deviation: RealArray
    holder: Spectrum | None = None
    sound: Spectrum | None = None

    def __post_init__(self) -> None:
        if not self.pressure > 0:
            raise InputError(f"sweep {self.name}: the pressure must be positive")
        freeze_field(self, "deviation", self.acceleration.values.shape, f"sweep {self.name}")
        if not np.all(self.deviation > 0):
            raise InputError(f"sweep {self.name}: no spectrum is exact, state its deviation")
        for what, spectrum in (("holder", self.holder), ("sound", self.sound)):
            if spectrum is not None and not np.array_equal(
                spectrum.frequency, self.acceleration.frequency
            ):
                raise InputError(f"sweep {self.name}: {what} has other lines than the compressor")

    @property
    def frequency(self) -> RealArray:
        """Of the rotation, shape (n_frequency,) [Hz]."""
        return self.acceleration.frequency

    @property
    def speed(self) -> RealArray:
        """Of the rotation, shape (n_frequency,) [1/min]."""
        return np.asarray(60.0 * self.frequency)


@dataclass(frozen=True, eq=False)
class HoseDrawing:
    """A hose as drawn and catalogued: a straight uniform beam from the compressor to the body.

    Parameters
    ----------
    name : str
        Such as ``suction hose``.
    position : array, shape (3,)
        Of the port on the compressor, from the virtual point [m].
    direction : array, shape (3,)
        From the port to the body, of any length [1].
    length : float
        [m]
    tension, torsion, bending : float
        EA [N], GJ and EI [N m²], as a supplier may state them: start values.
    line_mass : float
        [kg/m]
    loss_factor : float
        Of all three stiffnesses [1].
    torsion_radius : float
        Radius of gyration of the section about its axis [m].

    Raises
    ------
    InputError
        Numbers that are not positive, or a direction of no length.
    """

    name: str
    position: RealArray
    direction: RealArray
    length: float
    tension: float
    torsion: float
    bending: float
    line_mass: float
    loss_factor: float
    torsion_radius: float

    def __post_init__(self) -> None:
        freeze_field(self, "position", (3,), self.name)
        freeze_field(self, "direction", (3,), self.name)
        if not np.linalg.norm(self.direction) > 0:
            raise InputError(f"{self.name}: the direction has no length")
        for field in (
            "length",
            "tension",
            "torsion",
            "bending",
            "line_mass",
            "loss_factor",
            "torsion_radius",
        ):
            if not getattr(self, field) > 0:
                raise InputError(f"{self.name}: {field} must be positive")


@dataclass(frozen=True, eq=False)
class OperatingTest:
    """One compressor: struck without hoses, perhaps with them, and run.

    Parameters
    ----------
    name : str
        Title of the test.
    hammer : InertanceTest
        Without hoses, compressor off.
    hammer_with_hoses : InertanceTest or None
        With the standard hoses, compressor off; same sensors and impacts.
    sweeps : tuple of OperatingSweep
        At least one.
    rotor_inertia : float or None
        Polar moment of the rotor, from its data sheet [kg m²]; None where not known.
    hoses : tuple of HoseDrawing
        Empty where no drawing exists.
    input_files : tuple of Path

    Raises
    ------
    InputError
        No sweep, doubled names, or a sweep whose channels are not the hammer test's.
    """

    name: str
    hammer: InertanceTest
    hammer_with_hoses: InertanceTest | None
    sweeps: tuple[OperatingSweep, ...]
    rotor_inertia: float | None = None
    hoses: tuple[HoseDrawing, ...] = ()
    input_files: tuple[Path, ...] = ()

    def __post_init__(self) -> None:
        names = [sweep.name for sweep in self.sweeps]
        if not names:
            raise InputError(f"{self.name}: there is no sweep: a running compressor needs one")
        if len(set(names)) < len(names):
            raise InputError(f"{self.name}: two sweeps have one name: {names}")
        for sweep in self.sweeps:
            if sweep.acceleration.channels != self.hammer.frf.outputs:
                raise InputError(
                    f"{self.name}: sweep {sweep.name} has other accelerometers than the hammer "
                    "test: the sensors must stay where they were struck"
                )
        other = self.hammer_with_hoses
        if other is not None and (
            other.frf.outputs != self.hammer.frf.outputs
            or other.frf.inputs != self.hammer.frf.inputs
        ):
            raise InputError(
                f"{self.name}: the hammer tests with and without hoses have other channels or "
                "impacts: keep the sensors, strike the same points"
            )

    def with_hoses(self, state: HoseState) -> tuple[OperatingSweep, ...]:
        """Sweeps with these hoses, in their order."""
        return tuple(sweep for sweep in self.sweeps if sweep.hoses is state)
