"""Balance of the pumped flow: motion, leakage, flow bias and compression, by least squares over blocks of a log."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from estimation.log_checks.channel_blocks import FEWEST_BLOCKS, bridged_channel, correlation_and_ratio
from estimation.log_checks.channel_names import POSITION, PRESSURE, SPEED, VELOCITY
from estimation.log_checks.measurement_noise import excited_noise_variance, position_variance
from plant.arrays import Array
from plant.eha.model import EhaParameters, piston_areas
from plant.log.record import Record

FEWEST_SAMPLES = 8
"""Least samples in a block, since those at its ends count little [count]."""

MOST_LOST = 0.25
"""Largest flow bias, over the flow at rated speed [fraction]; judged: the leakiest actuator of the paper loses a
fifth."""

BIASES = 401
"""Flow biases over which a balance is averaged [count]: one more or less changes the piston's factor by less than 0.1
%."""

HELD_BEYOND = 3.0
"""Deviations of its noise from which one sample of pressure shows the loaded side of a single rod [dimensionless]."""

LEAST_SHARE = 1e-12
"""Share of the flow that counts as left in any case, as in a log without noise [fraction]."""

REFUTED = 2.0
"""Difference of the piston's flow from the rig's, over what a balance leaves unexplained, from which a slip of units is
seen in it [dimensionless]."""


class FlowBalance(NamedTuple):
    """Balance of the pumped flow by least squares: motion, leakage, flow bias and compression.

    Parameters
    ----------
    swept : float
        Pumped flow for the motion over the piston's own flow; 1 for a sound log [dimensionless].
    swept_std : float
        Its standard deviation [dimensionless].
    compressed : float
        Factor on the rig's compressibility [dimensionless].
    compressed_std : float
        Its standard deviation [dimensionless].
    explained : float
        Share of the pumped flow's variance that is explained [fraction].
    moving : float
        The piston's own flow over the pumped flow, both about their means, root mean square [fraction].
    """

    swept: float
    swept_std: float
    compressed: float
    compressed_std: float
    explained: float
    moving: float

    @property
    def rig_contradiction(self) -> float:
        """Error of the piston's flow by the balance, over what the balance leaves unexplained [dimensionless].

        If the piston hardly moves and nearly all flow leaks, the motion absorbs whatever the balance omits.
        """
        return abs(self.swept - 1.0) * self.moving / max(1.0 - self.explained, 1e-12) ** 0.5


def flow_balance(record: Record, p: EhaParameters, length: float) -> FlowBalance | None:
    """Return the balance of the pumped flow; None if pump, piston or pressure is not logged, or the pump is at rest.

    Parameters
    ----------
    length : float
        Length of the blocks over which flows are balanced [s].
    """
    found = {name: bridged_channel(record, name) for name in (SPEED, PRESSURE, POSITION, VELOCITY)}
    moved = POSITION if found[POSITION] is not None else VELOCITY
    speed, pressure, piston = found[SPEED], found[PRESSURE], found[moved]
    size = max(FEWEST_SAMPLES, round(length / record.sample_time))
    if speed is None or pressure is None or piston is None or (len(record) - 1) // size < FEWEST_BLOCKS:
        return None
    window = _Window(size, record.sample_time)
    noise_p = _noise(pressure)
    noise_x = position_variance(piston) if moved == POSITION else _noise(piston)
    compliance = p.chamber_volume / p.bulk_modulus
    spread = window.of_slope if moved == POSITION else window.of_mean
    flow = p.pump_displacement * window.mean(speed)
    areas = _pumped_areas(pressure, HELD_BEYOND * np.sqrt(noise_p), size, p)
    parts = [
        window.slope(piston, areas) if moved == POSITION else window.mean(areas * piston),
        compliance * window.slope(pressure),
        window.mean(pressure),
    ]
    parts += [np.ones_like(flow)]
    noises = [p.piston_area**2 * spread * noise_x, compliance**2 * window.of_slope * noise_p]
    noises += [window.of_mean * noise_p, 0.0]
    sign = window.mean(np.sign(speed))  # a block in which the pump reverses has both signs
    return _averaged_over_biases(flow, sign, parts, np.array(noises), MOST_LOST * p.rated_flow)


def _pumped_areas(pressure: Array, least: float, size: int, p: EhaParameters) -> Array:
    """Return the area that the pump's flow moves, shape (n,) [m^2].

    The difference of a single rod's low side passes its make-up valve, which the high side holds open. With plain
    valves that shut, both sides may be high, and the mean area is used. Below ``least`` a pressure may be noise [Pa];
    the mean over ``size`` samples shows the side.
    """
    if not (p.single_rod and p.pilot_share > 0.0):
        return np.full(len(pressure), p.piston_area)
    side_a, side_b = piston_areas(p)
    lasting = np.convolve(pressure, np.full(size, 1.0 / size), mode="same")
    return np.where(np.where(np.abs(pressure) > least, pressure, lasting) > 0.0, side_a, side_b)


def _noise(values: Array) -> float:
    """Return the variance of a channel's noise [its unit squared], zero where the log does not show it."""
    found = excited_noise_variance(values)
    return found if np.isfinite(found) else 0.0


