"""An identified model together with the log on which it is shown, for channels of a test bench or any columns."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from estimation.arrays import Array, ComplexArray
from estimation.identification.fit.residual_tests import cross_correlation_test, ljung_box
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.search.criterion import Structure, sensitivities
from experiments.log_pages.channel_charts import SHOWN_IN, plain_channel
from plant.errors import HydrostateError
from plant.log.columns import UNITS

if TYPE_CHECKING:
    from estimation.identification.free_run.data import Channels
    from estimation.identification.free_run.model import FreeRunModel

MOST_TESTED = 50_000
"""Largest number of samples passed to the residual tests [count]."""

AS_LOGGED = "as logged"
"""Unit shown for a column that is not a known channel."""


@dataclass(frozen=True, eq=False)
class Signal:
    """A channel or column, as a page names it.

    Parameters
    ----------
    unit : str
        As shown; `AS_LOGGED` if it is unknown.
    scale : float
        Factor from the log's unit to the shown unit [dimensionless].
    """

    name: str
    unit: str
    scale: float

    @classmethod
    def of(cls, name: str) -> "Signal":
        """Return a channel in the unit used in workshops; any other column keeps the log's unit."""
        if name not in UNITS:
            return cls(name, AS_LOGGED, 1.0)
        unit, scale = SHOWN_IN.get(UNITS[name], (UNITS[name], 1.0))
        return cls(plain_channel(name), unit, scale)

    def amount(self, text: str) -> str:
        """Return a number with its unit, if the unit is known."""
        return text if self.unit == AS_LOGGED else f"{text} {self.unit}"


