"""The gate passes a filter that is right, and objects to one that is wrong, with a reason."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from estimation.eha.bulk_modulus import estimate_bulk_modulus
from estimation.filters.ekf import ekf
from estimation.filters.run import Estimate, run_filter
from estimation.finding import Gate, Outcome
from estimation.log_checks.first_belief import PRESSURE_NOISE_LOGGED, first_belief
from estimation.models.eha_forms import BULK_MODULUS, FORMS, PRESSURE_FORM
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from estimation.notes import ChannelCode, EstimateCode
from estimation.trust.consistency import consistency_gate, describes_log, mean_chi_square_bounds, nees, wander
from estimation.trust.whiteness import SETTLING
from faults.conditions import CONDITIONS, parameters_for
from plant.arrays import Array
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, LUMPED, REDUCED, Plant, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from tests.thinned import thinned

RUNS, SAMPLES, SUBSTEPS = 100, 40, 40
RIG = EhaParameters()
VARIANCES = {"position_m": 1e-6, "velocity_m_s": 1e-4}
EVERY_CONDITION = pytest.mark.parametrize(
    "condition", thinned(CONDITIONS, ["normal", "major_friction", "major_leakage_minor_friction"])
)
PRIOR = Gaussian(np.array([0.1, -0.2, 0.5]), np.diag([1e-4, 1e-2, 1.0]))


def true_run(model: ProcessModel, H: Array, F: Array, rng: np.random.Generator) -> tuple[Record, Array]:
    """Draw a start from the prior, drive the linear system with its own process noise, and measure it."""
    state = rng.multivariate_normal(PRIOR.mean, PRIOR.covariance)
    deviations = np.sqrt(np.array([variable.noise_density for variable in model.states]) * 0.01 / SUBSTEPS)
    step = np.eye(3) + (F - np.eye(3)) / SUBSTEPS
    speed = np.sin(0.3 * np.arange(SAMPLES))
    measured = np.empty((SAMPLES, 2))
    for k in range(SAMPLES):
        for j in range(SUBSTEPS if k else 0):
            ramp = speed[k - 1] + (speed[k] - speed[k - 1]) * (j + 0.5) / SUBSTEPS
            push = np.array([0.0, 0.02 * 0.01 / SUBSTEPS * ramp, 0.0])
            state = step @ state + push + deviations * rng.standard_normal(3)
        measured[k] = H @ state + np.sqrt(list(VARIANCES.values())) * rng.standard_normal(2)
    channels = dict(zip(VARIANCES, measured.T, strict=True))
    return Record(0.01, {"motor_speed_rad_s": speed, **channels}), state


@pytest.fixture(scope="module")
def linear_runs(linear: ProcessModel, transition: Array, observation: Array) -> list[tuple[Estimate, Array]]:
    rng = np.random.default_rng(11)
    runs = [true_run(linear, observation, transition, rng) for _ in range(RUNS)]
    return [(run_filter(ekf, linear, PRIOR, log, RIG, variances=VARIANCES), state) for log, state in runs]


def test_nees_of_a_linear_system_lies_in_its_chi_square_band(linear_runs: list[tuple[Estimate, Array]]) -> None:
    errors = np.array([estimate.belief.mean - state for estimate, state in linear_runs])
    covariances = np.array([estimate.belief.covariance for estimate, _ in linear_runs])
    low, high = mean_chi_square_bounds(3, RUNS, 0.99)
    assert low < np.mean(nees(errors, covariances)) < high
    assert np.mean(nees(2.0 * errors, covariances)) > high


def test_nis_of_a_linear_system_lies_in_its_chi_square_band(linear_runs: list[tuple[Estimate, Array]]) -> None:
    total = np.mean([sum(estimate.nis.values()) for estimate, _ in linear_runs])
    low, high = mean_chi_square_bounds(2, RUNS * SAMPLES, 0.99)
    assert low < total < high


def test_the_chi_square_band_narrows_with_the_count_and_covers_95_percent() -> None:
    narrow, wide = mean_chi_square_bounds(2, 1_000), mean_chi_square_bounds(2, 10)
    assert wide[0] < narrow[0] < 2.0 < narrow[1] < wide[1]
    draws = np.mean(np.random.default_rng(0).chisquare(2, (4_000, 10)), axis=1)
    assert np.mean((draws > wide[0]) & (draws < wide[1])) == pytest.approx(0.95, abs=0.015)


@cache
def bench_log(parameters: EhaParameters, drive: str = "steps") -> Record:
    rng = np.random.default_rng(3)
    speed = make_drive(drive, 6.0, 1e-3, parameters, rng)
    return simulate(LUMPED, speed, 1e-3, parameters, sensors=BENCH, rng=rng)


@pytest.mark.parametrize("drive", ["steps", "sine", "prbs"])
@EVERY_CONDITION
def test_the_gate_passes_on_clean_simulations(condition: str, drive: str) -> None:
    parameters = parameters_for(CONDITIONS[condition])
    found = estimate_bulk_modulus(bench_log(parameters, drive), parameters, form="pressure")
    assert found.outcome is Outcome.OK
    assert found.gate.reasons == ()
    assert found.gate.passed


def frozen_pressure(record: Record) -> Record:
    pressure = record["differential_pressure_pa"].copy()
    pressure[len(pressure) // 3 :] = pressure[len(pressure) // 3]
    return record.replace(differential_pressure_pa=pressure)


def position_in_millimetres(record: Record) -> Record:
    return record.replace(position_m=1e3 * record["position_m"])


@pytest.mark.parametrize("name", ["normal", "minor_leakage", "major_leakage_major_friction"])
@pytest.mark.parametrize(
    ("spoil", "channel"),
    [(frozen_pressure, "differential_pressure_pa"), (position_in_millimetres, "position_m")],
    ids=["frozen sensor", "unit error of 1000"],
)
def test_the_gate_fails_with_a_reason_that_names_the_channel(
    spoil: Callable[[Record], Record], channel: str, name: str
) -> None:
    parameters = parameters_for(CONDITIONS[name])
    found = estimate_bulk_modulus(spoil(bench_log(parameters)), parameters, form="pressure")
    assert not found.gate.passed
    codes = {EstimateCode.INNOVATIONS_LARGE, *ChannelCode}
    assert channel in {note.data["channel"] for note in found.gate.reasons if note.code in codes}


def estimate_with(track: Array, linear: ProcessModel, nis: float = 1.0) -> Estimate:
    mean = np.column_stack([track, track, track])
    return Estimate(
        linear, ("position_m",), np.arange(len(track)), mean, np.full_like(mean, 1e-6), PRIOR,
        {"position_m": nis}, 0.0, np.empty((0, 1)), np.empty((0, 1)),
    )  # fmt: skip


def test_a_drift_larger_than_its_deviation_allows_is_unsettled(linear: ProcessModel) -> None:
    still, drifting = np.full(100, 2.0), np.linspace(1.0, 2.0, 100)
    assert consistency_gate(estimate_with(still, linear), "position_m").passed
    (reason,) = consistency_gate(estimate_with(drifting, linear), "position_m").reasons
    assert (reason.code, reason.data["state"]) == (EstimateCode.NOT_SETTLED, "position_m")
    assert reason.data["moved"] == pytest.approx(0.202, abs=5e-4)


@pytest.mark.parametrize(("nis", "passes"), [(1.0, True), (1.99, True), (2.01, False)])
def test_innovations_of_twice_the_expected_variance_fail_the_gate(
    nis: float, passes: bool, linear: ProcessModel
) -> None:
    assert consistency_gate(estimate_with(np.full(100, 2.0), linear, nis), "position_m").passed is passes


COLOURED = {EstimateCode.INNOVATIONS_FOLLOW_DRIVE, EstimateCode.INNOVATIONS_BESIDE_DRIVE}


def judged(
    plant: Plant,
    form: str,
    drive: str,
    condition: str,
    *,
    pressure: bool = True,
    sample_time: float = 1e-3,
    seed: int = 5,
) -> tuple[Gate, float]:
    """Return the gate on a filtered log, and the estimate's error in standard deviations."""
    parameters, rng = parameters_for(CONDITIONS[condition]), np.random.default_rng(seed)
    speed = make_drive(drive, 10.0, sample_time, parameters, rng)
    log = simulate(plant, speed, sample_time, parameters, sensors=BENCH, rng=rng)
    kept = ("motor_speed_rad_s", "position_m", "velocity_m_s") + (("differential_pressure_pa",) if pressure else ())
    record = log.replace(**dict.fromkeys(set(log) - set(kept)))
    model = FORMS[form]
    noise = {"differential_pressure_pa": PRESSURE_NOISE_LOGGED} if pressure and form == "pressure" else {}
    prior = first_belief(model, record, 2e8, 3e8)
    estimate = run_filter(ekf, model, prior, record, parameters, noise=noise, keep_innovations=True)
    value, std = estimate.settled(BULK_MODULUS)
    return consistency_gate(estimate, BULK_MODULUS, record), (value - parameters.bulk_modulus) / std


