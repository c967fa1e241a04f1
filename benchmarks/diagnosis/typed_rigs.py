"""Both verbs on rigs of other makers: ten rig files as an engineer types them, logs by the open benchmark's physics.

The files in `typed_rigs/` were written by hand, with sizes as in catalogues of such units: actuators of a flight
control, a drone, an excavator's boom, a press, a robot's knee, a compact unit, a blade's pitch, a steering gear, a
laboratory's bench and a strut. They are right, but some do not state the accumulator's gas volume. Each rig has the
drive typical of its use: a position loop, sines, or steps. Prints one line for each log, and summary figures.
"""

import argparse
import time
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil, pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from benchmarks.diagnosis.random_rigs import print_figures, row_as_text, score_log
from benchmarks.targets import print_and_keep
from experiments.open_benchmark.draws import course_of
from experiments.open_benchmark.drives import CLOSED
from experiments.open_benchmark.logger import POSITION, PRESSURES, SPEED, VELOCITY, Logger, Sensor
from experiments.open_benchmark.machine import PRELOAD, Machine, machine_of
from experiments.open_benchmark.run import RECORD, at_rest, run, substeps_for
from experiments.open_benchmark.setup import Setup
from experiments.python_user.log import Log
from experiments.running.random_streams import stream
from faults.conditions import CONDITIONS, parameters_for
from plant.arrays import Array
from plant.eha.model import EhaParameters, piston_areas
from plant.eha.rig import Rig, read_rig
from plant.errors import LogWarning
from plant.log.record import Record

FILES = Path(__file__).parent / "typed_rigs"


@dataclass(frozen=True)
class RigUse:
    """How a rig is used, and data that its file may omit.

    Parameters
    ----------
    drives : tuple of str
        Names of `experiments.open_benchmark.drives.DRIVES`.
    sample_time : float
        Sample time of its logger [s].
    gas : float
        Gas volume of its accumulator [m^3].
    travel : float
        Fraction of half the stroke that its drives use [fraction].
    """

    drives: tuple[str, ...]
    sample_time: float
    gas: float
    travel: float = 0.7


RIG_USES: Mapping[str, RigUse] = {
    "blade_pitch": RigUse(("posn", "track"), 2e-3, 8e-3),
    "excavator_boom": RigUse(("track", "posn"), 2e-3, 6e-3),
    "flight_control": RigUse(("track", "posn"), 1e-3, 6e-5),
    "laboratory": RigUse(("steps", "prbs", "multisine"), 1e-3, 1e-3),
    "light_aircraft": RigUse(("track", "sines"), 5e-4, 1.2e-5),
    "mini_pack": RigUse(("track", "posn"), 1e-3, 2.5e-4),
    "press": RigUse(("posn", "track"), 1e-3, 1e-2),
    "robot_leg": RigUse(("track", "posn"), 5e-4, 1.5e-5),
    "steering_gear": RigUse(("posn", "sines"), 2e-3, 5e-3),
    "suspension": RigUse(("sines", "multisine"), 1e-3, 5e-5),
}
"""Use of each rig, by name of its file; the gas volume agrees with the file if the file states it."""

SPREAD = 0.05
"""Half-width of leakage, friction and bulk modulus about the file's values [fraction]."""

SINGLE_PILOT = 3.0
"""Pilot ratio of a single rod's make-up valves: opening pressure per pressure in the other chamber, as the open
benchmark's."""

DURATION = 10.0
"""Length of a log [s]."""

LARGEST_STEP = 0.3
"""Largest step of Heun's method, as a fraction of a chamber's shortest time constant [dimensionless]."""


