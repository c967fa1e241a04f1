"""Single steps of a diagnosis (fits, biases, splits of a log), kept in `numbers_steps.json`."""

from dataclasses import replace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from faults.diagnosis.changes import onset
from faults.diagnosis.changes.onset import _change_block, part_of
from faults.diagnosis.changes.split import likeliest_split
from faults.diagnosis.circuits import class_fit, out_of_model
from faults.diagnosis.circuits.class_fit import _fit_at, _step, fit_freely
from faults.diagnosis.circuits.class_regions import fit_classes
from faults.diagnosis.circuits.out_of_model import (
    _bias_note,
    _bias_notes,
    _least_bias,
    _linear_biases,
    _nearest_severity,
)
from plant.arrays import Array
from plant.log.record import Record
from tests.faults.diagnosis.short_logs import ACTUATOR, OFF, blocks, classes, log, made_classes, noted
from tests.numbers import Numbers, Roughly

NUMBERS = Numbers(__file__)
PULL: Array = np.asarray(class_fit.LASTING * np.linalg.inv(class_fit.WEAK_PRIOR), dtype=np.float64)
SIZES = {"pump": 1.0, "motor_speed_rad_s": 80.0, "differential_pressure_pa": 3e5}


def biased(*found: tuple[float, float]) -> dict[str, tuple[float, float]]:
    """Return values and errors of the biases of pump, speed and pressure; those that are not given are zero."""
    return dict(zip(SIZES, [*found, *[(0.0, 0.0)] * (3 - len(found))], strict=True))


@NUMBERS.case(relative=1e-4)
def one_step_of_a_free_fit() -> dict[str, Any]:
    told: dict[str, Any] = {}
    centre = ACTUATOR.conditions[1]
    alone, part = blocks(pressure=False), part_of(blocks(), 20, 200)
    for name, one, off in (
        ("near", blocks(), 0.1),
        ("far", blocks(), 6.0),
        ("without pressure", alone, 1.0),
        ("in part", part, 1.0),
    ):
        found = _fit_at(one, ACTUATOR, centre, centre + off * OFF, PULL)
        told[name] = {
            "cost": found.cost,
            "information": found.information[np.triu_indices(7)],
            "slopes of velocity": found.slopes[:, 60, 0],
            "step": _step(one, found, centre, PULL),
        }
    return told


@NUMBERS.case()
def rounds_of_free_fits() -> dict[str, Any]:
    told: dict[str, Any] = {}
    runs = class_fit.predicted_outputs
    afar = ACTUATOR.conditions[8] + 0.4
    for name, start, gained in (("usual", None, 0.5), ("roughly", None, 50.0), ("from afar", afar, 0.5)):
        with patch.object(class_fit, "predicted_outputs", side_effect=runs) as asked:
            # a copy of the blocks, whose runs are not yet cached
            fit = fit_freely(replace(blocks()), ACTUATOR, "normal", start, gained)
        told[name] = {"rounds": Roughly(asked.call_count, 0.1), "cost": Roughly(fit.cost, 1e-3)}
    with patch.object(class_fit, "predicted_outputs", side_effect=runs) as asked:
        fit_classes(blocks("major_friction"), ACTUATOR)
    told["of all classes"] = Roughly(asked.call_count, 0.1)
    with patch.object(class_fit, "predicted_outputs", side_effect=runs) as asked:
        fit_classes(blocks("major_friction"), ACTUATOR, start=ACTUATOR.conditions[6])
    told["of all classes from one start"] = Roughly(asked.call_count, 0.1)
    alike = np.repeat(class_fit.nominal_runs(blocks(), ACTUATOR)[:1], 9, axis=0)
    with patch.object(class_fit, "predicted_outputs", side_effect=runs) as asked:
        fit_classes(blocks(), ACTUATOR, runs=alike)
    told["where nine classes are alike"] = Roughly(asked.call_count, 0.1)
    return told


@NUMBERS.case(relative=1e-3)
def one_step_of_a_bias() -> dict[str, Any]:
    told: dict[str, Any] = {}
    centre = ACTUATOR.conditions[1]
    for name, pressure in (("with pressure", True), ("without", False)):
        one = blocks(pressure=pressure)
        sizes = {key: SIZES[key] for key in SIZES if pressure or key != "differential_pressure_pa"}
        for trust in (1.0, 1e-3):
            fit = _fit_at(one, ACTUATOR, centre, centre + 0.1 * OFF, PULL)
            found = _linear_biases(one, fit, trust, ACTUATOR, sizes)
            told[f"{name}, trusted {trust:g}"] = {of: list(pair) for of, pair in found.items()}
    part = part_of(blocks(), 20, 200)
    fit = _fit_at(part, ACTUATOR, centre, centre + OFF, PULL)
    told["in part"] = {of: list(pair) for of, pair in _linear_biases(part, fit, 0.1, ACTUATOR, SIZES).items()}
    told["least that matters"] = {of: [_least_bias(of, error, SIZES) for error in (0.0, SIZES[of])] for of in SIZES}
    told["told as"] = noted([_bias_note(of, 0.2) for of in SIZES])
    return told


