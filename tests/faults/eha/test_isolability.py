from dataclasses import replace

import numpy as np
import pytest

from estimation.trust.identifiability import CARD_CHANNELS
from faults.conditions import CONDITIONS
from faults.eha.bank import mathematical_bank, predict_run
from faults.eha.isolability import (
    SPREAD,
    condition_distances,
    overdetermined_equations,
    structural_isolability,
    wrong_verdicts,
)
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.errors import HydrostateError
from plant.log.record import Record
from plant.sensors.sensors import BENCH

P = EhaParameters()
T = 2e-3
WITHOUT_PRESSURE = ("position_m", "velocity_m_s")


def _drive(name: str) -> np.ndarray:
    return make_drive(name, 4.0, T, P, np.random.default_rng(0))


def test_pressure_makes_friction_structurally_isolable_from_leakage() -> None:
    assert structural_isolability(CARD_CHANNELS)["friction"] == ()
    assert structural_isolability(CARD_CHANNELS)["leakage"] == ("air", "speed sensor")
    assert "friction" in (structural_isolability(WITHOUT_PRESSURE)["leakage"] or ())


def test_without_redundant_equations_no_fault_is_detectable() -> None:
    assert overdetermined_equations({"flow balance", "force balance", "kinematics"}) == set()
    assert set(structural_isolability(()).values()) == {None}


def test_faults_of_absent_sensors_are_left_out() -> None:
    assert "pressure sensor" not in structural_isolability(WITHOUT_PRESSURE)


def test_more_sensors_never_make_a_fault_harder_to_isolate() -> None:
    fewer, more = structural_isolability(("position_m",)), structural_isolability(CARD_CHANNELS)
    for fault, rivals in fewer.items():
        assert set(more[fault] or ()) <= set(rivals or ())


def test_steps_separate_all_nine_conditions_and_a_sine_with_a_stuck_piston_does_not() -> None:
    steps = condition_distances(P, _drive("steps"), T)
    assert steps.conditions == tuple(CONDITIONS)
    assert wrong_verdicts(steps.least) < 0.01
    np.testing.assert_array_equal(np.diag(steps.nats), 0.0)
    sine = condition_distances(P, _drive("sine"), T, WITHOUT_PRESSURE)
    assert wrong_verdicts(sine.least) == pytest.approx(0.5)
    leaking = sine.mutual[sine.conditions.index("minor_leakage"), sine.conditions.index("major_leakage")]
    assert leaking == pytest.approx(0.0, abs=1e-9)


def test_an_additional_sensor_never_reduces_the_distance_of_conditions() -> None:
    drive = _drive("prbs")
    fewer, more = condition_distances(P, drive, T, WITHOUT_PRESSURE), condition_distances(P, drive, T)
    assert np.all(more.nats >= fewer.nats * (1.0 - 1e-9) - 1e-6)


def test_a_repeated_experiment_increases_the_distance_of_conditions() -> None:
    drive = _drive("prbs")
    assert condition_distances(P, np.tile(drive, 2), T).least > condition_distances(P, drive, T).least


def test_a_channel_without_a_noise_model_is_refused() -> None:
    with pytest.raises(HydrostateError, match="a channel must be one of"):
        condition_distances(P, _drive("prbs"), T, ("pressure_a_pa",))


def test_a_distance_is_that_of_normal_distributions_with_class_spread_and_sensor_noise() -> None:
    drive, channels = _drive("steps")[:200], ("velocity_m_s", "differential_pressure_pa")
    found = condition_distances(P, drive, T, channels)
    log = Record(T, {"motor_speed_rad_s": drive})
    healthy = predict_run(log, P)
    # sensor noise, and a model error of 5 % that lasts 50 ms and so counts like the errors of 25 samples
    noise = {"velocity_m_s": BENCH.velocity_noise**2}
    noise["differential_pressure_pa"] = BENCH.pressure_noise**2 + BENCH.pressure_quantum**2 / 12.0
    sizes = {name: np.sqrt(one + 0.05**2 * (0.05 / T) * np.var(healthy[name])) for name, one in noise.items()}

    def seen(model: EhaParameters) -> np.ndarray:
        run = predict_run(log, model)
        return np.concatenate([run[name] / size for name, size in sizes.items()])

    models = mathematical_bank(P)
    for assumed in ("normal", "minor_friction"):
        model = models[assumed]
        covariance = np.eye(2 * len(drive))
        for name, share in SPREAD.items():
            value = getattr(model, name)
            slope = (seen(replace(model, **{name: 1.001 * value})) - seen(model)) / 0.001 * share
            covariance += np.outer(slope, slope)
        for true in ("minor_leakage", "major_friction"):
            away = seen(models[true]) - seen(model)
            wanted = 0.5 * away @ np.linalg.solve(covariance, away)
            row, column = (found.conditions.index(name) for name in (true, assumed))
            assert found.nats[row, column] == pytest.approx(wanted, rel=1e-6)
