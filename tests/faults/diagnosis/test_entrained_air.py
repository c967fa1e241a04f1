"""A log whose oil contains air is compared with conditions in that oil, and the air is reported as estimated."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.eha.result import BulkModulusEstimate
from estimation.finding import Gate, Outcome
from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.log_checks.clean import clean_log
from estimation.notes import RigCode
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.diagnose import diagnose_log
from plant.components.oil import ATMOSPHERE
from plant.eha.circuit_parameters import circuit_of
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

HEALTHY, CONDITION, AIR, STATED = EhaParameters(), "minor_friction", 0.015, 7e5
SHARE = AIR / (1.0 - AIR)


def aerated_log() -> Record:
    p, rng = replace(circuit_of(parameters_for(CONDITIONS[CONDITION])), air_fraction=AIR), np.random.default_rng(8)
    return simulate(CIRCUIT, make_drive("steps", 2.0, 1e-3, HEALTHY, rng), 1e-3, p, sensors=BENCH, rng=rng)


def estimate() -> BulkModulusEstimate:
    """Return the estimate of the flow balance for that log, without its search."""
    value = 1.0 / (1.0 / HEALTHY.bulk_modulus + SHARE * ATMOSPHERE / STATED**2)
    told = {"bulk_modulus": (value, 4e5), "air_softness": (SHARE * ATMOSPHERE, 15.0), "air_quickness": (0.0, 0.05)}
    return BulkModulusEstimate(
        outcome=Outcome.OK,
        value=value,
        std=4e5,
        bound=4e-3,
        gate=Gate(True, ()),
        form="flow",
        channels=("position_m", "differential_pressure_pa"),
        nis={},
        others={},
        explanation=Explanation(("air",), told, {}, (), (), STATED),  # type: ignore[arg-type]
    )


def test_a_log_with_entrained_air_gets_its_class_and_the_estimated_air() -> None:
    """With oil equally soft at every pressure, a circuit left 23 % of the velocity, and the class was unknown."""
    record = aerated_log()
    found = diagnose_log(record, Rig("paper", HEALTHY), (clean_log(record, HEALTHY), estimate()))
    assert (found.condition, found.unknown, found.against) == (CONDITION, False, ())
    assert found.probabilities is not None
    assert found.probabilities[CONDITION] > 0.9
    told = {note.code for note in found.notes}
    assert RigCode.AIR_ENTRAINED in told
    assert RigCode.OIL_SOFTER not in told  # without its air, the oil is the rig file's
    air, oil = found.severities["entrained_air"], found.severities["bulk_modulus"]
    assert air.value == pytest.approx(100.0 * SHARE)
    assert oil.value == estimate().value
    assert found.healthy["bulk_modulus"] == pytest.approx(HEALTHY.bulk_modulus)
