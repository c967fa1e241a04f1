import numpy as np
import pytest

from estimation.trust.identifiability import SENSED
from faults.conditions import CONDITIONS
from faults.eha.isolability import condition_distances, overdetermined, structural_isolability, wrong_verdicts
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.errors import HydrostateError

P = EhaParameters()
T = 2e-3
WITHOUT_PRESSURE = ("position_m", "velocity_m_s")


def _drive(name: str) -> np.ndarray:
    return make_drive(name, 4.0, T, P, np.random.default_rng(0))


def test_pressure_tells_friction_from_leakage_by_structure() -> None:
    assert structural_isolability(SENSED)["friction"] == ()
    assert structural_isolability(SENSED)["leakage"] == ("air", "speed sensor")
    assert "friction" in (structural_isolability(WITHOUT_PRESSURE)["leakage"] or ())


def test_without_a_second_equation_nothing_is_detected() -> None:
    assert overdetermined({"flow balance", "force balance", "kinematics"}) == set()
    assert set(structural_isolability(()).values()) == {None}


def test_faults_of_sensors_that_are_not_there_are_left_out() -> None:
    assert "pressure sensor" not in structural_isolability(WITHOUT_PRESSURE)


def test_more_sensors_never_make_a_fault_harder_to_isolate() -> None:
    fewer, more = structural_isolability(("position_m",)), structural_isolability(SENSED)
    for fault, rivals in fewer.items():
        assert set(more[fault] or ()) <= set(rivals or ())


def test_nine_steps_tell_all_conditions_apart_and_a_stuck_sine_does_not() -> None:
    steps = condition_distances(P, _drive("steps"), T)
    assert steps.conditions == tuple(CONDITIONS)
    assert wrong_verdicts(steps.least) < 0.01
    np.testing.assert_array_equal(np.diag(steps.nats), 0.0)
    sine = condition_distances(P, _drive("sine"), T, WITHOUT_PRESSURE)
    assert wrong_verdicts(sine.least) == pytest.approx(0.5)
    leaking = sine.mutual[sine.conditions.index("minor_leakage"), sine.conditions.index("major_leakage")]
    assert leaking == pytest.approx(0.0, abs=1e-9)


def test_a_sensor_more_brings_conditions_no_nearer() -> None:
    drive = _drive("prbs")
    fewer, more = condition_distances(P, drive, T, WITHOUT_PRESSURE), condition_distances(P, drive, T)
    assert np.all(more.nats >= fewer.nats * (1.0 - 1e-9) - 1e-6)


def test_twice_the_experiment_brings_more_distance() -> None:
    drive = _drive("prbs")
    assert condition_distances(P, np.tile(drive, 2), T).least > condition_distances(P, drive, T).least


def test_a_channel_without_noise_or_unknown_is_refused() -> None:
    with pytest.raises(HydrostateError, match="a channel must be one of"):
        condition_distances(P, _drive("prbs"), T, ("pressure_a_pa",))
