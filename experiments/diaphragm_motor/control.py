"""Velocity control of the diaphragm motor: by encoder or self-sensing, under a load step, with an undetected leak."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

import numpy as np
import pandas as pd

from estimation.diaphragm_motor.control import controlled_run
from estimation.diaphragm_motor.maps import AVERAGE_STEP, average_run, motor_maps
from experiments.diaphragm_motor.sweeps import PEAK
from plant.diaphragm_motor.model import POSITION
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.diaphragm_motor.run import RAMP_TIME, SAMPLE_TIME, Schedule, run_motor

LEAK = 2e-12
"""Leakage past the piston that self-sensing does not detect [m^3/(s Pa)]."""

LIGHT, HEAVY = 5.0, 15.0
"""Load before and after its step [N]."""

RISE, BURDEN, END = 0.8, 1.6, 2.4
"""Times at which the demanded velocity rises, the load rises, and the run ends [s]."""

SLOW, FAST = 2e-3, 3.5e-3
"""Demanded velocities [m/s]."""


def _reference_velocity(time: float) -> float:
    return SLOW if time < RISE else FAST


def control_runs(p: DiaphragmMotorParameters, seed: int) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return velocity under control by encoder and by self-sensing, healthy and with a leak (section 4, errata M19).

    Returns
    -------
    tuple of pandas.DataFrame
        Time series, with columns run, time_s, wanted_m_s, measured_m_s, velocity_m_s, voltage_v; and one row for each
        run, with columns run, settling_s (start), rise_s, recovery_s, velocity_m_s, measured_m_s at the end.
    """
    maps = motor_maps(p, (PEAK,))
    leaking = replace(p, crossport_leakage=LEAK)
    courses, figures = [], []
    for name, (motor, sensing) in RUNS.items():
        base = leaking if motor else p
        schedule: Schedule = [(0.0, replace(base, load_force=LIGHT)), (BURDEN, replace(base, load_force=HEAVY))]
        run = controlled_run(
            schedule, _reference_velocity, END, PEAK, maps, np.random.default_rng(seed), sensing=sensing
        )
        columns = {"time_s": run.time, "wanted_m_s": run.wanted, "measured_m_s": run.measured}
        columns |= {"velocity_m_s": run.velocity, "voltage_v": run.swing}
        courses.append(pd.DataFrame({"run": name, **columns}))
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


def averaged_course(p: DiaphragmMotorParameters) -> pd.DataFrame:
    """Return the averaged motor beside the fast plant while voltage steps under a load (equations 2 and 18).

    Returns
    -------
    pandas.DataFrame
        Columns time_s, voltage_v, fast_m_s (mean over the surrounding cycle), averaged_m_s; every 1 ms.
    """
    loaded = replace(p, load_force=LIGHT)
    time = SAMPLE_TIME * np.arange(round(0.3 / SAMPLE_TIME) + 1)
    swing = np.where(time < 0.1, 150.0, np.where(time < 0.2, 250.0, 200.0)) * np.minimum(time / RAMP_TIME, 1.0)
    drive = 0.5 * swing * np.sin(2.0 * np.pi * PEAK * time)
    position = run_motor(loaded, drive, SAMPLE_TIME)[:, POSITION]
    sparse = round(AVERAGE_STEP / SAMPLE_TIME)
    _, velocity, _ = average_run(motor_maps(p, (PEAK,)), loaded, PEAK, swing[::sparse])
    shown = np.arange(round(2e-3 / SAMPLE_TIME), len(time) - 104, round(1e-3 / SAMPLE_TIME))
    half = 0.5 / PEAK
    moved = np.interp(time[shown] + half, time, position) - np.interp(time[shown] - half, time, position)
    speeds = {"fast_m_s": moved * PEAK, "averaged_m_s": np.interp(time[shown], time[::sparse], velocity)}
    return pd.DataFrame({"time_s": time[shown], "voltage_v": swing[shown], **speeds})


RUNS: Mapping[str, tuple[bool, Literal["encoder", "self"]]] = {
    "encoder": (False, "encoder"),
    "self-sensing": (False, "self"),
    "encoder, leak": (True, "encoder"),
    "self-sensing, leak": (True, "self"),
}
"""The runs: whether the piston leaks, and the source of the velocity."""
