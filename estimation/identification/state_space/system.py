"""A state-space model with its covariance: poles, gains and frequency responses, each with its deviation."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from estimation.arrays import Array, ComplexArray


@dataclass(frozen=True, eq=False)
class StateSpace:
    """``x[t + 1] = A x[t] + B u[t]``, ``y[t] = C x[t] + D u[t] + level``.

    Parameters
    ----------
    a, b, c, d : ndarray, shapes (n, n), (n, m), (p, n), (p, m)
        Matrices; the basis of the states is free.
    level : ndarray, shape (p,)
        Output where states and inputs are zero [output units].
    delays : tuple of int
        Samples by which each input comes later.
    direct : bool
        Whether D was fitted; it is zero otherwise.
    sample_time : float
        Seconds between samples [s].
    covariance : ndarray, shape (k, k)
        Of A, B, C, D, row by row, and level, in the basis of these matrices [their units]; whatever does not depend on
        the basis has its variance from it.
    """

    a: Array
    b: Array
    c: Array
    d: Array
    level: Array
    delays: tuple[int, ...]
    direct: bool
    sample_time: float
    covariance: Array

    @property
    def order(self) -> int:
        """States."""
        return len(self.a)

    @property
    def n_values(self) -> int:
        """Number of free values: those of the matrices, less the choice of a basis, plus levels."""
        n, (p, m) = self.order, self.d.shape
        return n * (p + m) + p * m * self.direct + p

    @property
    def poles(self) -> ComplexArray:
        """Eigenvalues of A."""
        return np.linalg.eigvals(self.a).astype(np.complex128)

    @property
    def pole_std(self) -> ComplexArray:
        """Standard deviations of the poles' real and imaginary parts."""
        values, right = np.linalg.eig(self.a)
        left, n = np.linalg.inv(right), self.order
        out = np.zeros(values.size, dtype=np.complex128)
        for k in range(values.size):
            slopes = np.zeros(len(self.covariance), dtype=np.complex128)
            slopes[: n * n] = np.outer(left[k], right[:, k]).ravel()
            out[k] = self._deviation(slopes.real) + 1j * self._deviation(slopes.imag)
        return out

    def response(self, z: complex) -> tuple[ComplexArray, ComplexArray]:
        """Return the transfer function at one point, and its derivative by all values.

        Parameters
        ----------
        z : complex
            Shift operator, dimensionless.

        Returns
        -------
        tuple of ndarray, shapes (p, m) and (p, m, k)
            Gain and derivatives [output unit per input unit].
        """
        n, (p, m) = self.order, self.d.shape
        inside = np.linalg.inv(z * np.eye(n) - self.a)
        left, right = self.c @ inside, inside @ self.b
        slopes = np.zeros((p, m, len(self.covariance)), dtype=np.complex128)
        slopes[:, :, : n * n] = np.einsum("ok,lj->ojkl", left, right).reshape(p, m, -1)
        at = n * n
        for j in range(m):
            slopes[:, j, at + j : at + n * m : m] = left
        at += n * m
        for o in range(p):
            slopes[o, :, at + o * n : at + (o + 1) * n] = right.T
        at += p * n
        if self.direct:
            for o in range(p):
                slopes[o, :, at + o * m : at + (o + 1) * m] = np.eye(m)
        late = z ** -np.asarray(self.delays, dtype=np.float64)
        return (self.c @ right + self.d) * late, slopes * late[None, :, None]

    @property
    def dc_gain(self) -> Array:
        """Steady gain, shape (p, m) [output unit per input unit]."""
        return self.response(1.0)[0].real

    @property
    def dc_gain_std(self) -> Array:
        """Standard deviation of the steady gain, shape (p, m) [output unit per input unit]."""
        return self._deviation(self.response(1.0)[1].real)

    @property
    def offset(self) -> Array:
        """Outputs at rest where all inputs are zero, shape (p,) [output units]."""
        return self.level

    def frequency_response(self, frequency: ArrayLike) -> tuple[ComplexArray, Array]:
        """Return the frequency response and the standard deviation of its distance from the truth.

        Parameters
        ----------
        frequency : array_like, shape (f,)
            Frequencies [Hz].

        Returns
        -------
        tuple of ndarray, both of shape (f, p, m)
            Response, and root of the summed variances of its real and imaginary part [output unit per input unit].
        """
        found, spread = list[ComplexArray](), list[Array]()
        for one in np.atleast_1d(np.asarray(frequency, dtype=np.float64)):
            gain, slopes = self.response(complex(np.exp(2j * np.pi * one * self.sample_time)))
            found.append(gain)
            spread.append(np.hypot(self._deviation(slopes.real), self._deviation(slopes.imag)))
        return np.array(found), np.array(spread)

    def _deviation(self, slopes: Array) -> Array:
        variance = np.einsum("...i,ij,...j->...", slopes, self.covariance, slopes)
        return np.sqrt(np.maximum(variance, 0.0))

    def in_units(self, u_mean: Array, u_std: Array, y_mean: Array, y_std: Array) -> "StateSpace":
        """Return a model of scaled channels in the channels' units.

        Parameters
        ----------
        u_mean, u_std : ndarray, shape (m,)
            What inputs were scaled by [input units].
        y_mean, y_std : ndarray, shape (p,)
            What outputs were scaled by [output units].
        """
        n = self.order
        factors = np.concatenate(
            [
                np.ones(n * n),
                np.tile(1.0 / u_std, n),
                np.repeat(y_std, n),
                *([np.outer(y_std, 1.0 / u_std).ravel()] if self.direct else []),
                y_std,
            ]
        )
        gain, slopes = (one.real for one in self.response(1.0))
        turn = np.diag(factors)
        # the level applies to zero inputs, so the response to the inputs' means is subtracted
        turn[-len(y_std) :] -= y_std[:, None] * np.tensordot(u_mean / u_std, slopes, axes=(0, 1))
        gain = gain * np.outer(y_std, 1.0 / u_std)
        return StateSpace(
            self.a,
            self.b / u_std,
            self.c * y_std[:, None],
            self.d * np.outer(y_std, 1.0 / u_std),
            y_mean + y_std * self.level - gain @ u_mean,
            self.delays,
            self.direct,
            self.sample_time,
            turn @ self.covariance @ turn.T,
        )

    def with_delays_as_states(self) -> tuple[Array, Array, Array, Array]:
        """Return A, B, C and D in which every sample of dead time is a state that holds its input.

        Returns
        -------
        tuple of ndarray
            Of shapes (n + k, n + k), (n + k, m), (p, n + k) and (p, m), k samples of dead time in all.
        """
        n, (p, m), k = self.order, self.d.shape, sum(self.delays)
        a, b, c, d = np.zeros((n + k, n + k)), np.zeros((n + k, m)), np.zeros((p, n + k)), np.zeros((p, m))
        a[:n, :n], c[:, :n], at = self.a, self.c, n
        for j, delay in enumerate(self.delays):
            if delay == 0:
                b[:n, j], d[:, j] = self.b[:, j], self.d[:, j]
                continue
            b[at, j] = 1.0
            a[at + 1 : at + delay, at : at + delay - 1] = np.eye(delay - 1)
            a[:n, at + delay - 1], c[:, at + delay - 1] = self.b[:, j], self.d[:, j]
            at += delay
        return a, b, c, d

    def to_dict(self) -> dict[str, Any]:
        """Return JSON values."""
        names = ("a", "b", "c", "d", "level", "covariance")
        return {
            **{name: getattr(self, name).tolist() for name in names},
            "delays": list(self.delays),
            "direct": self.direct,
            "sample_time_s": self.sample_time,
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "StateSpace":
        """Return the model that `to_dict` wrote."""
        a, b, c, d, level, covariance = (
            np.array(values[name], dtype=np.float64) for name in ("a", "b", "c", "d", "level", "covariance")
        )
        delays = tuple(int(one) for one in values["delays"])
        return cls(a, b, c, d, level, delays, bool(values["direct"]), float(values["sample_time_s"]), covariance)
