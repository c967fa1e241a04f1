"""The verb `hydrostate filter`: turns rows into samples, filters the samples, and prints estimates as lines."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.command.terminal import note
from experiments.streams.rows import STANDARD_INPUT, open_rows, report_left_out_rows, warn_of_cut_row
from experiments.streams.state_file import require_same_rate, save_at_intervals
from plant.errors import LogError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from estimation.eha.online import StreamFilterOptions
    from estimation.filters.online import OnlineFilter
    from plant.log.record import Record
    from plant.log.stream.csv_rows import CsvStream

LEARNING = 1.0
"""Time at the start of a stream from which noise levels and initial estimate are taken, if no log is named [s]."""

FEWEST_ROWS = 200
"""Smallest number of rows from which a filter starts."""

LONGEST_PIECE = 0.1
"""Longest piece of a stream that is filtered at once [s]; results do not depend on it."""


@dataclass
class Filtering:
    """A filtered stream and its output.

    Parameters
    ----------
    say : callable
        Receives the entries of a line.
    asked : StreamFilterOptions
        The filter.
    columns : tuple of two Mapping[str, str]
        Foreign column by channel, from the rig file and from the command line.
    every : float
        Stream time between two estimates [s].
    like : Record or None
        A log from the same test bench that gives the noise levels; the beginning of the stream if None.
    state : Path or None
        File that keeps the state of the filter over a restart.
    source : str
        Name of the stream in lines, errors and warnings.
    """

    say: Callable[[dict[str, Any]], None]
    asked: "StreamFilterOptions"
    columns: tuple[Mapping[str, str], Mapping[str, str]]
    every: float
    like: "Record | None" = None
    state: Path | None = None
    source: str = STANDARD_INPUT
    last: float | None = field(default=None, init=False)
    filtered: "OnlineFilter | None" = field(default=None, init=False)
    _sums: "tuple[NDArray[np.float64], NDArray[np.float64]] | None" = field(default=None, init=False)

    def follow(self, lines: Iterable[str]) -> None:
        """Filter a header and rows as they arrive, until they end.

        Raises
        ------
        HydrostateError
            If too many rows are garbage, or the stream cannot be filtered.
        """
        stream = open_rows(lines, *self.columns, self.source)
        told = stream.start_time
        with report_left_out_rows(stream, self.source), save_at_intervals(self.state, self._save, told) as save_if_due:
            for last, rows, gap in self._pieces(stream):
                filtered = self._current_filter(stream, rows, last, gap)
                channels = dict(zip(stream.channels, rows.T, strict=True))
                self._take(filtered, channels)
                self.last = last
                if last - told >= self.every - 0.5 * stream.sample_time:
                    told += self.every * round((last - told) // self.every or 1)
                    self._estimate(filtered)
                save_if_due(last)
        if self.filtered is not None and self.last is not None and self.last > told:
            self._estimate(self.filtered)
        warn_of_cut_row(stream, self.source)

    def end(self, outcome: str, message: str) -> None:
        """Report that the stream has ended, and how."""
        taken = 0 if self.filtered is None else self.filtered.taken
        self._line("end", outcome=outcome, samples=taken, message=message or f"{taken} samples filtered")

    def _save(self, state: Path) -> None:
        from estimation.eha.online import save_filter

        if self.filtered is not None and self.last is not None:
            save_filter(state, self.asked, self.filtered, self.last)

    def _pieces(self, stream: "CsvStream") -> "Iterator[tuple[float, NDArray[np.float64], bool]]":
        """Yield pieces of rows; at the start and after a gap, the first piece has enough rows to start the filter."""
        import numpy as np

        resumes = self.state is not None and self.state.exists()
        wanted = 0 if resumes else self._rows_to_start(stream)
        first: list[NDArray[np.float64]] = []
        after_gap, last = False, stream.start_time
        for last, rows, gap in stream.samples(max(1, round(min(self.every, LONGEST_PIECE) / stream.sample_time))):
            if gap:
                if first:
                    note(f"{self.source}: warning: too few rows before a gap at {last:g} s to start the filter")
                first, after_gap, wanted = [], True, self._rows_to_start(stream)
            first.append(rows)
            if sum(map(len, first)) >= wanted:
                yield last, np.concatenate(first), after_gap
                first, after_gap, wanted = [], False, 0
        if first:
            yield last, np.concatenate(first), after_gap

    def _rows_to_start(self, stream: "CsvStream") -> int:
        """Return the number of rows needed to start a filter."""
        return 1 if self.like is not None else max(round(LEARNING / stream.sample_time), FEWEST_ROWS)

    def _current_filter(
        self, stream: "CsvStream", rows: "NDArray[np.float64]", last: float, gap: bool
    ) -> "OnlineFilter":
        """Return the filter, which starts, resumes from its state file, or restarts after a gap."""
        from estimation.eha.online import begin_filter
        from plant.log.record import Record

        T = stream.sample_time
        if self.filtered is None and not gap and self.state is not None and self.state.exists():
            self._resume(self.state, T, last - (len(rows) - 1) * T)
        if self.filtered is None or gap:
            if gap:
                note(f"{self.source}: warning: rows are missing before {last:g} s, so the filter restarts")
            record = Record(T, dict(zip(stream.channels, rows.T, strict=True)))
            try:
                self.filtered, self._sums = begin_filter(self.asked, record, self.like), None
            except LogError as error:
                raise LogError(error.message, self.source) from error
            self._start(self.filtered, "begun")
        return self.filtered

    def _resume(self, state: Path, sample_time: float, start: float) -> None:
        """Resume from the state file; rows missing since then count as missing samples."""
        import numpy as np

        from estimation.eha.online import load_filter
        from plant.log.stream.csv_rows import LONGEST_GAP

        filtered, last = load_filter(state, self.asked)
        T = filtered.problem.sample_time
        require_same_rate(state, T, sample_time, self.source)
        missing = round((start - last) / T) - 1
        if not 0 <= missing * T <= LONGEST_GAP:
            note(f"{self.source}: warning: the stream does not continue at {last:g} s, so the filter restarts")
            return
        wide = len(filtered.problem.model.drives), len(filtered.problem.channels)
        filtered.take(np.full((missing, wide[0]), np.nan), np.full((missing, wide[1]), np.nan))
        self.filtered, self.last = filtered, last
        now = filtered.now()
        self._sums = now.nis, now.count
        self._start(filtered, "continued")

    def _take(self, filtered: "OnlineFilter", channels: "Mapping[str, NDArray[np.float64]]") -> None:
        from estimation.eha.online import samples_of

        try:
            filtered.take(*samples_of(filtered, channels))
        except LogError as error:
            raise LogError(error.message, self.source) from error

    def _start(self, filtered: "OnlineFilter", how: str) -> None:
        task = filtered.problem
        about = {"form": self.asked.form, "method": self.asked.method, "channels": list(task.channels)}
        self._line("start", file=self.source, rate_hz=round(1.0 / task.sample_time, 6), **about, message=how)

    def _estimate(self, filtered: "OnlineFilter") -> None:
        """Report the estimates, and the size of the innovations since the last report."""
        import numpy as np

        from estimation.trust.consistency import LARGEST_NIS, MISMATCH_NIS

        now, names = filtered.now(), [state.name for state in filtered.problem.model.states]
        before = (0.0 * now.nis, 0.0 * now.count) if self._sums is None else self._sums
        self._sums = now.nis, now.count
        came = now.count - before[1]
        with np.errstate(invalid="ignore", divide="ignore"):
            nis = np.where(came > 0.0, (now.nis - before[0]) / came, np.nan)
        finite = bool(np.all(np.isfinite([now.values, now.deviations])))
        worst = float(np.nanmax(nis)) if np.any(came > 0.0) else 0.0
        gate = [code for code, held in (
            ("not_finite", finite), ("mismatch", not worst > MISMATCH_NIS), ("overconfident", not worst > LARGEST_NIS)
        ) if not held]  # fmt: skip
        self._line(
            "estimate",
            values=_listed(names, now.values),
            std=_listed(names, now.deviations),
            nis=_listed(filtered.problem.channels, nis),
            samples=filtered.taken,
            gate=gate,
        )

    def _line(self, event: str, **entries: Any) -> None:
        clock = datetime.now(UTC).isoformat(timespec="milliseconds")
        time_s = None if self.last is None else round(self.last, 6)
        self.say({"event": event, "time_s": time_s, "clock": clock, **entries})


def _listed(names: Iterable[str], values: "NDArray[np.float64]") -> dict[str, float | None]:
    """Return numbers by name; values that are not finite become null."""
    shown = (float(value) for value in values)
    return {name: value if abs(value) < float("inf") else None for name, value in zip(names, shown, strict=True)}
