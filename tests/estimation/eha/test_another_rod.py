"""A single rod that explains a log is doubted if its areas are known no better than a rig file's."""

import numpy as np
import pytest

from estimation.eha.another_rod import vague_area_notes
from estimation.eha.result import is_vague
from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.notes import RigCode


def explained(**values: tuple[float, float]) -> Explanation:
    return Explanation(("single_rod",), values, {}, (), (), 1e5)


def test_a_ratio_of_areas_with_a_deviation_of_three_percent_is_vague_and_half_a_percent_is_not() -> None:
    """Side B over side A is (1 - d) / (1 + d): near d = 0 its deviation is twice that of d."""
    assert vague_area_notes(explained(area_difference=(0.176, 0.002))) == ()
    (note,) = vague_area_notes(explained(area_difference=(-0.03, 0.015)))
    assert note.code is RigCode.AREAS_VAGUE
    assert note.data["percent"] == pytest.approx(1.96 * 3.0, rel=0.01)


def test_an_explanation_without_areas_has_no_vague_areas() -> None:
    assert vague_area_notes(None) == ()
    assert vague_area_notes(explained(pressure_offset=(1e5, 1e6))) == ()


def test_an_undetermined_value_is_vague() -> None:
    assert is_vague(1.0, None)
    assert is_vague(1.0, np.inf)
    assert is_vague(1.0, float("nan"))
    assert not is_vague(-1.0, 0.4)
    (note,) = vague_area_notes(explained(area_difference=(0.2, np.inf)))
    assert note.data["percent"] == 999.0