@NUMBERS.case(relative=1e-3)
def biases_on_either_side() -> dict[str, Any]:
    told: dict[str, Any] = {}
    size = float(np.sqrt(np.mean(blocks().speed ** 2)))
    loud = float(np.sqrt(np.nanmean(blocks().outputs[:, 1] ** 2)))
    for name, found in {
        "small": biased((0.079, 0.0), (0.029 * size, 0.0), (-0.049 * loud, 0.0)),
        "large": biased((0.0, 0.0), (-0.031 * size, 0.0), (0.051 * loud, 0.0)),
        "large but unsure": biased((0.3, 0.16), (size, 0.6 * size), (loud, 0.6 * loud)),
        "surer": biased((0.0, 0.1), (size, 0.45 * size), (-loud, 0.45 * loud)),
        "a pump that the misfit does not want": biased((-0.3, 0.0)),
        "a pump that is hardly there": biased((-0.9, 0.0)),
    }.items():
        with patch.object(out_of_model, "_linear_biases", return_value=found):
            told[name] = noted(_bias_notes(blocks(), classes(), ACTUATOR))
    for gain, pressure in ((19.0, True), (21.0, True), (2.9, False), (3.1, False)):
        found = biased((-0.2 if pressure else 0.2, 0.0))  # without pressure, another step looks for a worn pump
        if not pressure:
            del found["differential_pressure_pa"]
        one = blocks(pressure=pressure)
        fits = classes(pressure=pressure)
        tries = [replace(fits.best, cost=30.0 * gain), replace(fits.best, cost=0.0)]
        with (
            patch.object(out_of_model, "_linear_biases", return_value=found),
            patch.object(out_of_model, "fit_freely", side_effect=tries),
        ):
            told[f"a pump that gains {gain:g} a lasting misfit"] = noted(_bias_notes(one, fits, ACTUATOR))
    told["nearest severity"] = list(_nearest_severity(made_classes(OFF, blocks()), ACTUATOR))
    return told


@NUMBERS.case()
def splits_near_the_ends_of_a_log() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for share in (0.12, 0.3, 0.66, 0.88):
        one = blocks("normal", "major_leakage", seconds=4.0, share=share)
        fits = fit_classes(one, ACTUATOR)
        split = likeliest_split(one, fits.best)
        place = None if split is None else split.place
        told[f"at {4.0 * share:g} s of 4"] = {"block": place}
        if place is not None:
            row = class_fit.parameter_rows(ACTUATOR.conditions[:1], ACTUATOR.circuit, ACTUATOR.rated)[0]
            when = _change_block(one, row, ACTUATOR.conditions[2], place, ACTUATOR)
            told[f"at {4.0 * share:g} s of 4"] |= {
                "low, best, high": list(when),
                "where the split is late": list(_change_block(one, row, ACTUATOR.conditions[2], place + 60, ACTUATOR)),
                "where it is early": list(_change_block(one, row, ACTUATOR.conditions[2], place - 8, ACTUATOR)),
            }
    weak = blocks("normal", "minor_leakage", seconds=4.0, drive="sine")
    split = likeliest_split(weak, fit_classes(weak, ACTUATOR).best)
    told["of little"] = None if split is None else split.place
    return told


@NUMBERS.case()
def parts_of_a_log_about_alarms() -> dict[str, Any]:
    """Return the parts of a log of 100 s at 50 Hz, about alarms that the watch is made to raise."""
    from faults.watch.events import Alarm

    long = Record(0.02, {name: np.resize(log()[name], 5000) for name in log()}, start_time=7.0)
    told = ((5.0, "flow"), (30.0, "force"), (50.0, "loss"), (70.0, "flow"), (90.0, "flow"), (95.0, "flow"))
    alarms = [Alarm(t + 7.3, balance, t + 7.0, (t, t), 5.0, 4.0) for t, balance in told]
    with patch.object(onset, "watch_record", return_value=alarms):
        found = list(onset._windows_about_alarms(long, ACTUATOR))
        short = len(list(onset._windows_about_alarms(long.slice(0, 4490), ACTUATOR)))
        slow = len(list(onset._windows_about_alarms(replace(long, sample_time=0.051), ACTUATOR)))
    parts = [[one.start_time, len(one)] for one in found]
    return {"begin and length": parts, "of 89.8 s": short, "of a slow log": slow}


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
