"""Libraries that only some formats need. They are imported when such a file is read, and named if they are missing."""

import logging
from importlib import import_module
from typing import Any

from plant.errors import LogError


def library(name: str, kind: str, source: str) -> Any:
    """Return a library that reads one format.

    Parameters
    ----------
    name : str
        As it is imported.
    kind : str
        What the files are called.
    source : str
        The file, for the message.

    Raises
    ------
    LogError
        If it is not installed; it says what installs it.

    Examples
    --------
    >>> library("no_such_reader", "TDMS", "a.tdms")
    Traceback (most recent call last):
    plant.errors.LogError: a.tdms: TDMS files need no_such_reader: pip install 'hydrostate[bench]'
    """
    try:
        found = import_module(name)
        for logger in list(logging.root.manager.loggerDict):
            if logger.split(".")[0] == name:  # our own message says what is wrong with a damaged file
                logging.getLogger(logger).setLevel(logging.CRITICAL + 1)
        return found
    except ImportError as error:
        raise LogError(f"{kind} files need {name}: pip install 'hydrostate[bench]'", source) from error
