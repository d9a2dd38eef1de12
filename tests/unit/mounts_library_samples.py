"""Mounts for the library's tests, and the programs that write to a library beside a test."""

import time
from dataclasses import fields, is_dataclass
from functools import cache

import numpy as np

from deboom.errors import InputError
from deboom.measurement.campaign import StaticCurve
from deboom.mounts.characterised_mount import (
    CampaignRecord,
    CharacterisedDirection,
    CharacterisedMount,
    DirectionQuality,
    MapPoints,
    MountIdentity,
)
from deboom.mounts.library import open_library
from deboom.mounts.mount import Mount
from deboom.mounts.response_surface import DynamicStiffnessSurface, operating_points


def campaign(name="spring", **changes):
    content = {
        "name": name,
        "order": 1.5,
        "runs": ("g5_wot220 rising", "g5_wot220 falling"),
        "tolerances": {"sensor_position [m]": 0.002, "sensor_angle [rad]": np.radians(0.5)},
        "inputs_sha256": {"campaign.toml": "ab" * 32},
    }
    return CampaignRecord(**(content | changes))


def map_points(seed, n=150):
    rng = np.random.default_rng(seed)
    stiffness = rng.normal(2e5, 3e4, n) + 1j * rng.normal(2e4, 3e3, n)
    return MapPoints(
        preload=rng.normal(0, 800, n),
        wheel_torque=rng.uniform(0, 3000, n),
        amplitude=rng.uniform(1e-6, 1e-3, n),
        frequency=20 + 0.25 * np.arange(n),
        dynamic_stiffness=stiffness,
        confidence=rng.uniform(0, 1, n),
        run=["g5_wot220 rising", "g5_wot220 falling"] * (n // 2) + ["g5_wot220 rising"] * (n % 2),
    )


@cache
def surface(preload_unit="N"):
    points = map_points(3)
    lines = operating_points(points.preload, points.amplitude, points.frequency)
    return DynamicStiffnessSurface(preload_unit=preload_unit).fit(lines, points.dynamic_stiffness)


def mount(seed=1, *, name="TSM", campaign_name="spring", n=150, **identity):
    rng = np.random.default_rng(seed)
    deflection = np.linspace(-0.01, 0.01, 21)
    curve = StaticCurve(name, "x", "M3", deflection, 2e5 * deflection + 1e9 * deflection**3, 0.02)
    settings = {"pieces": 2, "overlap": 0.02, "split": "all", "cv": False, "max": None}
    return CharacterisedMount(
        identity=MountIdentity(
            **({"campaign": campaign_name, "mount": name, "variant": "M3"} | identity)
        ),
        mount=Mount(
            name, "Drehmomentstütze", ("",), (tuple(rng.normal(size=3).tolist()),), ("x", "z")
        ),
        directions=(
            CharacterisedDirection(
                axis="x",
                map_points=map_points(seed, n),
                quality=DirectionQuality(True, 0.013, 0.9991, 0.995, 0.9999),
                surface=surface(),
                static_curve=curve,
            ),
            CharacterisedDirection(
                "z",
                map_points(seed + 1, n),
                DirectionQuality(False),
                surface("N m"),
                settings=settings,
            ),
            CharacterisedDirection("y", map_points(seed, 0), DirectionQuality(False, 0.4)),
        ),
        quality={"force_transfer_condition_number [1]": rng.uniform(1, 9)},
    )


def wishbone(**identity):
    both = Mount(
        "Du", "", ("left", "right"), ((0.1, -0.3, -0.2), (0.1, 0.3, -0.2)), ("x",), 31.5, 1 / 3
    )
    content = {"campaign": "spring", "mount": "Du", "variant": "M3"} | identity
    direction = CharacterisedDirection("x", map_points(8), DirectionQuality(False))
    return CharacterisedMount(MountIdentity(**content), both, (direction,), {})


def assert_same(a, b):
    """Bit for bit, with types."""
    assert type(a) is type(b)
    if isinstance(a, DynamicStiffnessSurface):
        assert_same(a.to_arrays(), b.to_arrays())
    elif is_dataclass(a):
        for field in fields(a):
            assert_same(getattr(a, field.name), getattr(b, field.name))
    elif isinstance(a, np.ndarray):
        assert (a.dtype, a.shape, a.tobytes()) == (b.dtype, b.shape, b.tobytes())
    elif isinstance(a, dict):
        assert list(a) == list(b)
        for key in a:
            assert_same(a[key], b[key])
    elif isinstance(a, tuple):
        assert len(a) == len(b)
        for left, other in zip(a, b, strict=True):
            assert_same(left, other)
    else:
        assert a == b


def write_many(where, name, folder):
    """Make campaigns of its own, and try to be the first with one that others want, too."""
    (folder / f"{name} ready").touch()
    while not (folder / "go").exists():
        time.sleep(0.002)
    with open_library(where, create=True) as library:
        for i in range(4):
            variant = f"{name} {i}"
            library.add(
                [campaign(variant)],
                [mount(seed=s, campaign_name=variant, serial=str(s)) for s in (1, 2)],
            )
        try:
            library.add([campaign("wanted by all")], [mount(campaign_name="wanted by all")])
            said = "first"
        except InputError as error:
            said = str(error)
    (folder / f"{name} said").write_text(said)


def stall(where, marker):
    """Stop in the midst of an import, with megabytes written and not committed."""
    from sqlalchemy import Engine, event

    seen = []

    def after_execute(_connection, _cursor, statement, *_):
        seen.append("INSERT INTO deboom_mount" in statement)
        if sum(seen) == 2:
            marker.touch()
            time.sleep(120)

    event.listen(Engine, "after_cursor_execute", after_execute)
    with open_library(where) as library:
        parts = [mount(seed=s, n=40_000, serial=str(s)) for s in (21, 22, 23)]
        library.add([campaign()], parts, replace=True)
