"""Doubts about the channels themselves: dependent inputs, and outputs that stand out from their neighbours."""

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels
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

DECISIVE_SHARE = 0.5
"""Share of a model's squared error above which a few outputs decide the fit [fraction]."""


def doubtful_channels(model: FreeRunModel, data: Channels) -> list[Note]:
    """Return notes on dependent inputs, and on outputs that stand out.

    Parameters
    ----------
    model : FreeRunModel
        Fitted to the logs.
    data : Channels
        In units of the channels.
    """
    return [*dependent_input_notes(data), *outlier_notes(model, data)]


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
    """Return a note if the residual is large, more than noise from sample to sample, and depends on the inputs.

    Filtered or held sensor noise is correlated from sample to sample too, so the residual must also follow the inputs.
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
    if not (share > LARGE_RESIDUAL and noise < NOISE_SHARE * total):
        return []
    drives = [np.column_stack([run, u])[begin:] for run, u, begin in zip(runs, data.u, begins, strict=True)]
    if not depends_on_signals(np.concatenate(left), np.concatenate(drives)):
        return []
    return [IdentificationCode.MORE_THAN_NOISE.note(output=data.output, left=share)]


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
