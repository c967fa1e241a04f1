"""Fitted circuits compared with the regions of the conditions."""

from dataclasses import replace

import numpy as np
import pytest

from faults.conditions import CONDITIONS
from faults.diagnosis.circuits import class_regions
from faults.diagnosis.circuits.actuator import Actuator, actuator_of
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.circuit_runs import COORDINATES, parameter_rows, predicted_outputs
from faults.diagnosis.circuits.class_fit import CONDITION_SPREAD, PointFit
from faults.diagnosis.circuits.class_regions import (
    credible_information,
    fit_classes,
    is_stuck,
    nearest_score,
)
from faults.diagnosis.circuits.model_doubt import lasting_misfit
from faults.diagnosis.circuits.pressure_scale import ALIKE, PRESSURE_SCALE, spread_without_pressure
from faults.diagnosis.circuits.region_scores import region_scores, separations
from plant.eha.model import EhaParameters

ACTUATOR = actuator_of(EhaParameters())
INFORMATION = 1e4 * np.eye(7)


def blocks(*, pressure: bool, travel: float = 0.1) -> Blocks:
    velocity = np.full(100, travel / 0.99)
    outputs = 2 if pressure else 1
    return Blocks(np.zeros(1001), 1e-3, 10, velocity, velocity if pressure else None, np.full(outputs, 1e-3))


def fit(place: int, scale: float = 1e-3, outputs: int = 2) -> PointFit:
    empty = np.zeros((100, outputs))
    return PointFit(ACTUATOR.conditions[place], 0.0, INFORMATION, np.full(outputs, scale), empty, empty[None])


@pytest.mark.parametrize("place", range(len(CONDITIONS)))
def test_a_nominal_circuit_is_in_its_own_region_only(place: int) -> None:
    scores = region_scores(fit(place), INFORMATION, ACTUATOR)
    assert scores[place] == 0.0
    assert np.all(np.delete(scores, place) < -10.0)


def test_coordinates_without_information_do_not_affect_the_scores() -> None:
    only_leakage = np.diag([1e4, *6 * [0.0]])
    scores = region_scores(fit(0), only_leakage, ACTUATOR)
    alike = [i for i, condition in enumerate(CONDITIONS.values()) if condition.leakage == "none"]
    assert scores[alike] == pytest.approx(0.0)
    assert np.all(np.delete(scores, alike) < -10.0)


def test_without_pressure_there_is_no_credible_information_on_the_pressure_scale() -> None:
    believed = credible_information(fit(0, outputs=1), blocks(pressure=False))
    assert float(PRESSURE_SCALE @ believed @ PRESSURE_SCALE) == pytest.approx(0.0, abs=1e-6)
    assert credible_information(fit(0), blocks(pressure=True)) == pytest.approx(INFORMATION)


