"""A circuit outside the nine is described by its levels of leakage and friction, and by what deviates there."""

from dataclasses import replace

import numpy as np
import pytest

from faults.conditions import severity
from faults.diagnosis.circuits.beside import beside_note
from faults.diagnosis.circuits.circuit_runs import COORDINATES, coordinates_of
from plant.arrays import Array
from plant.notes import Note
from tests.faults.diagnosis.short_logs import ACTUATOR, classes


def at(leakage: float, friction: float) -> Array:
    return coordinates_of(severity(leakage, friction, ACTUATOR.circuit), ACTUATOR.rated)


def told_of(place: Array) -> Note:
    fits = classes()
    return beside_note(replace(fits, best=replace(fits.best, coordinates=place)), ACTUATOR)


def test_leakage_without_the_flow_bias_of_its_level_is_described_by_the_ratio_of_flow_bias() -> None:
    place, bias = at(1.25, 0.0), COORDINATES.index("bias")
    healthy = ACTUATOR.conditions[0][bias]
    ratio = float(np.exp(healthy - place[bias]))
    place[bias] = healthy
    note = told_of(place)
    assert note.data == {"leakage": 1.25, "friction": 0.0, "part": "flow bias", "ratio": pytest.approx(ratio, rel=0.02)}
    assert str(note).endswith("but flow bias is 0.17 times what it should be at these levels")


def test_leakage_beyond_the_last_level_is_described_as_a_multiple_of_that_level() -> None:
    place = at(2.0, 0.0) + np.log(3.0) * (np.array(COORDINATES) == "leakage")
    expected = {"leakage": 2.0, "friction": 0.0, "part": "leakage coefficient", "ratio": pytest.approx(3.0)}
    assert told_of(place).data == expected


def test_friction_is_described_by_its_level_and_the_part_that_deviates() -> None:
    place = at(0.0, 1.5) + np.log(0.4) * (np.array(COORDINATES) == "friction_rest")
    assert told_of(place).data == {
        "leakage": 0.0,
        "friction": 1.5,
        "part": "friction at rest",
        "ratio": pytest.approx(0.4, rel=0.05),
    }
