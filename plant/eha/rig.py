"""The rig file: an actuator's parameters, their uncertainties, and the names of the channels in its logs.

A rig may be of any kind of actuator: its parameters are a frozen dataclass whose fields carry `SI` notes.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from types import MappingProxyType
from typing import Any, Generic

from typing_extensions import TypeVar

from plant.atomic import replacing
from plant.eha.doubts import Spread, default_uncertainties, spreads_of
from plant.eha.model import PAIRS, SIZED_BY_PUMP, VOLUME_SHARE, EhaParameters
from plant.errors import RigError
from plant.log.columns import check_columns
from plant.small_file import small_toml
from plant.units import notes

_EXAMPLES: Mapping[str, str] = {
    "time_s": "T_MS:ms",
    "motor_speed_rad_s": "RPM:rpm",
    "position_m": "POS_MM:mm",
    "velocity_m_s": "VEL_MM_S:mm/s",
    "differential_pressure_pa": "DP_BAR:bar",
    "pressure_a_pa": "PA_BAR:bar",
    "pressure_b_pa": "PB_BAR:bar",
    "motor_voltage_v": "U_MOTOR:V",
}

EHA = "eha"
"""Name of the gear-pump actuator in a rig file; a file without a plant is read as the kind that is required."""

UNNAMED = "paper"
"""Name of the rig if there is no rig file, and of a rig file until its owner gives another."""

MOST_UNCERTAIN = 2.0
"""Largest relative standard deviation [fraction]: a larger one means that the value is unknown, or that a percentage
was given as a fraction. For 1 and 2 that cannot be decided."""

UNEQUAL_SIDES = (*PAIRS.values(), "pilot_share")
"""Entries that two numbers for sides A and B set: a template has them as comments, so that they do not contradict."""

P = TypeVar("P", default=EhaParameters)

SIZED = f",\n# except {' and '.join(SIZED_BY_PUMP)}, which then go with the pump's flow."
"""Remark in the template on omitted entries."""


@dataclass(frozen=True)
class Rig(Generic[P]):
    """An actuator on its bench.

    Parameters
    ----------
    name : str
        Name in reports.
    parameters : dataclass
        Its parameters, SI; the paper's gear-pump actuator by default. If a file omits the conductances of the valves,
        they are sized by its pump; given here, they are not changed (`plant.eha.scales.with_valves_sized`).
    uncertainties : Mapping[str, float]
        Relative standard deviation by parameter, a fraction, 0.3 for 30 %, or of the `pressure_gain`; the default is
        that of `plant.eha.doubts.DEFAULT_UNCERTAINTIES`.
    columns : Mapping[str, str]
        Foreign log columns by channel: ``{"position_m": "POS_MM:mm"}``.
    measured : tuple of str
        Entries that were measured on the bench, whose default uncertainty is smaller.
    plant : str or None
        Kind of actuator as which its file was read; None for a rig without a file.

    Raises
    ------
    RigError
        If name or parameters are of another type, if an uncertainty is negative or of an unknown entry, if a measured
        entry has no default uncertainty or has an own uncertainty as well, if either is given for an entry without a
        value, or if a column's channel or unit is unknown.

    Examples
    --------
    >>> Rig("bench 2", EhaParameters(piston_area=3.04e-3), {"bulk_modulus": 0.3}).parameters.piston_area
    0.00304
    """

    name: str = UNNAMED
    parameters: P = field(default_factory=EhaParameters)  # pyright: ignore[reportAssignmentType] -- P's own default
    uncertainties: Mapping[str, float] = field(default_factory=dict[str, float])
    columns: Mapping[str, str] = field(default_factory=dict[str, str])
    measured: tuple[str, ...] = ()
    plant: str | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not is_dataclass(self.parameters):  # pyright: ignore -- a user's slip
            raise RigError(f"a rig is Rig(name, parameters), got {self.name!r:.40} and {self.parameters!r:.40}")
        doubted = default_uncertainties(self.parameters)
        _require_known(self.uncertainties, dict.fromkeys((*_names(type(self.parameters)), *doubted)), "uncertainty")
        _require_known(self.measured, doubted, "measured")
        for name in (*self.measured, *self.uncertainties):
            if getattr(self.parameters, name, 1.0) is None:
                raise RigError(f"{name} is said to be known, and has no value: give it below [parameters]")
        for name, value in self.uncertainties.items():
            if not 0.0 <= value <= MOST_UNCERTAIN:
                raise RigError(
                    f"uncertainty.{name} must be 0 or more and at most {MOST_UNCERTAIN:g} (a fraction: 0.05 is 5 %), "
                    f"got {value!r}"
                )
            if name in self.measured:
                raise RigError(f"uncertainty.{name} and measured both say how well it is known, give one")
        object.__setattr__(self, "uncertainties", MappingProxyType(dict(self.uncertainties)))
        object.__setattr__(self, "columns", MappingProxyType(check_columns(self.columns)))

    def __reduce__(self) -> tuple[object, ...]:
        own = (dict(self.uncertainties), dict(self.columns), self.measured, self.plant)
        return Rig, (self.name, self.parameters, *own)

    @property
    def spreads(self) -> Mapping[str, Spread]:
        """Uncertainty of each entry: that of the rig file, else the default."""
        return spreads_of(default_uncertainties(self.parameters), self.uncertainties, self.measured)


def read_rig(path: str | Path, parameter_class: type[Any] = EhaParameters, plant: str = EHA) -> Rig[Any]:
    """Read a rig file; omitted entries keep their default, and the template's name is replaced by the file's name.

    Parameters
    ----------
    path : str or Path
        A TOML file in the format of `rig_template`.
    parameter_class : type
        Class of the required actuator's parameters.
    plant : str
        Name of that kind of actuator.

    Raises
    ------
    RigError
        If the file cannot be read or is not TOML, is of another kind of actuator, or an entry is unknown, of the wrong
        type, out of range, or of a size that no actuator has in SI.
    """
    from plant.eha.rig_entries import path_of_rig, type_errors_as_rig_errors

    content = _read_content(path_of_rig(path))
    try:
        with type_errors_as_rig_errors():
            found = _rig(content, parameter_class, plant)
        own = found.name == UNNAMED and found.parameters != parameter_class()
        return replace(found, name=Path(path).stem) if own else found
    except RigError as error:
        raise RigError(f"{path}: {error}") from error


def plant_of(path: str | Path) -> str | None:
    """Return the kind of actuator that a rig file names.

    Returns
    -------
    str or None
        Its ``plant``; None if it names none.

    Raises
    ------
    RigError
        If the file cannot be read or is not TOML.
    """
    plant = _read_content(Path(path)).get("plant")
    return plant if isinstance(plant, str) else None


def _read_content(path: Path) -> dict[str, Any]:
    try:
        return small_toml(path)
    except OSError as error:
        hint = "; `hydrostate rig init` writes one to fill in" if isinstance(error, FileNotFoundError) else ""
        raise RigError(f"{path}: cannot be read as a rig file: {error.strerror or error}{hint}") from error
    except ValueError as error:
        raise RigError(f"{path}: a rig file (TOML) is needed: {error}") from error


def _rig(content: Mapping[str, Any], parameter_class: type[Any], plant: str) -> Rig[Any]:
    from plant.eha.rig_entries import RigEntries, numbers_of
    from plant.eha.rig_quantities import numbers_with_units
    from plant.eha.rig_units import require_si
    from plant.eha.scales import with_valves_sized

    if misplaced := [name for name in content if name in _names(parameter_class)]:
        raise RigError(f"{misplaced[0]} must stand below a line [parameters]")
    _require_on_top(content)
    _require_known(content, RigEntries.model_fields, "")
    file = RigEntries.model_validate(content)
    if file.plant not in (None, plant):
        raise RigError(f"a rig of plant {plant!r} is needed here, got one of {file.plant!r}")
    _require_known(file.parameters, _names(parameter_class), "parameters")
    given = numbers_with_units(file.parameters, {name: one.unit for name, one in notes(parameter_class).items()})
    values = numbers_of(_without_pairs(given, _pairs_of(parameter_class)), parameter_class)
    parameters = parameter_class(**values)
    if isinstance(parameters, EhaParameters):
        parameters = with_valves_sized(parameters, values)
        require_si(parameters)
    return Rig(file.name, parameters, file.uncertainty, file.columns, file.measured, plant)


def _require_on_top(content: Mapping[str, Any]) -> None:
    """Refuse an entry of the whole file that stands below a section's line, since TOML makes it part of the section."""
    for section in ("parameters", "uncertainty", "columns"):
        entries = content.get(section)
        for name in ("name", "plant", "measured"):
            if isinstance(entries, dict) and name in entries:
                raise RigError(f"{name} must stand above the first line in square brackets, got it below [{section}]")


