"""Random draws of a plain log, and of how the actuator changes over a log."""

import numpy as np

from experiments.open_benchmark.drives import CLOSED, DRIVES, DriveLimits
from experiments.open_benchmark.machine import Machine, machine_of
from experiments.open_benchmark.run import TICK
from experiments.open_benchmark.setup import Setup
from faults.conditions import CONDITIONS, parameters_for
from plant.arrays import Array
from plant.eha.model import EhaParameters

SPREAD = 0.05
"""Half width of the spread of leakage, flow bias and friction about the values of their condition [fraction]."""

OIL_SPREAD = 0.3
"""Half width of the spread of bulk modulus about the paper's value [fraction]."""

MARGIN = 0.06
"""Distance between a drive's maximum travel and the end stop [m]."""


def _draw_machine(condition: str, rng: np.random.Generator, base: EhaParameters | None = None) -> Machine:
    """Return an actuator in a condition: Tables 3 and 4 and bulk modulus with their spread, and random details."""
    nominal = machine_of(parameters_for(CONDITIONS[condition], base or EhaParameters()))

    def about(value: float, width: float = SPREAD) -> float:
        return value * rng.uniform(1.0 - width, 1.0 + width)

    size = nominal.displacement / Machine().displacement
    return nominal._replace(
        leakage=about(nominal.leakage),
        flow_bias=about(nominal.flow_bias),
        quadratic=about(nominal.quadratic),
        linear=about(nominal.linear),
        coulomb=about(nominal.coulomb),
        bulk_modulus=about(nominal.bulk_modulus, OIL_SPREAD),
        drain=rng.uniform(0.0, 0.05) * size * Machine().leakage,
        teeth=float(rng.integers(9, 15)),
        ripple=rng.uniform(0.0, 0.03),
        motor_lag=rng.uniform(2e-3, 6e-3),
        acceleration=rng.uniform(2e4, 5e4),
        crack_a=rng.uniform(0.0, 2e3),
        crack_b=rng.uniform(0.0, 2e3),
        check_a=size * about(Machine().check_a),
        check_b=size * about(Machine().check_b),
        supply_gas=size * rng.uniform(1e-3, 4e-3),
        presliding=rng.uniform(1.5e-5, 4.5e-5),
    )


def draw_plain(condition: str, drive: str, rng: np.random.Generator, base: EhaParameters | None = None) -> Setup:
    """Return a setup with no peculiarity, with travel of 20 to 200 mm to either side.

    Parameters
    ----------
    condition : str
        One of the nine.
    drive : str
        One of `DRIVES`.
    rng : numpy.random.Generator
        Source of everything that differs between logs.
    base : EhaParameters, optional
        The healthy actuator; the paper's if not given.
    """
    machine = _draw_machine(condition, rng, base)
    travel = float(np.exp(rng.uniform(np.log(0.02), np.log(0.2))))
    closed = {"loop_gain": rng.uniform(4e4, 9e4), "speed_limit": EhaParameters().rated_speed}
    machine = machine._replace(stroke=2.0 * (travel + MARGIN), **(closed if drive in CLOSED else {}))
    return Setup(condition, machine, drive, travel, 20.0 if travel > 0.08 else 10.0)


def course_of(setup: Setup, rng: np.random.Generator) -> Array:
    """Return an actuator's drive and how its parameters change over a log.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of the drive and of the times at which friction grips.

    Returns
    -------
    ndarray, shape (n, 5)
        One row for each `TICK`: demanded speed [rad/s] or position [m]; viscosity and leakage relative to their values
        at the start, and entrained air per unit of oil [dimensionless]; friction's grip relative to its value at the
        start [dimensionless].
    """
    m, change = setup.machine, setup.change
    glide = 0.75 * m.efficiency * m.displacement / max(m.area_a, m.area_b)
    room = DriveLimits(setup.duration + setup.logger.begin, setup.rated_speed, setup.travel, glide)
    along = np.linspace(0.0, 1.0, room.ticks)
    rough = np.ones(room.ticks)
    for begin in rng.uniform(0.05, 0.9, change.bursts):
        rough[(along >= begin) & (along < begin + rng.uniform(0.02, 0.06))] = change.grip
    entering = np.clip((along - change.late_from) * room.ticks * TICK / 0.5, 0.0, 1.0)
    demand = DRIVES[setup.drive](room, rng)
    if setup.forward_first:
        demand *= np.sign(demand[np.flatnonzero(demand)[0]])
    wear = change.wear**along * np.where(along >= change.late_from, change.late_wear, 1.0)
    columns = demand, change.viscosity**along, wear, change.air + change.late_air * entering, rough
    return np.stack(columns, axis=1)
