"""Order of trials, by the gain that slopes predict."""

from types import SimpleNamespace

import pytest

from estimation.fits.flow.search import flow_starts
from estimation.fits.greybox import nudges
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypotheses import AIR, DELIVERY, MAKEUP_BLOCKED, MAY_HIDE, OFFSET
from estimation.fits.hypothesis_search import conclusion, predicted_gains
from estimation.fits.hypothesis_search.predicted_gains import by_predicted_gain, predicted_gain, predicted_gain_beside
from estimation.fits.hypothesis_search.wide_log import balances_mass
from estimation.fits.hypothesis_search.wide_problem import hypothesis_problem
from estimation.models.completed_flow import CRACKS
from estimation.models.flow import STIFFNESS
from estimation.models.wide_flow import QUICK_FLOW_FORM, QUICKNESS
from tests.estimation.fits.short_logs import PAPER, at_one_speed, log, lost_in_bias, seen, wide

FOUND = {**flow_starts(PAPER, PAPER.bulk_modulus)[2], STIFFNESS: 3e7, "case_leakage": 4e-13}
"""Possible result of a plain fit [SI]."""


def test_a_hypothesis_that_slopes_do_not_show_is_not_tried_first() -> None:
    likely, others, gains = by_predicted_gain(wide(), (), FOUND, [MAKEUP_BLOCKED, OFFSET])
    assert (likely, others) == ([OFFSET], [MAKEUP_BLOCKED])
    assert gains[OFFSET.name] == pytest.approx(predicted_gain_beside(wide().coarsened(), (), FOUND, OFFSET).gain)


def test_a_hypothesis_that_slopes_do_not_show_is_tried_first_if_there_is_no_other() -> None:
    """A stuck make-up valve beside an offset of speed: with no other to try first, the search ended in an error."""
    likely, others, _ = by_predicted_gain(wide(), (), FOUND, [MAKEUP_BLOCKED])
    assert (likely, others) == ([MAKEUP_BLOCKED], [])


def test_slopes_show_every_hypothesis_that_may_hide_behind_a_plain_fit() -> None:
    assert not any(one.far for one in MAY_HIDE)
    assert MAKEUP_BLOCKED.name in [one.name for one in MAY_HIDE]


def test_the_gain_beside_no_other_hypothesis_is_that_alone() -> None:
    alone = predicted_gain(seen(log(0.5), chamber_volume=0.1), PAPER, FOUND, OFFSET)
    assert predicted_gain_beside(wide(), (), FOUND, OFFSET) == pytest.approx(alone, rel=1e-6)


def test_delivery_is_less_certain_beside_a_pressure_offset() -> None:
    known = {**FOUND, "pressure_offset": 1e3}
    alone, beside = (predicted_gain_beside(wide(), taken, known, DELIVERY) for taken in ((), (OFFSET,)))
    assert beside.deviation > alone.deviation


def test_gains_beside_air_are_predicted_with_the_bubbles_of_the_fit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With isothermal bubbles beside a fit with others, a sound pump was worn at 99 %, by a gain that did not exist."""
    asked = list[object]()

    def noted(*given: object) -> object:
        asked.append(problem := hypothesis_problem(*given))  # type: ignore[arg-type]
        return problem

    monkeypatch.setattr(predicted_gains, "hypothesis_problem", noted)
    predicted_gain_beside(wide(), (AIR,), {**FOUND, "air_softness": 2e3, QUICKNESS: 0.2}, DELIVERY)
    assert all(one.model.rates is QUICK_FLOW_FORM.rates for one in asked)  # type: ignore[attr-defined]
    assert all(QUICKNESS in one.model.unknowns for one in asked)  # type: ignore[attr-defined]


@pytest.mark.parametrize(("by_mass", "freed_last"), [(True, (STIFFNESS,)), (False, ()), (False, (STIFFNESS, *CRACKS))])
def test_the_gain_of_another_delivery_is_predicted_with_the_form_of_the_fit(
    by_mass: bool, freed_last: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the other balance a sound pump was predicted to gain 30,000, and without valve drops that were freed, 208."""
    asked = list[tuple[bool, tuple[object, ...]]]()

    def noted(row: GreyBoxLog, *given: object) -> object:
        asked.append((balances_mass(row), given[3:]))
        return predicted_gains.NO_GAIN

    monkeypatch.setattr(conclusion, "predicted_gain_beside", noted)
    values = {**FOUND, "air_softness": 2e3, **dict.fromkeys(CRACKS, 1e3)}
    values = {name: one for name, one in values.items() if name not in (STIFFNESS, *CRACKS) or name in freed_last}
    best = SimpleNamespace(together=(AIR,), values=values, delays={}, by_mass=by_mass)
    conclusion.delivery_beside(wide(), best)  # type: ignore[arg-type]
    assert asked == [(by_mass, freed_last)]


def test_the_predicted_gain_of_a_worn_pump_at_one_speed_does_not_depend_on_the_slope_step(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Curvature in forward slopes by delivery and flow bias does not cancel, and it looked like information."""
    worn = seen(at_one_speed())
    fine = predicted_gain(worn, PAPER, lost_in_bias(), DELIVERY)
    monkeypatch.setattr(nudges, "NUDGE", 10.0 * nudges.NUDGE)
    assert predicted_gain(worn, PAPER, lost_in_bias(), DELIVERY) == pytest.approx(fine, rel=0.02)


def test_the_predicted_size_has_the_sign_of_the_pressure_offset() -> None:
    pressure = log(0.5)["differential_pressure_pa"]
    low, high = (
        predicted_gain(seen(log(0.5).replace(differential_pressure_pa=pressure + off)), PAPER, FOUND, OFFSET)
        for off in (-3e5, 3e5)
    )
    assert low.size < 0.0 < high.size
