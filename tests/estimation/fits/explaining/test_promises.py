"""What is tried first, by what the slopes promise."""

import pytest

from estimation.fits.explaining.promises import promised, promised_beside, promising
from estimation.fits.flow.search import flow_starts
from estimation.fits.hypotheses import DELIVERY, MAKEUP_BLOCKED, MAY_HIDE, OFFSET
from estimation.models.flow import STIFFNESS
from tests.estimation.fits.short_logs import PAPER, log, seen, wide

FOUND = {**flow_starts(PAPER, PAPER.bulk_modulus)[2], STIFFNESS: 3e7, "case_leakage": 4e-13}
"""What a plain fit may have found [SI]."""


def test_what_slopes_say_nothing_of_is_not_tried_first() -> None:
    likely, others, gains = promising(wide(), (), FOUND, [MAKEUP_BLOCKED, OFFSET])
    assert (likely, others) == ([OFFSET], [MAKEUP_BLOCKED])
    assert gains[OFFSET.name] == pytest.approx(promised_beside(wide().coarsened(), (), FOUND, OFFSET).gain)


def test_behind_a_plain_form_that_explains_a_log_all_that_may_hide_is_tried_by_its_slopes() -> None:
    assert not any(one.far for one in MAY_HIDE)
    assert MAKEUP_BLOCKED.name in [one.name for one in MAY_HIDE]


def test_beside_nothing_a_hypothesis_promises_what_it_does_alone() -> None:
    alone = promised(seen(log(0.5), chamber_volume=0.1), PAPER, FOUND, OFFSET)
    assert promised_beside(wide(), (), FOUND, OFFSET) == pytest.approx(alone, rel=1e-6)


def test_what_is_taken_already_leaves_less_to_tell() -> None:
    known = {**FOUND, "pressure_offset": 1e3}
    alone, beside = (promised_beside(wide(), taken, known, DELIVERY) for taken in ((), (OFFSET,)))
    assert beside.deviation > alone.deviation