def _pairs_of(parameter_class: type[Any]) -> Mapping[str, str]:
    return PAIRS if issubclass(parameter_class, EhaParameters) else {}


def _without_pairs(given: Mapping[str, Any], pairs: Mapping[str, str]) -> dict[str, Any]:
    """Return a file's values; pairs for sides A and B become mean and relative difference, volumes go with areas."""
    values = dict(given)
    for name, difference in pairs.items():
        pair = given.get(name)
        if not isinstance(pair, list):
            continue
        if difference in given:
            raise RigError(
                f"parameters.{name} gives two numbers, which say {difference} too: remove the line of {difference}"
            )
        if len(pair) != 2 or not all(type(one) in (int, float) and 0.0 < one < float("inf") for one in pair):
            raise RigError(f"parameters.{name} must be a positive number, or two for sides A and B, got {pair!r}")
        side_a, side_b = pair
        values |= {name: 0.5 * (side_a + side_b), difference: (side_a - side_b) / (side_a + side_b)}
        if name == "piston_area" and side_a != side_b:
            values = {"pilot_share": 1.0, "volume_difference": VOLUME_SHARE * values[difference], **values}
    return values


def _names(parameter_class: type[Any]) -> list[str]:
    return [one.name for one in fields(parameter_class)]


def _require_known(given: Iterable[str], known: Iterable[str], section: str) -> None:
    names = list(known)
    for name in given:
        if name not in names:
            near = get_close_matches(name, names, n=1)
            hint = f"did you mean {near[0]!r}?" if near else f"wanted one of {', '.join(names) or 'none'}"
            raise RigError(f"{f'{section}.{name}' if section else name} is unknown, {hint}")


