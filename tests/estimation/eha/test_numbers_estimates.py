"""Estimates of a short log by each method, kept in `numbers_estimates.json`."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from estimation.eha import chamber_bank
from estimation.eha.bulk_modulus import estimate_bulk_modulus
from estimation.eha.by_flow_filter import BIASES, LEAKAGES, MODULI, drive_noise
from estimation.eha.chamber_bank import Member
from estimation.eha.estimate import estimate_log
from estimation.engine.contract import FilterProblem
from estimation.filters.run import filter_problem
from estimation.log_checks.first_belief import first_belief
from estimation.models.eha_forms import PRESSURE_FORM
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import LUMPED, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from tests.edges import edge
from tests.numbers import Found, Numbers, Roughly

NUMBERS = Numbers(__file__)
P = EhaParameters()


@cache
def log(seconds: float = 1.5) -> Record:
    rng = np.random.default_rng(3)
    return simulate(LUMPED, make_drive("steps", seconds, 1e-3, P, rng), 1e-3, P, sensors=BENCH, rng=rng)


def told(record: Record, **options: Any) -> dict[str, Any]:
    found = estimate_bulk_modulus(record, P, **options)
    known = found.value is not None and found.std is not None
    return {
        "value [Pa]": Found(found.value, found.std)
        if known and found.value is not None and found.std is not None
        else None,
        "outcome": found.outcome.name,
        "form": found.form,
        "method": found.method,
        "gate": found.gate.passed,
        "reasons": [str(one.code) for one in found.gate.reasons],
    }


@NUMBERS.case()
def estimates_by_each_method() -> dict[str, Any]:
    blind = log().replace(differential_pressure_pa=None)
    return {
        "by fit": told(log()),
        "by fit, without pressure": told(blind),
        "by chamber filter": told(log(), method="chamber-ekf"),
        "by filter, pressure form": told(log(), form="pressure", method="ekf"),
        "by filter, without pressure": told(blind, form="pressure", method="ekf"),
        "by filter, acceleration form": told(log(), form="acceleration", method="ekf"),
        "of a log that stands": told(
            log(0.3).replace(
                motor_speed_rad_s=np.zeros(300),
                position_m=np.zeros(300),
                velocity_m_s=np.zeros(300),
            )
        ),
    }


@NUMBERS.case()
def finding_of_a_log() -> dict[str, Any]:
    found = estimate_log(log(), Rig())
    return {
        "outcome": found.outcome.name,
        "quantities": {
            name: {
                "unit": one.unit,
                "value": None if one.value is None or one.std is None else Found(one.value, one.std),
                "total": one.ci95_total is not None,
            }
            for name, one in found.quantities.items()
        },
        "total width": Roughly(float(np.diff(found.quantities["bulk_modulus"].ci95_total or (0.0, 0.0))[0]), 0.02),
        "gate": found.gate.passed,
        "not told": [str(one.code) for one in found.not_told],
        "channels": list(found.channels),
    }


@cache
def task() -> FilterProblem:
    return filter_problem(PRESSURE_FORM, first_belief(PRESSURE_FORM, log(), 1.9e8, 1e8), log(), P)


def member(mean: float, score: float = 0.0, deviation: float = 1.0) -> Member:
    width = len(task().mean)
    return Member(task(), task().mean + mean * (np.arange(width) == width - 1), deviation**2 * np.eye(width), score)


@NUMBERS.case()
def banks_of_chamber_filters() -> dict[str, Any]:
    near, width = (len(task().mean) - 1,), len(task().mean)
    many = [member(3.0 * k, -0.5 * k) for k in range(70)]

    def kept(end: int, samples: int = 5000) -> int:
        return len(chamber_bank._survivors(many, near, end, samples))  # pyright: ignore[reportPrivateUsage]

    part = chamber_bank._block_task(task(), 5, 12)  # pyright: ignore[reportPrivateUsage]
    first = chamber_bank._block_task(task(), 0, 4)  # pyright: ignore[reportPrivateUsage]
    mean, variance = chamber_bank._mixture_moments(
        np.array([0.2, 0.8, 1e-14]), np.array([[[0.0]], [[4.0]], [[1e9]]]), np.ones((3, 1, 1))
    )  # pyright: ignore[reportPrivateUsage]
    read = chamber_bank.run_bank([member(0.0), member(0.4, -1.0), member(-0.8, -2.0)], near)
    return {
        "ends": [
            chamber_bank._block_ends(samples, every, step)
            for samples, every, step in ((1500, 1, 1e-3), (40000, 10, 1e-3), (12, 5, 1e-3), (300, 7, 0.1))
        ],  # pyright: ignore[reportPrivateUsage]
        "heard": [kept(end) for end in (100, 499, 500, 999, 1000, 1999)],
        "part": [len(part.measured), bool(np.isnan(part.measured[0]).all()), float(part.drives[0, 0])],
        "first part": [len(first.measured), bool(np.isnan(first.measured[0]).any())],
        "weights": chamber_bank._weights([member(0.0, -1e4), member(0.0, -1e4 + 1.0)]),  # pyright: ignore[reportPrivateUsage]
        "mixed": [mean[0, 0], variance[0, 0]],
        "none is sound": chamber_bank._mixture_moments(np.ones(1), np.full((1, 1, 1), np.nan), np.ones((1, 1, 1)))[0],  # pyright: ignore[reportPrivateUsage]
        "one from": edge(lambda one: chamber_bank._count_as_one(member(one), member(0.0, 0.0, 2.0), near), 0.1, 9.0),  # pyright: ignore[reportPrivateUsage]
        "apart": len(chamber_bank._distinct_filters([member(0.3 * k) for k in range(9)], near)),  # pyright: ignore[reportPrivateUsage]
        "online": {str(k): read.online.track[[0, 700, -1], k] for k in range(width)},
        "online, variances": {str(k): read.online.track_variance[[700, -1], k] for k in range(width)},
        "at the end": {"mean": read.online.mean, "log-likelihood": read.again.log_likelihood},
        "guesses of the bank": {"moduli [Pa]": list(MODULI), "leakages": list(LEAKAGES), "biases": list(BIASES)},
        "noise of the drive": [
            drive_noise(log(), P),
            drive_noise(log(), P, {"motor_speed_rad_s": 0.01, "position_m": 1e-12, "differential_pressure_pa": 1e8}),
        ],
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
