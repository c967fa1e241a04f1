"""The score of each condition's region for a circuit, with friction as forces."""

import numpy as np
import pytest

from faults.conditions import CONDITIONS
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.circuit_runs import COORDINATES
from faults.diagnosis.circuits.class_fit import PointFit
from faults.diagnosis.circuits.friction_shape import bent_information
from faults.diagnosis.circuits.region_scores import (
    region_scores,
    scores_in_forces,
    separations,
    separations_in_forces,
)
from plant.eha.model import EhaParameters

ACTUATOR = actuator_of(EhaParameters())
NORMAL, RUBS = (list(CONDITIONS).index(name) for name in ("normal", "minor_friction"))
QUADRATIC, RATED = (COORDINATES.index(f"friction_{name}") for name in ("quadratic", "rated"))
KNOWN = 1e4 * np.eye(7)


def at(place: np.ndarray) -> PointFit:
    empty = np.zeros((10, 2))
    return PointFit(place, 0.0, KNOWN, np.ones(2), empty, np.zeros((7, 10, 2)))


@pytest.mark.parametrize("place", range(len(CONDITIONS)))
def test_a_nominal_circuit_is_in_its_own_region_only(place: int) -> None:
    fit = at(ACTUATOR.conditions[place])
    scores = scores_in_forces(fit, KNOWN, ACTUATOR)
    assert scores[place] == pytest.approx(0.0, abs=1e-9)
    assert np.all(np.delete(scores, place) < -10.0)
    near = at(ACTUATOR.conditions[place] + 0.02)
    assert scores_in_forces(near, KNOWN, ACTUATOR)[place] == pytest.approx(
        region_scores(near, KNOWN, ACTUATOR)[place], abs=0.2
    )


def test_scores_in_forces_favor_stronger_friction_less_than_logarithmic_scores() -> None:
    quadratic, rated = np.exp(
        0.5 * np.log(np.exp(2.0 * ACTUATOR.conditions[[NORMAL, RUBS]][:, [QUADRATIC, RATED]]).mean(0))
    )
    middle = ACTUATOR.conditions[NORMAL].copy()
    middle[[QUADRATIC, RATED]] = np.log([quadratic, rated])
    moved = np.zeros((7, 2))
    moved[QUADRATIC, 0] = moved[RATED, 1] = 1.0
    told = bent_information(KNOWN, moved)
    straight, forces = (scores(at(middle), told, ACTUATOR) for scores in (region_scores, scores_in_forces))
    assert straight[NORMAL] - straight[RUBS] < -1.0
    assert abs(forces[NORMAL] - forces[RUBS]) < abs(straight[NORMAL] - straight[RUBS])


def test_distances_in_forces_equal_those_in_logarithms_unless_friction_is_uncertain() -> None:
    fit = at(ACTUATOR.conditions[RUBS])
    wide = np.zeros((7, 7))
    wide[QUADRATIC, QUADRATIC] = wide[RATED, RATED] = 4.0
    apart = separations_in_forces(fit, wide, ACTUATOR)
    assert np.array_equal(apart, apart.T)
    assert apart[NORMAL, RUBS] < 1.0 < 10.0 < separations_in_forces(fit, 0.0 * wide, ACTUATOR)[NORMAL, RUBS]
    leaks = list(CONDITIONS).index("minor_leakage_minor_friction")
    assert apart[RUBS, leaks] == pytest.approx(separations(0.0 * wide, ACTUATOR)[RUBS, leaks])
