"""Reading logs for Python users. A log with too many missing samples for estimation may still relate its channels."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from experiments.command.logs import catch_and_repeat_warnings, catch_log_warnings
from plant.errors import SparseLogError
from plant.log.clock.uniform import MOST_MISSING_TO_RELATE
from plant.log.notes import LogCode

if TYPE_CHECKING:
    from plant.errors import LogWarning
    from plant.log.record import Record


@dataclass(frozen=True, eq=False)
class Reading:
    """A log after reading.

    Parameters
    ----------
    record : Record
        The log.
    said : sequence of LogWarning
        Remarks from reading the log.
    sparse : Record or None
        The log including the channels that `record` lacks, with up to half of each missing; None if it lacks none.
    refusal : str
        Why nothing is estimated from `record`; empty if few enough samples are missing.
    """

    record: "Record"
    said: "Sequence[LogWarning]" = ()
    sparse: "Record | None" = None
    refusal: str = ""


def read_whole_or_sparse(read: "Callable[..., Record]") -> Reading:
    """Return a log, whole or with up to half of its samples missing.

    Parameters
    ----------
    read : callable
        Reads the log; ``most_missing`` is the share of samples that may be missing [fraction], 5 % if not given.

    Returns
    -------
    Reading
        The log. It is read a second time only if it, or one of its channels, lacks too many samples.

    Raises
    ------
    LogError
        If the log cannot be read or trusted; if over half is missing, with the message used for estimates.

    Warns
    -----
    LogWarning
        Remarks from reading the log.
    """
    with catch_and_repeat_warnings() as said:
        try:
            record = read()
        except SparseLogError as refused:
            try:
                record = read(most_missing=MOST_MISSING_TO_RELATE)
            except SparseLogError:
                raise refused from None
            return Reading(record, said, refusal=str(refused))
    if not any(one.note.code in (LogCode.CHANNEL_LEFT_OUT, LogCode.CHANNEL_LOGGED_IN_PART) for one in said):
        return Reading(record, said)
    with catch_log_warnings():
        return Reading(record, said, sparse=read(most_missing=MOST_MISSING_TO_RELATE))
