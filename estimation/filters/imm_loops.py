"""The compiled loop of the interacting multiple model filter: mix, step every mode, weight, combine."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import TypeAlias

import numpy as np

from estimation.arrays import Array, IntArray
from estimation.engine.contract import Samples, Trace
from estimation.engine.parts import rule_functions
from estimation.engine.rule import Rule
from estimation.models.model import ProcessModel
from plant.compiled.native.load import load_native
from plant.compiled.native.signature import signature_of
from plant.compiled.paste import functions_text, kernel_text

Kind = tuple[Rule, ProcessModel]
"""A filter on a model, shared by modes that differ only in parameters."""


Room: TypeAlias = tuple[Array, Array, Array, Array]
"""Workspace of `mix`: states, terms and weights of the modes, and a belief."""

Work: TypeAlias = tuple[Array, Array, Array, Array, Array, Room]
"""Workspace of `step_bank`: predicted log probabilities (modes,), which before the first sample are the prior's;
innovations and their variances (modes, 2, channels); terms, weights and shares (modes,); and the workspace of `mix`."""

Chain: TypeAlias = tuple[Array, Array]
"""Logarithms of transitions (modes, modes) and of each mode's probability (modes,)."""

Judged: TypeAlias = tuple[Array, Array, Array]
"""Sums of squared normalised innovations and counts of samples present (channels,), and the last sample's innovations
with their variances (2, channels)."""

PrepareMode: TypeAlias = Callable[[int, Array, Array], None]
PredictMode: TypeAlias = Callable[[int, Array, Array, Array, Array, float], None]
UpdateMode: TypeAlias = Callable[[int, Array, Array, Array, Array], None]
"""As in `estimation.engine.parts`, with the kind as first argument."""


def log_sum(terms: Array, shares: Array) -> float:
    """Return the logarithm of a sum of exponentials, and fill in the share of each."""
    largest = -np.inf
    for term in terms:
        if term > largest:
            largest = term
    if largest == -np.inf:
        shares[:] = 0.0
        return largest
    total = 0.0
    for i in range(terms.shape[0]):
        shares[i] = math.exp(terms[i] - largest)
        total += shares[i]
    for i in range(terms.shape[0]):
        shares[i] /= total
    return largest + math.log(total)


def blend(states: Array, weights: Array, shift: Array, result: Array, *, WIDTH: int, BELIEF: int) -> None:
    """Set the moments of a mixture, relative to its heaviest part: equal parts stay unchanged to the last bit."""
    best = 0
    for i in range(weights.shape[0]):
        if weights[i] > weights[best]:
            best = i
    shift[:] = 0.0
    for i in range(weights.shape[0]):
        if weights[i] > 0.0 and i != best:
            for q in range(BELIEF):
                shift[q] += weights[i] * (states[i, q] - states[best, q])
    for q in range(BELIEF):
        result[q] = states[best, q] + shift[q]
    for i in range(weights.shape[0]):
        if weights[i] > 0.0:
            for a in range(WIDTH):
                shift[a] = states[i, a] - result[a]
            place = WIDTH
            for a in range(WIDTH):
                for b in range(a, WIDTH):
                    result[place] += weights[i] * shift[a] * shift[b]
                    place += 1


def mix(
    states: Array, transitions: Array, log_probability: Array, predicted: Array, room: Room, *, WIDTH: int, BELIEF: int
) -> None:
    """Start each mode from the mixture of all modes, each weighted by the probability that it came before."""
    mixed, terms, weights, shift = room
    modes = states.shape[0]
    for i in range(modes):
        for j in range(modes):
            terms[j] = transitions[j, i] + log_probability[j]
        predicted[i] = log_sum(terms, weights)
        for q in range(states.shape[1]):
            mixed[i, q] = states[i, q]
        if predicted[i] > -np.inf:
            blend(states, weights, shift, mixed[i], WIDTH=WIDTH, BELIEF=BELIEF)
    for i in range(modes):
        for q in range(states.shape[1]):
            states[i, q] = mixed[i, q]


