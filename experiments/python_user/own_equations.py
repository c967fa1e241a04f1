"""A user's own equations in Python: written, fitted, printed, drawn and simulated."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from estimation.equations.definition import Equations, Parameter
from experiments.python_user.answers import Shown
from experiments.python_user.fitted_equations import FittedGreyBox, record_of, times_of
from plant.errors import HydrostateError

if TYPE_CHECKING:
    import pandas as pd


class GreyBox(Shown):
    """Equations with unknown parameters, to be fitted to logs.

    Parameters
    ----------
    derivative : callable
        ``derivative(state, inputs, parameters)``: the time derivatives of the states, in the states' order. NumPy
        functions may be used; a choice that depends on a state needs ``np.where`` instead of ``if``.
    states, inputs, outputs : Mapping[str, str] or sequence of str
        Names, with or without units. Inputs and outputs are channels of the log; outputs are states unless ``observe``
        computes them.
    parameters : Mapping[str, Parameter or float]
        Parameters to fit, and known numbers [each its unit].
    observe : callable, optional
        ``observe(state, inputs, parameters)``: the outputs, in their order.
    initial : Mapping[str, Parameter or float], optional
        The states at the first sample [their units]: fixed if a number is given, otherwise fitted separately for each
        log.
    held : sequence of str
        Inputs that are constant between samples, such as a controller's commands; the others are interpolated linearly.

    Raises
    ------
    HydrostateError
        If names or functions do not match.

    Examples
    --------
    >>> def cooling(state, inputs, p):
    ...     return -p.rate * (state.warm - inputs.room)
    >>> GreyBox(cooling, states=["warm"], inputs=["room"], outputs=["warm"], parameters={"rate": Parameter(0.1)})
    GreyBox of warm, driven by room, with unknown rate
    """

    def __init__(
        self,
        derivative: Callable[[Any, Any, Any], Any],
        *,
        states: Mapping[str, str] | Sequence[str],
        inputs: Mapping[str, str] | Sequence[str] = (),
        outputs: Mapping[str, str] | Sequence[str],
        parameters: Mapping[str, Parameter | float],
        observe: Callable[[Any, Any, Any], Any] | None = None,
        initial: Mapping[str, Parameter | float] | None = None,
        held: Sequence[str] = (),
    ) -> None:
        from estimation.equations.kernel import traceable

        if not isinstance(parameters, Mapping):  # pyright: ignore[reportUnnecessaryIsInstance] -- a user's slip
            raise HydrostateError(f"parameters must be a mapping of names, got {parameters!r}")
        units = _named("states", states)
        self.equations = Equations(
            derivative,
            states=units,
            inputs=_named("inputs", inputs),
            outputs={
                name: unit if unit != "1" else units.get(name, "1") for name, unit in _named("outputs", outputs).items()
            },
            parameters={name: one for name, one in parameters.items() if isinstance(one, Parameter)},
            known={name: one for name, one in parameters.items() if not isinstance(one, Parameter)},
            observe=observe,
            initial=dict(initial or {}),
            held=(held,) if isinstance(held, str) else tuple(held),
        )
        traceable(self.equations)

    def __str__(self) -> str:
        model = self.equations
        driven = f", driven by {', '.join(model.inputs)}" if model.inputs else ""
        return f"GreyBox of {', '.join(model.states)}{driven}, with unknown {', '.join(model.parameters)}"

    def fit(
        self,
        *logs: Any,
        noise: Mapping[str, float] | None = None,
        robust: bool = False,
        starts: int = 1,
        seed: int = 0,
    ) -> FittedGreyBox:
        """Fit the parameters to one log or several.

        Parameters
        ----------
        *logs : Log, Record or pandas.DataFrame
            With the inputs and outputs as channels; a table's time is its index, or a column that is named so.
        noise : Mapping[str, float], optional
            Standard deviation of an output's noise [its unit], if it is known.
        robust : bool
            Whether large residuals enter the cost linearly, so that outliers count less.
        starts : int
            Number of starts of the search; those after the first are drawn within the bounds.
        seed : int
            Seed of these random starts.

        Returns
        -------
        FittedGreyBox
            Values with intervals, whether to believe them, and what the logs do not determine.

        Raises
        ------
        HydrostateError
            If a log lacks a channel, an input has gaps, or the equations diverge.
        """
        from estimation.equations.fit import fit_equations

        records = [record_of(one) for one in logs]
        return FittedGreyBox(
            fit_equations(self.equations, records, noise=noise, robust=robust, starts=starts, seed=seed), records
        )

    def simulate(
        self, log: Any, values: Mapping[str, float] | None = None, initial: Mapping[str, float] | None = None
    ) -> "pd.DataFrame":
        """Return the outputs of the equations for given parameters.

        Parameters
        ----------
        log : Log, Record or pandas.DataFrame
            Must contain the inputs.
        values : Mapping[str, float], optional
            Parameters [their units]; omitted ones take their start values.
        initial : Mapping[str, float], optional
            The states at the first sample [their units]; omitted ones start as in a fit, or at zero.

        Returns
        -------
        pandas.DataFrame
            One column for each output, by time [s].
        """
        import pandas as pd

        from estimation.equations.fit import simulated_outputs

        record = record_of(log)
        found = simulated_outputs(self.equations, record, values or {}, initial or {})
        return pd.DataFrame(dict(found), index=times_of(log, record))


def _named(what: str, names: Any) -> dict[str, str]:
    """Return names with their units; ``"1"`` if no unit is given."""
    if isinstance(names, Mapping):
        return {str(name): str(unit) for name, unit in names.items()}
    if isinstance(names, str) or not isinstance(names, Sequence):
        raise HydrostateError(f"{what} must be a mapping of names to units, or a list of names, got {names!r}")
    twice = [name for place, name in enumerate(names) if name in names[:place]]
    if twice:
        raise HydrostateError(f"{what} must have names of their own, got {twice[0]!r} twice")
    return dict.fromkeys(names, "1")
