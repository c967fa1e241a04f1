"""Limits of residual statistics under white noise alone: wider in a short log than in a long one."""

LARGEST_CHI_SQUARE = 1.2
"""Mean squared normalised residual above which a model does not explain its log [dimensionless]."""

LARGEST_EXCESS_BY_CHANCE = 5.0
"""Excess of the mean squared residual over one, times the root of the number of samples, that one log in a thousand has
by chance [dimensionless]. The variance of white noise over what `measurement_variances` finds scatters by 1.5 over that
root (2,000 to 20,000 samples). It is skewed: with 400 samples four logs in a thousand exceed the limit."""

LARGEST_CORRELATION_BY_CHANCE = 3.3
"""The same for the correlation of neighbouring residuals, in either direction; that of white noise scatters by one over
that root (Bartlett 1946) [dimensionless]."""


def largest_chi_square(samples: float, least: float = LARGEST_CHI_SQUARE) -> float:
    """Return the mean squared normalised residual above which a model does not explain its log.

    Parameters
    ----------
    samples : float
        Number of residuals [count].
    least : float
        The limit for a long log [dimensionless].

    Returns
    -------
    float
        That limit, or the value that one log in a thousand exceeds by chance, whichever is larger [dimensionless].

    Examples
    --------
    >>> [round(largest_chi_square(samples), 2) for samples in (400, 625, 20_000)]
    [1.25, 1.2, 1.2]
    """
    return max(least, 1.0 + LARGEST_EXCESS_BY_CHANCE / samples**0.5)


def correlation_by_chance(samples: float) -> float:
    """Return the lag-one correlation of white residuals that one log in a thousand exceeds by chance.

    Parameters
    ----------
    samples : float
        Number of residuals [count].

    Returns
    -------
    float
        Its absolute value [dimensionless].

    Examples
    --------
    >>> [round(correlation_by_chance(samples), 2) for samples in (900, 20_000)]
    [0.11, 0.02]
    """
    return LARGEST_CORRELATION_BY_CHANCE / samples**0.5
