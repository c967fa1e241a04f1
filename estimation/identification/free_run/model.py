"""`FreeRunModel`: an identified relation between any channels, simulated free, judged, saved and read again."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from estimation.arrays import Array
from estimation.identification.free_run.absolute_dynamics import AbsoluteDynamics
from estimation.identification.free_run.data import Scaling
from estimation.identification.free_run.dynamics import Dynamics, OutputErrorDynamics
from estimation.identification.free_run.error_model import ErrorModel
from estimation.identification.free_run.fallback import linear_stands_in
from estimation.identification.free_run.hammerstein_dynamics import HammersteinDynamics
from estimation.identification.free_run.limited_dynamics import LimitedDynamics
from estimation.identification.free_run.linear_dynamics import LinearDynamics
from estimation.identification.free_run.polynomial_dynamics import PolynomialDynamics
from estimation.identification.free_run.quality import FreeRun, FreeRunQuality
from estimation.identification.state_space.dynamics import StateSpaceDynamics
from plant.errors import HydrostateError
from plant.log.formats.cells import values_of

if TYPE_CHECKING:
    import control

    from estimation.identification.model.linear_model import LinearModel

FORMAT, VERSION = "hydrostate-model", 2
"""Format of a saved model, and its latest version: models with an error model. Others are written as version 1."""

KINDS: Mapping[str, Any] = {
    one.kind: one
    for one in (
        LinearDynamics,
        PolynomialDynamics,
        HammersteinDynamics,
        AbsoluteDynamics,
        LimitedDynamics,
        StateSpaceDynamics,
    )
}
"""Dynamics by their names in a saved model."""


@dataclass(frozen=True, eq=False)
class FreeRunModel:
    """A model from one or more inputs to one output.

    Parameters
    ----------
    inputs, output : tuple of str, str
        Names of the channels.
    sample_time : float
        Seconds between samples [s].
    structure : str
        How it was fitted: ``"output-error"``, ``"narx"``, ...
    scaling, dynamics : Scaling, Dynamics
        Scaling of the fitted data, and the dynamics between its scaled channels.
    linear : LinearModel, optional
        The transfer function with its covariance, for one input and a linear model.
    error_model : ErrorModel, optional
        What predicts part of the error of the dynamics; runs include it.
    """

    inputs: tuple[str, ...]
    output: str
    sample_time: float
    structure: str
    scaling: Scaling
    dynamics: Dynamics
    linear: "LinearModel | None" = field(default=None)
    error_model: ErrorModel | None = None

    @property
    def n_values(self) -> int:
        """Fitted coefficients."""
        return self.dynamics.n_values + (0 if self.error_model is None else self.error_model.n_values)

    @property
    def nonlinearity(self) -> dict[str, Any] | None:
        """Nonlinearity of the input or of the output, by kind and values in the channels' units, or None."""
        if isinstance(self.dynamics, HammersteinDynamics):
            return self.dynamics.nonlinearity(self.scaling)
        if isinstance(self.dynamics, PolynomialDynamics):
            return self.dynamics.nonlinearity(self.scaling, self.sample_time)
        if isinstance(self.dynamics, AbsoluteDynamics):
            return self.dynamics.nonlinearity(self.sample_time)
        if isinstance(self.dynamics, LimitedDynamics):
            return self.dynamics.limits.nonlinearity(self.scaling)
        return None

    def simulate(self, u: ArrayLike, y: ArrayLike | None = None) -> Array:
        """Return the free run of the model.

        Parameters
        ----------
        u : array_like, shape (n, m) or (n,)
            Inputs in the model's order, without gaps.
        y : array_like, shape (n,), optional
            Measured output, NaN where missing: only the initial state is estimated from it. Without it the run begins
            in the steady state of the first input for a linear model, and at the mean for a polynomial one.

        Returns
        -------
        ndarray, shape (n,)
            Output; NaN from where a polynomial model diverges.
        """
        return self.free_run(u, y).output

    def free_run(self, u: ArrayLike, y: ArrayLike | None = None) -> FreeRun:
        """Return the free run with what was decided on the way.

        Parameters
        ----------
        u : array_like, shape (n, m) or (n,)
            Inputs in the model's order, without gaps.
        y : array_like, shape (n,), optional
            See `simulate`.
        """
        inputs, outputs = self._scaled(u, y)
        errors: tuple[float, float] | None = None
        if isinstance(self.dynamics, PolynomialDynamics | HammersteinDynamics):
            run, errors = self.dynamics.judged_run(inputs, outputs)
        else:
            run = self.dynamics.run(inputs, outputs)
        left_out = False
        if self.error_model is not None and not linear_stands_in(errors):
            error = self.error_model.predicted(inputs, run)
            left_out, run = error is None, run if error is None else run + error
        return FreeRun(self.scaling.y_mean + self.scaling.y_std * run, errors, left_out)

    def predict(self, u: ArrayLike, y: ArrayLike) -> Array:
        """Return the prediction one step ahead from measured outputs, shape (n,); NaN where they are missing.

        Parameters
        ----------
        u : array_like, shape (n, m) or (n,)
            Inputs.
        y : array_like, shape (n,)
            Measured output.

        Returns
        -------
        ndarray, shape (n,)
            Output [output unit].
        """
        if self._predicts_freely:
            return self.simulate(u, y)
        inputs, outputs = self._scaled(u, y)
        if (noisy := self._noise_model) is not None:
            return noisy.predict(self.scaling.u_mean[0] + self.scaling.u_std[0] * inputs[:, 0], np.asarray(y))
        return self.scaling.y_mean + self.scaling.y_std * self.dynamics.one_step(inputs, outputs)

    @property
    def _noise_model(self) -> "LinearModel | None":
        """The transfer function if its model of noise predicts from measured outputs."""
        linear = self.linear if self.error_model is None else None
        return linear if linear is not None and linear.noise_denominator.size > 1 else None

    @property
    def _predicts_freely(self) -> bool:
        """Whether measured outputs do not improve the next prediction, which is then the free run."""
        return isinstance(self.dynamics, OutputErrorDynamics) and self._noise_model is None

    def quality(self, u: Sequence[Array], y: Sequence[Array]) -> FreeRunQuality:
        """Return the quality of the model on logs, without the first outputs that a long dead time leaves undetermined.

        Parameters
        ----------
        u : sequence of ndarray, shape (n, m)
            Inputs of each log.
        y : sequence of ndarray, shape (n,)
            Output of each log; NaN where missing.
        """
        return self.quality_and_runs(u, y)[0]

    def quality_and_runs(self, u: Sequence[Array], y: Sequence[Array]) -> tuple[FreeRunQuality, list[FreeRun]]:
        """Return the quality on logs, and the runs that it judges.

        Parameters
        ----------
        u : sequence of ndarray, shape (n, m)
            Inputs of each log.
        y : sequence of ndarray, shape (n,)
            Output of each log; NaN where missing.
        """
        measured = np.concatenate([self._without_undetermined(one) for one in y])
        runs = [self.free_run(one_u, one_y) for one_u, one_y in zip(u, y, strict=True)]
        free = ahead = np.concatenate([run.output for run in runs])
        if not self._predicts_freely:
            ahead = np.concatenate([self.predict(one_u, one_y) for one_u, one_y in zip(u, y, strict=True)])
        return FreeRunQuality.of(measured, free, ahead), runs

    def _without_undetermined(self, y: Array) -> Array:
        """Return an output without its first samples that depend, by a long dead time, on earlier inputs."""
        return np.where(np.arange(y.size) < self.dynamics.undetermined_outputs(y.size), np.nan, y)

    def _scaled(self, u: ArrayLike, y: ArrayLike | None) -> tuple[Array, Array]:
        try:
            inputs = np.asarray(values_of("input", u, "the inputs"))
            inputs = inputs.astype(np.float64, casting="same_kind" if np.iscomplexobj(inputs) else "unsafe")
        except (TypeError, ValueError):
            raise HydrostateError(f"inputs {', '.join(self.inputs)} must be numbers, got {u!r:.60}") from None
        inputs = inputs[:, None] if inputs.ndim == 1 else inputs
        if inputs.ndim != 2 or inputs.shape[1] != len(self.inputs):
            raise HydrostateError(
                f"inputs {', '.join(self.inputs)} are needed, shape (n, {len(self.inputs)}), got {inputs.shape}"
            )
        if not len(inputs):
            raise HydrostateError(f"inputs {', '.join(self.inputs)} are needed at one sample at least, got none")
        if not np.isfinite(inputs).all():
            row = int(np.argmax(~np.isfinite(inputs).all(axis=1)))
            raise HydrostateError(f"inputs {', '.join(self.inputs)} must be finite at every sample, row {row} is not")
        by = self.scaling
        outputs = np.full(inputs.shape[0], np.nan) if y is None else np.asarray(y, dtype=np.float64)
        if outputs.shape != inputs.shape[:1]:
            raise HydrostateError(
                f"input and output must be of one length, got {inputs.shape[0]} and {outputs.shape} samples"
            )
        return (inputs - by.u_mean) / by.u_std, (outputs - by.y_mean) / by.y_std

    def transfer_functions(self) -> list[tuple[Array, Array]]:
        """Return numerator and denominator from each input, in units of the channels.

        Returns
        -------
        list of tuple of ndarray
            In powers of the delay operator, dead time as leading zeros.

        Raises
        ------
        HydrostateError
            If the model is not linear.
        """
        dynamics = self.dynamics
        if not isinstance(dynamics, LinearDynamics | StateSpaceDynamics):
            raise HydrostateError(f"a {self.structure} model has no transfer function")
        factors = self.scaling.y_std / self.scaling.u_std
        return [(b * factor, f) for (b, f), factor in zip(dynamics.transfer_functions(), factors, strict=True)]

    @property
    def level(self) -> float:
        """Output of a linear model at rest with inputs at the data's means [output unit]; NaN for others."""
        if not isinstance(self.dynamics, LinearDynamics | StateSpaceDynamics):
            return float("nan")
        return self.scaling.y_mean + self.scaling.y_std * self.dynamics.level

    @property
    def offset(self) -> float:
        """Output at rest of a linear model whose inputs are zero [output unit]; NaN for others."""
        if not isinstance(self.dynamics, LinearDynamics | StateSpaceDynamics):
            return float("nan")
        gains = [float(b.sum() / f.sum()) for b, f in self.transfer_functions()]
        return self.level - float(np.dot(gains, self.scaling.u_mean))

    def padded_transfer_functions(self) -> tuple[list[Array], list[Array]]:
        """Return numerators and denominators of a linear model, one per input, padded with zeros."""
        both = self.transfer_functions()
        length = max(max(b.size, f.size) for b, f in both)
        numerators, denominators = ([np.pad(x, (0, length - x.size)) for x in one] for one in zip(*both, strict=True))
        return numerators, denominators

    def to_control(self) -> "control.TransferFunction":
        """Return a linear model as a python-control object, without offset, limits and error model."""
        import control

        numerators, denominators = self.padded_transfer_functions()
        return control.TransferFunction(
            [numerators], [denominators], self.sample_time, inputs=list(self.inputs), outputs=[self.output]
        )

    def to_dict(self) -> dict[str, Any]:
        """Return JSON values that `from_dict` reads."""
        by = self.scaling
        return {
            "format": FORMAT,
            "version": 1 if self.error_model is None else VERSION,
            "inputs": list(self.inputs),
            "output": self.output,
            "sample_time_s": self.sample_time,
            "structure": self.structure,
            "kind": self.dynamics.kind,
            "scaling": {
                "u_mean": by.u_mean.tolist(),
                "u_std": by.u_std.tolist(),
                "y_mean": by.y_mean,
                "y_std": by.y_std,
            },
            "body": self.dynamics.to_dict(),
            **({} if self.error_model is None else {"error_model": self.error_model.to_dict()}),
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "FreeRunModel":
        """Return the model that `to_dict` wrote.

        Raises
        ------
        HydrostateError
            If it is no such model, or one of a later version.
        """
        if values.get("format") != FORMAT or int(values.get("version", 0)) > VERSION:
            raise HydrostateError(
                f"a saved model of format {FORMAT!r}, version {VERSION} at most, is needed, got "
                f"{values.get('format')!r}, version {values.get('version')}"
            )
        try:
            by = values["scaling"]
            scaling = Scaling(np.array(by["u_mean"]), np.array(by["u_std"]), float(by["y_mean"]), float(by["y_std"]))
            dynamics = KINDS[values["kind"]].from_dict(values["body"])
            names = (tuple(values["inputs"]), str(values["output"]))
            told, sizes = values.get("error_model"), (float(values["sample_time_s"]), str(values["structure"]))
            error_model = None if told is None else ErrorModel.from_dict(told, len(names[0]))
            return cls(*names, *sizes, scaling, dynamics, error_model=error_model)
        except (KeyError, TypeError, ValueError) as error:
            raise HydrostateError(f"a saved model is not usable: {type(error).__name__} {error}") from error
