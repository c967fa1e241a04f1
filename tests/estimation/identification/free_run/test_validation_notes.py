"""A model that does clearly worse on another log than on held-back blocks of the fitted log says so."""

from dataclasses import replace
from math import isnan, nan

import numpy as np
import pytest

from estimation.identification.free_run.data import Channels, channels_from
from estimation.identification.free_run.identified import LEVEL_DOES_NOT_HOLD, Identified
from estimation.identification.free_run.identify import identify_channels
from estimation.identification.free_run.validation_notes import validation_notes
from estimation.identification.model.recursion import filtered
from estimation.identification.notes import IdentificationCode
from plant.notes import Note


def log(seed: int, pole: float = 0.9, drive: float = 1.0, noise: float = 0.1) -> Channels:
    rng = np.random.default_rng(seed)
    u = drive * np.repeat(rng.normal(size=120), 5)
    y = filtered([0.0, 1.0 - pole], [1.0, -pole], u) + noise * rng.normal(size=u.size)
    return channels_from([u[:, None]], [y], 0.1, ["u"], "y")


@pytest.fixture(scope="module")
def found() -> Identified:
    return identify_channels(log(0), order=1, delay=1)


def codes(found: Identified, other: Channels) -> list[str]:
    quality = found.model.quality(other.u, other.y)
    return [str(note.code) for note in validation_notes(found.model, quality, found.expected_error, "the log")]


@pytest.mark.parametrize("seed", range(1, 9))
def test_other_logs_of_the_same_plant_are_as_good_as_held_back_blocks(found: Identified, seed: int) -> None:
    assert codes(found, log(seed)) == []


def test_a_log_of_another_plant_is_worse_and_says_by_how_much(found: Identified) -> None:
    other = log(1, pole=0.7)
    quality = found.model.quality(other.u, other.y)
    (note,) = validation_notes(found.model, quality, found.expected_error, "--validate other.csv")
    assert note.code == "validated_worse"
    assert note.data["left"] == pytest.approx(1.0 - quality.fit_percent / 100.0)
    assert note.data["held_back"] == pytest.approx(1.0 - found.held_back_percent / 100.0)
    assert "--validate other.csv" in str(note)


def test_a_larger_drive_or_the_same_noise_beside_a_smaller_one_is_no_worse_a_model(found: Identified) -> None:
    large, small = log(1, drive=4.0, noise=0.4), log(1, drive=0.2)
    rmse = found.expected_error * found.model.scaling.y_std
    assert found.model.quality(large.u, large.y).rmse > 2.0 * rmse
    assert found.model.quality(small.u, small.y).fit_percent < 100.0 - 200.0 * found.expected_error
    assert codes(found, large) == codes(found, small) == []


@pytest.mark.parametrize("code", sorted(LEVEL_DOES_NOT_HOLD, key=str))
def test_a_model_whose_level_holds_for_its_own_log_alone_promises_nothing(
    found: Identified, code: IdentificationCode
) -> None:
    told = replace(found, notes=(Note(code),))
    assert isnan(told.expected_error)
    assert codes(told, log(1, pole=0.7)) == []


def test_without_held_back_blocks_nothing_is_told(found: Identified) -> None:
    assert codes(replace(found, held_back_percent=nan), log(1, pole=0.7)) == []
