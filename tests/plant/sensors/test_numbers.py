"""The readings of healthy and faulty sensors in a run, kept in `numbers.json`."""

from dataclasses import asdict, replace
from typing import Any, get_args

import numpy as np
import pytest

from plant.log.record import Record
from plant.sensors.faults import Kind, SensorFault, with_fault
from plant.sensors.sensors import SENSORS, Sensors, differentiated, drop_samples, measure, noise_variances
from tests.numbers import Numbers, or_refused

NUMBERS = Numbers(__file__)
T = 1e-3
N = 40
TRUTH = Record(
    T,
    {
        "motor_speed_rad_s": 50.0 * np.sin(0.2 * np.arange(N)),
        "position_m": 0.01 * np.cos(0.1 * np.arange(N)),
        "velocity_m_s": -1.0 * np.sin(0.1 * np.arange(N)),
        "differential_pressure_pa": 3e5 * np.sin(0.3 * np.arange(N)),
    },
)


@NUMBERS.case()
def what_sensors_log() -> dict[str, Any]:
    told: dict[str, Any] = {}
    sets = {**SENSORS, "noisy position": replace(SENSORS["rig"], position_noise=1e-5, velocity_window=8e-3)}
    for name, sensors in sets.items():
        logged = measure(TRUTH, sensors, np.random.default_rng(4), keep_truth=name == "bench")
        told[name] = {
            "sensors": asdict(sensors),
            **{channel: logged[channel][[0, 1, 20, 39]] for channel in logged},
            "variances": dict(noise_variances(sensors)),
        }
    return told


@NUMBERS.case()
def velocities_and_gaps() -> dict[str, Any]:
    position = TRUTH["position_m"]
    gone = drop_samples(TRUTH.annotate(), 0.2, np.random.default_rng(2))
    return {
        "velocity [m/s]": {
            str(window): differentiated(position, T, window)[[0, 1, 5, 20, 38, 39]]
            for window in (2e-3, 3e-3, 5e-3, 8e-3)
        },
        "windows": [
            or_refused(lambda one=one: differentiated(position, T, one)[1])
            for one in (1.99e-3, 2e-3 * (1 - 1e-12), 2e-3 * (1 - 3e-9))
        ],
        "samples": [or_refused(lambda one=one: differentiated(position[:one], T, 2e-3)[0]) for one in (1, 2)],
        "missing": np.flatnonzero(np.isnan(gone["position_m"])),
        "missing of one": [
            int(np.isnan(one["position_m"]).sum())
            for one in (drop_samples(TRUTH, share, np.random.default_rng(2), ("velocity_m_s",)) for share in (0.0, 1.0))
        ],
        "all": int(np.isnan(drop_samples(TRUTH, 1.0, np.random.default_rng(2))["position_m"]).sum()),
        "shares": [
            isinstance(or_refused(lambda one=one: drop_samples(TRUTH, one, np.random.default_rng(2))), str)
            for one in (-0.01, 0.0, 1.0, 1.01)
        ],
        "refused": [
            isinstance(or_refused(lambda one=one: Sensors(**one)), str)
            for one in (
                {"speed_noise": -1e-9},
                {"speed_noise": 0.0},
                {"speed_noise": np.inf},
                {"velocity_window": 0.0},
                {"velocity_window": 1e-9},
            )
        ],
    }


@NUMBERS.case()
def faulty_sensors() -> dict[str, Any]:
    def fault(kind: Any, size: float, start: float = 0.015, growth: float = 0.0, *, random: bool = True) -> Any:
        made = SensorFault(channel="position_m", kind=kind, size=size, start=start, growth=growth)
        found = with_fault(TRUTH, made, np.random.default_rng(3) if random else None)
        return found["position_m"][[0, 14, 15, 16, 20, 30, 39]]

    return {
        **{
            kind: or_refused(lambda kind=kind: fault(kind, 0.3 if kind == "dropout" else 5e-3))
            for kind in get_args(Kind)
        },
        **{
            f"{kind} that grows": or_refused(lambda kind=kind: fault(kind, 5e-3, 0.015, 0.01))
            for kind in get_args(Kind)
        },
        "frozen from the first": fault("freeze", 0.0, 0.0),
        "sizes": [
            isinstance(or_refused(lambda one=one: fault(*one)), str)
            for one in (
                ("saturation", 0.0),
                ("saturation", 1e-9),
                ("dropout", -0.1),
                ("dropout", 0.0),
                ("dropout", 1.0),
                ("dropout", 1.1),
                ("bias", np.inf),
                ("bias", -1.0),
            )
        ],
        "times": [
            isinstance(or_refused(lambda one=one: fault("bias", 1.0, *one)), str)
            for one in ((-1e-9,), (0.0,), (0.0, -1e-9), (0.0, 0.0), (np.nan,))
        ],
        "without chance": or_refused(lambda: fault("dropout", 0.5, random=False)),
        "unless told": [
            float(one) for one in with_fault(TRUTH, SensorFault(channel="position_m", kind="bias"))["position_m"][:2]
        ],
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
