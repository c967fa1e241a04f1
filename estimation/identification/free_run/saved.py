"""Saved models, one file for all outputs of a log: what `hydrostate identify --out` writes, read back."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from estimation.identification.free_run.model import FORMAT, FreeRunModel
from plant.atomic import replacing
from plant.errors import HydrostateError


def save_models(models: Sequence[FreeRunModel], path: str | Path) -> None:
    """Write models as JSON, completely or not at all.

    Raises
    ------
    HydrostateError
        If the file cannot be written.
    """
    try:
        with replacing(Path(path)) as file:
            file.write((json.dumps([one.to_dict() for one in models], indent=1) + "\n").encode())
    except OSError as error:
        raise HydrostateError(f"the model cannot be written: {error.strerror or error}", str(path)) from error


def load_models(path: str | Path) -> list[FreeRunModel]:
    """Return the models of a file that `save_models` or the command line wrote.

    Parameters
    ----------
    path : str or Path
        JSON.

    Raises
    ------
    HydrostateError
        If the file cannot be read or holds no such model.
    """
    try:
        content = json.loads(Path(path).read_text())
    except OSError as error:
        raise HydrostateError(f"the model cannot be read: {error.strerror or error}", str(path)) from error
    except ValueError as error:
        raise HydrostateError(f"a model in JSON is needed: {error}", str(path)) from error
    entries: list[Any] = content if isinstance(content, list) else [content]
    kept = [found for one in entries if isinstance(one, Mapping) and (found := _entry(one)) is not None]
    if not kept:
        raise HydrostateError(
            "the file holds no saved model; write one with hydrostate identify --input U --output Y --out MODEL.json",
            str(path),
        )
    return [FreeRunModel.from_dict(one) for one in kept]


def _entry(values: Mapping[str, Any]) -> Mapping[str, Any] | None:
    if values.get("format") == FORMAT:
        return values
    inner = values.get("model")
    return inner if isinstance(inner, Mapping) and inner.get("format") == FORMAT else None
