"""Most likely change point between two circuits, from the derivatives of a fit to the whole log.

They give what two circuits would explain more than one, for every time of change at once (the generalised likelihood
ratio, linearised: Basseville and Nikiforov, Detection of Abrupt Changes, 1993, section 2.4.3), and to first order the
circuits themselves.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.class_fit import LASTING, WEAK_PRIOR, PointFit
from faults.diagnosis.circuits.class_regions import credible_information
from faults.diagnosis.circuits.region_scores import region_scores

EDGE = 1.0
"""Least length of a log before a change and after it [s]."""

GAIN = 10.0
"""Log-likelihood that two circuits must gain over one to be examined [dimensionless]."""


class Split(NamedTuple):
    """A log in two parts, with the circuit of each to first order.

    Parameters
    ----------
    place : int
        First block of the second part.
    before, after : PointFit
        With their own coordinates and information; all else is that of one circuit for all.
    """

    place: int
    before: PointFit
    after: PointFit


def likeliest_split(blocks: Blocks, fit: PointFit) -> Split | None:
    """Return the most likely block of a change between two circuits, if a change explains much more.

    Parameters
    ----------
    blocks : Blocks
        The log.
    fit : PointFit
        The circuit fitted to all of it.

    Returns
    -------
    Split or None
        The block, and both circuits; None if one circuit suffices.
    """
    first, edge = blocks.first, round(EDGE / (blocks.block * blocks.sample_time))
    left = (blocks.outputs - fit.fitted)[first:] / fit.scales
    seen = np.isfinite(left)
    left = np.where(seen, left, 0.0)
    slopes = np.where(seen, fit.slopes[:, first:] / fit.scales, 0.0)
    places = np.arange(edge, len(left) - edge)
    if len(places) == 0:
        return None
    scores = np.cumsum(np.einsum("ink,nk->ni", slopes, left), axis=0)
    known = np.cumsum(np.einsum("ink,jnk->nij", slopes, slopes), axis=0)
    weak = np.linalg.inv(WEAK_PRIOR)
    moved = np.linalg.solve(known[places] + weak, scores[places, :, None])[..., 0]
    moved_on = np.linalg.solve(known[-1] - known[places] + weak, (scores[-1] - scores[places])[..., None])[..., 0]
    gains = np.einsum("ti,ti->t", scores[places], moved) + np.einsum("ti,ti->t", scores[-1] - scores[places], moved_on)
    best = int(np.argmax(gains))
    split = int(places[best])
    explained = np.concatenate(
        [
            np.einsum("ink,i->nk", slopes[:, :split], moved[best]),
            np.einsum("ink,i->nk", slopes[:, split:], moved_on[best]),
        ]
    )
    all_left, least = (np.sum(one**2, axis=0) for one in (left, left - explained))
    tiny = np.finfo(float).tiny
    gain = 0.5 * float(np.sum(seen, axis=0) @ np.log(np.maximum(all_left, tiny) / np.maximum(least, tiny)))
    if gain < GAIN * LASTING:
        return None
    told = known[split], known[-1] - known[split]
    before, after = (
        replace(fit, coordinates=fit.coordinates + step, information=one)
        for step, one in zip((moved[best], moved_on[best]), told, strict=True)
    )
    return Split(first + split, before, after)


def in_one_condition(split: Split, blocks: Blocks, actuator: Actuator) -> bool:
    """Return whether both circuits are, to first order, so clearly in one condition that fits cannot end elsewhere.

    Parameters
    ----------
    split : Split
        Where the log splits.

    Returns
    -------
    bool
        Whether each has lost `GAIN` of log-likelihood in every other condition.
    """
    scores = np.array(
        [region_scores(fit, credible_information(fit, blocks), actuator) for fit in (split.before, split.after)]
    )
    ranked = np.sort(scores, axis=1)
    first, last = np.argmax(scores, axis=1)
    return bool(first == last and np.min(ranked[:, -1] - ranked[:, -2]) > GAIN)
