"""Measured data with everything that may be wrong with them, and how another measurement differs.

A draw does not blur results: it measures again. Noise transfer functions, forces and motions are
changed, and whatever is computed from data is computed from the changed ones. So vehicles, designs
and load cases keep their correlation: a change of the level against today's design, which the
calibration of a microphone does not touch, is known much better than the level.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.load_case import LoadCase
from deboom.measurement.method_difference import local_magnitude
from deboom.vehicles.fleet import Band, Fleet, lines_inside, refuse_doubled
from deboom.vehicles.uncertainty_source import MeasuredArrays, UncertaintySource, own_generator


@dataclass(frozen=True, eq=False)
class UncertainData:
    """Vehicles and load cases with the sources of their errors.

    Parameters
    ----------
    fleet : Fleet
        As measured; every vehicle with the same paths.
    load_cases : sequence of LoadCase
        As measured, with the same channels and lines.
    sources : sequence of UncertaintySource
        Independent of each other, each with a name of its own.
    band : (lower, upper)
        Lines that are kept, both edges included [Hz].

    Raises
    ------
    InputError
        No load case; lines, paths or channels that differ; a doubled source.
    """

    fleet: Fleet
    load_cases: tuple[LoadCase, ...]
    sources: tuple[UncertaintySource, ...]
    band: Band

    def __post_init__(self) -> None:
        object.__setattr__(self, "load_cases", tuple(self.load_cases))
        object.__setattr__(self, "sources", tuple(self.sources))
        refuse_doubled(self.names, "source of uncertainty")
        if not self.load_cases:
            raise InputError("uncertain data without a load case: give at least one")
        first, paths = self.load_cases[0], self.fleet.vehicles[0].noise_transfer.inputs
        for case in self.load_cases:
            same = case.force.channels == first.force.channels
            if not (same and np.array_equal(case.force.frequency, first.force.frequency)):
                raise InputError(
                    f"load cases {first.name} and {case.name} differ in channels or lines: draw "
                    "their uncertainty apart from each other"
                )
        for vehicle in self.fleet.vehicles:
            transfer = vehicle.noise_transfer
            if set(transfer.inputs) != set(paths) or not np.array_equal(
                transfer.frequency, first.force.frequency
            ):
                raise InputError(
                    f"vehicle {vehicle.name}: its noise transfer functions have other paths or "
                    f"lines than vehicle {self.fleet.names[0]} or load case {first.name}: bring "
                    "all to the same ones"
                )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the sources."""
        return tuple(source.name for source in self.sources)

    def drawn(
        self, draw: int, seed: int, only: Collection[str] | None = None
    ) -> tuple[Fleet, tuple[LoadCase, ...]]:
        """Measure again, within the band.

        Parameters
        ----------
        draw : int
            Number of the draw, from 0. The same draw and seed give the same errors.
        seed : int
            From 1.
        only : collection of str, optional
            Names of the sources that err; by default all. Their errors are those that they have
            among all.

        Returns
        -------
        fleet : Fleet
        load_cases : tuple of LoadCase

        Raises
        ------
        InputError
            A seed below 1, a draw below 0, a source that does not exist.
        """
        unknown = sorted(set(only or ()) - set(self.names))
        if unknown:
            raise InputError(f"no source of uncertainty {unknown}: use {list(self.names)}")
        data = self._arrays
        for source in self.sources:
            if only is None or source.name in only:
                data = source.measured_again(data, own_generator(source, seed, draw))
        return self._of(data)

    @cached_property
    def measured(self) -> tuple[Fleet, tuple[LoadCase, ...]]:
        """Vehicles and load cases as measured, within the band."""
        return self._of(self._arrays)

    @cached_property
    def _arrays(self) -> MeasuredArrays:
        first = self.load_cases[0]
        inside = lines_inside(first.force.frequency, self.band, f"load case {first.name}")
        paths = self.fleet.vehicles[0].noise_transfer.inputs
        transfers = [
            vehicle.noise_transfer.select(inputs=paths).values[inside, 0]
            for vehicle in self.fleet.vehicles
        ]
        frequency, transfer = first.force.frequency[inside], np.stack(transfers)
        return MeasuredArrays(
            frequency=frequency,
            transfer=transfer,
            transfer_around=local_magnitude(transfer, frequency),
            displacement=np.stack([case.displacement.values[inside] for case in self.load_cases]),
            force=np.stack([case.force.values[inside] for case in self.load_cases]),
            paths=paths,
            channels=first.force.channels,
        )

    def _of(self, data: MeasuredArrays) -> tuple[Fleet, tuple[LoadCase, ...]]:
        vehicles = []
        for vehicle, values in zip(self.fleet.vehicles, data.transfer, strict=True):
            own = vehicle.noise_transfer
            frf = Frf(data.frequency, values[:, np.newaxis], own.outputs, data.paths, own.unit)
            vehicles.append(replace(vehicle, noise_transfer=frf))
        first = self.load_cases[0]
        inside = lines_inside(first.force.frequency, self.band, f"load case {first.name}")
        cases = [
            replace(
                case,
                displacement=Spectrum(data.frequency, displacement, data.channels, "m"),
                force=Spectrum(data.frequency, force, data.channels, "N"),
                engine_torque=None if case.engine_torque is None else case.engine_torque[inside],
            )
            for case, displacement, force in zip(
                self.load_cases, data.displacement, data.force, strict=True
            )
        ]
        return Fleet(tuple(vehicles)), tuple(cases)
