"""Several evidences on one scoreboard: the score of each, their sum, and what a stuck piston leaves open."""

from typing import Any

import numpy as np
import pytest

from estimation.identification import LinearModel
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.calibration import Calibration
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.circuit_runs import COORDINATES
from faults.diagnosis.circuits.class_regions import is_stuck
from faults.diagnosis.evidence import (
    FARTHEST,
    Scoreboard,
    bounded_log_odds,
    friction_left_open,
    limited_by_separation,
    weigh_evidence,
)
from faults.diagnosis.rmse import score_transfer_functions
from plant.eha.circuit_parameters import circuit_of
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

ACTUATOR = actuator_of(EhaParameters())
NAMES = list(CONDITIONS)
WEIGHTS = {"transfer_functions": 0.0, "models": 0.5, "innovations": 0.0, "parameters": 1.0}


def blocks(pressure: float | None) -> Blocks:
    """Return a log of a stuck piston under a pressure."""
    still = np.zeros(50)
    pushed = None if pressure is None else np.linspace(-pressure, pressure, 50)
    return Blocks(np.zeros(501), 1e-3, 10, still, pushed, np.ones(1 if pushed is None else 2))


def board(log: Blocks, **odds: np.ndarray) -> Scoreboard:
    fits: Any = None
    return Scoreboard(odds, log, fits, Record(1e-3, {"motor_speed_rad_s": np.zeros(2)}), None)


def calibration(*, without: float = 1.0) -> Calibration:
    return Calibration({"weights": WEIGHTS}, {"weights": {name: without * one for name, one in WEIGHTS.items()}}, {})


def odds_for(**by_name: float) -> np.ndarray:
    return np.array([by_name.get(name, -10.0) for name in NAMES])


def test_probabilities_are_weighted_log_odds_and_sum_to_one() -> None:
    one = board(
        blocks(1e5),
        models=odds_for(normal=0.0, minor_leakage=-2.0),
        parameters=odds_for(normal=0.0, minor_leakage=-1.0),
    )
    found = one.probabilities(calibration())
    assert sum(found.values()) == pytest.approx(1.0)
    assert found["normal"] / found["minor_leakage"] == pytest.approx(np.exp(0.5 * 2.0 + 1.0))


def test_a_log_without_pressure_has_weights_of_its_own() -> None:
    odds = odds_for(normal=0.0, minor_leakage=-1.0)
    with_it, without = (
        board(blocks(at), parameters=odds).probabilities(calibration(without=3.0)) for at in (1e5, None)
    )
    assert with_it["normal"] / with_it["minor_leakage"] == pytest.approx(np.exp(1.0))
    assert without["normal"] / without["minor_leakage"] == pytest.approx(np.exp(3.0))


def test_a_single_evidence_names_its_likeliest_condition() -> None:
    assert board(blocks(None), models=odds_for(major_friction=0.0)).choice("models") == "major_friction"


def test_scores_of_an_evidence_are_bounded_and_keep_their_order() -> None:
    scores = np.array([0.0, -1.0, -50.0, -1e6, np.nan])
    found = bounded_log_odds(scores)
    assert found[0] == 0.0
    assert found[1] == pytest.approx(-1.0, abs=0.05)
    assert np.all(np.diff(found[:4]) < 0.0)
    assert np.all(found >= -FARTHEST)
    assert found[4] == -FARTHEST
    assert bounded_log_odds(np.full(3, -np.inf)).tolist() == [0.0, 0.0, 0.0]


RESTING = np.exp(ACTUATOR.conditions[:, COORDINATES.index("friction_rest")]) / ACTUATOR.circuit.piston_area
"""Pressures at which the piston breaks loose in each condition [Pa]."""


def test_friction_levels_of_a_stuck_piston_get_equal_scores_at_each_leakage_level() -> None:
    scores = -np.arange(len(NAMES), dtype=np.float64)
    found = friction_left_open(scores, blocks(1e4), ACTUATOR)
    for level in ("none", "minor", "major"):
        alike = [i for i, one in enumerate(CONDITIONS.values()) if one.leakage == level]
        assert found[alike].tolist() == [max(scores[alike])] * 3


