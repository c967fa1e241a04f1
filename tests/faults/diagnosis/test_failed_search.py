"""A failed search for motion parameters is no objection if the motion form follows the log at the circuit's values."""

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from estimation.eha.result import BulkModulusEstimate
from estimation.finding import Gate, Outcome
from estimation.log_checks.clean import CleanLog
from estimation.models.motion import UNKNOWNS
from estimation.notes import EstimateCode, SensorCode
from faults.conditions import CONDITIONS
from faults.diagnosis import failed_search
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.circuit_runs import coordinates_of
from faults.diagnosis.evidence import Scoreboard
from faults.diagnosis.failed_search import doubts_after_fit, motion_form_values
from plant.eha.model import EhaParameters
from plant.log.record import Record
from tests.faults.diagnosis.circuits.test_rivals import leaving, log

PAPER = EhaParameters()
ACTUATOR = actuator_of(PAPER)
FAR = EstimateCode.POSITION_RESIDUALS_LARGE.note(ratio=40.0, motion_percent=20.0)
LAWS = EstimateCode.FRICTION_LAWS_DISAGREE.note(least_pa=1e8, most_pa=2e8)
FROZE = SensorCode.SENSOR_FROZE.note(channel="position_m", value=0.0, begin_s=0.0, length_s=1.0)


def left(
    monkeypatch: pytest.MonkeyPatch, share: float, form: str = "motion", noises: float = 1.0, pump: float = 0.0
) -> tuple[Any, ...]:
    """Return the remaining ones of three objections, if the motion form leaves ``share`` of the motion.

    The circuit leaves ``noises`` times the sensors' noise of a velocity, which is a hundred times that noise. The
    pump's whole flow would move the piston ``pump`` times as fast as it moves.
    """
    one = log(pressure=False)
    per_speed = PAPER.pump_displacement / PAPER.piston_area
    one = replace(one, speed=np.full_like(one.speed, pump * float(one.rms[0]) / per_speed))
    fits = cast("Any", type("Fits", (), {"best": leaving(noises, 1.0, one)}))
    board = Scoreboard({}, one, fits, Record(1e-3, {"motor_speed_rad_s": np.zeros(2)}), None)
    estimate = BulkModulusEstimate(
        Outcome.MISMATCH, None, None, 1.0, Gate(False, (FAR, LAWS)), form, ("position_m",), {}, {}
    )
    clean = cast("CleanLog", type("Log", (), {"record": board.window, "variances": {"motor_speed_rad_s": 1e-4}}))
    monkeypatch.setattr(failed_search, "share_at", lambda *_: share)
    return doubts_after_fit((FAR, LAWS, FROZE), estimate, clean, PAPER, board)


@pytest.mark.parametrize(("share", "kept"), [(0.09, False), (0.11, True), (np.inf, True), (np.nan, True)])
def test_a_failed_motion_fit_is_not_an_objection_if_the_circuits_values_leave_half_as_much(
    monkeypatch: pytest.MonkeyPatch, share: float, *, kept: bool
) -> None:
    assert left(monkeypatch, share) == ((FAR, LAWS, FROZE) if kept else (FROZE,))


def test_a_failed_motion_fit_is_an_objection_if_the_circuits_values_leave_too_much(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(failed_search, "FAILED_RATIO", 100.0)
    assert left(monkeypatch, 0.11) == (FROZE,)
    assert left(monkeypatch, 0.13) == (FAR, LAWS, FROZE)


def test_objections_to_a_fit_with_pressure_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    assert left(monkeypatch, 0.0, "flow") == (FAR, LAWS, FROZE)


@pytest.mark.parametrize(
    ("pump", "noises", "kept"), [(7.0, 40.0, True), (10.0, 10.0, False), (10.0, 20.0, True), (40.0, 40.0, False)]
)
def test_for_a_piston_that_hardly_moves_the_fit_of_the_circuit_decides(
    monkeypatch: pytest.MonkeyPatch, pump: float, noises: float, *, kept: bool
) -> None:
    assert left(monkeypatch, np.inf, noises=noises, pump=pump) == ((FAR, LAWS, FROZE) if kept else (FROZE,))


def test_a_circuit_gives_values_for_the_unknowns_of_the_motion_form() -> None:
    at = list(CONDITIONS).index("normal")
    one = log(pressure=False)
    fit = leaving(1.0, 1.0, one)
    values = motion_form_values(fit, ACTUATOR)
    assert set(values) == set(UNKNOWNS) - {"speed_lead", "bristle_damping"}
    assert values["leakage_coefficient"] == pytest.approx(PAPER.leakage_coefficient, rel=1e-6, abs=0.0)
    assert values["friction_linear"] == pytest.approx(PAPER.friction_linear)
    assert values["bristle_stiffness"] == pytest.approx(PAPER.friction_coulomb / 2e-5)
    np.testing.assert_allclose(ACTUATOR.conditions[at], coordinates_of(PAPER, ACTUATOR.rated))