@pytest.mark.parametrize(("drive", "pressure"), [("steps", True), ("steps", False), ("prbs", True), ("sine", True)])
@EVERY_CONDITION
def test_innovations_of_the_filters_own_plant_raise_no_objection(condition: str, drive: str, pressure: bool) -> None:
    gate, deviations = judged(LUMPED, "pressure", drive, condition, pressure=pressure)
    assert gate.reasons == ()
    assert gate.inflation < 2.0
    assert abs(deviations) < 3.0


@pytest.mark.parametrize("pressure", [True, False], ids=["with pressure", "motion alone"])
@EVERY_CONDITION
def test_the_gate_objects_to_the_lumped_model_of_a_circuit(condition: str, pressure: bool) -> None:
    gate, deviations = judged(CIRCUIT, "pressure", "steps", condition, pressure=pressure)
    assert not gate.passed
    assert abs(deviations) > 15.0
    assert abs(deviations) < 3.0 * gate.inflation  # the inflated interval is of the error's magnitude
    assert COLOURED & {note.code for note in gate.reasons}


@pytest.mark.slow
@pytest.mark.parametrize("condition", ["normal", "minor_friction", "major_leakage", "major_leakage_minor_friction"])
def test_the_gate_finds_the_step_error_of_the_acceleration_form_that_nis_misses(condition: str) -> None:
    gate, deviations = judged(REDUCED, "acceleration", "sine", condition, sample_time=1e-4)
    assert abs(deviations) > 5.0
    assert not gate.passed
    assert abs(deviations) < 3.0 * gate.inflation
    assert EstimateCode.INNOVATIONS_LARGE not in {note.code for note in gate.reasons}


