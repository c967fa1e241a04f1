"""Where no bulk modulus is known, stiffer oil alone does not make the class unknown."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.beyond_nine.another_oil import with_stiffer_oil
from faults.diagnosis.beyond_nine.load import LoadedDiagnosis
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.circuit_runs import coordinates_of
from faults.diagnosis.diagnose import diagnose_log
from faults.notes import AgainstCode, ClassCode
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import CIRCUIT, simulate
from plant.notes import Note
from plant.sensors.sensors import BENCH

HEALTHY = EhaParameters()
ACTUATOR = actuator_of(HEALTHY)
STIFF = AgainstCode.OIL_STIFF.note(share=4.0)
SOFT = AgainstCode.OIL_SOFT.note(share=0.3)
BESIDE = AgainstCode.OUTSIDE_CONDITIONS.note()
BIASED = AgainstCode.SPEED_BIAS.note(bias_rad_s=3.0)


def asked_of(
    against: tuple[Note, ...], fitted: float = 1.0, again: tuple[Note, ...] = ()
) -> tuple[LoadedDiagnosis, list[float]]:
    """Return the diagnosis of a log, and the bulk moduli around which it was made, relative to the rig file's.

    The first circuit has ``fitted`` times the rig file's bulk modulus; ``again`` are the objections to the second one.
    """
    asked: list[float] = []
    coordinates = coordinates_of(replace(HEALTHY, bulk_modulus=fitted * HEALTHY.bulk_modulus), ACTUATOR.rated)
    board = SimpleNamespace(fits=SimpleNamespace(best=SimpleNamespace(coordinates=coordinates)))

    def diagnosed(tried: EhaParameters, doubt: float) -> Any:
        asked.append(tried.bulk_modulus / HEALTHY.bulk_modulus)
        said = against if len(asked) == 1 else again
        return SimpleNamespace(against=said, unknown=bool(said), doubt=doubt, scoreboard=board)

    return with_stiffer_oil(diagnosed, HEALTHY), asked


@pytest.mark.parametrize(
    ("against", "fitted", "moduli"),
    [
        ((), 1.0, [1.0]),
        ((STIFF,), 1.0, [1.0, 4.0]),
        ((SOFT,), 1.0, [1.0]),
        ((STIFF, BIASED), 1.0, [1.0]),
        ((BESIDE,), 2.5, [1.0, 2.5]),
        ((BESIDE,), 1.5, [1.0]),
        ((), 2.5, [1.0]),
        ((BESIDE, BIASED), 2.5, [1.0]),
    ],
)
def test_a_log_is_refitted_around_stiffer_oil_only_if_nothing_else_is_an_objection(
    against: tuple[Note, ...], fitted: float, moduli: list[float]
) -> None:
    found, asked = asked_of(against, fitted)
    assert asked == pytest.approx(moduli)
    again = len(moduli) > 1
    assert found.diagnosis.against == (() if again else against)
    assert found.parameters.bulk_modulus == pytest.approx(moduli[-1] * HEALTHY.bulk_modulus)
    assert [(note.code, note.data["ratio"]) for note in found.notes] == (
        [(ClassCode.OIL_STIFFER_CLASS, pytest.approx(moduli[-1]))] if again else []
    )


def test_the_rig_files_oil_is_kept_if_the_refit_around_stiffer_oil_has_objections() -> None:
    found, asked = asked_of((BESIDE,), 2.5, again=(BIASED,))
    assert len(asked) == 2
    assert found.diagnosis.against == (BESIDE,)
    assert (found.parameters, found.notes) == (HEALTHY, ())


def test_without_pressure_a_log_of_stiff_oil_gets_its_class_and_a_note() -> None:
    truth = replace(parameters_for(CONDITIONS["minor_leakage"]), bulk_modulus=4.0 * HEALTHY.bulk_modulus)
    rng = np.random.default_rng(8)
    log = simulate(CIRCUIT, make_drive("steps", 3.0, 2e-3, truth, rng), 2e-3, truth, sensors=BENCH, rng=rng)
    found = diagnose_log(log.replace(differential_pressure_pa=None), Rig("paper", HEALTHY))
    assert (found.condition, found.unknown) == ("minor_leakage", False)
    (said,) = (note for note in found.notes if note.code == ClassCode.OIL_STIFFER_CLASS)
    assert said.data["ratio"] == pytest.approx(4.0, rel=0.3)


def test_with_pressure_a_log_of_stiff_oil_that_gives_no_number_gets_its_class_and_a_note() -> None:
    truth = replace(parameters_for(CONDITIONS["minor_leakage"]), bulk_modulus=6.0 * HEALTHY.bulk_modulus)
    rng = np.random.default_rng(8)
    log = simulate(CIRCUIT, make_drive("multisine", 3.0, 5e-3, truth, rng), 5e-3, truth, sensors=BENCH, rng=rng)
    found = diagnose_log(log, Rig("paper", HEALTHY))
    assert not found.gate.passed
    assert (found.condition, found.unknown) == ("minor_leakage", False)
    (said,) = (note for note in found.notes if note.code == ClassCode.OIL_STIFFER_CLASS)
    assert said.data["ratio"] == pytest.approx(6.0, rel=0.3)
