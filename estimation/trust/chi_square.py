"""Tail and quantiles of the chi-square distribution; importing scipy.special takes longer than fitting a log."""

import math

from estimation.fits.root import root_between


def chi_square_tail(statistic: float, freedom: int) -> float:
    """Return the probability of a chi-square statistic at least this large (Abramowitz and Stegun, 26.4.4 and 26.4.5).

    Parameters
    ----------
    statistic : float
        The statistic, not negative [dimensionless].
    freedom : int
        Degrees of freedom, 1 or more.

    Returns
    -------
    float
        Probability; NaN if the statistic is NaN.

    Examples
    --------
    >>> round(chi_square_tail(3.841458820694124, 1), 12)
    0.05
    """
    half = 0.5 * statistic
    if not half > 0.0:
        return 1.0 if half <= 0.0 else math.nan
    if math.isinf(half):
        return 0.0
    odd = freedom % 2
    first = math.erfc(math.sqrt(half)) if odd else 0.0
    logarithm = math.log(half)
    powers = (k + 0.5 * odd for k in range(freedom // 2))
    return min(
        1.0, first + math.fsum(math.exp(power * logarithm - half - math.lgamma(power + 1.0)) for power in powers)
    )


def chi_square_quantile(probability: float, freedom: int) -> float:
    """Return the value that a chi-square statistic does not exceed with a given probability.

    Parameters
    ----------
    probability : float
        Between 0 and 1 [probability].
    freedom : int
        Degrees of freedom, 1 or more.

    Returns
    -------
    float
        The statistic [dimensionless].

    Examples
    --------
    >>> round(chi_square_quantile(0.95, 1), 9)
    3.841458821
    """
    tail, high = 1.0 - probability, float(freedom)
    while chi_square_tail(high, freedom) > tail:
        high *= 2.0
    return root_between(lambda statistic: chi_square_tail(statistic, freedom) - tail, 0.0, high, 1e-15 * high)
