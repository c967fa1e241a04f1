"""When pump ripple is included, corrected and left, by made-up fits."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from estimation.fits.flow import asked_hypotheses
from estimation.fits.flow import fit as flow_fit
from estimation.fits.flow import plain as plain_flow
from estimation.fits.flow.asked_hypotheses import ALWAYS_ASKED
from estimation.fits.flow.fit import fit_flow
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.pump_ripple import MOST_OFFSET, TOOTH_COUNTS, Ripple, ShownOffset, ShownRipple
from estimation.fits.hypothesis_search.predicted_gains import PredictedGain
from estimation.fits.hypothesis_search.pump_ripple_fits import (
    BY_CHANCE,
    CHANCE,
    KEPT_GAIN,
    LEAST_OFFSET,
    LEAST_TEETH,
    MOST_LINEAR,
    MOST_TEETH,
    OFFSET_SETTLED,
    OFFSET_WORTH,
    ONE_SIDED_95,
    OVERTONE_WORTH,
    ROUNDS,
    SETTLED,
    STANDS_OUT,
    SURE_SHARE,
    SURELY_WORTH,
    TEETH_WORTH,
    RippleFits,
    with_pump_ripple,
)
from estimation.notes import EstimateCode, RigCode
from plant.arrays import Array
from plant.notes import Note
from tests.estimation.fits.short_logs import PAPER, log, made_fit, noted, seen


def shown(count: int, gain: float, size: float = 0.1, offset: float = 0.0, beside: float | None = None) -> ShownRipple:
    one = ShownRipple(Ripple(count, size, 0.0), gain, 0.01, np.zeros(2), offset, 1e-3)
    return one._replace(beside=gain if beside is None else beside)


def fit(cost: float, *teeth: ShownRipple, off: tuple[float, float] = (0.0, 0.0)) -> GreyBoxFit:
    offset = ShownOffset(*off, 2e-3, np.zeros(2))
    return replace(made_fit(cost, 2e8, 1e5), teeth={one.teeth.count: one for one in teeth}, speed_offset=offset)


Asked = tuple[tuple[int, ...], tuple[int, ...]]


def told(*fits: GreyBoxFit) -> tuple[Callable[[GreyBoxLog], Sequence[GreyBoxFit]], list[Asked]]:
    """Return a function that returns the fits in turn, and the tooth counts that each log tests and includes."""
    asked: list[Asked] = []

    def fitted(one: GreyBoxLog) -> Sequence[GreyBoxFit]:
        asked.append((one.counts, tuple(each.count for each in one.teeth)))
        return [fits[len(asked) - 1]]

    return fitted, asked


PLAIN = seen(log(0.2))


def well(_: GreyBoxFit) -> bool:
    return True


def test_ripple_is_included_only_if_it_explains_the_log() -> None:
    for explained, size in ((True, 0.1), (False, 0.1), (True, 0.01)):  # small ripple too, if it is needed
        fitted, _ = told(fit(500.0, shown(12, 200.0, size)), fit(300.0, shown(12, 0.0)))
        found = with_pump_ripple(PLAIN, fitted, lambda one, said=explained: said and one.cost == 300.0)
        assert bool(found.remarks) is explained
        assert bool(found.left) is not explained


def test_ripple_is_corrected_until_none_remains() -> None:
    rounds = [fit(500.0, shown(12, 200.0, 0.10)), fit(300.0, shown(12, 5.0, 0.02)), fit(290.0, shown(12, 0.1, 0.001))]
    fitted, asked = told(*rounds)
    found = with_pump_ripple(PLAIN, fitted, well)
    assert asked == [(TOOTH_COUNTS, ()), ((12, 24), (12,)), ((12, 24), (12,))]
    assert found.fits[0].cost == 290.0
    assert noted(found.remarks) == [
        {
            "code": "pump_ripples",
            "percent": pytest.approx(12.0),
            "half_width": pytest.approx(1.96, abs=0.01),
            "teeth": 12,
        }
    ]
    assert not found.left
    assert not np.array_equal(found.log.drives, PLAIN.drives)


@pytest.mark.parametrize(("chi", "hopeless"), [(2.0, False), (1.2, False), (3.0, True)])
@pytest.mark.parametrize("by_offset", [True, False])
def test_a_log_that_neither_ripple_nor_an_offset_can_explain_is_fitted_once(
    chi: float, hopeless: bool, by_offset: bool
) -> None:
    # its cost of 1000 must fall by 500 at a residual of 2, and by 667 at 3; a predicted 60 may gain ten times that
    off = (0.5, 60.0) if by_offset else (0.0, 0.0)
    teeth = () if by_offset else (shown(12, 60.0),)
    first = replace(fit(1000.0, *teeth, off=off), chi_square=(chi,))
    fitted, asked = told(first, *(fit(900.0, shown(12, 0.0)) for _ in range(9)))
    found = with_pump_ripple(PLAIN, fitted, well, 1.2 if chi < 3.0 else 1.0)
    assert (len(asked) == 1) is hopeless
    assert hopeless is not bool(found.remarks)
    assert bool(found.left) is (hopeless and not by_offset)


def test_ripple_corrections_end_after_a_fixed_number_of_rounds() -> None:
    fitted, asked = told(fit(500.0, shown(12, 200.0)), *(fit(300.0, shown(12, SETTLED + 0.1, 0.01)) for _ in range(9)))
    with_pump_ripple(PLAIN, fitted, well)
    assert len(asked) == 1 + ROUNDS


@pytest.mark.parametrize(
    ("teeth", "wanted"),
    [
        ([shown(12, TEETH_WORTH + 0.1)], True),
        ([shown(12, TEETH_WORTH - 0.1)], False),
        ([shown(12, 50.0, LEAST_TEETH + 0.001)], True),
        ([shown(12, 50.0, LEAST_TEETH - 0.001)], False),
        ([shown(12, 50.0), shown(13, BY_CHANCE + 39.9 / STANDS_OUT)], True),
        ([shown(12, 50.0), shown(13, 40.0, beside=BY_CHANCE + 39.9 / STANDS_OUT)], True),
        ([shown(12, 50.0), shown(13, BY_CHANCE + 40.1 / STANDS_OUT)], False),
        ([shown(13, 1.0), shown(12, 50.0), shown(6, 49.0)], True),  # 12 is an overtone of 6
        ([shown(6, 50.0), shown(12, 49.0)], True),
        ([shown(12, 50.0), shown(18, 49.0)], False),
        ([], False),
    ],
)
def test_ripple_is_tested_by_gain_and_amplitude_if_no_other_tooth_count_does_as_well(
    teeth: list[ShownRipple], wanted: bool
) -> None:
    settled = [fit(100.0, *(shown(one.teeth.count, 0.0) for one in teeth)) for _ in range(2)]
    fitted, asked = told(fit(500.0, *teeth), *settled)
    found = with_pump_ripple(PLAIN, fitted, well)
    assert bool(found.remarks) is wanted
    assert len(asked) == 1 + wanted


def test_an_overtone_is_included_only_if_it_gains_enough() -> None:
    for gain, held in ((OVERTONE_WORTH + 0.1, (12, 24)), (OVERTONE_WORTH - 0.1, (12,))):
        rounds = fit(300.0, shown(12, 0.0), shown(24, gain, 0.05)), fit(290.0, shown(12, 0.0), shown(24, 0.0))
        found = with_pump_ripple(PLAIN, told(fit(500.0, shown(12, 200.0)), *rounds)[0], well)
        assert tuple(one.count for one in found.log.teeth) == held


def left(notes: Sequence[Note]) -> list[tuple[object, object, object]]:
    return [(note.code, note.data["teeth"], note.data["percent"]) for note in notes]


def test_ripple_that_gains_too_little_or_does_not_stand_out_is_reported_as_left() -> None:
    useless, _ = told(fit(500.0, shown(12, 200.0)), fit(500.0 - TEETH_WORTH + 0.1, shown(12, 0.0)))
    useful, _ = told(fit(500.0, shown(12, 200.0)), fit(500.0 - TEETH_WORTH - 0.1, shown(12, 0.0)))
    several, _ = told(fit(500.0, shown(12, 50.0), shown(13, 40.0)))
    unfelt, _ = told(fit(500.0, shown(12, 200.0)), fit(100.0))
    for fitted in (useless, several, unfelt):
        found = with_pump_ripple(PLAIN, fitted, well)
        assert left(found.left) == [(EstimateCode.TEETH_LEFT, 12, pytest.approx(10.0))]
        assert not found.remarks
        assert found.log is PLAIN
    assert not with_pump_ripple(PLAIN, useful, well).left
    assert not with_pump_ripple(PLAIN, told(fit(500.0, shown(12, 9.0), shown(13, 8.0)))[0], well).left


def test_ripple_that_may_be_small_is_reported_as_left_only_if_it_shifts_bulk_modulus() -> None:
    def doubted(size: float, moved: float, offset: float = 0.0, gain: float = 50.0) -> bool:
        rivals = fit(500.0, shown(12, gain, size, offset), shown(13, gain - 5.0), off=(offset, 0.0))
        felt = rivals.std["bulk_modulus"] / rivals.values["bulk_modulus"] * moved
        fitted, _ = told(replace(rivals, small_teeth=({"bulk_modulus": felt}, {"bulk_modulus": 0.0})))
        return bool(with_pump_ripple(PLAIN, fitted, well).left)

    most = LEAST_TEETH + 0.01 * ONE_SIDED_95  # the deviation of the ripple is 0.01
    assert [doubted(most - 1e-4, MOST_LINEAR + by) for by in (0.01, -0.01)] == [True, False]
    assert doubted(most + 1e-4, MOST_LINEAR - 0.01)
    assert doubted(most - 1e-4, 0.0, offset=0.1)
    assert [doubted(most + 1e-4, 0.0, gain=SURELY_WORTH + by) for by in (0.1, -0.1)] == [True, False]  # chance
    assert not doubted(LEAST_TEETH - 1e-4, MOST_LINEAR + 0.01)


def test_ripple_larger_than_that_of_any_pump_is_reported_as_left() -> None:
    for at_first, more, left_over in ((MOST_TEETH + 0.01, 0.0, True), (0.3, 0.12, True), (0.3, 0.08, False)):
        first = fit(500.0, shown(12, 200.0, at_first))
        fitted, asked = told(first, fit(300.0, shown(12, 5.0, more)), fit(290.0, shown(12, 0.0, 0.0)))
        found = with_pump_ripple(PLAIN, fitted, well)
        assert bool(found.left) is left_over
        assert bool(found.remarks) is not left_over
        assert len(asked) == (1 if at_first > MOST_TEETH else 2 if left_over else 3)


def test_ripple_is_not_tested_in_a_log_with_gaps_in_speed() -> None:
    fitted, asked = told(fit(500.0, shown(12, 200.0)))
    holey = replace(PLAIN, gaps=np.array([[3.0, 9.0, 1.0]]))
    assert with_pump_ripple(holey, fitted, well).log is holey
    assert asked == [((), ())]


@pytest.mark.parametrize(("chi", "code"), [(1.0, "TEETH_LEFT"), (2.0, "PRESSURE_RESIDUALS_LARGE")])
def test_remaining_ripple_shuts_the_gate_if_nothing_else_does(
    monkeypatch: pytest.MonkeyPatch, chi: float, code: str
) -> None:
    shows = replace(fit(500.0, shown(12, 50.0), shown(13, 40.0)), chi_square=(chi,))
    monkeypatch.setattr(plain_flow, "balance_fits", lambda *_, **__: [shows])
    monkeypatch.setattr(flow_fit, "with_implicit_steps", lambda _: None)
    wear = (RigCode.WEAR_NOT_EXCLUDED.note(percent=3.0),)
    monkeypatch.setattr(flow_fit, "hypotheses_asked", lambda *_, **__: ((), wear))
    found = fit_flow(log(0.2), PAPER, PAPER.bulk_modulus)
    assert [note.code.name for note in found.reasons] == [code]
    assert [note.code for note in found.remarks] == [RigCode.WEAR_NOT_EXCLUDED]


def test_a_sound_log_has_no_remaining_ripple(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plain_flow, "balance_fits", lambda *_, **__: [fit(500.0, shown(12, 3.0))])
    gains = len(ALWAYS_ASKED) * [PredictedGain(0.0, 0.0, 0.01)]
    monkeypatch.setattr(asked_hypotheses, "predicted_gains", lambda *_, **__: gains)
    found = fit_flow(log(0.2), PAPER, PAPER.bulk_modulus)
    assert not found.reasons
    assert not found.remarks


def test_the_limits_for_ripple_have_their_stated_rates_of_false_alarms() -> None:
    """Twice the gain of a cosine and a sine is chi-square distributed with two degrees of freedom."""
    assert np.exp(TEETH_WORTH) / len(TOOTH_COUNTS) == pytest.approx(1500.0, rel=0.03)
    assert np.exp(OVERTONE_WORTH) == pytest.approx(150.0, rel=0.02)


def subtracted(found: RippleFits) -> Array:
    return PLAIN.drives[:, 0] - found.log.drives[:, 0]


def test_a_speed_offset_is_subtracted_corrected_and_reported_if_this_explains_the_log() -> None:
    rounds = [
        fit(900.0, off=(0.2, 500.0)),
        fit(420.0, off=(0.04, 2.0 * OFFSET_SETTLED)),
        fit(410.0, off=(0.01, 0.9 * OFFSET_SETTLED)),
    ]
    fitted, asked = told(*rounds)
    found = with_pump_ripple(PLAIN, fitted, lambda one: one.cost < 900.0)
    assert asked == 3 * [(TOOTH_COUNTS, ())]
    assert subtracted(found) == pytest.approx(0.24)
    assert found.log.speed_offset == pytest.approx(0.24)
    assert not found.log.counts  # hypotheses on this log do not test for ripple again
    assert found.best.cost == 410.0
    assert noted(found.remarks) == [
        {
            "code": "speed_offset",
            "offset_rad_s": pytest.approx(0.24),
            "half_width": pytest.approx(1.96 * 2e-3, rel=1e-3),
        }
    ]


@pytest.mark.parametrize(
    ("rounds", "explained"),
    [
        ([fit(900.0, off=(0.2, OFFSET_WORTH - 0.1))], True),
        ([fit(900.0, off=(1.01 * MOST_OFFSET, 500.0))], True),
        ([fit(900.0, off=(0.2, 500.0)), fit(900.0 - KEPT_GAIN * 500.0 + 0.1)], True),
        ([fit(900.0, off=(0.2, 500.0)), fit(900.0 - KEPT_GAIN * 500.0 - 0.1)], False),
    ],
)
def test_an_offset_that_gains_too_little_or_leaves_the_log_unexplained_is_not_subtracted(
    rounds: list[GreyBoxFit], *, explained: bool
) -> None:
    found = with_pump_ripple(PLAIN, told(*rounds)[0], lambda _: explained)
    assert found.log is PLAIN
    assert found.best.cost == 900.0
    assert not found.remarks


def test_an_offset_that_leaves_residuals_above_sensor_noise_is_not_subtracted() -> None:
    """A single rod looks like an offset, and its log passed with bulk modulus 39 % too low."""
    most = SURE_SHARE * 0.2 + CHANCE * np.sqrt(2.0 / len(PLAIN.drives))
    for left, taken in ((0.95 * most, True), (1.05 * most, False)):
        after = replace(fit(400.0), chi_square=(1.0 + left,))
        found = with_pump_ripple(PLAIN, told(fit(900.0, off=(0.2, 500.0)), after)[0], well, 1.2)
        assert bool(found.remarks) is taken


def test_the_offset_is_that_of_the_balance_that_is_likeliest_with_its_own_offset() -> None:
    fits = [[fit(900.0, off=(0.2, 500.0))], [fit(400.0), fit(405.0, off=(0.05, 50.0))], [fit(410.0), fit(355.0)]]
    found = with_pump_ripple(PLAIN, lambda _: fits.pop(0), well)
    assert subtracted(found) == pytest.approx(0.25)
    assert found.best.cost == 355.0


@pytest.mark.parametrize("left", [0.9 * OFFSET_SETTLED, 1.1 * OFFSET_SETTLED])
def test_a_first_guess_of_the_offset_is_corrected_and_reported_whatever_its_size(left: float) -> None:
    settled = left < OFFSET_SETTLED
    fitted, asked = told(fit(420.0, off=(0.04, left)), fit(419.0))
    found = with_pump_ripple(PLAIN, fitted, well, offset=3.0 * MOST_OFFSET)
    assert len(asked) == (1 if settled else 2)
    offset = 3.0 * MOST_OFFSET + (0.0 if settled else 0.04)
    assert subtracted(found) == pytest.approx(offset)
    (note,) = found.remarks
    assert note.data["offset_rad_s"] == found.log.speed_offset == pytest.approx(offset)


def test_a_small_offset_is_subtracted_and_not_reported() -> None:
    for size, said in ((0.9 * LEAST_OFFSET, False), (1.1 * LEAST_OFFSET, True)):
        found = with_pump_ripple(PLAIN, told(fit(900.0, off=(size, 500.0)), fit(400.0))[0], well)
        assert subtracted(found) == pytest.approx(size)
        assert bool(found.remarks) is said


def test_ripple_is_tested_after_the_offset_is_subtracted_and_corrects_the_offset() -> None:
    rounds = [
        fit(9000.0, off=(0.2, 8000.0)),
        fit(600.0, shown(12, 90.0, 0.1, 0.03)),
        fit(500.0, shown(12, 5.0, 0.02, 0.01)),
        fit(490.0, shown(12, 0.0, 0.0, 0.0)),
    ]
    fitted, asked = told(*rounds)
    found = with_pump_ripple(PLAIN, fitted, lambda one: one.cost < 600.0)
    assert asked == [(TOOTH_COUNTS, ()), (TOOTH_COUNTS, ()), ((12, 24), (12,)), ((12, 24), (12,))]
    assert found.log.speed_offset == pytest.approx(0.24)
    assert noted(found.remarks)[1] == {
        "code": "speed_offset",
        "offset_rad_s": pytest.approx(0.24),
        "half_width": pytest.approx(1.96e-3, rel=1e-3),
    }


def test_small_ripple_is_included_if_it_shows_a_speed_offset() -> None:
    for offset, wanted in ((0.1, True), (0.0, False)):
        one = shown(12, 60.0, 0.5 * LEAST_TEETH, offset)
        fits = fit(900.0, one, off=(offset, 0.0)), fit(800.0, shown(12, 0.0))
        assert bool(with_pump_ripple(PLAIN, told(*fits)[0], well).remarks) is wanted


def test_overtones_are_tested_once_the_ripple_has_settled_and_dropped_if_they_gain_nothing() -> None:
    rounds = [
        fit(900.0, shown(12, 200.0)),
        fit(700.0, shown(12, OVERTONE_WORTH + 0.1), shown(24, 50.0)),
        fit(690.0, shown(12, 0.0), shown(24, 50.0)),
        fit(695.0, shown(12, 0.0), shown(24, 0.0)),
    ]
    fitted, asked = told(*rounds)
    found = with_pump_ripple(PLAIN, fitted, well)
    assert [held for _, held in asked] == [(), (12,), (12,), (12, 24)]
    assert (found.best.cost, len(found.log.teeth)) == (690.0, 1)
