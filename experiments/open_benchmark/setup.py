"""Setup of one log: actuator, drive, logger, and what changes over time."""

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
        Values at the end relative to those at the start; both change exponentially in time [dimensionless].
    air, late_air : float
        Entrained air at atmospheric pressure, throughout and from `late_from` on, per unit of oil [dimensionless].
    late_wear : float
        Factor by which leakage jumps at `late_from` [dimensionless].
    late_from : float
        Time at which late air or late wear begins, as a share of the log [fraction].
    bursts : int
        Number of times that friction grips.
    grip : float
        Strength of the grip relative to Coulomb friction [dimensionless].
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
    """Everything that defines a log.

    Parameters
    ----------
    condition : str
        One of the nine.
    machine : Machine
        The true actuator.
    drive : str
        One of `DRIVES`.
    travel : float
        Maximum travel of the drive to either side [m].
    duration : float
        Duration [s].
    logger : Logger
        Logger of the log.
    change : Change
        Changes during the log.
    rig : Mapping[str, float]
        Entries of the rig file, SI units; empty if there is none and the paper's is assumed.
    forward_first : bool
        Whether the first move is forward.
    rated_speed : float
        Rated speed of the drives [rad/s].
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
        """Return a setup with a changed machine.

        Parameters
        ----------
        **changes : float
            New values by field, SI.
        """
        return replace(self, machine=self.machine._replace(**changes))

    def with_sensor(self, channels: tuple[str, ...], **changes: float) -> "Setup":
        """Return a setup with changed sensors.

        Parameters
        ----------
        channels : tuple of str
            Channels to change.
        **changes : float
            New values by field of `Sensor` [unit of the channel].
        """
        sensors = dict(self.logger.sensors)
        sensors |= {name: replace(sensors[name], **changes) for name in channels}
        return self.with_logger(sensors=sensors)

    def with_logger(self, **changes: Any) -> "Setup":
        """Return a setup with a changed logger."""
        return replace(self, logger=replace(self.logger, **changes))

    def with_change(self, **changes: Any) -> "Setup":
        """Return a setup with other changes over time."""
        return replace(self, change=replace(self.change, **changes))

    def begins(self, share: float) -> float:
        """Return the time in the log at which a change begins.

        Parameters
        ----------
        share : float
            When it begins, as a share of the run [fraction].

        Returns
        -------
        float
            Time since the first sample [s].
        """
        return share * (self.duration + self.logger.begin) - self.logger.begin
