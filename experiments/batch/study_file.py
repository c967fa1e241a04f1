"""The study file: which plants, conditions, drives, sensors, methods and seeds, or which logs, in TOML."""

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, ValidationInfo, field_validator, model_validator

from estimation.eha.named_methods import NAMED
from estimation.filters.methods import METHODS
from estimation.log_checks.first_belief import START_STD
from estimation.models.eha_forms import FORMS
from experiments.actuator_kind import ActuatorKind
from experiments.actuators import DEFAULT, actuator, verb_of_kind
from faults.conditions import CONDITIONS, HIGHEST_SEVERITY
from plant.eha.drives import DRIVES
from plant.eha.simulate import PLANTS
from plant.errors import HydrostateError
from plant.sensors.sensors import SENSORS
from plant.small_file import MOST_SHOWN, entry_text, small_toml

STUDIES_PACKAGE = "experiments.batch.studies"

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Severity = Annotated[float, Field(ge=0.0, le=HIGHEST_SEVERITY)]


MOST_SEEDS = 1_000_000
"""Maximum number of seeds in one `[[runs]]` [count]."""


class StudyError(HydrostateError):
    """A study file is not usable."""


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=True)


NAME = r"^[^./\\\x00-\x1f\x7f][^/\\\x00-\x1f\x7f]*$"
"""Pattern of a study's name, which also names a folder: no slashes, no control characters and no leading dot."""


def _other_kind(info: ValidationInfo) -> ActuatorKind | None:
    """Return the study's kind of actuator, or None for the gear-pump actuator."""
    kind: ActuatorKind | None = (info.context or {}).get("kind")
    return None if kind is None or kind.name == DEFAULT else kind


def _require_known_names(names: Sequence[str], known: Sequence[str]) -> None:
    for name in names:
        if name not in known:
            near = get_close_matches(name, known, n=1)
            hint = f", did you mean {near[0]!r}?" if near else ""
            raise ValueError(f"one of {', '.join(known)}, got {name!r}{hint}")


class Method(_Table):
    """Method applied to a log or a simulated series.

    Parameters
    ----------
    verb : {"filter", "estimate", "diagnose"}
        ``filter`` runs one filter, compiled and 32 side by side for the ``ekf``; ``estimate`` gives the value and
        verdict of `hydrostate estimate`; ``diagnose`` names one of the nine conditions.
    form : str
        The process model; ``auto`` only for ``estimate``.
    method : str
        The filter; ``auto`` only for ``estimate``.
    pressure : bool
        Whether differential pressure is used if it is logged.
    told : {"condition", "healthy"}
        Source of the leakage and friction given to the method: the simulated condition, or the healthy rig.
    start_std_pa : float
        Standard deviation of the first guess [Pa].
    """

    verb: Literal["filter", "estimate", "diagnose"]
    form: str = "auto"
    method: str = "auto"
    pressure: bool = True
    told: Literal["condition", "healthy"] = "condition"
    start_std_pa: Positive = START_STD

    @field_validator("form", "method")
    @classmethod
    def _names(cls, name: str, info: ValidationInfo) -> str:
        known = list(FORMS if info.field_name == "form" else METHODS)
        if info.data.get("verb") != "filter":
            known = ["auto", *(("flow", "motion") if info.field_name == "form" else ("least-squares", *NAMED)), *known]
        _require_known_names([name], known)
        return name


