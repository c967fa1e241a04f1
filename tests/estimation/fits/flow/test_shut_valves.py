"""Make-up valves that stay shut in a log though sound ones would have opened."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.fits.flow import shut_valves as of_valves
from estimation.fits.flow.log import without_strays
from estimation.fits.flow.log_traits import AT_REST, LogTraits
from estimation.fits.flow.plain import FitStart, Logged, plain_fits
from estimation.fits.flow.shut_valves import LEAST_LEAD, shut_valves
from estimation.fits.greybox.descent import Point
from estimation.fits.hypothesis_search.explain import REQUIRED_GAIN
from estimation.models.completed_flow import CRACKS
from estimation.models.flow import HELD_FLOW_FORM
from estimation.notes import RigCode
from tests.estimation.fits.short_logs import PAPER, WORN, log, made_fit


def fits(makeup: float = 1e-29, std: float = np.inf, held: float = np.inf) -> Any:
    best = made_fit(100.0, 2e8, 1e5)
    values, stds = {**best.values, of_valves.MAKEUP: makeup}, {**best.std, **dict.fromkeys(CRACKS, std)}
    best, other = replace(best, values=values, std=stds), replace(best, model=HELD_FLOW_FORM, cost=held)
    start = SimpleNamespace(parameters=PAPER)
    return SimpleNamespace(best=best, fits=[best, other], start=start, explains=lambda _: True)


@pytest.mark.parametrize(
    ("plain", "traits", "sound", "said"),
    [
        (fits(), AT_REST, 1.1 * REQUIRED_GAIN, [RigCode.MAKEUP_BLOCKED]),
        (fits(), AT_REST, 0.9 * REQUIRED_GAIN, [RigCode.MAKEUP_UNSEEN]),  # the log does not decide
        (fits(std=900.0), AT_REST, 1.1 * REQUIRED_GAIN, []),
        (fits(makeup=1e-8), AT_REST, 1.1 * REQUIRED_GAIN, [RigCode.MAKEUP_UNSEEN]),
        # half as wide as in the rig file is enough for the pump's flow at the inner circuit's pressure; a fifth is not
        (fits(makeup=0.5 * PAPER.makeup_conductance), AT_REST, 1.1 * REQUIRED_GAIN, [RigCode.MAKEUP_UNSEEN]),
        (fits(makeup=0.2 * PAPER.makeup_conductance), AT_REST, 1.1 * REQUIRED_GAIN, [RigCode.MAKEUP_BLOCKED]),
        (fits(held=100.0 + 0.9 * LEAST_LEAD), AT_REST, 1.1 * REQUIRED_GAIN, []),  # a lumped plant has no make-up valves
        (fits(), LogTraits(moving=True), 1.1 * REQUIRED_GAIN, []),
    ],
)
def test_missing_make_up_flow_is_a_stuck_valve_only_if_the_log_contradicts_sound_valves(
    plain: Any, traits: LogTraits, sound: float, said: list[RigCode], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(of_valves, "cost_of_sound_valves", lambda *_: sound)
    notes = shut_valves(plain, traits)
    assert [note.code for note in notes] == said


def test_searches_with_sound_valves_explain_a_sound_log_as_well_as_its_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    record, variances = without_strays(log(2.0))
    plain = plain_fits(Logged(record, variances), FitStart(WORN, WORN.bulk_modulus))
    found, least = plain.best.values[of_valves.MAKEUP], list[float]()
    place, descend = plain.best.model.unknowns.index(of_valves.MAKEUP), of_valves.descend

    def watched(at: Any, begun: Any, evaluations: int, bounds: Any, **told: Any) -> Point:
        least.extend(np.exp([bounds[0][place], begun[place]]).tolist())
        return descend(at, begun, evaluations, bounds, **told)

    monkeypatch.setattr(of_valves, "descend", watched)
    assert of_valves.cost_of_sound_valves(plain, plain.best, found) < 1.0
    assert min(least) == pytest.approx(found, rel=1e-9, abs=0.0)  # no valve narrower than a sound one
