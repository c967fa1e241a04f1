"""`stuck_instead(log, best, ...) -> list[Trial]`: replaces a valve that opens very late by a stuck one."""

from dataclasses import replace

from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypotheses import CHECKS_CRACK, MAKEUP_BLOCKED, MAKEUP_HIDDEN, UNLIKE_CRACKS
from estimation.fits.hypothesis_search.decimation import Decimation
from estimation.fits.hypothesis_search.explanation import Trial
from estimation.fits.hypothesis_search.final_fits import REQUIRED_GAIN
from estimation.fits.hypothesis_search.ranking import likeliest_sets
from estimation.fits.hypothesis_search.screening import screen
from estimation.fits.hypothesis_search.wide_log import without_delays


def stuck_instead(log: GreyBoxLog, best: Trial, spared: Decimation) -> list[Trial]:
    """Return the best set with a stuck make-up valve in place of a very late one, if both explain the log.

    A valve that never opens looks like one that opens as late as the log allows. A stuck valve is the simpler fault: it
    has one unknown, not two pressure drops. It leaves the class of the log undecided.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    best : Trial
        The likeliest set of hypotheses.
    spared : Decimation
        Which samples the search uses, and its starts.

    Returns
    -------
    list of Trial
        At most one set.
    """
    others = tuple(one for one in best.together if one.name != CHECKS_CRACK.name)
    stuck = any(one.name == MAKEUP_BLOCKED.name for one in others)
    if stuck or len(others) == len(best.together) or abs(best.values[CHECKS_CRACK.free[1]]) < UNLIKE_CRACKS:
        return []
    together = (*others, MAKEUP_BLOCKED if CHECKS_CRACK in best.together else MAKEUP_HIDDEN)
    late, starts, wanted = without_delays(log, best.delays), (best.values, *spared.starts), best.cost + REQUIRED_GAIN
    tried = likeliest_sets(late, [[*screen(late, together, starts, every=spared.every)]], wanted, spared)
    return [replace(one, delays=best.delays) for one in tried if one.fits and one.cost < wanted]
