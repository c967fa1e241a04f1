"""Exceptions for invalid input: one family, whose messages are written for the user."""

from collections.abc import Iterable, Sequence

from plant.notes import Note


class HydrostateError(ValueError):
    """A user's input cannot be used; the message says what was expected and what was given.

    Parameters
    ----------
    source : str, optional
        The file concerned, which precedes the sentence.
    """

    def __init__(self, message: str, source: str | None = None) -> None:
        super().__init__(message if source is None else f"{source}: {message}")
        self.message = message
        self.source = source

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (self.message, self.source)


class NoSuchNameError(HydrostateError, AttributeError):
    """An attribute does not exist; the message names the nearest one."""


class NoSuchEntryError(HydrostateError, KeyError):
    """An entry of a table does not exist; the message names the nearest one."""

    def __str__(self) -> str:
        return Exception.__str__(self)  # a KeyError would put the sentence in quotation marks


class LogError(HydrostateError):
    """A log file cannot be read or trusted."""


class NoMemoryError(LogError, MemoryError):
    """Reading a log needs more memory than is available; another log, or a single column, may fit."""


class MissingColumnError(LogError):
    """A column named in a mapping is not in the log.

    Parameters
    ----------
    channel, column : str
        The channel, and the column that was expected for it.
    known : str
        The columns that the log has, as a list in words.
    hint : str
        The column that may be meant, as a clause with its semicolon.
    """

    def __init__(self, channel: str, column: str, known: str, source: str | None = None, hint: str = "") -> None:
        wanted = f"column {column[:80]!r} is needed for {channel}; the log has {known}"
        super().__init__(f"{wanted}; name one of them as {channel}=NAME:UNIT{hint}", source)
        self.channel, self.column, self.known, self.hint = channel, column, known, hint
        self.bare = wanted
        """The sentence without command-line advice."""

    def __reduce__(self) -> tuple[object, ...]:
        return MissingColumnError, (self.channel, self.column, self.known, self.source, self.hint)


class TextColumnError(LogError):
    """A column of a log holds text where numbers are needed.

    Parameters
    ----------
    column : str
        Name of the column.
    text : str
        The text found.
    """

    def __init__(self, message: str, source: str | None = None, column: str = "", text: str = "") -> None:
        super().__init__(message, source)
        self.column, self.text = column, text


class NoChannelError(LogError):
    """A log lacks the channels of an actuator; it may still be read as a log of any origin.

    Parameters
    ----------
    message : str
        The missing channels, and the channels found.
    hint : str
        Advice for the command line, as clauses, each after a semicolon.
    columns : tuple of str
        Names of the log's columns, which may be channels of another kind of actuator.
    """

    def __init__(self, message: str, source: str | None = None, hint: str = "", columns: tuple[str, ...] = ()) -> None:
        super().__init__(f"{message}{hint}", source)
        self.bare, self.hint, self.columns = message, hint, columns

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (self.bare, self.source, self.hint, self.columns)


class ClockError(LogError):
    """The time stamps of a log do not increase."""


class SparseLogError(LogError):
    """A log lacks too many samples for estimation; models between its channels may still be identified."""


class RigError(HydrostateError):
    """A rig file, or a parameter in it, is not usable."""


class DriveError(HydrostateError):
    """A drive signal exceeds the actuator's limits, or its description is unusable."""


class ModelError(HydrostateError, TypeError):
    """A model's equations cannot be differentiated and compiled; the message says what to write instead."""


class LogWarning(UserWarning):
    """A log was accepted, but the reader should know something about it.

    Parameters
    ----------
    source : str, optional
        The file concerned, which precedes the sentence.
    """

    def __init__(self, note: Note, source: str | None = None) -> None:
        super().__init__(str(note) if source is None else f"{source}: {note}")
        self.note = note
        self.source = source

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (self.note, self.source)


class CovarianceWarning(LogWarning):
    """The covariance of a fitted model is not informative; the model's predictions are not affected."""


def require_known(
    what: str, name: object, known: Iterable[str], error: type[HydrostateError] = HydrostateError
) -> None:
    """Refuse an unknown name.

    Raises
    ------
    HydrostateError
        If the name is not among them.
    """
    names = list(known)
    if name not in names:
        raise error(not_known(what, name, names))


def not_known(what: str, name: object, known: Sequence[str]) -> str:
    """Return the error sentence for an unknown name.

    Returns
    -------
    str
        With all names, and the closest one.

    Examples
    --------
    >>> not_known("plant", "piezo_stack", ["eha", "piezo-stack"])
    "plant must be one of eha, piezo-stack, got 'piezo_stack', did you mean 'piezo-stack'?"
    """
    from difflib import get_close_matches  # imported here, because a correct name does not need it

    near = get_close_matches(str(name), known, n=1)
    hint = f", did you mean {near[0]!r}?" if near else ""
    return f"{what} must be one of {', '.join(known)}, got {name!r}{hint}"


def require_each_known(what: str, names: Sequence[str], known: Sequence[str]) -> None:
    """Refuse names if one of them is unknown or repeated.

    Raises
    ------
    HydrostateError
        If one is not among them, or comes twice.
    """
    for i, name in enumerate(names):
        require_known(what, name, known)
        if name in names[:i]:
            raise HydrostateError(f"{what} must be given once, got {name!r} twice")
