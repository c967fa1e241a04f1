"""Errors of the command in the words of Python: arguments in place of options."""

import re
from collections.abc import Generator
from contextlib import contextmanager


@contextmanager
def options_by_name() -> Generator[None]:
    """Give options in errors the names that Python users know them by: ``start_std`` in place of ``--start-std``.

    Raises
    ------
    HydrostateError
        The same as within, with its options renamed.
    """
    from plant.errors import HydrostateError

    try:
        yield
    except HydrostateError as error:
        error.message = in_python(error.message)
        error.args = (error.message if error.source is None else f"{error.source}: {error.message}",)
        raise


_OPTION = re.compile(r"(?<![\w-])--([a-z][a-z-]*)")
"""An option as the command spells it."""

_COLUMNS = re.compile(r"--columns '([^']*)'")
"""Columns as an error offers them for the command line."""

ELSEWHERE = {"--with FILE": "beside=FILE", "--rig rig.toml": "rig='rig.toml'"}
"""Options that Python calls otherwise, or gives a value in quotes."""


def in_python(said: str) -> str:
    """Return a sentence with its options as Python users know them; a command in backticks stays as it is.

    Examples
    --------
    >>> in_python("give --start-std, or `hydrostate rig init --force`; perhaps --columns 'position_m=Weg [mm]:mm'")
    "give start_std, or `hydrostate rig init --force`; perhaps columns={'position_m': 'Weg [mm]:mm'}"
    """
    parts = said.split("`")
    for place in range(0, len(parts), 2):
        text = _COLUMNS.sub(lambda found: f"columns={_mapping(found[1])}", parts[place])
        for option, argument in ELSEWHERE.items():
            text = text.replace(option, argument)
        parts[place] = _OPTION.sub(lambda found: found[1].replace("-", "_"), text)
    return "`".join(parts)


def _mapping(option: str) -> dict[str, str]:
    """Return columns as `read` takes them; a comma within a name begins no channel."""
    pairs = re.split(r",(?=[a-z0-9_]+=)", option)
    return {channel: name for channel, _, name in (pair.partition("=") for pair in pairs)}
