"""A log for the wide flow form, which has a parameter for every hypothesis, all at their neutral values."""

from collections.abc import Mapping
from dataclasses import fields, replace
from types import MappingProxyType

import numpy as np

from estimation.fits.flow.accumulator import first_stiffness
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.play_courses import crossings
from estimation.fits.hypotheses import PRIOR_SPREADS
from estimation.log_checks.channel_names import POSITION
from estimation.models.completed_flow import CRACKS
from estimation.models.flow import FLOW_FORM, STIFFNESS
from estimation.models.inner_circuit import BEND
from estimation.models.wide_flow import (
    COURSES,
    LINEAR,
    OTHER_COURSES,
    QUICKEST,
    QUICKNESS,
    WIDE_FLOW_FORM,
    WideFlowParameters,
)
from plant.eha.model import EhaParameters
from plant.solvers.steps import parameter_names, parameter_row

START_LEVEL = "start_level"

HELD_PARAMETERS = (STIFFNESS, *CRACKS, BEND)
"""Parameters of the plain fit that a search for other effects holds, since they would absorb these."""

LEVEL_SPREAD = 3.0**-0.5
"""Prior root mean square of the pressure level at which the lower side begins, over its largest possible value
[fraction]: it is anywhere between zero and that."""

UNIFORM_DEVIATION = 3.0**-0.5
"""Standard deviation of a uniform distribution over half its range [dimensionless]."""

LEAST_PEAK = 1.0
"""Least value used for the highest differential pressure if the sensor is dead [Pa]: a search cannot start at the
logarithm of zero."""


def widened_log(
    log: GreyBoxLog, parameters: EhaParameters, found: Mapping[str, float] = MappingProxyType({})
) -> GreyBoxLog:
    """Return a log for the wide flow form: elapsed share, rate of position and courses of play are its drives.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the plain flow form sees it.
    found : Mapping[str, float], optional
        Parameters of the plain fit; `HELD_PARAMETERS` ones are kept [SI].

    Returns
    -------
    GreyBoxLog
        The log, with its priors.
    """
    samples, position = len(log.drives), log.drives[:, FLOW_FORM.drives.index(POSITION)]
    courses = crossings(position, log.measured[:, 0], log.sample_time)
    rate = np.gradient(position) / log.sample_time
    known = {one.name: getattr(parameters, one.name) for one in fields(parameters)}
    return replace(
        log,
        drives=np.column_stack([log.drives, np.arange(samples) / samples, rate, courses]),
        drive_std=(*log.drive_std, *(0.0 for _ in WIDE_FLOW_FORM.drives[len(log.drive_std) :])),
        parameters=parameter_row(
            WideFlowParameters(
                **known,
                **{STIFFNESS: first_stiffness(log), **{name: found[name] for name in HELD_PARAMETERS if name in found}},
                stated_pressure=usual_pressure(log, parameters),
            )
        ),
        presumed={
            **log.presumed,
            **{name: (known[name], std) for name, std in PRIOR_SPREADS.items()},
            **dict.fromkeys(OTHER_COURSES, (0.0, 1.0)),
            QUICKNESS: (0.5 * QUICKEST, 0.5 * QUICKEST * UNIFORM_DEVIATION / LINEAR[QUICKNESS]),
            START_LEVEL: (0.0, LEVEL_SPREAD * shut_in_pressure(log) / LINEAR[START_LEVEL]),
        },
    )


def shut_in_pressure(log: GreyBoxLog) -> float:
    """Return the largest volume that a loaded chamber passes on without make-up flow: half of what loaded it.

    Returns
    -------
    float
        As a pressure above the inner circuit's [Pa].
    """
    return max(0.5 * float(np.nanmax(np.abs(log.measured))), LEAST_PEAK)


def usual_pressure(log: GreyBoxLog, parameters: EhaParameters) -> float:
    """Return the root-mean-square pressure of the loaded side of a log.

    Returns
    -------
    float
        Absolute [Pa].
    """
    return parameters.accumulator_pressure + log.measured_rms


def usual_values(log: GreyBoxLog) -> dict[str, float]:
    """Return the parameters of a widened log by name.

    Returns
    -------
    dict
        Values of the rig file, with all effects absent [SI].
    """
    return dict(zip(parameter_names(WideFlowParameters), log.parameters.tolist(), strict=True))


def with_balance(log: GreyBoxLog, mass: float) -> GreyBoxLog:
    """Return a log whose wide form balances mass (1), or volume (0).

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    mass : float
        1 or 0 [dimensionless].
    """
    parameters = log.parameters.copy()
    parameters[parameter_names(WideFlowParameters).index("by_mass")] = mass
    return replace(log, parameters=parameters)


def balances_mass(log: GreyBoxLog) -> bool:
    """Return whether the wide form balances mass on a log.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.

    Returns
    -------
    bool
        Whether it does; else volume.
    """
    return bool(usual_values(log)["by_mass"])


def without_delays(log: GreyBoxLog, delays: Mapping[str, float]) -> GreyBoxLog:
    """Return a log whose late channels are shifted forward in time.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    delays : Mapping[str, float]
        Delay of each channel [s]; a name that is no drive is the output. An early drive has a negative delay and is
        shifted back.

    Returns
    -------
    GreyBoxLog
        The log without its last outputs; without its first if a drive is early.
    """
    measured, drives = log.measured, log.drives
    for channel, delay in delays.items():
        samples = round(delay / log.sample_time)
        if samples == 0:
            continue
        late = slice(-samples, None) if samples > 0 else slice(None, -samples)
        if channel in FLOW_FORM.drives:
            names = (channel, "position_rate", *COURSES) if channel == POSITION else (channel,)
            columns = [WIDE_FLOW_FORM.drives.index(name) for name in names]
            drives, measured = drives.copy(), measured.copy()
            if samples > 0:
                drives[:-samples, columns] = log.drives[samples:, columns]
            else:
                drives[-samples:, columns] = log.drives[:samples, columns]
            measured[late] = np.nan
        elif log.mean_rows > 1:  # whole means stay in their rows
            drives = np.pad(drives, ((max(samples, 0), max(-samples, 0)), (0, 0)), mode="edge")
            drives = drives[: len(measured)] if samples > 0 else drives[-samples:]
        else:
            measured = np.vstack([measured[samples:], np.full_like(measured[late], np.nan)])
    return replace(log, measured=measured, drives=drives)