class Runs(_Table):
    """Simulated cases: every combination of the listed values.

    Parameters
    ----------
    plants, drives, sensors : tuple of str
        Names accepted by `hydrostate simulate`; plants and drives only for the gear-pump actuator.
    conditions : tuple of str
        Conditions by name; by default all of them, or none if severities are given.
    severities : tuple of pairs of float
        Pairs of leakage and friction severity, in addition to the conditions [dimensionless].
    seeds : int or tuple of int
        A number of seeds counted from 0, or a list of seeds.
    starts_pa : tuple of float
        First guesses of bulk modulus [Pa]; the rig's own if none are given.
    duration_s, sample_time_s : float
        Duration and sample time of a run [s].
    """

    plants: tuple[str, ...] = ("lumped",)
    drives: tuple[str, ...] = ("steps",)
    sensors: tuple[str, ...] = ("bench",)
    conditions: tuple[str, ...] | None = None
    severities: tuple[tuple[Severity, Severity], ...] = ()
    seeds: Annotated[int, Field(ge=1, le=MOST_SEEDS)] | tuple[Annotated[int, Field(ge=0)], ...] = 1
    starts_pa: tuple[NotNegative, ...] = ()
    duration_s: Positive = 10.0
    sample_time_s: Positive = 1e-4
    methods: Annotated[tuple[Method, ...], Field(min_length=1)]

    @field_validator("plants", "drives", "sensors", "conditions")
    @classmethod
    def _names(cls, names: tuple[str, ...] | None, info: ValidationInfo) -> tuple[str, ...] | None:
        kind = _other_kind(info)
        if kind is not None:
            _require_known_names(names or (), kind.conditions if info.field_name == "conditions" else names or ())
            return names
        known = {"plants": PLANTS, "drives": DRIVES, "sensors": SENSORS, "conditions": CONDITIONS}[str(info.field_name)]
        _require_known_names(names or (), list(known))
        if not names and info.field_name != "conditions":
            raise ValueError(f"one or more of {', '.join(known)}, got none")
        return names

    @model_validator(mode="after")
    def _samples(self) -> "Runs":
        if not self.duration_s / self.sample_time_s >= 10.0:
            raise ValueError(f"at least 10 samples long, got {self.duration_s:g} s at {self.sample_time_s:g} s")
        return self

    @property
    def seed_count(self) -> int:
        """Number of seeds [count]."""
        return self.seeds if isinstance(self.seeds, int) else len(self.seeds)

    @property
    def seed_list(self) -> tuple[int, ...]:
        """The seeds, one by one."""
        return tuple(range(self.seeds)) if isinstance(self.seeds, int) else self.seeds


class Logs(_Table):
    """Cases that are logs.

    Parameters
    ----------
    glob : str
        Pattern of the files, relative to the study file unless absolute; ``**`` includes sub-folders.
    columns : dict[str, str]
        Column name in the file for each channel, in addition to the rig's: ``{ position_m = "POS_MM:mm" }``.
    starts_pa : tuple of float
        First guesses of bulk modulus [Pa]; the rig's own if none are given.
    sample_time_s : float or None
        Sample time [s] of logs without time, or with times that do not increase.
    """

    glob: Annotated[str, Field(min_length=1)]
    columns: dict[str, str] = {}
    starts_pa: tuple[NotNegative, ...] = ()
    sample_time_s: Positive | None = None
    methods: Annotated[tuple[Method, ...], Field(min_length=1)]


class Study(_Table):
    """A study file's content.

    Parameters
    ----------
    plant : str
        The kind of actuator of its runs and logs.
    rig : str
        The healthy actuator's rig file, relative to the study file; empty for the actuator of the paper.
    rigs : dict[str, str]
        Rig files of folders, both relative to the study file; a log uses that of the nearest folder above it.
    """

    name: Annotated[str, Field(min_length=1, max_length=100, pattern=NAME)]
    question: str = ""
    plant: str = DEFAULT
    rig: str = ""
    rigs: dict[str, str] = {}
    runs: tuple[Runs, ...] = ()
    logs: tuple[Logs, ...] = ()

    @model_validator(mode="after")
    def _require_cases(self, info: ValidationInfo) -> "Study":
        if not (self.runs or self.logs):
            raise ValueError("at least one [[runs]] or [[logs]], got none")
        kind = _other_kind(info)
        if kind is not None:
            if self.runs:
                verb_of_kind(kind, "simulate")
            verbs = [one for one in ("estimate", "diagnose") if getattr(kind, one) is not None]
            _require_known_names([method.verb for some in (*self.runs, *self.logs) for method in some.methods], verbs)
        return self