def rig_template(
    parameter_class: type[Any] = EhaParameters, plant: str = EHA, columns: Mapping[str, str] = _EXAMPLES
) -> str:
    """Return a commented rig file that describes an actuator with default parameters, in TOML.

    Parameters
    ----------
    parameter_class : type
        Class of the parameters; the paper's gear-pump actuator by default.
    plant : str
        Name of the kind of actuator.
    columns : Mapping[str, str]
        An example of a foreign column by channel.

    Returns
    -------
    str
        The text; `read_rig` reads it as default parameters.

    Examples
    --------
    >>> print(rig_template().splitlines()[0])
    # A rig file: an actuator's parameters, how well each is known, and the names of the columns in its logs.
    """
    parameters = parameter_class()
    lines = [
        "# A rig file: an actuator's parameters, how well each is known, and the names of the columns in its logs.",
        "# All values are those of the healthy actuator, in SI, or with a unit in quotes as a nameplate has them: "
        + ('"3.5 cm^3/rev", "160 bar".' if parameter_class is EhaParameters else '"160 bar".'),
        "# A parameter that is left out keeps the value shown here"
        + (SIZED if parameter_class is EhaParameters else "."),
        "",
        *([f'name = "{UNNAMED}"'] if plant == EHA else [f'name = "{plant}"', f'plant = "{plant}"']),
        *(
            [
                "# Parameters that you measured on the bench; they get the smaller uncertainty that is given below.",
                "# measured = []",
            ]
            if default_uncertainties(parameter_class)
            else []
        ),
        "",
        "[parameters]",
    ]
    pairs = _pairs_of(parameter_class)
    for name, note in notes(parameter_class).items():
        value = getattr(parameters, name)
        if name in pairs:
            lines.append(f"# two numbers where sides A and B differ: {name} = [A, B]")
        lines.append(f"# {note.meaning} [{note.unit}]; source: {note.source}")
        known = list(value) if isinstance(value, tuple) else value
        left_out = pairs and name in (*UNEQUAL_SIDES, *SIZED_BY_PUMP)
        lines.append(f"# {name} = NUMBER" if known is None else f"{'# ' if left_out else ''}{name} = {known!r}")
    lines += [
        "",
        *_uncertainty_lines(parameter_class),
        "",
        "[columns]",
        '# Names of the columns in your logs, with the unit after a colon: channel = "NAME:UNIT".',
    ]
    lines += [f'# {channel} = "{example}"' for channel, example in columns.items()]
    return "\n".join(lines) + "\n"


def _uncertainty_lines(parameter_class: type[Any]) -> list[str]:
    """Return the section of the uncertainties: defaults as comments, each with its reason."""
    doubts = default_uncertainties(parameter_class)
    said = "has the default shown here" if doubts else "is taken as exact"
    lines = [
        "[uncertainty]",
        f"# Relative standard deviation of a parameter: 0.3 is 30 %. A parameter that is not listed {said}.",
    ]
    for name, doubt in doubts.items():
        down, up = doubt.usual
        sides = f"{down:g} down, {up:g} up" if down != up else f"{up:g}"
        lines += [f"# {name}: {sides}, {doubt.measured.up:g} if measured;", f"#   {doubt.reason}"]
    return [*lines, f"# {'chamber_volume' if doubts else next(iter(notes(parameter_class)))} = 0.3"]


def write_rig_template(path: str | Path, template: str | None = None) -> None:
    """Write a commented rig file, unless a file of that name exists.

    Parameters
    ----------
    path : str or Path
        The file to write.
    template : str, optional
        A text from `rig_template`; that of the paper's actuator if not given.

    Raises
    ------
    RigError
        If the file exists or cannot be written.
    """
    if (path := Path(path)).exists() or path.is_symlink():
        raise RigError(f"{path}: the file exists already and is not overwritten; give another name")
    try:
        with replacing(path) as file:
            file.write((rig_template() if template is None else template).encode())
    except OSError as error:
        raise RigError(f"{path}: cannot be written: {error.strerror or error}") from error
