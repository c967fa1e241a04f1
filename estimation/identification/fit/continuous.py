"""Transfer functions in continuous time with dead time, fitted to sampled data whose input is held between samples."""

from typing import NamedTuple

import numpy as np

from estimation.arrays import Array
from estimation.identification.fit.covariances import covariances
from estimation.identification.fit.fitted import CovarianceKind, is_robust, quality
from estimation.identification.fit.output_error import descend_from, jacobian_and_residual, minimise
from estimation.identification.model.held_input import held_input_model
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.search.criterion import Structure
from estimation.identification.search.descent import stable
from estimation.identification.search.experiments import (
    SAMPLES_PER_PARAMETER,
    Experiments,
    Signals,
    data_hash,
    experiments_from,
)
from plant.errors import HydrostateError

DIFFERENCE_STEP = 1e-6
"""Relative step of the derivative of discrete coefficients by continuous ones."""

LONGEST = 10.0
"""Dead time looked for at most [samples]."""

LEAST_SAMPLES_PER_POLE = 2
"""Samples for each pole that are left of an experiment without its dead time, or it stays as it is [count]."""

MOST_EVALUATIONS = 60
"""Of the simulated output, a start."""


def fit_continuous(
    u: Signals,
    y: Signals,
    sample_time: float,
    *,
    n_zeros: int,
    n_poles: int,
    dead_time: float | None = 0.0,
    covariance: CovarianceKind = "white",
    estimate_offset: bool = False,
    input_name: str = "input",
    output_name: str = "output",
) -> LinearModel:
    """Fit ``exp(-dead_time s) B(s)/A(s)`` by output error, with the input held between samples.

    Parameters
    ----------
    u, y : array_like, shape (n,), or a list of them
        Input, no gaps; output, NaN where missing.
    sample_time : float
        Seconds between samples [s].
    n_zeros, n_poles : int
        Degrees of numerator and denominator, ``n_zeros <= n_poles``.
    dead_time : float or None
        Known delay of the input [s]; None estimates it, ten samples at most.
    covariance : {"white", "coloured", "auto"}
        As `fit_output_error`; the deviation of the dead time is from the same one.
    estimate_offset : bool
        Whether a constant output, `LinearModel.offset`, is fitted along: in a short record, the mean is not the output
        at the mean input. Remove means first all the same, since starts are without it.

    Returns
    -------
    LinearModel
        ``continuous=True``, ``structure="continuous-output-error"``.

    Raises
    ------
    HydrostateError
        As `fit_output_error`.
    """
    if not 0 <= n_zeros <= n_poles or n_poles < 1:
        raise HydrostateError(f"0 <= n_zeros <= n_poles and n_poles >= 1 are needed, got {n_zeros} and {n_poles}")
    n_wanted = SAMPLES_PER_PARAMETER * (n_zeros + 2 * n_poles + 2)
    names = (input_name, output_name)
    given = experiments_from(u, y, names, n_excited=2 * n_poles, n_wanted=n_wanted)
    problem = _Problem(given.scaled(), sample_time, n_zeros, n_poles, dead_time, estimate_offset=estimate_offset)
    early = problem.without_whole_samples()
    found = [early.descend(start) for start in early.starts()]
    values = min(found, key=lambda one: one[0])[1]
    return problem.result(values, data_hash(given, sample_time), names, covariance)


class _ModelAtPoint(NamedTuple):
    """A model at one point: discrete numerator, denominator and delay, and derivatives by them and by initial states.

    A fitted offset is one more initial state. The residual uses the best ones.
    """

    values: Array
    b: Array
    f: Array
    delay: int
    main: Array
    initial: Array
    residual: Array