def read_study(path: str | Path) -> Study:
    """Read a study file.

    Parameters
    ----------
    path : str or Path
        A TOML file, or the name of a study that comes with the project.

    Raises
    ------
    StudyError
        If the file cannot be read or is no TOML, or an entry is unknown, of the wrong kind, or out of range.
    """
    path = study_path(path)
    try:
        content = small_toml(path)
    except FileNotFoundError as error:
        shipped = " and ".join(shipped_studies())
        raise StudyError(f"{path}: there is no such study file; {shipped} are included, and need no file") from error
    except OSError as error:
        raise StudyError(f"{path}: cannot be read: {error.strerror or error}") from error
    except ValueError as error:
        raise StudyError(f"{path}: a TOML file is needed: {error}") from error
    return parse_study(content, str(path))


def parse_study(content: Mapping[str, Any], source: str) -> Study:
    """Return a study from a study file's content.

    Raises
    ------
    StudyError
        If an entry is unknown, of the wrong kind, or out of range; the message names the first such field.

    Examples
    --------
    >>> content = {"name": "a", "runs": [{"seeds": 0, "methods": [{"verb": "diagnose"}]}]}
    >>> parse_study(content, "a.toml")
    Traceback (most recent call last):
    experiments.batch.study_file.StudyError: a.toml: runs[0].seeds must be greater than or equal to 1, got 0
    """
    try:
        kind = actuator(str(content.get("plant", DEFAULT)))
    except HydrostateError as error:
        raise StudyError(f"{source}: {str(error).removeprefix('--')}") from error
    try:
        return Study.model_validate(content, context={"kind": kind})
    except ValidationError as error:
        raise StudyError(f"{source}: {_sentence(max(error.errors(), key=lambda one: len(one['loc'])))}") from error


def study_path(path: str | Path) -> Path:
    """Return the file of a study: the path itself, or that of a study that comes with the project.

    Parameters
    ----------
    path : str or Path
        A file, or a name such as ``eha-paper``.
    """
    shipped = files(STUDIES_PACKAGE).joinpath(f"{path}.toml")
    if Path(path).exists() or not shipped.is_file():
        return Path(path)
    return Path(str(shipped))


def shipped_studies() -> tuple[str, ...]:
    """Return the names of the studies that come with the project.

    Examples
    --------
    >>> shipped_studies()
    ('eha-paper', 'fleet-archive')
    """
    names = (one.name for one in files(STUDIES_PACKAGE).iterdir())
    return tuple(sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml")))


def _sentence(error: Any) -> str:
    """Return which field is wrong, what was expected, and what was given."""
    where = ""
    for part in error["loc"]:
        if isinstance(part, int):
            where += f"[{part}]"
        elif part not in ("constrained-int", "int", "tuple[constrained-int, ...]", "tuple[int, ...]"):
            name = part if part.isprintable() and len(part) <= MOST_SHOWN else entry_text(part)
            where += f".{name}" if where else name
    match error["type"]:
        case "extra_forbidden":
            return f"{where} is unknown{_nearest(error['loc'])}"
        case "missing":
            return f"{where} is needed, and not there"
        case "value_error":
            wanted = str(error["msg"]).removeprefix("Value error, ")
            return f"{where or 'the file'} must {'have' if wanted.startswith('at least one [[') else 'be'} {wanted}"
        case _:
            wanted = str(error["msg"]).removeprefix("Input should be ").removeprefix("Value should ")
            return f"{where} must be {wanted}, got {entry_text(error['input'])}"


def _nearest(place: Sequence[str | int]) -> str:
    names = [part for part in place if isinstance(part, str)]
    table = {"runs": Runs, "logs": Logs, "methods": Method}.get(names[-2] if len(names) > 1 else "", Study)
    known = list(table.model_fields)
    near = get_close_matches(names[-1], known, n=1)
    return f", did you mean {near[0]!r}?" if near else f", wanted one of {', '.join(known)}"
