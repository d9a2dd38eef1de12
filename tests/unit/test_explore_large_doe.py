"""Many designs: restartable, in constant memory, the same whatever the chunks."""

import tracemalloc

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.design_space import stiffness_factor_space
from deboom.explore.known_truth import quad2
from deboom.explore.large_doe import SobolDesigns, evaluate_to_store, stored_chunks
from deboom.files.checkpoint import CheckpointFolder, read_evaluations

MODEL = quad2(3, seed=1)
SPACE = stiffness_factor_space(MODEL.variable_names)


def store_in(folder):
    return CheckpointFolder(folder, {})


@pytest.mark.parametrize("chunk", [1, 7, 64, 100, 1000])
def test_designs_and_responses_do_not_depend_on_the_chunks(tmp_path, chunk):
    designs = SobolDesigns(SPACE, 100, seed=3)
    n_chunks = evaluate_to_store(MODEL, designs, store_in(tmp_path / "doe"), chunk)
    assert n_chunks == -(-100 // chunk)
    kept = read_evaluations(tmp_path / "doe")
    np.testing.assert_array_equal(kept["designs"], designs.part(0, 100))
    np.testing.assert_allclose(kept["responses"], MODEL(kept["designs"]), rtol=1e-13)
    assert len(np.unique(kept["designs"], axis=0)) == 100
    parts = list(stored_chunks(store_in(tmp_path / "doe")))
    np.testing.assert_array_equal(np.vstack([p["designs"] for p in parts]), kept["designs"])


def test_points_fill_the_bounds_evenly():
    points = SobolDesigns(SPACE, 256, seed=1).part(0, 256)
    for column in points.T:
        counts, _ = np.histogram(column, bins=16, range=(0.8, 1.2))
        np.testing.assert_array_equal(counts, 16)
    assert not np.array_equal(points, SobolDesigns(SPACE, 256, seed=2).part(0, 256))


def test_an_interrupted_run_goes_on_where_it_was(tmp_path):
    designs = SobolDesigns(SPACE, 100, seed=3)

    def stop(number, total, text):
        assert (total, text) == (10, f"{number * 10} designs")
        if number == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        evaluate_to_store(MODEL, designs, store_in(tmp_path / "doe"), 10, progress=stop)
    assert evaluate_to_store(MODEL, designs, store_in(tmp_path / "doe"), 10) == 6
    assert evaluate_to_store(MODEL, designs, store_in(tmp_path / "doe"), 10) == 0
    evaluate_to_store(MODEL, designs, store_in(tmp_path / "whole"), 10)
    one, other = read_evaluations(tmp_path / "doe"), read_evaluations(tmp_path / "whole")
    for name, column in one.items():
        np.testing.assert_array_equal(column, other[name])


def test_memory_does_not_grow_with_the_number_of_designs(tmp_path):
    peaks = []
    for n_designs in (2**11, 2**15):
        store = store_in(tmp_path / str(n_designs))
        tracemalloc.start()
        evaluate_to_store(MODEL, SobolDesigns(SPACE, n_designs, seed=1), store, 2**10)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.2 * peaks[0]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"seed": 4}, "seed 3, not 4"),
        ({"n_designs": 50}, "n_designs 100, not 50"),
        ({"chunk": 20}, "chunk 10, not 20"),
        ({"half_width": 0.1}, "lower"),
    ],
)
def test_other_designs_are_refused_by_name(tmp_path, changes, words):
    asked = {"seed": 3, "n_designs": 100, "chunk": 10, "half_width": 0.2}

    def evaluate(seed, n_designs, chunk, half_width):
        space = stiffness_factor_space(MODEL.variable_names, half_width)
        designs = SobolDesigns(space, n_designs, seed)
        evaluate_to_store(MODEL, designs, store_in(tmp_path / "doe"), chunk)

    evaluate(**asked)
    with pytest.raises(InputError, match=words):
        evaluate(**asked | changes)


def test_what_cannot_be_is_refused(tmp_path):
    designs = SobolDesigns(SPACE, 8, seed=1)
    with pytest.raises(InputError, match="seed 0"):
        SobolDesigns(SPACE, 8, seed=0)
    with pytest.raises(InputError, match="0 designs"):
        SobolDesigns(SPACE, 0, seed=1)
    with pytest.raises(InputError, match="chunks of 0 designs"):
        evaluate_to_store(MODEL, designs, store_in(tmp_path), 0)
    with pytest.raises(InputError, match="same names in the same order"):
        evaluate_to_store(quad2(4, seed=1), designs, store_in(tmp_path))
    assert len(designs) == 8
