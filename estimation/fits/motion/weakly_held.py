"""Test whether position determines bulk modulus too weakly, at the end of a fit or during it.

See decision 314.
"""

import numpy as np

from estimation.fits.greybox.descent import Point
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.motion.force_scale import deviation
from estimation.fits.motion.search import EXPLAINED

MOST_MOVED = 0.03
"""Share of bulk modulus by which a misfit that does not show may move it, above which it is not believed [fraction]: as
much as noise may (`estimation.eha.result.LARGEST_BOUND`)."""

FAR_TOO_WEAK = 3.0
"""How many times `MOST_MOVED` it is on the way from which no other scale of forces is looked for [dimensionless]. On
four logs of random rigs that are not believed, the end of the fit had 0.9 to 1.2 times what the way had; on a fifth,
which is believed, less than 0.7. If the end is believed after all, the other scales are looked for then."""


def unseen(chi_square: float, samples: int) -> float:
    """Return by how many standard deviations an undetected misfit may shift the result.

    The sum of n squared residuals has a standard deviation of ``sqrt(2 n)``. A misfit of that size does not show, and
    one that looks like the change of an unknown moves it by the root of that, in deviations. What a log holds firmly
    is not moved far by so many; what it holds weakly is.

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
    >>> round(unseen(1.0, 20_000), 1)
    14.2
    """
    shown = float(np.clip(chi_square, 1.0, EXPLAINED) - 1.0) * samples
    return float(np.sqrt(1.0 + shown + np.sqrt(2.0 * samples)))


def far_too_weak(problem: FreedProblem, best: Point, whole: FreedProblem) -> bool:
    """Return whether a log determines bulk modulus so weakly at an optimum that its end will hardly be believed.

    Parameters
    ----------
    problem : FreedProblem
        The problem on a beginning of the log, or on all of it.
    best : Point
        Its optimum, as far as it is known.
    whole : FreedProblem
        The problem on the whole log, which holds bulk modulus the better, the more samples it has.

    Returns
    -------
    bool
        Whether a misfit that does not show would move bulk modulus by more than `FAR_TOO_WEAK` times `MOST_MOVED`.
    """
    samples, all_samples = len(problem.log.measured), len(whole.log.measured)
    on_all = deviation(problem, best) * float(np.sqrt(samples / all_samples))
    return unseen(2.0 * best.cost / samples, all_samples) * on_all > FAR_TOO_WEAK * MOST_MOVED
