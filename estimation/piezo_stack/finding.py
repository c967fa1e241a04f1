"""`stack_finding(record, healthy) -> Finding`: what a log of the piezo-stack actuator determines, and what not."""

from collections.abc import Collection, Mapping, Sequence
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from estimation.finding import Finding, Gate, Outcome, Quantity
from estimation.piezo_stack.estimate import StackEstimate, estimate_stack, stack_bounds
from estimation.piezo_stack.runs import DRIVE, STACK_CHANNELS
from estimation.piezo_stack.unknowns import DEFAULT_UNKNOWNS, STARTS, UNKNOWNS
from plant.log.record import Record
from plant.notes import Code, Note
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.piezo_stack.trajectory import NAME

MOST_MISFIT = 1.05
"""Residual over noise above which the model does not describe a log, chance apart [dimensionless]."""

CHANCE_ALLOWANCE = 4.0
"""Allowance for chance, over the root of the number of samples: three deviations of noise that was estimated from the
log, which scatters by 1.3 of that [dimensionless]."""

MOST_DEVIATION = 0.30
"""Standard deviation, over the healthy value or over the size of a small fault, above which no number is given."""

MOST_LEFT = 0.1
"""Share of what the model misses, as a mean square, that a corrected delay may leave if the model then still does not
describe the log [dimensionless] (judged): one channel of a wrong scale passes for a delay of all up to a half."""

_MOST_CORRECTIONS = 2

SMALLEST_FAULT: Mapping[str, float] = {"chamber_leakage": 5e-12, "crossport_leakage": 5e-12, "coulomb_friction": 100.0}
"""Reference sizes of leaks and friction, which are zero or small in a healthy actuator [SI]."""


class StackCode(Code):
    """Notes on an estimate of the piezo-stack actuator."""

    CHANNEL_MISSED = "the model misses {channel} by {ratio:.3g} times its noise"
    CHANNEL_DISAGREES = (
        "{channel} alone disagrees: without it the model explains the log; inspect that sensor, its scale and its delay"
    )
    CHANNELS_SHIFTED = (
        "all channels are {shift_us:.0f} us {side} the drive (filters, or a drive measured before its amplifier); this "
        "was corrected"
    )
    QUANTITIES_NOT_TOLD = "these sensors do not determine {names}"


def stack_finding(
    record: Record, healthy: PiezoStackParameters, *, channels: tuple[str, ...] = STACK_CHANNELS
) -> Finding:
    """Estimate air, leaks, friction, polarisation and reeds from a run that began at rest.

    Parameters
    ----------
    healthy : PiezoStackParameters
        The healthy actuator, at the run's bias pressure and load.
    channels : tuple of str
        Channels to use, of those that are logged.

    Returns
    -------
    Finding
        Its evidence is the `StackEstimate`.

    Raises
    ------
    LogError
        If the log cannot be used.
    """
    found, in_step, shifts = estimate_in_step(record, healthy, channels=channels)
    quantities = stack_quantities(found, healthy)
    lost = [name for name, one in quantities.items() if one.value is None]
    reasons = tuple(
        StackCode.CHANNEL_MISSED.note(channel=name, ratio=ratio) for name, ratio in undescribed_channels(found).items()
    )
    if reasons:
        reasons += channel_disagrees(in_step, healthy, tuple(found.misfit))
        quantities = {name: Quantity(None, one.unit, None, one.std) for name, one in quantities.items()}
    told = Outcome.NOT_OBSERVABLE if len(lost) == len(quantities) else Outcome.OK
    return Finding(
        actuator=NAME,
        outcome=Outcome.MISMATCH if reasons else told,
        quantities=quantities,
        gate=Gate(not reasons, reasons),
        channels=tuple(found.misfit),
        not_told=(StackCode.QUANTITIES_NOT_TOLD.note(names=", ".join(lost)),) if lost else (),
        notes=shifts,
        evidence=found,
    )


def stack_prospect(
    actuator: PiezoStackParameters,
    voltage: NDArray[np.float64],
    sample_time: float,
    *,
    channels: tuple[str, ...] = STACK_CHANNELS,
) -> Finding:
    """Return what a run would determine, before it is made: Cramér-Rao bounds, all unknown together.

    Parameters
    ----------
    actuator : PiezoStackParameters
        The actuator, at the run's bias pressure and load.
    voltage : ndarray, shape (n,)
        Drive at the samples [V].
    sample_time : float
        Seconds between samples [s].

    Returns
    -------
    Finding
        The actuator's own values with the least standard deviations that any method could reach.
    """
    quantities: dict[str, Quantity] = {}
    for name, bound in stack_bounds(actuator, voltage, sample_time, channels=channels).items():
        unknown = UNKNOWNS[name]
        value = 1.0 if len(unknown.names) > 1 else float(getattr(actuator, name))
        quantities[name] = Quantity(value, UNKNOWNS[name].unit, None, bound if unknown.scale else bound * value)
    return Finding(NAME, Outcome.OK, quantities, Gate(True, ()), channels)


