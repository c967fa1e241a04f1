"""Make-up valves that must pass much flow: for a piston that outruns its pump, or a single rod with pilot valves."""

import numpy as np

from estimation.fits.greybox.log import GreyBoxLog
from estimation.models.flow import FLOW_FORM
from plant.eha.model import EhaParameters

OUTRUNS, OUTRUN_SPAN = 1.2, 5e-3
"""Piston speed over that at the pump's full flow, from which the piston outruns its pump [dimensionless], and the time
over which it must [s]. In 100 training logs without a constant load it is at most 0.95; in seven of 20 with one it is
1.8."""


def outruns_pump(log: GreyBoxLog, p: EhaParameters) -> bool:
    """Return whether the piston moves faster than the full pump flow would move it, as under a pulling load.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the flow form sees it.
    """
    speed, position = (log.drives[:, FLOW_FORM.drives.index(name)] for name in FLOW_FORM.drives)
    samples = min(max(1, round(OUTRUN_SPAN / log.sample_time)), len(position) - 1)
    fastest = float(np.max(np.abs(position[samples:] - position[:-samples]))) / (samples * log.sample_time)
    return p.piston_area * fastest > OUTRUNS * p.pump_displacement * float(np.max(np.abs(speed)))


def opens_wide(log: GreyBoxLog, p: EhaParameters) -> bool:
    """Return whether make-up valves must be modelled as orifices, since they stand wide open.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the flow form sees it.
    """
    return p.pilot_share > 0.0 or outruns_pump(log, p)
