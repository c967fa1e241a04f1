"""Options shared by several commands, each defined once."""

import math
import re
from collections.abc import Collection, Mapping, Sequence
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from plant.errors import HydrostateError

if TYPE_CHECKING:
    from experiments.actuator_kind import ActuatorKind
    from plant.eha.rig import Rig


def option(metavar: str, said: str, *names: str, **more: Any) -> Any:
    """Return a command line option that takes a value, with its help text."""
    return typer.Option(*names, metavar=metavar, help=said, **more)


def flag(names: str, said: str) -> Any:
    """Return a command line flag, with its help text."""
    return typer.Option(names, help=said)


def argument(metavar: str, said: str) -> Any:
    """Return a command line argument, with its help text."""
    return typer.Argument(metavar=metavar, help=said, show_default=False)


Logs: TypeAlias = Annotated[
    list[Path],
    argument(
        "LOG",
        "Logs: text with any delimiter, Parquet, Feather, MAT; with hydrostate[bench] XLSX, TDMS, MDF, HDF5. They need "
        "time_s, motor_speed_rad_s, and position_m or velocity_m_s; differential_pressure_pa is optional. A name may "
        "carry another unit (position_mm, motor_speed_rpm). For other names, start with `hydrostate inspect`.",
    ),
]
Json: TypeAlias = Annotated[
    bool,
    flag(
        "--json",
        "Print the results as a JSON list, one object per log if the verb reads logs; notes go to standard error.",
    ),
]
Out: TypeAlias = Annotated[
    Path | None,
    option(
        "DIR",
        "Also write results.json and results.csv into this folder; or, if the name ends in .json, that file alone.",
        "--out",
        "-o",
    ),
]
Report: TypeAlias = Annotated[
    Path | None, option("FILE", "Write a page (HTML); several logs get one page each.", "--report", "--html")
]
Seed: TypeAlias = Annotated[int, option("INT", "Seed of the random numbers; stored in the results.", min=0)]
RigFile: TypeAlias = Annotated[
    Path | None,
    option(
        "FILE",
        "Rig file (TOML): parameters of your actuator in SI, and the names of the columns; `hydrostate rig init` "
        "writes one. Without it, the paper's actuator is assumed.",
    ),
]
Columns: TypeAlias = Annotated[
    list[str] | None,
    option(
        "CHANNEL=NAME:UNIT",
        "The name of a channel's column, with its unit if it is not SI: position_m=POS_MM:mm, or a sensor's scale: "
        "position_m=CH2:20 mm/V. Repeat the option, or separate several by commas.",
    ),
]
SampleTime: TypeAlias = Annotated[
    float | None,
    option("S", "Time between rows [s], for a log without a time column, or with times that do not increase."),
]
Beside: TypeAlias = Annotated[
    list[Path] | None,
    option(
        "FILE",
        "A second logger's file of the same test, to be merged with the log. Repeat the option for more.",
        "--with",
    ),
]
ConditionName: TypeAlias = Annotated[
    str | None, option("NAME", "Name of a condition; `hydrostate conditions` lists them.")
]

Plant: TypeAlias = Annotated[
    str | None,
    option(
        "PLANT",
        "Kind of actuator: eha (gear pump); piezo-stack (logs start at rest, with drive_voltage_v and any of "
        "stack_displacement_m, stack_force_n, position_m, chamber_pressure_pa); diaphragm-motor (logs under a steady "
        "sine, with drive_voltage_v, electrode_1_v to electrode_7_v, position_m). Options that name a plant work for "
        "that plant only.",
        show_default="as in the rig file, else eha",
    ),
]
BiasPressure: TypeAlias = Annotated[
    float | None, option("PA", "piezo-stack: absolute bias pressure of the runs.", show_default="1e6")
]
Load: TypeAlias = Annotated[
    float | None,
    option(
        "KG|N",
        "piezo-stack: mass lifted in the runs [kg]; diaphragm-motor: known force against extension [N].",
        show_default="0",
    ),
]
Frequency: TypeAlias = Annotated[
    float | None,
    option(
        "HZ",
        "piezo-stack: drive frequency, up to 450 Hz; diaphragm-motor: up to 1000 Hz.",
        show_default="275, diaphragm-motor 480",
    ),
]
Voltage: TypeAlias = Annotated[
    float | None,
    option(
        "V",
        "piezo-stack: peak-to-peak voltage, with half of it as bias; diaphragm-motor: peak to peak, up to 300 V.",
        show_default="140, diaphragm-motor 200",
    ),
]
Healthy: TypeAlias = Annotated[
    Path | None, option("LOG", "piezo-stack, diaphragm-motor: a log of the healthy actuator, to calibrate on.")
]
Noise: TypeAlias = Annotated[str, option("NOISE", "Sensor noise: bench, rig or paper.")]
Drive: TypeAlias = Annotated[str, option("DRIVE", "Drive: sine, prbs, steps, chirp or multisine, at the paper's 4 V.")]
Ranked: TypeAlias = Annotated[bool, flag("--rank", "Rank all drives, the most informative first.")]

