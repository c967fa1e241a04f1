"""A pump's delivery that slopes attribute to leaks, and a zero partly absorbed by another effect, are still tried."""

from types import SimpleNamespace
from typing import Any

import pytest

from estimation.fits.hypotheses import BEGUN_UNDER_LOAD, DELIVERY, ENCODER_ZERO, OFFSET, VOLUME
from estimation.fits.hypothesis_search import commonly_hidden
from estimation.fits.hypothesis_search.commonly_hidden import fit_of_delivery, rig_and_load, with_delivery, with_zero
from estimation.fits.hypothesis_search.explanation import Trial
from estimation.fits.hypothesis_search.predicted_gains import PredictedGain

LOG: Any = None
SPARED: Any = SimpleNamespace(starts=[{}], every=1)


def tried(cost: float, *together: Any, delays: Any = None) -> Trial:
    of_this: Any = SimpleNamespace(cost=cost)
    values = {name: 1.0 for one in together for name in one.free}
    return Trial(together, of_this, values, delays or {}, {}, (of_this,))


def explains(fit: Any) -> bool:
    return fit.cost < 50.0


@pytest.fixture(autouse=True)
def asked(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    found = list[Any]()

    def screened(_: Any, together: Any, *__: Any, **___: Any) -> Any:
        found.append(together)
        return [tried(40.0, *together)]

    monkeypatch.setattr(commonly_hidden, "screen", screened)
    monkeypatch.setattr(commonly_hidden, "likeliest_sets", lambda _, ways, *__: ways[0])
    monkeypatch.setattr(commonly_hidden, "without_delays", lambda log, _: log)
    return found


@pytest.mark.parametrize(
    ("first", "sought"),
    [
        (tried(90.0, OFFSET), True),
        (tried(40.0, OFFSET), False),  # it already explains the log
        (tried(90.0, DELIVERY), False),  # delivery was already sought
    ],
)
def test_another_delivery_is_searched_further_only_if_nothing_explains_the_log(
    first: Trial, sought: bool, asked: list[Any]
) -> None:
    assert bool(fit_of_delivery(LOG, [first], SPARED, explains)) == bool(asked) == sought


def test_an_encoder_zero_is_tested_with_the_likeliest_hypothesis_unless_that_explains_the_log(asked: list[Any]) -> None:
    (both,) = with_zero(LOG, tried(90.0, OFFSET, delays={"position_m": 1e-3}), SPARED, explains)
    assert both.together == (OFFSET, ENCODER_ZERO)
    assert both.delays == {"position_m": 1e-3}
    for first in (tried(40.0, OFFSET), tried(90.0, ENCODER_ZERO)):
        assert with_zero(LOG, first, SPARED, explains) == []
    assert with_zero(LOG, tried(90.0, OFFSET), SPARED, lambda fit: fit.cost < 1.0) == []  # both leave too much
    assert len(asked) == 2


def test_delivery_volume_and_load_are_tested_together_only_if_nothing_explains_the_log(
    asked: list[Any],
) -> None:
    assert rig_and_load(LOG, BEGUN_UNDER_LOAD, tried(40.0, OFFSET), SPARED, explains) == asked == []
    (three,) = rig_and_load(LOG, BEGUN_UNDER_LOAD, tried(90.0, OFFSET), SPARED, explains)
    assert three.together == (DELIVERY, VOLUME, BEGUN_UNDER_LOAD)
    assert rig_and_load(LOG, BEGUN_UNDER_LOAD, tried(90.0, OFFSET), SPARED, lambda fit: fit.cost < 1.0) == []


@pytest.mark.parametrize(
    ("first", "gain", "size", "sought"),
    [
        (tried(45.0, OFFSET), 27.0, -0.08, True),
        (tried(45.0, OFFSET), 12.0, -0.08, False),
        (tried(45.0, OFFSET), 27.0, -0.005, False),  # no rig file is so accurate
        (tried(90.0, OFFSET), 27.0, -0.08, False),  # it does not explain the log
        (tried(45.0, OFFSET, DELIVERY), 27.0, -0.08, False),
    ],
)
def test_another_delivery_is_tested_beside_an_explanation_if_its_predicted_gain_is_large(
    first: Trial, gain: float, size: float, sought: bool, asked: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(commonly_hidden, "delivery_beside", lambda *_: PredictedGain(gain, size, 0.01))
    found = with_delivery(LOG, first, SPARED, explains)
    assert [one.together for one in found] == asked == [(OFFSET, DELIVERY)] * sought
