"""Without pressure, one fault outside the nine from end to end may look like a change of condition within a log.

A sound circuit leaves systematic residuals of a worn pump's log, and two successive sound circuits leave less. If one
circuit with the fault explains the log as well as the two, nothing changed within it.
"""

import math
from collections.abc import Sequence

from faults.diagnosis.beyond_nine.other_faults import circuits_with_faults
from faults.diagnosis.changes.change_odds import BELIEVED_ODDS, gain_of_parts, odds_of_change
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.class_regions import ClassFits


def fault_throughout(
    blocks: Blocks, parts: Sequence[Blocks], fits: Sequence[ClassFits], whole: ClassFits, actuator: Actuator
) -> bool:
    """Return whether a fault outside the nine, from end to end, makes a change of condition unlikely.

    Parameters
    ----------
    parts : sequence of Blocks
        What is before the change, and after it.
    fits : sequence of ClassFits
        Sound circuits fitted to each.
    whole : ClassFits
        Sound circuits fitted to all.

    Returns
    -------
    bool
        Whether the change is not `BELIEVED_ODDS` times as likely as some fault, with the priors of both. Always False
        with pressure, since the flow balance tests for such faults.
    """
    if blocks.pressure is not None:
        return False
    least = math.log(BELIEVED_ODDS)
    needed = odds_of_change(gain_of_parts(whole, parts, fits), fits, whole, blocks, actuator) - least
    for presumed, faulty in circuits_with_faults(blocks, whole, actuator, needed):
        odds = odds_of_change(gain_of_parts(faulty, parts, fits), fits, faulty, blocks, actuator)
        if odds - presumed <= least:
            return True
    return False
