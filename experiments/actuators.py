"""The kinds of actuator, each registered by one line; they are imported when one is asked for."""

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

from plant.errors import HydrostateError

if TYPE_CHECKING:
    from experiments.actuator_kind import ActuatorKind

ACTUATORS: Mapping[str, str] = {
    "eha": "experiments.eha.kind:EHA",
    "piezo-stack": "experiments.piezo_stack.kind:PIEZO_STACK",
    "diaphragm-motor": "experiments.diaphragm_motor.kind:DIAPHRAGM_MOTOR",
}
"""Where each kind's `experiments.actuator_kind.ActuatorKind` is, by name."""

DEFAULT = "eha"

ENTRY_POINTS = "hydrostate.actuators"
"""Group of entry points by which an installed package registers kinds of its own: ``name = "module:OBJECT"``."""


def actuator(name: str) -> "ActuatorKind":
    """Return the kind of actuator of this name.

    Parameters
    ----------
    name : str
        Of `ACTUATORS` or an installed package; or of one of a kind's models, ``circuit``.

    Returns
    -------
    ActuatorKind
        The kind; its channels are known from here on.

    Raises
    ------
    HydrostateError
        If there is no such kind.
    """
    if name in ACTUATORS:
        return _loaded(name, ACTUATORS[name])
    for kind in actuators():
        if name == kind.name or name in kind.models:
            return kind
    known = [one for kind in actuators() for one in (kind.name, *kind.models)]
    raise HydrostateError(f"--plant must be one of {', '.join(known)}, got {name!r}")


def actuators() -> "Iterator[ActuatorKind]":
    """Yield every kind of actuator, the project's own first."""
    from importlib.metadata import entry_points  # 20 ms, which a log of the project's own kind can do without

    yield from (_loaded(name, place) for name, place in ACTUATORS.items())
    installed = {one.name: one.value for one in entry_points(group=ENTRY_POINTS)}
    yield from (_loaded(name, place) for name, place in installed.items() if name not in ACTUATORS)


def _loaded(name: str, place: str) -> "ActuatorKind":
    from plant.log.columns import know_channels

    module, _, attribute = place.partition(":")
    kind: ActuatorKind = getattr(import_module(module), attribute)
    if kind.name != name:
        raise HydrostateError(f"{place} must be called {name!r}, as it is registered, got {kind.name!r}")
    know_channels(kind.channels)
    return kind


def offered(kind: "ActuatorKind", verb: str) -> Any:
    """Return what a kind of actuator does for a verb.

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
        raise HydrostateError(f"{verb} is not there for {kind.name}, {kind.description}")
    return found
