"""`objections(fit, noisy)`: objections to a fit of the flow form, from its residuals."""

from estimation.fits.greybox.chance import LARGEST_CHI_SQUARE, correlation_by_chance, largest_chi_square
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.lateness import latest_channel
from estimation.fits.greybox.play import ShownPlay, omitted_play_note
from estimation.notes import EstimateCode
from plant.notes import Note

DOUBTED_CHI_SQUARE = 1.1
"""The same for a log that begins under load or in motion: its fit has many minima, and the sensors' noise is known to a
twentieth [dimensionless]."""

LARGEST_AUTOCORRELATION = 0.1
"""Correlation of neighbouring residuals above which a fit does not explain its log [dimensionless]."""

NOISY = (1.44, 0.3)
"""The two limits if position noise matters: it is known to a fifth, and an encoder's steps are not white."""

QUIET = 0.5
"""Mean squared normalised residual below which a fit is rejected if position noise matters [dimensionless]; judged.
That noise grows with the oil's stiffness. A pressure that seems late reduces the residuals, so oil five times too stiff
explained a leaky rig's log at a fifth of the noise, and passed the gate."""

LATE_WORTH = 20.0
"""Gain in log-likelihood from which speed or position is reported as late or early, if no hypothesis says more
[dimensionless]. For right explanations the gain is at most 6, on logs of 18 kinds of strange rigs and on 18 of a
foreign bench; for a position that lags by 3 ms it is 390 to 2800. The test begins at `REQUIRED_GAIN`: half a
millisecond may gain 10, and move bulk modulus by seven deviations."""

NAMED_SHARE = 0.25
"""Share of the unexplained cost that a cause must account for, to be named beside it [fraction]."""


def residual_limits(noisy: bool, samples: float) -> tuple[float, float]:
    """Return the limits on the residuals of a fit that explains a log; a short log has wider ones.

    Parameters
    ----------
    noisy : bool
        Whether position noise matters.
    samples : float
        Number of residuals [count].

    Returns
    -------
    tuple of float
        The largest mean squared normalised residual, and correlation of neighbouring ones [dimensionless].
    """
    largest, correlated = NOISY if noisy else (LARGEST_CHI_SQUARE, LARGEST_AUTOCORRELATION)
    return largest_chi_square(samples, largest), max(correlated, correlation_by_chance(samples))


def exceeds_noise(fit: GreyBoxFit) -> bool:
    """Return whether the residuals of a fit exceed the sensors' noise.

    Parameters
    ----------
    fit : GreyBoxFit
        The fit of a log whose position noise does not matter.
    """
    return fit.chi_square[0] > largest_chi_square(fit.seen, DOUBTED_CHI_SQUARE)


def objections(fit: GreyBoxFit, noisy: bool) -> tuple[Note, ...]:
    """Return the objections to a fit.

    Parameters
    ----------
    noisy : bool
        Whether position noise matters.

    Returns
    -------
    tuple of Note
        Empty if the fit explains the log.
    """
    reasons: list[Note] = []
    largest, correlated = residual_limits(noisy, fit.seen)
    if fit.chi_square[0] > largest:
        reasons.append(EstimateCode.PRESSURE_RESIDUALS_LARGE.note(ratio=fit.chi_square[0] ** 0.5))
    if is_too_close(fit, noisy):
        reasons.append(EstimateCode.PRESSURE_RESIDUALS_SMALL.note(ratio=fit.chi_square[0] ** -0.5))
    if abs(fit.autocorrelation[0]) > correlated and not _residuals_alternate(fit, noisy):
        reasons.append(EstimateCode.PRESSURE_RESIDUALS_CORRELATED.note(correlation=fit.autocorrelation[0]))
    channel, late, gain = latest_channel(fit.late)
    if gain > max(LATE_WORTH, _share_left(fit) if reasons else 0.0):
        when = "late" if late > 0.0 else "early"
        reasons.insert(0, EstimateCode.CHANNEL_LATE.note(channel=channel, milliseconds=1e3 * abs(late), when=when))
    return tuple(reasons)


def objections_and_play(fit: GreyBoxFit, noisy: bool, shown: ShownPlay, sensed: ShownPlay) -> tuple[Note, ...]:
    """Return the objections to a fit, and an encoder play that it does not include.

    Parameters
    ----------
    noisy : bool
        Whether position noise matters.
    shown, sensed : ShownPlay
        Play that the residuals show, and play that a velocity sensor shows.
    """
    reasons = objections(fit, noisy)
    return (*reasons, *omitted_play_note(shown, sensed, _share_left(fit) if reasons else 0.0))


def _share_left(fit: GreyBoxFit) -> float:
    """Return the gain in log-likelihood from which a cause is named beside a fit that does not explain its log."""
    return NAMED_SHARE * fit.cost * max(1.0 - 1.0 / fit.chi_square[0], 0.0)


def is_too_close(fit: GreyBoxFit, noisy: bool) -> bool:
    """Return whether residuals are far smaller than the effect of position noise, which other hypotheses only reduce.

    Parameters
    ----------
    noisy : bool
        Whether position noise matters.
    """
    return noisy and 0.0 < fit.chi_square[0] < QUIET  # residuals are 0 if pressure is 0 throughout


def _residuals_alternate(fit: GreyBoxFit, noisy: bool) -> bool:
    """Return whether residuals alternate due to their noise: motor noise was overestimated, or encoder noise leaks off.

    The random walk that motor noise causes in pressure is then followed too closely, and intervals are too wide, not
    too narrow. What leakage leaves of encoder noise is its change, and successive means share a reading: if oil leaks
    off within a block, their correlation is as low as -0.5.
    """
    return fit.autocorrelation[0] < 0.0 and (noisy or fit.chi_square[0] < 1.0)


def fit_explains(fit: GreyBoxFit, noisy: bool) -> bool:
    """Return whether there is no objection to a fit; see `objections`.

    Parameters
    ----------
    noisy : bool
        Whether position noise matters.
    """
    return not objections(fit, noisy)


def fit_explains_all(fit: GreyBoxFit, noisy: bool) -> bool:
    """Return whether the residuals of a fit are no larger than the sensors' noise; see `objections`.

    Parameters
    ----------
    noisy : bool
        Whether position noise matters.
    """
    return fit_explains(fit, noisy) and (noisy or not exceeds_noise(fit))
