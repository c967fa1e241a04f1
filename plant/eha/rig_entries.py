"""Schema of a rig file, checked by pydantic, which is needed only to read a rig file."""

from collections.abc import Generator, Mapping
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from plant.errors import RigError
from plant.small_file import entry_text


def path_of_rig(given: object) -> Path:
    """Return the path of a rig file.

    Raises
    ------
    RigError
        If it is no path.
    """
    if not isinstance(given, str | PathLike):
        raise RigError(f"the path of a rig file is needed, got {given!r:.80}")
    return Path(given)  # pyright: ignore[reportUnknownArgumentType] -- of text, or refused by Path


Strict = Annotated[float, Field(strict=True)]


class RigEntries(BaseModel):
    """Schema of a rig file.

    Parameters
    ----------
    name, plant : str
        Name of the rig in reports, and the kind of actuator.
    measured : tuple of str
        Entries that were measured on the bench.
    parameters : dict
        By name [SI]; `numbers_of` checks them.
    uncertainty : dict
        Relative standard deviation by parameter [fraction].
    columns : dict
        Foreign log columns by channel.
    """

    model_config = ConfigDict(extra="forbid")

    name: Annotated[str, Field(strict=True)] = "rig"
    plant: Annotated[str, Field(strict=True)] | None = None
    measured: tuple[Annotated[str, Field(strict=True)], ...] = ()
    parameters: dict[str, Any] = {}
    uncertainty: dict[str, Strict] = {}
    columns: dict[str, Annotated[str, Field(strict=True)]] = {}


def numbers_of(given: Mapping[str, Any], parameter_class: type[Any]) -> dict[str, Any]:
    """Return the parameters that a file gives as numbers, or as rows of numbers if the class has rows.

    Parameters
    ----------
    given : Mapping[str, Any]
        Entries of the file.
    parameter_class : type
        Class of the parameters.

    Returns
    -------
    dict[str, Any]
        The same names, checked [SI].
    """
    rows = {name: isinstance(getattr(parameter_class, name, None), tuple) for name in given}
    kinds: dict[str, Any] = {name: (tuple[Strict, ...] if row else Strict, ...) for name, row in rows.items()}
    wanted = create_model("Wanted", parameters=(create_model("Parameters", **kinds), ...))
    return wanted.model_validate({"parameters": given}).model_dump()["parameters"]


@contextmanager
def type_errors_as_rig_errors() -> Generator[None]:
    """Raise our error if an entry of a rig file has the wrong type.

    Raises
    ------
    RigError
        The message names the entry, its required type, and its actual type.
    """
    try:
        yield
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        wanted = first["msg"].removeprefix("Input should be ").replace("a valid tuple", "a list in square brackets")
        wanted += " (a fraction: 0.15 is 15 %)" if first["loc"][0] == "uncertainty" and len(first["loc"]) > 1 else ""
        raise RigError(f"{where} must be {wanted}, got {entry_text(first['input'])}") from error
