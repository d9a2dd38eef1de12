"""Studies under the names that they had in version 0.3; versions before 0.5 take them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from deboom.errors import InputError


@dataclass(frozen=True)
class FormerStudy:
    """A study of version 0.3, as a study of today.

    - `today`: its name.
    - `defaults`: options whose default was another one, by name.
    - `gone`: options that it took and today's does not, with the values that change no model, and
      what there is in their place.
    """

    today: str
    defaults: Mapping[str, Any] = field(default_factory=dict)
    gone: Mapping[str, tuple[tuple[Any, ...], str]] = field(default_factory=dict)

    def arguments(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Return options of the former study as today's takes them.

        - `given`: options by name.
        - raises InputError: an option that is gone and changed the model.
        """
        for name in given.keys() & self.gone.keys():
            ignored, instead = self.gone[name]
            if given[name] not in ignored:
                raise InputError(f"{self.today} has no --{name.replace('_', '-')}: {instead}")
        kept = {name: value for name, value in given.items() if name not in self.gone}
        return {**self.defaults, **kept}


FORMER_STUDIES = {
    "u06_platform": FormerStudy("front"),
    "u06_robust_front": FormerStudy(
        "front",
        {"with_": "prescribed", "generations": 50},
        {
            # a record has the options that it stood for as well
            "as_thesis": (
                (False, True),
                "write --motion prescribed --sampler fresh --samples 100",
            ),
            "free_tolerances": (
                (False,),
                "`deboom run tolerance_allocation --free-tolerances` has them as variables",
            ),
        },
    ),
    "u06_sensitivity": FormerStudy("sensitivity"),
    "fleet_correlation": FormerStudy("correlation"),
    "compressor_robust_front": FormerStudy("compressor_front"),
    "compressor_identification": FormerStudy("identify"),
    "compressor_unbalance": FormerStudy("unbalance"),
}

MOVED = {
    "second_engine": "this study is an example now, examples/mounts/plot_second_engine.py: "
    "deboom.mounts.surface_forces.predicted_forces predicts the forces"
}
"""Studies of version 0.3 that are none any more, and where they are."""


def names_of(study: str) -> tuple[str, ...]:
    """Return the name of a study today, and then those that it had."""
    today = FORMER_STUDIES[study].today if study in FORMER_STUDIES else study
    return (today, *(name for name, former in FORMER_STUDIES.items() if former.today == today))
