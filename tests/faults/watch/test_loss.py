import numpy as np
import pytest

from faults.watch.loss import (
    ALIKE,
    ALLOWED,
    DELAYS,
    FAST,
    KNOWN,
    LARGEST,
    LAST,
    LEARNT,
    LEAST_LEARNT,
    LIMIT,
    LIVELY,
    OIL,
    OTHERS,
    RATIO,
    RISEN,
    SEEN,
    SHARE,
    SPANS,
    SPREAD,
    WANTED,
    count_lag,
    count_work,
    drive_is_alike,
    judge_loss,
    learn_loss_again,
    loss_threshold,
    measure_lag,
    measure_work,
)

USUAL, SPANS_LEARNT = 0.08, 12


def learnt(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return the learnt state of a circuit that loses 8 %, with noise of 0.2 % in each span."""
    loss, levels = np.zeros(SEEN + 1), np.zeros((512, 2))
    loss[WANTED], loss[LIMIT] = SPANS_LEARNT, loss_threshold(1e-4)
    for now in range(SPANS_LEARNT):
        assert not judge_loss(span(USUAL + 0.002 * rng.standard_normal()), float(now), loss, levels)
    return loss, levels


def span(share: float, other: float | None = None) -> np.ndarray:
    return np.array([share, share if other is None else other, 1.0, 1.0, 1.0, 1.0])


def first_alarm(shares: np.ndarray, others: np.ndarray | None = None) -> int | None:
    rng = np.random.default_rng(1)
    loss, levels = learnt(rng)
    for k, share in enumerate(shares):
        noise = 0.002 * rng.standard_normal()
        told = span(share + noise, None if others is None else others[k] + noise)
        if judge_loss(told, float(SPANS_LEARNT + k), loss, levels):
            return k
    return None


@pytest.mark.parametrize("size", [0.05, 1.0, 30.0])
@pytest.mark.parametrize("place", [FAST, LIVELY])
def test_a_drive_is_like_the_learnt_one_within_a_limiting_ratio(place: int, size: float) -> None:
    loss = np.zeros(SEEN + 1)
    loss[SPANS] = loss[WANTED] = SPANS_LEARNT
    loss[FAST] = loss[LIVELY] = size
    for ratio, alike in ((0.99, True), (1.01, False)):
        for by in (ALIKE * ratio, 1.0 / (ALIKE * ratio)):
            told = np.array([0.1, 0.1, 1.0, 1.0, size, size])
            told[4 if place == FAST else 5] *= by
            assert drive_is_alike(told, loss) is alike


def test_oil_that_thins_by_almost_half_raises_no_alarm_in_a_day() -> None:
    warming = USUAL * (1.0 + 0.95 * (1.0 - np.exp(-np.arange(8640) / 90.0)))
    assert first_alarm(warming) is None


def test_a_leak_that_grows_as_slowly_raises_an_alarm_once_it_has_doubled_the_loss() -> None:
    found = first_alarm(USUAL * (1.0 + np.arange(360) / 90.0))
    assert found is not None
    assert 90 < found < 112


def test_one_or_two_spans_raise_no_alarm() -> None:
    assert first_alarm(np.array([1.0, 1.0, *[USUAL] * 300])) is None
    assert first_alarm(np.full(5, 1.0)) == np.ceil(loss_threshold(1e-4) / (LARGEST - 0.5)) - 1


def test_a_higher_loss_in_only_one_of_two_measures_is_not_a_leak() -> None:
    high, usual = np.full(300, 4.0 * USUAL), np.full(300, USUAL)
    assert first_alarm(high, usual) is None
    assert first_alarm(usual, high) is None
    assert first_alarm(high, high) is not None


def test_after_an_alarm_the_new_loss_is_learnt_as_usual() -> None:
    loss, levels = learnt(np.random.default_rng(2))
    learn_loss_again(loss)
    assert not any(judge_loss(span(0.4), float(now), loss, levels) for now in range(200))
    assert loss[SHARE] == pytest.approx(0.4)
    assert loss[SPANS] == LEARNT


def test_a_jump_of_the_loss_hardly_widens_the_learnt_spread() -> None:
    loss, levels = learnt(np.random.default_rng(3))
    loss[KNOWN] = 100.0
    before = loss.copy()
    judge_loss(span(0.5), 50.0, loss, levels)
    assert loss[SEEN] == before[SEEN] + 1.0
    assert loss[KNOWN] == 101.0
    assert loss[9] < 1.1 * before[9]


def test_white_noise_exceeds_the_loss_threshold_at_the_requested_rate() -> None:
    rng, expected = np.random.default_rng(4), 0.01
    limit, sums, passed, spans = loss_threshold(expected), np.zeros(2000), 0, 1500
    for _ in range(spans):
        sums = np.maximum(0.0, sums + rng.standard_normal(2000) - 0.5)
        passed += int((sums > limit).sum())
        sums[sums > limit] = 0.0
    assert passed / (2000 * spans) == pytest.approx(expected, rel=0.1)


def test_compression_of_oil_does_not_count_as_lost_flow() -> None:
    work, told = np.zeros(5), np.zeros(6)
    phase = 2.0 * np.pi * np.arange(2000) / 100.0
    for w, p, rate in zip(np.sin(phase), np.sin(phase + 0.6), np.cos(phase + 0.6), strict=True):
        count_work(w, w - 0.1 * p - 0.3 * rate, p, work)
    measure_work(work, told)
    assert told[1] == pytest.approx(0.1, rel=1e-6)
    assert told[2] * told[1] == pytest.approx(told[0], rel=1e-9)


def test_a_span_at_rest_gives_no_valid_measurement() -> None:
    told = np.ones(6)
    measure_work(np.zeros(5), told)
    assert told[3] == 0.0
    told[3] = 1.0
    measure_lag(np.zeros((DELAYS + 2, DELAYS + 2)), np.zeros(DELAYS + 2), told)
    assert told[3] == 0.0


def lagging(speed: np.ndarray, lost: float) -> np.ndarray:
    """Return the measurements over a span of a piston that loses a share of its speed and follows with a lag."""
    speeds, lag, moment, told = (
        np.zeros((2, DELAYS + 2)),
        np.zeros((DELAYS + 2, DELAYS + 2)),
        np.zeros(DELAYS + 2),
        None,
    )
    velocity = 0.0
    for k, w in enumerate(speed):
        velocity += 0.5 * ((1.0 - lost) * w - velocity)
        count_lag(w, velocity, k > DELAYS, speeds, lag, moment)
    told = np.zeros(6)
    measure_lag(lag, moment, told)
    return told


@pytest.mark.parametrize("lost", [0.0, 0.05, 0.3])
def test_random_reversals_distinguish_lost_speed_from_lag(lost: float) -> None:
    reversals = np.repeat(np.random.default_rng(5).choice((-1.0, 1.0), 200), 10)
    told = lagging(reversals, lost)
    assert told[3] == 1.0
    assert told[0] == pytest.approx(lost, abs=1e-3)
    assert told[2] * told[1] == pytest.approx(lost, abs=1e-3)


def test_a_sine_does_not_distinguish_lost_speed_from_lag() -> None:
    assert lagging(np.sin(2.0 * np.pi * np.arange(2000) / 200.0), 0.2)[3] == 0.0


def test_another_drive_is_left_out_and_learnt_if_it_persists() -> None:
    loss, _ = learnt(np.random.default_rng(6))
    other = span(0.5)
    other[5] = 1.1 * ALIKE
    assert drive_is_alike(span(0.5), loss)
    assert not drive_is_alike(other, loss)
    assert drive_is_alike(span(0.5), loss)
    assert loss[OTHERS] == 0.0
    assert not any(drive_is_alike(other, loss) for _ in range(int(LEARNT)))
    assert loss[SPANS] == 0.0
    assert drive_is_alike(other, loss)


@pytest.mark.parametrize("known", [LEAST_LEARNT - 1.0, LEAST_LEARNT])
def test_the_score_of_a_span_is_its_excess_over_warm_oil_in_standard_deviations(known: float) -> None:
    loss, levels = np.zeros(SEEN + 1), np.zeros((4, 2))
    state = {SPANS: 12.0, WANTED: 12.0, SHARE: 0.08, RATIO: 1.0, SPREAD: 4e-4, KNOWN: known, SEEN: 20.0, LAST: 0.08}
    for place, value in {**state, RISEN: 0.5, LIMIT: 7.0}.items():
        loss[place] = value
    assert not judge_loss(span(0.2), 33.0, loss, levels)
    apart = 0.5 * (0.2 - 0.08) ** 2  # half the squared difference of two values estimates the variance of one
    if known >= LEAST_LEARNT:
        apart = min(apart, 9.0 * 4e-4)
    spread = 4e-4 + (apart - 4e-4) / (known + 1.0)
    assert loss[SPREAD] == pytest.approx(spread)
    deviation = np.sqrt(spread) * (1.0 + 2.0 / np.sqrt(known + 2.0))  # the spread is itself an estimate
    score = min((0.2 - 0.08 - (OIL - 1.0) * 0.08) / deviation, LARGEST)
    assert loss[RISEN] == pytest.approx(0.5 + score - ALLOWED)
    assert levels[20 % 4].tolist() == [0.2, 33.0]
    assert (loss[LAST], loss[SEEN], loss[KNOWN]) == (0.2, 21.0, known + 1.0)


def test_a_span_at_rest_keeps_the_values_of_the_last_one() -> None:
    told = np.array([0.1, 0.2, 0.3, 1.0, 0.4, 0.5])
    measure_lag(np.zeros((DELAYS + 2, DELAYS + 2)), np.zeros(DELAYS + 2), told)
    assert told.tolist() == [0.1, 0.2, 0.3, 0.0, 0.4, 0.5]


def test_lost_speed_is_measured_even_with_a_drive_of_small_amplitude() -> None:
    reversals = 0.01 * np.repeat(np.random.default_rng(5).choice((-1.0, 1.0), 200), 10)
    told = lagging(reversals, 0.05)
    assert told[3] == 1.0
    assert told[0] == pytest.approx(0.05, abs=1e-3)
