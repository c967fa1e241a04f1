"""The least-squares problem that a grey-box model and a log make, with the log's noise."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from estimation.greybox import GreyBoxModel, compile_prediction
from estimation.whitening import block_weights, whitened

Array = NDArray[np.float64]

OUTLIER = 3.0
"""Residuals beyond this many standard deviations count linearly (Huber 1964) [dimensionless]."""

BLOCK = 1e-3
"""Length over which residuals are averaged before they are squared [s]."""

RUNAWAY = 1e6
"""Largest normalised residual or slope [dimensionless]."""

UPWARD, DOWNWARD = np.log(1e3), 70.0
"""How far the logarithm of an unknown may leave its starts: three decades up; down until it is as good as absent."""


def _nothing() -> Mapping[str, float]:
    return MappingProxyType({})


@dataclass(frozen=True)
class OutputNoise:
    """Noise of an output.

    Parameters
    ----------
    variance : float
        Of its white noise, a sample [SI squared].
    walk : float
        Variance that its random walk gathers [SI squared a second]; white noise of a rate, such as measured speed,
        that the model integrates.
    """

    variance: float
    walk: float = 0.0


@dataclass(frozen=True, eq=False)
class GreyBoxLog:
    """A log, as a fit sees it.

    Parameters
    ----------
    drives : ndarray, shape (n, channels)
        Driving channels in SI, no sample missing.
    measured : ndarray, shape (n, outputs)
        Outputs in SI; NaN is missing.
    parameters : ndarray, shape (parameters,)
        Row of the actuator's parameters; the unknowns' entries are not used.
    sample_time : float
        Seconds between samples [s].
    steps : ndarray of int, shape (n,)
        Model steps up to each sample.
    noise : tuple of OutputNoise
        Of each output.
    drive_std : tuple of float
        Standard deviation of each driving channel's noise, where the outputs' noise does not hold it already [SI].
    uncertainties : Mapping[str, float]
        Relative standard deviation of the actuator's parameters [fraction]; those of unknowns are not used.
    """

    drives: Array
    measured: Array
    parameters: Array
    sample_time: float
    steps: NDArray[np.int64]
    noise: tuple[OutputNoise, ...]
    drive_std: tuple[float, ...] = ()
    uncertainties: Mapping[str, float] = field(default_factory=_nothing)

    def beginning(self, samples: int) -> "GreyBoxLog":
        """Return the log's first part.

        Parameters
        ----------
        samples : int
            How many samples are kept [samples].

        Returns
        -------
        GreyBoxLog
            The shorter log.
        """
        return replace(self, drives=self.drives[:samples], measured=self.measured[:samples], steps=self.steps[:samples])

    def softened(self, variance: float, walk: float) -> "GreyBoxLog":
        """Return the log as if its noise were larger, which makes the way to the optimum smoother.

        Parameters
        ----------
        variance, walk : float
            Factors on the white noise's variance and on the random walk's [dimensionless].

        Returns
        -------
        GreyBoxLog
            The same log under that noise.
        """
        return replace(self, noise=tuple(OutputNoise(n.variance * variance, n.walk * walk) for n in self.noise))


def search_bounds(model: GreyBoxModel, guesses: Sequence[Array], ceilings: Mapping[str, float]) -> tuple[Array, Array]:
    """Return how far the fitted coordinates may go.

    Parameters
    ----------
    model : GreyBoxModel
        The model.
    guesses : sequence of ndarray, shape (unknowns,)
        The starts.
    ceilings : Mapping[str, float]
        Largest value of an unknown, where physics gives one [SI].

    Returns
    -------
    tuple of ndarray, shape (unknowns,)
        Lower and upper bounds.
    """
    logarithmic = np.array([name not in dict(model.linear) for name in model.unknowns])
    lower = np.where(logarithmic, np.min(guesses, axis=0) - DOWNWARD, -np.inf)
    upper = np.where(logarithmic, np.max(guesses, axis=0) + UPWARD, np.inf)
    for name, ceiling in ceilings.items():
        if name in model.unknowns:
            upper[model.unknowns.index(name)] = np.log(ceiling)
    return lower, upper


class Problem:
    """The least-squares problem of one log, on whitened means over blocks of about `BLOCK` seconds.

    Averaging keeps what the log says about unknowns that act more slowly, and makes a 10 kHz log as cheap to solve as a
    1 kHz one. The last prediction is kept, since the optimiser asks for residual and slopes at the same point.

    Parameters
    ----------
    model : GreyBoxModel
        The model.
    log : GreyBoxLog
        The log.
    """

    def __init__(self, model: GreyBoxModel, log: GreyBoxLog) -> None:
        self.model, self.log = model, log
        self._run = compile_prediction(model)
        self._block = max(1, round(BLOCK / log.sample_time))
        edges = np.arange(0, len(log.measured), self._block)
        self.counts = np.add.reduceat(np.isfinite(log.measured), edges, axis=0, dtype=np.float64)
        self._weights = [
            block_weights(counts, noise.variance, noise.walk * self._block * log.sample_time)
            for counts, noise in zip(self.counts.T, log.noise, strict=True)
        ]

        @lru_cache(maxsize=2)
        def predict(theta: tuple[float, ...]) -> tuple[Array, Array]:
            excess, slopes = self.run(np.array(theta))
            return self.normalised(excess), self.normalised(slopes)

        self.predict = predict

    def run(self, theta: Array, drives: Array | None = None, parameters: Array | None = None) -> tuple[Array, Array]:
        """Return what the prediction exceeds the measured outputs by, and its slopes.

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
        tuple of ndarray
            Means over blocks, zero where one is missing [SI], shapes (blocks, outputs), (blocks, outputs, unknowns).
        """
        log = self.log
        return self._run(
            theta,
            log.drives if drives is None else drives,
            log.measured,
            log.parameters if parameters is None else parameters,
            log.sample_time,
            log.steps,
            self._block,
        )

    def normalised(self, means: Array) -> Array:
        """Return block means, whitened and over their standard deviations, one output after the other.

        Parameters
        ----------
        means : ndarray, shape (blocks, outputs) or (blocks, outputs, columns)
            In SI.

        Returns
        -------
        ndarray, shape (outputs * blocks,) or (outputs * blocks, columns)
            Normalised; zero where the block is missing, and a runaway held to a size that an optimiser can step back
            from [dimensionless].
        """
        white = np.concatenate(
            [whitened(means[:, i].reshape(len(means), -1), weights) for i, weights in enumerate(self._weights)]
        )
        np.nan_to_num(white, copy=False, nan=RUNAWAY, posinf=RUNAWAY, neginf=-RUNAWAY)
        return np.clip(white, -RUNAWAY, RUNAWAY, out=white).reshape(-1, *means.shape[2:])

    def solve(self, start: Array, evaluations: int, bounds: tuple[Array, Array], scale: str | float = "jac") -> Any:
        """Return scipy's solution from a start in fitted coordinates, with outliers counted linearly.

        Steps are measured against each unknown's own effect (``"jac"``) or, with 1, against decades alone: the better
        choice where several unknowns must move together.

        Parameters
        ----------
        start : ndarray, shape (unknowns,)
            Where to begin [dimensionless].
        evaluations : int
            How often the model may be evaluated [evaluations].
        bounds : tuple of ndarray, shape (unknowns,)
            Lowest and highest coordinates [dimensionless].
        scale : str or float
            How steps are measured, scipy's ``x_scale`` [dimensionless].

        Returns
        -------
        OptimizeResult
            Scipy's solution: ``x`` and ``cost`` [dimensionless].
        """
        return least_squares(
            lambda theta: self.predict(tuple(theta))[0],
            start,
            jac=lambda theta: self.predict(tuple(theta))[1],  # pyright: ignore[reportArgumentType]  # nor a callable
            loss="huber",
            f_scale=OUTLIER,
            x_scale=scale,  # pyright: ignore[reportArgumentType]  # the stubs lack scipy's "jac"
            max_nfev=evaluations,
            bounds=bounds,
        )
