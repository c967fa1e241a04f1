"""The kinds of actuator, each registered by one line and imported on first use."""

from collections.abc import Collection, Iterator, Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

from plant.errors import HydrostateError, not_known

if TYPE_CHECKING:
    from pathlib import Path

    from experiments.actuator_kind import ActuatorKind
    from plant.eha.rig import Rig
    from plant.errors import NoChannelError

ACTUATORS: Mapping[str, str] = {
    "eha": "experiments.eha.kind:EHA",
    "piezo-stack": "experiments.piezo_stack.kind:PIEZO_STACK",
    "diaphragm-motor": "experiments.diaphragm_motor.kind:DIAPHRAGM_MOTOR",
}
"""Location of each kind's `experiments.actuator_kind.ActuatorKind`, by name."""

DEFAULT = "eha"

ENTRY_POINTS = "hydrostate.actuators"
"""Group of entry points with which an installed package registers its own kinds: ``name = "module:OBJECT"``."""


def actuator(name: str, what: str = "--plant") -> "ActuatorKind":
    """Return the kind of actuator with this name.

    Parameters
    ----------
    name : str
        A name from `ACTUATORS` or from an installed package; or the name of one of a kind's models, such as
        ``circuit``.
    what : str
        What an error calls the name.

    Returns
    -------
    ActuatorKind
        The kind; its channels are now registered.

    Raises
    ------
    HydrostateError
        If there is no such kind.
    """
    if name in ACTUATORS:
        return _load_kind(name, ACTUATORS[name])
    for kind in actuators():
        if name == kind.name or name in kind.models:
            return kind
    known = [one for kind in actuators() for one in (kind.name, *kind.models)]
    raise HydrostateError(not_known(what, name, known))


def kind_of_rig(rig: "Rig[Any]", usual: str) -> "ActuatorKind":
    """Return the kind of actuator named in a log's rig file, or the default kind if it names none."""
    return actuator(rig.plant or usual)


def actuators() -> "Iterator[ActuatorKind]":
    """Yield every kind of actuator, the project's own kinds first."""
    from importlib.metadata import entry_points  # takes 20 ms, and the project's own kinds do not need it

    yield from (_load_kind(name, place) for name, place in ACTUATORS.items())
    installed = {one.name: one.value for one in entry_points(group=ENTRY_POINTS)}
    yield from (_load_kind(name, place) for name, place in installed.items() if name not in ACTUATORS)


def kinds_by_columns(columns: Collection[str]) -> tuple[str, ...]:
    """Return the kinds of actuator with the most channels in a log, by the channels' own names.

    A log with the channels that the gear-pump actuator requires always belongs to that kind.

    Parameters
    ----------
    columns : collection of str
        Names of the log's columns.

    Returns
    -------
    tuple of str
        One name; several if kinds share these channels; none if the log has too few channels for every kind.

    Examples
    --------
    >>> kinds_by_columns(["time_s", "drive_voltage_v", "electrode_1_v"])
    ('diaphragm-motor',)
    >>> kinds_by_columns(["time_s", "drive_voltage_v", "position_m"])
    ('piezo-stack', 'diaphragm-motor')
    """
    from plant.log.checks import missing_required

    if not missing_required(_load_kind(DEFAULT, ACTUATORS[DEFAULT]).required, columns):
        return (DEFAULT,)
    shared = {
        kind.name: len(kind.channels.keys() & set(columns))
        for kind in actuators()
        if not missing_required(kind.required, columns)
    }
    return tuple(name for name, count in shared.items() if count == max(shared.values()))


def infer_kind(error: "NoChannelError", plant: str | None, rig: object) -> str:
    """Return the kind of actuator for a log that lacks the channels of the gear-pump actuator.

    Parameters
    ----------
    error : NoChannelError
        The error from reading it as a gear-pump log.
    plant : str or None
        The requested kind of actuator.
    rig : object
        The given rig; None if none was given.

    Raises
    ------
    NoChannelError
        If a kind or a rig was given, or no kind or several have these channels; for several, it says how to choose.
    """
    from plant.errors import NoChannelError

    kinds = kinds_by_columns(error.columns) if plant is None and rig is None else ()
    if len(kinds) == 1:
        return kinds[0]
    if kinds:
        told = f"; these may be columns of {' or '.join(kinds)}: name the kind with --plant"
        raise NoChannelError(error.bare, error.source, f"{told}{error.hint}", error.columns) from error
    raise error


def _load_kind(name: str, place: str) -> "ActuatorKind":
    from plant.log.columns import know_channels

    module, _, attribute = place.partition(":")
    kind: ActuatorKind = getattr(import_module(module), attribute)
    if kind.name != name:
        raise HydrostateError(f"{place} must be called {name!r}, as it is registered, got {kind.name!r}")
    know_channels(kind.channels)
    return kind


def read_own_rig(path: "Path", common: "ActuatorKind") -> "Rig[Any]":
    """Return the rig from a file that lies among logs of several kinds of actuator.

    Parameters
    ----------
    path : Path
        The rig file.
    common : ActuatorKind
        Kind of actuator for a file that names none.

    Raises
    ------
    HydrostateError
        If there is no such kind, or the file is not usable.
    """
    from plant.eha.rig import plant_of

    named = plant_of(path)
    return (common if named is None else actuator(named, f"{path}: plant")).read_rig(path)


def verb_of_kind(kind: "ActuatorKind", verb: str) -> Any:
    """Return a kind of actuator's function for a verb.

    Parameters
    ----------
    verb : str
        ``simulate``, ``estimate``, ``diagnose`` or ``identifiability``.

    Raises
    ------
    HydrostateError
        If it does not offer the verb.
    """
    found = getattr(kind, verb)
    if found is None:
        raise HydrostateError(f"{verb} is not available for {kind.name}, {kind.description}")
    return found
