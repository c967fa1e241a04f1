"""The modelled-chamber filter: bulk modulus, leakage and flow bias sample by sample, from pressure, position and speed.

One extended Kalman filter that starts far from the truth believes its first linearisation too much and stays there: on
a ridge where leakage makes up for bulk modulus. A bank of them, each sure of another first guess and weighted by its
likelihood, covers the ridge, and what is left of it is linearised anew (`estimation.eha.chamber_bank`).
"""

from collections.abc import Mapping
from itertools import product
from typing import NamedTuple

import numpy as np

from estimation.eha.chamber_bank import Member, run_bank
from estimation.filters.run import Estimate, filter_problem, in_si
from estimation.log_checks.channel_names import PRESSURE, SPEED
from estimation.log_checks.first_belief import first_load
from estimation.log_checks.measurement_noise import measurement_variances
from estimation.models.chambers import CHAMBERS, CHAMBERS_BY_MASS, CHAMBERS_HELD, FLOOR_NOISE, MAKEUP, chamber_belief
from estimation.models.eha_forms import BULK_MODULUS
from plant.eha.model import EhaParameters
from plant.log.record import Record

MODULI = (0.35, 0.6, 1.0, 1.6, 2.6)
"""First guesses of bulk modulus, as multiples of the rig's; what the user guesses stands beside them."""

LEAST_MODULUS = 0.05
"""Least first guess of bulk modulus, as a multiple of the rig's: a logarithm cannot begin at nothing [fraction]."""

GUESS_SPREAD = 1.5
"""How far bulk modulus may be from the user's guess, as the logarithm's standard deviation [dimensionless]."""

LEAKAGES = (1.0, 2.0, 4.0, 6.5, 9.5, 14.0, 20.0, 28.0)
"""First guesses of leakage, as multiples of a healthy actuator's; Table 3 goes to 12.6."""

BIASES = (1.0, 2.0, 4.0, 6.5)
"""First guesses of flow bias, as multiples of a healthy actuator's; Table 3 goes to 6.1."""

FORMS = ((CHAMBERS, MAKEUP), (CHAMBERS_BY_MASS, MAKEUP), (CHAMBERS_HELD, 1e-13))
"""What is believed of the chambers, each with a make-up conductance [m^3/(s Pa)]: a circuit with make-up valves,
balanced by volume and by mass, and a lumped actuator without."""


class FlowReading(NamedTuple):
    """A log as the bank of chamber filters reads it.

    Parameters
    ----------
    online : Estimate
        The mixture of all filters, weighted by what the log so far says of them; after the last sample, by all of it.
    again : Estimate
        The likeliest filter's last reading of the whole log, by which it is judged.
    """

    online: Estimate
    again: Estimate


def filter_flow(
    record: Record,
    parameters: EhaParameters,
    variances: Mapping[str, float] | None = None,
    guess: float | None = None,
) -> FlowReading:
    """Filter a log with a bank of chamber filters; nothing of leakage, flow bias or friction need be known.

    Parameters
    ----------
    record : Record
        The log, with motor speed, position and differential pressure.
    parameters : EhaParameters
        Geometry and pump are taken from it, and the first guesses' size.
    variances : Mapping[str, float], optional
        Measurement variances of its channels [SI squared]; read off the log if not given.
    guess : float, optional
        First guess of bulk modulus [Pa]; the rig's if not given.

    Raises
    ------
    LogError
        If a channel is missing.
    """
    CHAMBERS.require_drives(record)
    load = first_load(record, variances) if PRESSURE in record else 0.0
    centre = parameters.bulk_modulus
    wanted = max(guess if guess is not None else centre, LEAST_MODULUS * centre)
    moduli = sorted({*(multiple * centre for multiple in MODULI), wanted})
    noise: Mapping[str, float] = dict.fromkeys(
        ("pressure_a_pa", "pressure_b_pa"), drive_noise(record, parameters, variances)
    )
    members: list[Member] = []
    for model, makeup in FORMS:
        anywhere = chamber_belief(parameters, load, centre, 1.0, 1.0, makeup)
        task = filter_problem(model, anywhere, record, parameters, noise=noise, variances=variances)
        for modulus, leakage, bias in product(moduli, LEAKAGES, BIASES):
            prior = model.to_filter(chamber_belief(parameters, load, modulus, leakage, bias, makeup))
            score = -0.5 * (np.log(modulus / wanted) / GUESS_SPREAD) ** 2
            members.append(Member(task, prior.mean, prior.covariance, float(score)))
    told_apart = tuple(CHAMBERS.index(name) for name in (BULK_MODULUS, "leakage_coefficient"))
    problem, *traces = run_bank(members, told_apart)
    online, again = (in_si(problem, trace, record.start_time) for trace in traces)
    return FlowReading(online, again)


def drive_noise(record: Record, p: EhaParameters, variances: Mapping[str, float] | None = None) -> float:
    """Return the process-noise density of a chamber's pressure: measured speed's noise as flow, and a floor.

    Parameters
    ----------
    record : Record
        The log, with motor speed.
    variances : Mapping[str, float], optional
        Measurement variances of its channels [SI squared]; speed's is read off the log if not among them.

    Returns
    -------
    float
        Density [Pa^2/s].
    """
    known = variances if variances is not None and SPEED in variances else measurement_variances(record, (SPEED,))
    rate = p.bulk_modulus / (2.0 * p.chamber_volume) * p.pump_displacement
    return FLOOR_NOISE + rate**2 * known[SPEED] * record.sample_time
