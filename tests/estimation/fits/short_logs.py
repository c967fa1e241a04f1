"""Short logs of one actuator and made-up fits, for the recorded numbers of the fits."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from estimation.fits.flow.log import flow_log
from estimation.fits.flow.search import flow_starts
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypothesis_search.wide_log import widened_log
from estimation.models.flow import FLOW_FORM, STIFFNESS
from plant.arrays import Array
from plant.eha.circuit_parameters import circuit_of
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.notes import Note
from plant.sensors.sensors import BENCH

PAPER = EhaParameters()


WORN = replace(PAPER, leakage_coefficient=2e-11, flow_bias=5e-6)


SINGLE = replace(PAPER, area_difference=0.18, volume_difference=-0.1)


PRESSURE, SPEED, POSITION = "differential_pressure_pa", "motor_speed_rad_s", "position_m"


VARIANCES = {SPEED: 1e-4, POSITION: 1e-12, PRESSURE: 1e7}


def noted(notes: Sequence[Note]) -> list[dict[str, Any]]:
    return [{"code": str(note.code), **dict(note.data)} for note in notes]


@cache
def log(
    seconds: float = 1.0,
    sample_time: float = 1e-3,
    p: EhaParameters = WORN,
    position_noise: float = 0.0,
    drive: str = "steps",
) -> Record:
    rng = np.random.default_rng(3)
    sensors = replace(BENCH, position_noise=position_noise, position_quantum=1e-5) if position_noise else BENCH
    speed = make_drive(drive, seconds, sample_time, p, rng)
    return simulate(CIRCUIT, speed, sample_time, circuit_of(p), sensors=sensors, rng=rng)


@cache
def at_one_speed(delivery: float = 0.85, speed: float = 100.0) -> Record:
    """Return a log of a worn pump that runs to and fro at one speed, held for 50 ms or longer each time."""
    rng = np.random.default_rng(3)
    turned = speed * np.where(rng.random(40) < 0.5, -1.0, 1.0).repeat(50)
    worn = replace(PAPER, pump_displacement=delivery * PAPER.pump_displacement)
    return simulate(CIRCUIT, turned, 1e-3, circuit_of(worn), sensors=BENCH, rng=rng)


def lost_in_bias(delivery: float = 0.85, speed: float = 100.0) -> dict[str, float]:
    """Return the values of a plain fit of such a log [SI]: the flow bias absorbs the pump's loss."""
    start = {**flow_starts(PAPER, PAPER.bulk_modulus)[2], STIFFNESS: 3e7, "case_leakage": 4e-13}
    lost = (1.0 - delivery) * PAPER.pump_displacement * speed
    return {**start, "leakage_coefficient": PAPER.leakage_coefficient, "flow_bias": PAPER.flow_bias + lost}


def seen(record: Record, p: EhaParameters = PAPER, **uncertainties: float) -> GreyBoxLog:
    return flow_log(record, p, uncertainties, VARIANCES)


@cache
def problem(form: Any = FLOW_FORM, position_noise: float = 0.0) -> FreedProblem:
    return FreedProblem.of(form, seen(log(0.5, position_noise=position_noise)))


def usual(p: FreedProblem) -> Array:
    start = {**flow_starts(PAPER, PAPER.bulk_modulus)[2], STIFFNESS: 2e7, "case_leakage": 4e-13}
    return p.model.theta(start)


def made_fit(
    cost: float,
    modulus: float,
    std: float,
    *,
    chi: float = 1.0,
    correlated: float = 0.0,
    late: float = 0.0,
    gain: float = 0.0,
) -> GreyBoxFit:
    values = {"bulk_modulus": modulus, "leakage_coefficient": 1e-12}
    return GreyBoxFit(
        FLOW_FORM,
        np.zeros(2),
        values,
        {"bulk_modulus": std, "leakage_coefficient": 1e-13},
        cost,
        (chi,),
        (correlated,),
        {},
        {SPEED: (late, gain, 0.0), POSITION: (0.0, 0.1, 0.0)},
    )


@cache
def wide(stiffness: float = 3e7) -> GreyBoxLog:
    return widened_log(seen(log(0.5), chamber_volume=0.1), PAPER, {STIFFNESS: stiffness})
