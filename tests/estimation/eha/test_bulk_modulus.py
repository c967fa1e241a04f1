"""Bulk modulus is recovered from simulated and from foreign logs, or the outcome says why it cannot be."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from estimation.eha.bulk_modulus import estimate_bulk_modulus
from estimation.eha.result import BulkModulusEstimate
from estimation.finding import OUTCOMES, Outcome
from estimation.log_checks.first_belief import first_belief
from estimation.models.eha_forms import PRESSURE_FORM
from estimation.notes import EstimateCode, SensorCode
from faults.conditions import CONDITIONS, Condition, parameters_for
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import PLANTS, simulate
from plant.errors import HydrostateError, LogError, LogWarning
from plant.log.files import read_record
from plant.log.record import Record
from plant.sensors.faults import SensorFault, with_fault
from plant.sensors.sensors import BENCH
from tests.thinned import thinned

TRUTH = 2.07e8
STARTS = (0.0, 2e8, 5e8)
SPARSE = 5e-4  # s; fine enough for a form that takes its own steps between samples
WIDE_STARTS = (0.0, 0.5e8, 1e8, 2e8, 3e8, 4e8, 5e8)
TWO = ("major_friction", "minor_leakage_minor_friction")
EVERY_CONDITION = pytest.mark.parametrize("name", thinned(CONDITIONS, TWO))
TWO_CONDITIONS = pytest.mark.parametrize("name", TWO)
"""The slow suite tests all conditions, from more starts, in `test_every_start_of_the_study_converges`."""


@cache
def bench_log(plant: str, drive: str, name: str, seed: int = 1, sample_time: float = 1e-4) -> Record:
    """Return five seconds measured with the sensors of the bench."""
    parameters, rng = parameters_for(CONDITIONS[name]), np.random.default_rng(seed)
    speed = make_drive(drive, 5.0, sample_time, parameters, rng)
    return simulate(PLANTS[plant], speed, sample_time, parameters, sensors=BENCH, rng=rng)


def found(record: Record, name: str, form: str, start: float) -> BulkModulusEstimate:
    return estimate_bulk_modulus(record, parameters_for(CONDITIONS[name]), form=form, start=start)


def largest_error(record: Record, name: str, form: str, starts: tuple[float, ...] = STARTS) -> float:
    """Return the relative error of the worst start; infinite if one gives no number."""
    values = [found(record, name, form, start).value for start in starts]
    return max(np.inf if value is None else abs(value / TRUTH - 1.0) for value in values)


def without_pressure(record: Record) -> Record:
    return record.replace(differential_pressure_pa=None)


@TWO_CONDITIONS
def test_the_published_form_converges_on_the_plant_that_it_assumes(name: str) -> None:
    assert largest_error(bench_log("reduced", "sine", name), name, "acceleration") < 0.03


@TWO_CONDITIONS
@pytest.mark.parametrize("drive", ["sine", "steps"])
def test_the_pressure_form_with_pressure_logged_converges_to_one_percent(drive: str, name: str) -> None:
    assert largest_error(bench_log("lumped", drive, name, sample_time=SPARSE), name, "pressure") < 0.01


@TWO_CONDITIONS
def test_the_pressure_form_without_pressure_converges_to_three_percent_on_steps(name: str) -> None:
    assert largest_error(without_pressure(bench_log("lumped", "steps", name)), name, "pressure") < 0.03


@EVERY_CONDITION
def test_the_papers_sine_without_pressure_gives_no_number(name: str) -> None:
    log = without_pressure(bench_log("lumped", "sine", name, sample_time=SPARSE))
    for start in STARTS:
        answer = found(log, name, "auto", start)
        assert answer.outcome is Outcome.NOT_OBSERVABLE  # errata E13
        assert answer.value is answer.std is answer.interval is None
        assert answer.bound > 0.03
        assert answer.gate.reasons[0].code == EstimateCode.BOUND_TOO_WIDE
        assert answer.gate.reasons[0].data["percent"] == pytest.approx(100.0 * min(answer.bound, 9.99))


def test_the_published_form_fails_on_a_plant_that_sticks() -> None:
    errors: list[float] = []
    for name in CONDITIONS:
        answer = found(bench_log("lumped", "sine", name), name, "acceleration", 2e8)
        assert answer.estimate is not None
        errors.append(abs(answer.estimate.settled("bulk_modulus_pa")[0] / TRUTH - 1.0))
        assert not answer.gate.passed
    assert sum(error > 0.2 for error in errors) >= 8  # errata E9


def test_the_interval_is_the_value_and_two_deviations() -> None:
    answer = found(bench_log("lumped", "steps", "normal"), "normal", "pressure", 2e8)
    assert answer.value is not None
    assert answer.std is not None
    low, high = answer.interval or (0.0, 0.0)
    assert low < TRUTH < high
    assert high - low == pytest.approx(3.92 * answer.std, rel=1e-3)
    assert (answer.form, answer.outcome, answer.gate.passed) == ("pressure", Outcome.OK, True)


def test_filterpy_gives_the_same_number() -> None:
    log, parameters = bench_log("lumped", "steps", "normal").slice(0, 1_000), EhaParameters()
    ours, theirs = (
        estimate_bulk_modulus(log, parameters, form="pressure", method=method, start=1e8)
        for method in ("ekf", "filterpy-ekf")
    )
    assert ours.outcome is theirs.outcome is Outcome.OK
    assert theirs.value == pytest.approx(ours.value, rel=1e-9)
    assert theirs.bound == ours.bound


def test_position_alone_is_enough_on_steps() -> None:
    log = without_pressure(bench_log("lumped", "steps", "normal")).replace(velocity_m_s=None)
    assert largest_error(log, "normal", "pressure", (2e8,)) < 0.03


def test_a_log_without_motion_is_refused() -> None:
    log = without_pressure(bench_log("lumped", "steps", "normal")).replace(velocity_m_s=None, position_m=None)
    with pytest.raises(LogError, match="needs position_m or velocity_m_s"):
        estimate_bulk_modulus(log, EhaParameters())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"form": "viscous"}, "form must be one of acceleration, pressure.*, got 'viscous'"),
        ({"method": "ukf9", "form": "pressure"}, "method must be one of auto, ekf, .*filterpy-ekf.*, got 'ukf9'"),
        ({"start": -1.0}, "first guess must be 0 Pa or more"),
        ({"start": float("nan")}, "first guess must be 0 Pa or more"),
        ({"start_std": 0.0}, "its deviation positive"),
    ],
)
def test_invalid_options_are_refused_with_a_message(options: dict[str, object], message: str) -> None:
    log = bench_log("lumped", "steps", "normal").slice(0, 100)
    with pytest.raises(HydrostateError, match=message):
        estimate_bulk_modulus(log, EhaParameters(), **options)


def test_the_first_belief_begins_at_the_first_position_sample_that_is_not_missing() -> None:
    log = Record(1e-3, {"motor_speed_rad_s": np.zeros(3), "position_m": np.array([np.nan, 0.02, 0.03])})
    belief = first_belief(PRESSURE_FORM, log, 1e8, 3e8)
    assert belief.mean.tolist() == [0.02, 0.0, 0.0, 1e8]
    assert belief.std[3] == pytest.approx(3e8)


def test_every_outcome_is_explained() -> None:
    assert set(OUTCOMES) == set(Outcome)
    assert all(sentence.endswith(".") for sentence in OUTCOMES.values())


@cache
def foreign_logs(folder: Path) -> list[tuple[Record, Condition, float]]:
    truth = pd.read_csv(folder / "bench" / "truth.csv")
    by_levels = {(condition.leakage, condition.friction): condition for condition in CONDITIONS.values()}
    return [
        (read_record(folder / "bench" / str(file)), by_levels[leakage, friction], float(bulk_modulus))
        for file, leakage, friction, bulk_modulus in zip(
            truth["file"], truth["leakage"], truth["friction"], truth["bulk_modulus_pa"], strict=True
        )
    ]


@pytest.mark.slow
def test_without_pressure_the_motion_form_is_chosen(shared: Path) -> None:
    log, _, truth = foreign_logs(shared)[2]
    answer = estimate_bulk_modulus(without_pressure(log), EhaParameters())
    assert (answer.form, answer.outcome, answer.gate.passed) == ("motion", Outcome.OK, True)
    assert answer.value == pytest.approx(truth, rel=0.02)
    assert set(answer.others) == {"leakage_coefficient", "flow_bias"}


@pytest.mark.parametrize("form", [pytest.param("flow", marks=pytest.mark.slow), "pressure"])
def test_uncertainty_of_chamber_volume_widens_only_the_total_interval_of_bulk_modulus(form: str) -> None:
    log = bench_log("lumped", "steps", "normal")
    exact, vague = (
        estimate_bulk_modulus(log, EhaParameters(), form=form, uncertainties=given)
        for given in ({}, {"chamber_volume": 0.05})
    )
    assert (vague.value, vague.std) == (exact.value, exact.std)
    assert exact.quantity.ci95_total == exact.interval
    assert vague.quantity.ci95_total is not None
    low, high = vague.quantity.ci95_total
    assert np.log(high / low) == pytest.approx(2.0 * 1.96 * 0.05, rel=0.05)


@pytest.mark.parametrize("every", thinned([4, 1], [4]))
def test_foreign_logs_give_bulk_modulus_within_ten_percent(every: int, shared: Path) -> None:
    logs = foreign_logs(shared)
    assert len(logs) == 18
    for log, condition, truth in logs[::every]:
        parameters = parameters_for(condition)
        for start in (0.5e8, 4e8):
            answer = estimate_bulk_modulus(log, parameters, form="pressure", start=start, start_std=1e8)
            assert answer.value == pytest.approx(truth, rel=0.1)


@pytest.mark.slow
@EVERY_CONDITION
def test_every_start_of_the_study_converges(name: str) -> None:
    seed = list(CONDITIONS).index(name)  # a different seed for each condition; `benchmarks bulk_modulus` runs more
    reduced = bench_log.__wrapped__("reduced", "sine", name, seed)
    assert largest_error(reduced, name, "acceleration", WIDE_STARTS) < 0.03
    for drive in ("sine", "steps"):
        log = bench_log.__wrapped__("lumped", drive, name, seed)
        assert largest_error(log, name, "pressure", WIDE_STARTS) < 0.01
    assert largest_error(without_pressure(log), name, "pressure", WIDE_STARTS) < 0.03


PRESSURE = "differential_pressure_pa"


def clipped(record: Record, share: float) -> Record:
    """Return the log with a pressure sensor whose range ends at a share of the largest pressure."""
    limit = 500.0 * round(share * float(np.max(np.abs(record[PRESSURE]))) / 500.0)
    return with_fault(record, SensorFault(channel=PRESSURE, kind="saturation", size=limit))


def sampled(sample_time: float, condition: str = "minor_leakage", duration: float = 5.0) -> Record:
    p, rng = parameters_for(CONDITIONS[condition]), np.random.default_rng(21)
    speed = make_drive("prbs", duration, sample_time, p, rng)
    return simulate(PLANTS["lumped"], speed, sample_time, p, sensors=BENCH, rng=rng)


def covers(answer: BulkModulusEstimate, truth: float) -> bool:
    low, high = answer.interval or (np.inf, -np.inf)
    return low < truth < high


@pytest.mark.parametrize("method", thinned(["least-squares", "ekf"], ["least-squares"]))
def test_a_clipped_pressure_leaves_bulk_modulus_within_its_interval(method: str) -> None:
    log = sampled(1e-3)
    with pytest.warns(LogWarning) as caught:
        answer = estimate_bulk_modulus(clipped(log, 0.7), EhaParameters(), form="flow", method=method)
    (note,) = [one.message.note for one in caught]
    assert (note.code, note.data["channel"]) == (SensorCode.SENSOR_CLIPPED, PRESSURE)
    assert 30.0 < note.data["percent"] < 80.0
    assert covers(answer, TRUTH)
    assert answer.gate.passed
    assert answer.value == pytest.approx(TRUTH, rel=0.01)


def test_a_clipped_pressure_of_the_foreign_bench_leaves_bulk_modulus_within_its_interval(shared: Path) -> None:
    log, _, truth = foreign_logs(shared)[10]
    with pytest.warns(LogWarning) as caught:
        answer = estimate_bulk_modulus(clipped(log, 0.7), EhaParameters())
    assert [one.message.note.code for one in caught] == [SensorCode.SENSOR_CLIPPED]
    assert covers(answer, truth)
    assert answer.value == pytest.approx(truth, rel=0.005)


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.9, 0.7, 0.5])
def test_intervals_of_clipped_foreign_bench_logs_cover_the_truth(share: float, shared: Path) -> None:
    covered: list[bool] = []
    for log, _, truth in foreign_logs(shared)[::2]:
        with pytest.warns(LogWarning) as caught:
            answer = estimate_bulk_modulus(clipped(log, share), EhaParameters())
        assert [one.message.note.code for one in caught] == [SensorCode.SENSOR_CLIPPED]
        assert answer.value == pytest.approx(truth, rel=0.02)
        covered.append(covers(answer, truth))
    assert sum(covered) >= 7


def every_tenth(record: Record, channel: str, first: int) -> Record:
    slow = np.full(len(record), np.nan)
    slow[first::10] = record[channel][first::10]
    return record.replace(**{channel: slow})


ASYNCHRONOUS: Mapping[str, tuple[float, tuple[str, ...]]] = {
    "500 Hz": (2e-3, ()),
    "2 kHz": (5e-4, ()),
    "20 kHz": (5e-5, ()),
    "pressure at 1 of 10 kHz": (1e-4, (PRESSURE,)),
    "pressure and encoder at 1 of 10 kHz, at different times": (1e-4, (PRESSURE, "position_m")),
}
"""Sample time, and the channels that are logged only in every tenth row."""


def asynchronous(rate: str, duration: float = 5.0) -> Record:
    sample_time, slow = ASYNCHRONOUS[rate]
    record = sampled(sample_time, duration=duration)
    for first, channel in enumerate(slow, 3):
        record = every_tenth(record, channel, first)
    return record


@pytest.mark.parametrize("rate", ASYNCHRONOUS)
def test_the_pressure_form_accepts_any_sample_rate_and_mixed_rates(rate: str) -> None:
    answer = estimate_bulk_modulus(asynchronous(rate), parameters_for(CONDITIONS["minor_leakage"]), form="pressure")
    assert covers(answer, TRUTH)
    assert answer.value == pytest.approx(TRUTH, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["least-squares", "ekf"])
@pytest.mark.parametrize("rate", ASYNCHRONOUS)
def test_the_flow_form_accepts_any_sample_rate_and_mixed_rates(rate: str, method: str) -> None:
    answer = estimate_bulk_modulus(asynchronous(rate, 10.0), EhaParameters(), form="flow", method=method, start=3e8)
    assert covers(answer, TRUTH)
    assert answer.value == pytest.approx(TRUTH, rel=0.01)
    assert answer.gate.passed


@pytest.mark.parametrize("form", ["pressure", pytest.param("flow", marks=pytest.mark.slow)])
def test_a_slow_speed_sensor_does_not_bias_a_filter(form: str) -> None:
    log = every_tenth(every_tenth(sampled(1e-4, duration=10.0), PRESSURE, 3), "motor_speed_rad_s", 7)
    known = parameters_for(CONDITIONS["minor_leakage"]) if form == "pressure" else EhaParameters()
    answer = estimate_bulk_modulus(log, known, form=form, method="ekf")
    assert answer.value == pytest.approx(TRUTH, rel=0.005)
    assert covers(answer, TRUTH)
    assert answer.gate.passed


@pytest.mark.parametrize(("first", "samples"), thinned([(2130, 2500), (3337, 1500)], [(3337, 1500)]))
def test_a_log_that_begins_under_load_gives_its_bulk_modulus(first: int, samples: int, shared: Path) -> None:
    log, _, truth = foreign_logs(shared)[10]
    assert abs(log[PRESSURE][first]) > 1e5
    answer = estimate_bulk_modulus(log.slice(first, first + samples), EhaParameters())
    assert answer.form == "flow"
    assert answer.value == pytest.approx(truth, rel=0.005)


def test_gross_outliers_and_drop_outs_of_speed_hardly_worsen_a_filter() -> None:
    log, rng = sampled(1e-3, "normal", 10.0), np.random.default_rng(4)
    speed = log["motor_speed_rad_s"].copy()
    speed[rng.choice(len(log), len(log) // 100, replace=False)] += 20.0 * np.std(speed)
    speed[4000:4100] = np.nan
    with pytest.warns(LogWarning) as caught:
        broken = found(log.replace(motor_speed_rad_s=speed), "normal", "pressure", 3e8)
    (note,) = [one.message.note for one in caught]
    assert note.code == SensorCode.OUTLIERS_LEFT_OUT
    assert (note.data["channel"], note.data["total"]) == ("motor_speed_rad_s", 10_000)
    assert note.data["count"] > 90
    sound = found(log, "normal", "pressure", 3e8)
    assert broken.gate.passed
    assert abs(broken.value - TRUTH) < max(2.0 * abs(sound.value - TRUTH), 1e-3 * TRUTH)
    assert broken.std < 1.5 * sound.std
