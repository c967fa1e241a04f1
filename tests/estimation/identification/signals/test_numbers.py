"""Frequency responses, distortion and the preprocessing of signals before a fit, kept in `numbers.json`."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np
import pytest

from estimation.identification.signals import automatic_window, etfe
from estimation.identification.signals.automatic_window import automatic_response
from estimation.identification.signals.distortion import Distortion, best_linear_approximation
from estimation.identification.signals.etfe import checked_signals, etfe_welch
from estimation.identification.signals.local_polynomial import local_polynomial_response
from estimation.identification.signals.measured_response import measured_response
from estimation.identification.signals.period import find_period
from estimation.identification.signals.preprocess import detrend, resample, zero_phase_filter
from plant.arrays import Array
from tests.numbers import Numbers, refused, some, warned

NUMBERS = Numbers(__file__)
SAMPLE_TIME = 0.01
RNG = np.random.default_rng(11)
WHITE: Array = RNG.standard_normal(2000)
NOISE: Array = RNG.standard_normal(2100)

LOW: Array = np.hanning(9)


def resonance(u: Array, cube: float = 0.0, square: float = 0.0) -> Array:
    """Return the response of two poles to an input, plus powers of it."""
    y = np.zeros(u.size)
    for t in range(2, u.size):
        y[t] = 1.6 * y[t - 1] - 0.8 * y[t - 2] + 0.2 * u[t - 1]
    return y + cube * y**3 + square * y**2


def parts_of(found: etfe.FrequencyResponse) -> dict[str, Any]:
    low, high = found.gain_band(0.9)
    return {
        "count": found.frequency_hz.size,
        "frequency [Hz]": some(found.frequency_hz, 4),
        "response": some(found.response, 8),
        "coherence": some(found.coherence, 4),
        "deviation of the gain": some(found.gain_std, 8),
        "resolution [Hz]": some(np.atleast_1d(found.resolution_hz), 6),
        "band": [some(low, 3), some(high, 3)],
    }


@NUMBERS.case()
def windowed_spectra() -> dict[str, Any]:
    u, y = WHITE[:400] + 3.0, resonance(WHITE[:400]) + 0.3 * NOISE[:400] - 7.0
    return {
        "by lags": parts_of(etfe.etfe(u, y, SAMPLE_TIME)),
        "by few lags": parts_of(etfe.etfe(u, y, SAMPLE_TIME, lag_window=2)),
        "of a short record": parts_of(etfe.etfe(u[:100], y[:100], SAMPLE_TIME)),
        "by as many as there may be": etfe.etfe(u, y, SAMPLE_TIME, lag_window=199).frequency_hz.size,
        "by segments": parts_of(etfe_welch(u, y, SAMPLE_TIME)),
        "by segments of two thirds": parts_of(etfe_welch(u, y, SAMPLE_TIME, segment_length=266)),
        "by short segments": etfe_welch(u, y, SAMPLE_TIME, segment_length=8).frequency_hz,
        "of 64 samples, by segments": etfe_welch(u[:64], y[:64], SAMPLE_TIME).frequency_hz,
        "of gains that are nothing": etfe.gain_std(np.array([1.0 + 0j, 2.0]), np.array([0.0, 0.5]), 10.0),
        "where the input is one sine": parts_of(etfe.etfe(np.sin(np.arange(400) / 3.0), y, SAMPLE_TIME)),
    }


@NUMBERS.case()
def windows_that_choose_themselves() -> dict[str, Any]:
    u, y = WHITE, resonance(WHITE) + 0.5 * NOISE[:2000]
    known = etfe.correlations(*checked_signals(u[:400], y[:400], SAMPLE_TIME))
    responses, deviations, coherences = automatic_window._estimates(known, [40, 20, 10], 80, 400)
    hollow = deviations.copy()
    hollow[1, 3:9], hollow[0, 20:24] = np.nan, np.nan
    return {
        "of a long record": parts_of(automatic_response(u, y, SAMPLE_TIME)),
        "of the shortest": parts_of(automatic_response(u[:160], y[:160], SAMPLE_TIME)),
        "of a pure gain": parts_of(automatic_response(u[:400], 2.0 * u[:400] + NOISE[:400], SAMPLE_TIME)),
        "by window": [some(one) for one in responses],
        "deviation by window": [np.r_[one[:5], one[-5:]] for one in deviations],
        "coherence by window": [some(one) for one in coherences],
        "accepted": automatic_window._accepted(responses, deviations),
        "accepted where some are not known": automatic_window._accepted(responses, hollow),
    }


@NUMBERS.case()
def what_a_response_refuses() -> dict[str, Any]:
    u, y = WHITE[:400], resonance(WHITE[:400])
    lost = np.where(np.arange(400) == 5, np.nan, y)
    calls: dict[str, Callable[[], Any]] = {
        "one lag": partial(etfe.etfe, u, y, SAMPLE_TIME, lag_window=1),
        "lags of half the record": partial(etfe.etfe, u, y, SAMPLE_TIME, lag_window=200),
        "63 samples": partial(checked_signals, u[:63], y[:63], SAMPLE_TIME),
        "64 samples": partial(checked_signals, u[:64], y[:64], SAMPLE_TIME),
        "no time": partial(checked_signals, u, y, 0.0),
        "endless time": partial(checked_signals, u, y, np.inf),
        "tables": partial(checked_signals, u.reshape(200, 2), y.reshape(200, 2), SAMPLE_TIME),
        "other lengths": partial(checked_signals, u, y[:399], SAMPLE_TIME),
        "gaps": partial(checked_signals, u, lost, SAMPLE_TIME),
        "gaps of the input": partial(checked_signals, lost, y, SAMPLE_TIME),
        "a constant": partial(checked_signals, np.ones(400), y, SAMPLE_TIME),
        "segments of 7": partial(etfe_welch, u, y, SAMPLE_TIME, segment_length=7),
        "segments of 267": partial(etfe_welch, u, y, SAMPLE_TIME, segment_length=267),
        "159 samples of windows": partial(automatic_response, u[:159], y[:159], SAMPLE_TIME),
        "27 samples of polynomials": partial(local_polynomial_response, u[:26], y[:26], SAMPLE_TIME),
        "polynomials of a table": partial(local_polynomial_response, u[:, None], y[:, None], SAMPLE_TIME),
        "polynomials of other lengths": partial(local_polynomial_response, u, y[:300], SAMPLE_TIME),
        "polynomials of gaps": partial(local_polynomial_response, u, lost, SAMPLE_TIME),
        "polynomials of nothing": partial(local_polynomial_response, np.zeros(400), y, SAMPLE_TIME),
        "polynomials of short periods": partial(local_polynomial_response, np.tile(u[:8], 50), y, SAMPLE_TIME),
        "polynomials of low frequencies": partial(local_polynomial_response, np.convolve(u, LOW, "same"), y, 1.0),
        "polynomials of a sine": partial(local_polynomial_response, np.sin(np.arange(400) * np.pi / 8), y, 1.0),
        "a response of lost samples": partial(measured_response, u, lost, SAMPLE_TIME),
        "no period": partial(best_linear_approximation, u, y, SAMPLE_TIME),
        "periods of a table": partial(best_linear_approximation, u[:, None], y[:, None], SAMPLE_TIME),
        "periods of other lengths": partial(best_linear_approximation, u, y[:300], SAMPLE_TIME),
        "periods of gaps": partial(best_linear_approximation, u, lost, SAMPLE_TIME),
        "one period": partial(best_linear_approximation, u, y, SAMPLE_TIME, period=134),
        "two periods": partial(best_linear_approximation, u, y, SAMPLE_TIME, period=133),
        "periods of 7": partial(best_linear_approximation, u, y, SAMPLE_TIME, period=7),
        "periods of 8": partial(best_linear_approximation, u, y, SAMPLE_TIME, period=8),
    }
    return {name: refused(call) for name, call in calls.items()}


@NUMBERS.case()
def local_polynomials() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for n in (28, 27, 201, 400):
        found = local_polynomial_response(WHITE[:n] + 5.0, resonance(WHITE[:n]) + 0.2 * NOISE[:n], SAMPLE_TIME)
        told[f"of {n} samples"] = {
            "frequency [Hz]": some(found.frequency, 4),
            "response": some(found.response, 8),
            "variance": some(found.variance, 8),
            "freedom": found.freedom,
            "radius": [some(found.radius(), 3), some(found.radius(0.5), 3)],
        }
    return told


@cache
def multisine(length: int, step: int, missing: bool, seed: int = 5) -> Array:
    """Return one period of a multisine up to a third of half the rate, with one odd line in four left out."""
    rng = np.random.default_rng(seed)
    spectrum = np.zeros(length // 2 + 1, dtype=complex)
    lines = np.arange(1, length // 6, step)
    if missing:
        lines = np.concatenate(
            [np.delete(one, rng.integers(0, one.size)) for one in np.array_split(lines, lines.size // 4)]
        )
    spectrum[lines] = np.exp(2j * np.pi * rng.random(lines.size))
    period = np.fft.irfft(spectrum, length)
    return period / period.std()


def told_of(found: Distortion) -> dict[str, Any]:
    return {
        "period": [found.period, found.periods],
        "frequency [Hz]": some(found.frequency, 3),
        "lines": [int(found.excited.sum()), int(found.odd.sum())],
        "noise": some(found.noise, 4),
        "power": some(found.power, 4),
        "stray": some(found.stray, 4),
        "response": some(found.response.response, 6),
        "frequencies [Hz]": some(found.response.frequency, 3),
        "variance": some(found.response.variance, 6),
        "freedom": found.response.freedom,
        "levels": [found.level(odd=odd) for odd in (True, False)],
        "intervals": [found.level_interval(odd=odd, probability=p) for odd in (True, False) for p in (0.5, 0.95)],
        "periods wanted": [found.period_wanted(odd=odd) for odd in (True, False)],
    }


@NUMBERS.case(relative=1e-5)
def distortion_of_multisines() -> dict[str, Any]:
    told: dict[str, Any] = {}
    kinds = {
        "odd lines, some left out": (multisine(512, 2, True), 512),
        "odd lines": (multisine(512, 2, False), 512),
        "every line": (multisine(512, 1, False), 512),
        "every line, some left out": (multisine(512, 1, True), 512),
        "of odd length": (multisine(511, 2, True), 511),
        "short": (multisine(128, 2, True), 128),
        "just long enough": (multisine(130, 2, True), 130),
    }
    for name, (period, length) in kinds.items():
        u = np.tile(period, 4)
        y = resonance(u, 0.05, 0.1) + 0.05 * NOISE[: u.size]
        told[name] = told_of(best_linear_approximation(u, y, SAMPLE_TIME, period=length, settling=1))
    u = np.tile(multisine(512, 2, True), 3)
    y = resonance(u, 0.05, 0.1)
    told["found, more settling"] = told_of(best_linear_approximation(u[:1400], y[:1400], SAMPLE_TIME, settling=0))
    clean = best_linear_approximation(u, resonance(u), SAMPLE_TIME, period=512)
    told["of a linear plant"] = [clean.level(odd=True) < 1e-12, clean.level_interval(odd=False)[0]]
    few = np.tile(np.cos(2.0 * np.pi * np.arange(64) / 64.0) + np.cos(6.0 * np.pi * np.arange(64) / 64.0), 3)
    two = best_linear_approximation(few, resonance(few, 0.1, 0.1) + NOISE[:192], SAMPLE_TIME, period=64)
    told["two lines"] = told_of(two)
    nothing = replace(clean, power=np.zeros_like(clean.power), noise=np.ones_like(clean.noise))
    told["no power"] = [nothing.level(odd=True), *nothing.level_interval(odd=True), nothing.period_wanted(odd=True)]
    return told


def made(power: float, noise: float, driven: float, length: int = 512) -> Distortion:
    """Return a possible result of a multisine of odd lines."""
    base = best_linear_approximation(np.tile(multisine(512, 2, True), 3), NOISE[:1536], SAMPLE_TIME, period=512)
    rng = np.random.default_rng(9)
    size = np.where(base.excited, np.sqrt(driven), np.sqrt(power))
    stray = size * np.exp(2j * np.pi * rng.random(size.size)) * np.sqrt(rng.exponential(size=size.size))
    held = np.full(base.noise.size, noise)
    return replace(base, period=length, stray=stray, power=np.abs(stray) ** 2, noise=held)


@NUMBERS.case()
def levels_of_distortion() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, given in {
        "plain": (1.0, 0.1, 1.0),
        "twice as much where driven": (1.0, 0.1, 1.6),
        "three times": (1.0, 0.1, 3.5),
        "below noise": (1.0, 5.0, 1.0),
    }.items():
        one = made(*given)
        told[name] = {
            "level": one.level(odd=True),
            "intervals": [one.level_interval(odd=True), one.level_interval(odd=False, probability=0.8)],
            "wanted": [one.period_wanted(odd=True), one.period_wanted(odd=False)],
            "spread": [one._spread(True), one._spread(False)],
        }
    told["too short a period"] = [replace(made(1.0, 0.1, 1.0), period=n)._spread(True) for n in (126, 127)]
    return told


@NUMBERS.case()
def periods() -> dict[str, Any]:
    four = np.array([0.0, 1.0, 3.0, 2.0])
    rng = np.random.default_rng(3)
    base = np.tile(rng.standard_normal(20), 6)
    told = {
        f"changed by {share:g}": find_period(base + share * rng.standard_normal(base.size))
        for share in (0.0, 0.005, 0.009, 0.0099, 0.0101, 0.012, 0.014, 0.02)
    }
    told |= {"twice": find_period(np.tile(four, 2)), "not twice": find_period(np.tile(four, 2)[:7])}
    told |= {"one and a half": find_period(np.tile(four, 3)[:9]), "constant": find_period(np.ones(9))}
    return told | {"not known": find_period(np.array([1.0, np.nan, 2.0, 3.0])), "line": find_period(np.arange(30.0))}


@NUMBERS.case()
def what_logs_tell() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, u in {
        "three periods": np.tile(multisine(128, 2, True), 3),
        "two and a half": np.tile(multisine(128, 2, True), 3)[:320],
        "periods of 8": np.tile(multisine(128, 2, True)[:8], 20),
        "periods of 7": np.tile(multisine(128, 2, True)[:7], 20),
    }.items():
        try:
            found = measured_response(u, resonance(u, 0.05, 0.02) + 0.01 * NOISE[: u.size], SAMPLE_TIME).to_dict()
        except ValueError as error:
            told[name] = str(error)
            continue
        arrays = ("frequency_hz", "real", "imag", "radius95")
        if found["method"] == "multisine":
            told[name] = {**found, **{key: some(found[key], 3) for key in arrays}}
        else:  # only leakage drives most lines
            told[name] = found["method"]
    noise = measured_response(WHITE[:300], resonance(WHITE[:300]), SAMPLE_TIME)
    return {**told, "noise": noise.method}


@NUMBERS.case()
def filtered_and_resampled() -> dict[str, Any]:
    wave = np.cumsum(WHITE[:200]) * 0.1
    gaps = np.where((np.arange(200) > 20) & (np.arange(200) < 26), np.nan, wave)
    told: dict[str, Any] = {"less its mean": some(detrend(gaps), 3)}
    for order, cutoff in ((12, 30.0), (1, 5.0), (3, 49.0), (8, 0.3)):
        u, y = zero_phase_filter(wave, gaps, SAMPLE_TIME, cutoff_hz=cutoff, order=order)
        told[f"order {order} at {cutoff:g} Hz"] = [some(u, 9), some(y, 5)]
    told["output alone"] = [some(one, 3) for one in zero_phase_filter(wave, gaps, 0.001, filter_input=False)]
    for new in (0.01, 0.0100001, 0.005, 0.0073, 0.02, 0.025, 0.03, 0.0200001):
        told[f"at {new:g} s"] = some(resample(gaps, SAMPLE_TIME, new), 9)
        told[f"at {new:g} s, count"] = resample(gaps, SAMPLE_TIME, new).size
    told["one sample"] = [resample(np.ones(1), 0.01, 0.01), refused(lambda: resample(np.ones(3), 0.01, 0.02))]
    told["warns"] = warned(lambda: zero_phase_filter(wave, wave, SAMPLE_TIME, cutoff_hz=20.0, filter_input=False))
    for name, n, cutoff, order in (
        ("as long as it needs", 26, 20.0, 12),
        ("one sample too short", 25, 20.0, 12),
        ("one too short, odd order", 9, 20.0, 3),
        ("odd order", 10, 20.0, 3),
        ("at the end of the band", 200, 50.0, 4),
        ("at zero", 200, 0.0, 4),
        ("of no order", 200, 20.0, 0),
        ("of one", 200, 20.0, 1),
    ):
        call = partial(zero_phase_filter, wave[:n], wave[:n], SAMPLE_TIME, cutoff_hz=cutoff, order=order)
        told[f"refused {name}"] = refused(call)
    told["times refused"] = [
        refused(partial(resample, wave, a, b)) for a, b in ((0.0, 1.0), (1.0, -1.0), (np.inf, 1.0))
    ]
    told["four samples"] = resample(np.arange(4.0), 1.0, 0.5)
    return told


@pytest.mark.parametrize("case", NUMBERS.cases)
@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning")
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
