"""The rig file: an actuator's parameters, how well they are known, and what its logs call the channels."""

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from difflib import get_close_matches
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from plant.atomic import replacing
from plant.columns import check_columns
from plant.eha import EhaParameters
from plant.errors import RigError
from plant.units import notes

_EXAMPLES: Mapping[str, str] = MappingProxyType(
    {
        "time_s": "T_MS:ms",
        "motor_speed_rad_s": "RPM:rpm",
        "position_m": "POS_MM:mm",
        "velocity_m_s": "VEL_MM_S:mm/s",
        "differential_pressure_pa": "DP_BAR:bar",
        "pressure_a_pa": "PA_BAR:bar",
        "pressure_b_pa": "PB_BAR:bar",
        "motor_voltage_v": "U_MOTOR:V",
    }
)


def _nothing() -> Mapping[str, Any]:
    return MappingProxyType({})


@dataclass(frozen=True)
class Rig:
    """An actuator on its bench.

    Parameters
    ----------
    name : str
        What reports call it.
    parameters : EhaParameters
        Its parameters, SI.
    uncertainties : Mapping[str, float]
        Relative standard deviation by parameter, a fraction, 0.3 for 30 %; a parameter without one is taken as known.
    columns : Mapping[str, str]
        Foreign log columns by channel: ``{"position_m": "POS_MM:mm"}``.

    Raises
    ------
    RigError
        If an uncertainty is of no parameter or negative, or a column's channel or unit is unknown.

    Examples
    --------
    >>> Rig("bench 2", EhaParameters(piston_area=3.04e-3), {"bulk_modulus": 0.3}).parameters.piston_area
    0.00304
    """

    name: str = "paper"
    parameters: EhaParameters = field(default_factory=EhaParameters)
    uncertainties: Mapping[str, float] = field(default_factory=_nothing)
    columns: Mapping[str, str] = field(default_factory=_nothing)

    def __post_init__(self) -> None:
        _known(self.uncertainties, _parameter_names(), "uncertainty")
        for name, value in self.uncertainties.items():
            if not 0.0 <= value < float("inf"):
                raise RigError(f"uncertainty.{name} must be 0 or more and finite, got {value!r}")
        object.__setattr__(self, "uncertainties", MappingProxyType(dict(self.uncertainties)))
        object.__setattr__(self, "columns", MappingProxyType(check_columns(self.columns)))

    def __reduce__(self) -> tuple[object, ...]:
        return Rig, (self.name, self.parameters, dict(self.uncertainties), dict(self.columns))


Strict = Annotated[float, Field(strict=True)]


class _RigFile(BaseModel):
    """What a rig file may hold."""

    model_config = ConfigDict(extra="forbid")

    name: Annotated[str, Field(strict=True)] = "rig"
    parameters: dict[str, Strict] = {}
    uncertainty: dict[str, Strict] = {}
    columns: dict[str, Annotated[str, Field(strict=True)]] = {}


def read_rig(path: str | Path) -> Rig:
    """Read a rig file; a parameter that it leaves out keeps the paper's value.

    Parameters
    ----------
    path : str or Path
        A TOML file as `rig_template` writes it.

    Returns
    -------
    Rig
        The rig.

    Raises
    ------
    RigError
        If the file cannot be read or is no TOML, or an entry is unknown, of the wrong kind, or out of range.
    """
    path = Path(path)
    try:
        content = tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except OSError as error:
        raise RigError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise RigError(f"{path}: a TOML file is wanted: {error}") from error
    try:
        return _rig(content)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        wanted = first["msg"].removeprefix("Input should be ")
        raise RigError(f"{path}: {where} must be {wanted}, got {first['input']!r}") from error
    except RigError as error:
        raise RigError(f"{path}: {error}") from error


def _rig(content: Mapping[str, Any]) -> Rig:
    _known(content, _RigFile.model_fields, "")
    file = _RigFile.model_validate(content)
    _known(file.parameters, _parameter_names(), "parameters")
    return Rig(file.name, EhaParameters(**file.parameters), file.uncertainty, file.columns)


def _parameter_names() -> list[str]:
    return [one.name for one in fields(EhaParameters)]


def _known(given: Iterable[str], known: Iterable[str], section: str) -> None:
    names = list(known)
    for name in given:
        if name not in names:
            near = get_close_matches(name, names, n=1)
            hint = f"did you mean {near[0]!r}?" if near else f"wanted one of {', '.join(names)}"
            raise RigError(f"{f'{section}.{name}' if section else name} is unknown, {hint}")


def rig_template() -> str:
    """Return a commented rig file that describes the paper's actuator, in TOML.

    Returns
    -------
    str
        The text; `read_rig` makes `EhaParameters()` of it.

    Examples
    --------
    >>> print(rig_template().splitlines()[0])
    # A rig: an actuator's parameters, how well they are known, and what its logs call the channels.
    """
    parameters = EhaParameters()
    lines = [
        "# A rig: an actuator's parameters, how well they are known, and what its logs call the channels.",
        "# All values are SI. A parameter that is left out keeps the value shown here.",
        "",
        'name = "paper"',
        "",
        "[parameters]",
    ]
    for name, note in notes(EhaParameters).items():
        lines.append(f"# {note.meaning} [{note.unit}]; source: {note.source}")
        lines.append(f"{name} = {getattr(parameters, name)!r}")
    lines += [
        "",
        "[uncertainty]",
        "# Relative standard deviation of a parameter: 0.3 is 30 %. What is not named is taken as known.",
        "# bulk_modulus = 0.3",
        "",
        "[columns]",
        '# Log columns under other names, with their unit after a colon: channel = "NAME:UNIT".',
    ]
    lines += [f'# {channel} = "{example}"' for channel, example in _EXAMPLES.items()]
    return "\n".join(lines) + "\n"


def write_rig_template(path: str | Path) -> None:
    """Write the commented rig file of the paper's actuator, unless a file of that name is there.

    Parameters
    ----------
    path : str or Path
        Where to.

    Raises
    ------
    RigError
        If the file exists or cannot be written.
    """
    path = Path(path)
    if path.exists() or path.is_symlink():
        raise RigError(f"{path}: there is such a file already, and it is not overwritten")
    try:
        with replacing(path) as file:
            file.write(rig_template().encode())
    except OSError as error:
        raise RigError(f"{path}: cannot be written: {error.strerror or error}") from error
