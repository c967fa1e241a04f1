"""The coordinates that a log does not narrow, and the severities that depend on them."""

import numpy as np

from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.circuits.circuit_runs import COORDINATES
from faults.diagnosis.circuits.class_fit import WEAK_PRIOR
from faults.diagnosis.circuits.not_shown import BLIND_RATIO, FRICTION_LAW, undetermined_coordinates
from faults.diagnosis.diagnose import diagnose_log
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.chamber_pressures import PRESSURE
from plant.sensors.sensors import BENCH
from tests.faults.diagnosis.test_severity import fits


def test_coordinates_that_a_log_hardly_narrows_are_not_shown() -> None:
    narrowed = np.array([20.0 if name.startswith("friction") else 0.2 for name in COORDINATES])
    found = undetermined_coordinates(fits(np.diag(narrowed**2 * np.diag(WEAK_PRIOR))))
    assert found >= FRICTION_LAW
    assert all(name.startswith("friction") for name in found)
    assert undetermined_coordinates(fits(BLIND_RATIO**2 * 0.1 * WEAK_PRIOR)) == frozenset()


def test_without_pressure_a_stuck_piston_leaves_bulk_modulus_and_friction_undetermined() -> None:
    truth = parameters_for(CONDITIONS["minor_leakage_major_friction"])
    drive = make_drive("sine", 3.0, 1e-3, EhaParameters(), np.random.default_rng(0))
    log = simulate(CIRCUIT, drive, 1e-3, truth, sensors=BENCH, rng=np.random.default_rng(1))
    found = diagnose_log(log.replace(**{PRESSURE: None}), Rig())
    assert not found.unknown
    assert found.condition == "minor_leakage"
    undetermined = {name for name, one in found.severities.items() if one.value is None and one.ci95 is None}
    assert {"bulk_modulus", "added_friction"} <= undetermined
