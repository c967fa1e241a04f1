"""Test whether position determines bulk modulus too weakly, at the end of a fit or during it.

See decision 314.
"""

import numpy as np

from estimation.fits.greybox.descent import Point
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.motion.force_scale import deviation
from estimation.fits.motion.search import EXPLAINED

LARGEST_UNSEEN_SHIFT = 0.03
"""Share of bulk modulus by which an undetected misfit may shift it, above which it is not believed [fraction]: as large
as the limit for noise (`estimation.eha.result.LARGEST_BOUND`)."""

FAR_TOO_WEAK = 3.0
"""The same during a fit, in multiples of `LARGEST_UNSEEN_SHIFT`, from which no other scale of forces is searched
[dimensionless]. In four logs of random rigs that are not believed, the end of the fit had 0.9 to 1.2 times the value on
the way; in a fifth, which is believed, less than 0.7. If the end is believed after all, the other scales are searched
then."""


def unseen_shift(chi_square: float, samples: int) -> float:
    """Return by how many standard deviations an undetected misfit may shift the result.

    The sum of n squared residuals has a standard deviation of ``sqrt(2 n)``. A misfit of that size is not detected. If
    it has the shape of an unknown's effect, it shifts the unknown by the root of that, in deviations. For a
    well-determined unknown so many deviations are little; for a weakly determined one they are much.

    Parameters
    ----------
    chi_square : float
        Mean squared normalised residual [dimensionless].
    samples : int
        How many residuals there are.

    Returns
    -------
    float
        12 for 10,000 residuals that are explained [dimensionless].

    Examples
    --------
    >>> round(unseen_shift(1.0, 20_000), 1)
    14.2
    """
    shown = float(np.clip(chi_square, 1.0, EXPLAINED) - 1.0) * samples
    return float(np.sqrt(1.0 + shown + np.sqrt(2.0 * samples)))


def is_far_too_weak(problem: FreedProblem, best: Point, whole: FreedProblem) -> bool:
    """Return whether a log determines bulk modulus so weakly at an optimum that its end will hardly be believed.

    Parameters
    ----------
    problem : FreedProblem
        The problem on a beginning of the log, or on all of it.
    best : Point
        Its best known optimum.
    whole : FreedProblem
        The problem on the whole log, which determines bulk modulus better the more samples it has.

    Returns
    -------
    bool
        Whether a misfit that does not show would move bulk modulus by more than `FAR_TOO_WEAK` times that limit.
    """
    samples, all_samples = len(problem.log.measured), len(whole.log.measured)
    on_all = deviation(problem, best) * float(np.sqrt(samples / all_samples))
    return unseen_shift(2.0 * best.cost / samples, all_samples) * on_all > FAR_TOO_WEAK * LARGEST_UNSEEN_SHIFT
