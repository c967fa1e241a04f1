"""Effects of faults of the gear-pump actuator, and how far apart they are, kept in `numbers.json`."""

from dataclasses import asdict
from typing import Any

import numpy as np
import pytest

from faults.conditions import CONDITIONS, parameters_for
from faults.eha import bank, isolability
from faults.eha.bank import identification_run, mathematical_bank, predict_run, predict_runs
from faults.eha.inject import abrupt_fault, growing_fault, varied_actuator
from faults.eha.isolability import Distances, condition_distances, structural_isolability, wrong_verdicts
from faults.eha.physical import THROTTLE_A, THROTTLE_B, aerated, with_drifted_relief, with_throttles
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.model import EhaParameters
from plant.log.record import Record
from plant.sensors.sensors import PAPER
from tests.edges import edge
from tests.numbers import Numbers, or_refused

NUMBERS = Numbers(__file__)
P, CIRCUIT = EhaParameters(), CircuitParameters()


def differs(changed: Any, base: Any) -> dict[str, float]:
    was = asdict(base)
    return {name: value for name, value in asdict(changed).items() if value != was[name]}


@NUMBERS.case()
def physical_faults() -> dict[str, Any]:
    volts = [(10.0, 0.0), (2.0, 2.5), (1.9, 1.0), (1.5, 2.4), (1.75, 5.0), (0.0, 10.0), (6.0, 2.3)]
    calls: dict[str, Any] = {
        "air": lambda one: aerated(CIRCUIT, one),
        "relief": lambda one: with_drifted_relief(CIRCUIT, one),
        "throttle A": lambda one: with_throttles(CIRCUIT, one, 0.0),
        "throttle B": lambda one: with_throttles(CIRCUIT, 10.0, one),
    }
    sizes = (-0.1, 0.0, 1e-9, 0.4, 0.5, 0.51, 0.999, 1.0, 2.0, 2.01, 10.0, 10.1, np.inf)
    return {
        **{f"throttles at {a:g} and {b:g} V": differs(with_throttles(CIRCUIT, a, b), CIRCUIT) for a, b in volts},
        "air": differs(aerated(CIRCUIT, 0.03), CIRCUIT),
        "relief": differs(with_drifted_relief(CIRCUIT, 0.7), CIRCUIT),
        "throttle B's areas [m^2]": [THROTTLE_B.at(one) for one in (0.0, 1.0, 2.3, 2.5, 8.0, 10.0)],
        "throttle A": [
            list(one) for one in zip(*(THROTTLE_A.at(volts) for volts in (1.75, 2.0, 5.0, 10.0)), strict=True)
        ],
        "refused": {
            name: [isinstance(or_refused(lambda one=one, call=call: call(one)), str) for one in sizes]
            for name, call in calls.items()
        },
    }


@NUMBERS.case()
def injected_faults() -> dict[str, Any]:
    faulty = parameters_for(CONDITIONS["major_leakage_major_friction"])
    other = varied_actuator(P, np.random.default_rng(3))
    return {
        "abrupt": abrupt_fault(P, faulty, 2.0).sample(np.array([0.0, 1.9, 2.0, 9.0]))[:, [5, 6, 7]].T,
        "growing": growing_fault(P, faulty, 1.0, 3.0).sample(np.array([0.0, 1.0, 1.5, 3.0, 9.0]))[:, [5, 6, 7]].T,
        "times": [
            isinstance(or_refused(lambda one=one: abrupt_fault(P, faulty, one)), str)
            for one in (-1.0, 0.0, 1e-9, np.inf)
        ],
        "spans": [
            isinstance(or_refused(lambda one=one: growing_fault(P, faulty, *one)), str)
            for one in ((1.0, 1.0), (1.0, 0.9), (1.0, 1.1), (np.nan, 1.0), (0.0, np.inf))
        ],
        "spread": differs(other, P),
        "a spread of one": differs(varied_actuator(P, np.random.default_rng(3), 0.0, 0.0, 0.5), P),
        "widths": [
            isinstance(or_refused(lambda one=one: varied_actuator(P, np.random.default_rng(3), **one)), str)
            for one in ({"leakage": -0.01}, {"friction": 0.0}, {"bulk_modulus": 0.99}, {"leakage": 1.0})
        ],
    }


@NUMBERS.case(relative=1e-4)
def banks_of_models() -> dict[str, Any]:
    speed = 40.0 * np.sin(0.02 * np.arange(400.0)) + 20.0 * np.sign(np.sin(0.05 * np.arange(400.0)))
    record = Record(1e-3, {"motor_speed_rad_s": np.where(np.arange(400) == 9, np.nan, speed)})
    models = mathematical_bank(P)
    side = predict_runs(record, models)
    alone = predict_run(record, models["minor_leakage"])
    ran = identification_run(P, CONDITIONS["minor_friction"], np.random.default_rng(2), duration=0.3)
    coarse = predict_run(Record(4e-3, {"motor_speed_rad_s": speed[::4]}), P)
    return {
        "side by side": {
            name: {channel: values[k] for (channel, values), k in zip(channels.items(), (-1, 200, 399), strict=False)}
            for name, channels in side.items()
        },
        "alone": {name: values[[50, 200, 399]] for name, values in alone.items()},
        "coarse": {name: values[[12, 50, 99]] for name, values in coarse.items()},
        "identification": {name: ran[name][[0, 100, 299]] for name in ran},
        "identification, length and step": [len(ran), ran.sample_time],
        "lengths [s]": [bank.IDENTIFICATION_DURATION, bank.LIBRARY_DURATION],
    }


@NUMBERS.case(relative=1e-4)
def how_far_conditions_are_apart() -> dict[str, Any]:
    speed = 60.0 * np.sign(np.sin(0.06 * np.arange(300.0)))
    found = condition_distances(P, speed, 2e-3)
    slow = condition_distances(P, speed[:60], 0.1, ("position_m",))
    made = Distances(("a", "b", "c"), np.array([[0.0, 5.0, 9.0], [4.0, 0.0, 7.0], [8.0, 2.0, 0.0]]), 3.0)
    return {
        "nats": found.nats,
        "seconds": [found.seconds, slow.seconds],
        "slow": slow.nats[:3],
        "hardest": list(found.hardest),
        "least": found.least,
        "made": [made.mutual, list(made.hardest), made.least],
        "wrong verdicts": [wrong_verdicts(one) for one in (0.0, 1.0, 10.8)],
        "channels": [
            or_refused(lambda one=one: condition_distances(P, speed[:9], 1e-3, *one).least)
            for one in ((("force_n",),), (("differential_pressure_pa",), PAPER))
        ],
        "structure": {
            " ".join(channels): {
                fault: None if rest is None else list(rest) for fault, rest in structural_isolability(channels).items()
            }
            for channels in (
                (),
                ("position_m",),
                ("velocity_m_s",),
                ("position_m", "differential_pressure_pa"),
                ("position_m", "velocity_m_s", "differential_pressure_pa"),
            )
        },
        "overdetermined": sorted(
            isolability.overdetermined_equations(
                {"flow balance", "force balance", "motor_speed_rad_s", "position_m", "differential_pressure_pa"}
            )
        ),
        "told apart from [nats]": edge(lambda one: wrong_verdicts(one) < isolability.ERROR, 0.1, 50.0),
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
