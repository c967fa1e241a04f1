"""A filter with noise levels tuned to the log reports at least how large its error may be."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.eha.bulk_modulus import _fitted_estimate, estimate_bulk_modulus
from estimation.eha.by_filter import _settled_run, _verdict
from estimation.eha.result import LARGEST_BOUND, BulkModulusEstimate
from estimation.finding import Outcome
from estimation.fits.hypothesis_search.form_fit import FormFit
from estimation.notes import EstimateCode
from estimation.trust.consistency import MISMATCH_NIS
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.drives import make_drive
from plant.eha.simulate import PLANTS, simulate
from plant.errors import HydrostateError, LogError
from plant.log.record import Record
from plant.notes import Note
from plant.sensors.sensors import BENCH

FAULTY = parameters_for(CONDITIONS["minor_leakage_minor_friction"])
TRUTH = FAULTY.bulk_modulus
QUIET = replace(
    BENCH, speed_noise=5e-3, velocity_noise=1e-4, pressure_noise=500.0, pressure_quantum=50.0, position_quantum=1e-7
)


def run(duration: float, sample_time: float) -> Record:
    rng = np.random.default_rng(3)
    speed = make_drive("steps", duration, sample_time, FAULTY, rng)
    return simulate(PLANTS["lumped"], speed, sample_time, FAULTY, sensors=QUIET, rng=rng)


def filtered(log: Record, tuned: bool) -> BulkModulusEstimate:
    return estimate_bulk_modulus(log, FAULTY, form="pressure", tuned=tuned)


@pytest.mark.slow
def test_model_sub_steps_do_not_bias_a_tuned_filter_on_a_10_khz_log() -> None:
    found = filtered(run(1.0, 1e-4), tuned=True)
    assert found.std < 2e-5 * TRUTH
    assert found.value == pytest.approx(TRUTH, abs=4.0 * found.std)


def test_tuning_to_a_quiet_log_narrows_the_interval_and_keeps_it_valid() -> None:
    log = run(3.0, 1e-3)
    tuned, given = filtered(log, tuned=True), filtered(log, tuned=False)
    assert 5.0 * tuned.std < given.std
    assert tuned.value == pytest.approx(TRUTH, abs=4.0 * tuned.std)
    assert given.value == pytest.approx(TRUTH, abs=4.0 * given.std)


def outcome_of(fit: FormFit) -> BulkModulusEstimate:
    return _fitted_estimate(fit, "flow", ("position_m",))


def form_fit(*, bound: float = 0.01, chi_square: float = 1.0, reasons: tuple[Note, ...] = ()) -> FormFit:
    return FormFit({"bulk_modulus": (2e8, 1e6), "flow_bias": (1e-6, 1e-8)}, bound, chi_square, reasons)


def test_a_fit_with_large_residuals_or_a_wide_bound_gives_no_value() -> None:
    sound = outcome_of(form_fit())
    assert (sound.outcome, sound.value, sound.std, sound.gate.passed) == (Outcome.OK, 2e8, 1e6, True)
    doubted = outcome_of(form_fit(reasons=(EstimateCode.DIVERGED.note(),)))
    assert (doubted.outcome, doubted.value, doubted.gate.passed) == (Outcome.OK, 2e8, False)
    unlike = outcome_of(form_fit(chi_square=1.01 * MISMATCH_NIS, bound=9.0))
    assert (unlike.outcome, unlike.value, unlike.std) == (Outcome.MISMATCH, None, None)
    vague = outcome_of(form_fit(bound=1.01 * LARGEST_BOUND))
    assert (vague.outcome, vague.value, vague.gate.passed) == (Outcome.NOT_OBSERVABLE, None, False)
    assert [note.code for note in vague.gate.reasons] == [EstimateCode.BOUND_TOO_WIDE]


REST = Record(1e-3, {name: np.zeros(300) for name in ("motor_speed_rad_s", "position_m", "velocity_m_s")})


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"start": -1.0}, r"the first guess must be 0 Pa or more, its deviation positive, got -1\.0"),
        ({"start": np.nan}, "the first guess must be 0 Pa or more"),
        ({"start_std": 0.0}, r"its deviation positive, got .*, 0\.0"),
        ({"method": "chamber-ekf", "form": "pressure"}, "chamber-ekf believes the flow form, got form 'pressure'"),
        ({"method": "least-squares", "form": "pressure"}, "the pressure form is filtered, got method 'least-squares'"),
        ({"method": "ekf", "form": "motion"}, "the motion form is fitted by least squares, got method 'ekf'"),
        ({"states": ("weight",)}, "a further state must be one of"),
        ({"form": "flow", "method": "ukf"}, "no robust update, got method ukf$"),
        ({"form": "flow", "tuned": True, "robust": "huber"}, "no robust update, got tuning; robust huber$"),
        ({"form": "flow", "states": ("friction",)}, "the flow form is filtered by a bank of ekf"),
        ({"form": "flow", "tuned": True}, "the flow form is filtered by a bank of ekf"),
    ],
)
def test_invalid_first_guesses_and_combinations_of_form_and_method_are_refused(
    options: dict[str, Any], said: str
) -> None:
    with pytest.raises(HydrostateError, match=said):
        estimate_bulk_modulus(REST.replace(differential_pressure_pa=np.zeros(300)), FAULTY, **options)


def test_the_flow_form_says_which_channel_it_lacks() -> None:
    for options in ({"form": "flow"}, {"form": "flow", "method": "ekf"}, {"method": "chamber-ekf"}):
        with pytest.raises(LogError, match="differential_pressure_pa"):
            estimate_bulk_modulus(REST, FAULTY, **options)


def test_a_filter_that_diverged_or_has_a_wide_bound_passes_no_gate() -> None:
    nothing: Any = None
    assert _verdict(nothing, REST, False, 0.01)[0] is Outcome.DIVERGED
    outcome, gate = _verdict(nothing, REST, True, 1.01 * LARGEST_BOUND)
    assert outcome is Outcome.NOT_OBSERVABLE
    assert not gate.passed


@pytest.mark.parametrize(("second", "taken"), [(5.0, "again"), (-5.0, "first"), (0.0, "first")])
def test_the_likelier_of_two_filter_passes_is_returned_together_with_the_first(second: float, taken: str) -> None:
    begun: list[float] = []

    def filtered(guess: float) -> Any:
        begun.append(guess)
        name, likelihood = ("first", 0.0) if len(begun) == 1 else ("again", second)
        return SimpleNamespace(name=name, log_likelihood=likelihood, settled=lambda _: (2e8, 1e6))

    found, first = _settled_run(filtered, 1e7)
    assert begun == [1e7, 2e8]  # a first guess far below the result, and then the result
    assert (found.name, first.name) == (taken, "first")
