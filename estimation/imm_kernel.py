"""The compiled loop of the interacting multiple model filter: mix, step every mode, weigh, combine."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from estimation.algebra import Rule
from estimation.model import ProcessModel
from estimation.parts import HEADER, rule_functions
from plant.compiled.kernel_file import load_kernel

Kind = tuple[Rule, ProcessModel]
"""What modes share: a filter on a model; they differ in parameters."""

_LOOP = '''

@numba.njit(cache=True, nogil=True, error_model="numpy")
def prepare(kind, rows, constants):
{prepare}


@numba.njit(cache=True, nogil=True, error_model="numpy")
def predict(kind, state, constants, before, after, j):
{predict}


@numba.njit(cache=True, nogil=True, error_model="numpy")
def update(kind, state, constants, sample, seen):
{update}


@numba.njit(cache=True, nogil=True, error_model="numpy")
def log_sum(terms, shares):
    """Log of the sum of exponentials; the share of each in it."""
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


@numba.njit(cache=True, nogil=True, error_model="numpy")
def blend(states, weights, shift, result):
    """Moments of a mixture, about its heaviest part: equal parts stay what they are, to the last bit."""
    best = 0
    for i in range(weights.shape[0]):
        if weights[i] > weights[best]:
            best = i
    shift[:] = 0.0
    for i in range(weights.shape[0]):
        if weights[i] > 0.0 and i != best:
            for q in range({belief}):
                shift[q] += weights[i] * (states[i, q] - states[best, q])
    for q in range({belief}):
        result[q] = states[best, q] + shift[q]
    for i in range(weights.shape[0]):
        if weights[i] > 0.0:
            for a in range({width}):
                shift[a] = states[i, a] - result[a]
            place = {width}
            for a in range({width}):
                for b in range(a, {width}):
                    result[place] += weights[i] * shift[a] * shift[b]
                    place += 1


@numba.njit(cache=True, nogil=True, error_model="numpy")
def mix(states, mixed, transitions, log_probability, predicted, terms, weights, shift):
    modes = states.shape[0]
    for i in range(modes):
        for j in range(modes):
            terms[j] = transitions[j, i] + log_probability[j]
        predicted[i] = log_sum(terms, weights)
        mixed[i] = states[i]
        if predicted[i] > -np.inf:
            blend(states, weights, shift, mixed[i])
    states[:] = mixed


@numba.njit(cache=True, nogil=True, error_model="numpy")
def run(
    states, rows, kinds, transitions, log_probability, drives, measured, substeps, every,
    track, track_variance, history, mean, covariance, nis, count, residuals, residual_variances,
):
    n, channels = measured.shape
    modes = states.shape[0]
    keep = residuals.shape[0] == n
    constants = np.empty((modes, {constants}))
    seen = np.empty((modes, 2, channels))
    mixed = np.empty_like(states)
    terms, weights, shares, shift = np.empty(modes), np.empty(modes), np.empty(modes), np.empty({belief})
    predicted = log_probability.copy()
    overall = np.empty({belief})
    log_likelihood = 0.0
    for i in range(modes):
        prepare(kinds[i], rows[i], constants[i])
    for k in range(n):
        if k > 0:
            mix(states, mixed, transitions, log_probability, predicted, terms, weights, shift)
            for i in range(modes):
                for j in range(substeps):
                    predict(kinds[i], states[i], constants[i], drives[k - 1], drives[k], float(j))
        for i in range(modes):
            update(kinds[i], states[i], constants[i], measured[k], seen[i])
            score = 0.0
            for c in range(channels):
                if measured[k, c] == measured[k, c]:
                    e, s = seen[i, 0, c], seen[i, 1, c]
                    score -= 0.5 * (e * e / s + math.log(2.0 * math.pi * s))
            for a in range({belief}):
                if not math.isfinite(states[i, a]):
                    score = -np.inf
            terms[i] = predicted[i] + score if score == score else -np.inf
        total = log_sum(terms, weights)
        log_likelihood += total
        for i in range(modes):
            log_probability[i] = terms[i] - total
        believed = 0.0
        for i in range(modes):
            shares[i] = math.exp(predicted[i]) if terms[i] > -np.inf else 0.0
            believed += shares[i]
        for c in range(channels):
            e = np.nan
            s = np.nan
            if measured[k, c] == measured[k, c] and believed > 0.0:
                e = 0.0
                s = 0.0
                for i in range(modes):
                    if shares[i] > 0.0:
                        e += shares[i] / believed * seen[i, 0, c]
                for i in range(modes):
                    if shares[i] > 0.0:
                        s += shares[i] / believed * (seen[i, 1, c] + (seen[i, 0, c] - e) ** 2)
                nis[c] += e * e / s
                count[c] += 1.0
            if keep:
                residuals[k, c], residual_variances[k, c] = e, s
        if k % every == 0 or k == n - 1:
            if total == -np.inf:
                overall[:] = np.nan
            else:
                blend(states, weights, shift, overall)
        if k % every == 0:
            history[k // every] = log_probability
            place = {width}
            for a in range({width}):
                track[k // every, a] = overall[a]
                track_variance[k // every, a] = overall[place]
                place += {width} - a
    place = {width}
    for a in range({width}):
        mean[a] = overall[a]
        for b in range(a, {width}):
            covariance[a, b] = covariance[b, a] = overall[place]
            place += 1
    return log_likelihood
'''


@dataclass(frozen=True)
class ImmKernel:
    """A compiled bank.

    Parameters
    ----------
    run : callable
        The generated loop; `estimation.imm` calls it.
    carried : int
        How much each mode carries from sample to sample.
    """

    run: Callable[..., float]
    carried: int


def _dispatch(name: str, arguments: str, kinds: int) -> str:
    """Call the function of a mode's kind; a bank of one kind has nothing to choose."""
    lines: list[str] = []
    for kind in range(kinds):
        test = f"    {'if' if kind == 0 else 'elif'} kind == {kind}:"
        lines += [test, f"        {name}_{kind}({arguments})"]
    return "\n".join(lines)


@cache
def compile_imm(kinds: tuple[Kind, ...], channels: tuple[str, ...]) -> ImmKernel:
    """Generate and load the loop of a bank.

    Parameters
    ----------
    kinds : tuple of (Rule, ProcessModel)
        The different filters and models in it, of equal states.
    channels : tuple of str
        Measured channels.

    Returns
    -------
    ImmKernel
        The loop.
    """
    parts = [rule_functions(rule, model, channels, str(i)) for i, (rule, model) in enumerate(kinds)]
    width = kinds[0][1].width
    names = "_".join(f"{rule.name}_{model.name}" for rule, model in kinds)
    loop = _LOOP.format(
        width=width,
        belief=width + width * (width + 1) // 2,
        constants=max(part.constants for part in parts),
        prepare=_dispatch("prepare", "rows, constants", len(kinds)),
        predict=_dispatch("predict", "state, constants, before, after, j", len(kinds)),
        update=_dispatch("update", "state, constants, sample, seen", len(kinds)),
    )
    source = HEADER.format(title=f"interacting models, {names}") + "".join(part.source for part in parts) + loop
    return ImmKernel(load_kernel(f"imm_{names}", source).run, max(len(part.carried) for part in parts))
