"""Which of two explanations of a log is accepted, and the hint that is given if there is none."""

from types import SimpleNamespace
from typing import Any

import pytest

from estimation.fits.flow import belief
from estimation.fits.flow.belief import judged, likelier_of, nearly_explained
from estimation.fits.flow.log_traits import AT_REST
from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.notes import RigCode
from tests.estimation.fits.short_logs import made_fit


def explanation(name: str, cost: float) -> Explanation:
    return Explanation((name,), {}, {}, (made_fit(cost, 2e8, 1e5),), (), 1e6)


def test_unlike_gauge_gains_are_accepted_only_if_no_other_explanation_is_as_likely() -> None:
    """Tested together with all others, they absorbed 1.8 rad/s of a speed offset of 2 rad/s."""
    offset, gauges = explanation("pressure_offset", 2585.0), explanation("pressure_sides", 2731.0)
    assert likelier_of(offset, gauges) is offset
    assert likelier_of(explanation("delivery", 2731.0), gauges) is not gauges
    assert likelier_of(explanation("delivery", 2731.1), gauges) is gauges
    assert likelier_of(None, gauges) is gauges
    assert likelier_of(offset, None) is offset
    assert likelier_of(None, None) is None


@pytest.mark.parametrize(("chi", "left"), [(1.1, 0.1), (9.0, 8.0), (12.0, None)])
def test_a_hypothesis_that_removes_nearly_all_of_the_misfit_is_hinted_at(chi: float, left: float | None) -> None:
    """`makeup_check_stuck_shut`, validation 25300: a blocked valve left 1.14 of 1100, too much for an explanation."""
    plain: Any = SimpleNamespace(best=made_fit(5e4, 2e8, 1e5, chi=101.0), explains=lambda fit: fit.chi_square[0] < 1.05)
    blocked = Explanation(("makeup_blocked",), {}, {}, (made_fit(1e3, 2e8, 1e5, chi=chi),), (), 1e6)
    said = nearly_explained(plain, blocked)
    assert [one.data["left"] for one in said] == ([] if left is None else [pytest.approx(left)])


def test_a_log_that_the_plain_form_explains_gets_no_hint() -> None:
    plain: Any = SimpleNamespace(best=made_fit(5e4, 2e8, 1e5, chi=1.02), explains=lambda fit: fit.chi_square[0] < 1.05)
    assert nearly_explained(plain, explanation("makeup_blocked", 1e3)) == ()


@pytest.mark.parametrize(
    ("gained", "prior", "chi", "believed"),
    [
        (17.6, 1e-3, 1.0, False),  # 57 % of the rig file's volume, at 15 %: the plain form is likelier
        (50.0, 1e-3, 1.0, True),
        (17.6, 0.5, 1.0, True),
        (17.6, 1e-3, 1.1, True),  # only the other volume explains the log
        (17.6, 1.0, 1.0, True),
    ],
)
def test_another_volume_is_weighed_against_that_of_the_rig_file(
    gained: float, prior: float, chi: float, monkeypatch: pytest.MonkeyPatch, *, believed: bool
) -> None:
    """A ramp of 11 mm under 2 um of noise told 57 +- 8 % of the chambers, with bulk modulus 43 % low."""
    best = made_fit(1e3, 4.9e8, 1e7, chi=chi)
    start = SimpleNamespace(parameters=SimpleNamespace(chamber_volume=2.7e-4))
    plain: Any = SimpleNamespace(best=best, swinging=best, start=start, explains=lambda fit: fit.chi_square[0] < 1.05)
    monkeypatch.setattr(belief, "wanted_cost_in", lambda *_: best.cost - 10.0)
    values = {"chamber_volume": (1.54e-4, 1.2e-5), "bulk_modulus": (2.76e8, 2.6e7)}
    fit = made_fit(best.cost - gained, 2.76e8, 2.6e7)
    other = Explanation(("volume",), values, {}, (fit,), (), 1e6, priors=(prior,))
    found, notes = judged(plain, other, AT_REST, plain.explains)
    assert (found is other) is believed
    assert [note.code for note in notes] == ([] if believed else [RigCode.VOLUME_UNLIKELY])
