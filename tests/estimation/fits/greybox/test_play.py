"""Where the piston may be in its encoder's play, and whether a log's residuals show a play."""

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.special import ndtr

from estimation.fits.flow import asked_hypotheses
from estimation.fits.flow import fit as flow_fit
from estimation.fits.flow import plain as plain_flow
from estimation.fits.flow.asked_hypotheses import ALWAYS_ASKED
from estimation.fits.flow.fit import fit_flow
from estimation.fits.flow.search import balance_fits, flow_starts
from estimation.fits.greybox.play import (
    NO_PLAY,
    PLAY_BELIEVED,
    PLAY_OPEN,
    PLAY_SENSED,
    PLAY_SHOWN,
    PLAY_STRUCTURE,
    ShownPlay,
    crossings,
    omitted_play_note,
    sensed_play,
)
from estimation.fits.hypotheses import PLAY, Hypothesis
from estimation.fits.hypothesis_search.fit_objections import DOUBTED_CHI_SQUARE
from estimation.fits.hypothesis_search.form_fit import FormFit
from estimation.fits.hypothesis_search.predicted_gains import NO_GAIN, PredictedGain
from estimation.notes import EstimateCode, RigCode
from faults.conditions import CONDITIONS, parameters_for
from plant.arrays import Array
from plant.eha.circuit_parameters import circuit_of
from plant.eha.drives import make_drive
from plant.eha.simulate import CIRCUIT, LUMPED, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from tests.estimation.fits.short_logs import PAPER, made_fit, seen
from tests.thinned import thinned

QUANTUM = 1e-6


def side_of_play(position: Array) -> Array:
    """Return the first course that is tested on every log: the piston crosses late."""
    return crossings(position, np.zeros(len(position)), 1e-3)[:, 0]


def read(position: Array) -> Array:
    return QUANTUM * np.round(position / QUANTUM)


def test_play_is_crossed_between_the_last_movement_one_way_and_the_first_one_back() -> None:
    side = side_of_play(turned())
    assert side[10:490] == pytest.approx(1.0)
    assert side[560:] == pytest.approx(-1.0)
    assert side[525] == pytest.approx(0.5, abs=0.1)  # a quarter of the way in half of the time
    assert np.all(np.diff(side[490:560]) <= 0.0)


def test_encoder_noise_is_not_taken_for_a_reversal() -> None:
    noise = QUANTUM * np.random.default_rng(1).standard_normal(5000)
    assert not np.any(side_of_play(read(noise)))
    moved = side_of_play(read(noise + np.linspace(0.0, 1e-2, 5000)))
    assert moved[100:] == pytest.approx(1.0)


def test_a_dead_encoder_is_at_neither_side_of_its_play() -> None:
    assert not np.any(side_of_play(np.full(100, 0.3)))


def turned() -> Array:
    """Return a reading that rises for 500 ms, rests for 50 ms and returns."""
    up = np.linspace(0.0, 1e-2, 500)
    return read(np.concatenate([up, np.full(50, 1e-2), up[::-1]]))


def test_a_piston_that_pressure_moves_crosses_the_play_as_pressure_reverses() -> None:
    position = turned()
    pressure = np.where(np.arange(len(position)) < 510, 1e6, -1e6)  # reverses when the encoder has rested for 10 ms
    late, by_pressure, at_once, sprung = crossings(position, pressure, 1e-3).T
    assert late == pytest.approx(side_of_play(position))
    assert (late + by_pressure)[[499, 530, 560]] == pytest.approx([1.0, -1.0, -1.0], abs=0.02)
    assert (late + by_pressure)[510] == pytest.approx(0.0, abs=0.2)
    assert (late + at_once)[525] == pytest.approx(-0.5, abs=0.1)  # three quarters of the way in half of the time
    assert not np.any(sprung)


def test_a_stopped_piston_springs_back_in_proportion_to_the_lost_pressure() -> None:
    up = np.linspace(0.0, 1e-2, 500)
    position = read(np.concatenate([up, np.full(200, 1e-2), 1e-2 + up]))
    pressure = np.where(np.abs(np.arange(len(position)) - 600) < 50, 2.5e5, 1e6)
    pressure[595:605] = np.nan
    late, by_pressure, at_once, sprung = crossings(position, pressure, 1e-3).T
    assert late[10:] == pytest.approx(1.0)
    assert not np.any(by_pressure[10:])
    assert not np.any(at_once[10:])
    assert sprung[600] == pytest.approx(-0.75, abs=0.01)
    assert sprung[[400, 520, 680, 900]] == pytest.approx(0.0, abs=0.01)
    back = crossings(-position, -pressure, 1e-3).T[3]
    assert back == pytest.approx(-sprung)


