"""Channels averaged over blocks, and correlations between them, for checks of the channels by physics."""

from dataclasses import dataclass

import numpy as np

from estimation.log_checks.bridging import bridged
from estimation.log_checks.channel_names import POSITION, PRESSURE, SPEED, VELOCITY
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.log.record import Record

FEWEST_SAMPLES, FEWEST_BLOCKS = 5, 20
"""Least samples per block, and least blocks for a conclusion [count]."""

SURE, FOLLOWS, OPPOSED = 0.9, 0.6, -0.3
"""Correlations of one motion measured twice, of a piston with its pump, and with one of opposite sign: compliance and
friction never oppose their drive, neither in the long run nor from block to block."""


@dataclass(frozen=True, eq=False)
class ChannelBlocks:
    """A log's channels over blocks; None for a channel that is not logged.

    Parameters
    ----------
    length : float
        Length of a block [s].
    pumped : ndarray, shape (n,), or None
        Flow displaced by the pump [m^3/s].
    slope : ndarray, shape (n,), or None
        Slope of position [m/s].
    position : ndarray, shape (n,), or None
        Mean position [m].
    velocity : ndarray, shape (n,), or None
        Mean velocity [m/s].
    velocity_slope : ndarray, shape (n,), or None
        Slope of velocity [m/s^2].
    pressure : ndarray, shape (n,), or None
        Mean differential pressure [Pa].
    """

    length: float
    pumped: Array | None
    slope: Array | None
    position: Array | None
    velocity: Array | None
    velocity_slope: Array | None
    pressure: Array | None

    @property
    def piston(self) -> Array | None:
        """Velocity of the piston [m/s], from position if that is logged."""
        return self.velocity if self.slope is None else self.slope


def channel_blocks(record: Record, p: EhaParameters, length: float) -> ChannelBlocks:
    """Return a log in blocks of a given length, or of a few samples if that is longer.

    Parameters
    ----------
    p : EhaParameters
        The actuator, for its pump.
    length : float
        Length of a block [s].
    """
    size = max(FEWEST_SAMPLES, round(length / record.sample_time))
    span = size * record.sample_time

    def mean(name: str) -> Array | None:
        values = bridged_channel(record, name)
        count = (len(record) - 1) // size
        return None if values is None else values[: count * size].reshape(count, size).mean(axis=1)

    def slope(name: str) -> Array | None:
        values = bridged_channel(record, name)
        return None if values is None else np.diff(values[::size][: (len(record) - 1) // size + 1]) / span

    speed = mean(SPEED)
    return ChannelBlocks(
        span,
        None if speed is None else p.pump_displacement * speed,
        slope(POSITION),
        mean(POSITION),
        mean(VELOCITY),
        slope(VELOCITY),
        mean(PRESSURE),
    )


def bridged_channel(record: Record, name: str) -> Array | None:
    """Return a channel with its gaps bridged, None if it is not logged [its unit]."""
    if name not in record or not np.any(np.isfinite(record[name])):
        return None
    return bridged(record[name])


def correlation_and_ratio(y: Array | None, x: Array | None) -> tuple[float, float]:
    """Return the correlation of two signals, and their signed ratio of sizes.

    Parameters
    ----------
    y, x : ndarray, shape (n,), or None
        The signals [any unit].

    Returns
    -------
    tuple of float
        Correlation [dimensionless] and size of y over that of x [their units]; zeros if one is absent or constant.
    """
    if y is None or x is None or len(y) < FEWEST_BLOCKS:
        return 0.0, 0.0
    about_y, about_x = y - y.mean(), x - x.mean()
    size_y, size_x = float(np.linalg.norm(about_y)), float(np.linalg.norm(about_x))
    if size_y == 0.0 or size_x == 0.0:
        return 0.0, 0.0
    correlation = float(about_y @ about_x) / (size_y * size_x)
    return correlation, float(np.sign(correlation)) * size_y / size_x


def pressure_flow_correlation(pressure: Array | None, flow: Array | None, piston: Array | None) -> float:
    """Return the correlation of pressure with pumped flow, without the effect of a constant load and a spring.

    Sliding and leakage take power, whatever the load; a load returns what it took.

    Parameters
    ----------
    pressure, flow, piston : ndarray, shape (n,), or None
        Differential pressure [Pa], pumped flow [m^3/s] and velocity [m/s].

    Returns
    -------
    float
        Correlation [dimensionless]; 0 if one is absent.
    """
    if pressure is None or piston is None:
        return 0.0
    travelled = np.cumsum(piston)
    far, level = travelled - travelled.mean(), pressure - pressure.mean()
    size = float(far @ far)
    return correlation_and_ratio(flow, level - far * float(far @ level) / size if size > 0.0 else level)[0]


def path_agreement(piston: Array | None, pumped: Array | None) -> tuple[float, float]:
    """Return the agreement of the piston's path with the pumped volume, both detrended; slow motion counts most.

    Parameters
    ----------
    piston, pumped : ndarray, shape (n,), or None
        Velocity [m/s] and flow [m^3/s].

    Returns
    -------
    tuple of float
        Correlation [dimensionless] and ratio of sizes [1/m^2].
    """
    if piston is None or pumped is None or len(piston) < FEWEST_BLOCKS:
        return 0.0, 0.0
    ramp = np.linspace(-1.0, 1.0, len(piston))
    drift = np.linalg.qr(np.column_stack([np.ones_like(ramp), ramp, ramp**2]))[0]
    sums = (np.cumsum(one) for one in (piston, pumped))
    return correlation_and_ratio(*(one - drift @ (drift.T @ one) for one in sums))