class _Problem:
    """One continuous-time fit in scaled time. Values are numerator, denominator after its 1, and dead time if free."""

    def __init__(
        self,
        data: Experiments,
        sample_time: float,
        n_zeros: int,
        n_poles: int,
        dead_time: float | None,
        *,
        estimate_offset: bool = False,
    ) -> None:
        self.estimate_offset = estimate_offset
        self.data, self.sample_time = data, sample_time
        self.n_zeros, self.n_poles, self.dead_time = n_zeros, n_poles, dead_time
        self._last: _ModelAtPoint | None = None

    def without_whole_samples(self) -> "_Problem":
        """Return the same fit with a known dead time of less than a sample, see `Experiments.advanced`.

        A dead time of 200 samples has 200 initial values, which take almost all the time of a search.
        """
        if self.dead_time is None:
            return self
        whole = int(np.floor(self.dead_time / self.sample_time + 1e-9))
        least = whole + LEAST_SAMPLES_PER_POLE * self.n_poles
        if whole == 0 or not self.data.has_outputs_after(least):
            return self
        rest = max(self.dead_time - whole * self.sample_time, 0.0)
        late, sizes = self.data.advanced(whole), (self.n_zeros, self.n_poles)
        return _Problem(late, self.sample_time, *sizes, rest, estimate_offset=self.estimate_offset)

    def discrete(self, values: Array) -> tuple[Array, Array, int]:
        """Return numerator, denominator and delay, with one sample for each unit of time."""
        n_b = self.n_zeros + 1
        late = self.dead_time / self.sample_time if self.dead_time is not None else values[-1]
        return held_input_model(values[:n_b], values[n_b : n_b + self.n_poles], max(float(late), 0.0), 1.0)

    def _at(self, values: Array) -> _ModelAtPoint:
        """Return the common part of residual and Jacobian, cached for the last point because a search needs it twice.

        `parts` computes the derivative by the continuous values: the residual alone is needed more often.
        """
        if self._last is not None and np.array_equal(self._last.values, values):
            return self._last
        b, f, delay = self.discrete(values)
        form = Structure(b.size - delay, self.n_poles, delay)
        theta = np.concatenate([b[delay:], f[1:], np.zeros(form.n_states * self.data.count)])
        jacobian, residual = jacobian_and_residual(form, theta, self.data)
        n_main = form.n_numerator + form.n_denominator
        initial = jacobian[:, n_main:]
        if self.estimate_offset:
            initial = np.column_stack([initial, self.data.used.astype(np.float64)])
        residual = residual - initial @ np.linalg.lstsq(initial, residual, rcond=None)[0]
        self._last = _ModelAtPoint(values.copy(), b, f, delay, jacobian[:, :n_main], initial, residual)
        return self._last

    def parts(self, values: Array) -> tuple[Array, Array]:
        """Return Jacobian by continuous values and initial states, and the residual, with the best initial states."""
        at = self._at(values)
        b, f, delay = at.b, at.f, at.delay
        moved = np.zeros((at.main.shape[1], values.size))
        for k in range(values.size):
            step = DIFFERENCE_STEP * max(abs(values[k]), 1e-3 * np.abs(values).max())
            if k == values.size - 1 and self.dead_time is None:
                step = 1e-5
            up = values.copy()
            up[k] += step
            other_b, other_f, _ = self.discrete(up)
            known = np.pad(other_b, (0, b.size))[: b.size]  # a dead time that crosses a whole sample adds one value
            moved[: b.size - delay, k] = (known - b)[delay:] / step
            moved[b.size - delay :, k] = (other_f[1:] - f[1:]) / step
        return np.concatenate([at.main @ moved, at.initial], axis=1), at.residual

    def _offset(self, values: Array) -> float:
        """Return the best offset beside the best initial states."""
        at = self._at(values)
        b, f = at.b[at.delay :], at.f[1:]
        still = np.concatenate([b, f, np.zeros(at.initial.shape[1] - int(self.estimate_offset))])
        residual = jacobian_and_residual(Structure(b.size, self.n_poles, at.delay), still, self.data)[1]
        return float(np.linalg.lstsq(at.initial, residual, rcond=None)[0][-1])

    def descend(self, start: Array) -> tuple[float, Array]:
        """Return cost and values of the minimum that a descent from one start reaches."""
        refused = np.full(self.data.u.size, 1e3)

        def residual(values: Array) -> Array:
            if (self.dead_time is None and values[-1] < 0.0) or not stable(self.discrete(values)[1][1:]):
                return refused
            return self._at(values).residual

        def jacobian(values: Array) -> Array:
            columns, _ = self.parts(values)
            free, initial = columns[:, : values.size], columns[:, values.size :]
            return -(free - initial @ np.linalg.lstsq(initial, free, rcond=None)[0])

        from scipy.optimize import least_squares  # importing it takes longer than fitting a discrete model

        found = least_squares(
            residual, start, jac=jacobian, method="lm", x_scale="jac", xtol=1e-10, ftol=1e-10, max_nfev=MOST_EVALUATIONS
        )
        return float(found.cost), np.asarray(found.x, dtype=np.float64)

    def starts(self) -> list[Array]:
        """Return starts from discrete fits at several dead times: poles by their logarithms, numerator by response."""
        known = self.dead_time
        lates = [known] if known is not None else np.linspace(0.0, LONGEST * self.sample_time, 7)
        kept: list[tuple[float, Array]] = []
        for late in lates:
            whole = int(np.floor(late / self.sample_time + 1e-9))
            form = Structure(self.n_poles + 1, self.n_poles, whole + (0 if self.n_zeros == self.n_poles else 1))
            theta = minimise(form, self.data)
            cost = descend_from(form, theta, self.data, 1)[0]
            values = self._from_discrete(form, theta, late / self.sample_time)
            kept.append((cost, values))
        return [values for _, values in sorted(kept, key=lambda one: one[0])[:3]]

    def _from_discrete(self, form: Structure, theta: Array, late: float) -> Array:
        b, f = theta[: form.n_numerator], np.concatenate([[1.0], theta[form.n_numerator :][: self.n_poles]])
        roots = np.roots(f).astype(np.complex128)
        # a pole on the negative real axis has no real continuous counterpart; a fast real pole replaces it
        roots = np.where((roots.imag == 0.0) & (roots.real <= 0.0), 0.05, roots)
        a = np.real(np.poly(np.log(roots)))
        omega = np.geomspace(1e-3, 1.0, 60) * min(np.pi, 3.0 * np.abs(np.log(roots)).max())
        shift = np.exp(-1j * omega)
        wanted = np.polyval(b[::-1], shift) * shift**form.delay / np.polyval(f[::-1], shift)
        s = 1j * omega
        hold = (1.0 - shift) / s
        basis = s[:, None] ** np.arange(self.n_zeros, -1, -1) * (hold * np.exp(-late * s) / np.polyval(a, s))[:, None]
        both = np.concatenate([basis.real, basis.imag])
        numerator = np.linalg.lstsq(both, np.concatenate([wanted.real, wanted.imag]), rcond=None)[0]
        values = np.asarray(np.concatenate([numerator, a[1:]]), dtype=np.float64)
        return values if self.dead_time is not None else np.concatenate([values, [late]])

    def result(
        self, values: Array, fingerprint: str, names: tuple[str, str], covariance: CovarianceKind
    ) -> LinearModel:
        """Return the model in seconds and in the data's units."""
        T, n_b = self.sample_time, self.n_zeros + 1
        jacobian, residual = self.parts(values)
        white, robust, _ = covariances(jacobian, residual, self.data)
        taken = robust if is_robust(covariance, residual, self.data) else white
        # values are in samples: a coefficient of s^k is multiplied by T^k, relative to the leading 1 of s^n
        powers_b = np.arange(self.n_zeros, -1, -1)
        powers_a = np.arange(self.n_poles - 1, -1, -1)
        gain = self.data.y_scale / self.data.u_scale
        unscale = np.concatenate([T ** (powers_b - self.n_poles) * gain, T ** (powers_a - self.n_poles)])
        n_main = unscale.size
        main, white_main, robust_main = (
            one[:n_main, :n_main] * np.outer(unscale, unscale) for one in (taken, white, robust)
        )
        late = self.dead_time if self.dead_time is not None else float(values[-1]) * T
        offset = self._offset(values) * self.data.y_scale if self.estimate_offset else 0.0
        return LinearModel(
            numerator=values[:n_b] * unscale[:n_b],
            denominator=np.concatenate([[1.0], values[n_b:n_main] * unscale[n_b:]]),
            sample_time=T,
            input_name=names[0],
            output_name=names[1],
            covariance=main,
            covariance_white=white_main,
            covariance_robust=robust_main,
            data_hash=fingerprint,
            **quality(residual, self.data, jacobian.shape[1]),
            structure="continuous-output-error",
            continuous=True,
            dead_time=late,
            offset=offset,
            dead_time_std=float(np.sqrt(taken[n_main, n_main])) * T if self.dead_time is None else float("nan"),
        )