def test_the_spread_is_computed_once_and_only_on_request(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []
    monkeypatch.setattr(class_regions, "spread_with_pressure", lambda *given: asked.append(given) or np.eye(7))
    found = fit_classes(blocks(pressure=True), ACTUATOR, start=ACTUATOR.conditions[0])
    assert found.scores.shape == (len(CONDITIONS),)
    assert not asked
    assert found.spread is found.spread
    assert len(asked) == 1


def test_a_model_error_reduces_the_credible_information() -> None:
    near, far = (credible_information(fit(0, scale), blocks(pressure=True)) for scale in (1e-3, 1e-2))
    assert np.all(np.diag(far) < 0.02 * np.diag(near))


def test_a_stuck_piston_gives_no_information_on_friction() -> None:
    stuck = blocks(pressure=True, travel=5e-5)
    assert is_stuck(stuck, ACTUATOR)
    assert not is_stuck(blocks(pressure=True), ACTUATOR)
    few = ACTUATOR.circuit.presliding_displacement * np.array([4.0, 6.0])
    assert [is_stuck(blocks(pressure=True, travel=travel), ACTUATOR) for travel in few.tolist()] == [True, False]
    believed = np.diag(credible_information(fit(0), stuck, stuck=True))
    assert [name for name, known in zip(COORDINATES, believed, strict=True) if known == 0.0] == [
        "friction_rest",
        "friction_quadratic",
        "friction_rated",
    ]


def residual(left: np.ndarray, *, pressure: bool = True) -> tuple[PointFit, Blocks]:
    """Return a fit with given residuals in each channel, and its log."""
    log = blocks(pressure=pressure)
    outputs = log.outputs
    found = fit(0, outputs=outputs.shape[1])
    return replace(found, fitted=outputs - 1e-3 * left[:, None]), log


def test_lasting_residuals_widen_intervals_and_white_noise_does_not() -> None:
    white = np.random.default_rng(1).normal(size=100)
    lasting = np.repeat(white[:10] / np.std(white[:10]), 10)
    spreads = [
        spread_without_pressure(*_with(left, pressure=False), ACTUATOR.conditions[0])
        for left in (np.zeros(100), white, lasting)
    ]
    quiet, noisy, coloured = (float(np.sqrt(spread[0, 0])) for spread in spreads)
    assert noisy < 1.3 * quiet
    assert coloured > 1.5 * quiet


def _with(left: np.ndarray, *, pressure: bool = True) -> tuple[PointFit, np.ndarray, Blocks]:
    found, log = residual(left, pressure=pressure)
    return found, INFORMATION, log


def test_without_pressure_an_atypical_actuator_has_a_wider_spread_of_the_pressure_scale() -> None:
    found, log = residual(np.zeros(100), pressure=False)
    believed = credible_information(found, log)
    along = PRESSURE_SCALE / np.linalg.norm(PRESSURE_SCALE)
    near, far = (
        float(
            along
            @ spread_without_pressure(replace(found, coordinates=found.coordinates + off), believed, log, centre)
            @ along
        )
        for centre in [ACTUATOR.conditions[0]]
        for off in (np.zeros(7), np.array([0.2, -0.2, 0.2, 0.0, 0.0, 0.0, 0.0]))
    )
    assert 1.5 * near < far < 1.0


def test_the_fitted_circuit_that_follows_the_log_best_decides_the_scores(monkeypatch: pytest.MonkeyPatch) -> None:
    log = blocks(pressure=True)
    followed = {next(iter(CONDITIONS)): 1.0158, list(CONDITIONS)[4]: 1.0}
    runs = np.array([log.outputs * followed.get(name, 2.0) for name in CONDITIONS])

    def fitted_from(_: Blocks, __: Actuator, condition: str, *___: object) -> PointFit:
        place = list(CONDITIONS).index(condition)
        scale = 1e-3 + 0.1 * (followed[condition] - 1.0)
        return replace(fit(place, scale), fitted=runs[place], cost=float(scale))

    monkeypatch.setattr(class_regions, "nominal_runs", lambda *_: runs)
    monkeypatch.setattr(class_regions, "fit_freely", fitted_from)
    found = fit_classes(log, ACTUATOR)
    assert int(np.argmax(found.scores)) == 4
    assert 2.0 < found.scores[4] - found.scores[0] < 4.0
    assert found.best.cost == pytest.approx(1e-3)
    assert int(np.argmin(found.nominal)) == 4


def test_a_creeping_piston_is_fitted_at_each_friction_level_without_a_clear_winner(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    log = blocks(pressure=True)
    names, tried = list(CONDITIONS), list[tuple[str, bool]]()
    runs = np.array([log.outputs * (1.0 if place == 0 else 50.0) for place in range(len(names))])

    def fitted_from(_: Blocks, __: Actuator, condition: str, start: object = None, *___: float) -> PointFit:
        tried.append((condition, start is not None))
        left = np.array([10.0 if condition == "normal" else 9.5, 1.0]) * log.noise
        return replace(fit(names.index(condition), 1e-3), fitted=log.outputs - left, scales=left, cost=float(left[0]))

    monkeypatch.setattr(class_regions, "nominal_runs", lambda *_: runs)
    monkeypatch.setattr(class_regions, "fit_freely", fitted_from)
    monkeypatch.setattr("faults.diagnosis.circuits.rivals.fit_freely", fitted_from)
    found = fit_classes(log, ACTUATOR)
    assert tried == [("normal", False), ("minor_friction", True), ("major_friction", True)]
    alike = [names.index(name) for name in ("normal", "minor_friction", "major_friction")]
    assert np.ptp(found.scores[alike]) < 0.5
    assert np.max(np.delete(found.scores, alike)) < np.min(found.scores[alike]) - 3.0
    rated = COORDINATES.index("friction_rated")
    assert found.spread[rated, rated] > 0.5
    tried.clear()
    fit_classes(log, ACTUATOR, start=ACTUATOR.conditions[0])
    assert tried == [("normal", True)]


def test_the_lasting_misfit_compares_residuals_averaged_over_0_1_s_with_white_noise() -> None:
    log = blocks(pressure=True)
    least = np.maximum(log.noise, 1e-3 * np.abs(log.outputs[0]))
    lasting = np.ones((100, 2)) * least
    assert lasting_misfit(log.outputs - lasting, log) == pytest.approx(np.sqrt(10.0), rel=1e-6)
    alternating = np.where(np.arange(100) % 2, 1.0, -1.0)[:, None] * least
    assert lasting_misfit(log.outputs - alternating, log) == pytest.approx(0.0, abs=1e-9)
    gaps = log.outputs - lasting
    gaps[50:60] = np.nan
    assert lasting_misfit(gaps, log) == pytest.approx(np.sqrt(10.0), rel=1e-6)


def test_without_pressure_similarity_of_actuators_limits_the_spread_of_the_pressure_scale() -> None:
    found, log = residual(np.zeros(100), pressure=False)
    spread = spread_without_pressure(found, np.zeros((7, 7)), log, ACTUATOR.conditions[0])
    known = spread_without_pressure(found, INFORMATION, log, ACTUATOR.conditions[0])
    along = PRESSURE_SCALE / np.linalg.norm(PRESSURE_SCALE)
    assert float(along @ spread @ along) < float(along @ class_regions.WEAK_PRIOR @ along)
    assert float(along @ known @ along) < float(along @ spread @ along)
    assert 0.05**2 < ALIKE * CONDITION_SPREAD[0, 0] < 0.1**2


@pytest.mark.parametrize("name", [name for name in COORDINATES if name != "presliding"])
def test_a_typical_actuator_is_in_its_region_and_one_off_by_a_factor_of_two_is_not(name: str) -> None:
    at = COORDINATES.index(name)
    near, far = (
        region_scores(
            replace(fit(0), coordinates=ACTUATOR.conditions[0] + off * np.eye(7)[at]), 1e6 * INFORMATION, ACTUATOR
        )
        for off in (0.1, 0.8)
    )
    assert near[0] > -1.0
    assert far[0] < -7.0


def test_an_actuator_with_twice_the_presliding_travel_stays_in_its_region() -> None:
    at = COORDINATES.index("presliding")
    for factor in (0.5, 2.0):
        moved = replace(fit(0), coordinates=ACTUATOR.conditions[0] + np.log(factor) * np.eye(7)[at])
        assert region_scores(moved, 1e6 * INFORMATION, ACTUATOR)[0] > -0.5
    beyond = replace(fit(0), coordinates=ACTUATOR.conditions[0] + np.log(100.0) * np.eye(7)[at])
    assert region_scores(beyond, 1e6 * INFORMATION, ACTUATOR)[0] < -7.0


def test_the_pressure_scale_multiplies_pressure_and_leaves_motion_unchanged() -> None:
    speed = np.repeat([60.0, 120.0, -120.0, -70.0], 150)
    log = Blocks(np.append(speed, speed[-1]), 1e-3, 10, np.zeros(60), np.zeros(60), np.ones(2))
    places = np.eye(7)[:6]
    others = [
        PRESSURE_SCALE + by * place * (PRESSURE_SCALE + (PRESSURE_SCALE == 0.0))
        for place in places
        for by in (1.0, -0.5)
    ]
    points = ACTUATOR.conditions[0] + 0.2 * np.vstack([np.zeros(7), PRESSURE_SCALE, others])
    runs = predicted_outputs(log, parameter_rows(points, ACTUATOR.circuit, ACTUATOR.rated))[:, log.first :]
    size = np.sqrt(np.mean(runs[0] ** 2, axis=0))
    moved = np.sqrt(np.mean((runs - runs[0])[:, :, 0] ** 2, axis=1)) / size[0]
    assert moved[1] < 0.01
    assert moved[1] < np.min(moved[2:])
    assert np.sqrt(np.mean(runs[1, :, 1] ** 2)) / size[1] == pytest.approx(np.exp(0.2), rel=0.01)


def test_the_covariance_is_the_weak_prior_without_information_and_vanishes_with_much() -> None:
    nine = np.zeros(len(CONDITIONS))
    said = (
        class_regions.ClassFits(
            fit(0), scale * np.eye(7), nine, np.zeros((9, 2)), nine, lambda: np.eye(7), 1.0
        ).covariance
        for scale in (0.0, 1e9)
    )
    nothing, everything = said
    np.testing.assert_allclose(nothing, class_regions.WEAK_PRIOR, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(everything, 1e-9 * np.eye(7), rtol=2e-3, atol=1e-12)


@pytest.mark.parametrize("off", [0.4, -0.4])
def test_without_pressure_a_fit_is_moved_along_the_pressure_scale_to_its_condition(
    off: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = blocks(pressure=False)
    runs = np.array([log.outputs * (1.0 if i == 0 else 2.0) for i in range(len(CONDITIONS))])
    away = ACTUATOR.conditions[0] + off * PRESSURE_SCALE
    found = replace(fit(0, outputs=1), coordinates=away, fitted=log.outputs)
    monkeypatch.setattr(class_regions, "nominal_runs", lambda *_: runs)
    monkeypatch.setattr(class_regions, "fit_freely", lambda *_: found)
    best = fit_classes(log, ACTUATOR).best
    np.testing.assert_allclose(best.coordinates, ACTUATOR.conditions[0], atol=1e-9)
    np.testing.assert_array_equal(best.as_run.coordinates, away)
    np.testing.assert_array_equal(found.as_run.coordinates, away)


def test_after_a_circuit_that_explains_the_log_no_search_starts_elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    drive = 100.0 * np.sign(np.sin(2.0 * np.pi * np.arange(3001) / 600.0))
    still = Blocks(drive, 1e-3, 10, np.zeros(300), np.zeros(300), np.array([2e-4, 2e4]))
    truth = 0.5 * ACTUATOR.conditions[0] + 0.5 * ACTUATOR.conditions[3]
    run = predicted_outputs(still, parameter_rows(truth[None], ACTUATOR.circuit, ACTUATOR.rated))[0]
    noise = still.noise * np.random.default_rng(2).standard_normal(run.shape)
    log = replace(still, velocity=(run + noise)[:, 0], pressure=(run + noise)[:, 1])
    begun: list[bool] = []
    usual = class_regions.fit_freely

    def counted(*given: object) -> PointFit:
        begun.append(given[3] is None)
        return usual(*given)  # pyright: ignore[reportArgumentType] -- as it came

    monkeypatch.setattr(class_regions, "fit_freely", counted)
    quick = fit_classes(log, ACTUATOR)
    assert begun.count(True) == 1
    monkeypatch.setattr(class_regions, "leaves_only_noise", lambda *_: False)
    whole = fit_classes(log, ACTUATOR)
    assert begun.count(True) > 2
    assert quick.best.cost < whole.best.cost + 0.5
    off = quick.best.coordinates - whole.best.coordinates
    assert float(off @ whole.best.information @ off) < 1.0
    assert np.argmax(quick.scores) == np.argmax(whole.scores)


def test_the_distance_of_conditions_shrinks_with_uncertainty_of_the_coordinates_that_differ() -> None:
    sure, rubs = np.zeros((7, 7)), np.zeros((7, 7))
    for name in ("friction_rest", "friction_quadratic", "friction_rated"):
        rubs[COORDINATES.index(name), COORDINATES.index(name)] = 4.0
    apart, unsure = separations(sure, ACTUATOR), separations(rubs, ACTUATOR)
    normal, leaks, rubbing = (list(CONDITIONS).index(one) for one in ("normal", "minor_leakage", "minor_friction"))
    assert np.array_equal(apart, apart.T)
    assert not np.any(apart.diagonal())
    assert unsure[normal, rubbing] < 2.0 < 10.0 < apart[normal, rubbing]
    assert unsure[normal, leaks] == pytest.approx(apart[normal, leaks])
    off = ACTUATOR.conditions[leaks] - ACTUATOR.conditions[normal]
    assert apart[normal, leaks] == pytest.approx(0.5 * off @ np.linalg.solve(CONDITION_SPREAD, off))


@pytest.mark.parametrize("pressure", [True, False])
def test_without_pressure_a_log_is_outside_only_if_every_circuit_that_follows_it_is(
    pressure: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    log, far = blocks(pressure=False), np.eye(7)[COORDINATES.index("leakage")]
    left = 0.02 * (-1.0) ** np.arange(100)[:, None]
    outside, inside = (
        replace(
            fit(0, outputs=1), coordinates=ACTUATOR.conditions[0] - off, fitted=log.outputs - size * left, cost=cost
        )
        for off, size, cost in ((far, 1.0, 0.0), (0.0 * far, 1.1, 1.0))
    )
    outside, inside = (replace(one, scales=class_regions.scales_of(log, one.fitted)) for one in (outside, inside))
    ends = iter((outside, inside, inside))
    monkeypatch.setattr(class_regions, "fit_freely", lambda *_: next(ends))
    fits = fit_classes(log, ACTUATOR, runs=np.zeros((9, 100, 1)))
    alone = float(np.max(region_scores(fits.best, fits.discounted_information, ACTUATOR)))
    assert alone < -10.0
    seen = blocks(pressure=True) if pressure else log
    behind = float(log.counts[0]) / class_regions.LASTING * np.log(1.1)
    assert nearest_score(fits, seen, ACTUATOR) == pytest.approx(alone if pressure else -behind)
