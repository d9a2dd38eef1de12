"""The library's commands: what they print, write and refuse."""

import pytest
from mounts_library_samples import assert_same, campaign, mount, wishbone

from command_line import call, refused
from deboom.mounts.library import open_library


@pytest.fixture
def path(tmp_path):
    place = tmp_path / "mounts.db"
    with open_library(place, create=True) as library:
        library.add([campaign()], [mount(part_number="4711"), wishbone()])
    return place


def test_list_shows_a_line_per_mount(path):
    done = call("library", "list", path)
    header, *lines = done.output.splitlines()
    assert header.split() == ["campaign", "mount", "variant", "part_number", "supplier", "serial"]
    assert [line.split()[:3] for line in lines] == [["spring", "Du", "M3"], ["spring", "TSM", "M3"]]
    with open_library(path.with_name("empty.db"), create=True) as empty:
        empty.add([campaign()], [])
    assert call("library", "list", path.with_name("empty.db")).output == "no mount\n"


def test_show_says_how_far_each_direction_may_be_believed(path):
    done = call("library", "show", path, "--mount", "TSM")
    lines = {line[:25].strip(): line[25:].split() for line in done.output.splitlines()}
    assert "TSM M3 of campaign spring, part number 4711: Drehmomentstütze" in done.output
    assert "virtual point at x 0.34" in done.output
    assert "force_transfer_condition_number [1]: " in done.output
    assert lines["identified"] == ["yes", "NO", "NO"]
    assert lines["r2_real [1]"] == ["0.9991", "-", "-"]
    assert lines["half_width_95 [1]"] == ["0.013", "-", "0.4"]
    assert lines["map_points"] == ["150", "150", "0"]
    assert lines["frequency_upper [Hz]"] == ["57.25", "57.25", "-"]
    unknown = call("library", "show", path, "--mount", "Du").output
    assert "right at x 0.1, y 0.3, z -0.2 m" in unknown
    assert "None" not in unknown


def test_export_and_import_move_a_library_unchanged(path, tmp_path):
    file = tmp_path / "mounts.json"
    assert call("library", "export", path, file).output.strip() == file.as_posix()
    moved = tmp_path / "moved.db"
    assert call("library", "import", moved, file).output == "2 mounts imported\n"
    assert "is there already" in call("library", "import", moved, file, code=2).output
    call("library", "import", moved, file, "--replace")
    with open_library(moved) as library:
        assert_same(library.load(wishbone().identity), wishbone())
        assert len(library.identities()) == 2


@pytest.mark.parametrize("suffix", ["xlsx", "JSON"])
def test_export_writes_what_the_suffix_says(path, tmp_path, suffix):
    file = tmp_path / f"mounts.{suffix}"
    call("library", "export", path, file, "--mount", "Du")
    start = file.read_bytes()[:2]
    assert start == b"PK" if suffix == "xlsx" else start[:1] == b"{"


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("list", "nowhere.db"), "nowhere.db: there is no such library; check the path"),
        (("show", "LIBRARY"), "2 mounts fit, say which one"),
        (("export", "LIBRARY", "m.csv"), "name a file that ends with .xlsx or .json"),
        (("export", "LIBRARY", "m.json", "--mount", "X"), "`deboom library list` shows them all"),
        (("import", "LIBRARY", "nowhere.json"), "nowhere.json cannot be read"),
    ],
)
def test_bad_input_ends_with_one_sentence_and_exit_code_2(path, tmp_path, arguments, sentence):
    words = (path if argument == "LIBRARY" else argument for argument in arguments)
    refused(("library", *words), "deboom: ", sentence)
