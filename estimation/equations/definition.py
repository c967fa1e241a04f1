"""`Equations`: a model that a user writes as a plain Python function, with named states, inputs and parameters."""

import keyword
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import inf, isfinite
from numbers import Real
from types import MappingProxyType
from typing import Any

from plant.errors import HydrostateError

Derivative = Callable[[Any, Any, Any], Any]
"""``derivative(state, inputs, parameters)``: the rate of every state, per second."""


@dataclass(frozen=True)
class Parameter:
    """An unknown of a user's equations: its start, bounds and unit.

    If its lower bound is positive, its logarithm is searched: a start that is too large by a factor is then as near as
    one that is too small by it.

    Parameters
    ----------
    start : float
        First guess [its unit].
    bounds : tuple of float
        Least and largest value [its unit].
    unit : str
        Its unit, for printing.

    Raises
    ------
    HydrostateError
        If the bounds are no interval, or the start lies outside.

    Examples
    --------
    >>> Parameter(0.1, (0.0, 1.0), "N s/m").start
    0.1
    >>> Parameter(5.0, (0.0, 1.0))
    Traceback (most recent call last):
    plant.errors.HydrostateError: a start between its bounds 0 and 1 is needed, got 5
    """

    start: float
    bounds: tuple[float, float] = (-inf, inf)
    unit: str = "1"

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", _finite("a start", self.start))
        try:
            low, high = (float(end) for end in self.bounds)
        except (TypeError, ValueError):
            raise HydrostateError(f"bounds must be two numbers, got {self.bounds!r}") from None
        if not low < high:
            raise HydrostateError(f"bounds must be a least and a larger value, got {low:g} and {high:g}")
        if not low <= self.start <= high:
            raise HydrostateError(f"a start between its bounds {low:g} and {high:g} is needed, got {self.start:g}")
        object.__setattr__(self, "bounds", (low, high))

    @property
    def logarithmic(self) -> bool:
        """Whether its logarithm is searched."""
        return self.bounds[0] > 0.0

    @property
    def size(self) -> float:
        """Size of a step [its unit], if its logarithm is not searched."""
        width = self.bounds[1] - self.bounds[0]
        return abs(self.start) or (0.1 * width if isfinite(width) else 1.0)


def _finite(what: str, value: object) -> float:
    """Return a number, also one of NumPy, as a float."""
    if isinstance(value, bool) or not isinstance(value, Real) or not isfinite(value):
        raise HydrostateError(f"{what} must be a finite number, got {value!r}")
    return float(value)


@dataclass(frozen=True, eq=False)
class Equations:
    """A user's model.

    Parameters
    ----------
    derivative : callable
        ``derivative(state, inputs, parameters)``: the rates of all states, in their order. States and inputs are tuples
        whose elements also have names, parameters are accessed by name. Arithmetic, comparisons and NumPy's functions
        (`plant.compiled.numpy_calls.SUPPORTED`) may be used; a choice that depends on a state is made by ``np.where``,
        not ``if``.
    states, inputs, outputs : Mapping[str, str]
        Their names, each with its unit. Inputs and outputs are channels of a log.
    parameters : Mapping[str, Parameter]
        The parameters to fit.
    known : Mapping[str, float]
        Constants that the functions read besides the parameters [each its unit].
    observe : callable, optional
        ``observe(state, inputs, parameters)``: the outputs, in their order; the states of the same names by default.
    initial : Mapping[str, Parameter or float]
        The states at the first sample [their units]: a number is held, a `Parameter` is fitted, separately for each
        log. A state that is not named is fitted from its first measured value, or from zero.
    held : tuple of str
        Inputs that are constant between samples, such as a controller's commands; the others are linear.

    Raises
    ------
    HydrostateError
        If names are no names, come twice, or do not fit together.
    """

    derivative: Derivative
    states: Mapping[str, str]
    inputs: Mapping[str, str]
    outputs: Mapping[str, str]
    parameters: Mapping[str, Parameter]
    known: Mapping[str, float] = field(default_factory=dict[str, float])
    observe: Derivative | None = None
    initial: Mapping[str, Parameter | float] = field(default_factory=dict[str, Parameter | float])
    held: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not callable(self.derivative):
            raise HydrostateError(
                f"derivative must be a function of state, inputs and parameters, got {self.derivative!r}"
            )
        for what, wanted in (("states", self.states), ("outputs", self.outputs), ("parameters", self.parameters)):
            if not wanted:
                raise HydrostateError(f"{what} must name one at least, got none")
        for what, names in (("state", self.states), ("input", self.inputs), ("parameter", self.every_parameter)):
            for name in names:
                _require_name(what, name)
        for name, one in self.parameters.items():
            if not isinstance(one, Parameter):  # pyright: ignore[reportUnnecessaryIsInstance] -- a user's slip
                raise HydrostateError(f"parameter {name!r} must be a Parameter, or a number that is known, got {one!r}")
        known = {name: _finite(f"parameter {name!r}", value) for name, value in self.known.items()}
        object.__setattr__(self, "known", known)
        twice = set(self.parameters) & set(self.known)
        if twice:
            raise HydrostateError(f"parameter {min(twice)!r} must be unknown or known, got both")
        if self.observe is None:
            strangers = [name for name in self.outputs if name not in self.states]
            if strangers:
                raise HydrostateError(
                    f"output {strangers[0]!r} must be a state ({', '.join(self.states)}), or observe= must compute it"
                )
        _require_among("initial", self.initial, self.states)
        _require_among("held", self.held, self.inputs)
        for name in ("states", "inputs", "outputs", "parameters", "known", "initial"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    def __getstate__(self) -> dict[str, Any]:
        return {name: dict(one) if isinstance(one, Mapping) else one for name, one in vars(self).items()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, one in state.items():
            object.__setattr__(self, name, MappingProxyType(one) if isinstance(one, dict) else one)

    @property
    def every_parameter(self) -> tuple[str, ...]:
        """Names of the fitted parameters, then of the known ones."""
        return (*self.parameters, *self.known)

    @property
    def free(self) -> tuple[str, ...]:
        """States whose initial value is fitted."""
        return tuple(name for name in self.states if isinstance(self.initial.get(name, Parameter(0.0)), Parameter))


def _require_name(what: str, name: object) -> None:
    if not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name) or name.startswith("_"):
        raise HydrostateError(f"a {what} must be named by letters, digits and underscores, got {name!r}")


def _require_among(what: str, names: Any, known: Mapping[str, str]) -> None:
    for name in names:
        if name not in known:
            raise HydrostateError(f"{what} names {name!r}, which is none of {', '.join(known) or 'none'}")
