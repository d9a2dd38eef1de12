"""Broken inputs of every kind are answered with a sentence; `make fuzz` tries many more."""

import sys
import warnings

import fuzz


def test_broken_inputs_of_every_kind_end_in_a_sentence(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["fuzz", "--cases", "40", "--seed", "1", "--seconds", "300"])
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # as it does itself
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        verdict = fuzz.main()
    said = capsys.readouterr().out
    assert (verdict, "40 cases, seed 1: 0 faults" in said) == (0, True), said
