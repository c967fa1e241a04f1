"""A filter gives bitwise the same result alone and in a batch, whatever its rule and its neighbours."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from estimation.engine.contract import FilterProblem, Trace
from estimation.engine.rule import Rule
from estimation.engine.runner import run_rule
from estimation.filters.batch import filter_batch
from estimation.filters.ckf import CKF
from estimation.filters.ekf import EKF
from estimation.filters.iekf import IEKF
from estimation.filters.run import filter_problem
from estimation.filters.sif import SIF
from estimation.filters.svsf import SVSF
from estimation.filters.ukf import UKF
from estimation.models.eha_forms import FORMS
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from plant.eha.drives import sine
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.errors import HydrostateError
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from tests.thinned import thinned

RULES: dict[str, tuple[Rule, str]] = {
    "ekf": (EKF, "none"),
    "ekf-huber": (EKF, "huber"),
    "ekf-student-t": (EKF, "student-t"),
    "iekf": (IEKF, "none"),
    "ukf": (UKF, "none"),
    "ckf": (CKF, "none"),
    "svsf": (SVSF, "none"),
    "sif": (SIF, "none"),
}
EVERY_RULE = pytest.mark.parametrize(("rule", "robust"), RULES.values(), ids=RULES)
SAMPLES = 701  # not a multiple of the number that the batch lays side by side at a time


def problems(model: ProcessModel, count: int, samples: int = SAMPLES, robust: str = "none") -> list[FilterProblem]:
    """Return filters of one log, each with its own prior, noise and measurements; one sample in ten is missing."""
    rig = EhaParameters()
    drive = sine(samples * 1e-4, 1e-4, rig.rated_speed, 5.0)
    record = simulate(LUMPED, drive, 1e-4, rig, sensors=BENCH, rng=np.random.default_rng(0))
    start = np.array([0.1 * state.scale for state in model.states])
    prior = Gaussian(start, np.diag(start**2))
    base = replace(filter_problem(model, prior, record, rig), robust=robust)
    rng = np.random.default_rng(1)
    made: list[FilterProblem] = []
    for _ in range(count):
        noise = np.sqrt(base.variances) * rng.normal(size=base.measured.shape)
        measured = np.where(rng.random(base.measured.shape) < 0.1, np.nan, base.measured + noise)
        mean = base.mean * rng.uniform(0.5, 2.0, size=base.mean.shape)
        made.append(replace(base, mean=mean, measured=measured, noise=base.noise * rng.uniform(0.5, 2.0)))
    return made


def assert_same_bits(traces: Sequence[Trace], alone: Sequence[Trace]) -> None:
    assert len(traces) == len(alone)
    for one, other in zip(traces, alone, strict=True):
        for name in ("mean", "covariance", "track", "track_variance", "nis", "count", "log_likelihood"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)


def assert_batch_is_alone(rule: Rule, tasks: list[FilterProblem], workers: int = 1) -> None:
    together = list(filter_batch(tasks, rule, workers=workers))
    assert_same_bits(together, [run_rule(rule, task) for task in tasks])
    assert np.all(np.isfinite([trace.mean for trace in together]))


@EVERY_RULE
@pytest.mark.parametrize("count", thinned([33, 40], [33]))
def test_every_rule_gives_the_same_bits_alone_and_in_a_batch(
    linear: ProcessModel, rule: Rule, robust: str, count: int
) -> None:
    assert_batch_is_alone(rule, problems(linear, count, robust=robust))


@pytest.mark.slow
@EVERY_RULE
@pytest.mark.parametrize("form", FORMS)
def test_every_rule_on_every_form_gives_the_same_bits_alone_and_in_a_batch(form: str, rule: Rule, robust: str) -> None:
    assert_batch_is_alone(rule, problems(FORMS[form], 33, robust=robust))


@pytest.mark.parametrize("substeps", [2, 5])
def test_steps_between_samples_give_the_same_bits_alone_and_in_a_batch(linear: ProcessModel, substeps: int) -> None:
    assert_batch_is_alone(EKF, [replace(one, substeps=substeps) for one in problems(linear, 40)])


def test_the_number_of_lanes_of_a_kernel_changes_no_bit(linear: ProcessModel) -> None:
    tasks = problems(linear, 9)
    assert_same_bits(list(filter_batch(tasks, lanes=16)), list(filter_batch(tasks)))


def test_only_samples_that_are_not_missing_are_counted(linear: ProcessModel) -> None:
    tasks = problems(linear, 40)
    tasks[3] = replace(tasks[3], measured=np.nan_to_num(tasks[3].measured, nan=1e-3))
    for task, trace in zip(tasks, filter_batch(tasks), strict=True):
        assert trace.count.tolist() == np.sum(np.isfinite(task.measured), axis=0).tolist()


def test_the_number_of_threads_changes_neither_bits_nor_order(linear: ProcessModel) -> None:
    assert_batch_is_alone(SVSF, problems(linear, 100), workers=2)


def test_problems_are_taken_from_the_iterator_one_block_at_a_time(linear: ProcessModel) -> None:
    drawn: list[int] = []
    tasks = problems(linear, 96, samples=20)
    traces = filter_batch((drawn.append(i) or task for i, task in enumerate(tasks)), EKF)
    next(traces)
    assert len(drawn) == 32


@pytest.mark.parametrize("samples", [2, 7, 8, 9, 16])
def test_short_logs_give_the_same_bits_alone_and_in_a_batch(linear: ProcessModel, samples: int) -> None:
    assert_batch_is_alone(EKF, problems(linear, 33, samples))


def test_the_memory_layout_of_a_log_changes_no_bit(linear: ProcessModel) -> None:
    tasks = problems(linear, 40, samples=50)
    measured = np.concatenate([task.measured for task in tasks], axis=1)
    measured.flags.writeable = False
    lying = [replace(task, measured=measured[:, 2 * k : 2 * k + 2]) for k, task in enumerate(tasks)]
    assert_same_bits(list(filter_batch(lying)), [run_rule(EKF, task) for task in tasks])


def test_full_tracks_are_the_same_alone_and_in_a_batch(linear: ProcessModel) -> None:
    assert_batch_is_alone(EKF, [replace(task, every=1) for task in problems(linear, 33, samples=50)])


def test_an_empty_batch_gives_no_trace() -> None:
    assert list(filter_batch([], EKF)) == []


def test_a_batch_of_different_models_or_settings_is_refused(linear: ProcessModel) -> None:
    first, second = problems(linear, 2, samples=20)
    with pytest.raises(HydrostateError, match="must share one model, got linear and pressure"):
        list(filter_batch([first, replace(second, model=FORMS["pressure"])]))
    with pytest.raises(HydrostateError, match=r"must agree in sample_time, got 0\.0001 and 0\.001"):
        list(filter_batch([first, replace(second, sample_time=1e-3)]))
    with pytest.raises(HydrostateError, match="must agree in robust, got none and huber"):
        list(filter_batch([first, replace(second, robust="huber")]))


def test_a_batch_of_logs_of_different_lengths_is_refused(linear: ProcessModel) -> None:
    first, second = problems(linear, 2, samples=20)
    with pytest.raises(HydrostateError, match="one length, got 20 and 19, drives of 19"):
        list(filter_batch([first, replace(second, measured=second.measured[:-1], drives=second.drives[:-1])]))
    with pytest.raises(HydrostateError, match="one length, got 20 and 20, drives of 19"):
        list(filter_batch([first, replace(second, drives=second.drives[:-1])]))


def test_the_measured_samples_of_a_task_are_not_changed(linear: ProcessModel) -> None:
    rng = np.random.default_rng(0)
    names = ("motor_speed_rad_s", "position_m", "velocity_m_s")
    record = Record(1e-3, {name: rng.normal(size=50) for name in names})
    task = filter_problem(linear, Gaussian(np.zeros(3), np.eye(3)), record, EhaParameters())
    before = task.measured.copy()
    list(filter_batch([task] * 40))
    np.testing.assert_array_equal(task.measured, before)