@dataclass(frozen=True, eq=False)
class IdentifiedView:
    """A model on one log.

    Parameters
    ----------
    result : Mapping
        Entries of `hydrostate identify`; file names have no folders.
    inputs, output : tuple of Signal, Signal
        The signals that the model relates.
    sample_time : float
        Sample time of the model and of the series [s].
    u, y, simulated : ndarray, shapes (n, m), (n,), (n,)
        Inputs, output and free run [in the log's units]; NaN if missing. All of an unstable free run is NaN.
    linear : LinearModel or None
        The model with its covariance, if it is linear and has one input.
    transfers : tuple of tuple of ndarray, shapes (n_b,) and (n_f,)
        Numerator and denominator from each input, in powers of the delay operator; empty for other models.
    run : callable
        Returns the output [its unit] for inputs of shape (n, m) that were held at their first values before the start.
    whiteness_p, cross_correlation_p : float or None
        p-values of the residual tests [probability]; None if a test was not made.
    """

    result: Mapping[str, Any]
    inputs: tuple[Signal, ...]
    output: Signal
    sample_time: float
    u: Array
    y: Array
    simulated: Array
    linear: LinearModel | None
    transfers: tuple[tuple[Array, Array], ...]
    run: Callable[[Array], Array]
    whiteness_p: float | None
    cross_correlation_p: float | None

    @property
    def is_linear(self) -> bool:
        """Whether the model has a transfer function."""
        return self.linear is not None or bool(self.transfers)

    @property
    def residual(self) -> Array:
        """Measured minus simulated output, shape (n,) [output unit]."""
        return self.y - self.simulated

    def gain_unit(self, number: int) -> tuple[float, str]:
        """Return the unit in which the response to an input is shown: the factor from the log's unit, and its name."""
        above, below = self.output, self.inputs[number]
        if AS_LOGGED in (above.unit, below.unit):
            return 1.0, AS_LOGGED
        return above.scale / below.scale, f"{_bracketed(above.unit)}/{_bracketed(below.unit)}"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the inputs as in the log."""
        return tuple(self.result.get("inputs") or (self.result["input"],))

    def response(self, number: int, frequency: Array) -> ComplexArray:
        """Return the frequency response to an input.

        Parameters
        ----------
        frequency : ndarray, shape (k,)
            Positive frequencies [Hz].

        Returns
        -------
        ndarray of complex, shape (k,)
            In the log's units.
        """
        if self.linear is not None:
            return self.linear.frequency_response(frequency)
        b, f = self.transfers[number]
        shift = np.exp(-2j * np.pi * frequency * self.sample_time)
        return np.asarray(np.polyval(b[::-1], shift) / np.polyval(f[::-1], shift), dtype=np.complex128)


def view_of_channels(result: Mapping[str, Any], model: LinearModel, u: Array, y: Array) -> IdentifiedView:
    """Return the view of a transfer function between two channels, on the log used for the fit.

    Parameters
    ----------
    result : Mapping
        Entries of the model, with the p-values of its tests.
    u, y : ndarray, shape (n,)
        Input without gaps, and output with NaN for missing samples [in the channels' units].
    """
    stable = model.is_stable
    discrete = model.discretised() if model.continuous else model
    simulated = model.simulate(u, initial=model.initial_state) if stable else np.full(u.size, np.nan)
    tests = result["validation"]
    return IdentifiedView(
        result=_without_folders(result),
        inputs=(Signal.of(model.input_name),),
        output=Signal.of(model.output_name),
        sample_time=model.sample_time,
        u=u[:, None],
        y=y,
        simulated=simulated,
        linear=model,
        transfers=((discrete.numerator, discrete.denominator),),
        run=lambda inputs: model.simulate(inputs[:, 0] - inputs[0, 0]),
        whiteness_p=tests["whiteness_p"],
        cross_correlation_p=tests["cross_correlation_p"],
    )


def view_of_columns(result: Mapping[str, Any], model: "FreeRunModel", data: "Channels") -> IdentifiedView:
    """Return the view of a model between any columns, on the longest of its logs.

    Parameters
    ----------
    data : Channels
        The data used for the fit.
    """
    longest = int(np.argmax([one.size for one in data.y]))
    u, y = data.u[longest], data.y[longest]
    simulated = model.simulate(u, y)
    residual, part = y - simulated, slice(0, MOST_TESTED)
    return IdentifiedView(
        result=_without_folders(result),
        inputs=tuple(map(Signal.of, model.inputs)),
        output=Signal.of(model.output),
        sample_time=model.sample_time,
        u=u,
        y=y,
        simulated=simulated,
        linear=model.linear,
        transfers=_transfers(model),
        run=lambda inputs: model.simulate(inputs),
        whiteness_p=_p_value(lambda: ljung_box(residual[part]).p_value),
        cross_correlation_p=_p_value(lambda: _cross_correlation(model, u[part, 0], residual[part])),
    )


def _transfers(model: "FreeRunModel") -> tuple[tuple[Array, Array], ...]:
    try:
        return tuple(model.transfer_functions())
    except HydrostateError:
        return ()


def _p_value(found: Callable[[], float | None]) -> float | None:
    """Return a p-value, or None if the residual is missing or too short."""
    try:
        return found()
    except HydrostateError:
        return None


def _cross_correlation(model: "FreeRunModel", u: Array, residual: Array) -> float | None:
    """Return the p-value of an output-error model with one input; None otherwise.

    For other fits it is not known what they absorbed.
    """
    linear = model.linear
    if linear is None or linear.structure != "output-error":
        return None
    structure = Structure(linear.free_numerator.size, linear.denominator.size - 1, linear.delay)
    theta = np.concatenate([linear.free_numerator, linear.denominator[1:], linear.initial_state])
    absorbed = np.column_stack([sensitivities(structure, theta, u), np.ones(u.size)])
    return cross_correlation_test(residual, u, jacobian=absorbed).p_value


def _without_folders(result: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries with folders removed from file names, because pages are passed on to others."""
    names = ", ".join(Path(one).name for one in str(result["file"]).split(", "))
    test = result.get("test")
    return {**result, "file": names, **({"test": _test_without_folders(test)} if test else {})}


def _bracketed(unit: str) -> str:
    return f"({unit})" if "/" in unit else unit


def _test_without_folders(test: Mapping[str, Any]) -> dict[str, Any]:
    files: Sequence[str] = test["files"]
    return {**test, "files": [Path(one).name for one in files]}
