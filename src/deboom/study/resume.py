"""Going on with an unfinished run: the same question, options, versions and files, or none."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import TypeAdapter, ValidationError

from deboom.errors import InputError
from deboom.files.run_list import RunEntry

SAME_RESULT = ("workers", "scheduler")
"""Options that say who computes, not what: a resumed run may have others."""


def resumed_arguments(
    entry: RunEntry, hints: Mapping[str, Any], given: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the arguments of an unfinished run.

    Parameters
    ----------
    entry : RunEntry
        The run.
    hints : mapping of str to type
        Of the parameters of the study's ``main``.
    given : mapping of str to str, int, float, bool, list or None
        Options that the user gave this time, as a record would hold them.

    Returns
    -------
    dict
        What ``main`` takes.

    Raises
    ------
    InputError
        An option given that differs from the run's, unless it cannot change the result.
    """
    recorded = dict(entry.record["arguments"])
    for name, value in given.items():
        if name in SAME_RESULT:
            recorded[name] = value
        elif recorded.get(name) != value:
            option = f"--{name.replace('_', '-')}"
            raise InputError(
                f"run {entry.name} was started with {option} {recorded.get(name)}, not {value}: "
                "leave the option out or start a new run"
            )
    try:
        return {
            name: TypeAdapter(hints[name]).validate_python(value)
            for name, value in recorded.items()
        }
    except (KeyError, ValidationError) as error:
        raise InputError(
            f"run {entry.name} has options that this study does not take ({error}): start a new run"
        ) from None


def check_same_code(entry: RunEntry, record: Mapping[str, Any]) -> None:
    """Refuse to go on with a run that another code began.

    Parameters
    ----------
    entry : RunEntry
        The run.
    record : mapping
        What its record would say if it began now.

    Raises
    ------
    InputError
        Names what differs: the study's text, Python, a package, or deboom's own revision.
    """
    if entry.record["study_text"] != record["study_text"]:
        raise InputError(
            f"run {entry.name} was started with another text of the study {entry.study}: bring the "
            f"script back as it was (its text is in {entry.folder / 'run.json'}) or start a new run"
        )
    now = dict(_versions(record["environment"]))
    for name, then in _versions(entry.record["environment"]):
        if now.get(name) != then:
            raise InputError(
                f"run {entry.name} was started with {name} {then}, now it is {now.get(name)}: "
                "go back to the former or start a new run"
            )


def _versions(environment: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    yield "Python", environment["python"]
    yield from environment["packages"].items()
    yield "deboom revision", (environment["git"] or {}).get("revision")