def log_density(sample: Array, seen: Array, state: Array, *, BELIEF: int) -> float:
    """Return the log density of a sample under a mode's innovations; minus infinity if the mode is no longer finite."""
    score = 0.0
    for c in range(sample.shape[0]):
        if sample[c] == sample[c]:
            e, s = seen[0, c], seen[1, c]
            score -= 0.5 * (e * e / s + math.log(2.0 * math.pi * s))
    for a in range(BELIEF):
        if not math.isfinite(state[a]):
            score = -np.inf
    return score if score == score else -np.inf


def innovate(c: int, y: float, seen: Array, shares: Array, believed: float) -> tuple[float, float]:
    """Return the mixture's innovation of a channel and its variance; NaN if nothing is measured."""
    e = s = np.nan
    if y == y and believed > 0.0:
        e = s = 0.0
        for i in range(shares.shape[0]):
            if shares[i] > 0.0:
                e += shares[i] / believed * seen[i, 0, c]
        for i in range(shares.shape[0]):
            if shares[i] > 0.0:
                s += shares[i] / believed * (seen[i, 1, c] + (seen[i, 0, c] - e) ** 2)
    return e, s


def unpack(belief: Array, mean: Array, covariance: Array, *, WIDTH: int) -> None:
    """Read a mean and a covariance from a belief."""
    place = WIDTH
    for a in range(WIDTH):
        mean[a] = belief[a]
        for b in range(a, WIDTH):
            covariance[a, b] = covariance[b, a] = belief[place]
            place += 1


def judge(sample: Array, seen: Array, predicted: Array, terms: Array, shares: Array, judged: Judged) -> None:
    """Score the mixture's innovations; a mode without probability is left out."""
    nis, count, innovations = judged
    believed = 0.0
    for i in range(shares.shape[0]):
        shares[i] = math.exp(predicted[i]) if terms[i] > -np.inf else 0.0
        believed += shares[i]
    for c in range(sample.shape[0]):
        e, s = innovate(c, sample[c], seen, shares, believed)
        innovations[0, c] = e
        innovations[1, c] = s
        if e == e:
            nis[c] += e * e / s
            count[c] += 1.0


def step_bank(
    begun: int,
    states: Array,
    constants: Array,
    kinds: IntArray,
    chain: Chain,
    before: Array,
    after: Array,
    sample: Array,
    substeps: int,
    work: Work,
    judged: Judged,
    *,
    WIDTH: int,
    BELIEF: int,
    predict: PredictMode,
    update: UpdateMode,
) -> float:
    """Mix, step every mode, weight and judge by one sample; return the logarithm of its density."""
    transitions, log_probability = chain
    predicted, seen, terms, weights, shares, room = work
    modes = states.shape[0]
    if begun > 0:
        mix(states, transitions, log_probability, predicted, room, WIDTH=WIDTH, BELIEF=BELIEF)
        for i in range(modes):
            for j in range(substeps):
                predict(kinds[i], states[i], constants[i], before, after, float(j))
    for i in range(modes):
        update(kinds[i], states[i], constants[i], sample, seen[i])
        terms[i] = predicted[i] + log_density(sample, seen[i], states[i], BELIEF=BELIEF)
    total = log_sum(terms, weights)
    for i in range(modes):
        log_probability[i] = terms[i] - total
    judge(sample, seen, predicted, terms, shares, judged)
    return total


def combine(
    density: float, states: Array, weights: Array, shift: Array, overall: Array, *, WIDTH: int, BELIEF: int
) -> None:
    """Set the moments of the bank after a sample; NaN if no mode is finite any more."""
    if density == -np.inf:
        overall[:] = np.nan
    else:
        blend(states, weights, shift, overall, WIDTH=WIDTH, BELIEF=BELIEF)


