"""A filter as a rule: its two halves, its settings, and the weight of outliers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

from estimation.engine.contract import FilterProblem
from estimation.engine.kalman import Outputs
from estimation.models.model import ProcessModel
from plant.errors import HydrostateError


@dataclass(frozen=True)
class Setting:
    """A number that a method's user may set.

    Parameters
    ----------
    default : float
        What holds unless it is set [its own unit].
    wanted : str
        What it must be, for the message; ``{n}`` is the count of states.
    allows : callable
        Whether a value is that, given the count of states.
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
        What holds unless it is set [its own unit].
    """
    return Setting(name, default, "positive", lambda value, _: value > 0.0)


@dataclass(frozen=True)
class Rule:
    """A filter that predicts, then updates. Its file states a rule, and kernels are made of rules.

    Parameters
    ----------
    name : str
        Name, in messages and of the kernel's file.
    predict : callable
        ``predict(model)``: new ``z`` and ``P`` after one step of the model.
    update : callable
        ``update(model, channels)``: new ``z`` and ``P``, and innovation ``e`` and its variance ``s`` of every channel;
        ``robust=`` says how outliers count, where the filter weighs them.
    settings : tuple of Setting
        Numbers that the user sets; they are symbols of those names in both halves.
    memory : tuple of str
        Names of what else the filter carries from sample to sample for each channel, zero at first; the channel's
        number is added to the name.
    weighs_outliers : bool
        Whether the update can be a robust one.
    """

    name: str
    predict: Callable[[ProcessModel], Outputs]
    update: Callable[..., Outputs]
    settings: tuple[Setting, ...] = ()
    memory: tuple[str, ...] = ()
    weighs_outliers: bool = True


@cache
def weighing(rule: Rule, robust: str) -> Rule:
    """Return a filter with outliers counting as wanted.

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
    """Return a method's settings, the user's in place of the defaults.

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
