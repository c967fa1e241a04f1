"""A filter as a rule: its two halves, its settings, and its weighting of outliers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

from estimation.engine.contract import FilterProblem
from estimation.engine.kalman import Outputs
from estimation.models.model import ProcessModel
from plant.errors import HydrostateError


@dataclass(frozen=True)
class Setting:
    """A setting of a method.

    Parameters
    ----------
    default : float
        Default value [its own unit].
    wanted : str
        Requirement on the value, for the message; ``{n}`` is the number of states.
    allows : callable
        Whether a value meets it, given the number of states.
    """

    name: str
    default: float
    wanted: str
    allows: Callable[[float, int], bool]


def positive(name: str, default: float) -> Setting:
    """Return a setting that must be positive.

    Parameters
    ----------
    default : float
        Default value [its own unit].
    """
    return Setting(name, default, "positive", lambda value, _: value > 0.0)


@dataclass(frozen=True)
class Rule:
    """A filter that predicts, then updates. Its file defines a rule, from which kernels are generated.

    Parameters
    ----------
    name : str
        Name, for messages and the kernel's file.
    predict : callable
        ``predict(model)``: new ``z`` and ``P`` after one step of the model.
    update : callable
        ``update(model, channels)``: new ``z`` and ``P``, and innovation ``e`` and its variance ``s`` of every channel;
        ``robust=`` selects how outliers count, if the filter weights them.
    settings : tuple of Setting
        Settings of the user; they are symbols with those names in both halves.
    memory : tuple of str
        Names of further values that the filter carries from sample to sample for each channel, initially zero; the
        channel's number is appended to the name.
    weighs_outliers : bool
        Whether the update can be robust.
    """

    name: str
    predict: Callable[[ProcessModel], Outputs]
    update: Callable[..., Outputs]
    settings: tuple[Setting, ...] = ()
    memory: tuple[str, ...] = ()
    weighs_outliers: bool = True


@cache
def weighing(rule: Rule, robust: str) -> Rule:
    """Return a filter with the requested treatment of outliers.

    Parameters
    ----------
    robust : str
        See `estimation.engine.robust.inflation`.

    Raises
    ------
    HydrostateError
        If it has no robust update.
    """
    if robust == "none":
        return rule
    if not rule.weighs_outliers:
        raise HydrostateError(
            f"{rule.name} takes a large innovation for a change of the plant, not for an outlier: robust must be none, "
            f"got {robust!r}"
        )
    return replace(rule, name=f"{rule.name}_{robust.replace('-', '_')}", update=partial(rule.update, robust=robust))


def chosen_settings(problem: FilterProblem, method: str, known: Sequence[Setting] = ()) -> dict[str, float]:
    """Return a method's settings, with the user's values replacing the defaults.

    Returns
    -------
    dict[str, float]
        Values by name, in that order [each in its own unit].

    Raises
    ------
    HydrostateError
        If the user set something that the method does not know, or to what it must not be.
    """
    names = [setting.name for setting in known]
    unknown = sorted(set(problem.settings) - set(names))
    if unknown:
        raise HydrostateError(f"{method} can be set {', '.join(names) or 'nothing'}, got {unknown[0]!r}")
    values = {setting.name: float(problem.settings.get(setting.name, setting.default)) for setting in known}
    for setting in known:
        if not setting.allows(values[setting.name], problem.model.width):
            wanted = setting.wanted.format(n=problem.model.width)
            raise HydrostateError(f"{setting.name} must be {wanted}, got {values[setting.name]}")
    return values
