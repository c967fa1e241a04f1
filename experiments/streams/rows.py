"""Rows of a stream: reads the header, then the rows, and reports missing parts on standard error."""

import io
from collections.abc import Generator, Iterable, Iterator, Mapping
from contextlib import contextmanager
from itertools import chain
from typing import TYPE_CHECKING, TextIO

from experiments.command.logs import read_and_warn, with_rig_columns
from experiments.command.terminal import note
from plant.log.stream.source import BatchCounts, bounded_lines

if TYPE_CHECKING:
    from plant.log.stream.csv_rows import CsvStream

STANDARD_INPUT = "standard input"
"""Name of standard input in events and errors."""


def stream_input(file: TextIO) -> Iterator[str]:
    """Yield the lines of standard input; bytes that are not text are rejected later as invalid numbers.

    Raises
    ------
    LogError
        If a line does not end.
    """
    if isinstance(file, io.TextIOWrapper):
        file.reconfigure(errors="replace")
    return bounded_lines(file, STANDARD_INPUT)


def open_rows(
    lines: Iterable[str], rig_columns: Mapping[str, str], columns: Mapping[str, str], source: str
) -> "CsvStream":
    """Return the rows below a header.

    Parameters
    ----------
    lines : iterable of str
        Header and rows.
    rig_columns, columns : Mapping[str, str]
        Foreign column by channel, from the rig file and from the command line.
    source : str
        Name of the stream in errors and warnings.

    Raises
    ------
    LogError
        If they are not the rows of a log.
    """
    from plant.log.stream.csv_rows import CsvStream

    rest = iter(lines)
    header = next((line for line in rest if line.strip()), "")

    def opened(mapping: Mapping[str, str]) -> CsvStream:
        return CsvStream(chain([header], rest), mapping, source=source)

    return read_and_warn(source, lambda: with_rig_columns(opened, rig_columns, columns))


@contextmanager
def report_left_out_rows(stream: "CsvStream", source: str) -> Generator[None]:
    """Report at the end of this block which rows of a stream were left out, however it ends."""
    try:
        yield
    finally:
        if stream.left_out:
            counted = "1 row holds" if stream.left_out == 1 else f"{stream.left_out} rows hold"
            first = "" if stream.left_out == 1 else "the first: "
            note(f"{source}: warning: {counted} garbage, which was left out; {first}{stream.first_left_out}")


def warn_of_cut_row(stream: "CsvStream", source: str) -> None:
    """Report that the last row was left out, if it was incomplete."""
    if stream.cut:
        note(f"{source}: warning: the last row is incomplete and was left out")


def warn_of_lost_batches(address: str, received: BatchCounts) -> None:
    """Report what happened to the batches of a network stream, if any are missing."""
    for count, fate in (
        (received.lost, "never came"),
        (received.late, "came late or twice"),
        (received.dropped, "found no room to wait"),
    ):
        if count:
            note(f"{address}: warning: {count} {received.what} {fate} beside {received.batches} that were read")
