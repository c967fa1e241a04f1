"""What is doubtful in channels themselves: inputs that are alike, and outputs that stand out from their neighbours."""

import numpy as np

from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.notes import IdentificationCode
from estimation.log_checks.outliers import without_outliers
from plant.notes import Note

ALIKE = 1e-10
"""Share of an input's variance that other inputs may leave of it for it to be their linear function: far above what
rounding leaves, and far below the noise of any sensor or converter [fraction]."""

MUCH, NOISY = 0.1, 0.5
"""Share of the output's deviation from which what a linear model leaves is worth a word, and share of what is left, by
deviation, that changes from sample to sample explain as white noise where it is nothing else [dimensionless]."""

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

    Parameters
    ----------
    model : FreeRunModel
        Fitted to the logs.
    data : Channels
        In units of the channels.

    Returns
    -------
    list of Note
        One at most.
    """
    y, sound = np.concatenate(data.y), np.concatenate([without_outliers(one) for one in data.y])
    outside = np.isfinite(y) & np.isnan(sound)
    count = int(np.count_nonzero(outside))
    if not count:
        return []
    left = np.concatenate([model.simulate(u, one) for u, one in zip(data.u, data.y, strict=True)]) - y
    theirs, others = float(np.sum(left[outside] ** 2)), float(np.nansum(left[~outside] ** 2))
    spread = float(np.nansum((sound - np.nanmean(sound)) ** 2))
    if not theirs > MOST_OF_IT * (theirs + others) and not others > spread:
        return []
    return [IdentificationCode.OUTLIERS.note(output=data.output, count=count, total=data.n_samples)]


def more_than_noise(model: FreeRunModel, data: Channels) -> list[Note]:
    """Return a note if a linear model leaves much of the output, and more than noise from sample to sample.

    Parameters
    ----------
    model : FreeRunModel
        Fitted to the logs.
    data : Channels
        In units of the channels.

    Returns
    -------
    list of Note
        One at most.
    """
    left = [y - model.simulate(u, y) for u, y in zip(data.u, data.y, strict=True)]
    total = float(np.nanstd(np.concatenate(left)))
    changes = np.concatenate([np.diff(one) for one in left])
    if not np.isfinite(changes).any():
        return []
    noise, share = float(np.nanstd(changes)) / 2.0**0.5, total / float(np.nanstd(np.concatenate(data.y)))
    if not (share > MUCH and noise < NOISY * total):
        return []
    return [IdentificationCode.MORE_THAN_NOISE.note(output=data.output, left=share)]
