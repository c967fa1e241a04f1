"""Chooses the order of a state-space model by its free run on held-back blocks, over all outputs."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimation.identification.free_run.choose_linear import CLEAR_GAIN, PATIENCE
from estimation.identification.free_run.data import Channels, blocks
from estimation.identification.free_run.dead_times import estimate_delays
from estimation.identification.free_run.held_back import BLOCKS, block_error, pooled_error
from estimation.identification.state_space.fit import Effort, StateSpaceFit, fit_state_space
from estimation.identification.state_space.joint import Joint, joined_outputs
from estimation.identification.state_space.problem import Problem, Size
from plant.errors import HydrostateError

COMPARISON_EFFORT, REFIT_EFFORT = Effort(2, 3, 25, 1e-4), Effort(1, 2, 10, 1e-4)
"""Searches where sizes are compared, and those that begin at a fit of nearly the same data."""

Form = tuple[bool, tuple[int, ...]]
"""Whether an input reaches the outputs within its sample, and the samples by which each comes later."""


@dataclass(frozen=True, eq=False)
class StateCandidate:
    """A size, and the scores in its favour.

    Parameters
    ----------
    delays : tuple of int
        Samples by which each input comes later.
    held_back : tuple of float
        Root-mean-square free-run error of the blocks held back, one an output, over its deviation [dimensionless].
    bic, aic : float
        Information criteria of the free run [dimensionless].
    doubt : str
        Why it may not be taken; empty where it may.
    """

    fit: StateSpaceFit
    delays: tuple[int, ...]
    held_back: tuple[float, ...]
    bic: float
    aic: float
    doubt: str

    @property
    def price(self) -> float:
        """Held-back error of all outputs [dimensionless]."""
        return pooled_error(self.held_back)

    def row(self) -> dict[str, Any]:
        """Return the row of this candidate, by the names of the JSON contract."""
        return {
            "structure": "state-space",
            "order": self.fit.size.n,
            "direct": self.fit.size.direct,
            "delay": list(self.delays),
            "held_back_percent": 100.0 * (1.0 - self.price),
            "bic": self.bic,
            "aic": self.aic,
            "doubt": self.doubt or None,
        }


def state_candidates(data: Sequence[Channels], orders: Sequence[int], delay: int | None = None) -> list[StateCandidate]:
    """Return state spaces of several orders, each judged on blocks held back.

    Parameters
    ----------
    data : sequence of Channels
        One an output, scaled, inputs alike.
    orders : sequence of int
        Orders tried, rising; ended early where two in a row bring nothing.
    delay : int, optional
        Dead time of every input [samples]; chosen by the data where not given.

    Returns
    -------
    list of StateCandidate
        One a size that the data could bear.

    Raises
    ------
    HydrostateError
        If they can bear none.
    """
    together, found, best, idle = joined_outputs(data), list[StateCandidate](), np.inf, 0
    refused: HydrostateError | None = None
    forms = _forms(data, delay)
    for order in orders:
        tried = list[StateCandidate]()
        for direct, delays in forms:
            part = together.delayed(delays)
            try:
                fit = fit_state_space(
                    Size(order, part.u[0].shape[1], len(data), direct), part, effort=COMPARISON_EFFORT
                )
            except HydrostateError as error:
                refused = error
                continue
            tried.append(_candidate(fit, delays, part, data[0]))
        found += tried
        now = min((one.price for one in tried if not one.doubt), default=np.inf)
        idle = 0 if now < (1.0 - CLEAR_GAIN) * best else idle + 1
        best = min(best, now)
        if idle >= PATIENCE:
            break
    if not found and refused is not None:
        raise refused
    return found


def _forms(data: Sequence[Channels], delay: int | None) -> list[Form]:
    """Return forms with and without a direct path, and after the dead time that all outputs share."""
    m = len(data[0].inputs)
    if delay is not None:
        return [(delay == 0, (max(delay - 1, 0),) * m)]
    late = tuple(max(min(found) - 1, 0) for found in zip(*(estimate_delays(one) for one in data), strict=True))
    return list(dict.fromkeys([(False, (0,) * m), (True, (0,) * m), (False, late)]))


def _candidate(fit: StateSpaceFit, delays: tuple[int, ...], data: Joint, first: Channels) -> StateCandidate:
    n, size = int(np.isfinite(np.concatenate(data.y)).sum()), fit.size
    values = size.n_matrices - size.n**2 + size.n * len(data.u)
    target = np.concatenate(data.y)
    errors: list[list[float]] = []
    for masks in blocks(first, BLOCKS):
        part = fit_state_space(size, data.without(masks), fit.theta, REFIT_EFFORT)
        problem = Problem(size, data)
        left = problem.outputs(problem.unpacked(part.theta)) - target
        mask = np.concatenate(masks)
        errors.append([block_error(left[:, o], mask & np.isfinite(target[:, o])) for o in range(size.p)])
    held_back = tuple(pooled_error(one) for one in zip(*errors, strict=True))
    criteria = fit.deviance + values * float(np.log(n)), fit.deviance + 2.0 * values
    return StateCandidate(fit, delays, held_back, *criteria, _doubt(fit, data))


def _doubt(fit: StateSpaceFit, data: Joint) -> str:
    """Return ``time_constant`` if the slowest time constant is longer than the longest log; otherwise empty."""
    radius = float(np.abs(np.linalg.eigvals(fit.a)).max())
    longest = max(len(u) for u in data.u)
    return "time_constant" if radius >= 1.0 or (radius > 0.0 and -1.0 / np.log(radius) > longest) else ""


def chosen_state(candidates: Sequence[StateCandidate]) -> StateCandidate:
    """Return the model of least BIC among those that do nearly as well on held-back blocks as the best.

    Parameters
    ----------
    candidates : sequence of StateCandidate
        One at least; where all are doubtful, the best of them is returned.
    """
    sound = [one for one in candidates if not one.doubt] or list(candidates)
    least = min(one.price for one in sound)
    return min((one for one in sound if one.price <= (1.0 + CLEAR_GAIN) * least), key=lambda one: one.bic)
