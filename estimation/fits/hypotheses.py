"""What may be strange about a rig, its oil or its logger, as hypotheses that a log accepts or not.

A log that the plain flow form explains is not asked. One that it does not is fitted under each hypothesis, then under
pairs with the likeliest; what is freed without need only widens the interval.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import product
from typing import TypeAlias

import numpy as np

from estimation.fits.descent import descend
from estimation.fits.form_fit import weighed
from estimation.fits.freed_problem import FreedProblem
from estimation.fits.greybox_fit import GreyBoxFit, concluded
from estimation.fits.greybox_problem import GreyBoxLog, search_bounds
from estimation.models.flow import FLOW_FORM
from estimation.models.wide_flow import LINEAR, WIDE_FLOW_FORM, WideFlowParameters
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.solvers.steps import parameter_names, parameter_row


@dataclass(frozen=True)
class Hypothesis:
    """Something that a rig, its oil or its logger may add to the plain flow form.

    Parameters
    ----------
    name : str
        Name.
    free : tuple of str
        Parameters of `WideFlowParameters` that are fitted beside the plain ones.
    starts : tuple of Mapping[str, float]
        First guesses [SI]; parameters that are not named start where they are absent.
    delays : tuple of float
        Times by which the pressure may come late beside its lag [s].
    """

    name: str
    free: tuple[str, ...]
    starts: tuple[Mapping[str, float], ...] = ({},)
    delays: tuple[float, ...] = (0.0,)


DELIVERY = Hypothesis("delivery", ("pump_displacement",))
"""Asked of every log: a pump that delivers less may pass for leakage, with bulk modulus a fifth too low."""

START_LOAD = Hypothesis("start_load", ("start_pressure", "start_level"))

HYPOTHESES = (
    Hypothesis("pressure_late", ("pressure_lag",), ({"pressure_lag": 1e-3},), (0.0, 2e-3, 5e-3, 9e-3)),
    Hypothesis("pressure_offset", ("pressure_offset",)),
    Hypothesis("encoder_zero", ("position_zero",), ({"position_zero": -0.06}, {"position_zero": 0.06})),
    DELIVERY,
    Hypothesis("volume", ("chamber_volume",)),
    START_LOAD,
    Hypothesis("air", ("air_softness",), ({"air_softness": 1e2}, {"air_softness": 1e3})),
    Hypothesis(
        "leakage_growth", ("leakage_growth", "leakage_bend"), ({"leakage_growth": 1.0}, {"leakage_growth": 10.0})
    ),
    Hypothesis(
        "makeup_blocked",
        ("makeup_share_b",),
        ({"makeup_share_b": 1e-4}, {"makeup_share_b": 1e4, "makeup_conductance": 1e-13}),
    ),
    Hypothesis("checks_crack", ("crack_pressure",), ({"crack_pressure": 1e4},)),
    Hypothesis("port_a_drains", ("drain_share_a",), ({"drain_share_a": 1e2},)),
    Hypothesis("port_b_drains", ("drain_share_b",), ({"drain_share_b": 1e2},)),
)
"""In no order: the log chooses."""

LIMITS: Mapping[str, tuple[float, float]] = {
    "makeup_opening": (1e2, 1e6),
    "pressure_lag": (0.0, 0.05),
    "pressure_offset": (-1e7, 1e7),
    "position_zero": (-1.0, 1.0),
    "start_pressure": (-1e7, 1e7),
    "start_level": (-2.5e5, 1e7),
    "air_softness": (0.0, 1e5),
    "leakage_growth": (-1.0, 100.0),
    "crack_pressure": (-1e5, 2e5),
    "leakage_bend": (-100.0, 100.0),
}
"""Least and largest values where physics gives them [SI]."""

PRESUMED = {"chamber_volume": 0.15, "pump_displacement": 0.15}
"""Standard deviation of the logarithm of what a rig file says, before the log is seen [dimensionless]: dead volume is
seldom measured; a pump that delivers less than its displacement is worn."""

SCREENING, SETTLING, FINISHING = 7, 40, 12
"""Evaluations of the model for a start, for one that is carried on, and for the last, with short model steps."""

FINALISTS, CARRIED = 3, 2
"""Hypotheses that are carried on, and starts of each."""

FINEST_DELAY = 1e-3
"""Step in which a delay is sought [s]; what is left of it goes into the lag."""

LEAST_DELIVERY = 1e-2
"""Relative change of the pump's delivery below which it is not freed: no rig file is surer [fraction]."""

CLOSE = 60.0
"""Difference of log-likelihood up to which a rival is fitted to the end, with short model steps [dimensionless]."""

