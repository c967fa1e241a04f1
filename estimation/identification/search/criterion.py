"""The output-error criterion: structure, simulation, exact sensitivities, and elimination of the linear part."""

from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array, BoolArray, ComplexArray, IntArray
from estimation.identification.model.recursion import filtered
from estimation.identification.search.linear import least_squares


@dataclass(frozen=True)
class Structure:
    """Numbers of coefficients of an output-error model, and its delay.

    Parameters
    ----------
    n_denominator : int
        Denominator coefficients beside the leading 1; the order.
    delay : int
        Leading zero coefficients of the numerator [samples].
    estimate_initial_state : bool
        Whether the state at the first sample is free; otherwise it is rest.
    """

    n_numerator: int
    n_denominator: int
    delay: int = 0
    estimate_initial_state: bool = True

    @property
    def n_states(self) -> int:
        """Length of the state, as `scipy.signal.lfilter` counts it."""
        return max(self.n_denominator, self.n_numerator + self.delay - 1)

    @property
    def n_main(self) -> int:
        """Coefficients of numerator and denominator."""
        return self.n_numerator + self.n_denominator

    @property
    def sizes(self) -> IntArray:
        """The sizes as the compiled descent needs them."""
        return np.array([self.n_numerator, self.n_denominator, self.delay, self.n_initial])

    @property
    def n_initial(self) -> int:
        """Free initial-state values."""
        return self.n_states if self.estimate_initial_state else 0

    @property
    def n_parameters(self) -> int:
        """All free values."""
        return self.n_main + self.n_initial

    def split(self, theta: Array) -> tuple[Array, Array, Array]:
        """Return numerator with its leading zeros, monic denominator, and initial state.

        Parameters
        ----------
        theta : ndarray, shape (n_parameters,)
            All free values: numerator, denominator, initial state.

        Returns
        -------
        tuple of ndarray
            Shapes (delay + n_numerator,), (n_denominator + 1,), (n_states,).
        """
        n_b, n_f = self.n_numerator, self.n_denominator
        b = np.concatenate([np.zeros(self.delay), theta[:n_b]])
        f = np.concatenate([[1.0], theta[n_b : n_b + n_f]])
        state = theta[n_b + n_f :] if self.estimate_initial_state else np.zeros(self.n_states)
        return b, f, state


def polynomial(poles: ComplexArray) -> Array:
    """Return the monic polynomial with these roots.

    Parameters
    ----------
    poles : ndarray of complex, shape (n,)
        In conjugate pairs.

    Returns
    -------
    ndarray, shape (n + 1,)
        Its coefficients.
    """
    return np.real(np.poly(poles)).astype(np.float64)


def is_stable(denominator: Array) -> bool:
    """Return whether every root of a monic denominator lies inside the unit circle.

    Parameters
    ----------
    denominator : ndarray, shape (n + 1,)
        Monic.

    Returns
    -------
    bool
        False, too, where a coefficient is not finite.
    """
    return bool(np.isfinite(denominator).all() and (np.abs(np.roots(denominator)) < 1.0).all())


def stabilised_denominator(denominator: Array, n_samples: int) -> Array:
    """Return the denominator with its unstable roots reflected into the unit circle.

    Parameters
    ----------
    denominator : ndarray, shape (n + 1,)
        Monic.
    n_samples : int
        Length of the data; a root on the circle moves to ``1 - 1 / n_samples``, which the data cannot tell
        apart.

    Returns
    -------
    ndarray, shape (n + 1,)
        Monic, stable.
    """
    if is_stable(denominator):
        return denominator
    roots = np.roots(denominator).astype(np.complex128)
    radius = np.abs(roots)
    outside = radius >= 1.0
    wanted = np.where(outside, np.minimum(1.0 / np.where(outside, radius, 1.0), 1.0 - 1.0 / n_samples), radius)
    shrink = np.where(outside, wanted / np.where(outside, radius, 1.0), 1.0)
    return polynomial(roots * shrink)


