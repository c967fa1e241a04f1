"""Limits of residual statistics under white noise alone: wider in a short log than in a long one."""

LARGEST_CHI_SQUARE = 1.2
"""Mean squared normalised residual above which the model is said to leave something out [dimensionless]."""

MORE_THAN_CHANCE = 7.7
"""Root of the number of samples times how far the mean squared residual is above one by chance in one log of a
thousand. The variance of white noise over what `measurement_variances` reads off it scatters by 2.45 over that root;
it is skewed, so that of 400 samples four logs of a thousand are above [dimensionless]."""

ALIKE_BY_CHANCE = 3.3
"""The same of the correlation of neighbouring residuals, to either side; that of white noise scatters by one over that
root (Bartlett 1946) [dimensionless]."""


def largest_chi_square(samples: float, least: float = LARGEST_CHI_SQUARE) -> float:
    """Return the mean squared normalised residual above which a model is said to leave something out.

    Parameters
    ----------
    samples : float
        Residuals that count [count].
    least : float
        The same of a long log [dimensionless].

    Returns
    -------
    float
        The same, or what one log of a thousand exceeds by chance, whichever is more [dimensionless].

    Examples
    --------
    >>> [round(largest_chi_square(samples), 2) for samples in (400, 1_482, 20_000)]
    [1.39, 1.2, 1.2]
    """
    return max(least, 1.0 + MORE_THAN_CHANCE / samples**0.5)


def alike_by_chance(samples: float) -> float:
    """Return the lag-one correlation of white residuals that one log in a thousand exceeds by chance.

    Parameters
    ----------
    samples : float
        Residuals that count [count].

    Returns
    -------
    float
        Its size [dimensionless].

    Examples
    --------
    >>> [round(alike_by_chance(samples), 2) for samples in (900, 20_000)]
    [0.11, 0.02]
    """
    return ALIKE_BY_CHANCE / samples**0.5