OWN_NOISE = {"position_m": 1e-13, "velocity_m_s": 1e-7, "differential_pressure_pa": 3e4}
"""Process noise that noise of the measured speed causes: too little to shake a stuck piston loose."""


def own_runs(runs: int, samples: int, rng: np.random.Generator) -> list[Record]:
    """Draw logs from the pressure form itself, including its process and sensor noise."""
    parameters, h, substeps = EhaParameters(), 2.5e-4, 4
    speed = make_drive("prbs", samples * h * substeps, h * substeps, parameters, np.random.default_rng(0))
    deviations = np.array([[(OWN_NOISE.get(state.name, 0.0) * h) ** 0.5] for state in PRESSURE_FORM.states])
    state = np.array([[0.0], [0.0], [0.0], [parameters.bulk_modulus]]) * np.ones(runs)
    measured = np.empty((samples, 3, runs))
    for k in range(samples):
        for j in range(substeps if k else 0):
            start, end = (speed[k - 1] + (speed[k] - speed[k - 1]) * (j + i) / substeps for i in (0, 1))
            moved = np.array(PRESSURE_FORM.step(tuple(state), (start, end), parameters, h))
            state = moved + deviations * rng.standard_normal((4, runs))
        measured[k] = state[:3] + np.array([[1e-6], [1e-3], [5e3]]) * rng.standard_normal((3, runs))
    names = ("position_m", "velocity_m_s", "differential_pressure_pa")
    return [
        Record(h * substeps, {"motor_speed_rad_s": speed, **dict(zip(names, measured[..., run].T, strict=True))})
        for run in range(runs)
    ]


