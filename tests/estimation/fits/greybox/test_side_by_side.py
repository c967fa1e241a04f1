"""Residuals of parameter sets that run side by side equal those of single runs."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from estimation.fits.flow.accumulator import presumed_stiffness
from estimation.fits.greybox import freed_problem, nudges, side_by_side
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.gap_loops import residuals_across_gaps
from estimation.fits.greybox.log import greybox_log
from estimation.fits.greybox.loops import RUNAWAY
from estimation.fits.greybox.nudges import NUDGE
from estimation.fits.greybox.problem import OUTLIER, Problem
from estimation.fits.greybox.side_by_side import LANES, MOST_LANES, compile_side_by_side
from estimation.fits.greybox.side_by_side_loops import residuals_side_by_side
from estimation.fits.hypotheses import HYPOTHESES
from estimation.fits.hypothesis_search.wide_log import usual_values, widened_log
from estimation.fits.hypothesis_search.wide_problem import hypothesis_problem
from estimation.models.flow import FLOW_FORM, HELD_FLOW_FORM, MASS_FLOW_FORM
from estimation.models.flow_parameters import flow_parameters
from estimation.models.greybox import GreyBoxModel
from estimation.models.wide_flow import TURBULENT_FLOW_FORM, WIDE_FLOW_FORM, WideFlowParameters
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.sensors.sensors import BENCH
from plant.solvers.steps import parameter_names, parameter_row
from tests.kernels import functions_of, on_memory, text_of

HEALTHY = EhaParameters()
VARIANCES = {"motor_speed_rad_s": 1e-4, "position_m": 1e-12, "differential_pressure_pa": 1e7}


@pytest.fixture(scope="module")
def problem() -> FreedProblem:
    rng = np.random.default_rng(3)
    record = simulate(CIRCUIT, make_drive("steps", 1.0, 1e-3, HEALTHY, rng), 1e-3, HEALTHY, sensors=BENCH, rng=rng)
    pressure = record["differential_pressure_pa"].copy()
    pressure[[20, 21, 22, 23, 300]] = np.nan
    record = record.replace(differential_pressure_pa=pressure)
    log = greybox_log(FLOW_FORM, record, flow_parameters(HEALTHY), longest_step=2.5e-4, variances=VARIANCES)
    both_sides = [one for one in HYPOTHESES if one.name != "single_rod"]  # its slopes use a longer step
    return hypothesis_problem(widened_log(replace(log, presumed=presumed_stiffness(HEALTHY, {})), HEALTHY), both_sides)


def points(problem: FreedProblem, count: int) -> np.ndarray:
    usual = problem.model.theta({**usual_values(problem.log), "case_leakage": 1e-13, "speed_lead": 1e-5})
    return usual + 0.02 * np.random.default_rng(4).standard_normal((count, len(usual)))


def alone(problem: FreedProblem, theta: np.ndarray) -> np.ndarray:
    """Return the residuals of one run by the kernel that also computes sensitivities."""
    row = problem.log.parameters.copy()
    for name, value in problem.model.values(theta).items():
        row[parameter_names(WideFlowParameters).index(name)] = value
    return Problem(replace(TURBULENT_FLOW_FORM, jump=()), problem.log).residuals(np.empty(0), parameters=row)


def test_several_points_together_cost_what_each_costs_alone(problem: FreedProblem) -> None:
    thetas = points(problem, 3)
    for theta, point in zip(thetas, problem.at_each(thetas), strict=True):
        here = alone(problem, theta).ravel()
        assert np.max(np.abs(here)) > 1.0
        weight = np.minimum(1.0, OUTLIER / np.maximum(np.abs(here), OUTLIER))
        known = 0.5 * problem.prior @ (theta - problem.presumed) ** 2
        assert point.cost == pytest.approx(float(np.sum((1.0 - 0.5 * weight) * weight * here**2) + known), rel=1e-7)
        assert point.gradient == pytest.approx(problem.at(theta).gradient, rel=1e-12)


def test_the_residuals_of_one_point_are_those_of_a_run_alone(problem: FreedProblem) -> None:
    (theta,) = points(problem, 1)
    np.testing.assert_allclose(problem.residuals(theta), alone(problem, theta), rtol=1e-7, atol=1e-7)


def test_the_normal_equations_are_those_of_residuals_one_by_one(problem: FreedProblem) -> None:
    (theta,) = points(problem, 1)
    assert len(theta) + 1 > LANES
    point, here = problem.at(theta), alone(problem, theta).ravel()
    small = np.abs(here) < OUTLIER
    for i in (0, 1, len(theta) - 1):
        nudged = theta.copy()
        nudged[i] += NUDGE
        slope = (alone(problem, nudged).ravel() - here) / NUDGE
        weight = np.where(small, 1.0, OUTLIER / np.maximum(np.abs(here), OUTLIER))
        expected = float(slope @ (weight * here)) + problem.prior[i] * (theta[i] - problem.presumed[i])
        assert point.gradient[i] == pytest.approx(expected, rel=1e-3, abs=1e-3)


def test_a_run_that_diverges_keeps_finite_residuals_and_does_not_affect_its_neighbours(problem: FreedProblem) -> None:
    mad = problem.log.parameters.copy()
    mad[parameter_names(WideFlowParameters).index("chamber_volume")] = np.nan
    run = compile_side_by_side(replace(WIDE_FLOW_FORM, jump=()), LANES)
    log, rows = problem.log, np.repeat(problem.log.parameters[None], LANES, axis=0)
    rows[3] = mad
    errors = np.zeros((1, len(log.measured), LANES))
    noise = log.noise[0]
    run(
        rows,
        log.drives[..., None],
        log.measured,
        log.sample_time,
        log.steps,
        1,
        np.array([noise.variance]),
        np.zeros((1, 1)),
        np.zeros((1, 1)),
        1.0,
        errors,
    )
    assert np.max(np.abs(errors[..., 3])) == RUNAWAY
    others = np.delete(errors, 3, axis=-1)
    assert np.all(others == others[..., :1])
    assert np.max(np.abs(others)) < RUNAWAY


@pytest.mark.parametrize(
    "form",
    [FLOW_FORM, replace(MASS_FLOW_FORM, jump=()), replace(HELD_FLOW_FORM, jump=())],
    ids=lambda form: form.name,
)
def test_finite_differences_give_the_normal_equations_of_exact_derivatives(
    problem: FreedProblem, form: GreyBoxModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(nudges, "NUDGE", 3e-7)  # exact derivatives do not see beyond the next corner
    p = flow_parameters(HEALTHY)
    log = replace(problem.log, drives=problem.log.drives[:, :2], parameters=parameter_row(p))
    start = {"case_leakage": 1e-13, "speed_lead": 1e-5, "accumulator_stiffness": 1e8, "makeup_opening": 1e3}
    theta = form.theta({**vars(p), **start})
    near, exact = FreedProblem.of(form, log).at(theta), Problem(form, log).at(theta)
    assert near.cost == pytest.approx(exact.cost, rel=1e-9)
    assert near.gradient == pytest.approx(exact.gradient, rel=1e-4, abs=1e-4 * np.max(np.abs(exact.gradient)))
    scale = np.sqrt(np.outer(np.diag(exact.gram), np.diag(exact.gram)))
    np.testing.assert_allclose(near.gram / scale, exact.gram / scale, atol=1e-4)


def test_costs_without_slopes_are_those_with_them(problem: FreedProblem) -> None:
    thetas = [*points(problem, 3)]
    assert problem.costs(thetas) == pytest.approx([problem.at(theta).cost for theta in thetas], rel=1e-9)


@pytest.mark.parametrize("count", [LANES - 1, LANES + 3, MOST_LANES + 2])
def test_any_number_of_points_is_run(problem: FreedProblem, count: int) -> None:
    thetas = [*points(problem, count)]
    together = problem.costs(thetas)
    assert len(together) == count
    for place in (0, count - 1):
        assert together[place] == pytest.approx(problem.at(thetas[place]).cost, rel=1e-9)


def test_the_last_two_points_are_not_run_again(problem: FreedProblem, monkeypatch: pytest.MonkeyPatch) -> None:
    own, (first, second, third) = problem.on(problem.log), points(problem, 3)
    fresh = [problem.on(problem.log).linearised(theta) for theta in (first, second)]
    for theta in (third, first, second):
        own.at(theta)
    monkeypatch.setattr(own, "_side_by_side", lambda *_: pytest.fail("this point was run"))
    for theta, (errors, slopes) in zip((first, second), fresh, strict=True):
        found = own.linearised(theta)
        np.testing.assert_array_equal(found[0], errors)
        np.testing.assert_array_equal(found[1], slopes)
    with pytest.raises(pytest.fail.Exception, match="this point was run"):
        own.at(third)


def test_a_point_near_a_known_one_is_extrapolated_by_its_slopes_on_request(
    problem: FreedProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    own, (theta,) = problem.on(problem.log), points(problem, 1)
    own.near, slopes = 0.2, own.slopes(theta)
    near, far = (theta + size * np.eye(len(theta))[0] / np.linalg.norm(slopes[:, 0]) for size in (0.19, 0.21))
    _, sizes, along = np.linalg.svd(slopes, full_matrices=False)
    bent = theta + (along * (0.19 / sizes)[:, None])[sizes > 0.05][-1]  # effects cancel; logarithms are nonlinear
    exact = problem.on(problem.log).at(near)
    monkeypatch.setattr(own, "_side_by_side", lambda *_: pytest.fail("this point was run"))
    assert own.at(near).cost == pytest.approx(exact.cost, abs=1e-2)
    for one in (far, bent):
        with pytest.raises(pytest.fail.Exception, match="this point was run"):
            own.at(one)


def test_residuals_under_several_rigs_are_those_of_each(problem: FreedProblem) -> None:
    (theta,) = points(problem, 1)
    wider = problem.log.parameters.copy()
    wider[parameter_names(WideFlowParameters).index("piston_area")] *= 1.01
    both = problem.residuals_of(theta, [problem.log.parameters, wider])
    assert np.max(np.abs(both[1] - both[0])) > 0.1
    for found, row in zip(both, (problem.log.parameters, wider), strict=True):
        np.testing.assert_allclose(found, problem.residuals(theta, parameters=row), rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("own", [False, True], ids=["one_drive", "drives_of_each"])
def test_the_loop_run_as_python_gives_what_its_kernel_gives(
    problem: FreedProblem, own: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    n, rng = 10, np.random.default_rng(5)
    rows = parameter_row(flow_parameters(HEALTHY)) * (1.0 + 0.01 * rng.standard_normal((LANES, 1)))
    drives = problem.log.drives[200 : 200 + n, :2, None] * (1.0 + 0.1 * np.arange(LANES if own else 1))
    measured = problem.log.measured[200 : 200 + n].copy()
    measured[4:6] = np.nan
    given = measured, 1e-3, np.array([0, *[2] * (n - 3), 3, 3]), 2, np.array([1e7])
    given = *given, np.array([[1e6, 0.0, 2e6]]), np.array([[0.0, 3e7]]), 0.9
    form = replace(FLOW_FORM, jump=())
    text = text_of(monkeypatch, side_by_side, lambda: compile_side_by_side.__wrapped__(form, LANES))
    file = functions_of(text)
    plain = SimpleNamespace(**vars(file))
    plain.VECTOR = 1
    for name in ("begin", "settle", "step", "show"):
        setattr(plain, f"{name}_at", on_memory(file, getattr(file, name)))
    found, wanted = (np.full((1, n // 2, LANES), np.nan) for _ in range(2))
    residuals_side_by_side(plain, rows, drives, *given, found)
    compile_side_by_side(form, LANES)(rows, drives, *given, wanted)
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9)


def test_other_drives_of_a_long_log_are_run_one_by_one(problem: FreedProblem, monkeypatch: pytest.MonkeyPatch) -> None:
    (theta,) = points(problem, 1)
    drives = [problem.log.drives, 1.001 * problem.log.drives]
    together = list(problem.disturbed(theta, drives))
    monkeypatch.setattr(problem, "disturbed_together", lambda *_: pytest.fail("these drives were run together"))
    monkeypatch.setattr(freed_problem, "MOST_SIDE_BY_SIDE", len(problem.log.drives) - 1)
    np.testing.assert_allclose(list(problem.disturbed(theta, drives)), together, rtol=1e-7, atol=1e-7)
    monkeypatch.setattr(freed_problem, "MOST_SIDE_BY_SIDE", len(problem.log.drives))
    with pytest.raises(pytest.fail.Exception, match="run together"):
        list(problem.disturbed(theta, drives))


@pytest.fixture(scope="module")
def gapped(problem: FreedProblem) -> FreedProblem:
    """Return a problem with two gaps in motor speed; pressure is missing in the first."""
    log = replace(problem.log, drives=problem.log.drives[:, :2], parameters=parameter_row(flow_parameters(HEALTHY)))
    return FreedProblem.of(FLOW_FORM, replace(log, gaps=np.array([[18.0, 24.0, 1e9], [300.0, 340.0, 1e12]])))


def test_runs_side_by_side_across_gaps_equal_single_runs(gapped: FreedProblem) -> None:
    values = {**vars(flow_parameters(HEALTHY)), "case_leakage": 1e-13, "speed_lead": 1e-5, "makeup_opening": 1e3}
    theta, rng = gapped.model.theta(values), np.random.default_rng(4)
    rows = [gapped.log.parameters * rng.uniform(0.95, 1.05, len(gapped.log.parameters)) for _ in range(LANES + 2)]
    together = gapped.residuals_of(theta, rows)
    for errors, row in zip(together, rows, strict=True):
        np.testing.assert_allclose(errors, gapped.residuals(theta, parameters=row), rtol=1e-7, atol=1e-7)
    bridged = gapped.on(replace(gapped.log, gaps=np.empty((0, 3))))
    assert np.max(np.abs(bridged.residuals(theta, parameters=rows[0]) - together[0])) > 1.0
    drives = [gapped.log.drives, 1.001 * gapped.log.drives]
    for errors, one in zip(gapped.disturbed(theta, drives), drives, strict=True):
        np.testing.assert_allclose(errors, gapped.residuals(theta, drives=one), rtol=1e-7, atol=1e-7)


def test_the_loop_across_gaps_run_as_python_gives_what_its_kernel_gives(
    problem: FreedProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    n, rng = 10, np.random.default_rng(5)
    rows = parameter_row(flow_parameters(HEALTHY)) * (1.0 + 0.01 * rng.standard_normal((LANES, 1)))
    rows[:, parameter_names(FLOW_FORM.parameters).index("leakage_coefficient")] *= np.geomspace(1.0, 1e4, LANES)
    measured = problem.log.measured[200 : 200 + n].copy()
    measured[4:6] = np.nan
    given = problem.log.drives[200 : 200 + n, :2, None], measured, 1e-3, np.array([0, *[2] * (n - 3), 3, 3]), 2
    given = *given, np.array([1e7]), np.array([[1e6, 0.0, 2e6]]), np.array([[0.0, 3e7]]), 0.9
    given = *given, np.array([[0.0, 1.0, 1e6], [3.0, 5.0, 1e10]])
    text = text_of(monkeypatch, side_by_side, lambda: compile_side_by_side.__wrapped__(FLOW_FORM, LANES))
    file = functions_of(text)
    plain = SimpleNamespace(**vars(file))
    plain.VECTOR = 1
    for name in ("begin", "settle", "step", "open_step", "show"):
        setattr(plain, f"{name}_at", on_memory(file, getattr(file, name)))
    found, wanted = (np.full((1, n // 2, LANES), np.nan) for _ in range(2))
    residuals_across_gaps(plain, rows, *given, found)
    compile_side_by_side(FLOW_FORM, LANES)(rows, *given, wanted)
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9)


def asked_for(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Record the lanes of each kernel that a problem requests."""
    asked: list[int] = []

    def noted(model: GreyBoxModel, lanes: int) -> object:
        asked.append(lanes)
        return compile_side_by_side(model, lanes)

    monkeypatch.setattr(freed_problem, "compile_side_by_side", noted)
    return asked