def test_the_play_is_not_crossed_without_a_movement() -> None:
    assert not np.any(crossings(np.full(100, 0.3), np.linspace(0.0, 1e6, 100), 1e-3))


@cache
def logged(condition: str, drive: str, play: float) -> Record:
    rng = np.random.default_rng(7)
    true = circuit_of(parameters_for(CONDITIONS[condition]))
    signal = make_drive(drive, 5.0, 1e-3, PAPER, rng)
    record = simulate(CIRCUIT, signal, 1e-3, true, sensors=BENCH, rng=rng)
    position = record["position_m"].copy()
    for i in range(1, len(position)):
        position[i] = min(max(position[i - 1], position[i] - 0.5 * play), position[i] + 0.5 * play)
    return record.replace(position_m=position)


def shown(record: Record) -> ShownPlay:
    fits = balance_fits(seen(record), PAPER, flow_starts(PAPER, PAPER.bulk_modulus))
    return max((fit.play for fit in fits), key=lambda one: one.gain)


@pytest.mark.parametrize("condition", ["normal", "minor_leakage_major_friction"])
def test_residuals_show_a_play_only_of_an_encoder_that_has_one(condition: str) -> None:
    assert shown(logged(condition, "prbs", 0.0)).gain < PLAY_SHOWN
    played = shown(logged(condition, "prbs", 5e-5))
    assert played.gain > PLAY_SHOWN
    assert played.size > 5e-6


@pytest.mark.parametrize("condition", thinned(["normal", "minor_leakage_major_friction", "major_leakage"], ["normal"]))
def test_bulk_modulus_with_a_play_is_within_its_interval_or_the_gate_is_shut(condition: str) -> None:
    fit = fit_flow(logged(condition, "prbs", 5e-5), PAPER, PAPER.bulk_modulus)
    value, std = fit.parameters["bulk_modulus"]
    named = fit.explanation is not None and "position_play" in fit.explanation.names
    left = [note for note in fit.reasons if note.code is EstimateCode.PLAY_LEFT]
    assert named or left
    assert fit.reasons or abs(value - PAPER.bulk_modulus) < 3.0 * std


@pytest.mark.parametrize("drive", ["prbs", "multisine"])
def test_a_velocity_sensor_shows_the_play_that_the_encoder_hides(drive: str) -> None:
    played, sound = logged("normal", drive, 5e-5), logged("normal", drive, 0.0)
    assert sensed_play(sound) == NO_PLAY
    found = sensed_play(played)
    assert found.gain > PLAY_SENSED
    assert 5e-6 < found.size < 1e-4
    by_encoder = np.gradient(played["position_m"]) / played.sample_time
    assert sensed_play(played.replace(velocity_m_s=by_encoder)) == NO_PLAY
    assert sensed_play(played.replace(velocity_m_s=None)) == NO_PLAY
    some_missing = np.where(np.arange(len(played)) % 50 < 5, np.nan, played["velocity_m_s"])
    assert sensed_play(played.replace(velocity_m_s=some_missing)).size == pytest.approx(found.size, rel=0.1)


@pytest.mark.parametrize(("noise", "shows"), [(1e-3, False), (2e-5, True)])
def test_an_encoder_has_a_play_only_if_it_surely_misses_half_of_the_pistons_motion(noise: float, shows: bool) -> None:
    rng, time = np.random.default_rng(4), 1e-3 * np.arange(2000)
    pressure = 1e6 * np.sin(2.0 * np.pi * time)
    yields = 5e-12
    channels = {
        "position_m": 1.4e-6 + 0.3 * yields * pressure + rng.normal(0.0, 3.5e-7, len(time)),
        "velocity_m_s": yields * np.gradient(pressure, 1e-3) + rng.normal(0.0, noise, len(time)),
        "differential_pressure_pa": pressure,
    }
    assert (sensed_play(Record(1e-3, channels)) != NO_PLAY) == shows


def standing_still(noise: float, seed: int, samples: int = 4000) -> Record:
    """Return a log of a sound encoder whose piston hardly moves, and of a velocity sensor with only noise."""
    rng = np.random.default_rng(seed)
    pressure = np.cumsum(rng.normal(0.0, 2e4, samples))
    channels = {
        "position_m": rng.normal(0.0, 3e-7, samples),
        "velocity_m_s": rng.normal(0.0, noise, samples),
        "differential_pressure_pa": pressure,
    }
    return Record(1e-3, channels)


def test_velocity_noise_shows_a_play_no_more_often_than_the_limit_predicts() -> None:
    """It is averaged over two sample times and so correlated: it counts for more than its scatter."""
    gains = [sensed_play(standing_still(1e-3, seed)).gain for seed in range(300)]
    assert sum(gain > PLAY_SENSED for gain in gains) <= 6  # 3 are expected by chance
    assert sum(gain > 1.0 for gain in gains) >= 8  # otherwise a test that detects nothing would pass


