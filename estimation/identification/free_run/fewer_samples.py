"""Linear models judged again on fewer samples, for the comparison with nonlinear ones."""

from collections.abc import Sequence
from dataclasses import replace

from estimation.identification.free_run.choose_linear import Candidate, candidate
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.integrating import refitted_linear
from estimation.identification.free_run.linear_fit import COARSE


def on_fewer_samples(
    linear: Sequence[Candidate], best: Candidate, part: Channels, fewer: Channels
) -> tuple[Channels, list[Candidate], Candidate]:
    """Return the data on which nonlinear models are compared, and linear ones judged there, the best one separately.

    Parameters
    ----------
    linear : sequence of Candidate
        Judged on the part.
    best : Candidate
        The chosen one.
    part, fewer : Channels
        Scaled: the data on which linear models were judged, and a section with a limited number of samples.

    Returns
    -------
    tuple of Channels, list of Candidate and Candidate
        Unchanged if the section is the part. Doubts stay: whether a time constant is too long is judged by the longer
        one.
    """
    if fewer.n_samples == part.n_samples:
        return part, list(linear), best
    judged = [
        replace(candidate(refitted_linear(one.fit, fewer, least_gain=COARSE), fewer), doubt=one.doubt) for one in linear
    ]
    own = next(other for one, other in zip(linear, judged, strict=True) if one.fit is best.fit)
    return fewer, judged, replace(own, doubt=best.doubt)
