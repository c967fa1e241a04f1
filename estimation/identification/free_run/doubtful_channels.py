"""What is doubtful in channels themselves: inputs that are alike, and outputs that stand out from their neighbours."""

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.free_run.random_walk import (
    COMES_BACK,
    FEWEST,
    MATERIAL,
    longest,
    remembers,
    returns,
    walk_followed,
)
from estimation.identification.notes import IdentificationCode
from estimation.log_checks.outliers import without_outliers
from plant.notes import Note

ALIKE = 1e-10
"""Share of an input's variance that other inputs may leave of it for it to be their linear function: far above what
rounding leaves, and far below the noise of any sensor or converter [fraction]."""

MUCH, NOISY = 0.1, 0.5
"""Share of the output's deviation from which what a linear model leaves is worth a word, and share of what is left, by
deviation, that changes from sample to sample explain as white noise where it is nothing else [dimensionless]."""

LATE, OTHERS, SAMPLES_EACH = (0, 2, 6, 18), 39, 4
"""By how many samples functions of inputs are late in what they may explain of what is left, at how many other times
they are tried (one told beforehand beats them all by chance in 2.5 %), and samples a column at least [count]."""

MOST_OF_IT = 0.5
"""Share of a model's squared error above which a few outputs decide what is fitted, and not the others [fraction]."""


def doubtful_channels(model: FreeRunModel, data: Channels) -> list[Note]:
    """Return notes on inputs that are alike, and on outputs that stand out.

    Parameters
    ----------
    model : FreeRunModel
        Fitted to the logs.
    data : Channels
        In units of the channels.
    """
    return [*inputs_alike(data), *outputs_that_stand_out(model, data)]


def inputs_alike(data: Channels) -> list[Note]:
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
    for k in np.flatnonzero(spread > 0.0)[1:]:  # what is constant is no function of another
        before, own = scaled[:, :k], scaled[:, k]
        shares = np.linalg.lstsq(before, own, rcond=1e-6)[0]
        if np.mean((own - before @ shares) ** 2) < ALIKE:
            others = [repr(name) for name, share in zip(data.inputs, shares, strict=False) if abs(share) > ALIKE**0.5]
            said = IdentificationCode.INPUTS_ALIKE.note(channel=data.inputs[k], others=" and ".join(others))
            notes.append(said)
    return notes


def outputs_that_stand_out(model: FreeRunModel, data: Channels) -> list[Note]:
    """Return a note if a few outputs that stand out from their neighbours decide what is fitted.

    They hold most of the model's error, or have taken it farther from the others than their mean is. Outputs that stand
    out because the inputs drive them are followed by the model, and take it from no others.
    """
    y, sound = np.concatenate(data.y), np.concatenate([without_outliers(one) for one in data.y])
    outside = np.isfinite(y) & np.isnan(sound)
    count = int(np.count_nonzero(outside))
    if not count:
        return []
    left = np.concatenate(_runs(model, data)) - y
    theirs, others = float(np.sum(left[outside] ** 2)), float(np.nansum(left[~outside] ** 2))
    spread = float(np.nansum((sound - np.nanmean(sound)) ** 2))
    if not theirs > MOST_OF_IT * (theirs + others) and not others > spread:
        return []
    return [IdentificationCode.OUTLIERS.note(output=data.output, count=count, total=data.n_samples)]


def _runs(model: FreeRunModel, data: Channels) -> list[Array]:
    """Return the free run of each log, begun as its outputs say."""
    return [model.simulate(u, y) for u, y in zip(data.u, data.y, strict=True)]


def more_than_noise(model: FreeRunModel, data: Channels) -> list[Note]:
    """Return a note if a model leaves much of the output, more than noise from sample to sample, and of its inputs.

    Sensor noise that is filtered or held is no noise from sample to sample either, so what is left must follow the
    inputs too.
    """
    runs = _runs(model, data)
    begins = [model.dynamics.unanswered(y.size) for y in data.y]
    left = [(y - run)[begin:] for y, run, begin in zip(data.y, runs, begins, strict=True)]
    known = np.concatenate(left)
    known = known[np.isfinite(known)]
    # of a slow sensor most rows are empty
    changes = np.concatenate([np.diff(one[np.isfinite(one)]) for one in left])
    if not changes.size:
        return []
    total, noise = float(known.std()), float(changes.std()) / 2.0**0.5
    share = total / float(np.nanstd(np.concatenate(data.y)))
    if not (share > MUCH and noise < NOISY * total):
        return []
    drives = [np.column_stack([run, u])[begin:] for run, u, begin in zip(runs, data.u, begins, strict=True)]
    if not follows(np.concatenate(left), np.concatenate(drives)):
        return []
    return [IdentificationCode.MORE_THAN_NOISE.note(output=data.output, left=share)]


def still_wanders(model: FreeRunModel, data: Channels) -> list[Note]:
    """Return a note where what a nonlinear model leaves of an output wanders.

    What a bend leaves behind a linear model may look like a walk or hide one; nothing of it is left here.

    Parameters
    ----------
    model : FreeRunModel
        Fitted to levels.
    data : Channels
        Levels, in units of the channels.
    """
    left = [y - run for y, run in zip(data.y, _runs(model, data), strict=True)]
    large = np.nanstd(np.concatenate(left)) > MATERIAL * np.nanstd(np.concatenate(data.y))
    changes = longest([np.diff(one) for one in left])
    if not large or changes.size < FEWEST or returns(changes) <= COMES_BACK or remembers(changes):
        return []
    return [walk_followed(data.output, model.structure)]


def follows(left: Array, drives: Array) -> bool:
    """Return whether what is left of an output follows functions of signals, more than of the same at other times.

    Both may last over many samples, so that a level of significance for white noise would not hold.

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
    late = [np.roll(functions, lag, axis=0) for lag in LATE]
    columns, known = np.column_stack([*late, np.ones(left.size)]), np.isfinite(left)
    if np.count_nonzero(known) < SAMPLES_EACH * columns.shape[1]:
        return False
    # what is missing says nothing at any shift; of shifted functions only what they meet is shifted
    basis, there = np.linalg.svd(columns, full_matrices=False)[0], np.where(known, left, 0.0)
    shifts = np.linspace(0.0, left.size, OTHERS + 2)[:-1].astype(int)
    explained = [float(np.sum((basis.T @ np.roll(there, -shift)) ** 2)) for shift in shifts.tolist()]
    return all(explained[0] > other for other in explained[1:])