class _Window:
    """Means and slopes of a signal over blocks, weighted by a parabola that is zero at both ends of a block.

    The slope of a signal, weighted in this way, is the signal itself weighted by the parabola's slope: all samples of a
    block contribute (Shinbrot, On the analysis of linear and nonlinear systems, 1957). The variances of a mean and of a
    slope are those of a sample's noise times `of_mean` [dimensionless] and `of_slope` [1/s^2].
    """

    def __init__(self, size: int, sample_time: float) -> None:
        middles = (np.arange(size) + 0.5) / size
        weights = middles * (1.0 - middles)
        self._weights = weights / weights.sum()
        self._sample_time = sample_time
        self.of_mean = float(np.sum(self._weights**2))
        self.of_slope = float(np.sum(np.diff(self._weights, prepend=0.0, append=0.0) ** 2)) / sample_time**2

    def mean(self, signal: Array) -> Array:
        """Return the mean over each block [unit of the signal]."""
        return self._over_blocks(0.5 * (signal[1:] + signal[:-1]))

    def slope(self, signal: Array, times: Array | None = None) -> Array:
        """Return the slope over each block, times a factor of each sample [unit of the signal over s]."""
        factors = 1.0 if times is None else 0.5 * (times[1:] + times[:-1])
        return self._over_blocks(factors * np.diff(signal) / self._sample_time)

    def _over_blocks(self, between: Array) -> Array:
        size = len(self._weights)
        count = len(between) // size
        return between[: count * size].reshape(count, size) @ self._weights


def _averaged_over_biases(
    flow: Array, sign: Array, parts: Sequence[Array], noises: Array, most: float
) -> FlowBalance | None:
    """Return the balance of a flow by its parts, averaged over the flow biases that it leaves open.

    The flow of a pump at constant speed is proportional to the sign of speed. Least squares then let a bias absorb all
    flow, since the less there is to explain, the less is left. So each bias counts by the share of the remaining flow
    that is left. A bias is neither below zero nor above `most` [m^3/s]; if speed has another unit, all flows are larger
    by the same factor as the piston's.

    Noise in a part biases its factor towards zero, and shifts those of correlated parts: by the inverse of the normal
    equations times the variance of noise, times the factor, once, squared and so on. Two orders are corrected, and
    deviations include the second, so that nothing is known if the series does not converge.
    """
    if np.ptp(flow) == 0.0:
        return None
    columns, wanted = np.column_stack(parts), np.column_stack([flow, sign])
    sizes = np.linalg.norm(columns, axis=0)
    absent = sizes == 0.0
    sizes[absent] = 1.0
    scaled = columns / sizes
    inverse = np.linalg.pinv(scaled.T @ scaled)
    found = inverse @ (scaled.T @ wanted)
    drawing = inverse * (len(flow) * noises / sizes**2)
    second = drawing @ (drawing @ found)
    factors, rest = found + drawing @ found + second, wanted - scaled @ found

    swept_at_none = float(factors[0, 0] / sizes[0])
    biases = most * max(1.0, swept_at_none) * np.linspace(0.0, 1.0, BIASES)
    without = np.stack([np.ones(BIASES), -biases])
    left, whole = (np.einsum("ib,ij,jb->b", without, np.cov(one.T, bias=True), without) for one in (rest, wanted))
    share = np.maximum(left / np.where(whole > 0.0, whole, np.inf), LEAST_SHARE)
    repeats = _blocks_per_independent_block(rest @ without[:, int(np.argmin(share))])
    weights = (np.min(share) / share) ** (0.5 * len(flow) / repeats)
    weights /= np.sum(weights)

    variance = repeats * np.maximum(np.diag(inverse)[:2, None], 0.0) * left + (second[:2] @ without) ** 2
    told = factors[:2] @ without
    mean = told @ weights
    std = np.sqrt((variance + (told - mean[:, None]) ** 2) @ weights)
    std[absent[:2]] = np.inf  # a part that stands still determines nothing
    (swept, compressed), (swept_std, compressed_std) = ((one / sizes[:2]).tolist() for one in (mean, std))
    explained = 1.0 - float(left @ weights) / float(np.var(flow))
    moving = float(np.std(parts[0])) / float(np.std(flow))
    return FlowBalance(swept, swept_std, compressed, compressed_std, explained, moving)


def _blocks_per_independent_block(rest: Array) -> float:
    """Return how many blocks are worth one independent block [dimensionless, 1 or more].

    Neighbours of a slow remainder repeat each other, and so do the periods of a sine, with the same model error in
    each. The number of independent blocks is then that of the lines of their spectrum (Welch's equivalent degrees of
    freedom, 1947).
    """
    lasting = float(np.clip(correlation_and_ratio(rest[1:], rest[:-1])[0], 0.0, 0.99))
    power = np.abs(np.fft.rfft(rest - rest.mean())[1:]) ** 2
    total = float(power.sum())
    lines = 2.0 * total**2 / float(power @ power) if total > 0.0 else np.inf
    return max((1.0 + lasting) / (1.0 - lasting), 0.5 * len(rest) / lines)
