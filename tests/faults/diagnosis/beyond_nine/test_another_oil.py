"""Without pressure, stiff oil alone is no reason for an unknown class."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.beyond_nine.another_oil import whatever_the_oil
from faults.diagnosis.diagnose import diagnose_log
from faults.notes import AgainstCode, ClassCode
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import CIRCUIT, simulate
from plant.notes import Note
from plant.sensors.sensors import BENCH

HEALTHY = EhaParameters()
STIFF = AgainstCode.OIL_STIFF.note(share=4.0)
SOFT = AgainstCode.OIL_SOFT.note(share=0.3)
BIASED = AgainstCode.SPEED_BIAS.note(bias_rad_s=3.0)


@pytest.mark.parametrize(
    ("against", "moduli"),
    [((), [1.0]), ((STIFF,), [1.0, 4.0]), ((SOFT,), [1.0]), ((STIFF, BIASED), [1.0])],
    ids=["sound", "stiff", "soft", "stiff and biased"],
)
def test_a_circuit_is_fitted_again_around_stiff_oil_that_alone_speaks_against_it(
    against: tuple[Note, ...], moduli: list[float]
) -> None:
    asked: list[float] = []

    def diagnosed(tried: EhaParameters, doubt: float) -> Any:
        asked.append(tried.bulk_modulus / HEALTHY.bulk_modulus)
        return SimpleNamespace(against=against if len(asked) == 1 else (), doubt=doubt)

    found = whatever_the_oil(diagnosed, HEALTHY)
    assert asked == pytest.approx(moduli)
    again = len(moduli) > 1
    assert found.diagnosis.against == (() if again else against)
    assert found.parameters.bulk_modulus == pytest.approx(moduli[-1] * HEALTHY.bulk_modulus)
    assert [(note.code, note.data["ratio"]) for note in found.notes] == (
        [(ClassCode.OIL_STIFFER_CLASS, 4.0)] if again else []
    )


def test_a_log_of_stiff_oil_gets_its_class_without_pressure_and_says_so() -> None:
    truth = replace(parameters_for(CONDITIONS["minor_leakage"]), bulk_modulus=4.0 * HEALTHY.bulk_modulus)
    rng = np.random.default_rng(8)
    log = simulate(CIRCUIT, make_drive("steps", 3.0, 2e-3, truth, rng), 2e-3, truth, sensors=BENCH, rng=rng)
    found = diagnose_log(log.replace(differential_pressure_pa=None), Rig("paper", HEALTHY))
    assert (found.condition, found.unknown) == ("minor_leakage", False)
    (said,) = (note for note in found.notes if note.code == ClassCode.OIL_STIFFER_CLASS)
    assert said.data["ratio"] == pytest.approx(4.0, rel=0.3)
