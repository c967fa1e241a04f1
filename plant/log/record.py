"""`Record`, which all layers share: one run or log with a uniform clock, named SI channels and metadata."""

import warnings
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite
from numbers import Integral, Real
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plant.errors import LogError, LogWarning
from plant.log.checks import REQUIRED, all_missing, checked_log
from plant.log.columns import CHANNELS as CHANNELS
from plant.log.columns import resolve_columns
from plant.log.formats.cells import numbers, values_of

if TYPE_CHECKING:
    import pandas as pd


def _frozen_channels(channels: Mapping[str, ArrayLike]) -> Mapping[str, NDArray[np.float64]]:
    frozen: dict[str, NDArray[np.float64]] = {}
    for name, given in channels.items():
        values = given if type(given) is np.ndarray else values_of(name, given, "the record")
        if hasattr(values, "magnitude"):
            raise LogError(f"channel {name[:80]!r} must be plain numbers in SI, got a quantity", "the record")
        if values.dtype.kind not in "fiub":
            values = numbers(values, name, "the record")
        column = np.asarray(values, dtype=np.float64).view()
        column.flags.writeable = False
        frozen[name] = column
    return MappingProxyType(frozen)


def _values(series: "pd.Series[Any]") -> NDArray[Any]:
    import pandas as pd

    if pd.api.types.is_numeric_dtype(series.dtype) and not pd.api.types.is_complex_dtype(series.dtype):
        return series.to_numpy(dtype=np.float64, na_value=np.nan)
    return series.astype(object).where(series.notna(), None).to_numpy()