def test_disturbed_drives_use_the_kernel_of_the_slopes(problem: FreedProblem, monkeypatch: pytest.MonkeyPatch) -> None:
    log = replace(problem.log, drives=problem.log.drives[:, :2], parameters=parameter_row(flow_parameters(HEALTHY)))
    held = FreedProblem.of(HELD_FLOW_FORM, log)
    values = {**vars(flow_parameters(HEALTHY)), "case_leakage": 1e-13, "speed_lead": 1e-5, "makeup_opening": 1e3}
    theta = HELD_FLOW_FORM.theta({**values, "accumulator_stiffness": 1e8})
    assert len(theta) < LANES
    drives = log.drives[..., None] * (1.0 + 1e-3 * np.arange(MOST_LANES))
    asked = asked_for(monkeypatch)
    held.at(theta)
    found = held.disturbed_together(theta, drives)
    assert asked == [LANES]
    for place in (0, LANES, MOST_LANES - 1):
        one = held.residuals(theta, drives=np.ascontiguousarray(drives[..., place]))
        np.testing.assert_allclose(found[..., place], one, rtol=1e-7, atol=1e-7)


def test_slopes_beside_known_ones_use_the_kernel_of_all_slopes(
    problem: FreedProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    (theta,) = points(problem, 1)
    own = problem.on(problem.log)
    asked = asked_for(monkeypatch)
    whole = own.at(theta)
    _, slopes = own.linearised(theta)
    known = dict(zip(own.model.unknowns, slopes.T, strict=True))
    del known[own.model.unknowns[2]]
    beside = own.at_beside(theta, known)
    assert asked == [MOST_LANES]
    assert beside.cost == pytest.approx(whole.cost, rel=1e-12)
    assert beside.gradient == pytest.approx(whole.gradient, rel=1e-9, abs=1e-9 * np.max(np.abs(whole.gradient)))


def test_costs_can_be_computed_by_the_kernel_of_a_search(
    problem: FreedProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    thetas, own = [*points(problem, LANES + 3)], problem.on(problem.log)
    asked = asked_for(monkeypatch)
    found = own.costs(thetas, LANES)
    assert asked == [LANES]
    np.testing.assert_array_equal(found, problem.costs(thetas))


def test_costs_of_many_points_are_summed_in_batches_of_one_kernel(
    problem: FreedProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    widths, summed = [], freed_problem._misfits
    monkeypatch.setattr(freed_problem, "_misfits", lambda errors: widths.append(errors.shape[-1]) or summed(errors))
    assert len(problem.costs([*points(problem, 2 * LANES + 3)], LANES)) == 2 * LANES + 3
    assert widths == 3 * [LANES]


def test_a_model_is_traced_once_for_kernels_of_all_widths(monkeypatch: pytest.MonkeyPatch) -> None:
    traced: list[GreyBoxModel] = []
    step = side_by_side.model_step
    monkeypatch.setattr(side_by_side, "model_step", lambda model, *given: traced.append(model) or step(model, *given))
    form = replace(FLOW_FORM, name="another_name")
    texts = [
        text_of(monkeypatch, side_by_side, lambda: compile_side_by_side.__wrapped__(form, LANES)),
        text_of(monkeypatch, side_by_side, lambda: compile_side_by_side.__wrapped__(form, MOST_LANES)),
    ]
    assert traced == [form]
    assert texts[0] != texts[1]