def main(arguments: list[str]) -> int:
    """Print one line for each log, and every figure with its target; return how many fall short."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", default="0:2", metavar="A:B", help="first and last seed of each rig")
    parser.add_argument("--rigs", default=",".join(RIG_USES), metavar="NAME,NAME")
    options = parser.parse_args(arguments)
    first, _, last = options.seeds.partition(":")
    warnings.simplefilter("ignore", LogWarning)
    rows: list[dict[str, Any]] = []
    for name in options.rigs.split(","):
        for seed in range(int(first), int(last or first) + 1):
            rows.append(score_rig_log(name, seed))
            print(f"{name} {row_as_text(rows[-1])}", flush=True)
    checks = print_and_keep(print_figures(rows, wrong=False))
    return sum(not check.met for check in checks)


def score_rig_log(name: str, seed: int) -> dict[str, Any]:
    """Return the results of both verbs for one log of a rig, compared with its truth.

    Parameters
    ----------
    name : str
        Name of the rig's file.
    seed : int
        Seed of the log.

    Returns
    -------
    dict[str, Any]
        As from `benchmarks.diagnosis.random_rigs.score_rig`.
    """
    rig = read_rig(FILES / f"{name}.toml")
    setup, record = draw_log(name, rig, seed)
    log, began = Log(record, rig), time.process_time()
    truth = {"bulk_modulus": setup.machine.bulk_modulus, "condition": setup.condition}
    row = score_log(log, truth, pressure=True)
    about = f"{setup.condition}; {setup.drive}, {1e3 * record.sample_time:g} ms"
    return {"seed": seed, "about": about, **row, "seconds": time.process_time() - began}


def draw_log(name: str, rig: Rig[EhaParameters], seed: int) -> tuple[Setup, Record]:
    """Return the true setup of a log of a rig, and the log.

    Parameters
    ----------
    name : str
        Name of the rig's file.
    rig : Rig
        Content of the file.
    seed : int
        Seed of the log.

    Returns
    -------
    tuple of (Setup, Record)
        The setup, and channels in SI.
    """
    rng = stream(seed, "typed rigs", name)
    condition = "normal" if seed % 3 == 0 else str(rng.choice(list(CONDITIONS)))
    setup = plain_setup(rig.parameters, RIG_USES[name], condition, seed, rng)
    table = table_of(setup, rng)
    return setup, Record(setup.logger.sample_time, {one: table[one].to_numpy() for one in setup.logger.channels})


def plain_setup(healthy: EhaParameters, use: RigUse, condition: str, turn: int, rng: np.random.Generator) -> Setup:
    """Return the true setup of a log without disturbances.

    Parameters
    ----------
    healthy : EhaParameters
        Healthy actuator, as the rig's file states it.
    use : RigUse
        How the rig is used.
    condition : str
        One of the nine.
    turn : int
        Index into its drives, taken in turn.
    rng : numpy.random.Generator
        Source of all that varies between logs.
    """
    drive = use.drives[turn % len(use.drives)]
    machine = _machine(healthy, condition, use, rng)
    travel = 0.5 * use.travel * (healthy.stroke or 0.0)
    if drive in CLOSED:
        glide = healthy.pump_displacement / healthy.piston_area
        machine = machine._replace(loop_gain=10.0 / glide, speed_limit=healthy.rated_speed)
    setup = Setup(condition, machine, drive, travel, DURATION, rated_speed=healthy.rated_speed)
    return setup.with_logger(sensors=_sensors(healthy), sample_time=use.sample_time)


def table_of(setup: Setup, rng: np.random.Generator) -> pd.DataFrame:
    """Return the log of a setup as in its file, shape (samples, 1 + channels).

    Parameters
    ----------
    setup : Setup
        Setup of the log.
    rng : numpy.random.Generator
        Source of the drive and of noise.
    """
    course = course_of(setup, rng)
    states = run(setup.machine, course, _states_at_rest(setup.machine), refine=_refinement(setup.machine))
    states[:, 4:6] = np.maximum(states[:, 4:6], setup.machine.vapour)
    return setup.logger.log(states, rng)


def _machine(healthy: EhaParameters, condition: str, use: RigUse, rng: np.random.Generator) -> Machine:
    """Return the actuator of a rig file in a condition; what no file states is sized to suit its flow."""
    p = parameters_for(CONDITIONS[condition], healthy)
    (area_a, area_b), made = piston_areas(p), machine_of(p)
    flow, uneven = p.rated_flow, p.area_difference != 0.0

    def about(value: float) -> float:
        return value * float(rng.uniform(1.0 - SPREAD, 1.0 + SPREAD))

    opening = flow / sqrt(float(rng.uniform(0.3e5, 1e5)))  # passes the pump's flow at a drop of 0.3 to 1 bar
    return made._replace(
        **{name: about(getattr(made, name)) for name in ("leakage", "quadratic", "linear", "coulomb", "bulk_modulus")},
        flow_bias=about(made.flow_bias),
        area_a=area_a,
        area_b=area_b,
        volume_a=2.0 * p.chamber_volume * (1.0 + p.volume_difference),
        volume_b=2.0 * p.chamber_volume * (1.0 - p.volume_difference),
        stroke=p.stroke,
        spring=p.load_stiffness,
        load=p.load_force,
        drain=float(rng.uniform(0.0, 0.05)) * healthy.leakage_coefficient,
        teeth=float(rng.integers(7, 15)),
        motor_lag=float(rng.uniform(3e-3, 1e-2)),
        acceleration=p.rated_speed / float(rng.uniform(0.02, 0.06)),
        rotor_inertia=8e-4 * p.pump_displacement / EhaParameters().pump_displacement,
        speed_limit=p.motor_speed_limit,
        relief_slope=flow / (0.03 * p.relief_pressure),
        supply_gas=use.gas,
        check_a=opening,
        check_b=opening,
        crack_a=float(rng.uniform(0.0, 5e3)),
        crack_b=float(rng.uniform(0.0, 5e3)),
        pilot=SINGLE_PILOT if uneven else 0.0,
    )


def _sensors(p: EhaParameters) -> Mapping[str, Sensor]:
    """Return sensors with the ranges that a rig needs, given its relief pressure and its speeds."""
    sensors, velocity = dict(Logger().sensors), p.rated_flow / p.piston_area
    return sensors | {
        SPEED: Sensor(noise=4e-4 * p.rated_speed),
        POSITION: Sensor(quantum=1e-6),
        VELOCITY: Sensor(noise=5e-3 * velocity),
        **dict.fromkeys(PRESSURES, Sensor(noise=7e-4 * p.relief_pressure, quantum=2.0**-14 * p.relief_pressure)),
    }


def _states_at_rest(m: Machine) -> Array:
    """Return the states at rest in mid-stroke, with the load held by the loaded chamber."""
    states = at_rest(m)
    states[4] += max(m.load, 0.0) / m.area_a
    states[5] += max(-m.load, 0.0) / m.area_b
    return states


def _refinement(m: Machine) -> int:
    """Return the factor by which steps must be finer than usual: small chambers settle quickly through their valves."""
    filled = max(m.check_a / sqrt(PRELOAD), m.relief_slope) * m.bulk_modulus / (0.5 * min(m.volume_a, m.volume_b))
    ringing = sqrt(4.0 * m.bulk_modulus * max(m.area_a, m.area_b) ** 2 / (min(m.volume_a, m.volume_b) * m.mass))
    usual = RECORD / substeps_for(m, m.speed_limit)
    return max(1, ceil(usual * max(filled, ringing / (2.0 * pi)) / LARGEST_STEP))


if __name__ == "__main__":
    import sys

    sys.exit(main(sys.argv[1:]))