def test_few_samples_at_rest_show_a_play_less_clearly() -> None:
    seed = max(range(60), key=lambda one: sensed_play(standing_still(1e-3, one)).gain)
    long, short = standing_still(1e-4, seed), standing_still(1e-4, seed, 120)
    yielding = 3e-11
    gains = [
        sensed_play(
            one.replace(
                velocity_m_s=one["velocity_m_s"] + yielding * np.gradient(one["differential_pressure_pa"], 1e-3)
            )
        ).gain
        for one in (long, short)
    ]
    assert gains[1] < 0.2 * gains[0]


def test_creep_between_the_steps_of_an_encoder_is_not_mistaken_for_play() -> None:
    """All rests together hide 40 um, each of them 5 um at most."""
    time = 1e-3 * np.arange(4000)
    position = 2e-5 * time / time[-1]
    pressure = 1e6 * time / time[-1]
    rng = np.random.default_rng(2)
    channels = {
        "position_m": 1e-6 * np.round(1e6 * position),
        "velocity_m_s": 2.5 * np.gradient(position, 1e-3) + rng.normal(0.0, 1e-6, len(time)),
        "differential_pressure_pa": pressure,
    }
    assert sensed_play(Record(1e-3, channels)) == NO_PLAY


def test_the_quantum_of_a_coarse_encoder_is_not_mistaken_for_play() -> None:
    sound = logged("normal", "multisine", 0.0)
    assert sensed_play(sound.replace(position_m=2e-5 * np.round(sound["position_m"] / 2e-5))) == NO_PLAY


def test_a_velocity_sensor_shows_no_play_without_rests_or_without_pressure() -> None:
    moving = np.linspace(0.0, 0.1, 1000)
    channels = {"position_m": moving, "velocity_m_s": np.full(1000, 0.1), "differential_pressure_pa": 1e6 * moving}
    assert sensed_play(Record(1e-3, channels)) == NO_PLAY
    still = {**channels, "position_m": 0.0 * moving, "differential_pressure_pa": 0.0 * moving}
    assert sensed_play(Record(1e-3, still)) == NO_PLAY


def concluded(
    monkeypatch: pytest.MonkeyPatch, plain: float, strange: float, chi: float = 1.0, record: Record | None = None
) -> FormFit:
    """Return the result for a log, from the gains by which its plain fit and its fit with a play show one."""
    fit = replace(made_fit(500.0, 2e8, 1e5), play=ShownPlay(3e-5, plain, moved={"bulk_modulus": -0.02}))
    played = replace(made_fit(100.0, 2.1e8, 1e5, chi=chi), play=ShownPlay(1e-5, strange))
    values = {name: (value, played.std[name]) for name, value in played.values.items()}
    explanation = SimpleNamespace(names=("position_play",), values=values, priors=None, fit=played, fits=(played,))
    explanation.weights, explanation.delivery_open, explanation.in_detail = np.ones(1), NO_GAIN, explanation

    def explained(*_: Any, asked: Sequence[Hypothesis], paired: bool, **__: Any) -> Any:
        assert asked == (PLAY,)
        assert not paired
        return explanation

    monkeypatch.setattr(plain_flow, "balance_fits", lambda *_, **__: [fit])
    monkeypatch.setattr(
        asked_hypotheses, "predicted_gains", lambda *_, **__: len(ALWAYS_ASKED) * [PredictedGain(0.0, 0.0, 0.01)]
    )
    monkeypatch.setattr(flow_fit, "explain", explained)
    monkeypatch.setattr(flow_fit, "lower_minimum", lambda *_: None)
    return fit_flow(record or logged("normal", "prbs", 0.0), PAPER, PAPER.bulk_modulus)