WORTH = 10.0
"""Gain in log-likelihood below which a hypothesis is not accepted [dimensionless]."""

ALIKE = 15.0
"""Difference of log-likelihood up to which two sets of hypotheses are said to explain a log alike [dimensionless]."""


@dataclass(frozen=True, eq=False)
class Explanation:
    """What explains a log that the plain flow form does not.

    Parameters
    ----------
    names : tuple of str
        The hypotheses that were accepted together.
    values : Mapping[str, tuple of float]
        Value and standard deviation by parameter, in SI.
    delay : float
        Time by which pressure comes late beside its lag [s].
    fit : GreyBoxFit
        The fit under them.
    rig_std : Mapping[str, float]
        What the rig's uncertain parameters add to each deviation, in SI.
    rivals : int
        How many other sets of hypotheses explain the log about as well.
    """

    names: tuple[str, ...]
    values: Mapping[str, tuple[float, float]]
    delay: float
    fit: GreyBoxFit
    rig_std: Mapping[str, float]
    rivals: int


@dataclass(frozen=True, eq=False)
class _Tried:
    """A set of hypotheses with the best that was found under it."""

    together: tuple[Hypothesis, ...]
    theta: Array
    values: Mapping[str, float]
    cost: float
    delay: float
    finished: GreyBoxFit | None = None

    @property
    def fit(self) -> GreyBoxFit:
        if self.finished is None:
            raise ValueError("only finished fits are compared")
        return self.finished


Accepted: TypeAlias = Callable[[GreyBoxFit], bool]


def explain(
    log: GreyBoxLog,
    parameters: EhaParameters,
    starts: Sequence[Mapping[str, float]],
    accepted: Accepted,
    *,
    asked: Sequence[Hypothesis] = HYPOTHESES,
) -> Explanation:
    """Return the hypotheses that explain a log best, alone or two together.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the plain flow form sees it.
    parameters : EhaParameters
        The actuator.
    starts : sequence of Mapping[str, float]
        First guesses of the plain form's unknowns [SI].
    accepted : callable
        ``accepted(fit)``: whether a fit explains the log.
    asked : sequence of Hypothesis
        What is tried alone; pairs are with any other.

    Returns
    -------
    Explanation
        The likeliest; whether it explains the log is for the gate to say.
    """
    wide = _widened(log, parameters)
    finished = _likeliest(wide, (_screened(wide, (one,), starts) for one in asked))
    first = finished[0]
    if not accepted(first.fit):
        late = delayed(wide, first.delay)
        others = [one for one in HYPOTHESES if one not in first.together]
        pairs = _likeliest(late, (_screened(late, (*first.together, one), [first.values]) for one in others))
        better = (one for one in pairs if one.cost < first.cost - WORTH)
        finished = _ranked([first, *(replace(one, delay=first.delay + one.delay) for one in better)])
    best = finished[0]
    rivals = [one for one in finished[1:] if one.cost < best.cost + ALIKE]
    found, rig_std = weighed([best.fit, *(one.fit for one in rivals)])
    values = {name: (value, best.fit.std[name]) for name, value in best.fit.values.items()} | dict(found)
    return Explanation(tuple(one.name for one in best.together), values, best.delay, best.fit, rig_std, len(rivals))


def promised(
    log: GreyBoxLog, parameters: EhaParameters, plain: Mapping[str, float], one: Hypothesis
) -> tuple[float, float]:
    """Return what a hypothesis promises beside the plain fit, to first order.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the plain flow form sees it.
    parameters : EhaParameters
        The actuator.
    plain : Mapping[str, float]
        What the plain form found [SI].
    one : Hypothesis
        What is asked.

    Returns
    -------
    tuple of float
        Gain in log-likelihood, Rao's score statistic over two [dimensionless], and how far what is freed first would
        move in its fitted coordinate: for a logarithm a relative change [dimensionless].
    """
    wide = _widened(log, parameters)
    problem = _problem(wide, (one,))
    absent = dict(zip(parameter_names(WideFlowParameters), wide.parameters, strict=True))
    point = problem.at(problem.model.theta({**absent, **plain}))
    step = np.linalg.lstsq(point.gram, point.gradient, rcond=None)[0]
    return 0.5 * float(point.gradient @ step), float(abs(step[problem.model.unknowns.index(one.free[0])]))


