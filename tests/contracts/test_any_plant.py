"""Solvers, filters and grey-box fits work on a plant unknown to them: a mass on a spring and a damper."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, make_dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from estimation.filters.methods import METHODS
from estimation.filters.run import run_filter
from estimation.finding import NORMAL_95
from estimation.fits.greybox.fit import fit_greybox
from estimation.fits.greybox.log import greybox_log
from estimation.models.gaussian import Gaussian
from estimation.models.greybox import GreyBoxModel
from estimation.models.model import ProcessModel, StateVariable
from plant.arrays import Array
from plant.compiled.functions import Scalar
from plant.errors import HydrostateError
from plant.log.record import Record
from plant.solvers.adaptive import ErrorControl, controlled_run
from plant.solvers.steps import parameter_names, parameter_row, rk4_step, ros2_step
from plant.solvers.trajectory import trajectory


@dataclass(frozen=True)
class Suspension:
    mass: float = 2.0
    stiffness: float = 800.0
    damping: float = 6.0


def derivative(state: tuple[Scalar, ...], force: Scalar, p: Any) -> tuple[Scalar, ...]:
    x, v = state
    return v, (force - p.damping * v - p.stiffness * x) / p.mass


TRUTH = Suspension()
T = 2e-3
FORCE = np.repeat(np.random.default_rng(3).choice([-40.0, 40.0], size=60), 50)
SCALES = np.array([0.05, 1.0])
NOISE = {"position_m": 1e-3, "velocity_m_s": 2e-2}


def exact(p: Suspension) -> Array:
    """Return the exact states under a force that is linear between samples, from matrix exponentials."""
    A = np.zeros((4, 4))
    A[0, 1] = A[2, 3] = 1.0
    A[1, :3] = np.array([-p.stiffness, -p.damping, 1.0]) / p.mass
    step, states = expm(T * A), np.zeros((len(FORCE), 2))
    for k, rise in enumerate(np.diff(FORCE) / T):
        states[k + 1] = (step @ [*states[k], FORCE[k], rise])[:2]
    return states


@pytest.fixture(scope="module")
def record() -> Record:
    rng, states = np.random.default_rng(5), exact(TRUTH)
    noisy = {
        name: values + NOISE[name] * rng.standard_normal(len(values))
        for name, values in zip(NOISE, states.T, strict=True)
    }
    return Record(T, {"force_n": FORCE, **noisy})


@pytest.mark.parametrize("scheme", [ros2_step, rk4_step])
def test_fixed_steps_follow_the_exact_run(scheme: Any) -> None:
    found = trajectory("suspension", scheme(derivative), np.zeros(2), FORCE, TRUTH, T, longest_step=2e-4)
    assert np.max(np.abs(found - exact(TRUTH)) / SCALES) < 1e-4


def test_steps_of_controlled_error_follow_the_exact_run() -> None:
    control = ErrorControl(derivative, lambda _: SCALES, lambda _: 40.0, lambda _: 1e-3 * T)
    for p in (TRUTH, replace(TRUTH, damping=4e3)):
        row = parameter_row(p)[None, None]
        (found,) = controlled_run("suspension", control, np.zeros((1, 2)), FORCE, row, T, type(p))
        assert np.max(np.abs(found - exact(p)) / SCALES) < 1e-4


def test_a_run_that_does_not_stay_finite_is_refused() -> None:
    runaway = replace(TRUTH, damping=-1e6)
    with np.errstate(all="ignore"), pytest.raises(HydrostateError, match="suspension plant stopped being finite at"):
        trajectory("suspension", rk4_step(derivative), np.ones(2), FORCE, runaway, T, longest_step=2e-4)


def filter_step(state: tuple[Scalar, ...], drives: Any, p: Any, h: Scalar) -> tuple[Scalar, ...]:
    *moving, stiffness = state
    known = SimpleNamespace(mass=p.mass, damping=p.damping, stiffness=stiffness)
    return (*ros2_step(derivative)(tuple(moving), drives, known, h), stiffness)


def seen(state: tuple[Scalar, ...], p: Any) -> Mapping[str, Scalar]:
    del p
    return {"position_m": state[0], "velocity_m_s": state[1]}


MODEL = ProcessModel(
    "suspension",
    (
        StateVariable("position_m", "m", 1e-2, 1e-12),
        StateVariable("velocity_m_s", "m/s", 1e-1, 1e-8),
        StateVariable("stiffness", "N/m", 1e3, 0.0, 1.0, 1e5, logarithmic=True),
    ),
    filter_step,
    seen,
    longest_step=5e-4,
    drives=("force_n",),
    parameters=Suspension,
)
PRIOR = Gaussian(np.array([0.0, 0.0, 400.0]), np.diag([1e-4, 1e-2, 400.0**2]))


@pytest.mark.parametrize("method", ["ekf", "ukf", "smoother", "filterpy-ekf"])
def test_a_filter_finds_a_parameter_that_is_a_state(method: str, record: Record) -> None:
    estimate = run_filter(METHODS[method], MODEL, PRIOR, record, TRUTH)
    found, std = estimate.settled("stiffness")
    assert abs(found - TRUTH.stiffness) < 4.0 * std < 0.02 * TRUTH.stiffness
    assert all(0.8 < nis < 1.25 for nis in estimate.nis.values())


def test_a_filter_accepts_any_object_with_the_parameter_fields(record: Record) -> None:
    bench = make_dataclass("Bench", ["label", "damping", "mass", "stiffness"], frozen=True)
    same = bench(label=7.0, **asdict(TRUTH))
    one, other = (run_filter(METHODS["ekf"], MODEL, PRIOR, record, p) for p in (TRUTH, same))
    np.testing.assert_array_equal(one.mean, other.mean)


def test_a_gap_of_the_drive_is_bridged_if_the_model_has_no_opening(record: Record) -> None:
    holed = FORCE.copy()
    holed[110:120] = np.nan
    estimate = run_filter(METHODS["ekf"], MODEL, PRIOR, record.replace(force_n=holed), TRUTH)
    assert estimate.settled("stiffness")[0] == pytest.approx(TRUTH.stiffness, rel=0.02)


def test_an_opening_for_gaps_of_the_drive_raises_the_likelihood(record: Record) -> None:
    def opening(p: Any, unknown: Mapping[str, Array], sample_time: float) -> tuple[Array, Mapping[str, float]]:
        del sample_time
        return unknown["force_n"], {"velocity_m_s": 1.0 / p.mass}

    switched = int(np.flatnonzero(np.diff(FORCE))[0])
    holed = FORCE.copy()
    holed[switched - 1 : switched + 20] = np.nan
    gap = record.replace(force_n=holed)
    believed, doubted = (
        run_filter(METHODS["ekf"], model, PRIOR, gap, TRUTH, keep_innovations=True)
        for model in (MODEL, replace(MODEL, opening=opening))
    )
    assert doubted.log_likelihood > believed.log_likelihood


GREY = GreyBoxModel(
    name="suspension",
    drives=("force_n",),
    outputs=("position_m", "velocity_m_s"),
    unknowns=("stiffness", "damping"),
    initial=lambda _: (0.0, 0.0),
    rates=lambda state, drives, p, share: derivative(state, drives[0][0] + share * (drives[0][1] - drives[0][0]), p),
    observe=lambda state: (state[0], state[1]),
    parameters=Suspension,
)


def test_a_grey_box_fit_finds_two_parameters_with_their_intervals(record: Record) -> None:
    log = greybox_log(GREY, record, TRUTH, longest_step=5e-4, uncertainties={"mass": 0.02})
    fit = fit_greybox(GREY, log, starts=[{"stiffness": 300.0, "damping": 20.0}])
    for name in GREY.unknowns:
        off, std = abs(fit.values[name] - getattr(TRUTH, name)), fit.std[name]
        assert off < 2.0 * NORMAL_95 * std < 0.02 * getattr(TRUTH, name)
    # a force shows only ratios to the mass, and the mass is known to 2 %
    assert fit.rig_slopes["mass"]["stiffness"] / fit.values["stiffness"] < 1.0
    assert fit.chi_square == pytest.approx((1.0, 1.0), abs=0.1)


def test_a_parameter_row_follows_the_order_of_the_fields_and_reserved_names_are_refused() -> None:
    assert parameter_names(Suspension) == ("mass", "stiffness", "damping")
    assert parameter_row(TRUTH).tolist() == [2.0, 800.0, 6.0]
    assert parameter_row(SimpleNamespace(damping=1.0, stiffness=2.0, mass=3.0), Suspension).tolist() == [3.0, 2.0, 1.0]
    with pytest.raises(HydrostateError, match="Short must not call a parameter 'h'"):
        parameter_names(make_dataclass("Short", ["mass", "h"]))
