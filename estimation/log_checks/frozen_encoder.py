"""Whether a constant encoder reading misses a motion, or the yield of seals. Leakage is the log's own."""

import numpy as np

from estimation.log_checks.bridging import bridged
from estimation.log_checks.channel_names import POSITION, PRESSURE, SPEED
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.log.record import Record

BLOCK, FEWEST = 0.02, 25
"""Length of the blocks over which flows are balanced [s], and least blocks outside of the hold [count]."""

WINDOW = 0.5
"""Parts of a hold that are judged separately [s]: over longer ones losses would be too uncertain."""

LOSSES_KNOWN, FLOW_KNOWN, DEVIATIONS = 0.25, 0.05, 3.0
"""Allowances: share by which losses may differ within the hold, share by which pump and piston may be wrong, and
deviations of the losses."""

SHORTEST_TRAVEL = 5e-4
"""Missed travel below which nothing is concluded: seals yield by less [m]."""

AT_RELIEF = 0.9
"""Share of the relief setting from which the valve may take all pumped flow [fraction]."""

SEALS_YIELD, RESOLVED = 2e-5, 10.0
"""Yield of seals before they slide [m] (judged), and quanta of an encoder that must show it [count]."""

FAR_LONGER, SWINGS = 10.0, 0.5
"""Length of a hold over the longest other one, and its range of pressure over that elsewhere, from which it is checked
[dimensionless]; judged."""

JUMP, BEYOND_PUMP = 10.0, 5.0
"""A step after a hold is a jump if it is so many times any other, and so many times what the pump can move."""


def ends_with_jump(record: Record, hold: slice, p: EhaParameters) -> bool:
    """Return whether the encoder leaves a hold with a jump too fast for a piston.

    Parameters
    ----------
    record : Record
        The log, with position.
    hold : slice
        Samples with a constant reading.
    p : EhaParameters
        The actuator, for what its pump moves.

    Returns
    -------
    bool
        Also False if the log ends with the hold.
    """
    present = np.flatnonzero(np.isfinite(record[POSITION]))
    rate = np.abs(np.diff(record[POSITION][present])) / (np.diff(present) * record.sample_time)
    after = int(np.searchsorted(present, hold.stop)) - 1
    if not 0 <= after < len(rate) or SPEED not in record:
        return False
    others = np.delete(rate, after)
    fastest = float(np.nanmax(np.abs(record[SPEED]))) * p.pump_displacement / p.piston_area
    return bool(rate[after] > max(JUMP * float(np.max(others, initial=0.0)), BEYOND_PUMP * fastest))


def misses_yield_of_seals(record: Record, hold: slice, p: EhaParameters) -> bool:
    """Return whether a fine encoder repeats one value for long while the piston yields on its seals.

    Pressure varies meanwhile, and the encoder repeats itself for far longer than anywhere else.

    Parameters
    ----------
    record : Record
        The log, with position.
    hold : slice
        Samples with a constant reading.
    p : EhaParameters
        The actuator, for its friction.
    """
    length = hold.stop - hold.start
    if PRESSURE not in record or min(length, len(record) - length) * record.sample_time < WINDOW:
        return False
    position = record[POSITION].copy()
    position[hold.start + 1 : hold.stop] = np.nan
    position = position[np.isfinite(position)]
    steps = np.diff(position)
    moved = np.flatnonzero(steps)
    if np.ptp(position) > SHORTEST_TRAVEL or len(moved) < FEWEST or length < FAR_LONGER * np.max(np.diff(moved)):
        return False
    within, usual = (_range(one) for one in (record[PRESSURE][hold], np.delete(record[PRESSURE], hold)))
    yields = SEALS_YIELD * within * p.piston_area / p.friction_coulomb if p.friction_coulomb > 0.0 else 0.0
    return within > SWINGS * usual and yields > RESOLVED * float(np.min(np.abs(steps[moved])))


