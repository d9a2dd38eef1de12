"""A study's booming index, built again from data that were measured again."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.files.library_export import read_library_json
from deboom.measurement.sensors import Tolerances
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.surface_forces import Outside
from deboom.vehicles.booming_model import CatalogueModel, model_of_other_data
from deboom.vehicles.catalogue import Catalogue, runs_of_parts
from deboom.vehicles.expected_change import (
    CarMeasurement,
    ExpectedChange,
    Information,
    expected_change,
    widths_if_measured,
)
from deboom.vehicles.fleet import Fleet
from deboom.vehicles.platform import LIBRARY_FILE, Platform, Runs
from deboom.vehicles.platform_uncertainty import (
    PRIOR,
    force_sources,
    tolerances_of_record,
    transfer_sources,
)
from deboom.vehicles.uncertain_data import BUDGET, SHAKER, UncertainData, UncertaintySource

REPETITIONS = 16
"""Draws of the measurements behind an expected change; bodies and rubber are drawn more often."""


@dataclass(frozen=True, eq=False)
class UncertainIndex:
    """A booming index that can be measured again.

    - `index`: from the data as measured.
    - `data`: these data, and what may be wrong with them.
    - `platform`: mounts and powertrain.
    """

    index: Any
    data: UncertainData
    platform: Platform

    def again(self, draw: int, seed: int, only: Collection[str] | None = None) -> Any:
        """Return the index of one draw, see `UncertainData.drawn`; of the same kind and names."""
        fleet, cases = self.data.drawn(draw, seed, only)
        data = self.platform
        return model_of_other_data(self.index, fleet, data.mounts, data.powertrain, cases)

    def draws(self, n_draws: int, seed: int, only: Collection[str] | None = None) -> Iterator[Any]:
        """Give the indices of draws 0 to ``n_draws`` - 1, one after the other."""
        for draw in range(n_draws):
            yield self.again(draw, seed, only)

    @property
    def on_bodies_at_rest(self) -> UncertainIndex:
        """The same without receptances, as an expected change takes it: bodies are drawn apart."""
        at_rest = Fleet(tuple(replace(v, receptance=None) for v in self.data.fleet.vehicles))
        return replace(self, data=replace(self.data, fleet=at_rest))

    def expected_change(
        self,
        picks: npt.ArrayLike,
        *,
        information: Information | None = None,
        weights: RealArray | None = None,
        seed: int = 1,
    ) -> ExpectedChange:
        """State the expected change by picks with its intervals.

        Parameters and errors as of `deboom.vehicles.expected_change.expected_change`.
        """
        return expected_change(
            self.index,
            list(self.on_bodies_at_rest.draws(REPETITIONS, seed)),
            self.data.fleet,
            self.platform.mounts,
            picks,
            information=information,
            weights=weights,
            seed=seed,
        )

    def widths_if_measured(
        self, picks: npt.ArrayLike, *, weights: RealArray | None = None, seed: int = 1
    ) -> dict[CarMeasurement | None, RealArray]:
        """State how wide the interval of the expected change is to be after a measurement.

        Parameters, widths and errors as of `deboom.vehicles.expected_change.widths_if_measured`.
        """
        return widths_if_measured(
            self.index,
            list(self.on_bodies_at_rest.draws(REPETITIONS, seed)),
            self.data.fleet,
            self.platform.mounts,
            picks,
            weights=weights,
            seed=seed,
        )


def uncertain_index(
    index: Any,
    platform: Platform,
    parts: Sequence[CharacterisedMount],
    transfer: Sequence[UncertaintySource] | None = None,
) -> UncertainIndex:
    """Put a study's index together with what may be wrong with its data.

    - `index`: of the study.
    - `platform`: with the load cases that the index was made of, and its vehicles.
    - `parts`: the forces come from; empty if they are the measured ones.
    - `transfer`, optional: of the noise transfer functions; by default the stated priors. The
      measuring chains have the tolerances in the record of the mount library, or stated priors
      where there is none.
    - raises InputError: see `UncertainData`.
    """
    of_response = {
        receiver.response_name(vehicle.name): vehicle
        for vehicle in platform.fleet.vehicles
        for receiver in vehicle.transfers
    }
    # each vehicle once, in the order of the index
    fleet = Fleet(tuple(dict.fromkeys(of_response[name] for name in index.response_names)))
    cases = tuple(platform.load_case(name) for name in index.load_case_names)
    band = (float(index.frequency[0]), float(index.frequency[-1]))
    chains = library_tolerances(platform) if parts else (Tolerances(), PRIOR)
    sources = (
        *(transfer_sources() if transfer is None else transfer),
        *force_sources(platform.mounts, cases, parts, band, *chains),
    )
    data = UncertainData(fleet, cases, sources, band)
    return UncertainIndex(index, data, platform)


def library_tolerances(platform: Platform) -> tuple[Tolerances, str]:
    """Return tolerances of the mounts' characterisation, or stated priors, and their origin."""
    records = read_library_json(platform.folder / LIBRARY_FILE)[0]
    if not records:
        return Tolerances(), PRIOR
    return (
        tolerances_of_record(records[0].tolerances, Tolerances()),
        f"tolerances of campaign {records[0].name}",
    )


def expected_of_sets(
    index: CatalogueModel,
    runs: Runs,
    catalogue: Catalogue,
    outside: Outside,
    designs: RealArray,
    *,
    weights: RealArray | None,
    seed: int,
) -> ExpectedChange:
    """State the expected change by sets of parts, re-tuned, against today's.

    - `index`: of the catalogue, see `catalogue_index`.
    - `designs` (n, n_mount + k): part numbers, then stiffness factors [1].
    - `weights`, `seed`: as of `deboom.vehicles.expected_change.expected_change`.
    - raises InputError: see there.
    """
    every = []
    for number, each in enumerate(runs_of_parts(runs, catalogue, outside)):
        uncertain = uncertain_index(index.models[number], each.platform, each.parts)
        # each part was set up on its own to be characterised; motion and cabin were measured once
        sources = tuple(
            replace(source, name=f"{source.name}, part {number}")
            if number and source.name in (SHAKER, BUDGET)
            else source
            for source in uncertain.data.sources
        )
        data = replace(uncertain.data, sources=sources)
        every.append(replace(uncertain, data=data).on_bodies_at_rest.draws(REPETITIONS, seed))
    again = [replace(index, models=models) for models in zip(*every, strict=True)]
    return expected_change(
        index, again, runs.fleet, index.mounts, designs, weights=weights, seed=seed
    )
