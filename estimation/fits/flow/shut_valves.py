"""`shut_valves(plain)`: make-up valves that stay shut in a log where sound valves would have opened."""

from dataclasses import replace

import numpy as np

from estimation.fits.flow.log_traits import LogTraits
from estimation.fits.flow.other_minimum import FINISHING, VALLEY_RADIUS
from estimation.fits.flow.plain import PlainFits
from estimation.fits.greybox.descent import descend
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.hypothesis_search.explain import REQUIRED_GAIN
from estimation.fits.hypothesis_search.not_excluded import blocked_note, unseen_note
from estimation.fits.hypothesis_search.wide_problem import flow_bounds
from estimation.models.completed_flow import CRACKS
from estimation.models.flow import HELD_FLOW_FORM
from plant.notes import Note

MAKEUP = "makeup_conductance"

LEAST_LEAD = 3.0
"""Log-likelihood by which held chambers must be behind [dimensionless]: odds of twenty to one. A lumped plant has no
valves."""


def shut_valves(plain: PlainFits, traits: LogTraits) -> tuple[Note, ...]:
    """Return a note if the plain form explains a log without any make-up flow: a valve is stuck shut, or may be.

    If one valve is stuck shut, the other opens so seldom in small chambers that the likeliest fit may have neither. The
    valve is stuck if sound valves do not explain the log; otherwise the log does not decide. A sound valve passes the
    pump's rated flow at a drop no larger than the inner circuit's pressure, since no larger drop can occur.

    Parameters
    ----------
    plain : PlainFits
        Fits of a log.
    traits : LogTraits
        How the log begins: chambers that are shut in under load need no make-up flow for a long time.

    Returns
    -------
    tuple of Note
        One at most.
    """
    best, p = plain.best, plain.start.parameters
    unfelt = all(np.isinf(best.std.get(name, 0.0)) for name in CRACKS)
    if traits.loaded or traits.moving or not (unfelt and plain.explains(best)):
        return ()
    held = [fit.cost for fit in plain.fits if fit.model.rates is HELD_FLOW_FORM.rates]
    if min(held, default=np.inf) < best.cost + LEAST_LEAD:
        return ()
    narrowest = min(p.makeup_conductance, p.rated_flow / p.accumulator_pressure)
    sound = best.values[MAKEUP] >= narrowest or cost_of_sound_valves(plain, best, narrowest) < REQUIRED_GAIN
    return (unseen_note("A or B") if sound else blocked_note("A or B"),)


def cost_of_sound_valves(plain: PlainFits, best: GreyBoxFit, narrowest: float) -> float:
    """Return how much worse valves of at least a given width fit, searched from the fit and from the rig file.

    Parameters
    ----------
    plain : PlainFits
        Fits of a log.
    best : GreyBoxFit
        The fit whose form is searched, with implicit model steps; both costs are compared with these.
    narrowest : float
        Smallest conductance of the valves [m^3/(s Pa)].

    Returns
    -------
    float
        Loss of log-likelihood; may be negative [dimensionless].
    """
    problem = FreedProblem.of(best.model, replace(plain.log, stiff=True))
    place = best.model.unknowns.index(MAKEUP)  # fitted as a logarithm
    costs = list[float]()
    for values in (best.values, {**best.values, **plain.starts[0]}):
        for conductance in dict.fromkeys((narrowest, max(plain.start.parameters.makeup_conductance, narrowest))):
            begun = problem.model.theta({**values, MAKEUP: conductance})
            lower, upper = flow_bounds(problem.model, [begun], problem.log)
            lower[place], upper[place] = np.log(narrowest), max(np.log(narrowest), upper[place])
            ended = descend(problem.at, np.clip(begun, lower, upper), FINISHING, (lower, upper), radius=VALLEY_RADIUS)
            costs.append(ended.cost)
    return min(costs) - problem.at(problem.model.theta(best.values)).cost