def _widened(log: GreyBoxLog, parameters: EhaParameters) -> GreyBoxLog:
    samples = len(log.drives)
    known = {one.name: getattr(parameters, one.name) for one in fields(parameters)}
    return replace(
        log,
        drives=np.column_stack([log.drives, np.arange(samples) / samples]),
        drive_std=(*log.drive_std, 0.0),
        parameters=parameter_row(WideFlowParameters(**known)),
        presumed={**log.presumed, **{name: (known[name], std) for name, std in PRESUMED.items()}},
    )


def _problem(log: GreyBoxLog, together: Sequence[Hypothesis]) -> FreedProblem:
    extra = dict.fromkeys(name for one in together for name in one.free)
    return FreedProblem(WIDE_FLOW_FORM, log, (*FLOW_FORM.unknowns, *extra), LINEAR)


def _ranked(tried: Iterable[_Tried]) -> list[_Tried]:
    return sorted(tried, key=lambda one: one.cost)


def _screened(
    log: GreyBoxLog, together: tuple[Hypothesis, ...], starts: Sequence[Mapping[str, float]]
) -> Iterator[_Tried]:
    """Yield the best from each start after a few steps, with one model step a sample."""
    absent = dict(zip(parameter_names(WideFlowParameters), log.parameters, strict=True))
    problems = [(delay, _problem(delayed(log, delay).coarsened(), together)) for delay in together[-1].delays]
    for start in starts:
        tried: list[_Tried] = []
        for (delay, problem), own in product(problems, together[-1].starts):
            guess = problem.model.theta({**absent, **start, **own})
            point = descend(problem.at, guess, SCREENING, _bounds(problem, guess))
            tried.append(_Tried(together, point.theta, problem.model.values(point.theta), point.cost, delay))
        yield min(tried, key=lambda one: one.cost)


def _settled(log: GreyBoxLog, tried: _Tried) -> _Tried:
    """Return a set of hypotheses brought to its optimum, with one model step a sample."""
    best = _descended(delayed(log, tried.delay).coarsened(), tried, SETTLING)
    if len(tried.together[-1].delays) == 1:
        return best
    for step in (FINEST_DELAY, -FINEST_DELAY):
        while best.delay + step >= 0.0:
            moved = replace(best, delay=best.delay + step)
            moved = _descended(delayed(log, moved.delay).coarsened(), moved, SETTLING)
            if moved.cost >= best.cost:
                break
            best = moved
    return best


def _descended(log: GreyBoxLog, tried: _Tried, evaluations: int) -> _Tried:
    problem = _problem(log, tried.together)
    point = descend(problem.at, tried.theta, evaluations, _bounds(problem, tried.theta))
    return replace(tried, theta=point.theta, values=problem.model.values(point.theta), cost=point.cost)


def _finished(log: GreyBoxLog, tried: _Tried) -> _Tried:
    """Return a set of hypotheses fitted to the end, balanced by volume or by mass, whichever is likelier."""
    row, by_mass = delayed(log, tried.delay), parameter_names(WideFlowParameters).index("by_mass")
    done: list[tuple[_Tried, GreyBoxLog]] = []
    for share in (0.0, 1.0):
        parameters = row.parameters.copy()
        parameters[by_mass] = share
        own = replace(row, parameters=parameters)
        done.append((_descended(own, done[-1][0] if done else tried, FINISHING), own))
    best, own = min(done, key=lambda one: one[0].cost)
    problem = _problem(own, best.together)
    return replace(best, finished=concluded(problem, problem.at(best.theta)))


def _likeliest(log: GreyBoxLog, tried: Iterable[Iterable[_Tried]]) -> list[_Tried]:
    """Return the likeliest of several sets of hypotheses, each tried from some starts, the best first."""
    sets = sorted((_ranked(one) for one in tried), key=lambda one: one[0].cost)[:FINALISTS]
    settled = _ranked(_ranked(_settled(log, start) for start in one[:CARRIED])[0] for one in sets)
    return _ranked(_finished(log, one) for one in settled if one.cost < settled[0].cost + CLOSE)


def _bounds(problem: FreedProblem, guess: Array) -> tuple[Array, Array]:
    return search_bounds(problem.model, [guess], {**LIMITS, "speed_lead": (0.0, problem.log.sample_time)})


def delayed(log: GreyBoxLog, delay: float) -> GreyBoxLog:
    """Return a log whose outputs are brought forward by a time.

    Parameters
    ----------
    log : GreyBoxLog
        The log.
    delay : float
        How late its outputs come [s].

    Returns
    -------
    GreyBoxLog
        The log, its last outputs missing.
    """
    samples = round(delay / log.sample_time)
    if samples == 0:
        return log
    measured = np.full_like(log.measured, np.nan)
    measured[:-samples] = log.measured[samples:]
    return replace(log, measured=measured)
