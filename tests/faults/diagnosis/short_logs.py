"""Short logs of one actuator, and made-up fits, for tests of the diagnosis's numbers."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.blocks import Blocks, blocks_of
from faults.diagnosis.circuits.class_fit import (
    PointFit,
)
from faults.diagnosis.circuits.class_regions import (
    ClassFits,
    fit_classes,
)
from faults.eha.inject import abrupt_fault
from plant.arrays import Array
from plant.eha.circuit_parameters import circuit_of
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import RIG

PAPER = EhaParameters()


ACTUATOR = actuator_of(PAPER)


SHORT = actuator_of(replace(PAPER, stroke=0.2, load_force=200.0, leakage_coefficient=9e-12))


PRESSURE = "differential_pressure_pa"


def noted(notes: Any) -> list[dict[str, Any]]:
    return [{"code": str(note.code), **dict(note.data)} for note in notes]


@cache
def log(
    condition: str = "minor_leakage", drive: str = "prbs", after: str = "", seconds: float = 3.0, share: float = 0.55
) -> Record:
    """Return a short log of a circuit, with or without a change to another condition midway."""
    rng = np.random.default_rng(11)
    speed = make_drive(drive, seconds, 2e-3, PAPER, rng)
    first = circuit_of(parameters_for(CONDITIONS[condition]))
    later = circuit_of(parameters_for(CONDITIONS[after])) if after else first
    return simulate(CIRCUIT, speed, 2e-3, abrupt_fault(first, later, share * seconds), sensors=RIG, rng=rng)


@cache
def blocks(
    condition: str = "minor_leakage",
    after: str = "",
    *,
    pressure: bool = True,
    drive: str = "prbs",
    seconds: float = 3.0,
    share: float = 0.55,
) -> Blocks:
    record = log(condition, drive, after, seconds, share)
    return blocks_of(record if pressure else record.replace(differential_pressure_pa=None))


@cache
def classes(condition: str = "minor_leakage", *, pressure: bool = True) -> ClassFits:
    return fit_classes(blocks(condition, pressure=pressure), ACTUATOR)


def made_fit(off: Array, scales: Array, information: Array, one: Blocks) -> PointFit:
    """Return a fit at a distance from the second condition, with residuals of 3 % of the blocks' outputs."""
    return PointFit(
        ACTUATOR.conditions[1] + off, 5.0, information, scales, 0.97 * one.outputs, np.ones((7, *one.outputs.shape))
    )


OFF = np.array([0.1, -0.05, 0.2, 0.0, -0.1, 0.3, 0.4])


INFORMATION = np.diag([400.0, 300.0, 200.0, 90.0, 500.0, 60.0, 2.0]) + 8.0


def made_classes(off: Array, one: Blocks, scores: Array | None = None, scale: float = 2.0) -> ClassFits:
    fit = made_fit(off, scale * one.noise, INFORMATION, one)
    nine = np.linspace(0.0, -8.0, 9) if scores is None else scores
    return ClassFits(
        fit,
        INFORMATION,
        nine,
        np.ones((9, 2)),
        nine,
        lambda: np.asarray(np.linalg.inv(INFORMATION), dtype=np.float64),
        2.0,
    )
