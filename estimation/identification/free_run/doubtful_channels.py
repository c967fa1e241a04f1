"""Doubts about the channels themselves: dependent inputs, and outputs that stand out from their neighbours."""

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.dropouts import dropout_notes
from estimation.identification.free_run.lagged_columns import columns_of
from estimation.identification.free_run.linear_problem import Form
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.free_run.random_walk import (
    FEWEST,
    LARGEST_WALK_STATISTIC,
    LEAST_WALK_ERROR,
    dickey_fuller_statistic,
    has_long_memory,
    longest_gap_free_row,
    walk_followed_note,
)
from estimation.identification.notes import IdentificationCode
from estimation.log_checks.outliers import without_outliers
from plant.notes import Note

DEPENDENT_SHARE = 1e-10
"""Largest unexplained share of an input's variance for it to be a linear function of other inputs: far above rounding,
and far below the noise of any sensor or converter [fraction]."""

LARGE_RESIDUAL, NOISE_SHARE = 0.1, 0.5
"""Residual of a linear model over the output's deviation from which it is reported, and share of the residual, by
deviation, that changes from sample to sample explain for pure white noise [dimensionless]."""

INPUT_LAGS, OTHER_SHIFTS, SAMPLES_EACH = (0, 2, 6, 18), 39, 4
"""Lags in samples of functions of inputs that may explain the residual, number of other shifts that are tried (one
given in advance beats them all by chance in 2.5 %), and least samples per column [count]."""

FILTER_LAGS, MOST_FILTERED, MISSED_SHARE = 50, 20_000, 0.5
"""Coefficients of a filter of the inputs that may explain the residual, and most samples that it is fitted to [count];
share of the residual's variance that it explains from which the model is called too small [fraction]; judged."""

DECISIVE_SHARE = 0.5
"""Share of a model's squared error above which a few outputs decide the fit [fraction]."""


def doubtful_channels(model: FreeRunModel, data: Channels) -> list[Note]:
    """Return notes on dependent inputs, and on outputs that stand out or drop out.

    Parameters
    ----------
    model : FreeRunModel
        Fitted to the logs.
    data : Channels
        In units of the channels.
    """
    return [*dependent_input_notes(data), *(dropout_notes(model, data) or outlier_notes(model, data))]


def dependent_input_notes(data: Channels) -> list[Note]:
    """Return a note on each input that is a linear function of those before it.

    Parameters
    ----------
    data : Channels
        In any scale.
    """
    notes: list[Note] = []
    together = np.concatenate(data.u)
    spread = together.std(axis=0)
    scaled = (together - together.mean(axis=0)) / np.where(spread > 0.0, spread, 1.0)
    for k in np.flatnonzero(spread > 0.0)[1:]:  # a constant input is no function of others
        before, own = scaled[:, :k], scaled[:, k]
        shares = np.linalg.lstsq(before, own, rcond=1e-6)[0]
        if np.mean((own - before @ shares) ** 2) < DEPENDENT_SHARE:
            others = [
                repr(name)
                for name, share in zip(data.inputs, shares, strict=False)
                if abs(share) > DEPENDENT_SHARE**0.5
            ]
            said = IdentificationCode.INPUTS_ALIKE.note(channel=data.inputs[k], others=" and ".join(others))
            notes.append(said)
    return notes


def outlier_notes(model: FreeRunModel, data: Channels) -> list[Note]:
    """Return a note if a few outputs that stand out from their neighbours decide the fit.

    They account for most of the model's error, or have moved it farther from the others than their mean is. If inputs
    cause such outputs, the model follows them without a loss elsewhere.
    """
    y, sound = np.concatenate(data.y), np.concatenate([without_outliers(one) for one in data.y])
    outside = np.isfinite(y) & np.isnan(sound)
    count = int(np.count_nonzero(outside))
    if not count:
        return []
    left = np.concatenate(_free_runs(model, data)) - y
    theirs, others = float(np.sum(left[outside] ** 2)), float(np.nansum(left[~outside] ** 2))
    spread = float(np.nansum((sound - np.nanmean(sound)) ** 2))
    if not theirs > DECISIVE_SHARE * (theirs + others) and not others > spread:
        return []
    return [IdentificationCode.OUTLIERS.note(output=data.output, count=count, total=data.n_samples)]


def _free_runs(model: FreeRunModel, data: Channels) -> list[Array]:
    """Return the free run of each log, with initial states from its outputs."""
    return [model.simulate(u, y) for u, y in zip(data.u, data.y, strict=True)]


