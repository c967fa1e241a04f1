"""Outputs of a state-space model and their derivatives, without the directions that only change its basis.

Every matrix is free. The search moves where outputs change, orthogonally to changes of basis (data-driven local
coordinates: McKelvey, Helmersson and Ribarits, Automatica 40, 2004, page 1629).
"""

from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array, BoolArray
from estimation.identification.state_space.joint import Joint
from estimation.identification.state_space.kernel import run_states, state_responses


@dataclass(frozen=True)
class Size:
    """Size of a model.

    Parameters
    ----------
    n, m, p : int
        States, inputs, outputs.
    direct : bool
        Whether an input reaches the outputs within its sample.
    """

    n: int
    m: int
    p: int
    direct: bool

    @property
    def n_matrices(self) -> int:
        """Values of A, B, C, D and levels."""
        return self.n * (self.n + self.m + self.p) + self.p * self.m * self.direct + self.p


@dataclass(frozen=True, eq=False)
class Values:
    """Matrices, levels, and a first state for each log.

    Parameters
    ----------
    a, b, c, d : ndarray, shapes (n, n), (n, m), (p, n), (p, m)
        Matrices, scaled.
    level : ndarray, shape (p,)
        Output where states and inputs are zero [scaled].
    starts : ndarray, shape (logs, n)
        States where each log's run begins, scaled.
    """

    a: Array
    b: Array
    c: Array
    d: Array
    level: Array
    starts: Array


