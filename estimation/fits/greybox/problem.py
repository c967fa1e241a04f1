"""The least-squares problem that a grey-box model and a log make."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from estimation.arrays import Array, IntArray
from estimation.fits.greybox.descent import Point
from estimation.fits.greybox.kernel import Kernel, compile_kernel
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.loops import STRAIGHT
from estimation.fits.greybox.normal_loops import fill_quadratic
from estimation.models.greybox import GreyBoxModel

OUTLIER = 3.0
"""Residuals beyond this many standard deviations count linearly (Huber 1964) [dimensionless]."""

UPWARD, DOWNWARD = np.log(1e3), 70.0
"""How far the logarithm of an unknown may leave its starts: three decades up; down until it is as good as absent."""


def search_bounds(
    model: GreyBoxModel, guesses: Sequence[Array], limits: Mapping[str, tuple[float, float]]
) -> tuple[Array, Array]:
    """Return the bounds of the fitted coordinates.

    Parameters
    ----------
    model : GreyBoxModel
        The model.
    guesses : sequence of ndarray, shape (unknowns,)
        The starts.
    limits : Mapping[str, tuple of float]
        Least and largest value of an unknown, where physics gives them [SI].

    Returns
    -------
    tuple of ndarray, shape (unknowns,)
        Lower and upper bounds.
    """
    sizes = dict(model.linear)
    lower, upper = np.min(guesses, axis=0) - DOWNWARD, np.max(guesses, axis=0) + UPWARD
    for i, name in enumerate(model.unknowns):
        if name in sizes:
            lower[i], upper[i] = (limit / sizes[name] for limit in limits.get(name, (-np.inf, np.inf)))
        elif name in limits:
            least, largest = limits[name]
            lower[i], upper[i] = np.log(least) if least > 0.0 else lower[i], np.log(largest)
    return lower, upper


class Problem:
    """The least-squares problem of one log, on whitened means over the log's blocks.

    Averaging keeps the information on unknowns with slower effects, and makes a 10 kHz log as cheap as a 1 kHz one.

    Attributes
    ----------
    prior : ndarray, shape (unknowns,)
        One over the prior variance of each coordinate; zero if nothing is known [dimensionless].

    Notes
    -----
    Where a driving channel's noise passes on to an output through an unknown ``b``, the output's variance is ``v + (s
    b)^2``, and an error in the driving channel is no longer taken for a small ``b``: this is Deming's regression
    (Fuller 1987, Measurement Error Models, section 1.3). Both parts of the variance are known from the log, so that
    no logarithm of the variance stands beside the squares.
    """

    def __init__(self, model: GreyBoxModel, log: GreyBoxLog, kernel: Kernel | None = None) -> None:
        self.model, self.log = model, log
        self._kernel = kernel or compile_kernel(model)
        self._block = max(1, round(log.block / log.sample_time))
        self._passes_on = log.passes_on
        self._white = np.array([noise.variance for noise in log.noise])
        self._walks = log.walk_variances(self._block)
        sizes = dict(model.linear)
        presumed = [log.presumed.get(name, (sizes.get(name, 1.0), np.inf)) for name in model.unknowns]
        self.presumed = model.theta({name: value for name, (value, _) in zip(model.unknowns, presumed, strict=True)})
        self.prior = np.array([deviation**-2.0 for _, deviation in presumed])

    @cached_property
    def blocks(self) -> int:
        """Number of blocks with at least one sample, over all outputs [count]."""
        begins = np.arange(0, len(self.log.measured), self._block)
        return int(np.count_nonzero(np.logical_or.reduceat(np.isfinite(self.log.measured), begins, axis=0)))

    @cached_property
    def coarse(self) -> "Problem":
        """The same problem with one model step a sample."""
        return self.on(self.log.coarsened())

    def on(self, log: GreyBoxLog) -> "Problem":
        """Return the same problem of another log."""
        return type(self)(self.model, log)

    def at(self, theta: Array) -> Point:
        """Return cost and slopes at a point.

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            Fitted coordinates [dimensionless].

        Returns
        -------
        Point
            Cost and normal equations; no array as long as the log is stored.
        """
        if not self.log.passes_on:
            return self._point(theta, *self._run(theta, np.empty((0, 0)), np.empty((0, 0, 0))))
        errors, slopes = self._empty_residuals(), self._empty_residuals(len(theta))
        self._run(theta, errors, slopes)
        return self._point(theta, *quadratic(errors, self._with_variance_slopes(theta, errors, slopes)))

    def _point(self, theta: Array, cost: float, gradient: Array, gram: Array) -> Point:
        """Return a point whose misfit is given, with the prior added and a full matrix."""
        away = theta - self.presumed
        cost += 0.5 * float(self.prior @ away**2)
        whole = gram + gram.T
        np.fill_diagonal(whole, gram.diagonal() + self.prior)
        return Point(theta, cost, gradient + self.prior * away, whole)

    def residuals(self, theta: Array, drives: Array | None = None, parameters: Array | None = None) -> Array:
        """Return the normalised residuals, predicted less measured.

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            Fitted coordinates [dimensionless].
        drives : ndarray, shape (n, channels), optional
            Other driving channels than the log's [SI].
        parameters : ndarray, shape (parameters,), optional
            Other parameters of the rig than the log's [SI].

        Returns
        -------
        ndarray, shape (outputs, blocks)
            White and of unit variance if the model explains the log; zero for a missing block [dimensionless].
        """
        errors = self._empty_residuals()
        self._run(theta, errors, np.empty((0, 0, 0)), drives, parameters)
        return errors

    def residuals_of(self, theta: Array, parameters: Sequence[Array]) -> list[Array]:
        """Return the normalised residuals under several parameters of the rig.

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
        return [self.residuals(theta, parameters=row) for row in parameters]

    def disturbed(self, theta: Array, drives: Iterable[Array]) -> Iterator[Array]:
        """Yield the normalised residuals under other driving channels than the log's.

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
        return (self.residuals(theta, drives=one) for one in drives)

    def disturbed_together(self, theta: Array, drives: Array) -> Array:
        """Return the normalised residuals under several other driving channels than the log's.

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            Fitted coordinates [dimensionless].
        drives : ndarray, shape (n, channels, several)
            The channels [SI].

        Returns
        -------
        ndarray, shape (outputs, blocks, several)
            As of `residuals`.
        """
        return np.stack([*self.disturbed(theta, map(np.ascontiguousarray, np.moveaxis(drives, -1, 0)))], axis=-1)

    def slopes(self, theta: Array) -> Array:
        """Return the derivatives of the normalised residuals.

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            Fitted coordinates [dimensionless].

        Returns
        -------
        ndarray, shape (outputs * blocks, unknowns)
            Zero for a missing block [dimensionless].
        """
        return self.linearised(theta)[1]

    def linearised(self, theta: Array) -> tuple[Array, Array]:
        """Return the normalised residuals and their derivatives, from one run.

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            Fitted coordinates [dimensionless].

        Returns
        -------
        tuple of ndarray, shapes (outputs, blocks) and (outputs * blocks, unknowns)
            As of `residuals` and `slopes`.
        """
        errors, slopes = self._empty_residuals(), self._empty_residuals(len(theta))
        self._run(theta, errors, slopes)
        return errors, self._with_variance_slopes(theta, errors, slopes).reshape(errors.size, len(theta))

    def _empty_residuals(self, *columns: int) -> Array:
        return np.zeros((self.log.measured.shape[1], -(-len(self.log.measured) // self._block), *columns))

    def _run(
        self,
        theta: Array,
        errors: Array,
        slopes: Array,
        drives: Array | None = None,
        parameters: Array | None = None,
        variance: Array | None = None,
    ) -> tuple[float, Array, Array]:
        log = self.log
        with np.errstate(all="ignore"):  # the search rejects a trial that diverges
            return self._kernel(
                theta,
                log.drives if drives is None else drives,
                log.measured,
                log.parameters if parameters is None else parameters,
                *self._course(self._variances(theta) if variance is None else variance),
                log.gaps,
                OUTLIER,
                errors,
                slopes,
            )

    def _passed_variance(self, theta: Array) -> Array:
        """Return the variance that driving channels' noise passes on to each output, in SI."""
        if not self.log.passes_on:
            return np.zeros(len(self.log.noise))
        values = self.model.values(theta)
        return np.array([one.passed_noise(values)[0] ** 2 for one in self.log.noise])

    def _variances(self, theta: Array) -> Array:
        return self._white + self._passed_variance(theta) if self._passes_on else self._white

    def _variance_slopes(self, theta: Array) -> Iterator[tuple[int, int, float]]:
        """Yield each output whose variance depends on an unknown: its index, the unknown's, and the dependent share."""
        if self.log.passes_on:
            share, values = self._passed_variance(theta) / self._variances(theta), self.model.values(theta)
            for i, noise in enumerate(self.log.noise):
                for name, slope in noise.passed_noise(values)[1].items():  # fitted as logarithms
                    yield i, self.model.unknowns.index(name), float(share[i]) * slope

    def _with_variance_slopes(self, theta: Array, errors: Array, slopes: Array) -> Array:
        """Return the derivatives of normalised residuals, given those at constant variance."""
        for i, place, share in self._variance_slopes(theta):
            slopes[i, :, place] -= share * errors[i]
        return slopes

    def untilted(self, theta: Array, errors: Array) -> Array:
        """Return the gradient that would remain at an optimum if drive noise were not counted with the slopes.

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            Fitted coordinates [dimensionless].
        errors : ndarray, shape (outputs, blocks)
            Normalised residuals there [dimensionless].

        Returns
        -------
        ndarray, shape (unknowns,)
            Zero if no channel passes noise on [dimensionless].
        """
        out = np.zeros(len(theta))
        for i, place, share in self._variance_slopes(theta):
            out[place] += share * float(errors[i] @ errors[i])
        return out

    def _course(self, variance: Array) -> tuple[float, IntArray, int, Array, Array, Array, float]:
        """Return sample time, model steps up to each sample, samples a block, and the noises of each output."""
        return self.log.sample_time, self.log.steps, self._block, variance, *self._walks


def quadratic(errors: Array, slopes: Array) -> tuple[float, Array, Array]:
    """Return cost, gradient and lower triangle of ``J'J`` of normalised residuals; gross outliers count linearly.

    Parameters
    ----------
    errors : ndarray, shape (outputs, blocks)
        The residuals [dimensionless].
    slopes : ndarray, shape (outputs, blocks, unknowns)
        Their derivatives [dimensionless].

    Returns
    -------
    tuple of (float, ndarray of shape (unknowns,), ndarray of shape (unknowns, unknowns))
        As a kernel returns them.
    """
    columns = slopes.reshape(errors.size, -1)
    squares, pulling, bent = np.empty(errors.shape), np.empty(errors.size), np.empty(columns.shape)
    fill_quadratic(errors.ravel(), columns, OUTLIER, STRAIGHT, squares.ravel(), pulling, bent)
    return float(np.sum(squares)), pulling @ columns, np.where(_lower(columns.shape[1]), bent.T @ columns, 0.0)


@cache
def _lower(unknowns: int) -> NDArray[np.bool_]:
    """Return which places of a square matrix lie in its lower triangle."""
    return np.tri(unknowns, dtype=np.bool_)