def residual_notes(model: FreeRunModel, data: Channels) -> list[Note]:
    """Return a note if the residual is large and depends on the inputs.

    If it is more than noise from sample to sample, functions of the inputs may explain it; filtered or held sensor
    noise is correlated from sample to sample too, so it must follow them. If it is as fast as noise, a linear filter of
    the inputs must explain it: a sweep drives each frequency once, so held-back blocks do not show what a small model
    misses.
    """
    runs = _free_runs(model, data)
    begins = [model.dynamics.undetermined_outputs(y.size) for y in data.y]
    left = [(y - run)[begin:] for y, run, begin in zip(data.y, runs, begins, strict=True)]
    known = np.concatenate(left)
    known = known[np.isfinite(known)]
    # most rows of a slow sensor are empty
    changes = np.concatenate([np.diff(one[np.isfinite(one)]) for one in left])
    if not changes.size:
        return []
    total, noise = float(known.std()), float(changes.std()) / 2.0**0.5
    share = total / float(np.nanstd(np.concatenate(data.y)))
    if not share > LARGE_RESIDUAL:
        return []
    if noise >= NOISE_SHARE * total:
        explained = _explained_by_filter(left, [u[begin:] for u, begin in zip(data.u, begins, strict=True)])
        told = IdentificationCode.MODEL_TOO_SMALL.note(output=data.output, left=share, explained=explained)
        return [told] if explained > MISSED_SHARE else []
    drives = [np.column_stack([run, u])[begin:] for run, u, begin in zip(runs, data.u, begins, strict=True)]
    if not depends_on_signals(np.concatenate(left), np.concatenate(drives)):
        return []
    return [IdentificationCode.MORE_THAN_NOISE.note(output=data.output, left=share)]


def _explained_by_filter(left: list[Array], inputs: list[Array]) -> float:
    """Return the share of a residual's variance that a filter of the inputs explains, less what chance explains."""
    count = inputs[0].shape[1]
    lags = max(1, FILTER_LAGS // count)
    form = Form(0, (lags,) * count, (0,) * count)
    columns = np.concatenate([columns_of(form, u)[lags:] for u in inputs])[:MOST_FILTERED]
    aims = np.concatenate([one[lags:] for one in left])[:MOST_FILTERED]
    known = np.isfinite(aims)
    freedom = int(np.count_nonzero(known)) - columns.shape[1] - 1
    if freedom < columns.shape[1]:
        return 0.0
    columns, aims = columns[known] - columns[known].mean(axis=0), aims[known] - aims[known].mean()
    missed = aims - columns @ np.linalg.lstsq(columns, aims, rcond=1e-9)[0]
    return 1.0 - float(missed @ missed) / freedom / (float(aims @ aims) / (aims.size - 1))


def wandering_notes(model: FreeRunModel, data: Channels) -> list[Note]:
    """Return a note if the residual of a nonlinear model wanders.

    The residual of a linear model may wander because of a nonlinearity, or the nonlinearity may hide it; here the
    nonlinearity is removed.

    Parameters
    ----------
    model : FreeRunModel
        Fitted to levels.
    data : Channels
        Levels, in units of the channels.
    """
    left = [y - run for y, run in zip(data.y, _free_runs(model, data), strict=True)]
    large = np.nanstd(np.concatenate(left)) > LEAST_WALK_ERROR * np.nanstd(np.concatenate(data.y))
    changes = longest_gap_free_row([np.diff(one) for one in left])
    if (
        not large
        or changes.size < FEWEST
        or dickey_fuller_statistic(changes) <= LARGEST_WALK_STATISTIC
        or has_long_memory(changes)
    ):
        return []
    return [walk_followed_note(data.output, model.structure)]


def depends_on_signals(left: Array, drives: Array) -> bool:
    """Return whether a residual follows functions of signals more than it follows the same functions at other times.

    Both may be correlated over many samples, so a significance level for white noise would not hold.

    Parameters
    ----------
    left : ndarray, shape (n,)
        Measured less simulated; NaN where missing.
    drives : ndarray, shape (n, k)
        Signals.
    """
    spread = drives.std(axis=0)
    scaled = (drives - drives.mean(axis=0)) / np.where(spread > 0.0, spread, 1.0)
    functions = np.column_stack([scaled, np.abs(scaled), scaled**2, scaled**3])
    late = [np.roll(functions, lag, axis=0) for lag in INPUT_LAGS]
    columns, known = np.column_stack([*late, np.ones(left.size)]), np.isfinite(left)
    if np.count_nonzero(known) < SAMPLES_EACH * columns.shape[1]:
        return False
    # missing samples count at no shift; the residual is shifted instead of the functions, which is the same
    basis, there = np.linalg.svd(columns, full_matrices=False)[0], np.where(known, left, 0.0)
    shifts = np.linspace(0.0, left.size, OTHER_SHIFTS + 2)[:-1].astype(int)
    explained = [float(np.sum((basis.T @ np.roll(there, -shift)) ** 2)) for shift in shifts.tolist()]
    return all(explained[0] > other for other in explained[1:])
