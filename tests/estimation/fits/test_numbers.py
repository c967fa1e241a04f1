"""Results of the fits' arithmetic, and of fits to steady logs, kept in `numbers.json`."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from estimation.fits.convolution import convolved, smooth_length
from estimation.fits.greybox.block_averages import averaged_log, block_means, samples_a_block
from estimation.fits.greybox.covariance import _autocovariance, automatic_lags, least_squares_covariance
from estimation.fits.greybox.descent import Point, descend, descend_together
from estimation.fits.greybox.log import GreyBoxLog, OutputNoise
from estimation.fits.root import root_between
from estimation.fits.steady_state_fit import SteadyPoints, fit_friction, fit_leakage, steady_points
from plant.arrays import Array
from plant.log.record import Record
from tests.estimation.fits.short_logs import PAPER, POSITION, PRESSURE, SPEED
from tests.numbers import Numbers

NUMBERS = Numbers(__file__)


@NUMBERS.case()
def means_of_blocks() -> dict[str, Any]:
    values = np.sin(0.3 * np.arange(400.0))
    drives = np.column_stack([values, np.cumsum(values)])
    measured = 3.0 * values[:, None]
    measured[7] = np.nan
    plain = GreyBoxLog(
        drives, measured, np.zeros(3), 1e-4, np.full(400, 1), (OutputNoise(4.0, 2.0, 3.0, "a"),), (0.5, 0.1)
    )
    holes = measured.copy()
    told: dict[str, Any] = {"samples a block": [samples_a_block(step, 1e-3) for step in (1e-4, 4e-4, 7e-4, 3e-3)]}
    for name, every in (("few missing", 400), ("9 blocks of 79 missing", 45), ("8 of 79", 50), ("7 of 79", 58)):
        some = holes.copy()
        some[::every] = np.nan
        found = averaged_log(replace(plain, measured=some), 2.5e-4)
        told[name] = {
            "drives": found.drives[[0, 1, 40, -1]],
            "measured": found.measured[[0, 1, 40, -1], 0],
            "time [s]": found.sample_time,
            "steps": int(found.steps[-1]),
            "noise": asdict(found.noise[0]),
            "noise of drives": list(found.drive_std),
            "length": len(found.drives),
        }
    told["slow logs stay"] = len(averaged_log(replace(plain, sample_time=4e-4), 2.5e-4).drives)
    told["logs with gaps stay"] = len(averaged_log(replace(plain, gaps=np.ones((1, 3))), 2.5e-4).drives)
    told["short logs stay"] = [len(averaged_log(plain.beginning(count), 2.5e-4).drives) for count in (7, 8, 9)]
    told["means"] = block_means(drives, 150)
    return told


@NUMBERS.case()
def roots_and_lengths() -> dict[str, Any]:
    asked: list[float] = []

    def counted(function: Callable[[float], float]) -> Callable[[float], float]:
        def of(x: float) -> float:
            asked.append(x)
            return function(x)

        return of

    functions: Mapping[str, tuple[Callable[[float], float], float, float]] = {
        "cubic": (lambda x: x**3 - 2.0, 0.0, 5.0),
        "steep": (lambda x: np.tanh(40.0 * (x - 0.3)), -4.0, 9.0),
        "flat": (lambda x: (x - 1.0) ** 5, -1.0, 9.0),
        "stepped": (lambda x: 1.0 if x > 0.7 else -3.0, 0.0, 1.0),
        "falling": (lambda x: 1.0 / x - 0.25, 0.1, 90.0),
        "at an end": (lambda x: x - 2.0, 2.0, 5.0),
    }
    told: dict[str, Any] = {}
    for name, (function, low, high) in functions.items():
        asked.clear()
        root = root_between(counted(function), low, high, 1e-9)
        told[name] = {"root": round(root, 7), "asked": len(asked), "third and fourth": asked[2:4]}
    told["smooth lengths"] = [smooth_length(least, (2, 3, 5)) for least in (1, 7, 11, 97, 1001)]
    told["with more primes"] = [smooth_length(least, (2, 3, 5, 7, 11)) for least in (7, 13, 97, 1001)]
    rng = np.random.default_rng(0)
    told["convolved"] = {
        f"{values} by {kernel}": convolved(rng.standard_normal(values), rng.standard_normal(kernel))[[0, 5, -1]]
        for values, kernel in ((20, 1), (20, 7), (900, 7), (3000, 31), (60, 41))
    }
    return told


@NUMBERS.case()
def covariances_of_least_squares() -> dict[str, Any]:
    rng = np.random.default_rng(2)
    white = rng.standard_normal(600)
    coloured = np.convolve(white, [1.0, 0.8, 0.5, 0.2], "same")
    columns = np.column_stack([np.ones(600), np.sin(0.05 * np.arange(600)), 1e-3 * np.arange(600)])
    told: dict[str, Any] = {
        "lags": [automatic_lags(one) for one in (white, coloured, np.cumsum(white), np.zeros(9), coloured[:60])],
        "autocovariance": _autocovariance(coloured, 600, 5),
        "autocovariance over many lags": _autocovariance(coloured, 600, 60)[[0, 1, 20, 60]],
    }
    for name, residual, prior in (("white", white, np.zeros(3)), ("coloured", coloured, np.array([0.0, 50.0, 3.0]))):
        for lags in (0, 10, 80):
            bread, spread = least_squares_covariance(columns, residual, 580, lags, prior)
            told[f"{name}, {lags} lags"] = {
                "bread": bread[np.triu_indices(3)],
                "covariance": spread[np.triu_indices(3)],
            }
    return told


def bowl(centre: Array, curvature: Array, bend: float = 0.0) -> Callable[[Array], Point]:
    def at(theta: Array) -> Point:
        off = theta - centre
        cost = 0.5 * float(off @ curvature @ off) + bend * float(np.sum(off**4))
        return Point(theta, cost, curvature @ off + 4.0 * bend * off**3, curvature)

    return at


@NUMBERS.case(relative=1e-5)
def descents() -> dict[str, Any]:
    curvature = np.array([[4.0, 1.0, 0.2], [1.0, 3.0, 0.5], [0.2, 0.5, 0.9]])
    far = np.array([-50.0] * 3), np.array([50.0] * 3)
    near = np.array([-50.0, -1.0, -0.5]), np.array([0.5, 50.0, 50.0])
    told: dict[str, Any] = {}
    for name, bend, bounds, radius in (
        ("bowl", 0.0, far, 30.0),
        ("bent", 0.3, far, 30.0),
        ("within bounds", 0.3, near, 30.0),
        ("in short steps", 0.3, far, 0.5),
    ):
        asked: list[Array] = []
        bottom = bowl(np.array([1.0, -2.0, 3.0]), curvature, bend)

        def counted(theta: Array, bottom: Callable[[Array], Point] = bottom, asked: list[Array] = asked) -> Point:
            asked.append(theta)
            return bottom(theta)

        found = descend(counted, np.array([9.0, 4.0, -7.0]), 30, bounds, radius=radius)
        told[name] = {
            "cost": round(found.cost, 6),
            "asked": len(asked),
            "first steps": asked[1:4],
            "found": np.round(found.theta, 2),
        }
    wild = Point(np.zeros(3), 1.0, np.array([1.0, -2.0, 0.5]), np.zeros((3, 3)))
    told["where nothing is curved"] = descend(lambda theta: replace_point(wild, theta), np.zeros(3), 3, far).theta
    hopeless = descend_together(
        lambda thetas: [bowl(np.full(3, 9.0), curvature)(one) for one in thetas],
        [np.zeros(3), np.full(3, 8.9)],
        12,
        far,
        wanted=-1e4,
    )
    told["given up"] = [one.cost for one in hopeless]
    return told


def replace_point(point: Point, theta: Array) -> Point:
    return Point(theta, point.cost + float(point.gradient @ theta), point.gradient, point.gram)


@cache
def steady(noise: float = 1.0) -> list[Record]:
    rng = np.random.default_rng(6)
    records: list[Record] = []
    for volts in (0.6, 1.1, 1.7, 2.4, 3.0, -3.6):
        count = 200
        speed = np.full(count, 31.4 * volts) + 0.02 * noise * rng.standard_normal(count)
        v = 31.4 * volts * PAPER.pump_displacement / PAPER.piston_area * 0.93
        pressure = (
            np.sign(volts) * (3e5 + 2.6e6 * abs(v) + 3.7e7 * v * v) + 300.0 * np.arange(count) * np.sign(volts) / count
        )
        position = v * 0.01 * np.arange(count) + 1e-6 * noise * rng.standard_normal(count)
        velocity = np.full(count, v) + 1e-5 * noise * rng.standard_normal(count)
        channels = {
            SPEED: speed,
            PRESSURE: pressure + 400.0 * noise * rng.standard_normal(count),
            POSITION: position,
            "velocity_m_s": velocity,
        }
        records.append(Record(0.01, channels))
    return records


@NUMBERS.case()
def steady_logs() -> dict[str, Any]:
    told: dict[str, Any] = {}
    by_velocity = [one.replace(position_m=None) for one in steady()]
    moving = [
        one.replace(**{PRESSURE: one[PRESSURE] + size * np.linspace(0.0, 1.0, len(one))})
        for one, size in zip(steady(), (0, 100, 200, 300, 400, 2000), strict=True)
    ]
    for name, records, window in (
        ("whole", steady(), 2.0),
        ("half", steady(), 1.0),
        ("velocity", by_velocity, 1.0),
        ("drifting", moving, 1.0),
    ):
        points = steady_points(records, window)
        told[name] = {
            "points": len(points),
            **{part: getattr(points, part)[[0, -1]] for part in SteadyPoints.__dataclass_fields__},
        }
        for law, fit in (("leakage", fit_leakage), ("friction", fit_friction)):
            found = fit(points, PAPER)
            told[name][law] = {one: asdict(c) for one, c in found.coefficients.items()} | {"misfit": found.misfit}
    slow = [
        one.replace(position_m=one[POSITION] * share)
        for one, share in zip(steady(), (0.0, 1e-4, 1e-3, 1e-2, 0.1, 1.0), strict=True)
    ]
    told["points of a piston that all but stands"] = len(steady_points(slow, 2.0))
    points = steady_points(steady(), 1.0)
    drifted = replace(points, drift=points.drift * 300.0, drift_error=points.drift_error + 10.0)
    told["leakage where pressure rises"] = {
        one: asdict(c) for one, c in fit_leakage(drifted, PAPER).coefficients.items()
    }
    return told


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
