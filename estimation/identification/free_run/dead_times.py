"""Dead times of the inputs of a linear model: short ones tried one by one, long ones if a screening shows them."""

from collections.abc import Iterator, Sequence
from itertools import combinations_with_replacement

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.lagged_columns import lay_shifted
from estimation.identification.free_run.least_squares import least_squares
from estimation.identification.free_run.linear_fit import fit_linear, quick_fit
from estimation.identification.free_run.linear_kernel import decay_rows
from estimation.identification.free_run.linear_problem import Form, long_dead_time
from estimation.identification.notes import IdentificationCode
from plant.notes import Note

LONGEST_SHARE = 5
"""Inverse of the longest dead time over the record: the length of the first block, which is never held back. With a
limit of a third, a drift was taken for a dead time in one of 91 logs."""

CLEAR_RATIO = 0.9
"""Largest ratio of the error with a long dead time to that with shorter ones [fraction]: the best of hundreds of dead
times is a few per cent better than the others by chance."""

TIME_CONSTANT_RATIO = 3.0
"""Ratio of the time constants of the screening, from one sample to a fifth of the record: between two neighbours, the
dead time moves by less than the time constant, and it is refined afterwards."""

ORDER, REFINED_GAIN = 3, 1e-4
"""Order of the fits that refine a long dead time, and their least gain for `levenberg`: with fewer poles, the rise of a
third one would be taken for dead time."""

SHORTER_RATIO = 1.005
"""Error with a shorter dead time over that with the best one, up to which the shorter is chosen [dimensionless]."""


UNEXPLAINED_RATIO = 0.5
"""Residual of a model over the output's deviation, from which a longer dead time may be the cause, and ratio of errors
up to which such a dead time is named: in 55 logs without one it is at least 0.6, in five with one at most 0.1."""


