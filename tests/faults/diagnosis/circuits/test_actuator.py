"""The healthy actuator with which circuits are fitted to logs."""

from dataclasses import replace

import pytest

from faults.diagnosis.circuits.actuator import actuator_of, with_room_for_stroke
from faults.diagnosis.doubtful_entries import doubtful_entries
from faults.notes import ClassCode
from plant.eha.circuit_parameters import longest_stroke
from plant.eha.model import EhaParameters
from plant.errors import RigError

PAPER = EhaParameters(area_difference=0.2, volume_difference=0.1)
LONGEST = float(longest_stroke(PAPER))


@pytest.mark.parametrize(("stroke", "larger"), [(None, 1.0), (0.9 * LONGEST, 1.0), (1.3 * LONGEST, 1.3)])
def test_a_chamber_volume_too_small_for_the_stroke_is_enlarged_and_noted(stroke: float | None, larger: float) -> None:
    """With a chamber volume 27 % too small in a single rod's rig file, no circuit fitted, and the class was unknown."""
    rig = replace(PAPER, stroke=stroke)
    assert with_room_for_stroke(rig).chamber_volume == pytest.approx(larger * PAPER.chamber_volume)
    (*said,) = doubtful_entries(rig)
    assert [round(note.data["percent"]) for note in said if note.code is ClassCode.VOLUME_FOR_STROKE] == (
        [30] if larger > 1.0 else []
    )
    circuit = actuator_of(rig).circuit
    assert circuit.stroke == pytest.approx(stroke or LONGEST)
    assert circuit.chamber_volume == pytest.approx(larger * PAPER.chamber_volume)


def test_a_stroke_far_too_long_for_the_chambers_is_refused() -> None:
    rig = replace(PAPER, stroke=3.0 * LONGEST)
    assert with_room_for_stroke(rig) == rig
    with pytest.raises(RigError, match="room"):
        actuator_of(rig)
