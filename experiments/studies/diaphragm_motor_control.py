"""Velocity control of the diaphragm motor: by encoder, by self-sensing, under a load's step, and with a leak unseen."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pandas as pd

from estimation.diaphragm_motor_control import ControlledRun, controlled_run
from estimation.diaphragm_motor_maps import MotorMaps, motor_maps
from experiments.studies.diaphragm_motor import PEAK
from plant.diaphragm_motor_parameters import DiaphragmMotorParameters
from plant.diaphragm_motor_run import Schedule

LEAK = 2e-12
"""Leakage past the piston that self-sensing is shown not to see [m^3/(s Pa)]."""

LIGHT, HEAVY = 5.0, 15.0
"""Load before and after its step [N]."""

RISE, BURDEN, END = 0.8, 1.6, 2.4
"""When the wanted velocity rises, when the load does, when the run ends [s]."""

SLOW, FAST = 2e-3, 3.5e-3
"""Velocities that are wanted [m/s]."""


def _wanted(time: float) -> float:
    return SLOW if time < RISE else FAST


def control_runs(p: DiaphragmMotorParameters, seed: int) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return velocity under control by encoder and by self-sensing, healthy and with a leak (section 4, errata M19).

    Parameters
    ----------
    p : DiaphragmMotorParameters
        The motor.
    seed : int
        Seed of the sensor noise.

    Returns
    -------
    tuple of pandas.DataFrame
        Courses, with columns run, time_s, wanted_m_s, measured_m_s, velocity_m_s, voltage_v; and a row a run, with
        columns run, settling_s (start), rise_s, recovery_s, velocity_m_s, measured_m_s at the end.
    """
    maps = motor_maps(p, (PEAK,))
    leaking = replace(p, crossport_leakage=LEAK)
    courses, figures = [], []
    for name, (motor, sensing) in RUNS.items():
        base = leaking if motor else p
        schedule: Schedule = [(0.0, replace(base, load_force=LIGHT)), (BURDEN, replace(base, load_force=HEAVY))]
        run = _run(schedule, maps, sensing, seed)
        courses.append(
            pd.DataFrame(
                {
                    "run": name,
                    "time_s": run.time,
                    "wanted_m_s": run.wanted,
                    "measured_m_s": run.measured,
                    "velocity_m_s": run.velocity,
                    "voltage_v": run.swing,
                }
            )
        )
        late = run.time > END - 0.2
        figures.append(
            {
                "run": name,
                "settling_s": run.settling(0.0, RISE),
                "rise_s": run.settling(RISE, BURDEN),
                "recovery_s": run.settling(BURDEN, END),
                "velocity_m_s": float(run.velocity[late].mean()),
                "measured_m_s": float(run.measured[late].mean()),
            }
        )
    return pd.concat(courses, ignore_index=True), pd.DataFrame(figures)


def _run(schedule: Schedule, maps: MotorMaps, sensing: str, seed: int) -> ControlledRun:
    source = "self" if sensing == "self" else "encoder"
    return controlled_run(schedule, _wanted, END, PEAK, maps, np.random.default_rng(seed), sensing=source)


RUNS: Mapping[str, tuple[bool, str]] = MappingProxyType(
    {
        "encoder": (False, "encoder"),
        "self-sensing": (False, "self"),
        "encoder, leak": (True, "encoder"),
        "self-sensing, leak": (True, "self"),
    }
)
"""The runs: whether the piston leaks, and where velocity comes from."""
