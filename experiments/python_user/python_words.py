"""Errors of the command line rephrased for Python: arguments instead of options."""

import re
from collections.abc import Generator
from contextlib import contextmanager


@contextmanager
def options_by_name() -> Generator[None]:
    """Rename options in errors to the names known in Python: ``start_std`` instead of ``--start-std``.

    Raises
    ------
    HydrostateError
        The error raised in the block, with its options renamed.
    """
    from plant.errors import HydrostateError

    try:
        yield
    except HydrostateError as error:
        error.message = in_python(error.message)
        error.args = (error.message if error.source is None else f"{error.source}: {error.message}",)
        raise


_OPTION = re.compile(r"(?<![\w-])--([a-z][a-z-]*)")
"""An option in command line form."""

_VALUE = re.compile(r"(?<![\w-])--([a-z][a-z-]*) ([A-Z]+)\b")
"""An option with the name of its value."""

_COLUMNS = re.compile(r"--columns '([^']*)'")
"""Columns as suggested by an error for the command line."""

ELSEWHERE = {"--with FILE": "beside=FILE", "--rig rig.toml": "rig='rig.toml'"}
"""Options that have another name in Python, or a value in quotes."""


def in_python(said: str) -> str:
    """Return a sentence with options renamed for Python users; commands in backticks stay unchanged.

    Examples
    --------
    >>> in_python("give --start-std, or `hydrostate rig init --force`; perhaps --columns 'position_m=Weg [mm]:mm'")
    "give start_std, or `hydrostate rig init --force`; perhaps columns={'position_m': 'Weg [mm]:mm'}"
    >>> in_python("--sample-time S takes the rows as evenly spaced")
    'sample_time=S takes the rows as evenly spaced'
    """
    parts = said.split("`")
    for place in range(0, len(parts), 2):
        text = _COLUMNS.sub(lambda found: f"columns={_mapping(found[1])}", parts[place])
        for option, argument in ELSEWHERE.items():
            text = text.replace(option, argument)
        text = _VALUE.sub(lambda found: f"{found[1].replace('-', '_')}={found[2]}", text)
        parts[place] = _OPTION.sub(lambda found: found[1].replace("-", "_"), text)
    return "`".join(parts)


def _mapping(option: str) -> dict[str, str]:
    """Return columns in the form that `read` takes; a comma inside a name does not start a new channel."""
    pairs = re.split(r",(?=[a-z0-9_]+=)", option)
    return {channel: name for channel, _, name in (pair.partition("=") for pair in pairs)}