class Problem:
    """Outputs and sensitivities of one size on given data."""

    def __init__(self, size: Size, data: Joint) -> None:
        self.size, self.data = size, data
        self.u, self.y = np.concatenate(data.u), np.concatenate(data.y)
        self.used: BoolArray = np.isfinite(self.y)

    def unpacked(self, theta: Array) -> Values:
        """Return matrices of values.

        Parameters
        ----------
        theta : ndarray, shape (k,)
            A, B, C, D row by row, levels, first states log by log [scaled].
        """
        n, m, p = self.size.n, self.size.m, self.size.p
        lengths = [n * n, n * m, p * n, p * m * self.size.direct, p]
        a, b, c, d, level, starts = np.split(theta, np.cumsum(lengths))
        feed = d.reshape(p, m) if self.size.direct else np.zeros((p, m))
        return Values(a.reshape(n, n), b.reshape(n, m), c.reshape(p, n), feed, level, starts.reshape(-1, n))

    def packed(self, v: Values) -> Array:
        """Return values of matrices, shape (k,)."""
        feed = [v.d.ravel()] if self.size.direct else []
        return np.concatenate([v.a.ravel(), v.b.ravel(), v.c.ravel(), *feed, v.level, v.starts.ravel()])

    def states(self, v: Values) -> Array:
        """Return the states, shape (samples, n); zero before a log's run begins."""
        out = np.zeros((len(self.u), self.size.n))
        pushed = np.ascontiguousarray(self.u @ v.b.T)
        for part, start in zip(self.data.slices, v.starts, strict=True):
            run_states(np.ascontiguousarray(v.a), pushed[part], np.ascontiguousarray(start), out[part])
        return out

    def outputs(self, v: Values) -> Array:
        """Return the outputs, shape (samples, p)."""
        return self.states(v) @ v.c.T + self.u @ v.d.T + v.level

    def _state_responses(self, a: Array, c: Array, source: Array) -> Array:
        """Return the outputs where a series pushes each state in turn, shape (p, samples, n)."""
        n, p = self.size.n, self.size.p
        out = np.zeros((len(source), p * n))
        for part in self.data.slices:
            state_responses(a, c, np.ascontiguousarray(source[part]), np.zeros((2 * p, n)), out[part])
        return out.reshape(-1, p, n).transpose(1, 0, 2)

    def linear_columns(self, a: Array, c: Array) -> Array:
        """Return derivatives by B, D, levels and first states, in which outputs are linear.

        Parameters
        ----------
        a, c : ndarray, shapes (n, n) and (p, n)
            Transition and outputs.

        Returns
        -------
        ndarray, shape (p, samples, k)
            Output after output [scaled].
        """
        size, rows = self.size, len(self.u)
        a, c = np.ascontiguousarray(a), np.ascontiguousarray(c)
        pushes = [self._state_responses(a, c, self.u[:, j]) for j in range(size.m)]
        by_b = np.stack(pushes, axis=-1).reshape(size.p, rows, -1)
        by_d = np.zeros((size.p, rows, size.p * size.m * size.direct))
        by_level = np.zeros((size.p, rows, size.p))
        by_start = np.zeros((size.p, rows, size.n * len(self.data.u)))
        for o in range(size.p):
            by_level[o, :, o] = 1.0
            if size.direct:
                by_d[o, :, o * size.m : (o + 1) * size.m] = self.u
        for k, part in enumerate(self.data.slices):
            # an initial state is the effect of a unit push one sample earlier
            push = np.zeros(part.stop - part.start + 1)
            push[0] = 1.0
            powers = np.zeros((push.size, size.p * size.n))
            state_responses(a, c, push, np.zeros((2 * size.p, size.n)), powers)
            by_start[:, part, k * size.n : (k + 1) * size.n] = powers[1:].reshape(-1, size.p, size.n).transpose(1, 0, 2)
        return np.concatenate([by_b, by_d, by_level, by_start], axis=2)

    def jacobian(self, theta: Array) -> tuple[Array, Array]:
        """Return outputs and their derivatives by every value.

        Parameters
        ----------
        theta : ndarray, shape (k,)
            All values [scaled].

        Returns
        -------
        tuple of ndarray, shapes (p, samples) and (p, samples, k)
            Outputs and derivatives.
        """
        v, size = self.unpacked(theta), self.size
        x, linear = self.states(v), self.linear_columns(v.a, v.c)
        a, c = np.ascontiguousarray(v.a), np.ascontiguousarray(v.c)
        by_a = np.stack([self._state_responses(a, c, x[:, j]) for j in range(size.n)], axis=-1)
        by_c = np.zeros((size.p, len(x), size.p * size.n))
        for o in range(size.p):
            by_c[o, :, o * size.n : (o + 1) * size.n] = x
        n_b = size.n * size.m
        whole = np.concatenate([by_a.reshape(size.p, len(x), -1), linear[:, :, :n_b], by_c, linear[:, :, n_b:]], axis=2)
        return (x @ v.c.T + self.u @ v.d.T + v.level).T, whole

    def directions(self, theta: Array) -> Array:
        """Return orthonormal directions that change outputs, not only the basis.

        Parameters
        ----------
        theta : ndarray, shape (k,)
            All values [scaled].

        Returns
        -------
        ndarray, shape (k, k - n^2)
            One a column.
        """
        v, n = self.unpacked(theta), self.size.n
        turns = np.zeros((theta.size, n * n))
        still = np.zeros_like(v.d), np.zeros_like(v.level)
        for place in range(n * n):
            turn = np.zeros((n, n))
            turn.flat[place] = 1.0
            moved = Values(turn @ v.a - v.a @ turn, turn @ v.b, -v.c @ turn, *still, v.starts @ turn.T)
            turns[:, place] = self.packed(moved)
        return np.asarray(np.linalg.qr(turns, mode="complete")[0][:, n * n :], dtype=np.float64)

    def balanced(self, theta: Array) -> Array:
        """Return the same model in a basis in which its states are uncorrelated and of unit deviation.

        Parameters
        ----------
        theta : ndarray, shape (k,)
            All values [scaled].

        Returns
        -------
        ndarray, shape (k,)
            Likewise.
        """
        v = self.unpacked(theta)
        x = self.states(v)
        spread = x.T @ x / len(x)
        spread[np.diag_indices_from(spread)] += 1e-12 * np.trace(spread) / len(spread)
        turn = np.linalg.inv(np.linalg.cholesky(spread))
        back = np.linalg.inv(turn)
        return self.packed(Values(turn @ v.a @ back, turn @ v.b, v.c @ back, v.d, v.level, v.starts @ turn.T))