def undescribed_channels(found: StackEstimate) -> Mapping[str, float]:
    """Return the channels that the fitted actuator does not describe.

    Returns
    -------
    Mapping[str, float]
        Residual over noise, by channel [dimensionless].
    """
    most = MOST_MISFIT + CHANCE_ALLOWANCE / sqrt(found.samples)
    return {name: ratio for name, ratio in found.misfit.items() if ratio > most}


def estimate_in_step(
    record: Record,
    healthy: PiezoStackParameters,
    *,
    channels: Collection[str] = STACK_CHANNELS,
    unknowns: Collection[str] = DEFAULT_UNKNOWNS,
    starts: Sequence[Mapping[str, float]] = STARTS,
) -> tuple[StackEstimate, Record, tuple[Note, ...]]:
    """Estimate with a drive that is in step with the channels: a delay of all of them is corrected.

    Parameters
    ----------
    record : Record
        A run that began at rest.
    healthy : PiezoStackParameters
        The healthy actuator, at the run's bias pressure and load.
    channels, unknowns : collection of str
        As in `estimate_stack`.
    starts : sequence of Mapping[str, float]
        First guesses, scaled as in `UNKNOWNS` [dimensionless].

    Returns
    -------
    tuple of StackEstimate, Record and tuple of Note
        The estimate, the log with the corrected drive, and a note on the correction; without a note the log is as it
        was, since the model describes it, or a delay does not explain it.

    Raises
    ------
    LogError
        If the log cannot be used.
    """

    def estimate(one: Record) -> StackEstimate:
        return estimate_stack(one, healthy, unknowns=unknowns, channels=channels, starts=starts)

    found, in_step, delay = estimate(record), record, 0.0
    for _ in range(_MOST_CORRECTIONS):
        if not undescribed_channels(found):
            break
        tried = delay + found.delay
        shifted = _with_later_drive(record, tried)
        other = estimate(shifted)
        if undescribed_channels(other) and _most_missed(other) > MOST_LEFT * _most_missed(found):
            break
        found, in_step, delay = other, shifted, tried
    if delay == 0.0:
        return found, record, ()
    side = "behind" if delay > 0.0 else "ahead of"
    return found, in_step, (StackCode.CHANNELS_SHIFTED.note(shift_us=1e6 * abs(delay), side=side),)


def _most_missed(found: StackEstimate) -> float:
    """Return the largest mean square of a channel's residual beyond its noise, over that of the noise."""
    return max(found.misfit.values()) ** 2 - 1.0


def _with_later_drive(record: Record, delay: float) -> Record:
    time = record.sample_time * np.arange(len(record))
    return record.replace(**{DRIVE: np.interp(time - delay, time, record[DRIVE])})


def channel_disagrees(record: Record, healthy: PiezoStackParameters, channels: Collection[str]) -> tuple[Note, ...]:
    """Return the one channel that is to blame for a log that the model does not describe.

    Parameters
    ----------
    record : Record
        A run that began at rest, and that the model does not describe.
    healthy : PiezoStackParameters
        The healthy actuator, at the run's bias pressure and load.
    channels : collection of str
        Channels that were used.

    Returns
    -------
    tuple of Note
        Empty if leaving out no single channel helps, if leaving out either of two channels helps, or if fewer than two
        would be left.
    """
    others = [tuple(name for name in channels if name != left) for left in channels] if len(channels) > 2 else []
    explained = [not undescribed_channels(estimate_stack(record, healthy, channels=some)) for some in others]
    if sum(explained) != 1:
        return ()
    return (StackCode.CHANNEL_DISAGREES.note(channel=tuple(channels)[explained.index(True)]),)


def stack_quantities(found: StackEstimate, healthy: PiezoStackParameters) -> dict[str, Quantity]:
    """Return every quantity with its interval; without a number if the sensors contain too little information."""
    quantities: dict[str, Quantity] = {}
    for name, value in found.values.items():
        size = 1.0 if name == "polarisation" else SMALLEST_FAULT.get(name) or getattr(healthy, name) or 1e-4
        told = found.deviations[name] < MOST_DEVIATION * size
        numbers = (value, found.interval(name)) if told else (None, None)
        quantities[name] = Quantity(numbers[0], UNKNOWNS[name].unit, numbers[1], found.deviations[name])
    return quantities
