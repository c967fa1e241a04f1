"""Which nonlinearity at the input, and which order behind it: by the free run on held-back blocks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.choose_linear import Candidate, criteria, smallest_good_candidate
from estimation.identification.free_run.data import Channels, Scaling, blocks
from estimation.identification.free_run.hammerstein_fit import (
    HammersteinFit,
    HammersteinProblem,
    fit_hammerstein,
    refitted_hammerstein,
)
from estimation.identification.free_run.held_back import BLOCKS, ComparedModel, block_error, is_better_beyond_chance
from estimation.identification.free_run.input_nonlinearity import NONLINEARITIES
from estimation.identification.free_run.linear_fit import COARSE
from estimation.identification.free_run.transfer_function import linear_model
from estimation.progress import report_progress

ORDERS = 4
"""Highest order of the linear part."""

BENT_MARGIN = 0.02
"""Share by which a nonlinearity at the input must reduce the held-back error."""

UNSCALED = Scaling(np.zeros(1), np.ones(1), 0.0, 1.0)
"""Poles and zeros are the same in every scale."""


@dataclass(frozen=True, eq=False)
class HammersteinCandidate(ComparedModel):
    """A fit with its held-back error.

    Parameters
    ----------
    doubt : str
        ``cancelling`` if a pole of the linear part, slower than a block, cannot be distinguished from a zero; otherwise
        empty.
    """

    fit: HammersteinFit
    doubt: str = ""


def hammerstein_candidates(linear: Sequence[Candidate], data: Channels) -> list[HammersteinCandidate]:
    """Return models of each kind before linear ones of several orders, the best of each judged on held-back blocks.

    Models that leave too much of their own data are not judged.

    Parameters
    ----------
    linear : sequence of Candidate
        Linear models of the same data, which provide forms and denominators.
    data : Channels
        Scaled, one input.
    """
    denominators: dict[int, list[Array]] = {}
    for one in linear:
        if one.doubt != "time_constant":
            denominators.setdefault(one.form.order, []).append(one.fit.f)
    # a model whose error on its own data exceeds the bar for held-back data has no chance there
    bar = (1.0 - BENT_MARGIN) * min(one.held_back for one in linear)
    found: list[HammersteinCandidate] = []
    for kind in NONLINEARITIES:
        best: dict[int, tuple[float, HammersteinFit]] = {}
        for one in _bases(linear):
            order = one.form.order
            report_progress("nonlinear inputs")
            fit = fit_hammerstein(kind, one.form, data, denominators.get(order, [one.fit.f]))
            if fit is not None and (order not in best or _bic(fit, data) < best[order][0]):
                best[order] = _bic(fit, data), fit
        found += [
            HammersteinCandidate(
                fit, _cancellation_doubt(fit, data), block_errors=_held_back_errors(fit, data), bic=bic
            )
            for bic, fit in best.values()
            if np.sqrt(fit.cost / data.n_samples) < bar
        ]
    return found


def chosen_hammerstein(candidates: Sequence[HammersteinCandidate]) -> HammersteinCandidate:
    """Return the smallest candidate that is nearly as good on held-back blocks as the best.

    A slow pole that a zero nearly cancels follows the drift of one record. Outputs on both sides determine a held-back
    block, but not another record.

    Parameters
    ----------
    candidates : sequence of HammersteinCandidate
        At least one; if all are doubtful, one of them is returned.
    """
    sound = [one for one in candidates if not one.doubt] or list(candidates)
    return smallest_good_candidate(sound, min(one.held_back for one in sound))


def worthwhile_candidate(
    candidates: Sequence[HammersteinCandidate], linear: Sequence[Candidate], best: Candidate, *, surely: bool
) -> HammersteinCandidate | None:
    """Return the candidate, if it is better than every linear model.

    Parameters
    ----------
    candidates : sequence of HammersteinCandidate
        Models with a nonlinearity at their input.
    linear : sequence of Candidate
        Models without a nonlinearity.
    best : Candidate
        The one that is chosen otherwise.
    surely : bool
        Whether it must be better by more than chance, since the user did not ask for a nonlinearity.

    Returns
    -------
    HammersteinCandidate or None
        None if the linear model is kept.
    """
    if not candidates:
        return None
    taken = chosen_hammerstein(candidates)
    bar = min(best.held_back, *(one.held_back for one in linear))
    if not taken.held_back < (1.0 - BENT_MARGIN) * bar:
        return None
    return None if surely and not is_better_beyond_chance(taken.block_errors, best.block_errors) else taken


def _bases(linear: Sequence[Candidate]) -> list[Candidate]:
    """Return the best linear model of each order, and that of the shortest dead time."""
    best: dict[tuple[int, int], Candidate] = {}
    for one in linear:
        place = (one.form.order, min(one.form.delays[0], 1))
        if one.form.order <= ORDERS and (place not in best or one.held_back < best[place].held_back):
            best[place] = one
    return list(best.values())


def _bic(fit: HammersteinFit, data: Channels) -> float:
    return criteria(fit.cost, fit.theta.size, data.n_samples)[0]


def _cancellation_doubt(fit: HammersteinFit, data: Channels) -> str:
    """Return a mark if a pole of the linear part, slower than a held-back block, cancels with a zero."""
    behind, _ = HammersteinProblem(fit.kind, fit.linear.form, data).behind_nonlinearity(fit.values, fit.starts)
    slow = np.exp(-(BLOCKS + 1.0) / data.longest)
    pairs = linear_model(fit.linear, behind, UNSCALED).cancellations
    return "cancelling" if any(abs(one.pole) > slow for one in pairs) else ""


def _held_back_errors(fit: HammersteinFit, data: Channels) -> tuple[float, ...]:
    """Return the free-run error of each held-back block, simulated by a fit to the others."""
    target, errors = np.concatenate(data.y), list[float]()
    for masks in blocks(data, BLOCKS):
        report_progress("nonlinear inputs")
        part = refitted_hammerstein(fit, data.without(masks), COARSE)
        output = HammersteinProblem(fit.kind, fit.linear.form, data).jacobian(part.theta)[0]
        errors.append(block_error(output - target, np.concatenate(masks) & np.isfinite(target)))
    return tuple(errors)
