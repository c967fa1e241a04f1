"""The finding on the oil of a log; its sensors are examined only once."""

import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimation.eha.bulk_modulus import EstimateOptions, estimate_bulk_modulus, estimate_clean
from estimation.eha.estimate import estimate_log, finding_of, rejection_notes
from estimation.eha.result import BulkModulusEstimate
from estimation.finding import Gate, Outcome
from estimation.log_checks import measurement_noise
from estimation.log_checks.clean import clean_log
from estimation.notes import EstimateCode, SensorCode
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import LUMPED, simulate
from plant.log.record import Record
from plant.notes import Note
from plant.sensors.faults import SensorFault, with_fault
from plant.sensors.sensors import BENCH
from tests.thinned import thinned

HEALTHY = EhaParameters()
PRESSURE = "differential_pressure_pa"
OILS = {EstimateCode.STIFFER_THAN_RIG, EstimateCode.SOFTER_THAN_RIG}
PACKAGES = ("plant", "estimation", "faults", "experiments")


def log(condition: str = "minor_leakage", drive: str = "steps", duration: float = 3.0) -> Record:
    p, rng = parameters_for(CONDITIONS[condition]), np.random.default_rng(8)
    return simulate(LUMPED, make_drive(drive, duration, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)


def with_outliers(record: Record, channel: str, count: int = 20) -> Record:
    values = record[channel].copy()
    hit = np.random.default_rng(3).choice(len(record), count, replace=False)
    values[hit] += 20.0 * np.std(values)
    return record.replace(**{channel: values})


def test_a_finding_holds_what_the_estimate_found_with_units_and_intervals() -> None:
    found = estimate_log(log(), Rig())
    alone = estimate_bulk_modulus(log(), HEALTHY, uncertainties=Rig().spreads)
    assert (found.actuator, found.outcome, found.channels) == ("eha", Outcome.OK, ("position_m", PRESSURE))
    assert found.quantities["bulk_modulus"] == alone.quantity
    assert found.gate == alone.gate
    assert {name: one.unit for name, one in found.quantities.items()} == {
        "bulk_modulus": "Pa",
        "leakage_coefficient": "m^3/(s Pa)",
        "flow_bias": "m^3/s",
    }
    for name, (value, std) in alone.others.items():
        one = found.quantities[name]
        assert (one.value, one.std) == (value, std)
        assert one.ci95 == pytest.approx((value - 1.96 * std, value + 1.96 * std), rel=1e-4, abs=0.0)
    assert (found.condition, found.probabilities, found.advice) == (None, {}, ())
    assert [note.code for note in found.all_notes] == [EstimateCode.KNOWN_AS_THE_RIG]


def test_outliers_are_noted_only_of_channels_that_the_estimate_used() -> None:
    unused, used = (
        estimate_log(with_outliers(log(), channel), Rig()) for channel in ("velocity_m_s", "motor_speed_rad_s")
    )
    assert [note.code for note in unused.notes] == [EstimateCode.KNOWN_AS_THE_RIG]
    note, _ = used.notes
    assert note == SensorCode.OUTLIERS_LEFT_OUT.note(channel="motor_speed_rad_s", count=20, total=3000)


@pytest.mark.parametrize("form", ["pressure", "acceleration"])
def test_an_estimate_that_does_not_use_pressure_notes_the_loss(form: str) -> None:
    record = log(duration=1.0)
    seen = record if form == "acceleration" else record.replace(**{PRESSURE: None})
    found = estimate_log(seen, Rig(), EstimateOptions(form=form))
    cost = EstimateCode.PRESSURE_UNUSED if form == "acceleration" else EstimateCode.PRESSURE_ABSENT
    assert [note.code for note in found.notes if note.code != EstimateCode.KNOWN_AS_THE_RIG] == [cost]
    assert {EstimateCode.PRESSURE_UNUSED, EstimateCode.PRESSURE_ABSENT}.isdisjoint(
        note.code for note in estimate_log(record, Rig()).notes
    )


def test_evidence_against_the_model_refuses_a_fit_and_a_wide_bound_does_not() -> None:
    frozen = with_fault(log(duration=1.0), SensorFault(channel="position_m", kind="freeze", start=0.5))
    found = estimate_log(frozen, Rig())
    assert SensorCode.SENSOR_FROZE in [note.code for note in rejection_notes(found.evidence)]
    stuck = log("major_friction", "sine", duration=1.0).replace(**{PRESSURE: None})
    unseen = estimate_log(stuck, Rig())
    assert unseen.outcome is Outcome.NOT_OBSERVABLE
    assert [note.code for note in unseen.gate.reasons] == [EstimateCode.BOUND_TOO_WIDE]
    assert rejection_notes(unseen.evidence) == ()


def test_the_pressure_form_with_given_leakage_and_friction_refuses_no_log() -> None:
    found = estimate_log(log("major_leakage_minor_friction"), Rig(), EstimateOptions(form="pressure"))
    assert EstimateCode.INNOVATIONS_LARGE in [note.code for note in found.gate.reasons]
    assert rejection_notes(found.evidence) == ()


def refused_with(form: str, outcome: Outcome, *reasons: Note) -> list[str]:
    gate = Gate(False, reasons)
    found = BulkModulusEstimate(outcome, None, None, 0.01, gate, form, (), {}, {}, None, None)
    return [note.code for note in rejection_notes(found)]


def test_slightly_large_position_residuals_without_pressure_do_not_refuse_the_fit() -> None:
    near, laws = (
        EstimateCode.POSITION_RESIDUALS_LARGE.note(ratio=1.9, motion_percent=9.0),
        EstimateCode.FRICTION_LAWS_DISAGREE.note(least_pa=1e8, most_pa=2e8),
    )
    froze = SensorCode.SENSOR_FROZE.note(channel="position_m", value=0.0, begin_s=0.0, length_s=1.0)
    wide = EstimateCode.BOUND_TOO_WIDE.note(percent=5.0)
    assert refused_with("motion", Outcome.OK, near, laws) == []
    assert refused_with("motion", Outcome.NOT_OBSERVABLE, froze, wide, near) == [SensorCode.SENSOR_FROZE]
    far = EstimateCode.POSITION_RESIDUALS_LARGE.note(ratio=38.0, motion_percent=6.1)
    assert refused_with("motion", Outcome.MISMATCH, wide, far) == [EstimateCode.POSITION_RESIDUALS_LARGE]
    # a fine encoder: large over its noise, small over the motion
    fine = EstimateCode.POSITION_RESIDUALS_LARGE.note(ratio=38.0, motion_percent=5.9)
    assert refused_with("motion", Outcome.MISMATCH, wide, fine) == []
    large = EstimateCode.PRESSURE_RESIDUALS_LARGE.note(ratio=1.9)
    assert refused_with("flow", Outcome.OK, large) == [EstimateCode.PRESSURE_RESIDUALS_LARGE]


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Record, tuple[str, ...]]]:
    """Record each measurement of a log's noise, wherever the function was imported."""
    calls: list[tuple[Record, tuple[str, ...]]] = []
    original = measurement_noise.measurement_variances

    def counting(record: Record, channels: Sequence[str]) -> object:
        calls.append((record, tuple(channels)))
        return original(record, channels)

    for name, module in list(sys.modules.items()):
        if name.split(".")[0] in PACKAGES and vars(module).get("measurement_variances") is original:
            monkeypatch.setattr(module, "measurement_variances", counting)
    return calls