@pytest.mark.slow
def test_the_gate_objects_to_at_most_two_percent_of_logs_of_its_own_model() -> None:
    variances = {"position_m": 1e-12, "velocity_m_s": 1e-6, "differential_pressure_pa": 2.5e7}
    objections = 0
    squares: list[float] = []
    for record in own_runs(100, 4_000, np.random.default_rng(1)):
        prior = first_belief(PRESSURE_FORM, record, 2e8, 3e8)
        estimate = run_filter(
            ekf, PRESSURE_FORM, prior, record, RIG, variances=variances, noise=OWN_NOISE, keep_innovations=True
        )
        objections += not consistency_gate(estimate, BULK_MODULUS, record).passed
        squares.append(wander(estimate, BULK_MODULUS))
    assert objections <= 2
    assert 0.5 < np.mean(squares) < 1.5


def test_a_constant_that_moves_as_its_variance_shrinks_has_a_wander_of_about_one(linear: ProcessModel) -> None:
    rng = np.random.default_rng(2)
    variance = np.linspace(4.0, 1.0, 1001)
    moves = np.concatenate([[0.0], np.sqrt(-np.diff(variance)) * rng.standard_normal(1000)])
    mean = np.column_stack([np.cumsum(moves), 5.0 * np.cumsum(moves), np.zeros(1001)])
    estimate = Estimate(
        linear, ("position_m",), np.arange(1001.0), mean, np.column_stack([variance] * 3), PRIOR, {}, 0.0,
        np.empty((0, 1)), np.empty((0, 1)),
    )  # fmt: skip
    assert 0.4 < wander(estimate, "position_m") < 1.8
    assert wander(estimate, "velocity_m_s") == pytest.approx(25.0 * wander(estimate, "position_m"))
    assert wander(estimate, "force_n") == 0.0
    reasons = consistency_gate(estimate, "velocity_m_s").reasons
    (wandered,) = (note for note in reasons if note.code == EstimateCode.ESTIMATE_WANDERS)
    assert wandered.data["state"] == "velocity_m_s"
    assert wandered.data["ratio"] ** 2 == pytest.approx(wander(estimate, "velocity_m_s"))


def constant(model: ProcessModel, mean: Array, nis: float = 1.0) -> Estimate:
    """Return an estimate of position whose variance falls evenly to half of its first value."""
    shown, variance = np.column_stack([mean, mean, mean]), np.linspace(4.0, 2.0, len(mean))
    return Estimate(
        model, ("position_m",), np.arange(float(len(mean))), shown, np.column_stack([variance] * 3), PRIOR,
        {"position_m": nis, "velocity_m_s": 1.0}, 0.0, np.empty((0, 1)), np.empty((0, 1)),
    )  # fmt: skip


def test_motion_of_an_estimate_before_the_filter_settles_is_no_wander(linear: ProcessModel) -> None:
    settled = round(SETTLING * 1000)
    before, after = (np.where(np.arange(1001) < place, 3.0, 0.0) for place in (settled, settled + 1))
    assert wander(constant(linear, before), "position_m") == 0.0
    assert wander(constant(linear, after), "position_m") == pytest.approx(9.0 / (0.8 * 2.0))


def test_a_model_fails_to_describe_a_log_beyond_ten_deviations_or_at_a_bound(linear: ProcessModel) -> None:
    first = replace(linear.states[0], lower=-1.0, upper=1.0)
    bounded = replace(linear, states=(first, *linear.states[1:]))
    for value, nis, described in ((0.5, 99.0, True), (0.5, 101.0, False), (1.0, 1.0, False), (-1.0, 1.0, False)):
        assert describes_log(constant(bounded, np.full(1001, value), nis), "position_m") is described
