"""Results of the diagnosis on short logs and made-up fits, kept in `numbers.json`."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimation.finding import Quantity
from faults.conditions import CONDITIONS
from faults.diagnosis.calibration import shipped_calibration
from faults.diagnosis.circuits.blocks import Blocks, blocks_of
from faults.diagnosis.circuits.circuit_runs import COORDINATES, coordinates_of, parameter_rows, predicted_outputs
from faults.diagnosis.circuits.class_fit import (
    CONDITION_SPREAD,
    WEAK_PRIOR,
    PointFit,
    fit_freely,
    least_scales,
    misfit,
    nominal_runs,
    scales_of,
)
from faults.diagnosis.circuits.class_regions import credible_information, is_stuck
from faults.diagnosis.circuits.model_doubt import lasting_misfit
from faults.diagnosis.circuits.pressure_scale import spread_without_pressure
from faults.diagnosis.circuits.region_scores import region_scores
from faults.diagnosis.not_told import not_told_notes
from faults.diagnosis.severity import limits_of, severities, severities_at, with_bulk_modulus
from faults.diagnosis.severity_total import with_totals
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.doubts import PRESSURE_GAIN, Spread
from plant.eha.drives import make_drive
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import RIG
from plant.solvers.steps import parameter_names
from tests.faults.diagnosis.short_logs import (
    ACTUATOR,
    INFORMATION,
    OFF,
    PAPER,
    PRESSURE,
    SHORT,
    blocks,
    classes,
    log,
    made_classes,
    made_fit,
    noted,
)
from tests.numbers import Found, Numbers

NUMBERS = Numbers(__file__)


def summed(one: Blocks) -> dict[str, Any]:
    sums = {"velocity [m/s]": one.velocity, "pressure [Pa]": one.pressure, "speed [rad/s]": one.speed}
    return {
        "count": [len(one.velocity), one.block, one.first],
        "time between samples [s]": one.sample_time,
        "noise": one.noise,
        "travel and reach [m]": [one.travel, one.reach],
        **{name: values[[3, 50, -1]] for name, values in sums.items() if values is not None},
        "missing": int(np.count_nonzero(np.isnan(one.outputs))),
    }


@NUMBERS.case()
def blocks_of_logs() -> dict[str, Any]:
    whole = log()
    quick = make_drive("steps", 0.6, 2e-4, PAPER, np.random.default_rng(1))
    fast = simulate(CIRCUIT, quick, 2e-4, PAPER, sensors=RIG, rng=np.random.default_rng(2))
    holes = {name: np.where(np.arange(len(whole)) % 37 < 9, np.nan, whole[name]) for name in ("position_m", PRESSURE)}
    return {
        "as logged": summed(blocks_of(whole)),
        "sampled fast": summed(blocks_of(fast)),
        "without position": summed(blocks_of(whole.replace(position_m=None))),
        "with holes": summed(blocks_of(whole.replace(**holes))),
        "pressure holes alone": summed(blocks_of(whole.replace(position_m=None, **{PRESSURE: holes[PRESSURE]}))),
        "pressure missing but named": summed(blocks_of(whole.replace(**{PRESSURE: np.full(len(whole), np.nan)}))),
        "long": len(blocks_of(Record(0.02, {name: np.resize(whole[name], 2000) for name in whole})).velocity),
    }


@NUMBERS.case()
def conditions_as_coordinates() -> dict[str, Any]:
    points = np.vstack([ACTUATOR.conditions[[0, 4, 8]], ACTUATOR.conditions[0] + 0.3, ACTUATOR.conditions[2] - 5.0])
    points[1, -1], points[4, 4] = -9.0, 2.0
    names, rows = parameter_names(CircuitParameters), parameter_rows(points, ACTUATOR.circuit, ACTUATOR.rated)
    return {
        "of nine": dict(zip(CONDITIONS, ACTUATOR.conditions, strict=True)),
        "rated velocity [m/s]": [ACTUATOR.rated, SHORT.rated],
        "stroke [m]": [ACTUATOR.circuit.stroke, SHORT.circuit.stroke],
        "of another rig": coordinates_of(SHORT.circuit, 0.05),
        "rows": [dict(zip(names, row, strict=True)) for row in rows],
        "of another rig's": dict(zip(names, parameter_rows(points[:1], SHORT.circuit, SHORT.rated)[0], strict=True)),
        "prior of a class": CONDITION_SPREAD[np.triu_indices(7)],
        "prior of a circuit": WEAK_PRIOR[np.triu_indices(7)],
    }


@NUMBERS.case(relative=1e-6)
def predictions_of_circuits() -> dict[str, Any]:
    one = blocks(seconds=1.5)
    rows = parameter_rows(ACTUATOR.conditions[[0, 5]], ACTUATOR.circuit, ACTUATOR.rated)
    course = np.linspace(1.0, 2.0, len(one.speed))
    ways = {
        "plain": one,
        "another before": replace(one, earlier_circuit=(300, rows[1])),
        "leakage grows": replace(one, leakage_course=course),
        "stops within reach": replace(one, stop=0.6 * one.reach),
        "without pressure": replace(one, pressure=None),
    }
    told: dict[str, Any] = {}
    for name, way in ways.items():
        runs = predicted_outputs(way, rows)
        told[name] = {
            "velocity [m/s]": runs[:, [20, 70, -1], 0],
            **({"pressure [Pa]": runs[:, [20, 70, -1], 1]} if runs.shape[2] > 1 else {}),
        }
    near = replace(ACTUATOR.circuit, stroke=2.0 * one.reach * 1.01)
    told["stops where the log's reach shows them"] = predicted_outputs(
        one, parameter_rows(ACTUATOR.conditions[:1], near, ACTUATOR.rated)
    )[0, [20, 70, -1], 0]
    return told


@NUMBERS.case(relative=1e-3)
def misfits_of_the_nominal_circuits() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, one in {"with pressure": blocks(), "without": blocks(pressure=False)}.items():
        runs = nominal_runs(one, ACTUATOR)
        told[name] = {
            "misfit": dict(zip(CONDITIONS, [misfit(one, run) for run in runs], strict=True)),
            "scales": [scales_of(one, run) for run in runs[:3]],
            "least scales": least_scales(one),
            "lasting misfit": [lasting_misfit(run, one) for run in runs[:3]],
        }
    told["not finite"] = misfit(blocks(), np.full_like(blocks().outputs, np.nan))
    return told


def _known(fit: PointFit) -> dict[str, Any]:
    deviations = np.sqrt(np.diag(np.linalg.inv(fit.information + np.linalg.inv(WEAK_PRIOR))))
    return {
        name: Found(float(x), float(std)) for name, x, std in zip(COORDINATES, fit.coordinates, deviations, strict=True)
    }


@NUMBERS.case(relative=0.01)
def fitted_circuits() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, pressure in (("with pressure", True), ("without", False)):
        found = classes(pressure=pressure)
        told[name] = {
            "coordinates": {
                one: Found(float(x), float(std))
                for one, x, std in zip(COORDINATES, found.best.coordinates, np.sqrt(np.diag(found.spread)), strict=True)
            },
            "deviation if the model held": np.sqrt(np.diag(found.covariance)),
            "scales": found.best.scales,
            "scores": {one: float(x) for one, x in zip(CONDITIONS, found.scores, strict=True) if x > -300.0},
            "nominal misfit": found.nominal[:3],
            "nominal scales": found.nominal_scales[:3],
            "lasting": found.lasting,
            "told of leakage": float(found.discounted_information[0, 0]),
        }
    from_afar = fit_freely(blocks(), ACTUATOR, "normal", ACTUATOR.conditions[8] + 0.4)
    told["from afar"] = _known(from_afar)
    told["roughly"] = {"cost": fit_freely(blocks(), ACTUATOR, "major_leakage", None, 200.0).cost}
    return told


@NUMBERS.case()
def regions_of_the_classes() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, pressure in (("with pressure", True), ("without", False)):
        one = blocks(pressure=pressure)
        fit = made_fit(OFF, 3.0 * one.noise, INFORMATION, one)
        known = credible_information(fit, one)
        told[name] = {
            "believed": known[np.triu_indices(7)],
            "believed of a piston that stands": credible_information(fit, one, stuck=True)[np.triu_indices(7)],
            "believed of a good fit": credible_information(replace(fit, scales=one.noise), one)[0],
            "scores": region_scores(fit, INFORMATION, ACTUATOR),
            "spread": spread_without_pressure(fit, INFORMATION, one, ACTUATOR.conditions[1])[np.triu_indices(7)],
            "lasting misfit": lasting_misfit(fit.fitted, one),
        }
    told["stands"] = [
        is_stuck(replace(blocks(), velocity=share * blocks().velocity), ACTUATOR) for share in (1.0, 1e-2, 1e-3, 1e-4)
    ]
    travelling = [replace(blocks(), velocity=np.full(100, times * 2e-5 / 0.99)) for times in (4.9, 5.1)]
    told["stands, about its limit"] = [is_stuck(one, ACTUATOR) for one in travelling]
    return told


@NUMBERS.case()
def severities_of_circuits() -> dict[str, Any]:
    told: dict[str, Any] = {
        "of nine": {
            name: dict(severities_at(point, ACTUATOR))
            for name, point in zip(CONDITIONS, ACTUATOR.conditions, strict=True)
        },
        "of another rig": dict(severities_at(SHORT.conditions[4], SHORT)),
        "limits": dict(limits_of(ACTUATOR)),
    }
    soft = made_classes(np.array([0.3, 0.2, 0.1, 0.1, 0.2, -0.5, 0.0]), blocks())
    for name, fits in (("fitted", made_classes(OFF, blocks())), ("soft oil", soft)):
        for widths, stretch in (("plain", None), ("calibrated", shipped_calibration().widths(True))):
            told[f"{name}, {widths}"] = {one: _of(q) for one, q in severities(fits, ACTUATOR, stretch).items()}
    found = severities(soft, ACTUATOR)
    estimated = Quantity(1.3e8, "Pa", (1.25e8, 1.35e8), ci95_total=(1.1e8, 1.5e8))
    told["with an estimate"] = {name: _of(q) for name, q in with_bulk_modulus(found, estimated, ACTUATOR).items()}
    spreads = {
        "pump_displacement": Spread(0.03, 0.03),
        "piston_area": Spread(0.02, 0.01),
        PRESSURE_GAIN: Spread(0.015, 0.02),
    }
    for name, pressure in (("with pressure", True), ("without", False)):
        totals = with_totals(found, ACTUATOR, spreads, pressure=pressure)
        told[f"with the rig's share, {name}"] = {one: _of(q) for one, q in totals.items()}
    return told


def _of(one: Quantity) -> dict[str, Any]:
    return {"value": one.value, "unit": one.unit, "interval": one.ci95, "with the rig's share": one.ci95_total}


@NUMBERS.case()
def what_a_log_does_not_tell() -> dict[str, Any]:
    found = severities(made_classes(OFF, blocks()), ACTUATOR)
    told: dict[str, Any] = {}
    for known in (0.1, 0.2, 0.3, 1.0, 100.0):
        information = np.diag(known * np.array([4.0, 4.0, 11.1, 11.1, 3.4, 11.1, 1.0]))
        fits = replace(made_classes(OFF, blocks()), information=information)
        told[f"known {known:g} times as well as believed"] = {
            name: noted(not_told_notes(fits, found, pressure=pressure))
            for name, pressure in (("with pressure", True), ("without", False))
        }
    for name, flow, speed in (
        ("alike", (0.2, 0.5), (10.0, 14.0)),
        ("told apart", (0.3, 0.42), (10.0, 14.0)),
        ("both vague", (0.2, 0.5), (5.0, 20.0)),
    ):
        some = {**found, "leakage_flow": Quantity(0.35, "L/min", flow), "velocity_lost": Quantity(12.0, "%", speed)}
        told[name] = noted(not_told_notes(made_classes(OFF, blocks()), some, pressure=True))
    return told


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
