"""Sensor faults: a bias, a gain, a drift, a freeze, a saturation or drop-outs, on one channel of a log.

Each fault changes a measured channel from a given time on, at once or growing. Source: the fault classes of Isermann,
Fault-Diagnosis Systems (2006), sensors.
"""

from dataclasses import dataclass
from math import isfinite
from typing import Literal, TypeAlias, get_args

import numpy as np

from plant.arrays import Array
from plant.errors import RigError, require_known
from plant.log.record import Record

Kind: TypeAlias = Literal["bias", "gain", "drift", "freeze", "saturation", "dropout"]


@dataclass(frozen=True, kw_only=True)
class SensorFault:
    """One fault of one channel.

    Parameters
    ----------
    channel : str
        The channel, as a `Record` names it.
    kind : {"bias", "gain", "drift", "freeze", "saturation", "dropout"}
        The effect: ``bias`` adds `size`; ``gain`` multiplies by ``1 + size``; ``drift`` adds `size` per second;
        ``freeze`` repeats the last healthy value; ``saturation`` limits the magnitude to `size`; ``dropout`` loses the
        fraction `size` of the samples.
    size : float
        In the channel's unit, a fraction for ``gain`` and ``dropout``, the unit per second for ``drift``; not used by
        ``freeze``.
    start : float
        Time at which it begins, from the start of the record [s].
    growth : float
        Time over which bias and gain grow linearly to their size [s]; 0 means at once.

    Raises
    ------
    RigError
        If the kind is unknown, a number is not finite, a time is negative, a limit is not positive, or a share of
        samples is not between 0 and 1.

    Examples
    --------
    >>> log = Record(0.5, {"position_m": np.zeros(5)})
    >>> with_fault(log, SensorFault(channel="position_m", kind="bias", size=1e-3, start=1.0))["position_m"].tolist()
    [0.0, 0.0, 0.001, 0.001, 0.001]
    """

    channel: str
    kind: Kind
    size: float = 0.0
    start: float = 0.0
    growth: float = 0.0

    def __post_init__(self) -> None:
        require_known("a sensor fault", self.kind, get_args(Kind), RigError)
        for name in ("size", "start", "growth"):
            if not isfinite(getattr(self, name)):
                raise RigError(f"{name} of a sensor fault must be finite, got {getattr(self, name)!r}")
        if self.start < 0.0 or self.growth < 0.0:
            raise RigError(f"times of a sensor fault must not be negative, got {self.start!r} and {self.growth!r} s")
        if self.growth > 0.0 and self.kind not in ("bias", "gain"):
            raise RigError(f"only bias and gain grow, got {self.kind!r} with growth {self.growth:g} s")
        if self.kind == "saturation" and self.size <= 0.0:
            raise RigError(f"size of a saturation must be positive, got {self.size!r}")
        if self.kind == "dropout" and not 0.0 <= self.size <= 1.0:
            raise RigError(f"size of a dropout must be between 0 and 1, got {self.size!r}")


def with_fault(record: Record, fault: SensorFault, rng: np.random.Generator | None = None) -> Record:
    """Return the record with one channel measured by a faulty sensor; the true channels are kept.

    Parameters
    ----------
    record : Record
        A measured run.
    rng : numpy.random.Generator, optional
        Source of the choice of samples that drop out; needed for ``dropout`` only.

    Returns
    -------
    Record
        The record, with the fault in its metadata under ``sensor_fault_`` and the channel.

    Raises
    ------
    LogError
        If the channel is not in the record.
    RigError
        If the fault is a drop-out and there is no generator.
    """
    time = record.sample_time * np.arange(len(record), dtype=np.float64)
    values = _faulty(record[fault.channel], time, fault, rng)
    said = {"kind": fault.kind, "size": fault.size, "start_s": fault.start, "growth_s": fault.growth}
    return record.replace(**{fault.channel: values}).annotate(**{f"sensor_fault_{fault.channel}": said})


def _faulty(values: Array, time: Array, fault: SensorFault, rng: np.random.Generator | None) -> Array:
    """Return the channel as measured by the faulty sensor."""
    present = time >= fault.start
    since = np.maximum(time - fault.start, 0.0)
    grown = np.minimum(since / fault.growth, 1.0) if fault.growth > 0.0 else present.astype(np.float64)
    match fault.kind:
        case "bias":
            return values + fault.size * grown
        case "gain":
            return values * (1.0 + fault.size * grown)
        case "drift":
            return values + fault.size * since
        case "freeze":
            first = int(np.searchsorted(time, fault.start))
            return np.where(present, values[max(first - 1, 0)], values)
        case "saturation":
            return np.where(present, np.clip(values, -fault.size, fault.size), values)
        case "dropout":
            if rng is None:
                raise RigError("a dropout needs rng, got None")
            return np.where(present & (rng.random(len(values)) < fault.size), np.nan, values)
