"""The least-squares problem of a model in which any parameter may be free: derivatives by finite differences.

`Problem` has exact sensitivities in its kernel, so each set of unknowns needs its own kernel. Here one kernel without
unknowns serves every hypothesis.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import Any

import numpy as np

from estimation.fits.greybox.descent import Point
from estimation.fits.greybox.kernel import compile_kernel
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.normal_loops import fill_differences
from estimation.fits.greybox.nudges import nudge_for
from estimation.fits.greybox.problem import OUTLIER, Problem, quadratic
from estimation.fits.greybox.ridge import Ridge
from estimation.fits.greybox.side_by_side import LANES, MOST_LANES, ResidualsRun, compile_side_by_side, lanes_for
from estimation.fits.greybox.work_limit import spend
from estimation.models.greybox import GreyBoxModel
from plant.arrays import Array
from plant.solvers.steps import parameter_names
from plant.spare_processors import map_cases

MOST_SIDE_BY_SIDE = 200_000
"""Longest log whose drives are copied for each run side by side [samples]: some 30 MB."""

MOST_BLOCKS_CACHED = 100_000
"""Blocks of the longest log whose last slopes are kept [count]: some 15 MB."""


class FreedProblem(Problem):
    """The least-squares problem of one log with some parameters of a model free.

    Parameters
    ----------
    model : GreyBoxModel
        A model without unknowns.
    log : GreyBoxLog
        The log; its parameters hold the values of what is not free.
    free : sequence of str
        Parameters that are fitted.
    linear : Mapping[str, float]
        Typical sizes of parameters that are not fitted as logarithms [SI].
    ridge : Ridge, optional
        Two parameters that nearly cancel.
    """

    near = 0.0
    """Change of all residuals from a known point up to which its slopes give them without a run [deviations]."""

    def __init__(
        self,
        model: GreyBoxModel,
        log: GreyBoxLog,
        free: Sequence[str],
        linear: Mapping[str, float],
        ridge: Ridge | None = None,
    ) -> None:
        sizes = tuple((name, linear[name]) for name in free if name in linear)
        if not log.gaps.size:  # following the uncertainty of gaps doubles the cost
            model = replace(model, jump=())
        model = replace(model, stiff=log.stiff)
        super().__init__(replace(model, unknowns=tuple(free), linear=sizes), log, partial(_run_alone, model))
        self._bare, self._sizes, self._ridge = model, linear, ridge
        self._nudge = nudge_for(log, model, free)
        self._most = LANES if model.jump else MOST_LANES  # with gaps, `MOST_LANES` take twice as long as `LANES`
        self._last: list[tuple[Array, Array, Array, Array]] = []
        self._columns = [parameter_names(model.parameters).index(name) for name in free]
        self._kernels: dict[int, ResidualsRun] = {}
        self._units = np.array([linear.get(name, np.nan) for name in free])
        self._logarithmic = np.isnan(self._units)
        self._placed = None if ridge is None else ridge.placed(self.model.unknowns)

    @classmethod
    def of(cls, model: GreyBoxModel, log: GreyBoxLog) -> "FreedProblem":
        """Return the problem of a model's own unknowns: eight runs cost less than exact derivatives by seven of them.

        Parameters
        ----------
        model : GreyBoxModel
            The model, its unknowns fields of its parameters.
        """
        return cls(replace(model, unknowns=(), linear=()), log, model.unknowns, dict(model.linear))

    def _point(self, theta: Array, cost: float, gradient: Array, gram: Array) -> Point:
        many = self.log.stands_for
        return super()._point(theta, many * cost, many * gradient, many * gram)

    def on(self, log: GreyBoxLog) -> "FreedProblem":
        """Return the same problem of another log; see `Problem.on`."""
        return FreedProblem(self._bare, log, self.model.unknowns, self._sizes, self._ridge)

    def at_each(self, thetas: Sequence[Array]) -> list[Point]:
        """Return the cost and slopes at several points, faster than one after another.

        Parameters
        ----------
        thetas : sequence of ndarray, shape (unknowns,)
            Fitted coordinates [dimensionless].

        Returns
        -------
        list of Point
            As of `Problem.at`.
        """
        if self.log.passes_on or len(thetas) == 1:  # otherwise all points share one variance
            return [self.at(theta) for theta in thetas]
        rows = np.vstack([self._rows(self._nudged(theta), self.log.parameters) for theta in thetas])
        found = self._residuals(rows, None, self._variances(thetas[0]))[..., : len(rows)]
        parts = np.split(found, len(thetas), axis=-1)
        return [self._point(at, *quadratic(*self._slopes(part, at))) for at, part in zip(thetas, parts, strict=True)]

    def at_beside(self, theta: Array, known: Mapping[str, Array]) -> Point:
        """Return the cost and slopes at a point at which the slopes of some unknowns are known from a fit.

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            Fitted coordinates [dimensionless].
        known : Mapping[str, ndarray of shape (outputs * blocks,)]
            Derivatives of the normalised residuals, by unknown [dimensionless].

        Returns
        -------
        Point
            As of `Problem.at`.
        """
        names = self.model.unknowns
        asked = [place for place, name in enumerate(names) if name not in known]
        rows = self._rows(self._nudged(theta)[[0, *(1 + place for place in asked)]], self.log.parameters)
        # padded to `MOST_LANES`, which the other runs need: compiling a smaller kernel takes longer than this run
        rows = np.concatenate([rows, np.repeat(rows[-1:], max(0, LANES + 1 - len(rows)), axis=0)])
        here, columns = self._differences(self._residuals(rows, None, self._variances(theta)), len(asked))
        slopes = np.empty((*here.shape, len(names)))
        slopes[..., asked] = columns
        for place, name in enumerate(names):
            if name in known:
                slopes[..., place] = known[name].reshape(here.shape)
        if self._placed is not None and names[self._placed.nudged] not in known:
            self._placed.turn_back(slopes, theta)
        return self._point(theta, *quadratic(here, slopes))

    def costs(self, thetas: Sequence[Array], lanes: int = MOST_LANES) -> Array:
        """Return the cost at several points, without slopes: eight points take as long as one with its slopes.

        Parameters
        ----------
        thetas : sequence of ndarray, shape (unknowns,)
            Fitted coordinates [dimensionless].
        lanes : int
            Points side by side: `MOST_LANES`, or `LANES` if a search already uses that kernel and there are few points.

        Returns
        -------
        ndarray, shape (points,)
            As of `Problem.at` [dimensionless]; drive noise is counted as at the first point.
        """
        points = np.array(thetas)
        groups = self._in_groups(self._rows(points, self.log.parameters), None, self._variances(points[0]), lanes)
        # all groups at once would not fit in the cache
        misfit = np.concatenate([*map(_misfits, groups)])[: len(points)]
        return self.log.stands_for * misfit + 0.5 * (points - self.presumed) ** 2 @ self.prior

    def residuals_of(self, theta: Array, parameters: Sequence[Array]) -> list[Array]:
        """Return the normalised residuals under several parameters of the rig, side by side.

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            Fitted coordinates [dimensionless].
        parameters : sequence of ndarray, shape (parameters,)
            Parameters of the rig [SI].

        Returns
        -------
        list of ndarray, shape (outputs, blocks)
            As of `residuals`.
        """
        rows = np.vstack([self._rows(theta[None], row) for row in parameters])
        found = self._residuals(rows, None, self._variances(theta))
        return [found[..., i] for i in range(len(parameters))]

    def disturbed(self, theta: Array, drives: Iterable[Array]) -> Iterator[Array]:
        """Yield the normalised residuals under other driving channels than the log's, several side by side.

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            Fitted coordinates [dimensionless].
        drives : iterable of ndarray, shape (n, channels)
            The channels [SI].

        Yields
        ------
        ndarray, shape (outputs, blocks)
            As of `residuals`.
        """
        if len(self.log.drives) > MOST_SIDE_BY_SIDE:
            yield from super().disturbed(theta, drives)
            return
        waiting = iter(drives)
        while some := list(islice(waiting, MOST_LANES)):
            lanes = lanes_for(len(some))
            found = self.disturbed_together(theta, np.stack([*some, *some[-1:] * (lanes - len(some))], axis=-1))
            yield from (found[..., i] for i in range(len(some)))

    def disturbed_together(self, theta: Array, drives: Array) -> Array:
        """Return the normalised residuals under several other driving channels than the log's, in one run.

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            Fitted coordinates [dimensionless].
        drives : ndarray, shape (n, channels, `LANES` or `MOST_LANES`)
            The channels [SI].

        Returns
        -------
        ndarray, shape (outputs, blocks, `LANES` or `MOST_LANES`)
            As of `residuals`.
        """
        # the same number of lanes as the slopes use, so that no further kernel is compiled
        most = LANES if len(theta) < LANES else self._most
        row, variance = self._rows(theta[None], self.log.parameters), self._variances(theta)
        parts = [drives[..., first : first + most] for first in range(0, drives.shape[-1], most)]
        found = [self._side_by_side(np.repeat(row, part.shape[-1], axis=0), part, variance) for part in parts]
        return found[0] if len(found) == 1 else np.concatenate(found, axis=-1)

    def _run(
        self,
        theta: Array,
        errors: Array,
        slopes: Array,
        drives: Array | None = None,
        parameters: Array | None = None,
        variance: Array | None = None,
    ) -> tuple[float, Array, Array]:
        parameters = self.log.parameters if parameters is None else parameters
        variance = self._variances(theta) if variance is None else variance
        if not slopes.size and errors.size:
            errors[...] = self._residuals(self._rows(theta[None], parameters), drives, variance)[..., 0]
            return 0.0, np.zeros(0), np.zeros((0, 0))
        own = drives is None and parameters is self.log.parameters
        here, columns = self._cached_slopes(theta, variance) if own else (None, None)
        if here is None or columns is None:
            found = self._residuals(self._rows(self._nudged(theta), parameters), drives, variance)
            here, columns = self._slopes(found, theta)
            if own and len(here[0]) <= MOST_BLOCKS_CACHED:
                self._last = [*self._last[-1:], (theta.copy(), variance, here, columns)]
        if errors.size:
            errors[...] = here
        if slopes.size:
            slopes[...] = columns
            return 0.0, np.zeros(0), np.zeros((0, 0))
        return quadratic(here, columns)

    def _cached_slopes(self, theta: Array, variance: Array) -> tuple[Array, Array] | tuple[None, None]:
        """Return the residuals and slopes at one of the last two points, or so near to one that its slopes suffice."""
        last = [(theta - one[0], *one[2:]) for one in self._last if np.array_equal(one[1], variance)]
        for away, here, columns in last:
            if not np.any(away):
                return here, columns
        for away, here, columns in last[::-1]:
            if self.near > 0.0 and np.linalg.norm(moved := columns @ away) < self.near:
                felt = np.linalg.norm(columns[..., self._logarithmic], axis=(0, 1))
                bent = 0.5 * felt @ away[self._logarithmic] ** 2  # second-order change, as if no terms cancelled
                if bent < self.near:
                    return here + moved, columns
        return None, None

    def _nudged(self, theta: Array) -> Array:
        """Return a point and its neighbours, one row each; those on a ridge lie along it."""
        points = theta + self._nudge * np.eye(len(theta) + 1, len(theta), -1)
        if self._placed is not None:
            self._placed.turn(points, theta, self._nudge)
        return points

    def _slopes(self, found: Array, theta: Array) -> tuple[Array, Array]:
        """Return the residuals at a point and their slopes, from those at `_nudged`."""
        here, slopes = self._differences(found, len(theta))
        if self._placed is not None:
            self._placed.turn_back(slopes, theta)
        return here, slopes

    def _differences(self, found: Array, unknowns: int) -> tuple[Array, Array]:
        """Return the residuals at a point and their slopes, from the residuals there and at its neighbours."""
        here, slopes = np.empty(found.shape[:2]), np.empty((*found.shape[:2], unknowns))
        fill_differences(found, self._nudge, here, slopes)
        return here, slopes

    def _rows(self, thetas: Array, parameters: Array) -> Array:
        """Return the parameters at some points, shape (points, parameters)."""
        rows = np.repeat(parameters[None], len(thetas), axis=0)
        values = thetas * self._units
        np.exp(thetas, out=values, where=self._logarithmic)
        rows[:, self._columns] = values
        return rows

    def _residuals(self, rows: Array, drives: Array | None, variance: Array) -> Array:
        """Return the normalised residuals under some parameters, shape (outputs, blocks, rows or more)."""
        found = self._in_groups(rows, drives, variance)
        return found[0] if len(found) == 1 else np.concatenate(found, axis=-1)

    def _in_groups(self, rows: Array, drives: Array | None, variance: Array, most: int = MOST_LANES) -> list[Array]:
        """Return the residuals by groups of rows, of which up to ``most`` run side by side."""
        if len(rows) == 1:  # a single run is cheaper without lanes
            spend(self.log)
            return [self._single_run(rows[0], drives, variance)[..., None]]
        most, shared = min(most, self._most), (self.log.drives if drives is None else drives)[..., None]
        groups = [rows[first : first + most] for first in range(0, len(rows), most)]
        spend(self.log, sum(lanes_for(len(some)) for some in groups))
        return map_cases(lambda some: self._side_by_side(some, shared, variance), groups)

    def _side_by_side(self, rows: Array, drives: Array, variance: Array) -> Array:
        """Return the normalised residuals of up to `MOST_LANES` runs, shape (outputs, blocks, lanes)."""
        lanes = lanes_for(len(rows))
        found = self._empty_residuals(lanes)
        filled = rows if len(rows) == lanes else np.concatenate([rows, np.repeat(rows[-1:], lanes - len(rows), axis=0)])
        with np.errstate(all="ignore"):  # the search rejects a trial that diverges
            gaps = (self.log.gaps,) if self._bare.jump else ()
            self._kernel_of(lanes)(filled, drives, self.log.measured, *self._course(variance), *gaps, found)
        return found

    def _kernel_of(self, lanes: int) -> ResidualsRun:
        if lanes not in self._kernels:
            self._kernels[lanes] = compile_side_by_side(self._bare, lanes)
        return self._kernels[lanes]

    def _single_run(self, row: Array, drives: Array | None, variance: Array) -> Array:
        errors = self._empty_residuals()
        super()._run(np.empty(0), errors, np.empty((0, 0, 0)), drives, row, variance)
        return errors


def _run_alone(model: GreyBoxModel, *given: Any) -> tuple[float, Array, Array]:
    """Run a model alone: most problems only run it side by side, and need not load this kernel."""
    return compile_kernel(model)(*given)


def _misfits(errors: Array) -> Array:
    """Return half the sum of squares of each run, where outliers count linearly, shape (lanes,)."""
    weight = OUTLIER / np.maximum(np.abs(errors), OUTLIER)
    return np.einsum("ijk,ijk->k", (1.0 - 0.5 * weight) * weight * errors, errors)
