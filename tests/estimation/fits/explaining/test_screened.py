"""Where hypotheses lead in a few steps."""

import pytest

from estimation.fits.explaining import screened as screening
from estimation.fits.explaining.screened import screened
from estimation.fits.explaining.wide_log import widened
from estimation.fits.hypotheses import DELIVERY
from tests.estimation.fits.short_logs import PAPER, at_one_speed, lost_in_bias, seen


def test_a_worn_pump_at_one_speed_is_found_sooner_from_where_the_flow_bias_is_healthy(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    log, plain = widened(seen(at_one_speed()), PAPER), lost_in_bias()
    (from_worn,) = screened(log, (DELIVERY,), [plain])
    monkeypatch.setattr(screening, "worn_start", lambda *_: ())
    (from_sound,) = screened(log, (DELIVERY,), [plain])
    assert from_worn.cost < from_sound.cost - 1.0
