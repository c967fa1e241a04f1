"""One log before it is run: actuator, drive, logger, and what changes over time; a plain one is drawn here."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.open_benchmark.drives import CLOSED, DRIVES, Room
from experiments.open_benchmark.logger import Logger
from experiments.open_benchmark.machine import Machine, machine_of
from experiments.open_benchmark.run import TICK
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.model import EhaParameters

Array = NDArray[np.float64]

SPREAD = 0.05
"""Half width of leakage, flow bias and friction about their condition's [fraction]."""

OIL_SPREAD = 0.3
"""Half width of bulk modulus about the paper's [fraction]."""

MARGIN = 0.06
"""From where a drive may take the piston to the end stop [m]."""


@dataclass(frozen=True)
class Change:
    """What changes over a log, each from nothing.

    Parameters
    ----------
    viscosity, wear : float
        Over those at the start, at the end; both run evenly in their logarithm [dimensionless].
    air, late_air : float
        Entrained air at atmospheric pressure throughout, and from `late_from` on, a unit of oil [dimensionless].
    late_from : float
        Part of the log after which late air is in [fraction].
    bursts : int
        How often friction grips.
    grip : float
        How strongly, over the Coulomb friction [dimensionless].
    """

    viscosity: float = 1.0
    wear: float = 1.0
    air: float = 0.0
    late_air: float = 0.0
    late_from: float = 0.5
    bursts: int = 0
    grip: float = 1.0


@dataclass(frozen=True)
class Setup:
    """All that a log is made of.

    Parameters
    ----------
    condition : str
        One of the nine.
    machine : Machine
        The true actuator.
    drive : str
        One of `DRIVES`.
    travel : float
        How far the drive takes the piston to either side, at most [m].
    duration : float
        [s].
    logger : Logger
        What writes it down.
    change : Change
        What changes meanwhile.
    rig : Mapping[str, float]
        What the rig file says, SI units; empty where none is handed over and the paper's is assumed.
    forward_first : bool
        Whether the first move is forward.
    rated_speed : float
        Of the drives [rad/s].
    """

    condition: str
    machine: Machine
    drive: str
    travel: float
    duration: float
    logger: Logger = field(default_factory=Logger)
    change: Change = field(default_factory=Change)
    rig: Mapping[str, float] = field(default_factory=dict[str, float])
    forward_first: bool = False
    rated_speed: float = EhaParameters().rated_speed

    def with_machine(self, **changes: float) -> "Setup":
        """Return a setup whose machine differs.

        Parameters
        ----------
        **changes : float
            Values by field, SI.
        """
        return replace(self, machine=self.machine._replace(**changes))

    def with_sensor(self, channels: tuple[str, ...], **changes: float) -> "Setup":
        """Return a setup whose channels have other sensors.

        Parameters
        ----------
        channels : tuple of str
            Which.
        **changes : float
            Fields of `Sensor` [unit of the channel].
        """
        sensors = dict(self.logger.sensors)
        sensors |= {name: replace(sensors[name], **changes) for name in channels}
        return self.with_logger(sensors=sensors)

    def with_logger(self, **changes: Any) -> "Setup":
        """Return a setup whose logger has other fields."""
        return replace(self, logger=replace(self.logger, **changes))

    def with_change(self, **changes: Any) -> "Setup":
        """Return a setup over which something else changes."""
        return replace(self, change=replace(self.change, **changes))


def draw_machine(condition: str, rng: np.random.Generator, base: EhaParameters | None = None) -> Machine:
    """Return an actuator in a condition: Tables 3 and 4 and bulk modulus with their spread, and details of its own.

    Parameters
    ----------
    condition : str
        One of the nine.
    rng : numpy.random.Generator
        Source of the spread.
    base : EhaParameters, optional
        The healthy actuator; the paper's if not given.
    """
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
    """Return a setup with nothing strange, with travel of 20 to 200 mm to either side.

    Parameters
    ----------
    condition : str
        One of the nine.
    drive : str
        One of `DRIVES`.
    rng : numpy.random.Generator
        Source of all that differs from log to log.
    base : EhaParameters, optional
        The healthy actuator; the paper's if not given.
    """
    machine = draw_machine(condition, rng, base)
    travel = float(np.exp(rng.uniform(np.log(0.02), np.log(0.2))))
    closed = {"loop_gain": rng.uniform(4e4, 9e4), "speed_limit": EhaParameters().rated_speed}
    machine = machine._replace(stroke=2.0 * (travel + MARGIN), **(closed if drive in CLOSED else {}))
    return Setup(condition, machine, drive, travel, 20.0 if travel > 0.08 else 10.0)


def course_of(setup: Setup, rng: np.random.Generator) -> Array:
    """Return what is asked and what changes, shape (n, 5), the columns and units of `COURSE`.

    Parameters
    ----------
    setup : Setup
        The log.
    rng : numpy.random.Generator
        Source of the drive and of when friction grips.

    Returns
    -------
    ndarray, shape (n, 5)
        A row every `TICK`.
    """
    m, change = setup.machine, setup.change
    glide = 0.75 * m.efficiency * m.displacement / max(m.area_a, m.area_b)
    room = Room(setup.duration + setup.logger.begin, setup.rated_speed, setup.travel, glide)
    along = np.linspace(0.0, 1.0, room.ticks)
    rough = np.ones(room.ticks)
    for begin in rng.uniform(0.05, 0.9, change.bursts):
        rough[(along >= begin) & (along < begin + rng.uniform(0.02, 0.06))] = change.grip
    entering = np.clip((along - change.late_from) * room.ticks * TICK / 0.5, 0.0, 1.0)
    demand = DRIVES[setup.drive](room, rng)
    if setup.forward_first:
        demand *= np.sign(demand[np.flatnonzero(demand)[0]])
    columns = demand, change.viscosity**along, change.wear**along, change.air + change.late_air * entering, rough
    return np.stack(columns, axis=1)
