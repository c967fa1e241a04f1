"""Chosen structures, identified logs, and closed loops in two stages, kept in `numbers.json`."""

from functools import partial
from typing import Any

import numpy as np
import pytest

from estimation.identification.choose import choose_model, compare_structures, fit_structure, split_record
from estimation.identification.from_record import identify_record, record_signals
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.two_stage import identify_columns
from plant.arrays import Array
from plant.log.record import Record
from tests.numbers import Found, Numbers, Roughly, refused, some, warned

NUMBERS = Numbers(__file__)
RNG = np.random.default_rng(41)
N = 450
U: Array = 100.0 * np.repeat(RNG.choice([-1.0, 1.0], N // 5), 5)
NOISE: Array = RNG.standard_normal(N)


def answer(noise: float = 0.5, delay: int = 1) -> Array:
    y = np.zeros(N)
    for t in range(2, N):
        y[t] = 1.5 * y[t - 1] - 0.7 * y[t - 2] + 0.02 * U[max(t - delay, 0)]
    return y + noise * NOISE


def told_of(model: LinearModel) -> dict[str, Any]:
    values = np.concatenate([model.free_numerator, model.denominator[1:]])
    return {
        "structure": [model.structure, model.delay, model.sample_time, model.input_name, model.output_name],
        "values": [Found(float(one), 1e-3) for one in values],
        "deviations": [Roughly(float(one), 0.02) for one in model.coefficient_std],
        "fit": Found(model.fit_percent, 0.01),
    }


@NUMBERS.case()
def structures() -> dict[str, Any]:
    form = {"n_numerator": 2, "n_denominator": 3, "delay": 1, "input_name": "u", "output_name": "y"}
    told: dict[str, Any] = {}
    for name in ("ARX", "ARMAX", "output-error", "Box-Jenkins", "SRIV", "subspace", "continuous"):
        sizes = form if name != "Box-Jenkins" else {**form, "n_denominator": 1}
        model = fit_structure(name, U, answer(), 0.01, {**sizes, "covariance": "white"})
        told[name] = {
            "sizes": [model.numerator.size, model.denominator.size, model.delay],
            "noise": [model.noise_numerator.size, model.noise_denominator.size],
            "dead time": model.dead_time,
            "names": [model.input_name, model.output_name],
        }
    late = fit_structure("continuous", U, answer(delay=4), 0.01, {**form, "delay": 4, "covariance": "white"})
    told["late"] = [late.dead_time, late.numerator.size]
    table = compare_structures(U, answer(), 0.01, {**form, "n_denominator": 2}, ("ARX", "output-error", "SRIV"))
    told["compared"] = {
        str(name): {key: Found(float(value), 0.02) for key, value in row.items()} for name, row in table.iterrows()
    }
    for n in (199, 200, 301):
        fitted, kept = split_record(U[:n], answer()[:n])
        told[f"split of {n}"] = [len(fitted[0][0]), len(kept[0][0]), len(kept[1][0])]
    for count in (2, 3, 4, 8):
        fitted, kept = split_record([U] * count, [NOISE] * count)
        told[f"split of {count} logs"] = [len(fitted[0]), len(kept[0]), len(fitted[0][0]), len(kept[1][0])]
    return told


@NUMBERS.case()
def choices() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, given in {
        "of orders": {"orders": (1, 2, 3), "structures": ("output-error",)},
        "of structures": {"orders": (2,), "structures": ("ARX", "output-error")},
        "of a delay": {"orders": (2,), "structures": ("ARX",), "delay": None},
        "of none": {"orders": (2,), "structures": ("ARX",), "delay": 1, "n_numerator": 3},
    }.items():
        found = choose_model(U, answer(delay=3), 0.01, **given)
        told[name] = {
            **told_of(found.model),
            "orders": None if found.orders is None else len(found.orders),
            "structures": None if found.structures is None else len(found.structures),
        }
    told["refused"] = [
        refused(partial(choose_model, U, NOISE, 0.01, structures=("ARX", "other"))),
        refused(partial(choose_model, U, NOISE, 0.01, structures=())),
        refused(partial(choose_model, U, NOISE, 0.01, orders=())),
    ]
    return told


def record(gaps: bool = False, name: str = "velocity_m_s") -> Record:
    speed = np.where(np.arange(N) % 40 == 7, np.nan, U) if gaps else U
    return Record(0.002, {"motor_speed_rad_s": speed, name: answer()})


@NUMBERS.case()
def records() -> dict[str, Any]:
    form = {"n_numerator": 2, "n_denominator": 2, "delay": 1}
    told: dict[str, Any] = {
        "as it is": told_of(identify_record(record(), sample_time=0.002, **form)),
        "another output": told_of(identify_record(record(name="other"), output="other", sample_time=0.002, **form)),
        "filtered": told_of(identify_record(record(), sample_time=0.002, filter_cutoff_hz=100.0, **form)),
        "coloured": told_of(identify_record(record(), sample_time=0.002, covariance="coloured", **form)),
        "by default": told_of(identify_record(record())),
        "orders": told_of(identify_record(record(), sample_time=0.002, orders=(1, 2), delay=1)),
        "dead time": told_of(identify_record(record(), sample_time=0.002, estimate_dead_time=True)),
    }
    u, y = record_signals(record(gaps=True), sample_time=0.004)
    told["signals"] = [some(u), some(y)]
    position = record(name="position_m")
    told["differentiated"] = some(record_signals(position, sample_time=0.002)[1])
    told["filtered signals"] = [some(one) for one in record_signals(record(), sample_time=0.002, filter_cutoff_hz=40.0)]
    told["says"] = [
        warned(lambda: record_signals(position, sample_time=0.002)),
        warned(lambda: record_signals(record(gaps=True), sample_time=0.002)),
        warned(lambda: identify_record(_rests(), sample_time=0.002, orders=(1, 2))),
        warned(lambda: identify_record(_fed_back(), sample_time=0.002, **form)),
        warned(lambda: identify_record(_fed_back(), sample_time=0.002, filter_cutoff_hz=200.0, **form)),
        warned(lambda: identify_record(_fed_back(), sample_time=0.001, **form)),
    ]
    short = Record(0.002, {"motor_speed_rad_s": np.ones(2), "position_m": np.ones(2)})
    told["refused"] = [refused(lambda: record_signals(short)), refused(lambda: record_signals(short, output="other"))]
    return told


def _rests() -> Record:
    t = 0.002 * np.arange(1500)
    u = 100.0 * np.sin(2.0 * np.pi * 2.0 * t) + 20.0 * np.sign(np.sin(25.0 * t))
    y = np.where(np.abs(u) > 60.0, 0.001 * (u - 60.0 * np.sign(u)), 0.0) + 1e-4 * np.resize(NOISE, 1500)
    return Record(0.002, {"motor_speed_rad_s": u, "velocity_m_s": y})


def _fed_back() -> Record:
    fed = U + np.concatenate([[0.0], 60.0 * NOISE[:-1]])
    y = np.zeros(N)
    for t in range(2, N):
        y[t] = 1.5 * y[t - 1] - 0.7 * y[t - 2] + 0.02 * fed[t - 1]
    return Record(0.002, {"motor_speed_rad_s": fed, "velocity_m_s": y + 2.0 * NOISE})


def closed_loop(share: float) -> Record:
    """Return a log of a closed loop whose input contains a share of the reference."""
    rng = np.random.default_rng(43)
    r, white = np.repeat(rng.choice([-1.0, 1.0], N // 18), 18), 0.2 * rng.normal(size=N)
    u, y, x, noise = np.zeros(N), np.zeros(N), 0.0, 0.0
    for t in range(N):
        noise = 0.9 * noise + white[t]
        y[t] = x + noise
        u[t] = share * r[t] - 2.0 * y[t - 1]
        x = 0.8 * x + 0.2 * u[t]
    return Record(0.01, {"r": r, "u": u, "y": y})


@NUMBERS.case()
def loops_in_two_stages() -> dict[str, Any]:
    told: dict[str, Any] = {}
    options = {"order": 1, "delay": 1}
    driven = closed_loop(1.0)
    for name, references in (("open", ()), ("by its reference", ("r",))):
        (found,), (data,) = identify_columns([driven], ["u"], ["y"], references=references, options=options)
        ((b, f),) = found.model.transfer_functions()
        told[name] = {
            "values": [Found(float(one), 1e-3) for one in (*b, *f)],
            "fit": Found(found.quality.fit_percent, 0.05),
            "notes": {str(one.code): sorted(one.data) for one in found.notes},
            "shares": [Found(float(one.data["share"]), 1e-3) for one in found.notes if "share" in one.data],
            "samples": [data.n_samples, data.sample_time],
        }
    told["hardly driven"] = refused(
        lambda: identify_columns([closed_loop(0.02)], ["u"], ["y"], references=["r"], options=options)
    )
    told["refused"] = [
        refused(lambda: identify_columns([driven], ["u"], ["y"], references=["u"])),
        refused(lambda: identify_columns([driven], ["u"], ["y"], references=["y"])),
    ]
    return told


@pytest.mark.parametrize("case", NUMBERS.cases)
@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning", "ignore::plant.errors.CovarianceWarning")
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
