"""Without pressure, a lasting model error counts when a circuit's distance from the nine conditions is judged."""

from dataclasses import replace

import numpy as np
import pytest

from faults.conditions import CONDITIONS
from faults.diagnosis.beyond_nine.near_enough import is_only_outside, is_outside_conditions
from faults.diagnosis.circuits.circuit_runs import COORDINATES
from faults.diagnosis.circuits.class_regions import fit_classes
from faults.notes import AgainstCode
from tests.faults.diagnosis.short_logs import ACTUATOR, blocks

LOG = blocks(pressure=False)
FITS = fit_classes(LOG, ACTUATOR)


def test_only_beside_means_no_objection_other_than_outside_or_between_conditions() -> None:
    outside, soft = AgainstCode.OUTSIDE_CONDITIONS.note(), AgainstCode.OIL_SOFT.note(share=0.3)
    assert is_only_outside(())
    assert is_only_outside((outside, AgainstCode.BETWEEN_CONDITIONS.note(leakage=0.5, friction=0.0)))
    assert not is_only_outside((outside, soft))


@pytest.mark.parametrize(("error", "beside"), [(0.0, True), (0.05, False)])
def test_a_circuit_with_lasting_residuals_is_not_beside_the_nine_conditions(error: float, beside: bool) -> None:
    far = FITS.best.coordinates + (np.array(COORDINATES) == "bulk_modulus")
    best = replace(FITS.best, coordinates=far)
    fits = replace(FITS, best=best, scores=np.full(len(CONDITIONS), -1e3), information=100.0 * np.eye(len(far)))
    slow = error * float(LOG.rms[0]) * np.sin(np.linspace(0.0, 12.0, len(LOG.velocity)))
    log = replace(LOG, velocity=FITS.best.fitted[:, 0] + slow)
    assert is_outside_conditions(log, fits, ACTUATOR) == beside
