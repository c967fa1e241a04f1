"""Logs that may need a hypothesis, and the explanation that is found."""

import numpy as np

from estimation.fits.flow.fit import fit_flow
from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.log_checks.clean import clean_log
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH, Sensors

HEALTHY = EhaParameters()
PRESSURE, SPEED = "differential_pressure_pa", "motor_speed_rad_s"


def log(
    drive: str = "multisine", duration: float = 1.5, parameters: EhaParameters = HEALTHY, sensors: Sensors = BENCH
) -> Record:
    rng = np.random.default_rng(5)
    signal = make_drive(drive, duration, 1e-3, parameters, rng)
    return simulate(CIRCUIT, signal, 1e-3, parameters, sensors=sensors, rng=rng)


def explained(record: Record, rig: EhaParameters = HEALTHY) -> Explanation:
    clean = clean_log(record, rig)
    fit = fit_flow(clean.record, rig, rig.bulk_modulus, {}, clean.variances)
    assert fit.explanation is not None, fit.reasons
    assert not fit.reasons
    value, std = fit.parameters["bulk_modulus"]
    assert abs(value - HEALTHY.bulk_modulus) < max(4.0 * std, 0.005 * HEALTHY.bulk_modulus), (
        value,
        std,
        fit.explanation,
    )
    return fit.explanation