WAYS = {
    "the flow form, fitted": EstimateOptions(),
    "the flow form, filtered": EstimateOptions(form="flow", method="ekf"),
    "the pressure form": EstimateOptions(form="pressure"),
    "the pressure form, smoothed": EstimateOptions(method="smoother"),
    "the pressure form, tuned": EstimateOptions(tuned=True),
    "the acceleration form": EstimateOptions(form="acceleration"),
    "the motion form": EstimateOptions(form="motion"),
}


@pytest.mark.parametrize("way", thinned(WAYS, ("the flow form, fitted", "the pressure form", "the acceleration form")))
def test_the_noise_of_a_cleaned_log_is_measured_once(way: str, measured: list[tuple[Record, tuple[str, ...]]]) -> None:
    record = log(duration=1.0)
    for channel in ("motor_speed_rad_s", "position_m", "velocity_m_s", PRESSURE):
        record = with_outliers(record, channel, 5)
    cleaned = clean_log(record, HEALTHY)
    assert [channels for seen, channels in measured if seen is cleaned.record] == [tuple(cleaned.variances)]
    assert set(cleaned.variances) == {"motor_speed_rad_s", "position_m", "velocity_m_s", PRESSURE}
    measured.clear()
    estimate_clean(cleaned, HEALTHY, WAYS[way])
    assert measured == []


@pytest.mark.parametrize(
    ("chosen", "asked"),
    [
        ({}, False),
        ({"method": "least-squares"}, False),
        ({"form": "pressure"}, False),
        ({"method": "ekf"}, True),
        ({"tuned": True}, True),
        ({"robust": "huber"}, True),
        ({"states": ("bulk_modulus",)}, True),
        ({"method": "ekf", "tuned": True}, True),
    ],
)
def test_a_filters_name_tuning_a_robust_update_or_further_states_select_filtering(
    chosen: dict[str, Any], asked: bool
) -> None:
    assert EstimateOptions(**chosen).filtering is asked


@pytest.mark.parametrize(
    ("share", "code"), [(0.4, EstimateCode.STIFFER_THAN_RIG), (1.0, None), (2.5, EstimateCode.SOFTER_THAN_RIG)]
)
def test_oil_unlike_the_rigs_is_noted_with_the_chamber_volume_that_would_explain_it(
    share: float, code: EstimateCode | None
) -> None:
    rig = replace(HEALTHY, bulk_modulus=share * HEALTHY.bulk_modulus)
    believed = replace(estimate_bulk_modulus(log(), HEALTHY), gate=Gate(True, ()))
    told = [
        note for note in finding_of(clean_log(log(), HEALTHY), believed, Rig(parameters=rig)).notes if note.code in OILS
    ]
    assert [note.code for note in told] == ([] if code is None else [code])
    if told:
        assert told[0].data["volume"] == pytest.approx(share * HEALTHY.chamber_volume, rel=0.01)
    doubted = replace(believed, gate=Gate(False, ()))
    assert not OILS & {note.code for note in finding_of(clean_log(log(), HEALTHY), doubted, Rig(parameters=rig)).notes}
