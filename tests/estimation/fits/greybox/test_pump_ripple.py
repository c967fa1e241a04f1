"""How clearly a fit's residuals show pump ripple, and a log whose speed includes it."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from estimation.fits.flow.fit import fit_flow
from estimation.fits.flow.log import flow_log, without_strays
from estimation.fits.flow.search import balance_fits, flow_starts
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.pump_ripple import LIKELIEST, TOOTH_COUNTS, Ripple, ShownRipple, with_ripple
from estimation.fits.hypothesis_search.form_fit import FormFit
from estimation.fits.hypothesis_search.pump_ripple_fits import TEETH_WORTH, RippleFits, with_pump_ripple
from estimation.notes import RigCode
from experiments.open_benchmark.logger import PLAIN_CHANNELS, Logger
from experiments.open_benchmark.machine import Machine
from experiments.open_benchmark.run import run
from plant.arrays import Array
from plant.log.record import Record
from tests.estimation.fits.short_logs import PAPER

SAMPLE = 1e-3


def bare(speed: Array, sample_time: float = SAMPLE) -> GreyBoxLog:
    column = speed.reshape(-1, 1)
    return GreyBoxLog(column, 0.0 * column, np.zeros(0), sample_time, np.ones(len(speed), dtype=np.int64), ())


def turned(speed: Array) -> Array:
    """Return the angle at each sample [rad], with speed linear between samples."""
    return np.concatenate([[0.0], np.cumsum(0.5 * SAMPLE * (speed[1:] + speed[:-1]))])


@pytest.mark.parametrize(("cosine", "sine"), [(0.1, 0.0), (0.0, 0.1), (-0.05, 0.08)])
def test_a_log_with_ripple_delivers_its_volume_between_any_two_samples(cosine: float, sine: float) -> None:
    speed = 60.0 * np.sin(np.pi * SAMPLE * np.arange(2000))  # both ways, up to 0.7 rad of tooth phase per sample
    log = with_ripple(bare(speed), [Ripple(12, cosine, sine)])
    added = turned(log.drives[:, 0]) - turned(speed)
    phase = 12 * turned(speed)
    delivered = (cosine * np.sin(phase) - sine * np.cos(phase)) / 12
    assert added - added[0] == pytest.approx(delivered - delivered[0], abs=2e-4)
    assert np.ptp(delivered) > 0.01
    assert log.teeth == (Ripple(12, cosine, sine),)


def test_ripple_that_is_too_fast_for_the_sample_time_is_not_added() -> None:
    fast = np.full(100, 2.1 / (12 * SAMPLE))
    assert with_ripple(bare(fast), [Ripple(12, 0.1, 0.0)]).drives[:, 0] == pytest.approx(fast)
    slower = np.full(100, 1.9 / (12 * SAMPLE))
    assert np.ptp(with_ripple(bare(slower), [Ripple(12, 0.1, 0.0)]).drives[:, 0]) > 0.1 * slower[0]


def test_an_offset_is_subtracted_before_the_angle_is_taken() -> None:
    speed, teeth = np.linspace(-30.0, 30.0, 500), [Ripple(10, 0.1, 0.02)]
    assert with_ripple(bare(speed + 0.4), teeth, 0.4).drives == pytest.approx(with_ripple(bare(speed), teeth).drives)
    assert with_ripple(bare(speed), (), 0.4).drives[:, 0] == pytest.approx(speed - 0.4)
    assert with_ripple(bare(speed), (), 0.4).speed_offset == 0.4


def test_ripples_of_two_tooth_counts_add_up() -> None:
    speed = np.linspace(-30.0, 30.0, 500)
    one, other = Ripple(10, 0.1, 0.02), Ripple(20, -0.03, 0.05)
    together = with_ripple(bare(speed), [one, other])
    apart = [with_ripple(bare(speed), [each]).drives - speed[:, None] for each in (one, other)]
    assert together.drives - speed[:, None] == pytest.approx(sum(apart))
    assert together.teeth == (one, other)


@cache
def logged(ripple: float, overtone: float = 0.0) -> Record:
    """Return a log of a leaky actuator that is driven slowly, and whose pump has 11 teeth."""
    machine = Machine(leakage=12.0 * Machine().leakage, crack_a=0.0, crack_b=0.0, teeth=11.0, ripple=ripple)
    time = SAMPLE * np.arange(4000)
    course = np.ones((len(time), 5))
    course[:, 0] = 60.0 * np.sin(np.pi * time) + 40.0 * np.sin(2.6 * np.pi * time)
    course[:, 3] = 0.0
    log = Logger().log(run(machine, course), np.random.default_rng(5))
    record = Record(SAMPLE, {name: log[name].to_numpy() for name in PLAIN_CHANNELS})
    return record if not overtone else with_overtone(record, overtone)


def with_overtone(record: Record, amplitude: float) -> Record:
    """Return a log whose speed lacks the ripple of 22 more teeth."""
    less = with_ripple(bare(record["motor_speed_rad_s"]), [Ripple(22, -amplitude, 0.0)])
    return record.replace(motor_speed_rad_s=less.drives[:, 0])


def seen(record: Record) -> GreyBoxLog:
    sound, variances = without_strays(record)
    return flow_log(sound, PAPER, {}, variances)


def fits_of(log: GreyBoxLog) -> Sequence[GreyBoxFit]:
    return balance_fits(log, PAPER, flow_starts(PAPER, PAPER.bulk_modulus))


@cache
def likeliest(ripple: float) -> GreyBoxFit:
    log = replace(seen(logged(ripple)), counts=TOOTH_COUNTS)
    return min(fits_of(log), key=lambda fit: fit.cost)


def most(fit: GreyBoxFit) -> ShownRipple:
    return max(fit.teeth.values(), key=lambda one: one.gain)


def test_residuals_show_count_and_amplitude_of_ripple_and_none_of_a_smooth_pump() -> None:
    shown = most(likeliest(0.1))
    assert shown.gain > TEETH_WORTH
    assert shown.teeth.count == 11
    assert shown.teeth.amplitude == pytest.approx(0.1, abs=0.03)
    assert shown.teeth.amplitude == pytest.approx(shown.std * (2.0 * shown.gain) ** 0.5, rel=0.2)
    assert most(likeliest(0.0)).gain < TEETH_WORTH


def test_the_model_is_run_only_for_the_likeliest_of_the_requested_tooth_counts() -> None:
    assert len(likeliest(0.0).teeth) == LIKELIEST
    assert not fits_of(seen(logged(0.0)))[0].teeth


def test_the_gain_beside_the_likeliest_tooth_count_is_that_after_fitting_this_count() -> None:
    fit = likeliest(0.1)
    held = with_ripple(replace(seen(logged(0.1)), counts=(11, 19)), [most(fit).teeth])
    after = min(fits_of(held), key=lambda one: one.cost)
    assert fit.teeth[11].beside == 0.0
    assert fit.teeth[19].beside == pytest.approx(after.teeth[19].gain, rel=0.1)
    assert fit.teeth[19].beside < 0.95 * fit.teeth[19].gain


def test_a_ripple_that_the_log_includes_adds_to_the_deviation() -> None:
    held = with_ripple(replace(seen(logged(0.1)), counts=(11,)), [Ripple(11, 0.1, 0.0)])
    free, known = (min(fits_of(log), key=lambda fit: fit.cost) for log in (held, replace(held, counts=(), teeth=())))
    assert free.std["leakage_coefficient"] > known.std["leakage_coefficient"]
    added = free.std["bulk_modulus"] ** 2 - known.std["bulk_modulus"] ** 2
    place = free.model.unknowns.index("bulk_modulus")
    assert added == pytest.approx(free.teeth[11].opened[place] * free.values["bulk_modulus"] ** 2, rel=0.01)


@cache
def fitted(ripple: float) -> FormFit:
    return fit_flow(logged(ripple), PAPER, PAPER.bulk_modulus)


def test_bulk_modulus_is_right_with_a_fitted_ripple_and_off_with_an_ignored_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sound, taken_up = fitted(0.0), fitted(0.2)
    monkeypatch.setattr("estimation.fits.flow.plain.with_pump_ripple", lambda log, fits, *_: RippleFits(log, fits(log)))
    passed_over = fit_flow(logged(0.2), PAPER, PAPER.bulk_modulus)
    value, std = sound.parameters["bulk_modulus"]
    assert taken_up.parameters["bulk_modulus"][0] == pytest.approx(value, abs=0.3 * std)
    assert abs(passed_over.parameters["bulk_modulus"][0] - value) > std
    assert not sound.remarks
    (note,) = taken_up.remarks
    assert note.code is RigCode.PUMP_RIPPLES
    assert note.data["teeth"] == 11
    assert abs(note.data["percent"] - 20.0) < note.data["half_width"] < 5.0


def test_an_overtone_is_fitted_with_its_tooth_count_and_not_reported_by_itself() -> None:
    found = with_pump_ripple(seen(logged(0.1, overtone=0.15)), fits_of, lambda _: True)
    assert [one.count for one in found.log.teeth] == [11, 22]
    assert [note.data["teeth"] for note in found.remarks] == [11]
    assert with_pump_ripple(seen(logged(0.1)), fits_of, lambda _: True).log.teeth[0].count == 11


OFFSET = 0.3


def shifted(ripple: float) -> Record:
    record = logged(ripple)
    return record.replace(motor_speed_rad_s=record["motor_speed_rad_s"] + OFFSET)


def test_a_ripple_whose_phase_a_speed_offset_shifts_is_found_only_together_with_it() -> None:
    held = with_ripple(
        replace(seen(shifted(0.1)), counts=TOOTH_COUNTS), (), 0.7 * OFFSET
    )  # a part of the offset is left
    best = most(min(fits_of(held), key=lambda fit: fit.cost))
    assert best.teeth.count == 11
    assert best.offset == pytest.approx(0.3 * OFFSET, abs=0.3 * 2.0 * np.pi / (11 * 4.0))
    asked = replace(held, counts=(11,))
    alone = most(min(fits_of(asked), key=lambda fit: fit.cost))
    assert alone.gain < 0.5 * best.gain


def test_a_speed_offset_is_estimated_from_the_residuals_and_adds_to_the_deviation() -> None:
    plain = replace(seen(shifted(0.0)), counts=TOOTH_COUNTS)
    first = min(fits_of(plain), key=lambda fit: fit.cost)
    assert first.speed_offset.gain > 100.0
    assert first.speed_offset.value == pytest.approx(OFFSET, rel=0.3)
    held = with_ripple(replace(plain, counts=()), (), OFFSET)
    without, known = (min(fits_of(log), key=lambda fit: fit.cost) for log in (held, replace(held, speed_offset=0.0)))
    assert abs(without.speed_offset.value) < 4.0 * without.speed_offset.std
    added = without.std["bulk_modulus"] ** 2 - known.std["bulk_modulus"] ** 2
    place = without.model.unknowns.index("bulk_modulus")
    assert added == pytest.approx(without.speed_offset.opened[place] * without.values["bulk_modulus"] ** 2, rel=0.01)
    assert added > 0.0


@pytest.mark.parametrize("ripple", [0.0, 0.1])
def test_bulk_modulus_is_as_good_with_an_offset_of_speed_as_without(ripple: float) -> None:
    sound, off = fitted(ripple), fit_flow(shifted(ripple), PAPER, PAPER.bulk_modulus)
    value, std = sound.parameters["bulk_modulus"]
    assert off.parameters["bulk_modulus"][0] == pytest.approx(value, abs=0.5 * std)
    assert not off.reasons
    assert off.turning.offset == pytest.approx(OFFSET, abs=0.02)
    assert bool(off.turning.teeth) == (ripple > 0.0)
    note = next(note for note in off.remarks if note.code is RigCode.SPEED_OFFSET)
    assert abs(note.data["offset_rad_s"] - OFFSET) < 1.5 * note.data["half_width"]
    assert all(note.code is not RigCode.SPEED_OFFSET for note in sound.remarks)
