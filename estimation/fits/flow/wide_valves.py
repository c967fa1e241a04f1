"""Make-up valves that must let in much: those of a piston that outruns its pump, or of a single rod with pilots."""

import numpy as np

from estimation.fits.greybox.log import GreyBoxLog
from estimation.models.flow import FLOW_FORM
from plant.eha.model import EhaParameters

OUTRUNS, OUTRUN_SPAN = 1.2, 5e-3
"""How many times as fast as the pump's whole flow would move it a piston is that outruns it [dimensionless], and over
which time [s]. Of 100 training logs without a constant load none is 0.95, of 20 with one seven are 1.8."""


def outruns_pump(log: GreyBoxLog, p: EhaParameters) -> bool:
    """Return whether the piston moves faster than the full pump flow would move it, as under a pulling load.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the flow form sees it.
    p : EhaParameters
        The actuator.

    Returns
    -------
    bool
        Whether it does.
    """
    speed, position = (log.drives[:, FLOW_FORM.drives.index(name)] for name in FLOW_FORM.drives)
    samples = min(max(1, round(OUTRUN_SPAN / log.sample_time)), len(position) - 1)
    fastest = float(np.max(np.abs(position[samples:] - position[:-samples]))) / (samples * log.sample_time)
    return p.piston_area * fastest > OUTRUNS * p.pump_displacement * float(np.max(np.abs(speed)))


def opens_wide(log: GreyBoxLog, p: EhaParameters) -> bool:
    """Return whether make-up valves are orifices: they stand wide open.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the flow form sees it.
    p : EhaParameters
        The actuator.
    """
    return p.pilot_share > 0.0 or outruns_pump(log, p)