def test_a_play_that_residuals_show_is_tested_and_accepted_if_only_noise_remains(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    unseen, asked = concluded(monkeypatch, PLAY_SHOWN, 0.0), concluded(monkeypatch, PLAY_SHOWN + 0.1, 0.0)
    assert unseen.explanation is None
    assert not unseen.reasons
    assert asked.explanation is not None
    assert not asked.reasons
    moved = 0.05  # a share of this remains uncertain
    assert asked.parameters["bulk_modulus"][1] == pytest.approx(
        np.hypot(PLAY_STRUCTURE, PLAY_OPEN * moved) * 2.1e8, rel=0.01
    )


def test_a_play_that_is_shown_and_not_found_shuts_the_gate(monkeypatch: pytest.MonkeyPatch) -> None:
    unexplained = concluded(monkeypatch, PLAY_BELIEVED + 0.1, 0.0, chi=DOUBTED_CHI_SQUARE + 0.01)
    assert unexplained.explanation is None
    assert [(note.code, note.data["play_um"]) for note in unexplained.reasons] == [(EstimateCode.PLAY_LEFT, 30.0)]
    another = concluded(monkeypatch, PLAY_SHOWN + 0.1, PLAY_BELIEVED + 0.1)
    assert [(note.code, note.data["play_um"]) for note in another.reasons] == [(EstimateCode.PLAY_LEFT, 10.0)]


def test_a_play_that_residuals_may_show_by_chance_widens_the_interval(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = concluded(monkeypatch, PLAY_SHOWN - 0.1, 0.0, chi=DOUBTED_CHI_SQUARE + 0.01)
    doubtful = concluded(monkeypatch, PLAY_BELIEVED - 0.1, 0.0, chi=DOUBTED_CHI_SQUARE + 0.01)
    assert not doubtful.reasons
    assert doubtful.explanation is None
    assert doubtful.parameters["bulk_modulus"][0] == sound.parameters["bulk_modulus"][0]
    moved = 0.02  # the shift that `fit_at_solution` sets
    assert doubtful.parameters["bulk_modulus"][1] == pytest.approx(np.hypot(PLAY_STRUCTURE, moved) * 2e8, rel=0.01)
    assert sound.parameters["bulk_modulus"][1] < 0.2 * doubtful.parameters["bulk_modulus"][1]
    assert RigCode.PLAY_NOT_EXCLUDED in [note.code for note in doubtful.remarks]
    assert RigCode.PLAY_NOT_EXCLUDED not in [note.code for note in sound.remarks]


def test_a_play_that_a_velocity_sensor_shows_is_tested_too(monkeypatch: pytest.MonkeyPatch) -> None:
    record = logged("normal", "prbs", 5e-5)
    assert concluded(monkeypatch, 0.0, 0.0, record=record).explanation is not None
    (note,) = concluded(monkeypatch, 0.0, 0.0, chi=DOUBTED_CHI_SQUARE + 0.01, record=record).reasons
    assert note.code is EstimateCode.PLAY_LEFT
    assert note.data["play_um"] == pytest.approx(1e6 * sensed_play(record).size)


def test_a_fitted_play_below_the_smallest_size_is_not_accepted(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = logged("normal", "prbs", 0.0)
    monkeypatch.setattr(flow_fit, "sensed_play", lambda _: ShownPlay(3e-5, PLAY_SHOWN + 0.1))
    fit = fit_flow(sound, PAPER, PAPER.bulk_modulus)
    assert fit.explanation is None
    assert [note.code for note in fit.reasons] == [EstimateCode.PLAY_LEFT]


@pytest.mark.parametrize(
    ("shown", "sensed", "shut"),
    [
        (ShownPlay(6e-6, PLAY_BELIEVED + 0.1), NO_PLAY, True),
        (ShownPlay(6e-6, PLAY_BELIEVED - 0.1), NO_PLAY, False),
        (ShownPlay(4e-6, PLAY_BELIEVED + 0.1), NO_PLAY, False),
        (NO_PLAY, ShownPlay(6e-6, PLAY_SHOWN + 0.1), True),
        (NO_PLAY, ShownPlay(6e-6, PLAY_SENSED + 0.1), False),
    ],
)
def test_only_a_significant_play_of_sufficient_size_shuts_the_gate(
    shown: ShownPlay, sensed: ShownPlay, shut: bool
) -> None:
    assert bool(omitted_play_note(shown, sensed)) is shut


def test_motion_within_the_resolution_of_a_sound_encoder_shows_no_play() -> None:
    p, rng = parameters_for(CONDITIONS["minor_leakage"]), np.random.default_rng(21)  # a play gained 7.4 at 500 Hz
    record = simulate(LUMPED, make_drive("prbs", 10.0, 2e-3, p, rng), 2e-3, p, sensors=BENCH, rng=rng)
    assert sensed_play(record).gain <= PLAY_SHOWN


def test_the_limits_for_a_play_have_their_stated_rates_of_false_alarms() -> None:
    """If a course asks for more play, its score statistic is the square of a positive normal deviate."""
    assert 1.0 / (3.0 * float(ndtr(-((2.0 * PLAY_BELIEVED) ** 0.5)))) == pytest.approx(3600.0, rel=0.02)
    by_chance = float(ndtr(-((2.0 * PLAY_SHOWN) ** 0.5)))
    assert 1.0 / by_chance == pytest.approx(430.0, rel=0.02)
    assert 1.0 / (3.0 * by_chance) == pytest.approx(140.0, rel=0.03)
    assert 1.0 / float(ndtr(-((2.0 * PLAY_SENSED) ** 0.5))) == pytest.approx(100.0, rel=0.02)


def test_a_shown_play_survives_a_copy_to_another_process() -> None:
    assert deepcopy(NO_PLAY) == NO_PLAY  # copied in the same way as by pickle
