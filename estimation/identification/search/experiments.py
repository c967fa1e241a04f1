"""One or more experiments in the form that a fit needs, checked with clear errors."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike

from estimation.arrays import Array, BoolArray, IntArray
from plant.errors import HydrostateError

Signals: TypeAlias = ArrayLike | Sequence[ArrayLike]
"""One signal, or a list of signals, one an experiment."""

SAMPLES_PER_PARAMETER = 5
"""Fewest output samples a free value; below that the covariance formula means nothing."""


@dataclass(frozen=True, eq=False)
class Experiments:
    """Input and output of one or more experiments, one after the other.

    Parameters
    ----------
    u : ndarray, shape (n,)
        Input [input unit].
    y : ndarray, shape (n,)
        Output; 0 where it is missing [output unit].
    used : ndarray of bool, shape (n,)
        Where the output is there.
    bounds : ndarray of int, shape (count + 1,)
        Where each experiment begins, and the end.
    u_scale, y_scale : float
        What input and output were divided by [input unit, output unit].
    """

    u: Array
    y: Array
    used: BoolArray
    bounds: IntArray
    u_scale: float = 1.0
    y_scale: float = 1.0

    @property
    def count(self) -> int:
        """Number of experiments."""
        return self.bounds.size - 1

    @property
    def n_used(self) -> int:
        """Number of outputs that are present."""
        return int(np.count_nonzero(self.used))

    @property
    def slices(self) -> list[slice]:
        """Slice of each experiment."""
        return [slice(int(a), int(b)) for a, b in zip(self.bounds[:-1], self.bounds[1:], strict=True)]

    @property
    def longest(self) -> slice:
        """Slice of the longest experiment."""
        return max(self.slices, key=lambda part: part.stop - part.start)

    def scaled(self) -> "Experiments":
        """Return the data divided by their root mean squares, so that input and output are of order one."""
        u_scale = float(np.sqrt(np.mean(self.u**2)))
        y_scale = float(np.sqrt(np.sum(self.y**2) / self.n_used))
        return replace(self, u=self.u / u_scale, y=self.y / y_scale, u_scale=u_scale, y_scale=y_scale)

    def advanced(self, samples: int) -> "Experiments":
        """Return the outputs moved forward, without the last inputs, whose responses are not logged.

        A model with a delay of so many samples has as many more initial values, which give it any output before its
        input arrives. Without them the criterion is the same, over all samples that count.

        Parameters
        ----------
        samples : int
            By how many [samples].

        Returns
        -------
        Experiments
            Each shorter by so many samples, one or more of which are there.

        Examples
        --------
        >>> both = Experiments(np.arange(7.0), np.arange(7.0), np.ones(7, dtype=bool), np.array([0, 4, 7]))
        >>> late = both.advanced(2)
        >>> late.u.tolist(), late.y.tolist(), late.bounds.tolist()
        ([0.0, 1.0, 4.0], [2.0, 3.0, 6.0], [0, 2, 3])
        """
        early = np.concatenate([np.arange(part.start, part.stop - samples) for part in self.slices])
        late = np.concatenate([np.arange(part.start + samples, part.stop) for part in self.slices])
        bounds = self.bounds - samples * np.arange(self.bounds.size)
        return replace(self, u=self.u[early], y=self.y[late], used=self.used[late], bounds=bounds)

    def has_outputs_after(self, samples: int) -> bool:
        """Return whether each experiment has outputs after so many samples."""
        return all(self.used[part][samples:].any() for part in self.slices)

    def measured(self) -> Array:
        """Return the output with NaN where it is missing, shape (n,)."""
        return np.where(self.used, self.y, np.nan)

    def bridged(self) -> list[tuple[Array, Array]]:
        """Return input and output of each experiment, with gaps of the output filled by straight lines."""
        pairs: list[tuple[Array, Array]] = []
        for part in self.slices:
            u, y, used = self.u[part], self.y[part], self.used[part]
            samples = np.arange(u.size)
            pairs.append((u, y if used.all() else np.interp(samples, samples[used], y[used])))
        return pairs


def experiments_from(u: Signals, y: Signals, names: tuple[str, str], *, n_excited: int, n_wanted: int) -> Experiments:
    """Return checked experiments.

    Parameters
    ----------
    u, y : array_like of shape (n,), or a sequence of them
        Input, no gaps; output, NaN where missing.

    Raises
    ------
    HydrostateError
        If the signals do not match, hold unusable values, are too short or constant, or the input excites too little.
    """
    input_name, output_name = names
    inputs, outputs = signal_list(u), signal_list(y)
    if len(inputs) != len(outputs):
        raise HydrostateError(f"as many inputs as outputs are needed, got {len(inputs)} and {len(outputs)}")
    for one_u, one_y in zip(inputs, outputs, strict=True):
        _require_signals(one_u, one_y, input_name, output_name)
    together = np.concatenate(outputs)
    used = np.isfinite(together)
    if int(used.sum()) < n_wanted:
        raise HydrostateError(
            f"a fit of so many values needs at least {n_wanted} samples of {output_name!r}, got {int(used.sum())}"
        )
    for one_y in outputs:
        if not np.isfinite(one_y).any():
            raise HydrostateError(f"every experiment needs samples of {output_name!r}, got one without any")
    if np.nanmin(together) == np.nanmax(together):
        raise HydrostateError(f"output {output_name!r} must vary, got {np.nanmin(together):g} throughout")
    _require_excitation(inputs, n_excited, input_name)
    bounds = np.concatenate([[0], np.cumsum([one_u.size for one_u in inputs])]).astype(np.int64)
    return Experiments(np.concatenate(inputs), np.where(used, together, 0.0), used, bounds)


def data_hash(data: Experiments, sample_time: float) -> str:
    """Return the SHA-256 of input, output and sample time as little-endian doubles.

    Parameters
    ----------
    sample_time : float
        Seconds between samples [s].
    """
    digest = hashlib.sha256()
    parts = [data.u, data.measured(), np.array([sample_time])]
    if data.count > 1:
        parts.append(data.bounds.astype(np.float64))
    for values in parts:
        digest.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return digest.hexdigest()


def signal_list(signals: Signals) -> list[Array]:
    """Return signals as a list with one array for each experiment.

    Parameters
    ----------
    signals : array_like of shape (n,), or a sequence of them
        One signal or several.

    Returns
    -------
    list of ndarray
        One at least.
    """
    if isinstance(signals, list | tuple) and len(signals) > 0 and np.ndim(signals[0]) > 0:
        return [np.asarray(signal, dtype=np.float64) for signal in signals]
    return [np.asarray(cast("ArrayLike", signals), dtype=np.float64)]


def _require_signals(u: Array, y: Array, input_name: str, output_name: str) -> None:
    if u.ndim != 1 or u.shape != y.shape:
        raise HydrostateError(
            f"input {input_name!r} and output {output_name!r} must be one-dimensional and of one length, "
            f"got shapes {u.shape} and {y.shape}"
        )
    n_bad = int(np.count_nonzero(~np.isfinite(u)))
    if n_bad:
        raise HydrostateError(
            f"input {input_name!r} must be known at every sample, got {n_bad} missing or infinite of {u.size}"
        )
    if np.isinf(y).any():
        raise HydrostateError(f"output {output_name!r} must be finite or missing (NaN), got infinite values")


def _require_excitation(inputs: list[Array], wanted: int, input_name: str) -> None:
    if all(u.size == 0 or u.min() == u.max() for u in inputs):
        level = f"{inputs[0][0]:g}" if inputs[0].size else "nothing"
        raise HydrostateError(
            f"input {input_name!r} must excite {wanted} coefficients, got the constant {level}: "
            "use steps, a chirp or a pseudo-random binary signal"
        )
    excited = max(_excitation_order(u, wanted) for u in inputs)
    if excited < wanted:
        raise HydrostateError(
            f"input {input_name!r} must excite {wanted} coefficients, got a signal that excites {excited} "
            "(a sine excites two): use steps, a chirp or a pseudo-random binary signal"
        )


def _excitation_order(u: Array, wanted: int) -> int:
    if u.size < 2 * wanted:
        return 0
    windows = np.lib.stride_tricks.sliding_window_view(u, wanted)
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(windows.T @ windows), 0.0))
    # eigenvalues of the Gram matrix are exact to eps, their roots to sqrt(eps); below that the factor's rank decides
    if spread[0] > 1e-7 * spread[-1]:
        return wanted
    return int(np.linalg.matrix_rank(windows))
