"""What a method lets its user set: names with defaults, checked where the method is called."""

from collections.abc import Mapping

from estimation.filter import FilterProblem
from plant.errors import HydrostateError


def chosen_settings(problem: FilterProblem, method: str, defaults: Mapping[str, float]) -> dict[str, float]:
    """Return a method's settings, the user's in place of the defaults.

    Parameters
    ----------
    problem : FilterProblem
        The task, with what its user set.
    method : str
        The method's name, for the message.
    defaults : Mapping[str, float]
        All that can be set, in the rule's order [each in its own unit].

    Returns
    -------
    dict[str, float]
        Values by name, in the order of the defaults.

    Raises
    ------
    HydrostateError
        If the user set something that the method does not know.
    """
    unknown = sorted(set(problem.settings) - set(defaults))
    if unknown:
        known = ", ".join(defaults) if defaults else "nothing"
        raise HydrostateError(f"{method} can be set {known}, got {unknown[0]!r}")
    return {name: float(problem.settings.get(name, value)) for name, value in defaults.items()}
