"""`drain_note(side)`: the note on a port that drains more than the other one: its make-up valve leaks, or none does."""

from collections.abc import Callable
from math import exp

from estimation.finding import NORMAL_95
from estimation.fits.flow.log import DRAIN_START, PRESUMED_STD
from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.fits.hypothesis_search.fault_guesses import leakage_guess
from estimation.notes import RigCode
from plant.eha.model import EhaParameters
from plant.notes import Note


def largest_port_drain(p: EhaParameters) -> float:
    """Return the prior upper limit of a sound pump's case drain per port.

    The prior is a twentieth of the healthy leakage, known to a factor of e: 97.5 % drain less than a third of it.

    Returns
    -------
    float
        Drain [m^3/(s Pa)].

    Examples
    --------
    >>> round(largest_port_drain(EhaParameters(leakage_coefficient=1e-11)) * 1e12, 2)
    3.55
    """
    return DRAIN_START * leakage_guess(p) * exp(NORMAL_95 * PRESUMED_STD)


def drain_note(side: str) -> Callable[[Explanation, EhaParameters], Note]:
    """Return a function that writes the note on ports that drain differently.

    The port that drains more has the make-up valve that leaks, whichever drain was fitted. If it drains no more than
    the case of a sound pump does, no valve leaks.

    Parameters
    ----------
    side : str
        The port whose drain was fitted, a or b.

    Returns
    -------
    callable
        ``note(found, parameters)``.
    """
    other = "ab".replace(side, "")

    def note(found: Explanation, p: EhaParameters) -> Note:
        case = found.values["case_leakage"][0]
        drains = {side: case * found.values[f"drain_share_{side}"][0], other: case}
        most = max(drains, key=lambda one: drains[one])
        if drains[most] > largest_port_drain(p):
            return RigCode.PORT_DRAINS.note(side=most.upper(), drain=drains[most])
        return RigCode.PORTS_DRAIN_APART.note(drain_a=drains["a"], drain_b=drains["b"], sound=largest_port_drain(p))

    return note
