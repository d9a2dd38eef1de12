import re

import pytest

from deboom.errors import InputError
from deboom.files.platform_file import dump_platform_file, load_platform_file

TOML = """\
format = 1
name = "compact"
title = "Compact platform, \\"two\\" bodies"
description = "Measured in winter: −5 °C."
mount_table = "mounts.csv"
channel_table = "tables/channels.csv"
default_load_case = "g5"

[engine]
cylinders = 3
dominant_order = 1.5
total_ratios = [16.2, 9.6, 6.2, 4.45, 3.4, 3]

[powertrain]
mass_kg = 193.5
mass_tolerance_kg = 1
inertia_kg_m2 = [[11.0, -0.06, -0.26], [-0.06, 6.8, 0.53], [-0.26, 0.53, 9.6]]
inertia_tolerance = 0.02
centre_of_gravity_tolerance_m = 0.002

[[mounts]]
name = "TSM"
description = "torque strut"
transfer_axes = ["x", "z"]

[[mounts]]
name = "Du"
description = "wishbone mount"
pieces = ["left", "right"]
transfer_axes = ["x"]

[[vehicles]]
name = "U06-1"
group = "U06"
noise_transfer = "noise_transfer/U06-1.uff"
ear_node = 901

[[load_cases]]
name = "g5"
title = "5th gear"
gear = 5
torque_limit_nm = 220.0
operating = "g5.uff"

[[load_cases]]
name = "g6"
title = "6th gear"
gear = 6
torque_limit_nm = 160.5
operating = "g6.uff"
"""


@pytest.fixture
def path(tmp_path):
    file = tmp_path / "platform.toml"
    file.write_text(TOML, encoding="utf-8")
    return file


def test_a_platform_file_is_read(path):
    platform = load_platform_file(path)
    assert platform.title == 'Compact platform, "two" bodies'
    assert platform.engine.total_ratios == (16.2, 9.6, 6.2, 4.45, 3.4, 3.0)
    assert platform.powertrain.inertia_kg_m2[1] == (-0.06, 6.8, 0.53)
    assert [mount.piece_names for mount in platform.mounts] == [("",), ("left", "right")]
    assert platform.vehicles[0].ear_node == 901
    assert [case.torque_limit_nm for case in platform.load_cases] == [220.0, 160.5]


def test_what_is_dumped_loads_as_the_same_values(path, tmp_path):
    platform = load_platform_file(path)
    dump_platform_file(tmp_path / "copy.toml", platform)
    assert load_platform_file(tmp_path / "copy.toml") == platform
    assert sorted(p.name for p in tmp_path.iterdir()) == ["copy.toml", "platform.toml"]


def test_a_mount_may_carry_a_body_of_its_own(path, tmp_path):
    text = path.read_text(encoding="utf-8")
    own = 'transfer_axes = ["x"]\nbody_mass_kg = 40.2\nbody_mass_tolerance_kg = 1.0'
    path.write_text(text.replace('transfer_axes = ["x"]', own), encoding="utf-8")
    platform = load_platform_file(path)
    assert [mount.body_mass_kg for mount in platform.mounts] == [None, 40.2]
    assert [mount.body_mass_tolerance_kg for mount in platform.mounts] == [None, 1.0]
    dump_platform_file(tmp_path / "copy.toml", platform)
    assert load_platform_file(tmp_path / "copy.toml") == platform


