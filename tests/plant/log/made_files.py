"""Helpers that read a file and return the result, or the text of the refusal."""

import tempfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from plant.errors import HydrostateError
from plant.log.formats.mat_reader import DamagedMatError


def or_refused(made: Any) -> Any:
    try:
        return made()
    except (HydrostateError, DamagedMatError, ValueError, zlib.error) as error:
        return f"{type(error).__name__}: {str(error).rpartition('/')[2][:70]}"


def in_a_file(content: bytes, of: Callable[[Path], Any], name: str = "log") -> Any:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_bytes(content)
        return or_refused(lambda: of(path))
