"""When a number of the piezo-stack actuator is reported, and objections to all of them."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimation.finding import Outcome
from estimation.piezo_stack import finding
from estimation.piezo_stack.estimate import StackEstimate, stack_bounds
from estimation.piezo_stack.finding import (
    CHANCE_ALLOWANCE,
    MOST_DEVIATION,
    MOST_MISFIT,
    SMALLEST_FAULT,
    stack_finding,
    stack_prospect,
    stack_quantities,
)
from estimation.piezo_stack.unknowns import DEFAULT_UNKNOWNS, UNKNOWNS
from plant.log.record import Record
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.piezo_stack.run import sine_drive

HEALTHY = PiezoStackParameters()
SAMPLES = 10_000
MOST = MOST_MISFIT + CHANCE_ALLOWANCE / SAMPLES**0.5
SIZES = {"coulomb_friction": SMALLEST_FAULT["coulomb_friction"], "air_fraction": HEALTHY.air_fraction}


def estimate(share: float, ratio: float = 1.0) -> StackEstimate:
    """Return deviations at a share of the largest one with which a number is reported, and residuals over noise."""
    deviations = {name: share * MOST_DEVIATION * size for name, size in SIZES.items()}
    misfit = {"stack_displacement_m": 1.0, "position_m": ratio}
    return StackEstimate(dict(SIZES), deviations, np.eye(2), misfit, 10, HEALTHY, SAMPLES, delay=0.0)


def found(monkeypatch: pytest.MonkeyPatch, one: StackEstimate) -> Any:
    monkeypatch.setattr(finding, "estimate_stack", lambda *_, **__: one)
    return stack_finding(Record(1e-4, {"drive_voltage_v": np.zeros(3)}), HEALTHY)


def test_a_value_is_reported_only_if_its_deviation_is_small() -> None:
    known, vague = (stack_quantities(estimate(share), HEALTHY) for share in (0.99, 1.01))
    assert {name: one.value for name, one in known.items()} == SIZES
    assert all(one.ci95 is not None and one.unit == UNKNOWNS[name].unit for name, one in known.items())
    assert all(one.value is None and one.ci95 is None and one.std is not None for one in vague.values())


def test_a_channel_with_a_large_misfit_withholds_every_value(monkeypatch: pytest.MonkeyPatch) -> None:
    said = found(monkeypatch, estimate(0.5, 1.01 * MOST))
    (reason,) = said.gate.reasons
    assert (str(reason.code), dict(reason.data)) == (
        "channel_missed",
        {"channel": "position_m", "ratio": 1.01 * MOST},
    )
    assert said.outcome is Outcome.MISMATCH
    assert all(one.value is None and one.std is not None for one in said.quantities.values())
    assert found(monkeypatch, estimate(0.5, 0.99 * MOST)).gate.passed


@pytest.mark.parametrize(
    ("left", "corrected"),
    [(1.0, True), (1.7**0.5, True), (1.9**0.5, False)],  # the mean square missed falls from 8
)
def test_a_delay_is_corrected_if_it_removes_nine_tenths_of_what_the_model_misses(
    left: float, corrected: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    drive = np.arange(5.0)

    def fitted(record: Record, *_: Any, **__: Any) -> StackEstimate:
        late = record["drive_voltage_v"][2] < drive[2]
        return replace(estimate(0.5, left if late else 3.0), delay=0.0 if late else 5e-5)

    monkeypatch.setattr(finding, "estimate_stack", fitted)
    log = Record(1e-4, {"drive_voltage_v": drive})
    found, in_step, notes = finding.estimate_in_step(log, HEALTHY)
    assert found.misfit["position_m"] == (left if corrected else 3.0)
    assert in_step["drive_voltage_v"] == pytest.approx([0.0, 0.5, 1.5, 2.5, 3.5] if corrected else drive)
    assert [dict(note.data) for note in notes] == [{"shift_us": pytest.approx(50.0), "side": "behind"}] * corrected


def test_a_parameter_that_the_sensors_do_not_determine_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    half = estimate(0.5)
    half = replace(half, deviations={**half.deviations, "air_fraction": 1.0})
    said = found(monkeypatch, half)
    assert [dict(note.data) for note in said.not_told] == [{"names": "air_fraction"}]
    assert said.outcome is Outcome.OK
    assert found(monkeypatch, estimate(2.0)).outcome is Outcome.NOT_OBSERVABLE
    assert found(monkeypatch, estimate(0.5)).not_told == ()


def test_a_planned_run_reports_the_smallest_possible_deviations() -> None:
    drive = sine_drive(275.0, 140.0, 0.01, 1e-4)
    said = stack_prospect(HEALTHY, drive, 1e-4, channels=("stack_displacement_m",))
    bounds = stack_bounds(HEALTHY, drive, 1e-4, channels=("stack_displacement_m",))
    assert set(said.quantities) == set(DEFAULT_UNKNOWNS)
    assert said.quantities["air_fraction"].value == HEALTHY.air_fraction
    for name, one in said.quantities.items():
        size = 1.0 if UNKNOWNS[name].scale else one.value
        assert one.std == pytest.approx(bounds[name] * size, rel=1e-6, abs=0.0)
