"""Reading a log for Python users: one that lacks too many samples to be estimated may still relate its channels."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from experiments.command.logs import caught, overheard
from plant.errors import SparseLogError
from plant.log.clock.uniform import MOST_MISSING_TO_RELATE
from plant.log.notes import LogCode

if TYPE_CHECKING:
    from plant.errors import LogWarning
    from plant.log.record import Record


@dataclass(frozen=True, eq=False)
class Reading:
    """A log as it was read.

    Parameters
    ----------
    record : Record
        The log.
    said : sequence of LogWarning
        What reading it brought up.
    sparse : Record or None
        The log with the channels that `record` lacks, up to half of each missing; None if it lacks none.
    refusal : str
        Why nothing is estimated of `record`; empty where few enough samples are missing.
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
        The log. It is read again only where too many samples of it, or of a channel, are missing.

    Raises
    ------
    LogError
        If the log cannot be read or trusted; where over half is missing, in the words for an estimate.

    Warns
    -----
    LogWarning
        What reading it brings up.
    """
    with overheard() as said:
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
    with caught():
        return Reading(record, said, sparse=read(most_missing=MOST_MISSING_TO_RELATE))
