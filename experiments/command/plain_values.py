"""Command line values that need no validator, taken unchanged.

Typer passes every value to pydantic, whose import and adapters take a tenth of a short run. Text, paths, and default
numbers do not need it. This relies on Typer's internals, which may change; then every value is validated as usual.
"""

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any, get_args, get_origin

NO_PLAIN = object()
"""Returned for a value that needs a validator."""

NOT_A_NUMBER = "unable to parse string as a"
"""Part of pydantic's message about text that is not a number, without the text."""

OUT_OF_RANGE = "Input should be "
"""Start of pydantic's message about a number out of range, without the number."""

CONVERTER_ATTRIBUTE = "_runtime_param"
"""Attribute of a Typer parameter that holds its value converter; None until it is first used."""


def accept_plain_values(parameters: Iterable[Any]) -> None:
    """Let parameters of a command accept plain values directly, and use pydantic only for other values.

    Parameters
    ----------
    parameters : iterable of click.Parameter
        These are modified, except those that Typer treats differently.
    """
    with suppress(ImportError):
        from typer._coercion import build_runtime_param  # pyright: ignore[reportPrivateUsage]  there is no other
        from typer._param_types import coerce_cli_path  # pyright: ignore[reportPrivateUsage]

        for parameter in parameters:
            if getattr(parameter, CONVERTER_ATTRIBUTE, NO_PLAIN) is None:
                setattr(parameter, CONVERTER_ATTRIBUTE, _PlainConverter(build_runtime_param, coerce_cli_path))


class _PlainConverter:
    """Converts a parameter's values for a command, as Typer's own converter does."""

    def __init__(self, checked: Any, path: Any) -> None:
        self._checked, self._path = checked, path

    def coerce(self, value: Any, param: Any, ctx: Any) -> Any:
        about = param.type_descriptor
        several = param.multiple or param.nargs == -1
        if value is None:
            return () if several else None
        found = NO_PLAIN if several and isinstance(value, str) else self._plain(value, about.annotation, param, ctx)
        if found is not NO_PLAIN:
            return found
        try:
            return self._checked(about).coerce(value, param=param, ctx=ctx)
        except Exception as error:
            said = str(getattr(error, "message", ""))
            if isinstance(value, str) and NOT_A_NUMBER in said:
                kind = "whole number" if "integer" in said else "number"
                vars(error)["message"] = f"a {kind} is needed, got {value!r}"
            elif isinstance(value, str) and said.startswith(OUT_OF_RANGE):
                vars(error)["message"] = f"must be {said.removeprefix(OUT_OF_RANGE)}, got {value!r}"
            raise

    def _plain(self, value: Any, annotation: Any, param: Any, ctx: Any) -> Any:
        """Return the value unchanged, or `NO_PLAIN`."""
        asked = param.type_descriptor.parameter_info
        if asked.parser is not None or param.type_descriptor.file_annotation is not None:
            return NO_PLAIN
        if get_origin(annotation) is list:
            if not isinstance(value, list | tuple):
                return NO_PLAIN
            found = [self._plain(one, get_args(annotation)[0], param, ctx) for one in value]
            return NO_PLAIN if NO_PLAIN in found else found
        if annotation is Path and isinstance(value, str | Path) and asked.path_type is None:
            return self._path(Path(value), asked, path_type=Path, param=param, ctx=ctx)
        if type(value) is not annotation or annotation not in (str, int, float, bool):
            return NO_PLAIN
        return value if annotation in (str, bool) or _is_within(value, asked.min, asked.max) else NO_PLAIN


def _is_within(value: Any, least: float | None, most: float | None) -> bool:
    return (least is None or value >= least) and (most is None or value <= most)
