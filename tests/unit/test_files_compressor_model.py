"""The file of an identified compressor: written, read back, refused."""

import json

import numpy as np
import pytest
from compressor_samples import identified

from deboom.errors import InputError
from deboom.files.compressor_model import read_compressor_model, write_compressor_model


def test_read_gives_back_what_was_written(tmp_path):
    path = tmp_path / "compressor_model.json"
    kept = identified(alarms=("look at the hoses",))
    write_compressor_model(path, kept)
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]
    read = read_compressor_model(path)
    for name in ("values", "covariance", "response", "excitation", "placement_errors"):
        np.testing.assert_array_equal(getattr(read, name), getattr(kept, name))
    for name in ("name", "length", "channels", "impacts", "bands", "alarms", "inputs_sha256"):
        assert getattr(read, name) == getattr(kept, name)
    lines = np.array([10.0, 100.0])
    np.testing.assert_array_equal(read.model.inertance(lines), kept.model.inertance(lines))


def _changed(**changes):
    def change(document):
        document.update(changes)

    return change


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_changed(version=2), "version 2"),
        (_changed(format="something else"), "no identified compressor"),
        (lambda document: document.pop("gain"), "lacks the entry 'gain'"),
        (_changed(mass_kg="heavy"), "wrong kind"),
        (_changed(mass_kg=-1.0), "must be positive"),
    ],
)
def test_another_file_is_refused(change, words, tmp_path):
    path = tmp_path / "compressor_model.json"
    write_compressor_model(path, identified())
    document = json.loads(path.read_text(encoding="utf-8"))
    change(document)
    path.write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(InputError, match=words):
        read_compressor_model(path)


def test_no_file_and_no_json(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_compressor_model(tmp_path / "nothing.json")
    (tmp_path / "text.json").write_text("mass 7.2", encoding="utf-8")
    with pytest.raises(InputError, match="not JSON"):
        read_compressor_model(tmp_path / "text.json")


def test_shapes_must_fit():
    with pytest.raises(InputError, match="covariance"):
        identified(covariance=np.eye(3))
