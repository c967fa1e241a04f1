"""Sensitivity of innovations to assumptions, and tuned noise levels, kept in `numbers.json`."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from estimation.engine.contract import FilterProblem
from estimation.engine.layout import layout
from estimation.engine.runner import aligned_array, constant_row
from estimation.filters.ekf import EKF, ekf
from estimation.filters.run import filter_problem
from estimation.log_checks.first_belief import first_belief
from estimation.models.eha_forms import PRESSURE_FORM
from estimation.tuning import tuning
from estimation.tuning.scoring import Coordinate, maximise
from estimation.tuning.sensitivity import innovation_sensitivity
from estimation.tuning.tuning import noise_coordinates, speed_noise, tune
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH, drop_samples
from tests.numbers import Numbers, Roughly

NUMBERS = Numbers(__file__)
RIG = EhaParameters()
MOVED = ("bulk_modulus", "leakage_coefficient", "friction_coulomb", "q1", "q2", "r0", "r1")


@cache
def log() -> Record:
    rng = np.random.default_rng(3)
    record = simulate(LUMPED, make_drive("steps", 0.4, 1e-3, RIG, rng), 1e-3, RIG, sensors=BENCH, rng=rng)
    return drop_samples(record, 0.05, rng, ["position_m", "velocity_m_s"])


@cache
def task() -> FilterProblem:
    return filter_problem(PRESSURE_FORM, first_belief(PRESSURE_FORM, log(), 1.9e8, 1e8), log(), RIG)


@NUMBERS.case(relative=1e-5)
def innovations_and_their_slopes() -> dict[str, Any]:
    names, row = layout(EKF, PRESSURE_FORM, task().channels).rows, constant_row(task(), {})
    directions = np.zeros((len(row), len(MOVED)))
    places = [names.index(name) for name in MOVED]
    directions[places, range(len(MOVED))] = row[places]
    found = innovation_sensitivity(task(), directions)
    trace = ekf(task())
    width = len(PRESSURE_FORM.states)
    belief = np.zeros((width + width * (width + 1) // 2, 1))
    belief[[0, width]] = 1.0
    begun = innovation_sensitivity(task(), np.zeros((len(row), 1)), belief)
    return {
        "row": dict(zip(names, row, strict=True)),
        "residuals": {channel: found.residuals[[0, 9, 200, 399], c] for c, channel in enumerate(task().channels)},
        "variances": {channel: found.variances[[0, 9, 200, 399], c] for c, channel in enumerate(task().channels)},
        "slopes": {
            name: {channel: found.residual_slopes[[9, 200, 399], c, k] for c, channel in enumerate(task().channels)}
            for k, name in enumerate(MOVED)
        },
        "slopes of variances": {
            name: {channel: found.variance_slopes[[9, 399], c, k] for c, channel in enumerate(task().channels)}
            for k, name in enumerate(MOVED)
        },
        "by the prior": {channel: begun.residual_slopes[[0, 1, 20], c, 0] for c, channel in enumerate(task().channels)},
        "log-likelihood": [found.log_likelihood, trace.log_likelihood],
        "NIS": found.nis,
        "scores": dict(zip(MOVED, found.scores.sum(axis=0), strict=True)),
        "information": {
            name: {other: found.information[k, i] for i, other in enumerate(MOVED)} for k, name in enumerate(MOVED)
        },
        "belief": {state.name: one for state, one in zip(PRESSURE_FORM.states, trace.mean, strict=True)},
        "variances of the belief": {
            state.name: one for state, one in zip(PRESSURE_FORM.states, np.diag(trace.covariance), strict=True)
        },
        "counts": trace.count,
        "aligned": [aligned_array(3, 5).ctypes.data % 64, *aligned_array(3, 5).shape],
    }


@NUMBERS.case()
def coordinates_of_noise() -> dict[str, Any]:
    made = noise_coordinates(task(), log(), RIG)
    begun, guessed = tuning._likeliest_start(task(), made)
    paper = tuning._task_with_published_noise(task())
    continued, moved = tuning._task_with_found_constants(task(), ekf(task()))
    return {
        "coordinates": {
            one.name: {"place": one.place, "guess": one.guess, "floor": one.floor, "spread": one.spread} for one in made
        },
        "values": [list(Coordinate("r0", 0, 3.0, floor=1.0).value(u)) for u in (0.0, 1.0, -60.0)]
        + [list(Coordinate("x", 0, 3.0, 0.5).value(u)) for u in (0.0, 2.0)],
        "far up": Coordinate("r0", 0, 3.0).value(60.0)[0],
        "start": {one.name: one.guess for one in guessed},
        "start of constants": begun.mean,
        "published": {
            "noise": {state.name: one for state, one in zip(PRESSURE_FORM.states, paper.noise, strict=True)},
            "variances": dict(zip(paper.channels, paper.variances.tolist(), strict=True)),
        },
        "continued": [moved, continued.mean],
        "noise of speed [Pa^2/s]": [speed_noise(log(), RIG), speed_noise(log(), RIG, 0.01)],
    }


@NUMBERS.case(relative=2e-2)
def where_the_search_ends() -> dict[str, Any]:
    names = layout(EKF, PRESSURE_FORM, task().channels).rows
    some = [
        Coordinate("r1", names.index("r1"), 4.0 * float(task().variances[1]), spread=3.0),
        Coordinate("friction_coulomb", names.index("friction_coulomb"), 400.0, 20.0, spread=2.0),
    ]
    found = maximise(task(), some, 30)
    short = log().slice(0, 250)
    tuned = tune(short, PRESSURE_FORM, first_belief(PRESSURE_FORM, short, 1.9e8, 1e8), RIG)
    return {
        "ends": {one.name: one.guess for one in found.coordinates},
        "objective": found.objective,
        "information": [found.information[0, 0], found.information[1, 1]],
        "converged": [found.converged, maximise(task(), some, 1).converged],
        "tuned variances": dict(tuned.tuned.variances),
        "given": {
            "noise": dict(tuned.given.noise),
            "variances": dict(tuned.given.variances),
            "log-likelihood": tuned.given.log_likelihood,
            "nis": dict(tuned.given.nis),
        },
        "published": {"log-likelihood": tuned.published.log_likelihood, "nis": dict(tuned.published.nis)},
        "log-likelihood": tuned.tuned.log_likelihood,
        "spreads": {name: Roughly(one, 0.1) for name, one in tuned.spread.items()},
        "prior [Pa]": Roughly(float(tuned.prior.mean[-1]), 0.02),
        "limits": [tuning.NOISE_SPREAD, tuning.ROUNDS, tuning.LARGEST_CONSTANT_MOVE],
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
