"""One direction of a characterised mount: measured points, surface, static curve, quality."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.campaign import StaticCurve
from deboom.mounts.mount import AXES
from deboom.mounts.response_surface import DynamicStiffnessSurface
from deboom.mounts.stored_values import (
    Setting,
    check_text,
    finite_number,
    freeze_finite,
    frozen_arrays,
    plain_setting,
)

TextArray = npt.NDArray[np.str_]


@dataclass(frozen=True, eq=False)
class MapPoints:
    """Measured dynamic stiffness of one direction, point by point.

    Parameters
    ----------
    preload : array, shape (n,)
        Static force in the direction [N].
    wheel_torque : array, shape (n,)
        Engine torque times total ratio [N m].
    amplitude : array, shape (n,)
        Of the displacement at the virtual point, peak [m].
    frequency : array, shape (n,)
        [Hz].
    dynamic_stiffness : array, shape (n,)
        Complex ``f / s`` [N/m].
    confidence : array, shape (n,)
        From 0 (masked: not to be used) to 1 [1].
    run : sequence of str, length n
        Operating run of each point, with the piece where a mount has several.

    Raises
    ------
    InputError
        Unequal lengths, a value that is not finite, a confidence outside of 0 … 1.
    """

    preload: RealArray
    wheel_torque: RealArray
    amplitude: RealArray
    frequency: RealArray
    dynamic_stiffness: ComplexArray
    confidence: RealArray
    run: TextArray

    def __post_init__(self) -> None:
        for name in ("preload", "wheel_torque", "amplitude", "frequency", "confidence"):
            freeze_finite(self, name, np.float64)
        freeze_finite(self, "dynamic_stiffness", np.complex128)
        runs = np.array([str(run) for run in self.run], dtype=np.str_)
        runs.setflags(write=False)
        object.__setattr__(self, "run", runs)
        shapes = {field.name: getattr(self, field.name).shape for field in fields(self)}
        if len(set(shapes.values())) != 1 or self.frequency.ndim != 1:
            raise InputError(f"map points need arrays of one equal length, they have {shapes}")
        if np.any((self.confidence < 0) | (self.confidence > 1)):
            raise InputError("map points: a confidence lies between 0 and 1")

    def __len__(self) -> int:
        return self.frequency.size


@dataclass(frozen=True, eq=False)
class FittedSurface:
    """A response surface K(preload, amplitude, frequency) as named arrays.

    Parameters
    ----------
    model : str
        Type that builds itself from the arrays, such as ``DynamicStiffnessSurface``.
    variables : tuple of str
        Its variables in their order, such as ``("preload", "amplitude", "frequency")``.
    units : tuple of str
        SI unit of each variable. Values are in N/m.
    lower, upper : array, shape (n_variables,)
        Range of each variable over the training points, in its unit.
    arrays : mapping of str to array
        All that the model needs, its training hull included.
    settings : mapping of str to str, int, float, bool or None
        How it was fitted.

    Raises
    ------
    InputError
        Counts that disagree, ranges that are not finite, an array of Python objects.
    """

    model: str
    variables: tuple[str, ...]
    units: tuple[str, ...]
    lower: RealArray
    upper: RealArray
    arrays: Mapping[str, npt.NDArray[Any]]
    settings: Mapping[str, Setting]

    def __post_init__(self) -> None:
        check_text("model of a surface", self.model, needed=True)
        object.__setattr__(self, "variables", tuple(self.variables))
        object.__setattr__(self, "units", tuple(self.units))
        for name in ("lower", "upper"):
            freeze_finite(self, name, np.float64)
        shape = (len(self.variables),)
        if not (len(self.units),) == self.lower.shape == self.upper.shape == shape:
            raise InputError(
                f"surface {self.model}: {len(self.variables)} variables need as many units and "
                f"bounds, it has {len(self.units)}, {self.lower.shape} and {self.upper.shape}"
            )
        object.__setattr__(self, "arrays", frozen_arrays(self.model, self.arrays))
        settings = {name: plain_setting(self.model, name, v) for name, v in self.settings.items()}
        object.__setattr__(self, "settings", settings)

    @classmethod
    def of(cls, surface: DynamicStiffnessSurface, settings: Mapping[str, Setting]) -> FittedSurface:
        """Take apart a fitted surface; `response_surface` gives it back.

        Parameters
        ----------
        surface : DynamicStiffnessSurface
            As fitted.
        settings : mapping of str to str, int, float, bool or None
            How it was fitted.
        """
        ranges = surface.ranges
        return cls(
            model=type(surface).__name__,
            variables=tuple(ranges),
            units=tuple(surface.units[name] for name in ranges),
            lower=np.array([low for low, _ in ranges.values()]),
            upper=np.array([high for _, high in ranges.values()]),
            arrays=surface.to_arrays(),
            settings=settings,
        )

    def response_surface(self) -> DynamicStiffnessSurface:
        """Build the surface, bit for bit as it was.

        Raises
        ------
        InputError
            It is of another model; or of another version, or incomplete.
        """
        if self.model != DynamicStiffnessSurface.__name__:
            raise InputError(
                f"a surface of model {self.model} cannot be built, only "
                f"{DynamicStiffnessSurface.__name__}: characterise the mount again"
            )
        return DynamicStiffnessSurface.from_arrays(self.arrays)


@dataclass(frozen=True)
class DirectionQuality:
    """How far the stiffness of one direction may be believed.

    Parameters
    ----------
    identified : bool
        False where the error budget leaves the direction unknown.
    half_width_95 : float, optional
        Of the 95 % band of K by the error budget, relative to |K| [1]; None without a budget.
    r2_real, r2_imag, r2_force : float, optional
        Coefficient of determination of the surface for Re K, Im K and the force, at most 1 [1].

    Raises
    ------
    InputError
        A number that is not finite: None stands for not known.
    """

    identified: bool
    half_width_95: float | None = None
    r2_real: float | None = None
    r2_imag: float | None = None
    r2_force: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "identified", bool(self.identified))
        for field in fields(self)[1:]:
            value = getattr(self, field.name)
            if value is not None:
                object.__setattr__(self, field.name, finite_number("quality", field.name, value))


@dataclass(frozen=True, eq=False)
class CharacterisedDirection:
    """One direction of a characterised mount.

    Parameters
    ----------
    axis : str
        ``x``, ``y`` or ``z``.
    map_points : MapPoints
        None at all where the mount was never loaded in this direction.
    quality : DirectionQuality
        Believe it or not.
    surface : FittedSurface, optional
        None where none could be fitted.
    static_curve : StaticCurve, optional
        Quasi-static force over deflection, as the supplier sent it.

    Raises
    ------
    InputError
        An unknown axis; identified, and yet without a surface.
    """

    axis: str
    map_points: MapPoints
    quality: DirectionQuality
    surface: FittedSurface | None = None
    static_curve: StaticCurve | None = None

    def __post_init__(self) -> None:
        if self.axis not in AXES:
            raise InputError(f"unknown axis {self.axis!r}, use {', '.join(AXES)}")
        if self.quality.identified and self.surface is None:
            raise InputError(f"direction {self.axis} is identified, but it has no surface")