def with_bounded_roots(denominator: Array, n_samples: int, limit: float) -> Array:
    """Return the denominator with unstable roots reflected, and those outside a circle moved onto it.

    Parameters
    ----------
    denominator : ndarray, shape (n + 1,)
        Monic.
    n_samples : int
        Length of the data, as `stabilised_denominator` takes it.
    limit : float
        Radius of the circle [dimensionless].

    Returns
    -------
    ndarray, shape (n + 1,)
        Monic, stable.
    """
    f = stabilised_denominator(denominator, n_samples)
    roots = np.roots(f).astype(np.complex128)
    radius = np.abs(roots)
    return f if (radius <= limit).all() else polynomial(roots * np.minimum(1.0, limit / np.maximum(radius, limit)))


def predict(structure: Structure, theta: Array, u: Array) -> Array:
    """Return the model's output.

    Parameters
    ----------
    theta : ndarray, shape (n_parameters,)
        All free values.
    u : ndarray, shape (n,)
        Input.

    Returns
    -------
    ndarray, shape (n,)
        Output.
    """
    b, f, state = structure.split(theta)
    return filtered(b, f, u, state)


def sensitivities(structure: Structure, theta: Array, u: Array) -> Array:
    """Return the exact derivative of the model's output with respect to every free value.

    With ``yhat = B/F u + S/F d`` (``S`` the initial state, ``d`` a unit pulse), ``dyhat/db_k = q^-k u/F``,
    ``dyhat/df_j = -q^-j yhat/F`` and ``dyhat/ds_k = q^-k d/F`` (Ljung, System Identification, section 10.3):
    three filterings, and shifts of them.

    Parameters
    ----------
    theta : ndarray, shape (p,)
        ``[b, f, initial state]``.
    u : ndarray, shape (n,)
        Input.

    Returns
    -------
    ndarray, shape (n, p)
        One column a free value.
    """
    _, f, _ = structure.split(theta)
    jacobian = np.zeros((u.size, structure.n_parameters), order="F")
    n_b, n_f = structure.n_numerator, structure.n_denominator
    _fill_linear_columns(structure, f, u, jacobian[:, :n_b], jacobian[:, n_b + n_f :])
    decayed = filtered([1.0], f, predict(structure, theta, u))
    for k in range(1, n_f + 1):
        jacobian[k:, n_b + k - 1] = -decayed[:-k]
    return jacobian


def _fill_linear_columns(structure: Structure, f: Array, u: Array, numerator: Array, initial: Array) -> None:
    """Write the output's derivative by numerator (n, n_b) and initial state (n, n_initial) into zeros."""
    decayed = filtered([1.0], f, u)
    for k in range(structure.n_numerator):
        lag = structure.delay + k
        numerator[lag:, k] = decayed[: max(u.size - lag, 0)]
    if structure.n_initial:
        pulse = np.zeros(u.size)
        pulse[0] = 1.0
        response = filtered([1.0], f, pulse)
        for k in range(structure.n_initial):
            initial[k:, k] = response[: max(u.size - k, 0)]


def profile(structure: Structure, denominator: Array, u: Array, y: Array, used: BoolArray) -> tuple[float, Array]:
    """Return the least cost that a denominator allows, and the values that reach it.

    Numerator and initial state enter linearly, so for a given denominator they follow by least squares.

    Parameters
    ----------
    denominator : ndarray, shape (n_denominator + 1,)
        Monic, stable.
    u, y : ndarray, shape (n,)
        Input and output.
    used : ndarray of bool, shape (n,)
        Output samples that count.

    Returns
    -------
    cost : float
        Sum of squared residuals.
    theta : ndarray, shape (p,)
        ``[b, f, initial state]``.
    """
    n_b = structure.n_numerator
    columns = np.zeros((u.size, n_b + structure.n_initial), order="F")
    _fill_linear_columns(structure, denominator, u, columns[:, :n_b], columns[:, n_b:])
    columns, target = columns[used], y[used]
    scale = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    scale[scale == 0.0] = 1.0
    columns = columns / scale
    values = least_squares(columns.T @ columns, columns.T @ target)
    residual = target - columns @ values
    values = values / scale
    return float(residual @ residual), np.concatenate([values[:n_b], denominator[1:], values[n_b:]])
