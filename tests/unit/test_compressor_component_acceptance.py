"""Which unbalance is judged, and when nothing is."""

from types import SimpleNamespace

import numpy as np
import pytest

from deboom.compressor.component_acceptance import (
    DYNAMIC,
    STATIC,
    unbalance_characteristic,
)
from deboom.compressor.routes import CalibratedMeasurementRoute, UpdatedRoute
from deboom.compressor.sources import ResidualBand
from deboom.measurement.operating_sweep import HoseState


def found(
    *,
    hoses=HoseState.SOFT,
    share=0.0,
    chi=1.0,
    alarms=(),
    route=None,
    converged=True,
):
    """Build what `unbalance_characteristic` reads of an `Unbalance`."""
    covariance = np.diag([4.0, 1.0, 9.0, 9.0, 0.0, 0.0])
    covariance[0, 1] = covariance[1, 0] = 1.5
    sources = SimpleNamespace(
        static=SimpleNamespace(value=3 + 4j),
        dynamic=SimpleNamespace(value=-7 + 0j),
        covariance=covariance,
        remaining_chi=chi,
        residual_bands=(ResidualBand(90.0, 120.0, share, 5.0 if share else 1.0),),
    )
    return SimpleNamespace(
        chosen=SimpleNamespace(
            sources=sources,
            sweeps=(SimpleNamespace(sweep="one"),),
            route=route or CalibratedMeasurementRoute(),
            fit=SimpleNamespace(converged=converged),
        ),
        test=SimpleNamespace(
            sweeps=(
                SimpleNamespace(name="one", hoses=hoses),
                SimpleNamespace(name="another", hoses=HoseState.STANDARD),
            )
        ),
        identification=SimpleNamespace(alarms=alarms),
    )


def test_the_size_of_an_unbalance_with_its_worst_direction():
    measured = unbalance_characteristic(found(), STATIC)
    assert measured.values.tolist() == [5.0]
    largest = np.linalg.eigvalsh([[4.0, 1.5], [1.5, 1.0]])[-1]
    assert measured.deviations == pytest.approx([np.sqrt(largest)])
    assert measured.is_radius
    assert measured.doubt == ""
    assert unbalance_characteristic(found(), DYNAMIC).deviations.tolist() == [3.0]


@pytest.mark.parametrize(
    ("state", "words"),
    [
        ({"hoses": HoseState.STANDARD}, "run with long soft hoses"),
        ({"share": 0.08}, "8.0% of the load in 90-120 Hz comes from no rotor"),
        ({"chi": 2.5}, "residuals are 2.50 times the noise"),
        ({"converged": False}, "no rotor, gas and mounts explain the sweeps"),
        ({"alarms": ("a subframe",), "route": UpdatedRoute()}, "choose route d"),
    ],
)
def test_what_makes_it_prove_nothing(state, words):
    assert words in unbalance_characteristic(found(**state), STATIC).doubt


def test_a_measured_route_does_not_need_the_refuted_model():
    assert unbalance_characteristic(found(alarms=("a subframe",)), STATIC).doubt == ""