def estimate_delays(data: Channels, longest: int | None = None) -> tuple[int, ...]:
    """Return the dead time of each input with which models of low order fit best, one input after the other.

    Dead times up to `long_dead_time` are each tried with second-order models. Longer ones are found by correlation of
    the output with the filtered input, and refined by fits.

    Parameters
    ----------
    data : Channels
        Scaled.
    longest : int, optional
        Longest dead time; by default a fifth of the record [samples].

    Returns
    -------
    tuple of int
        One per input [samples].
    """
    m = len(data.inputs)
    longest = (
        data.informative_samples // LONGEST_SHARE
        if longest is None
        else min(longest, data.informative_samples // LONGEST_SHARE)
    )
    most = min(longest, long_dead_time(data.longest))
    delays = [1] * m
    for index in range(m):
        costs: list[float] = []
        for delay in range(most + 1):
            tried = tuple(delay if k == index else one for k, one in enumerate(delays))
            costs.append(quick_fit(Form(2, (2,) * m, tried), data))
        least = min(costs)
        delays[index] = next(k for k, cost in enumerate(costs) if cost <= SHORTER_RATIO * least)
        delays[index] = _longer_dead_time(data, index, delays, most, longest)
    return tuple(delays)


def late_response_notes(data: Channels, rmse: float) -> list[Note]:
    """Return a note on each input with a response later than the dead times that are searched.

    Held-back blocks cannot judge such a model: a fit with a dead time of up to half of the log is used.

    Parameters
    ----------
    data : Channels
        Scaled.
    rmse : float
        Root-mean-square error of the chosen model [dimensionless].
    """
    if rmse < UNEXPLAINED_RATIO:
        return []
    m, notes = len(data.inputs), list[Note]()
    for index, name in enumerate(data.inputs):
        late = _longer_dead_time(
            data, index, [1] * m, data.informative_samples // LONGEST_SHARE, data.informative_samples // 2
        )
        form = Form(ORDER, (ORDER,) * m, tuple(late if k == index else 1 for k in range(m)))
        left = (
            1.0
            if late == 1
            else float(np.sqrt(fit_linear(form, data, least_gain=REFINED_GAIN).cost / data.n_samples)) / rmse
        )
        if left < UNEXPLAINED_RATIO:
            told = {"samples": late, "dead_time_s": late * data.sample_time, "left": left}
            notes.append(IdentificationCode.ANSWERS_LATE.note(output=data.output, input=name, **told))
    return notes


def _longer_dead_time(data: Channels, index: int, delays: Sequence[int], tried: int, most: int) -> int:
    """Return a longer dead time of one input if its error is clearly smaller, otherwise the given one."""
    if most <= tried:
        return delays[index]
    left = _unexplained_error(data, index, delays, most)
    far = left[tried + 1 :]
    if not far.min() < CLEAR_RATIO * left[: tried + 1].min():
        return delays[index]
    # inputs that repeat themselves, with the same or the opposite sign, explain as much one period later
    first = tried + 1 + int(np.argmax(far <= SHORTER_RATIO * far.min()))
    m, costs = len(data.inputs), dict[int, float]()

    def cost(delay: int) -> float:
        if delay not in costs:
            late = tuple(delay if k == index else one for k, one in enumerate(delays))
            costs[delay] = fit_linear(Form(ORDER, (ORDER,) * m, late), data, least_gain=REFINED_GAIN).cost
        return costs[delay]

    def shortest() -> int:
        least = min(costs.values())
        return min(delay for delay, one in costs.items() if one <= SHORTER_RATIO * least)

    step, centre = max(first // 8, 1), first
    cost(first)
    while step:
        for delay in (centre - step, centre + step):
            cost(int(np.clip(delay, tried + 1, most)))
        # poles can compensate for a dead time that is too short, but not for one that is too long
        moved, centre = centre, shortest()
        step = step // 2 if centre == moved else step
    # if the last dead time searched is best, longer ones would be better still: it is a drift
    return centre if centre < most and cost(centre) < CLEAR_RATIO * cost(delays[index]) else delays[index]


def _unexplained_error(data: Channels, index: int, delays: Sequence[int], most: int) -> Array:
    """Return the squared error that one input leaves for each dead time, shape (most + 1,).

    The input passes through two poles of every pair, and has two coefficients after the dead time. What the other
    inputs and the initial state explain through the same poles is first subtracted from the output.
    """
    least = np.full(most + 1, np.inf)
    others = [k for k in range(len(delays)) if k != index]
    for f in _denominators(data.informative_samples // LONGEST_SHARE):
        crossed, power, beside, told = np.zeros(most + 2), np.zeros(most + 2), np.zeros(most + 1), 0.0
        for u, y in zip(data.u, data.y, strict=True):
            n = y.size
            rows = np.zeros((u.shape[1] + 1, n))
            rows[:-1], rows[-1, 0] = (u - u[0]).T, 1.0
            decay_rows(f, rows, np.zeros(rows.shape[0]))
            known = np.isfinite(y)
            if not known.any():
                continue
            columns = np.ones((n, 3 + 2 * len(others)))
            for place, (row, late) in enumerate([(-1, 0), *((k, delays[k]) for k in others)]):
                for more in (0, 1):
                    lay_shifted(columns[:, 1 + 2 * place + more], rows[row], late + more, 0.0)
            values = least_squares(columns[known], y[known])[0]
            output = np.where(known, y - columns @ values, 0.0)
            told += float(output @ output)
            size = 2 ** int(np.ceil(np.log2(n + most + 2)))
            driven = rows[index] - rows[index].mean()
            crossed += _cross_products(output, driven, size)[: most + 2]
            # inputs count only where an output is present; beyond the log's end none counts as missing
            there = np.concatenate([known, np.ones(size - n)])
            power += _cross_products(there, driven**2, size)[: most + 2]
            beside += _cross_products(there[1:], driven[1:] * driven[:-1], size)[: most + 1]
        least = np.minimum(least, np.maximum(told - _explained_power(crossed, power, beside), 0.0))
    return least


def _cross_products(later: Array, series: Array, size: int) -> Array:
    """Return the sums of products of one series with a shifted other one, by FFT."""
    return np.fft.irfft(np.fft.rfft(later, size) * np.fft.rfft(series, size).conj(), size)


def _explained_power(crossed: Array, power: Array, beside: Array) -> Array:
    """Return what two coefficients explain for each dead time, shape (most + 1,).

    Parameters
    ----------
    crossed, power : ndarray, shape (most + 2,)
        Sums of products of the output with the shifted input, and of the input's own squares.
    beside : ndarray, shape (most + 1,)
        Sums of products of two neighbouring samples of the input.
    """
    (now, later), (one, other) = ((x[:-1], x[1:]) for x in (crossed, power))
    alone = now**2 / np.maximum(one, 1e-300)
    apart = one * other - beside**2
    # otherwise two neighbouring samples of the input differ only by rounding
    both = apart > 1e-6 * one * other
    together = (other * now**2 + one * later**2 - 2.0 * beside * now * later) / np.where(both, apart, 1.0)
    return np.where(both, together, alone)


def _denominators(longest: int) -> Iterator[Array]:
    """Yield denominators of pairs of real poles: no time constant, one sample, and so on up to a number of samples."""
    count = int(np.log(max(longest, 1)) / np.log(TIME_CONSTANT_RATIO)) + 1
    poles = [0.0, *(float(np.exp(-(TIME_CONSTANT_RATIO**-k))) for k in range(count))]
    for pair in combinations_with_replacement(poles, 2):
        yield np.asarray(np.poly(pair), dtype=np.float64)
