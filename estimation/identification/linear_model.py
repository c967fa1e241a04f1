"""`LinearModel`: an identified discrete transfer function with everything needed to believe it, or not."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq
from scipy.signal import freqz, lfilter

from plant.errors import HydrostateError

if TYPE_CHECKING:
    import control

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def _frozen(values: ArrayLike) -> FloatArray:
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array


def _nothing() -> FloatArray:
    return np.empty(0)


@dataclass(frozen=True, eq=False)
class LinearModel:
    """The transfer function ``y = B(q) / F(q) u`` in powers of the delay operator, with its uncertainty.

    Parameters
    ----------
    numerator : ndarray, shape (delay + n_numerator,)
        ``b``: coefficients of ``q^0, q^-1, ...``, output unit per input unit; the first `delay` are zero.
    denominator : ndarray, shape (n_denominator + 1,)
        ``f``: monic, coefficients of ``q^0, q^-1, ...``.
    sample_time : float
        Seconds between samples [s].
    input_name, output_name : str
        Channel names, which carry the units (``motor_speed_rad_s``).
    delay : int
        Dead time in samples.
    covariance : ndarray, shape (p, p), p = n_numerator + n_denominator
        Of ``[b[delay:], f[1:]]``; NaN, as by default, where it is not known (a published model).
    initial_state : ndarray, shape (max(len(numerator), len(denominator)) - 1,)
        State at the first sample of the data that the model was fitted to, in the output's unit, as
        `scipy.signal.lfilter` takes it; zero by default.
    fit_percent, rmse, residual_std : float
        Normalised fit, root-mean-square residual, and residual deviation with the degrees of freedom counted
        [output unit]; NaN where nothing was fitted.
    n_samples : int
        Output samples used.
    data_hash : str
        SHA-256 of the data used; empty where nothing was fitted.

    Raises
    ------
    HydrostateError
        If the sample time is not positive, the denominator is not monic, a coefficient is not finite, or
        shapes disagree.

    Examples
    --------
    >>> model = LinearModel([0.0, 0.2], [1.0, -0.8], 0.01, "motor_speed_rad_s", "velocity_m_s", delay=1)
    >>> round(model.dc_gain, 12)
    1.0
    >>> model.simulate(np.ones(3)).round(3).tolist()
    [0.0, 0.2, 0.36]
    """

    numerator: FloatArray
    denominator: FloatArray
    sample_time: float
    input_name: str
    output_name: str
    delay: int = 0
    covariance: FloatArray = field(default_factory=_nothing)
    initial_state: FloatArray = field(default_factory=_nothing)
    fit_percent: float = float("nan")
    rmse: float = float("nan")
    residual_std: float = float("nan")
    n_samples: int = 0
    data_hash: str = ""

    def __post_init__(self) -> None:
        b, f = _frozen(self.numerator), _frozen(self.denominator)
        if not (np.isfinite(self.sample_time) and self.sample_time > 0.0):
            raise HydrostateError(f"sample_time must be positive and finite, got {self.sample_time!r}")
        if b.ndim != 1 or f.ndim != 1 or not (np.isfinite(b).all() and np.isfinite(f).all()):
            raise HydrostateError("numerator and denominator must be one-dimensional and finite")
        if f.size < 1 or f[0] != 1.0:
            raise HydrostateError(f"denominator must be monic (begin with 1), got {f.tolist()}")
        if not 0 <= self.delay < b.size or b[: self.delay].any():
            raise HydrostateError(f"numerator must begin with {self.delay} zeros for the delay, got {b.tolist()}")
        p, n_states = b.size - self.delay + f.size - 1, max(b.size, f.size) - 1
        covariance = _frozen(np.full((p, p), np.nan) if np.size(self.covariance) == 0 else self.covariance)
        state = _frozen(np.zeros(n_states) if np.size(self.initial_state) == 0 else self.initial_state)
        if covariance.shape != (p, p):
            raise HydrostateError(f"covariance must have shape {(p, p)}, got {covariance.shape}")
        if state.shape != (n_states,):
            raise HydrostateError(f"initial_state must have shape {(n_states,)}, got {state.shape}")
        checked = {"numerator": b, "denominator": f, "covariance": covariance, "initial_state": state}
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    @property
    def poles(self) -> ComplexArray:
        """Roots of the denominator in z, slowest first, shape (n_denominator,); dead-time poles left out."""
        roots = np.roots(self.denominator).astype(np.complex128)
        return roots[np.argsort(-np.abs(roots), kind="stable")]

    @property
    def zeros(self) -> ComplexArray:
        """Roots of the numerator in z, largest first, shape (n_numerator - 1,) at most."""
        roots = np.roots(self.numerator[self.delay :]).astype(np.complex128)
        return roots[np.argsort(-np.abs(roots), kind="stable")]

    @property
    def is_stable(self) -> bool:
        """Whether every pole lies inside the unit circle."""
        return bool((np.abs(self.poles) < 1.0).all())

    @property
    def dc_gain(self) -> float:
        """Steady-state gain ``B(1) / F(1)`` [output unit per input unit]."""
        return float(self.numerator.sum() / self.denominator.sum())

    @property
    def dc_gain_std(self) -> float:
        """Standard deviation of `dc_gain`, first order in the covariance (delta method).

        Too small where a pole nearly cancels a zero, since the gain is then far from linear in the
        coefficients.
        """
        f_at_one = self.denominator.sum()
        n_b = self.numerator.size - self.delay
        gradient = np.full(self.covariance.shape[0], 1.0 / f_at_one)
        gradient[n_b:] = -self.dc_gain / f_at_one
        return float(np.sqrt(gradient @ self.covariance @ gradient))

    @property
    def coefficient_std(self) -> FloatArray:
        """Standard deviations of ``[b[delay:], f[1:]]``, shape (p,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def bandwidth_hz(self) -> float | None:
        """Lowest frequency at which the gain is 3 dB below `dc_gain` [Hz]; None if it never is."""
        wanted = abs(self.dc_gain) / np.sqrt(2.0)
        nyquist = 0.5 / self.sample_time
        grid = nyquist * np.concatenate([np.logspace(-5.0, -2.0, 300), np.linspace(0.01, 1.0, 2000)[1:]])
        below = np.flatnonzero(np.abs(self.frequency_response(grid)) < wanted)
        if below.size == 0:
            return None
        if below[0] == 0:
            return float(grid[0])

        def excess(frequency: float) -> float:
            return float(np.abs(self.frequency_response(np.array([frequency]))[0]) - wanted)

        return float(brentq(excess, float(grid[below[0] - 1]), float(grid[below[0]])))

    def frequency_response(self, frequency_hz: ArrayLike) -> ComplexArray:
        """Return the response at given frequencies.

        Parameters
        ----------
        frequency_hz : array_like, shape (k,)
            Frequencies [Hz].

        Returns
        -------
        ndarray of complex, shape (k,)
            ``B / F`` on the unit circle [output unit per input unit].
        """
        omega = 2.0 * np.pi * np.asarray(frequency_hz, dtype=np.float64) * self.sample_time
        return np.asarray(freqz(self.numerator, self.denominator, worN=omega)[1], dtype=np.complex128)

    def simulate(self, u: ArrayLike, initial: ArrayLike | None = None) -> FloatArray:
        """Return the model's output for an input.

        Parameters
        ----------
        u : array_like, shape (n,)
            Input on the model's sample time.
        initial : array_like, shape (len(initial_state),), or None
            State before the first sample; None is rest. ``model.initial_state`` reproduces the fitted run,
            and `estimation.identification.validate.estimate_initial_state` finds the one of another log.

        Returns
        -------
        ndarray, shape (n,)
            Output [output unit].
        """
        values = np.asarray(u, dtype=np.float64)
        state = np.zeros_like(self.initial_state) if initial is None else np.asarray(initial, dtype=np.float64)
        return np.asarray(lfilter(self.numerator, self.denominator, values, zi=state)[0], dtype=np.float64)

    def to_control(self) -> "control.TransferFunction":
        """Return the model as a python-control object, with sample time and signal names."""
        import control  # slow to import, and few callers need it

        length = max(self.numerator.size, self.denominator.size)
        numerator = np.pad(self.numerator, (0, length - self.numerator.size))
        denominator = np.pad(self.denominator, (0, length - self.denominator.size))
        return control.TransferFunction(
            numerator, denominator, self.sample_time, inputs=[self.input_name], outputs=[self.output_name]
        )

    def to_dict(self) -> dict[str, Any]:
        """Return JSON values at full precision, None for a number not known; `from_dict` is the inverse."""
        return {
            "numerator": self.numerator.tolist(),
            "denominator": self.denominator.tolist(),
            "sample_time_s": self.sample_time,
            "input": self.input_name,
            "output": self.output_name,
            "delay_samples": self.delay,
            "fit_percent": _or_none(self.fit_percent),
            "covariance": [[_or_none(value) for value in row] for row in self.covariance.tolist()],
            "initial_state": self.initial_state.tolist(),
            "rmse": _or_none(self.rmse),
            "residual_std": _or_none(self.residual_std),
            "n_samples": self.n_samples,
            "data_hash": self.data_hash,
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "LinearModel":
        """Return the model that `to_dict` wrote.

        Parameters
        ----------
        values : Mapping[str, Any]
            As `to_dict` returns, or as read back from JSON.

        Returns
        -------
        LinearModel
            Equal in every bit.

        Raises
        ------
        HydrostateError
            If an entry is missing, or one is not usable.
        """
        try:
            return cls(
                numerator=_frozen(values["numerator"]),
                denominator=_frozen(values["denominator"]),
                sample_time=values["sample_time_s"],
                input_name=values["input"],
                output_name=values["output"],
                delay=values["delay_samples"],
                covariance=np.array(values["covariance"], dtype=np.float64),
                initial_state=_frozen(values["initial_state"]),
                fit_percent=_or_nan(values["fit_percent"]),
                rmse=_or_nan(values["rmse"]),
                residual_std=_or_nan(values["residual_std"]),
                n_samples=values["n_samples"],
                data_hash=values["data_hash"],
            )
        except KeyError as error:
            raise HydrostateError(f"entry {error} of a linear model is wanted, got {', '.join(values)}") from error


def _or_none(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _or_nan(value: float | None) -> float:
    return float("nan") if value is None else value


def model_table(models: Mapping[str, LinearModel]) -> pd.DataFrame:
    """Return one row a model: coefficients, poles, gain with its deviation, bandwidth, and quality of fit.

    Parameters
    ----------
    models : Mapping[str, LinearModel]
        Models by name, e.g. of a condition.

    Returns
    -------
    pandas.DataFrame
        Indexed by name; ``b0, b1, ..., f1, ...``, ``pole_1, ...`` (complex), ``dc_gain``, ``dc_gain_std``,
        ``bandwidth_hz``, ``fit_percent``, ``rmse``, ``residual_std``, ``n_samples``, ``sample_time_s``,
        ``input``, ``output``. NaN where a model has no such entry.
    """
    return pd.DataFrame.from_dict({name: _row(model) for name, model in models.items()}, orient="index")


def _row(model: LinearModel) -> dict[str, Any]:
    row: dict[str, Any] = {f"b{k}": value for k, value in enumerate(model.numerator.tolist())}
    row |= {f"f{k}": value for k, value in enumerate(model.denominator.tolist()) if k > 0}
    row |= {f"pole_{k + 1}": complex(pole) for k, pole in enumerate(model.poles)}
    bandwidth = model.bandwidth_hz
    return row | {
        "dc_gain": model.dc_gain,
        "dc_gain_std": model.dc_gain_std,
        "bandwidth_hz": float("nan") if bandwidth is None else bandwidth,
        "fit_percent": model.fit_percent,
        "rmse": model.rmse,
        "residual_std": model.residual_std,
        "n_samples": model.n_samples,
        "sample_time_s": model.sample_time,
        "input": model.input_name,
        "output": model.output_name,
    }
