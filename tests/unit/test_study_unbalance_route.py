"""The route that counts where none is asked for: an update of the mounts is not for everybody."""

from types import SimpleNamespace

import pytest

from deboom.compressor.routes import CalibratedMeasurementRoute, UpdatedRoute
from deboom.compressor.sources import ResidualBand
from deboom.compressor.unbalance import Unbalance, UnbalanceOptions
from deboom.errors import InputError
from deboom.measurement.operating_sweep import HoseState
from deboom.study.compressor_unbalance import AUTOMATIC, MeasuredUnbalance, with_route


def found(*, changed=True, hoses=HoseState.SOFT, share=0.0, alarms=()):
    """Build what `with_route` reads of an evaluation by route d."""
    band = ResidualBand(90.0, 120.0, share, 5.0 if share else 1.0)
    results = tuple(
        SimpleNamespace(
            route=route,
            sweeps=(SimpleNamespace(sweep="one"),),
            sources=SimpleNamespace(residual_bands=(band,)),
        )
        for route in (CalibratedMeasurementRoute(), UpdatedRoute())
    )
    return Unbalance(
        test=SimpleNamespace(sweeps=(SimpleNamespace(name="one", hoses=hoses),)),
        identification=SimpleNamespace(alarms=alarms),
        options=UnbalanceOptions(),
        motions=(),
        sense=None,
        routes=results,
        state=SimpleNamespace(changed=changed),
        alarms=(),
        notices=(),
    )


@pytest.mark.parametrize(
    ("state", "letter"),
    [
        ({}, "e"),
        ({"changed": False}, "d"),
        ({"alarms": ("a subframe",)}, "d"),
        ({"hoses": HoseState.STANDARD}, "d"),
        ({"share": 0.08}, "d"),
    ],
)
def test_mounts_are_updated_only_where_nothing_else_can_look_like_them(state, letter):
    assert with_route(found(**state), AUTOMATIC).chosen.route.letter == letter


def test_a_route_that_is_asked_for_is_taken_and_an_unknown_one_refused():
    assert with_route(found(changed=False), "e").chosen.route.letter == "e"
    with pytest.raises(InputError, match="there is no route 'a': choose auto, d, e"):
        with_route(found(), "a")


@pytest.mark.parametrize(
    ("state", "changed"),
    [({}, "yes"), ({"changed": False}, "no"), ({"share": 0.08}, "unknown")],
)
def test_mounts_are_not_judged_with_hoses_in_the_data(state, changed):
    measured = MeasuredUnbalance(
        with_route(found(**state), "d"), None, None, (), None, (), None, 0.0
    )
    assert measured.mounts_changed == changed
    if changed == "unknown":
        assert "cannot be told" in measured.mount_state
