"""Entries of a rig file that contradict each other."""

from dataclasses import replace

import pytest

from benchmarks.diagnosis.typed_rigs import FILES
from faults.diagnosis.doubtful_entries import doubtful_entries
from faults.notes import ClassCode
from plant.eha.model import EhaParameters
from plant.eha.rig import read_rig


@pytest.mark.parametrize(
    ("areas", "times", "said"), [(0.0, 15.0, False), (0.35, 1.0, False), (0.35, 4.0, False), (0.35, 15.0, True)]
)
def test_make_up_valves_too_small_for_a_single_rods_flow_are_named(areas: float, times: float, *, said: bool) -> None:
    p = EhaParameters(area_difference=areas)
    p = replace(p, pump_displacement=times * p.pump_displacement)
    found = [note for note in doubtful_entries(p) if note.code is ClassCode.MAKEUP_TOO_SMALL]
    assert len(found) == said
    assert all(note.data["drop_pa"] == pytest.approx(0.7 / 1.35 * p.rated_flow / 1e-9) for note in found)


def test_no_rig_file_of_the_benchmark_has_make_up_valves_that_are_too_small() -> None:
    for file in FILES.glob("*.toml"):
        codes = [note.code for note in doubtful_entries(read_rig(file).parameters)]
        assert ClassCode.MAKEUP_TOO_SMALL not in codes
