"""Operating system errors as sentences for the user."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from plant.errors import HydrostateError


@contextmanager
def os_errors_as(said: str) -> Generator[None]:
    """Turn an operating system error in this block into an error that starts with the given words."""
    try:
        yield
    except OSError as error:
        raise HydrostateError(f"{said}: {reason_of(error)}") from error


def reason_of(error: OSError) -> str:
    """Return why the system refused, and what to do if a file has the name of the required folder.

    Examples
    --------
    >>> reason_of(NotADirectoryError(20, "Not a directory"))
    'Not a directory'
    """
    if isinstance(error, NotADirectoryError | FileExistsError) and isinstance(error.filename, str | Path):
        path = Path(error.filename)
        in_the_way = next((one for one in (path, *path.parents) if one.exists()), path)
        if not in_the_way.is_dir():
            return f"{in_the_way} is a file, and a folder is needed there: choose another name, or move the file"
    return error.strerror or str(error)
