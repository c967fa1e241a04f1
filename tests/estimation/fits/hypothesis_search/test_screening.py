"""Where searches of hypotheses arrive after a few steps."""

from types import SimpleNamespace
from typing import Any

import pytest

from estimation.fits.hypotheses import DELIVERY, VOLUME
from estimation.fits.hypothesis_search import screening
from estimation.fits.hypothesis_search.coarse_search import SLIGHT
from estimation.fits.hypothesis_search.screening import screen, screened_hypotheses
from estimation.fits.hypothesis_search.wide_log import widened_log
from estimation.models.flow import STIFFNESS
from tests.estimation.fits.short_logs import PAPER, at_one_speed, lost_in_bias, seen


def test_a_worn_pump_at_one_speed_is_found_sooner_from_a_start_with_healthy_flow_bias(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    log, plain = (
        widened_log(seen(at_one_speed()), PAPER, {STIFFNESS: 1.0}),
        lost_in_bias(),
    )  # practically no accumulator
    (from_worn,) = screen(log, (DELIVERY,), [plain])
    monkeypatch.setattr(screening, "worn_start", lambda *_: ())
    (from_sound,) = screen(log, (DELIVERY,), [plain])
    assert from_worn.cost < from_sound.cost - 1.0


def test_a_screening_ends_once_a_step_predicts_less_than_the_error_of_long_steps(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    log, descend_in_turn = widened_log(seen(at_one_speed()), PAPER), screening.descend_in_turn
    counted: list[int] = []

    def counting(ways: Any, *given: Any, **options: Any) -> Any:
        (way,) = ways
        counted.append(0)

        def once_more(thetas: Any) -> Any:
            counted[-1] += len(thetas)
            return way.at_each(thetas)

        assert options["least_share"] == SLIGHT
        return descend_in_turn([way._replace(at_each=once_more)], *given, **options)

    monkeypatch.setattr(screening, "descend_in_turn", counting)
    (near,) = screen(log, (VOLUME,), [lost_in_bias()])
    (again,) = screen(log, (VOLUME,), [near.values])
    assert counted[-1] < counted[0] <= screening.SCREENING
    assert again.cost > (1.0 - 2.0 * SLIGHT) * near.cost


@pytest.mark.parametrize(("lowest", "begun"), [(90.0, ["b"]), (110.0, ["a", "c"])])
def test_other_hypotheses_begin_at_the_start_from_which_a_far_one_reached_the_lowest_cost(
    lowest: float, begun: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Any] = []

    def from_starts(_: Any, __: Any, starts: Any, *___: Any) -> Any:
        asked.append(starts)
        return [SimpleNamespace(cost=lowest if start == "b" else 900.0) for start in starts]

    monkeypatch.setattr(screening, "screen", from_starts)
    far, some = (SimpleNamespace(far=far) for far in (True, False))
    starts: Any = ["a", "b", "c"]
    nothing: Any = None
    assert len([*screened_hypotheses(nothing, [some, far], starts, ["a", "c"], 100.0, 2)]) == 2  # pyright: ignore[reportArgumentType]
    assert asked == [starts, begun]
