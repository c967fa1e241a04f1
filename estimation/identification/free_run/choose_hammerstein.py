"""Which nonlinearity at the input, and which order behind it: by the free run on blocks held back."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.bends import KINDS
from estimation.identification.free_run.choose_linear import BLOCKS, CLEARLY, Candidate, block_error, pooled
from estimation.identification.free_run.data import Channels, blocks
from estimation.identification.free_run.hammerstein_fit import (
    HammersteinFit,
    HammersteinProblem,
    fit_hammerstein,
    refitted,
)

ORDERS = 4
"""Order of the linear part at most."""

KEPT = 2
"""Forms of each kind that are judged on blocks held back."""


@dataclass(frozen=True, eq=False)
class HammersteinCandidate:
    """A fit with its held-back error.

    Parameters
    ----------
    held_back : float
        Root-mean-square free-run error of the blocks held back, over the output's deviation [dimensionless].
    bic : float
        Information criterion of the free run [dimensionless].
    """

    fit: HammersteinFit
    held_back: float
    bic: float


def hammerstein_candidates(linear: Sequence[Candidate], data: Channels) -> list[HammersteinCandidate]:
    """Return models of each kind behind linear ones of several orders, judged on blocks held back.

    Parameters
    ----------
    linear : sequence of Candidate
        Linear models of the same data, from which forms and denominators are taken.
    data : Channels
        Scaled, one input.
    """
    denominators: dict[int, list[Array]] = {}
    for one in linear:
        if one.doubt != "time_constant":
            denominators.setdefault(one.form.order, []).append(one.fit.f)
    found: list[HammersteinCandidate] = []
    for kind in KINDS:
        fits = [
            fit
            for one in _bases(linear)
            if (fit := fit_hammerstein(kind, one.form, data, denominators.get(one.form.order, [one.fit.f])))
        ]
        ranked = sorted(((_bic(fit, data), fit) for fit in fits), key=lambda pair: pair[0])[:KEPT]
        found += [HammersteinCandidate(fit, _held_back(fit, data), bic) for bic, fit in ranked]
    return found


def chosen_hammerstein(candidates: Sequence[HammersteinCandidate]) -> HammersteinCandidate:
    """Return the smallest candidate that does nearly as well on held-back blocks as the best.

    Parameters
    ----------
    candidates : sequence of HammersteinCandidate
        One at least.
    """
    least = min(one.held_back for one in candidates)
    near = [one for one in candidates if one.held_back <= (1.0 + CLEARLY) * least]
    return min(near, key=lambda one: one.bic)


def _bases(linear: Sequence[Candidate]) -> list[Candidate]:
    """Return the best linear model of each order, and that of the shortest dead time."""
    best: dict[tuple[int, int], Candidate] = {}
    for one in linear:
        place = (one.form.order, min(one.form.delays[0], 1))
        if one.form.order <= ORDERS and (place not in best or one.held_back < best[place].held_back):
            best[place] = one
    return list(best.values())


def _bic(fit: HammersteinFit, data: Channels) -> float:
    n, p = data.n_samples, fit.theta.size
    return n * float(np.log(max(fit.cost, 1e-300) / n)) + p * float(np.log(n))


def _held_back(fit: HammersteinFit, data: Channels) -> float:
    """Return the free-run error of blocks held back, each simulated by a fit to the others."""
    target, errors = np.concatenate(data.y), list[float]()
    for masks in blocks(data, BLOCKS):
        part = refitted(fit, data.without(masks))
        output = HammersteinProblem(fit.kind, fit.linear.form, data).jacobian(part.theta)[0]
        errors.append(block_error(output - target, np.concatenate(masks) & np.isfinite(target)))
    return pooled(errors)
