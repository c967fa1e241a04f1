"""Selects the rig file for a log on a server: the one for its actuator, or the common one."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.command.options import load_actuator, load_rig
from experiments.fleet.naming import actuator_in_name
from experiments.fleet.one_form import one_form
from plant.errors import HydrostateError

if TYPE_CHECKING:
    from experiments.actuator_kind import ActuatorKind
    from plant.eha.rig import Rig


def rig_files(folder: Path | None) -> dict[str, Path]:
    """Return the rig files of a folder by actuator; each file is named after its actuator."""
    return {} if folder is None else {one_form(one.stem): one for one in sorted(folder.glob("*.toml"))}


def require_rigs(plant: str | None, rigs: Path | None, others: Path | None) -> None:
    """Read every rig file of a folder, as a check.

    Parameters
    ----------
    plant, others : str or None, Path or None
        As in `load_actuator_of_log`.
    rigs : Path or None
        The folder.

    Raises
    ------
    HydrostateError
        If the folder has none, or a file is wrong.
    """
    files = rig_files(rigs)
    if rigs is not None and not files:
        raise HydrostateError(f"{rigs}: must hold a rig file of each actuator, such as P-12.toml, it has none")
    for file in files.values():
        load_actuator_of_log(plant, file, others)


def rig_of(name: str, pattern: str | None, folder: Path | None, others: Path | None) -> Path | None:
    """Return the rig file of a log.

    Parameters
    ----------
    name : str
        Name of the log.
    pattern : str or None
        Pattern of log names, as in `experiments.fleet.naming.actuator_in_name`.
    folder : Path or None
        Folder of rig files by actuator, if the server has one.
    others : Path or None
        Rig file for logs whose actuator has no rig file of its own.

    Raises
    ------
    HydrostateError
        If there is a folder, but no rig file for this log: another actuator's would give wrong numbers.
    """
    if folder is None:
        return others
    files, actuator = rig_files(folder), actuator_in_name(name, pattern)
    if actuator not in files and others is None:
        of = f"the actuator is {actuator!r}" if actuator else f"{name} names no actuator"
        raise HydrostateError(f"no rig file: {of}, and the server has rig files of {', '.join(files) or 'none'}")
    return files.get(actuator, others)


def rig_of_stream(name: str, folder: Path | None, others: Path | None) -> Path | None:
    """Return the rig file of a stream, which is named after its actuator.

    Parameters
    ----------
    folder : Path or None
        Folder of rig files by actuator.
    others : Path or None
        Rig file for streams whose actuator has no rig file of its own.

    Raises
    ------
    HydrostateError
        If there is a folder, but no rig file for this stream.
    """
    return rig_of(name, "{actuator}", folder, others)


def require_rig_of_stream(name: str, folder: Path | None, others: Path | None) -> None:
    """Read the rig file of a stream, which must be for the gear-pump actuator; see `rig_of_stream`.

    Raises
    ------
    HydrostateError
        If it has none, or one for another kind of actuator.
    """
    try:
        load_rig(rig_of_stream(name, folder, others))
    except HydrostateError as error:
        raise HydrostateError(f"--watch {name}: {error}") from error


def load_actuator_of_log(plant: str | None, rig: Path | None, others: Path | None) -> "tuple[ActuatorKind, Rig[Any]]":
    """Return the kind of actuator of a log, and its rig.

    Parameters
    ----------
    plant, rig, others : str or None, Path or None
        Kind of actuator in the server's settings, rig file of the log, and rig file for logs without their own. A log's
        own rig file may name another kind.
    """
    if rig is not None and rig != others:
        from plant.eha.rig import plant_of

        plant = plant_of(rig) or plant
    return load_actuator(plant, rig)
