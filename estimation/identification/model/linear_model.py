"""`LinearModel`: an identified transfer function with its uncertainty and everything needed to judge it."""

from dataclasses import dataclass, field
from typing import overload

import numpy as np
from numpy.typing import ArrayLike

from estimation.arrays import Array, ComplexArray
from estimation.identification.model.bandwidth import bandwidth, bandwidth_std
from estimation.identification.model.export import from_dict, to_control, to_dict, to_mat, to_ss
from estimation.identification.model.held_input import held_input_model
from estimation.identification.model.recursion import filtered
from estimation.identification.model.uncertainty import (
    Cancellation,
    ResponseBand,
    cancellations,
    complex_std,
    response_band,
    root_gradients,
    sorted_roots,
)
from plant.errors import HydrostateError


def _read_only(values: ArrayLike) -> Array:
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array


def _empty_array() -> Array:
    return np.empty(0)


def _unit_polynomial() -> Array:
    return np.ones(1)


@dataclass(frozen=True, eq=False)
class LinearModel:
    """The transfer function ``y = B/F u + C/D e`` with its uncertainty.

    In discrete time the polynomials are in powers of the delay operator; in continuous time (`continuous`) in
    descending powers of s, and dead time is `dead_time` instead of leading zeros.

    Parameters
    ----------
    numerator : ndarray, shape (delay + n_numerator,)
        ``b``: coefficients of ``q^0, q^-1, ...``, output unit per input unit; the first `delay` are zero.
    denominator : ndarray, shape (n_denominator + 1,)
        ``f``: monic, coefficients of ``q^0, q^-1, ...``.
    sample_time : float
        Seconds between samples [s]; of the data, if the model is in continuous time.
    input_name, output_name : str
        Channel names, which carry the units (``motor_speed_rad_s``).
    covariance : ndarray, shape (p, p), p = n_numerator + n_denominator
        Of ``[b[delay:], f[1:]]``, the one that deviations are taken from; NaN by default: not known.
    initial_state : ndarray, shape (max(len(numerator), len(denominator)) - 1,)
        State at the first sample of the (first) fitted record, in the output's unit, as `scipy.signal.lfilter` takes
        it; zero by default.
    fit_percent, rmse, residual_std : float
        Fit and root-mean-square error of the free run, and deviation of the residual (one step ahead, where C or D is
        fitted) with the degrees of freedom counted [output unit]; NaN where nothing was fitted.
    data_hash : str
        SHA-256 of the data used; empty where nothing was fitted.
    covariance_white, covariance_robust : ndarray, shape (p, p)
        As `covariance`: for a white residual, and robust where it is coloured.
    structure : str
        How the model was fitted: ``"output-error"``, ``"ARX"``, ...; empty where it was not.
    noise_numerator, noise_denominator : ndarray, shapes (n_c + 1,) and (n_d + 1,)
        ``C`` and ``D``, monic; 1 by default.
    dead_time : float
        Of a model in continuous time [s].
    dead_time_std : float
        Its standard deviation [s]; NaN where it was not fitted.
    offset, one_step_rmse : float
        Output at rest where the input is zero; error one step ahead, NaN without C and D [output unit].

    Raises
    ------
    HydrostateError
        If the sample time is not positive, a polynomial not monic or not finite, or shapes disagree.

    Examples
    --------
    >>> model = LinearModel([0.0, 0.2], [1.0, -0.8], 0.01, "motor_speed_rad_s", "velocity_m_s", delay=1)
    >>> round(model.dc_gain, 12)
    1.0
    >>> model.simulate(np.ones(3)).round(3).tolist()
    [0.0, 0.2, 0.36]
    """

    numerator: Array
    denominator: Array
    sample_time: float
    input_name: str
    output_name: str
    delay: int = 0
    covariance: Array = field(default_factory=_empty_array)
    initial_state: Array = field(default_factory=_empty_array)
    fit_percent: float = float("nan")
    rmse: float = float("nan")
    residual_std: float = float("nan")
    n_samples: int = 0
    data_hash: str = ""
    covariance_white: Array = field(default_factory=_empty_array)
    covariance_robust: Array = field(default_factory=_empty_array)
    structure: str = ""
    noise_numerator: Array = field(default_factory=_unit_polynomial)
    noise_denominator: Array = field(default_factory=_unit_polynomial)
    continuous: bool = False
    dead_time: float = 0.0
    dead_time_std: float = float("nan")
    offset: float = 0.0
    one_step_rmse: float = float("nan")

    to_control, to_ss, to_dict, to_mat = to_control, to_ss, to_dict, to_mat
    from_dict = classmethod(from_dict)

    def __post_init__(self) -> None:
        b, f = _read_only(self.numerator), _read_only(self.denominator)
        if not (np.isfinite(self.sample_time) and self.sample_time > 0.0):
            raise HydrostateError(f"sample_time must be positive and finite, got {self.sample_time!r}")
        if b.ndim != 1 or f.ndim != 1 or not (np.isfinite(b).all() and np.isfinite(f).all()):
            raise HydrostateError("numerator and denominator must be one-dimensional and finite")
        if f.size < 1 or f[0] != 1.0:
            raise HydrostateError(f"denominator must be monic (begin with 1), got {f.tolist()}")
        if not 0 <= self.delay < b.size or b[: self.delay].any():
            raise HydrostateError(f"numerator must begin with {self.delay} zeros for the delay, got {b.tolist()}")
        p, n_states = b.size - self.delay + f.size - 1, max(b.size, f.size) - 1
        state = _read_only(np.zeros(n_states) if np.size(self.initial_state) == 0 else self.initial_state)
        if state.shape != (n_states,):
            raise HydrostateError(f"initial_state must have shape {(n_states,)}, got {state.shape}")
        checked = {"numerator": b, "denominator": f, "initial_state": state}
        for name in ("covariance", "covariance_white", "covariance_robust"):
            given = getattr(self, name)
            value = _read_only(np.full((p, p), np.nan) if np.size(given) == 0 else given)
            if value.shape != (p, p):
                raise HydrostateError(f"{name} must have shape {(p, p)}, got {value.shape}")
            checked[name] = value
        for name in ("noise_numerator", "noise_denominator"):
            checked[name] = _read_only(getattr(self, name))
            if checked[name].ndim != 1 or checked[name].size < 1 or checked[name][0] != 1.0:
                raise HydrostateError(f"{name} must be monic (begin with 1), got {checked[name].tolist()}")
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    @property
    def free_numerator(self) -> Array:
        """Numerator after its dead time, shape (n_numerator,)."""
        return self.numerator[self.delay :]

    @property
    def poles(self) -> ComplexArray:
        """Roots of the denominator in z (or s), largest modulus first, shape (n_denominator,); without dead time."""
        return sorted_roots(self.denominator)

    @property
    def zeros(self) -> ComplexArray:
        """Roots of the numerator in z (or s), largest first, shape (n_numerator - 1,) at most."""
        return sorted_roots(self.free_numerator)

    @property
    def pole_std(self) -> ComplexArray:
        """Standard deviations of the poles' real and imaginary parts, as one complex number each."""
        n_b = self.free_numerator.size
        gradients = root_gradients(self.denominator, self.poles)[:, 1:]
        return complex_std(gradients, self.covariance[n_b:, n_b:])

    @property
    def zero_std(self) -> ComplexArray:
        """Standard deviations of the zeros' real and imaginary parts, as one complex number each."""
        n_b = self.free_numerator.size
        return complex_std(root_gradients(self.free_numerator, self.zeros), self.covariance[:n_b, :n_b])

    @property
    def cancellations(self) -> tuple[Cancellation, ...]:
        """Poles that a zero may cancel, within the accuracy of the data; intervals then need `dc_gain_interval`."""
        return cancellations(self.free_numerator, self.denominator, self.covariance, 0.0 if self.continuous else 1.0)

    @property
    def is_stable(self) -> bool:
        """Whether every pole lies inside the unit circle, or left of the imaginary axis."""
        return bool(((self.poles.real < 0.0) if self.continuous else (np.abs(self.poles) < 1.0)).all())

    @property
    def dc_gain(self) -> float:
        """Steady-state gain [output unit per input unit]."""
        if self.continuous:
            return float(self.numerator[-1] / self.denominator[-1])
        return float(self.numerator.sum() / self.denominator.sum())

    @property
    def dc_gain_std(self) -> float:
        """Standard deviation of `dc_gain`, first order in the covariance (delta method).

        It is too small if a pole nearly cancels a zero: see `cancellations` and `dc_gain_interval`.
        """
        return float(self.frequency_response([0.0], ci=0.95).gain_std[0])

    @property
    def coefficient_std(self) -> Array:
        """Standard deviations of ``[b[delay:], f[1:]]``, shape (p,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def bandwidth_hz(self) -> float | None:
        """Lowest frequency at which the gain is 3 dB below `dc_gain` [Hz]; None if there is none."""
        return bandwidth(self)

    @property
    def bandwidth_std_hz(self) -> float | None:
        """Standard deviation of `bandwidth_hz` [Hz], first order in the covariance; None if there is no bandwidth."""
        return bandwidth_std(self)

    def response_gradient(self, frequency_hz: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Return the response, and its derivative by the coefficients.

        Parameters
        ----------
        frequency_hz : array_like, shape (k,)
            Frequencies [Hz].

        Returns
        -------
        response : ndarray of complex, shape (k,)
            ``B / F`` [output unit per input unit].
        gradient : ndarray of complex, shape (k, p)
            By ``[b[delay:], f[1:]]``.
        """
        omega = 2.0 * np.pi * np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64))
        n_b, n_f = self.free_numerator.size, self.denominator.size - 1
        if self.continuous:
            top = (1j * omega)[:, None] ** np.arange(n_b - 1, -1, -1) * np.exp(-1j * omega * self.dead_time)[:, None]
            bottom = (1j * omega)[:, None] ** np.arange(n_f, -1, -1)
        else:
            shift = np.exp(-1j * omega * self.sample_time)[:, None]
            top, bottom = shift ** (self.delay + np.arange(n_b)), shift ** np.arange(n_f + 1)
        below = bottom @ self.denominator
        response = np.asarray((top @ self.free_numerator) / below, dtype=np.complex128)
        gradient = np.concatenate([top / below[:, None], -(response / below)[:, None] * bottom[:, 1:]], axis=1)
        return response, np.asarray(gradient, dtype=np.complex128)

    @overload
    def frequency_response(self, frequency_hz: ArrayLike) -> ComplexArray: ...

    @overload
    def frequency_response(self, frequency_hz: ArrayLike, ci: float) -> ResponseBand: ...

    def frequency_response(self, frequency_hz: ArrayLike, ci: float | None = None) -> "ComplexArray | ResponseBand":
        """Return the response at given frequencies.

        Parameters
        ----------
        frequency_hz : array_like, shape (k,)
            Frequencies [Hz].
        ci : float, optional
            Probability of a band around gain and phase; none unless told.

        Returns
        -------
        ndarray of complex, shape (k,), or ResponseBand
            ``B / F`` on the unit circle, or imaginary axis [output unit per input unit].
        """
        response, gradient = self.response_gradient(frequency_hz)
        if ci is None:
            return response
        frequencies = np.atleast_1d(np.asarray(frequency_hz, dtype=np.float64))
        return response_band(frequencies, response, gradient, self.covariance, ci)

    def simulate(self, u: ArrayLike, initial: ArrayLike | None = None) -> Array:
        """Return the model's output for an input.

        Parameters
        ----------
        u : array_like, shape (n,)
            Input on the model's sample time; held between samples, if the model is in continuous time.
        initial : array_like, shape (len(initial_state),), or None
            State before the first sample; None is rest. ``model.initial_state`` reproduces the fitted run, and
            `estimate_initial_state` finds the one of another log.

        Returns
        -------
        ndarray, shape (n,)
            Output [output unit].
        """
        values = np.asarray(u, dtype=np.float64)
        if self.continuous:
            return self.offset + self.discretised().simulate(values)
        state = np.zeros_like(self.initial_state) if initial is None else np.asarray(initial, dtype=np.float64)
        return self.offset + filtered(self.numerator, self.denominator, values, state)

    def predict(self, u: ArrayLike, y: ArrayLike) -> Array:
        """Return the one-step-ahead prediction of the output by the noise model, from rest.

        Parameters
        ----------
        u : array_like, shape (n,)
            Input.
        y : array_like, shape (n,)
            Measured output; where missing (NaN), the simulated one stands for it.

        Returns
        -------
        ndarray, shape (n,)
            Output [output unit]; that of `simulate` where C = D.
        """
        simulated = self.simulate(u)
        noise = np.asarray(y, dtype=np.float64) - simulated
        noise = np.where(np.isfinite(noise), noise, 0.0)
        innovation = filtered(self.noise_denominator, self.noise_numerator, noise)
        return simulated + noise - innovation

    def discretised(self, sample_time: float | None = None) -> "LinearModel":
        """Return a model in continuous time as one in discrete time, its input held between samples.

        Parameters
        ----------
        sample_time : float, optional
            Seconds between samples [s]; that of the data unless told.

        Returns
        -------
        LinearModel
            Without covariance; dead time of a fraction of a sample is exact.
        """
        T = self.sample_time if sample_time is None else sample_time
        if not self.continuous:
            raise HydrostateError("discretised() is for a model in continuous time, got one in discrete time")
        b, f, delay = held_input_model(self.numerator, self.denominator[1:], self.dead_time, T)
        return LinearModel(b, f, T, self.input_name, self.output_name, delay=delay)

    def step(self, duration: float) -> tuple[Array, Array]:
        """Return the response to a unit step.

        Parameters
        ----------
        duration : float
            Length [s].

        Returns
        -------
        tuple of ndarray, shape (n,)
            Time from 0 [s], and output [output unit per input unit].
        """
        n = max(1, round(duration / self.sample_time)) + 1
        return self.sample_time * np.arange(n, dtype=np.float64), self.simulate(np.ones(n)) - self.offset
