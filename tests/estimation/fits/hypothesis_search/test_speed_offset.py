"""An offset of motor speed that passed for one of pressure, by made-up fits; and such an offset from the lost flow."""

from collections.abc import Sequence

import numpy as np
import pytest

from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypothesis_search.pump_ripple_fits import LEAST_OFFSET
from estimation.fits.hypothesis_search.speed_offset import MOST_SHARE, offset_by_lost_flow, speed_offset_instead
from tests.estimation.fits.short_logs import PAPER, SPEED, WORN, log, made_fit, seen

LEAKAGE, DISPLACEMENT = 5e-11, PAPER.pump_displacement


@pytest.mark.parametrize(("offset", "cost", "told"), [(-2.0, 99.0, True), (2.0, 99.0, True), (-2.0, 101.0, False)])
def test_a_speed_offset_replaces_a_pressure_offset_if_it_explains_the_log_better(
    offset: float, cost: float, *, told: bool
) -> None:
    plain = seen(log(0.2))
    turned: list[float] = []

    def fitted(one: GreyBoxLog) -> Sequence[GreyBoxFit]:
        turned.append(one.speed_offset)
        assert plain.drives[:, 0] - one.drives[:, 0] == pytest.approx(offset)
        return [made_fit(105.0, 2e8, 1e5), made_fit(cost, 2e8, 1e5)]

    high = -offset * DISPLACEMENT / LEAKAGE
    found = {"leakage_coefficient": (LEAKAGE, 1e-13), "pressure_offset": (high, 1e2)}
    assert speed_offset_instead(plain, fitted, found, DISPLACEMENT, 100.0) == pytest.approx(offset if told else 0.0)
    assert turned == pytest.approx([offset])


@pytest.mark.parametrize("share", [0.9, None])
def test_no_speed_offset_is_tried_without_a_pressure_offset_or_if_it_would_be_too_small(
    share: float | None,
) -> None:
    def fitted(_: GreyBoxLog) -> Sequence[GreyBoxFit]:
        raise AssertionError

    found = {"leakage_coefficient": (LEAKAGE, 1e-13)}
    if share is not None:
        found["pressure_offset"] = (share * LEAST_OFFSET * DISPLACEMENT / LEAKAGE, 1e2)
    assert speed_offset_instead(seen(log(0.2)), fitted, found, DISPLACEMENT, 100.0) == 0.0


def turned_by(offset: float) -> float:
    record = log(6.0, 1e-3, WORN, drive="prbs")
    return offset_by_lost_flow(seen(record.replace(**{SPEED: record[SPEED] + offset})), PAPER)


@pytest.mark.parametrize("offset", [-2.5, 2.5])
def test_lost_flow_shows_a_speed_offset(offset: float) -> None:
    assert turned_by(offset) == pytest.approx(offset, rel=0.1)


def test_lost_flow_shows_no_speed_offset_that_is_zero_or_implausibly_large() -> None:
    assert turned_by(0.0) == 0.0
    assert turned_by(2.0 * MOST_SHARE * PAPER.rated_speed) == 0.0


def test_a_dead_pressure_sensor_shows_no_speed_offset() -> None:
    record = log(0.5)
    still = record.replace(differential_pressure_pa=np.zeros_like(record[SPEED]))
    assert offset_by_lost_flow(seen(still), PAPER) == 0.0