@pytest.mark.parametrize(("share", "open_still"), [(1.1, True), (1.3, False)])
def test_a_friction_level_can_hold_the_piston_up_to_a_fifth_above_its_breakaway_force(
    share: float, *, open_still: bool
) -> None:
    scores = np.random.default_rng(1).normal(size=len(NAMES))
    # the strongest friction cannot be confused with a stronger one
    second = sorted(set(RESTING.round(-2).tolist()))[-2]
    found = friction_left_open(scores, blocks(share * second), ACTUATOR)
    assert np.all(np.isfinite(found))
    assert (found.tolist() != scores.tolist()) == open_still


def test_without_pressure_every_friction_level_can_hold_a_stuck_piston() -> None:
    scores = np.random.default_rng(0).normal(size=len(NAMES))
    found = friction_left_open(scores, blocks(None), ACTUATOR)
    assert len(set(found.tolist())) == 3
    assert np.all(found >= scores)


def driven(drive: str, condition: str) -> Record:
    rng = np.random.default_rng(3)
    p = circuit_of(parameters_for(CONDITIONS[condition]))
    return simulate(CIRCUIT, make_drive(drive, 2.0, 2e-3, p, rng), 2e-3, p, sensors=BENCH, rng=rng)


def test_a_library_adds_the_evidence_of_its_transfer_functions() -> None:
    record = driven("prbs", "normal")
    library = {
        name: LinearModel([0.0, (1.0 + 0.2 * k) * 6e-6], [1.0, -0.98], 2e-3, "motor_speed_rad_s", "velocity_m_s")
        for k, name in enumerate(NAMES)
    }
    without, found = weigh_evidence(record, ACTUATOR), weigh_evidence(record, ACTUATOR, library)
    assert list(without.log_odds) == ["models", "innovations", "parameters"]
    assert list(found.log_odds) == ["transfer_functions", "models", "innovations", "parameters"]
    errors = score_transfer_functions(record, library).by_condition
    assert found.choice("transfer_functions") == min(NAMES, key=lambda name: errors[name])
    for name, odds in without.log_odds.items():
        np.testing.assert_array_equal(found.log_odds[name], odds)


def test_no_evidence_determines_the_friction_level_of_a_stuck_piston() -> None:
    found = weigh_evidence(driven("sine", "major_friction"), ACTUATOR)
    assert is_stuck(found.blocks, ACTUATOR)
    for odds in found.log_odds.values():
        for level in ("none", "minor", "major"):
            alike = [i for i, one in enumerate(CONDITIONS.values()) if one.leakage == level]
            assert len({float(odds[i]) for i in alike}) < 3


def test_scores_of_nominal_circuits_are_limited_by_the_distances_of_conditions() -> None:
    scores = np.array([-5.0, 0.0, -40.0])
    apart = np.array([[0.0, 2.0, 60.0], [2.0, 0.0, 60.0], [60.0, 60.0, 0.0]])
    assert limited_by_separation(scores, apart).tolist() == [-2.0, 0.0, -40.0]
    assert limited_by_separation(scores, 1e9 * (1.0 - np.eye(3))).tolist() == scores.tolist()
    # a condition is no farther below another than the log separates the two
    chain = np.array([[0.0, 50.0, 1.0], [50.0, 0.0, 50.0], [1.0, 50.0, 0.0]])
    assert limited_by_separation(scores, chain).tolist() == [-5.0, 0.0, -6.0]
    assert limited_by_separation(np.array([-np.inf, 0.0]), np.array([[0.0, 3.0], [3.0, 0.0]])).tolist() == [-3.0, 0.0]


def test_only_fitted_circuits_count_if_the_log_separates_no_conditions(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    record = driven("prbs", "normal")
    told = weigh_evidence(record, ACTUATOR)
    monkeypatch.setattr("faults.diagnosis.circuits.class_regions.ClassFits.separations", lambda *_: np.zeros((9, 9)))
    blind = weigh_evidence(record, ACTUATOR)
    for name in ("models", "innovations"):
        assert np.ptp(told.log_odds[name]) > 1.0
        assert np.ptp(blind.log_odds[name]) == 0.0
    assert blind.log_odds["parameters"] == pytest.approx(told.log_odds["parameters"])
