"""A change of condition is believed if two circuits are much likelier than one, given everything that was chosen."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import quad

from faults.diagnosis.changes import change_odds, onset
from faults.diagnosis.changes.change_odds import (
    BELIEVED_ODDS,
    CHANGE_PRIOR,
    gain_of_parts,
    is_change_believed,
    odds_of_change,
)
from faults.diagnosis.changes.onset import find_onset, part_of, two_parts
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.class_fit import CONDITION_SPREAD, LASTING
from faults.diagnosis.circuits.class_regions import ClassFits, fit_classes
from faults.diagnosis.circuits.model_doubt import information_divisor
from tests.faults.diagnosis.short_logs import ACTUATOR, blocks


@cache
def whole() -> ClassFits:
    return fit_classes(blocks(), ACTUATOR)


def fits(*scores: tuple[int, float], deviation: float = 0.02) -> list[ClassFits]:
    """Return circuits at the centres of conditions, known to a deviation, each ahead of other conditions by a lead."""
    found: list[ClassFits] = []
    for place, lead in scores:
        one = np.full(9, -lead)
        one[place] = 0.0
        best = replace(whole().best, coordinates=ACTUATOR.conditions[place])
        told = np.eye(7) * 2 * LASTING / deviation**2
        found.append(replace(whole(), best=best, scores=one, unbent_scores=None, information=told))
    return found


def odds(gain: float, parts: Sequence[ClassFits], of: Blocks | None = None, deviation: float = 0.02) -> float:
    (all_of_it,) = fits((0, 99.0), deviation=deviation)
    return odds_of_change(gain, parts, all_of_it, of or blocks(), ACTUATOR)


def test_the_odds_of_a_change_include_the_priors_of_its_time_condition_and_circuit() -> None:
    parts, log = fits((0, 300.0), (3, 300.0)), blocks()
    volume = 0.5 * float(np.linalg.slogdet(np.eye(7) + CONDITION_SPREAD / 0.02**2)[1])
    times = len(log.velocity) / LASTING
    beforehand = math.log(CHANGE_PRIOR / (1.0 - CHANGE_PRIOR))
    assert odds(60.0, parts) == pytest.approx(30.0 - volume - math.log(9 * times) + beforehand)
    longer = replace(log, velocity=np.tile(log.velocity, 10))
    assert odds(60.0, parts, longer) == pytest.approx(odds(60.0, parts) - math.log(10.0))


def test_the_evidence_of_a_part_is_the_integral_of_its_likelihood_over_the_region() -> None:
    """The reference is an integral by quadrature over one coordinate; the log says nothing about the others."""
    parts = fits((0, 300.0), (3, 300.0))
    width, told, off = float(CONDITION_SPREAD[0, 0]), 400.0, 0.2
    first = np.zeros((7, 7))
    first[0, 0] = 2 * LASTING * told  # twice, since the two outputs count as one
    at = parts[0].best.coordinates + np.array([off, *np.zeros(6)])
    parts[0] = replace(parts[0], information=first, best=replace(parts[0].best, coordinates=at))
    normal = math.sqrt(2.0 * math.pi * width)
    integral, _ = quad(lambda x: math.exp(-0.5 * told * (x - off) ** 2 - 0.5 * x**2 / width) / normal, -3.0, 3.0)
    nothing = replace(parts[0], information=np.zeros((7, 7)))
    assert odds(30.0, parts) - odds(30.0, [nothing, parts[1]]) == pytest.approx(math.log(integral), abs=1e-6)


def test_odds_of_a_change_are_limited_by_the_lead_of_the_conditions_of_both_parts() -> None:
    near, far = fits((0, 2.0), (3, 300.0)), fits((0, 20.0), (3, 300.0))
    assert odds(200.0, near) == pytest.approx(2.0)
    assert odds(200.0, far) == pytest.approx(20.0)


def test_a_change_is_believed_at_odds_above_ten_to_one(monkeypatch: pytest.MonkeyPatch) -> None:
    parts = [part_of(blocks(), 0, 75), part_of(blocks(), 75, 150)]
    for least, told in ((math.log(BELIEVED_ODDS) + 0.01, True), (math.log(BELIEVED_ODDS) - 0.01, False)):
        monkeypatch.setattr(change_odds, "odds_of_change", lambda *_, least=least: least)
        assert is_change_believed(blocks(), parts, fits((0, 9.0), (3, 9.0)), whole(), ACTUATOR) is told


def test_the_single_circuit_is_refitted_if_its_search_ended_short_of_the_best(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    log = blocks(after="major_leakage")
    two = two_parts(log, fit_classes(log, ACTUATOR), ACTUATOR)
    assert two is not None
    assert find_onset(log, two, ACTUATOR) is not None
    with monkeypatch.context() as doubting:
        doubting.setattr(onset, "is_change_believed", lambda *_: False)
        assert find_onset(log, two, ACTUATOR) is None
    steady = blocks()
    halves = [part_of(steady, 0, 75), part_of(steady, 75, len(steady.velocity))]
    ends = [fit_classes(one, ACTUATOR) for one in halves]
    lost = replace(whole(), best=replace(whole().best, fitted=0.9 * whole().best.fitted))
    assert gain_of_parts(lost, halves, ends) > gain_of_parts(whole(), halves, ends) + 10.0
    apart = [replace(ends[0], scores=np.array([0.0, *np.full(8, -300.0)]), unbent_scores=None), ends[1]]
    assert odds_of_change(gain_of_parts(lost, halves, apart), apart, lost, steady, ACTUATOR) > math.log(BELIEVED_ODDS)
    assert not is_change_believed(steady, halves, apart, lost, ACTUATOR)


def test_a_part_followed_to_its_noise_gets_the_same_credible_information_as_the_others() -> None:
    """If the other part or the whole log leaves more than noise, all circuits have the same credible information."""
    rough, parts = 3.0 * blocks().noise, fits((0, 300.0), (3, 300.0))
    (whole,) = fits((0, 99.0))
    left = [replace(one, best=replace(one.best, scales=rough)) for one in (*parts, whole)]
    poor = replace(left[0], information=left[0].information / information_divisor(left[0].best, blocks()))
    clean = replace(parts[0], best=replace(parts[0].best, scales=blocks().noise))
    one, same = (odds_of_change(60.0, [first, left[1]], left[2], blocks(), ACTUATOR) for first in (clean, poor))
    assert one == pytest.approx(same, abs=1e-9)


@pytest.mark.parametrize("seconds", [3.0, 3.5, 4.0, 5.0])
def test_a_change_is_believed_after_a_part_that_a_circuit_follows_to_its_noise(seconds: float) -> None:
    log = blocks(after="major_leakage", seconds=seconds)
    two = two_parts(log, fit_classes(log, ACTUATOR), ACTUATOR)
    assert two is not None
    assert odds_of_change(two.gain, two.fits, two.whole, log, ACTUATOR) > math.log(BELIEVED_ODDS)
