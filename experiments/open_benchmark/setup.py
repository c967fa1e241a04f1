"""One log before it is run: actuator, drive, logger, and what changes over time."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from experiments.open_benchmark.logger import Logger
from experiments.open_benchmark.machine import Machine
from plant.eha.model import EhaParameters


@dataclass(frozen=True)
class Change:
    """Changes over a log, each from zero.

    Parameters
    ----------
    viscosity, wear : float
        Over those at the start, at the end; both run evenly in their logarithm [dimensionless].
    air, late_air : float
        Entrained air at atmospheric pressure throughout, and from `late_from` on, a unit of oil [dimensionless].
    late_wear : float
        Leakage over that before, from `late_from` on, at once [dimensionless].
    late_from : float
        Part of the log after which late air is in, or late wear [fraction].
    bursts : int
        How often friction grips.
    grip : float
        How strongly, over the Coulomb friction [dimensionless].
    """

    viscosity: float = 1.0
    wear: float = 1.0
    air: float = 0.0
    late_air: float = 0.0
    late_wear: float = 1.0
    late_from: float = 0.5
    bursts: int = 0
    grip: float = 1.0

    @property
    def steady(self) -> bool:
        """Whether the actuator is the same from the first sample to the last."""
        return self == Change(air=self.air, late_from=self.late_from, grip=self.grip)


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

    def begins(self, share: float) -> float:
        """Return the time in the log at which something comes in.

        Parameters
        ----------
        share : float
            When it comes, of the run [fraction].

        Returns
        -------
        float
            Time since the first sample [s].
        """
        return share * (self.duration + self.logger.begin) - self.logger.begin