PRESSURE = "differential_pressure_pa"
"""The channel that is optional everywhere."""

SEED = 2024


def load_rig(path: Path | None) -> "Rig":
    """Return the rig from a file; without a file, the paper's rig.

    Raises
    ------
    RigError
        If the file is not usable.
    """
    from plant.eha.rig import Rig, read_rig

    return Rig() if path is None else read_rig(path)


def load_columns(texts: Sequence[str] | None) -> dict[str, str]:
    """Return ``--columns`` as a mapping from channels to foreign columns.

    Parameters
    ----------
    texts : sequence of str or None
        ``CHANNEL=NAME:UNIT``, one or several separated by commas.

    Returns
    -------
    dict[str, str]
        Foreign column, with its unit, by channel.

    Raises
    ------
    RigError
        If one is not usable.

    Examples
    --------
    >>> load_columns(["position_m=POS, MM:mm,motor_speed_rad_s=RPM:rpm"])
    {'position_m': 'POS, MM:mm', 'motor_speed_rad_s': 'RPM:rpm'}
    """
    from plant.log.columns import parse_columns

    return parse_columns([part for text in texts or () for part in re.split(r",(?=\s*[A-Za-z]\w*=)", text)])


def split_names(*texts: str) -> tuple[str, ...]:
    """Return the names in comma-separated texts.

    Parameters
    ----------
    *texts : str
        Values of an option, which may be given several times.

    Examples
    --------
    >>> split_names("leakage, friction", "air")
    ('leakage', 'friction', 'air')
    """
    return tuple(part.strip() for text in texts for part in text.split(",") if part.strip())


def require_positive(option: str, value: float | None, unit: str) -> None:
    """Raise an error if an option's number is not positive and finite; None, not given, passes.

    Parameters
    ----------
    value : float or None
        Value of the option [in that unit].

    Raises
    ------
    HydrostateError
        If it is not a number, or not positive and finite.
    """
    if not isinstance(value, Real | None):  # pyright: ignore[reportUnnecessaryIsInstance] -- a user's slip
        raise HydrostateError(f"{option} must be a number [{unit}], got {value!r}")
    if value is not None and not (math.isfinite(value) and value > 0.0):
        raise HydrostateError(f"{option} must be positive and finite, got {value:g} {unit}")


def refuse_ineffective_options(options: Mapping[str, object], why: str) -> None:
    """Raise an error for options that would have no effect, rather than ignore them.

    Parameters
    ----------
    options : mapping of str to object
        Value of each option; None or empty if it was not given.
    why : str
        Rest of the sentence, after the name of the option.

    Raises
    ------
    HydrostateError
        If one was given.
    """
    for name, value in options.items():
        if value is not None and value != []:
            raise HydrostateError(f"{name} {why}")


def load_actuator(plant: str | None, path: Path | None) -> "tuple[ActuatorKind, Rig[Any]]":
    """Return the kind of actuator that the options name, and its rig.

    Parameters
    ----------
    plant : str or None
        As in ``--plant``. If not given, it is taken from the rig file; if that names none, it is the gear-pump
        actuator.
    path : Path or None
        The rig file.

    Raises
    ------
    HydrostateError
        If there is no such kind, or the rig file is not usable or of another kind.
    """
    from experiments.actuators import DEFAULT, actuator

    if plant is None and path is not None:
        from plant.eha.rig import plant_of

        plant = plant_of(path)
        kind = actuator(plant or DEFAULT, f"{path}: plant")
    else:
        kind = actuator(plant or DEFAULT)
    return kind, kind.read_rig(path)


def options_of_kind(
    context: typer.Context, asked: Mapping[str, Any], kind: "ActuatorKind", verb: str, common: Collection[str]
) -> dict[str, Any]:
    """Return the command line options that apply to a kind of actuator, with defaults for those not given.

    Parameters
    ----------
    asked : Mapping[str, Any]
        Arguments by name.
    common : collection of str
        Options of all kinds, which the verb itself handles.

    Raises
    ------
    HydrostateError
        If an option does not apply to the kind, or the kind lacks the verb.
    """
    from experiments.actuators import actuators, verb_of_kind

    defaults: Mapping[str, Any] = verb_of_kind(kind, verb).options
    flags = {str(one.name): one.opts[0] for one in context.command.params}
    sources = {name: str(context.get_parameter_source(name)) for name in flags if name not in common}
    given = {name: asked[name] for name, source in sources.items() if source == "ParameterSource.COMMANDLINE"}
    strange = [name for name in given if name not in defaults]
    if strange:
        takers = [
            one.name
            for one in actuators()
            if getattr(one, verb) is not None and set(strange) <= set(getattr(one, verb).options)
        ]
        needed = f" needs --plant {' or '.join(takers)}, and" if takers else ""
        raise HydrostateError(f"{', '.join(flags[name] for name in strange)}{needed} does not go with {kind.name}")
    return {**defaults, **given}
