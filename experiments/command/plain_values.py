"""Values of the command line that need no validator, taken as they are.

Typer hands every value to pydantic, whose import and adapters are a tenth of a short run. A text, a path, and a number
that is a default need none of it. How Typer does so is its own affair and may change: then all goes its usual way.
"""

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any, get_args, get_origin

NO_PLAIN = object()
"""What is given back for a value that a validator has to see."""

UNPARSED = "unable to parse string as a"
"""What pydantic says of a text that is no number, without the text."""

OUTSIDE = "Input should be "
"""How pydantic begins what it says of a number that is out of range, without the number."""

ITS_PLACE = "_runtime_param"
"""Where a parameter of Typer keeps what turns values into what a command takes; None until it is asked for."""


def take_plainly(parameters: Iterable[Any]) -> None:
    """Let parameters of a command take plain values as they are, and ask pydantic of others alone.

    Parameters
    ----------
    parameters : iterable of click.Parameter
        They are changed, but for those that Typer treats in another way.
    """
    with suppress(ImportError):
        from typer._coercion import build_runtime_param  # pyright: ignore[reportPrivateUsage]  there is no other
        from typer._param_types import coerce_cli_path  # pyright: ignore[reportPrivateUsage]

        for parameter in parameters:
            if getattr(parameter, ITS_PLACE, NO_PLAIN) is None:
                setattr(parameter, ITS_PLACE, _Taken(build_runtime_param, coerce_cli_path))


class _Taken:
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
            if isinstance(value, str) and UNPARSED in said:
                kind = "whole number" if "integer" in said else "number"
                vars(error)["message"] = f"a {kind} is needed, got {value!r}"
            elif isinstance(value, str) and said.startswith(OUTSIDE):
                vars(error)["message"] = f"must be {said.removeprefix(OUTSIDE)}, got {value!r}"
            raise

    def _plain(self, value: Any, annotation: Any, param: Any, ctx: Any) -> Any:
        """Return a value as it is taken, or `NO_PLAIN`."""
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
        return value if annotation in (str, bool) or _within(value, asked.min, asked.max) else NO_PLAIN


def _within(value: Any, least: float | None, most: float | None) -> bool:
    return (least is None or value >= least) and (most is None or value <= most)
