"""Hydrostate: what is wrong inside a hydrostatic actuator, from the signals that a bench already logs.

>>> import hydrostate as hs
>>> log = hs.simulate("minor_leakage", duration=2.0, sample_time=1e-3, seed=7)
>>> log.channels[:4]
('motor_speed_rad_s', 'position_m', 'velocity_m_s', 'differential_pressure_pa')

`read` or `simulate` give a `Log`; `Log.estimate`, `Log.diagnose` and `Log.identify` say what it holds. What they return
prints itself, and turns into pandas, matplotlib, python-control or plain dictionaries.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from importlib.util import find_spec
from numbers import Integral, Real
from os import PathLike, fsdecode
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

    from estimation.equations.definition import Parameter as Parameter
    from estimation.finding import Finding as Finding
    from estimation.identification.model.linear_model import LinearModel as LinearModel
    from experiments.published import load as published_table
    from experiments.python_user.own_equations import GreyBox as GreyBox
    from experiments.python_user.own_features import features as features
    from experiments.python_user.relation import Relation
    from faults.conditions import CONDITIONS as conditions  # noqa: N811 - a face has plain names
    from faults.conditions import Condition as Condition
    from faults.own_classes.face import Classifier as Classifier
    from plant.eha.rig import Rig as Rig
    from plant.eha.rig import read_rig as read_rig
    from plant.errors import HydrostateError as HydrostateError
    from plant.errors import LogError as LogError
    from plant.errors import RigError as RigError
    from plant.log.record import Record as Record

    __version__: str

OF_A_LOG = ("estimate", "diagnose", "identify")
"""Verbs of the command that are methods of a log in Python."""

LONGEST_PATH = 4096
"""Largest length of a path [characters]; a longer text is taken as the log itself."""

PACKAGES = ("plant", "estimation", "faults", "experiments")

__all__ = [
    "Answer",
    "Classifier",
    "Condition",
    "Finding",
    "GreyBox",
    "HydrostateError",
    "LinearModel",
    "Log",
    "LogError",
    "Model",
    "Parameter",
    "Record",
    "Rig",
    "RigError",
    "__version__",
    "actuators",
    "conditions",
    "features",
    "load_model",
    "published_table",
    "read",
    "read_rig",
    "simulate",
]


def _refuse_shadows() -> None:
    """Raise an error if other packages with the same names come before ours on the path."""
    home = Path(__file__).resolve().parent
    for name in PACKAGES:
        found = find_spec(name)
        places = [] if found is None else [Path(place).resolve() for place in found.submodule_search_locations or ()]
        if not places and found is not None and found.origin:
            places = [Path(found.origin).resolve()]
        if home / name not in places:
            where = places[0] if places else "nowhere"
            raise ImportError(
                f"hydrostate needs its own package {name!r} in {home}, but Python finds {where}; rename or remove that "
                "one, or use an environment of its own for hydrostate"
            )


_refuse_shadows()

from experiments.python_user.answers import Answer, Model, no_such, refuse  # noqa: E402 - after the check
from experiments.python_user.log import Log  # noqa: E402 - likewise
from experiments.python_user.options import known_options, refuse_entries  # noqa: E402 - likewise
from experiments.python_user.python_words import options_by_name  # noqa: E402 - likewise
from plant.lazy import lazy_getattr  # noqa: E402 - likewise

_late = lazy_getattr("hydrostate", __file__)


def __getattr__(name: str) -> Any:
    """Import a name on first use."""
    if name == "__version__":
        from importlib.metadata import version

        return version("hydrostate")
    if name in __all__ or name.startswith("_"):
        return _late(name)
    from plant.errors import NoSuchNameError

    if name in OF_A_LOG:
        raise NoSuchNameError(f"hydrostate has no {name!r}; a log has it: hydrostate.read(path).{name}()")
    raise NoSuchNameError(no_such("hydrostate", name, __all__))


def __dir__() -> list[str]:
    return list(__all__)


def actuators() -> Mapping[str, str]:
    """Return the kinds of actuator, each with a one-line description.

    Returns
    -------
    Mapping[str, str]
        Description by name; these names can be used as ``plant=``.

    Examples
    --------
    >>> list(actuators())
    ['eha', 'piezo-stack', 'diaphragm-motor']
    """
    from experiments.actuators import actuators as kinds

    return {kind.name: kind.description for kind in kinds()}


def read(
    path: "str | bytes | PathLike[Any] | pd.DataFrame | Mapping[str, Any]",
    *,
    rig: "Rig[Any] | str | Path | None" = None,
    columns: Mapping[str, str] | None = None,
    plant: str | None = None,
    sample_time: float | None = None,
    beside: "Sequence[str | Path] | str | Path" = (),
) -> "Log":
    """Read a log, of an actuator or of anything else.

    If no rig or kind is given, and no column but the time's is named, a log without the actuator's channels is read
    unchanged: every numeric column under its own name, for `Log.identify`. Up to half of the samples may be missing for
    `Log.identify`; at most 5 % for everything else.

    Parameters
    ----------
    path : str, bytes, path-like, pandas.DataFrame or Mapping[str, array_like]
        Text, Parquet, Feather or MAT; with the extra ``bench`` also XLSX, TDMS, MDF and HDF5. `hydrostate inspect`
        shows the contents of an unknown file. Or a table, also from Polars or Arrow, NumPy records, or arrays by name,
        with ``time_s`` or the index as time: seconds, durations or dates. Masked values count as missing; Pint
        quantities are converted.
    rig : Rig, str or Path, optional
        The actuator, or its rig file; the paper's if not given.
    columns : Mapping[str, str], optional
        Columns under other names, with their units: ``{"position_m": "POS_MM:mm"}``.
    plant : str, optional
        Kind of actuator, one of `actuators`. If not given, it is inferred from the column names; the gear-pump actuator
        is the default.
    sample_time : float, optional
        Time between rows [s], for a log without a time column, or for an actuator's log whose times do not increase.
        For a table of anything else, its time is then not read.
    beside : str, Path or sequence of them
        Files from other loggers in the same test; all are converted to one clock.

    Returns
    -------
    Log
        The log.

    Raises
    ------
    LogError
        If the file cannot be read or trusted, or over half of the samples are missing.
    HydrostateError
        If the rig or the kind of actuator is not usable.

    Examples
    --------
    >>> read("none.csv")
    Traceback (most recent call last):
    plant.errors.LogError: none.csv: there is no such file
    """
    from experiments.actuators import DEFAULT, actuator, kinds_by_columns
    from experiments.command.logs import read_log
    from experiments.python_user.log import ANY
    from experiments.python_user.reading import read_whole_or_sparse
    from plant.errors import NoChannelError
    from plant.log.any_columns import read_any, time_alone
    from plant.log.frames import by_name, frame_table, is_frame

    with options_by_name():
        kind = actuator(plant or DEFAULT)
    bench = _rig(rig, kind)
    if isinstance(sample_time, bool) or not isinstance(sample_time, Real | None):  # pyright: ignore[reportUnnecessaryIsInstance] -- a user's slip
        refuse(f"sample_time must be a number of seconds, got {sample_time!r}")
    if isinstance(path, PathLike | bytes):
        path = Path(fsdecode(path))
    if isinstance(path, str) and (len(path) > LONGEST_PATH or "\n" in path or not path):
        refuse(f"the path of a log is needed, got the text {path[:60]!r}")
    table = None if isinstance(path, str | Path) else path if is_frame(path) else by_name(path)
    levels = getattr(getattr(table, "columns", None), "nlevels", 1)
    if levels > 1:
        how = "for example table.columns = table.columns.map(' '.join)"
        refuse(f"each column of the table must have one name, got names of {levels} levels (MultiIndex); {how}")
    file = Path(path) if isinstance(path, str | Path) else None if table is None else frame_table(table)
    if file is None:
        got = repr(path) if isinstance(path, Real | list | tuple | None) else type(path).__name__
        hint = "; give the path of an open file" if hasattr(path, "read") else ""
        refuse(f"the path of a log, a pandas.DataFrame or arrays by name are needed, got {got[:100]}{hint}")
    if columns is not None and not isinstance(columns, Mapping):  # pyright: ignore[reportUnnecessaryIsInstance] -- a user's slip
        refuse(f"columns must be a mapping such as {{'position_m': 'POS_MM:mm'}}, got {columns!r}")
    given: Any = [beside] if isinstance(beside, str | PathLike) else beside
    if not isinstance(given, Sequence) or not all(isinstance(one, str | PathLike) for one in given):
        refuse(f"beside must be paths of other loggers' files, got {given!r:.80}")
    others = [Path(one) for one in given]
    more: dict[str, Any] = {"sample_time": sample_time, "beside": others}
    try:
        with options_by_name():
            found = read_whole_or_sparse(
                partial(read_log, file, bench.columns, dict(columns or {}), kind.required, **more)
            )
        name = kind.name
    except NoChannelError as error:
        time = time_alone(columns)
        if rig is not None or (columns is not None and time is None) or plant is not None or others:
            raise
        kinds = kinds_by_columns(error.columns)
        if len(kinds) == 1:
            return read(path, plant=kinds[0], columns=columns, sample_time=sample_time)
        found, name = read_whole_or_sparse(partial(read_any, file, time=time, sample_time=sample_time)), ANY
    kept: dict[str, Any] = {"sparse": found.sparse, "refusal": found.refusal}
    kept |= {"name": file.name} if isinstance(file, Path) else {}
    return Log(found.record, bench, name, found.said, **kept)


def load_model(path: "str | Path") -> "Relation":
    """Read a model between any channels, saved by `Relation.save` or ``hydrostate identify --out``.

    Parameters
    ----------
    path : str or Path
        JSON.

    Returns
    -------
    Relation
        Ready to simulate and to be validated on logs.

    Raises
    ------
    HydrostateError
        If the file cannot be read or contains no such model.
    """
    from estimation.identification.free_run.saved import load_models
    from experiments.python_user.relation import Relation

    if not isinstance(path, str | PathLike):  # pyright: ignore[reportUnnecessaryIsInstance] -- a user's slip
        refuse(f"the path of a model is needed, got {path!r:.80}")
    return Relation(load_models(path))


def simulate(
    condition: str | None = None,
    *,
    rig: "Rig[Any] | str | Path | None" = None,
    plant: str = "eha",
    seed: int = 2024,
    **options: Any,
) -> "Log":
    """Simulate a run and return it as its sensors would have logged it.

    Parameters
    ----------
    condition : str, optional
        Condition of the actuator, one of `conditions`; healthy if not given.
    rig : Rig, str or Path, optional
        The actuator, or its rig file.
    plant : str
        Kind of actuator, or one of its models: ``"circuit"``.
    seed : int
        Seed of all that is random.
    **options
        As `hydrostate simulate` takes them, ``drive="prbs"``, ``duration=10.0`` [s], ``sample_time=1e-3`` [s],
        ``sensors="rig"``.

    Returns
    -------
    Log
        The run; the metadata of `Log.record` say how it was made.

    Raises
    ------
    HydrostateError
        If the condition or an option is unknown or not usable.
    """
    from experiments.actuators import actuator, verb_of_kind

    with options_by_name():
        kind = actuator(plant)
    bench = _rig(rig, kind)
    simulation = verb_of_kind(kind, "simulate")
    if condition is not None:
        options["condition" if "condition" in simulation.options else "fault"] = condition
    refuse_entries(options, simulation.options, kind.parameters)
    asked = {**simulation.options, **known_options(options, simulation.options, "simulate")}
    if isinstance(seed, bool) or not isinstance(seed, Integral) or seed < 0:  # pyright: ignore[reportUnnecessaryIsInstance] -- a user's slip
        refuse(f"seed must be a whole number from 0 up, got {seed!r}")
    seed = int(seed)  # that of NumPy too
    with options_by_name():
        record = simulation.run(bench, {**asked, "seed": seed, "plant": plant}).record
    return Log(record, bench, kind.name)


def _rig(rig: Any, kind: Any) -> "Rig[Any]":
    """Return a rig of this kind of actuator."""
    if isinstance(rig, PathLike):
        rig = Path(rig)
    if isinstance(rig, str | Path) and not Path(rig).is_file():
        refuse(f"rig {str(rig)!r}: there is no such file; `hydrostate rig init FILE` writes one to edit, or pass a Rig")
    if rig is None or isinstance(rig, str | Path):
        return kind.read_rig(None if rig is None else Path(rig))
    if not isinstance(getattr(rig, "parameters", None), kind.parameters):
        refuse(
            f"rig must be a Rig of {kind.name}, or the path of its rig file (hydrostate rig init), "
            f"got {type(rig).__name__}"
        )
    return rig


if __name__ == "__main__":  # python -m hydrostate
    from experiments.cli import main

    main()
