"""Tables by name, single numbers from them, and the table of a rig's parameters."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, fields
from functools import wraps
from typing import Any, ParamSpec, SupportsFloat, TypeAlias, cast

import pandas as pd

from plant.units import notes

Tables: TypeAlias = Mapping[str, pd.DataFrame]

Rows: TypeAlias = Iterator[Mapping[str, Any]]
"""The rows of a table, by column."""

Frames: TypeAlias = Iterator[Mapping[str, Any] | pd.DataFrame]
"""The parts of a table, each as its columns or as a table."""

P = ParamSpec("P")


def as_table(rows: Callable[P, Rows]) -> Callable[P, pd.DataFrame]:
    """Decorate a function that yields rows, so that it returns them as a table."""

    @wraps(rows)
    def made(*args: P.args, **kwargs: P.kwargs) -> pd.DataFrame:
        return pd.DataFrame(list(rows(*args, **kwargs)))

    return made


def as_stacked_table(parts: Callable[P, Frames]) -> Callable[P, pd.DataFrame]:
    """Decorate a function that yields parts of a table, so that it returns them stacked into one."""

    @wraps(parts)
    def made(*args: P.args, **kwargs: P.kwargs) -> pd.DataFrame:
        return pd.concat(map(pd.DataFrame, parts(*args, **kwargs)), ignore_index=True)

    return made


def cell(frame: pd.DataFrame, row: object, column: str) -> float:
    """Return one number of a table.

    Parameters
    ----------
    frame : pandas.DataFrame
        A table with unique row labels.

    Returns
    -------
    float
        The number, in the column's unit.

    Examples
    --------
    >>> cell(pd.DataFrame({"speed_rpm": [1200]}, index=["rated"]), "rated", "speed_rpm")
    1200.0
    """
    return float(cast("SupportsFloat", frame.at[row, column]))


@as_table
def parameter_table(parameters: Any) -> Rows:
    """Return parameters with the notes given in the code.

    Parameters
    ----------
    parameters : dataclass
        A rig whose fields carry `plant.units.SI` notes.

    Returns
    -------
    pandas.DataFrame
        One row per parameter: parameter, value, unit, meaning, source.
    """
    noted = notes(type(parameters))
    for field in fields(parameters):
        yield {"parameter": field.name, "value": getattr(parameters, field.name), **asdict(noted[field.name])}