def _range(values: Array) -> float:
    """Return the range of a channel without its highest and lowest hundredth; NaN if it has hardly any samples."""
    there = values[np.isfinite(values)]
    return float(np.subtract(*np.percentile(there, (99.0, 1.0)))) if len(there) > FEWEST else np.nan


def misses_motion(record: Record, hold: slice, p: EhaParameters) -> bool:
    """Return whether pump delivery within a hold exceeds leakage, compression and relief flow.

    Leakage, flow bias and compressibility come from the rest of the log, in which the encoder shows where the oil goes.
    Without pressure, or with too little of a rest, leakage may have taken all.

    Parameters
    ----------
    record : Record
        The log, with position.
    hold : slice
        Samples with a constant reading.

    Returns
    -------
    bool
        Whether the piston must have moved.
    """
    if PRESSURE not in record or SPEED not in record:
        return False
    there = np.isfinite(record[PRESSURE])
    # pressure within the hold may have had any value
    if not np.any(there) or np.mean(there[hold]) <= 0.5 * np.mean(there):
        return False
    size = max(2, round(BLOCK / record.sample_time))
    span, count = size * record.sample_time, (len(record) - 1) // size
    speed, pressure = (_means(bridged(record[name]), size, count) for name in (SPEED, PRESSURE))
    swept, rise = (np.diff(bridged(record[name])[::size][: count + 1]) for name in (POSITION, PRESSURE))
    pumped = p.pump_displacement * speed
    losses = np.column_stack([pressure, _bias_flow(pumped, p.flow_bias), rise / span])
    blocks = np.arange(count)
    within = (blocks * size >= hold.start) & ((blocks + 1) * size <= hold.stop)
    away = ((blocks + 1) * size < hold.start) | (blocks * size > hold.stop)
    least = p.piston_area * SHORTEST_TRAVEL
    relieved = np.abs(pressure) > AT_RELIEF * p.relief_pressure
    away &= ~relieved
    if np.count_nonzero(away) < FEWEST or not np.any(within):
        return False
    took = pumped[away] - p.piston_area * swept[away] / span
    value, _ = _non_negative_fit(losses[away], took)
    losses[:, 1] = _bias_flow(pumped, float(value[1]))
    value, std = _non_negative_fit(losses[away], took)
    lost = np.sign(pumped) * np.minimum(np.abs(losses[:, :2] @ value[:2]), np.abs(pumped))
    left = np.where(relieved, 0.0, pumped - lost - losses[:, 2] * value[2])[within]
    uncertain = DEVIATIONS * np.abs(losses[within]) @ std + LOSSES_KNOWN * np.abs(lost[within])
    allowed = uncertain + FLOW_KNOWN * np.abs(pumped[within])
    length = max(1, round(WINDOW / span))
    return any(
        abs(float(np.sum(left[k : k + length]))) > float(np.sum(allowed[k : k + length])) + least / span
        for k in range(0, max(1, len(left) - length + 1), max(1, length // 2))
    )


def _bias_flow(pumped: Array, bias: float) -> Array:
    """Return the flow lost by a flow bias: no more than is pumped.

    At rest only noise is pumped, and its sign would hide the bias of a log with long rests.
    """
    return np.clip(pumped / bias, -1.0, 1.0) if bias > 0.0 else np.sign(pumped)


def _means(values: Array, size: int, count: int) -> Array:
    return values[: count * size].reshape(count, size).mean(axis=1)


def _non_negative_fit(columns: Array, found: Array) -> tuple[Array, Array]:
    """Return non-negative coefficients, with their deviations."""
    sizes = np.linalg.norm(columns, axis=0)
    sizes[sizes == 0.0] = 1.0
    inverse = np.linalg.pinv((columns / sizes).T @ (columns / sizes))
    value = np.maximum(inverse @ ((columns / sizes).T @ found), 0.0)
    left = float(np.mean((found - (columns / sizes) @ value) ** 2))
    return value / sizes, np.sqrt(left * np.maximum(np.diag(inverse), 0.0)) / sizes
