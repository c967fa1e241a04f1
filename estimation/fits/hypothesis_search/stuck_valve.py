"""`stuck_instead(log, best, ...) -> list[Trial]`: a make-up valve that never opens, in place of one that opens late."""

from dataclasses import replace

from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypotheses import CHECKS_CRACK, MAKEUP_BLOCKED, MAKEUP_HIDDEN, UNLIKE_CRACKS
from estimation.fits.hypothesis_search.decimation import Decimation
from estimation.fits.hypothesis_search.explanation import Trial
from estimation.fits.hypothesis_search.final_fits import WORTH
from estimation.fits.hypothesis_search.ranking import likeliest
from estimation.fits.hypothesis_search.screening import screen
from estimation.fits.hypothesis_search.wide_log import delayed


def stuck_instead(log: GreyBoxLog, best: Trial, spared: Decimation) -> list[Trial]:
    """Return the best hypotheses with a stuck make-up valve, where one that opens far later is hardly likelier.

    A valve that never opens in a log looks like one that opens as late as the log allows. It is one fault with one
    unknown in place of two drops, and it leaves the class of the log undecided.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    best : Trial
        The likeliest hypotheses.
    spared : Decimation
        What is spared, and where searches begin.

    Returns
    -------
    list of Trial
        One at most.
    """
    others = tuple(one for one in best.together if one.name != CHECKS_CRACK.name)
    stuck = any(one.name == MAKEUP_BLOCKED.name for one in others)
    if stuck or len(others) == len(best.together) or abs(best.values[CHECKS_CRACK.free[1]]) < UNLIKE_CRACKS:
        return []
    together = (*others, MAKEUP_BLOCKED if CHECKS_CRACK in best.together else MAKEUP_HIDDEN)
    late, starts, wanted = delayed(log, best.delays), (best.values, *spared.starts), best.cost + WORTH
    tried = likeliest(late, [[*screen(late, together, starts, every=spared.every)]], wanted, spared)
    return [replace(one, delays=best.delays) for one in tried if one.fits and one.cost < wanted]
