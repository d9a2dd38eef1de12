"""Which runs are of one platform: by the hashes of what its folder holds, wherever it lies."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from deboom.errors import InputError
from deboom.runs.rebuilt import check_same_platform


def run_of(home, **hashes):
    names = {"toml": "platform.toml", "uff": "noise/U06-1.uff"}
    inputs = {f"{home}/{names[name]}": digest for name, digest in hashes.items()}
    entry = SimpleNamespace(folder=Path("results") / home, record={"inputs_sha256": inputs})
    return SimpleNamespace(entry=entry)


def test_a_platform_is_the_same_in_another_folder():
    check_same_platform(
        [run_of("data/u06", toml="a", uff="b"), run_of("../mine", toml="a", uff="b")]
    )


def test_another_platform_is_named_by_its_first_file_that_differs():
    runs = [run_of("data/u06", toml="a", uff="b"), run_of("../mine", toml="a", uff="c")]
    with pytest.raises(InputError, match=r"different platforms \(noise/U06-1\.uff differs\)"):
        check_same_platform(runs)
