"""The file of an identified compressor: what is read back of it, and what is refused."""

import json

import pytest

from deboom.errors import InputError
from deboom.files.compressor_model import FORMAT, VERSION, read_fitted_bands

DOCUMENT = {
    "format": FORMAT,
    "version": VERSION,
    "bands_hz": [[10, 30], [100, 150]],
    "inputs_sha256": {"frf.uff": "00ff"},
}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"version": 2}, "version 2"),
        ({"format": "something else"}, "no identified compressor"),
        ({"bands_hz": None}, "lacks bands or hashes"),
        ({"bands_hz": [["low", 30]]}, "lacks bands or hashes"),
        ({"inputs_sha256": []}, "lacks bands or hashes"),
        ({}, ""),
    ],
)
def test_bands_and_hashes_are_read_or_refused(changes, words, tmp_path):
    path = tmp_path / "compressor_model.json"
    path.write_text(json.dumps(DOCUMENT | changes), encoding="utf-8")
    if not words:
        bands = ((10.0, 30.0), (100.0, 150.0))
        assert read_fitted_bands(path) == (bands, {"frf.uff": "00ff"})
        return
    with pytest.raises(InputError, match=words):
        read_fitted_bands(path)
