"""An offset of the motor's speed that passed for one of the pressure, by fits that are made up."""

from collections.abc import Sequence

import pytest

from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypothesis_search.pump_ripple_fits import LEAST_OFFSET
from estimation.fits.hypothesis_search.speed_offset import speed_offset_instead
from tests.estimation.fits.short_logs import PAPER, log, made_fit, seen

LEAKAGE, DISPLACEMENT = 5e-11, PAPER.pump_displacement


@pytest.mark.parametrize(("offset", "cost", "told"), [(-2.0, 99.0, True), (2.0, 99.0, True), (-2.0, 101.0, False)])
def test_the_speed_pumps_what_the_pressure_would_leak_if_that_explains_the_log_better(
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
def test_nothing_is_tried_where_no_pressure_offset_was_found_or_the_speed_would_not_be_told(
    share: float | None,
) -> None:
    def fitted(_: GreyBoxLog) -> Sequence[GreyBoxFit]:
        raise AssertionError

    found = {"leakage_coefficient": (LEAKAGE, 1e-13)}
    if share is not None:
        found["pressure_offset"] = (share * LEAST_OFFSET * DISPLACEMENT / LEAKAGE, 1e2)
    assert speed_offset_instead(seen(log(0.2)), fitted, found, DISPLACEMENT, 100.0) == 0.0