def run(
    states: Array,
    rows: Array,
    kinds: IntArray,
    transitions: Array,
    log_probability: Array,
    samples: Samples,
    history: Array,
    trace: Trace,
    *,
    WIDTH: int,
    BELIEF: int,
    CONSTANTS: int,
    prepare: PrepareMode,
    predict: PredictMode,
    update: UpdateMode,
) -> float:
    """Mix, step every mode, weight and combine, at every sample; return the log-likelihood.

    Parameters
    ----------
    states : ndarray, shape (modes, carried)
        Carried values of each mode.
    rows : ndarray, shape (modes, constants)
        Constants of each mode's filter.
    kinds : ndarray of int, shape (modes,)
        Index of each mode's filter and model.
    transitions : ndarray, shape (modes, modes)
        Logarithms of the transitions.
    log_probability : ndarray, shape (modes,)
        Log probabilities of the modes, before the first and after the last sample.
    history : ndarray, shape (rows, modes)
        Logarithms of the probabilities along the track.
    """
    drives, measured, substeps, every = samples
    (n, channels), modes = measured.shape, states.shape[0]
    constants, seen = np.empty((modes, CONSTANTS)), np.empty((modes, 2, channels))
    terms, weights, shares, shift = np.empty(modes), np.empty(modes), np.empty(modes), np.empty(BELIEF)
    work = log_probability.copy(), seen, terms, weights, shares, (np.empty_like(states), terms, weights, shift)
    overall, innovations = np.empty(BELIEF), np.empty((2, channels))
    chain, judged = (transitions, log_probability), (trace.nis, trace.count, innovations)
    log_likelihood = 0.0
    for i in range(modes):
        prepare(kinds[i], rows[i], constants[i])
    for k in range(n):
        before, after, sample = drives[max(k - 1, 0)], drives[k], measured[k]
        density = step_bank(
            k,
            states,
            constants,
            kinds,
            chain,
            before,
            after,
            sample,
            substeps,
            work,
            judged,
            WIDTH=WIDTH,
            BELIEF=BELIEF,
            predict=predict,
            update=update,
        )
        log_likelihood += density
        if trace.residuals.shape[0] > 0:
            trace.residuals[k], trace.residual_variances[k] = innovations[0], innovations[1]
        if k % every == 0 or k == n - 1:
            combine(density, states, weights, shift, overall, WIDTH=WIDTH, BELIEF=BELIEF)
            unpack(overall, trace.mean, trace.covariance, WIDTH=WIDTH)
        if k % every == 0:
            for i in range(modes):
                history[k // every, i] = log_probability[i]
            for a in range(WIDTH):
                trace.track[k // every, a] = trace.mean[a]
                trace.track_variance[k // every, a] = trace.covariance[a, a]
    return log_likelihood


STEP = (log_sum, blend, mix, log_density, innovate, judge, step_bank, combine)
"""Functions that a bank's step calls, and the one that combines its modes."""


@dataclass(frozen=True)
class ImmKernel:
    """A compiled bank.

    Parameters
    ----------
    run : callable
        The generated loop; `estimation.filters.imm` calls it.
    carried : int
        Number of values that each mode carries from sample to sample.
    """

    run: Callable[..., float]
    carried: int


def _dispatch(name: str, arguments: str, kinds: int) -> str:
    """Write the code that selects the functions of a mode's kind."""
    choices = [(f"    if kind == {kind}:", f"        {name}_{kind}({arguments})") for kind in range(kinds)]
    head = f"def {name}(kind, {arguments}):"
    return "\n".join([head, *(line for choice in choices for line in choice)])


@cache
def compile_imm(kinds: tuple[Kind, ...], channels: tuple[str, ...]) -> ImmKernel:
    """Generate and load the loop of a bank.

    Parameters
    ----------
    kinds : tuple of (Rule, ProcessModel)
        The distinct filters and models in it, all with the same states.
    """
    rules = [rule_functions(rule, model, channels, f"_{i}") for i, (rule, model) in enumerate(kinds)]
    width = kinds[0][1].width
    sizes = {"WIDTH": width, "BELIEF": width + width * (width + 1) // 2}
    sizes["CONSTANTS"] = max(rule.constants for rule in rules)
    parts = (
        *(rule.source for rule in rules),
        _dispatch("prepare", "rows, constants", len(kinds)),
        _dispatch("predict", "state, constants, before, after, j", len(kinds)),
        _dispatch("update", "state, constants, sample, seen", len(kinds)),
        functions_text(*STEP, unpack, run, constants=sizes),
    )
    names = "_".join(f"{rule.name}_{model.name}" for rule, model in kinds)
    text = kernel_text(f"interacting models, {names}", *parts)
    kernel = load_native(f"imm_{names}", text, {"run": signature_of(run)})
    return ImmKernel(kernel.run, max(len(rule.carried) for rule in rules))
