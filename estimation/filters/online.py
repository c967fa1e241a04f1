"""A filter for a stream of samples in blocks: the kernel that filters a log, with its memory kept between blocks.

The result does not depend on how the stream is cut into blocks. The filter's state consists of arrays: it can be saved
and continues exactly.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array
from estimation.engine.contract import FilterProblem, empty_trace
from estimation.engine.rule import Rule
from estimation.engine.runner import final_traces, prepared_kernel
from estimation.filters.ckf import CKF
from estimation.filters.ekf import EKF
from estimation.filters.iekf import IEKF
from estimation.filters.sif import SIF
from estimation.filters.svsf import SVSF
from estimation.filters.ukf import UKF
from plant.errors import HydrostateError, require_known

RULES: Mapping[str, Rule] = {rule.name: rule for rule in (EKF, IEKF, UKF, CKF, SVSF, SIF)}
"""Filters that predict, then update, by name: those that can filter a stream."""

FIRST_ROW_ONLY = 1 << 62
"""Interval between rows of a track so long that only the first row is kept [samples]."""


@dataclass(frozen=True, eq=False)
class CurrentBelief:
    """Belief of a filter after its last sample, in SI.

    Parameters
    ----------
    values, deviations : ndarray, shape (states,)
        Means and standard deviations [SI].
    nis, count : ndarray, shape (channels,)
        Sums of squared normalised innovations, and samples present [dimensionless].
    log_likelihood : float
        Log-likelihood of all samples [dimensionless].
    """

    values: Array
    deviations: Array
    nis: Array
    count: Array
    log_likelihood: float


class OnlineFilter:
    """Filter a stream; the memory it needs does not grow.

    Parameters
    ----------
    problem : FilterProblem
        The task; its log is not used.
    method : str
        One of `RULES`.

    Raises
    ------
    HydrostateError
        If method or a setting is not known.
    """

    def __init__(self, problem: FilterProblem, method: str = "ekf") -> None:
        require_known("a method that filters a stream", method, RULES)
        self.problem, self.method = problem, method
        self._places, self._kernel, self._work = prepared_kernel(RULES[method], [problem])
        self._logs = np.zeros((len(problem.channels), 1))
        self._track = np.empty((2, 1, problem.model.width))
        self._seen = np.empty((2, 0, len(problem.channels)))
        self._drive = np.full(len(problem.model.drives), np.nan)
        self.taken = 0
        """Samples taken so far."""

    def take(self, drives: Array, measured: Array) -> None:
        """Take samples, one or many.

        Parameters
        ----------
        drives : ndarray, shape (n, drives)
            Drives of the model [SI]; a missing one (NaN) is held at its last value, and its assumed accuracy stays the
            same.
        measured : ndarray, shape (n, channels)
            Measurements [SI]; NaN is missing.

        Raises
        ------
        HydrostateError
            If the shapes are not these, or no drive was ever there.
        """
        wide = len(drives), len(self._drive)
        if drives.shape != wide or measured.shape != (wide[0], len(self.problem.channels)):
            wanted = f"(n, {wide[1]}) and (n, {len(self.problem.channels)})"
            raise HydrostateError(f"samples must have shapes {wanted}, got {drives.shape} and {measured.shape}")
        if not wide[0]:
            return
        held = self._held(drives)
        seen = np.ascontiguousarray(measured, np.float64)
        where = held.ctypes.data, seen.ctypes.data
        results = (*self._track, self._logs, *self._seen)
        substeps = self.problem.substeps
        self._kernel.steps(self._work.ravel(), *where, self.taken, 0, len(held), substeps, FIRST_ROW_ONLY, results)
        self.taken += len(held)
        self._drive = held[-1].copy()

    def _held(self, drives: Array) -> Array:
        """Return the drives, with missing ones held at the last value."""
        rows = np.vstack([self._drive, drives])
        known = np.isfinite(rows)
        last = np.maximum.accumulate(np.where(known, np.arange(len(rows))[:, None], 0), axis=0)
        held = np.take_along_axis(rows, last, axis=0)[1:]
        if not np.all(np.isfinite(held)):
            names = ", ".join(self.problem.model.drives)
            raise HydrostateError(f"the first sample of a stream must have every drive ({names}), got one missing")
        return np.ascontiguousarray(held, np.float64)

    def now(self) -> CurrentBelief:
        """Return the belief after the last sample."""
        (trace,) = final_traces(self._places, [self.problem], self._work, self._logs, [empty_trace(self.problem)])
        values, slope = self.problem.model.to_si(trace.mean)
        deviations = np.sqrt(np.maximum(np.diag(trace.covariance), 0.0)) * slope
        return CurrentBelief(values, deviations, trace.nis, trace.count, trace.log_likelihood)

    def remembered(self) -> dict[str, Array]:
        """Return the full state of the filter, for `resume`.

        Returns
        -------
        dict[str, ndarray]
            Copies, by name.
        """
        return {
            "work": self._work.copy(),
            "logs": self._logs.copy(),
            "drive": self._drive.copy(),
            "taken": np.array([self.taken]),
        }

    def resume(self, kept: Mapping[str, Array]) -> None:
        """Continue exactly from where another filter of the same task stopped.

        Parameters
        ----------
        kept : Mapping[str, ndarray], each of its own shape
            Its state, from `remembered` [any unit].

        Raises
        ------
        HydrostateError
            If that filter had another model, other channels or another method.
        """
        own = self.remembered()
        if any(name not in kept or kept[name].shape != own[name].shape for name in own):
            raise HydrostateError("a filter can only continue one of the same form, method, states and channels")
        self._work[:], self._logs[:], self._drive[:] = kept["work"], kept["logs"], kept["drive"]
        self.taken = int(kept["taken"][0])