@dataclass(frozen=True, eq=False)
class Record:
    """A run or a log on a uniform clock.

    Parameters
    ----------
    sample_time : float
        Time between samples [s], positive.
    channels : Mapping[str, ndarray, shape (n,)]
        Values in SI under their channel name (``motor_speed_rad_s``); NaN marks a missing sample.
        Simulated truth may stand beside the sensors under other names (``true_...``).
    metadata : Mapping[str, Any]
        What made the record: plant, condition, parameters, seed, versions. JSON values only.
    start_time : float
        Time of the first sample [s].

    Raises
    ------
    LogError
        If the sample time is not positive and finite, there is no channel, or the lengths differ.

    Examples
    --------
    >>> import numpy as np
    >>> record = Record(1e-3, {"velocity_m_s": np.zeros(1001)})
    >>> record.duration
    1.0
    """

    sample_time: float
    channels: Mapping[str, NDArray[np.float64]]
    metadata: Mapping[str, Any] = field(default_factory=dict[str, Any])
    start_time: float = 0.0

    def __post_init__(self) -> None:
        if not (isinstance(self.sample_time, Real) and isfinite(self.sample_time) and self.sample_time > 0.0):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise LogError(f"sample_time must be positive and finite, got {self.sample_time!r}")
        if not (isinstance(self.start_time, Real) and isfinite(self.start_time)):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise LogError(f"start_time must be a finite number of seconds, got {self.start_time!r}")
        if not self.channels:
            raise LogError("a record needs at least one channel, got none")
        for what, given in (("channels", self.channels), ("metadata", self.metadata)):
            if not isinstance(given, Mapping):  # pyright: ignore[reportUnnecessaryIsInstance]
                raise LogError(f"{what} must be a mapping by name, got {given!r:.80}")
        channels = _frozen_channels(self.channels)
        lengths = {name: np.shape(values) for name, values in channels.items()}
        if len(set(lengths.values())) != 1 or any(len(shape) != 1 for shape in lengths.values()):
            raise LogError(f"channels must be one-dimensional and of one length, got {lengths}")
        object.__setattr__(self, "channels", channels)
        object.__setattr__(self, "metadata", MappingProxyType(dict(self.metadata)))

    def __repr__(self) -> str:
        names = ", ".join(self.channels)
        return f"Record({self.sample_time:g} s, {len(self)} samples from {self.start_time:g} s: {names})"

    def __reduce__(self) -> tuple[object, ...]:
        return Record, (self.sample_time, dict(self.channels), dict(self.metadata), self.start_time)

    def __len__(self) -> int:
        return len(next(iter(self.channels.values())))

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        if name not in self.channels:
            raise LogError(f"channel {name!r} is needed; the record has {', '.join(self.channels)}")
        return self.channels[name]

    def __contains__(self, name: object) -> bool:
        return name in self.channels

    def __iter__(self) -> Iterator[str]:
        return iter(self.channels)

    @property
    def time(self) -> NDArray[np.float64]:
        """Sample times [s], shape (n,)."""
        return self.start_time + self.sample_time * np.arange(len(self), dtype=np.float64)

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return self.sample_time * (len(self) - 1)

    def replace(self, **changes: NDArray[np.float64] | None) -> "Record":
        """Return a copy with channels set, or removed if the value is None.

        Parameters
        ----------
        **changes : ndarray, shape (n,), or None
            New values by channel name.

        Returns
        -------
        Record
            The changed record; this one is untouched.
        """
        merged = {**self.channels, **changes}
        kept = {name: values for name, values in merged.items() if values is not None}
        return Record(self.sample_time, kept, self.metadata, self.start_time)

    def annotate(self, **metadata: object) -> "Record":
        """Return a copy with these metadata entries added.

        Parameters
        ----------
        **metadata : object
            JSON values by name.
        """
        return Record(self.sample_time, self.channels, {**self.metadata, **metadata}, self.start_time)

    def slice(self, start: int = 0, stop: int | None = None, step: int = 1) -> "Record":
        """Return samples ``start:stop:step``, with the clock shifted and slowed to match.

        Parameters
        ----------
        start, stop, step : int
            As in Python slicing, non-negative, ``step`` at least 1.

        Raises
        ------
        LogError
            If ``start`` is negative or ``step`` is below 1.
        """
        if not all(isinstance(one, Integral | None) for one in (start, stop, step)):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise LogError(f"a slice counts samples in whole numbers, got {start!r}, {stop!r} and {step!r}")
        if start < 0 or step < 1:
            raise LogError(f"a slice needs start of 0 or more and step of 1 or more, got {start} and {step}")
        part = {name: values[start:stop:step] for name, values in self.channels.items()}
        begin = self.start_time + start * self.sample_time
        return Record(self.sample_time * step, part, self.metadata, begin)

    def to_frame(self) -> "pd.DataFrame":
        """Return a DataFrame with ``time_s`` and one column for each channel."""
        import pandas as pd

        return pd.DataFrame({"time_s": self.time, **self.channels})

    @staticmethod
    def from_frame(
        frame: "pd.DataFrame",
        columns: Mapping[str, str] | None = None,
        source: str = "the frame",
        *,
        required: Collection[str] = REQUIRED,
    ) -> "Record":
        """Return a DataFrame as a record. Its columns are converted and checked as those of a log file.

        Parameters
        ----------
        frame : pandas.DataFrame
            ``time_s`` (or time in another unit, ``time_ms``) and one column a channel.
        columns : Mapping[str, str], optional
            Foreign columns by channel: ``{"position_m": "POS_MM:mm"}``.
        required : Collection[str]
            Channels that must be there; ``"position_m or velocity_m_s"`` asks for one of the two.

        Returns
        -------
        Record
            The record, without metadata.

        Raises
        ------
        LogError
            If a column is missing, double, in an unknown unit, not a number, or not to be trusted.

        Warns
        -----
        LogWarning
            If something was mended or looks wrong (missing samples, jitter, implausible values).

        Examples
        --------
        >>> import pandas as pd
        >>> ramp = np.arange(10.0)
        >>> frame = pd.DataFrame({"time_ms": ramp, "motor_speed_rpm": 60.0 * ramp, "position_mm": ramp})
        >>> record = Record.from_frame(frame)
        >>> record.sample_time, round(float(record["position_m"][9]), 6)
        (0.001, 0.009)
        """
        if not hasattr(frame, "iloc"):
            raise LogError(f"a pandas.DataFrame is needed, got {type(frame).__name__}", source)
        chosen = resolve_columns([str(name) for name in frame.columns], columns, source)
        raw = {c: numbers(_values(frame.iloc[:, c.position]), c.name, source) for c in chosen}
        checked = checked_log(
            {of.channel: of.in_si(values) for of, values in raw.items()}, source=source, required=required
        )
        for note in checked.notes:
            warnings.warn(LogWarning(note, source), stacklevel=2)
        return Record(checked.sample_time, checked.channels, start_time=checked.start_time)


def with_samples(record: Record) -> tuple[Record, tuple[LogWarning, ...]]:
    """Return a record without channels that have no samples, as for files.

    Parameters
    ----------
    record : Record
        Made by hand, or a part of a log.

    Returns
    -------
    record : Record
        The same where every channel has a sample, or none has.
    said : tuple of LogWarning
        One for each channel that was left out.

    Examples
    --------
    >>> made = Record(1e-3, {"position_m": np.zeros(3), "velocity_m_s": np.full(3, np.nan)})
    >>> list(with_samples(made)[0])
    ['position_m']
    """
    notes = {name: note for name in record if (note := all_missing(name, record[name])) is not None}
    if not notes or len(notes) == len(record.channels):
        return record, ()
    return record.replace(**dict.fromkeys(notes)), tuple(LogWarning(note) for note in notes.values())
