"""Normal equations of a polynomial model's free run, summed over short parts that stay in the processor's cache.

A term is a monomial of past outputs times one of inputs. Those of inputs do not change in a descent and are computed
once; the run of a sample only needs the monomials of outputs, of which there are few.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from estimation.arrays import Array, IntArray
from estimation.identification.free_run.factored_kernel import pass_on, run_factored, slopes_of, write_own
from estimation.identification.free_run.polynomial_variables import lagged_signals

if TYPE_CHECKING:
    from estimation.identification.free_run.polynomial_fit import Runs

STRETCH = 100_000
"""Derivatives that are held at a time [count]: 800 kB."""


@dataclass(frozen=True, eq=False)
class Factors:
    """Terms as products of a monomial of past outputs and one of inputs.

    Parameters
    ----------
    place, column : ndarray of int, shape (k,)
        Of each term: its monomial of past outputs, and that of inputs.
    parent, factor : ndarray of int, shape (m,)
        A monomial of outputs is an earlier one times a past output, counted first among those as they are, then among
        those that are clipped at their ends; the first is 1.
    own : ndarray of int, shape (l,)
        Which variables are past outputs.
    inputs : tuple of (tuple of int, bool)
        Variables of each monomial of inputs, and whether they are clipped at their ends.
    """

    place: IntArray
    column: IntArray
    parent: IntArray
    factor: IntArray
    own: IntArray
    inputs: tuple[tuple[tuple[int, ...], bool], ...]

    def of_inputs(self, single: Array, held: Array) -> Array:
        """Return the monomials of inputs, shape (n, i).

        Parameters
        ----------
        single, held : ndarray, shape (n, v)
            Variables as they are, and clipped at their ends.

        Returns
        -------
        ndarray, shape (n, i)
            One column per monomial.
        """
        rows = np.ones((len(self.inputs), single.shape[0]))
        for row, (variables, is_held) in zip(rows, self.inputs, strict=True):
            for one in variables:
                row *= (held if is_held else single)[:, one]
        return np.ascontiguousarray(rows.T)


def factored(source: Sequence[int], terms: IntArray) -> Factors:
    """Return the factors of terms.

    Parameters
    ----------
    source : sequence of int
        Of each variable: 0 for the output, otherwise the input's number from 1.
    terms : ndarray of int, shape (k, 3)
        Variables of each term, followed by -1 if there are fewer than three; -1 stands for 1.

    Examples
    --------
    >>> found = factored([0, 1], np.array([[-1, -1, -1], [0, 1, -1], [0, 0, 1]]))
    >>> found.place.tolist(), found.column.tolist(), found.parent.tolist()
    ([0, 1, 2], [0, 1, 1], [0, 0, 1])
    """
    return _factored(tuple(int(one) for one in source), terms.tobytes(), terms.shape[0])


@lru_cache(maxsize=64)
def _factored(source: tuple[int, ...], packed: bytes, count: int) -> Factors:
    own = [v for v, one in enumerate(source) if one == 0]
    number = {v: s for s, v in enumerate(own)}
    monomials: dict[tuple[int, ...], int] = {(): 0}
    parent, factor = [0], [0]
    inputs: dict[tuple[tuple[int, ...], bool], int] = {}
    place, column = list[int](), list[int]()
    for term in np.frombuffer(packed, dtype=np.int64).reshape(count, -1):
        variables = [int(v) for v in term if v >= 0]
        alone = len(variables) == 1
        key: tuple[int, ...] = ()
        for v in sorted(v for v in variables if source[v] == 0):
            before, key = key, (*key, number[v] + (0 if alone else len(own)))
            if key not in monomials:
                monomials[key] = len(parent)
                parent.append(monomials[before])
                factor.append(key[-1])
        place.append(monomials[key])
        driven = tuple(sorted(v for v in variables if source[v] > 0))
        column.append(inputs.setdefault((driven, bool(driven) and not alone), len(inputs)))
    asked = (np.array(one, dtype=np.int64) for one in (place, column, parent, factor, own))
    of_terms, of_inputs, parents, factors, past = asked
    return Factors(of_terms, of_inputs, parents, factors, past, tuple(inputs))


class NormalEquations:
    """The free run of one set of terms on given data, and its normal equations.

    Parameters
    ----------
    runs : Runs
        Terms and data.
    ends : ndarray, shape (2,)
        Ends at which the output is clipped.
    """

    def __init__(self, runs: "Runs", ends: Array) -> None:
        self.runs, self.ends = runs, ends
        one = runs.variables
        self.factors = factored(one.source.tolist(), runs.terms)
        self.lag, self.limits = one.lag[self.factors.own], np.ascontiguousarray(one.limits[self.factors.own])
        self.inputs = [self.factors.of_inputs(*lagged_signals(one, u, np.zeros(u.shape[0]))) for u in runs.data.u]
        self._shares: list[Array] = []
        self._outputs: list[Array] = []
        self._rub = np.empty(0)

    def outputs(self, theta: Array) -> Array | None:
        """Return the outputs of all logs, one after the other; None if one diverges.

        Parameters
        ----------
        theta : ndarray, shape (p,)
            All values.

        Returns
        -------
        ndarray, shape (n,), or None
            Scaled.
        """
        runs, one = self.runs, self.factors
        weights = np.zeros((len(one.inputs), one.parent.size))
        np.add.at(weights, (one.column, one.place), theta[: runs.terms.shape[0]])
        self._shares, self._outputs = [inputs @ weights for inputs in self.inputs], []
        self._rub = theta[theta.size - runs.variables.n_friction :].copy()
        for index, share in enumerate(self._shares):
            out = runs.outputs_before_run(theta, index)
            at = (one.parent, one.factor, self.lag, self.limits, self.ends, runs.begins[index], self._rub)
            if run_factored(share, *at, out) >= 0:
                return None
            self._outputs.append(out)
        return np.concatenate(self._outputs)

    def sums(self, left: Array) -> tuple[Array, Array]:
        """Return the sums of products of the last run's derivatives with each other, and with the residuals.

        Parameters
        ----------
        left : ndarray, shape (n,)
            Residuals of all logs; those that do not count are not read.

        Returns
        -------
        tuple of ndarray, shapes (p, p) and (p,)
            Over the samples that count.
        """
        p = self.n_values
        gram, right = np.zeros((p, p)), np.zeros(p)
        for rows, residual in self._stretches(left):
            gram += rows.T @ rows
            right += rows.T @ residual
        return gram, right

    def sums_beside(self, left: Array, others: slice) -> tuple[Array, Array, Array]:
        """Return the sums if some values are only compared, without the products of these with each other.

        Parameters
        ----------
        left : ndarray, shape (n,)
            As in `sums`.
        others : slice
            The values that are compared.

        Returns
        -------
        tuple of ndarray, shapes (k, p), (p,) and (p,)
            Products of the k remaining derivatives with all, squares of all, and products with the residuals.
        """
        p = self.n_values
        kept = np.delete(np.arange(p), np.arange(p)[others])
        gram, square, right = np.zeros((kept.size, p)), np.zeros(p), np.zeros(p)
        for rows, residual in self._stretches(left):
            gram += rows[:, kept].T @ rows
            square += np.einsum("ij,ij->j", rows, rows)
            right += rows.T @ residual
        return gram, square, right

    def start_slopes(self) -> Array:
        """Return the last run's derivatives by the first outputs of its only log.

        Returns
        -------
        ndarray, shape (n, lags)
            One column a first output.
        """
        (begin,), (out,), n = self.runs.begins, self._outputs, self.runs.variables.n_start
        rows = np.zeros((out.size, n))
        rows[begin - n : begin] = np.eye(n)
        pass_on(self._slopes(0)[1][begin:], n, rows[begin - n :])
        return rows

    @property
    def n_values(self) -> int:
        """Values that the run depends on."""
        runs = self.runs
        return runs.terms.shape[0] + runs.variables.n_start * len(self.inputs) + runs.variables.n_friction

    def _slopes(self, index: int) -> tuple[Array, Array]:
        """Return monomials of past outputs, and the dependence of each output of a log on those before it."""
        share, one, variables = self._shares[index], self.factors, self.runs.variables
        monomials = np.zeros(share.shape)
        slope = np.zeros((share.shape[0], variables.n_start + bool(variables.friction)))
        at = (one.parent, one.factor, self.lag, self.limits, self.ends, self.runs.begins[index], self._rub)
        slopes_of(share, *at, self._outputs[index], monomials, slope)
        return monomials, slope

    def _stretches(self, left: Array) -> Iterator[tuple[Array, Array]]:
        """Yield derivatives and residuals of the samples that count, some at a time."""
        runs, one, p = self.runs, self.factors, self.n_values
        n, n_rub, place = runs.variables.n_start, runs.variables.n_friction, 0
        length = max(STRETCH // p, 32)
        rows, first_outputs = np.zeros((n + length, p)), np.eye(n)
        for index, (inputs, out) in enumerate(zip(self.inputs, self._outputs, strict=True)):
            begin, size, start = runs.begins[index], out.size, runs.terms.shape[0] + index * n
            monomials, slope = self._slopes(index)
            used, residual = runs.used[place : place + size], left[place : place + size]
            place += size
            rows[:n] = 0.0
            # before the run every derivative is zero
            for first in range(begin - n, size, length):
                last = min(first + length, size)
                counts, part, block = used[first:last], rows[n : n + last - first], slope[first:last]
                write_own(monomials[first:last], inputs[first:last], one.place, one.column, block, n_rub, part)
                if first < begin:
                    given = part[: begin - first]
                    given[:] = 0.0
                    given[:, start : start + n] = first_outputs[first - begin + n :][: len(given)]
                pass_on(block, n, rows[: n + last - first])
                if counts.all():
                    yield part, residual[first:last]
                elif counts.any():
                    yield part[counts], residual[first:last][counts]
                rows[:n] = rows[last - first : n + last - first].copy()
