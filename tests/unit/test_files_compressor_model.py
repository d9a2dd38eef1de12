"""The file of an identified compressor: written, read back, refused."""

import json

import numpy as np
import pytest

from deboom.compressor.identify import IdentifiedCompressor
from deboom.compressor.model import CompressorModel, GainFactor
from deboom.errors import InputError
from deboom.files.compressor_model import read_compressor_model, write_compressor_model


def sample(**changes):
    rng = np.random.default_rng(1)
    model = CompressorModel(
        7.2,
        np.array([0.0015, -0.002, 0.001]),
        np.diag([0.0158, 0.0291, 0.0302]),
        np.diag([7e4, 7e4, 7e4, 400.0, 600.0, 650.0]),
        GainFactor.of([1.85, 0.06, 2.2, 0.42, 0.15, 2.5]),
    )
    fields = {
        "name": "test of a pump, 20 °C",
        "model": model,
        "length": 0.0591,
        "reference_frequency": 20.0,
        "parameter_names": ("a", "b"),
        "values": rng.standard_normal(2),
        "covariance": np.diag([1e-9, 2.0]),
        "channels": ("A1 x", "A1 y", "A1 z"),
        "response": rng.standard_normal((3, 6)),
        "impacts": ("I01",),
        "excitation": rng.standard_normal((1, 6)),
        "placement_names": ("hammer gain",),
        "placement_errors": np.array([0.01]),
        "placement_deviations": np.array([0.002]),
        "reduced_chi": 0.98,
        "bands": ((10.0, 30.0), (100.0, 150.0)),
        "alarms": ("look at the hoses",),
        "inputs_sha256": {"frf.uff": "00ff"},
    }
    return IdentifiedCompressor(**(fields | changes))


def test_read_gives_back_what_was_written(tmp_path):
    path = tmp_path / "compressor_model.json"
    kept = sample()
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
    write_compressor_model(path, sample())
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
        sample(covariance=np.eye(3))