def test_what_would_be_refused_is_not_dumped(path, tmp_path):
    platform = load_platform_file(path)
    cases = (platform.load_cases[1],)
    with pytest.raises(InputError, match="default_load_case 'g5' is not among the load cases g6"):
        dump_platform_file(tmp_path / "a.toml", platform.model_copy(update={"load_cases": cases}))
    # pydantic checks nothing in model_copy: a control character is no TOML
    with pytest.raises(InputError, match="is not TOML"):
        dump_platform_file(tmp_path / "a.toml", platform.model_copy(update={"title": "a\x7fb"}))
    with pytest.raises(InputError, match=r"a\.toml cannot be written \(No such file"):
        dump_platform_file(tmp_path / "absent" / "a.toml", platform)
    assert [p.name for p in tmp_path.iterdir()] == ["platform.toml"]


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        # unknown keys, which also explain a missing one
        ("gear = 6", "gaer = 6", "unknown key 'gaer' in [[load_cases]] 2; did you mean 'gear'?"),
        ("mass_kg", "mass", "unknown key 'mass' in [powertrain]; did you mean 'mass_kg'?"),
        ("[engine]", "[motor]", "unknown key 'motor' in the top level; use format, name,"),
        ("[[vehicles]]", "[[vehicle]]", "'vehicle' in the top level; did you mean 'vehicles'?"),
        ("cylinders = 3", "cylinders = 3\nturbo = true", "unknown key 'turbo' in [engine]; use"),
        # missing keys
        ("gear = 6\n", "", "key 'gear' in [[load_cases]] 2 is missing: add it"),
        ('name = "compact"\n', "", "key 'name' in the top level is missing: add it"),
        ("dominant_order = 1.5\n", "", "key 'dominant_order' in [engine] is missing"),
        # types
        (
            "gear = 6",
            'gear = "6"',
            "'gear' in [[load_cases]] 2 is \"6\": input should be a valid int",
        ),
        (
            "gear = 6",
            "gear = 6.0",
            "'gear' in [[load_cases]] 2 is 6.0: input should be a valid int",
        ),
        ("gear = 6", "gear = true", "'gear' in [[load_cases]] 2 is true: input should be a valid"),
        ("mass_kg = 193.5", 'mass_kg = "193.5"', "'mass_kg' in [powertrain] is \"193.5\": input"),
        ("16.2,", '"16.2",', "key 'total_ratios[0]' in [engine] is \"16.2\": input should be"),
        ("[11.0, -0.06", "[true, -0.06", "key 'inertia_kg_m2[0][0]' in [powertrain] is true"),
        ('transfer_axes = ["x"]', 'transfer_axes = "x"', "'transfer_axes' in [[mounts]] 2"),
        ('title = "5th gear"', "title = 5", "key 'title' in [[load_cases]] 1 is 5: input should"),
        # a body of its own
        (
            'transfer_axes = ["x"]',
            'transfer_axes = ["x"]\nbody_mass_kg = 40.0',
            "key 'body_mass_tolerance_kg' in [[mounts]] 2 is null: a body mass needs a tolerance",
        ),
        (
            'transfer_axes = ["x"]',
            'transfer_axes = ["x"]\nbody_mass_kg = 4.0\nbody_mass_tolerance_kg = 5.0',
            "is 5.0: a body mass needs a tolerance below it",
        ),
        (
            'transfer_axes = ["x"]',
            'transfer_axes = ["x"]\nbody_mass_tolerance_kg = 1.0',
            "is 1.0: a tolerance needs the key 'body_mass_kg' beside it",
        ),
        (
            'transfer_axes = ["x"]',
            'transfer_axes = ["x"]\nbody_mass_kg = 0.0\nbody_mass_tolerance_kg = 0.0',
            "key 'body_mass_kg' in [[mounts]] 2 is 0.0: input should be greater than 0",
        ),
        # ranges
        ("format = 1", "format = 2", "key 'format' in the top level is 2: input should be 1"),
        ("gear = 6", "gear = 0", "is 0: input should be greater than or equal to 1"),
        ("gear = 6", "gear = 7", "load case 'g6' is in gear 7, but total_ratios in [engine] has 6"),
        ("mass_kg = 193.5", "mass_kg = -1.0", "is -1.0: input should be greater than 0"),
        ("mass_kg = 193.5", "mass_kg = nan", "'mass_kg' in [powertrain] is NaN: input should be"),
        ("mass_tolerance_kg = 1", "mass_tolerance_kg = -1", "greater than or equal to 0"),
        ("-0.26, 0.53, 9.6", "-0.26, 0.5, 9.6", "an inertia tensor is symmetric and positive"),
        ("[11.0, -0.06", "[-11.0, -0.06", "an inertia tensor is symmetric and positive"),
        ('["x", "z"]', '["x", "w"]', "key 'transfer_axes[1]' in [[mounts]] 1 is \"w\": input"),
        ('["x", "z"]', '["x", "x"]', "two transfer_axes of mount TSM are named 'x'"),
        # names
        ('name = "Du"', 'name = "TSM"', "two [[mounts]] are named 'TSM': keep or rename one"),
        ('name = "g6"', 'name = "g5"', "two [[load_cases]] are named 'g5'"),
        ('["left", "right"]', '["left", "left"]', "two pieces of mount Du are named 'left'"),
        ('["left", "right"]', '["left"]', "key 'pieces' in [[mounts]] 2"),
        ('name = "Du"', 'name = "D u"', "at least one character and no blanks"),
        ('default_load_case = "g5"', 'default_load_case = "g7"', "among the load cases g5, g6"),
        # files
        ('"g6.uff"', '"../g6.uff"', "'operating' in [[load_cases]] 2 is \"../g6.uff\": a file is"),
        ('"g6.uff"', '"/data/g6.uff"', "relative to the platform folder"),
        ('"g6.uff"', "'C:\\g6.uff'", "relative to the platform folder"),
        ('"g6.uff"', '""', "relative to the platform folder"),
        ('"mounts.csv"', '"a/../../mounts.csv"', "key 'mount_table' in the top level is"),
        # TOML itself
        ("gear = 6", "gear = six", "is not TOML: Invalid value (at line"),
        ("gear = 6", "gear = 6\ngear = 6", "is not TOML: Cannot overwrite a value (at line"),
    ],
)
def test_a_wrong_key_is_named_with_its_place(path, old, new, sentence):
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=re.escape(sentence)) as caught:
        load_platform_file(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_a_missing_and_a_foreign_file_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"platform\.toml cannot be read \(No such file"):
        load_platform_file(tmp_path / "platform.toml")
    (tmp_path / "platform.toml").write_bytes(b'name = "\xff"')
    with pytest.raises(InputError, match=r"platform\.toml is not UTF-8"):
        load_platform_file(tmp_path / "platform.toml")
