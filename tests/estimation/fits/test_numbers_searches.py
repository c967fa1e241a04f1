"""Results of searches from many starts in short logs, and their evaluations, kept in `numbers_searches.json`."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from estimation.fits.flow.fit import fit_flow
from estimation.fits.flow.log import without_strays
from estimation.fits.flow.log_traits import LogTraits
from estimation.fits.flow.search import balance_fits, flow_starts
from estimation.fits.greybox.descent import Point
from estimation.fits.greybox.fit import Search, coarse_optimum, explains_log
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.problem import Problem
from estimation.fits.hypotheses import HYPOTHESES
from estimation.fits.hypothesis_search.explain import explain
from estimation.fits.hypothesis_search.wide_problem import flow_bounds
from estimation.fits.motion.fit import fit_motion
from plant.arrays import Array
from plant.eha.circuit_parameters import circuit_of
from plant.eha.drives import make_drive
from plant.eha.parameter_path import ParameterPath
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from tests.estimation.fits.short_logs import PAPER, PRESSURE, WORN, log, noted, problem, seen
from tests.numbers import Found, Numbers, Roughly

NUMBERS = Numbers(__file__)


@contextmanager
def counted() -> Iterator[list[int]]:
    """Record each evaluation of a misfit by the number of its samples."""
    asked: list[int] = []
    at, at_each, costs = Problem.at, FreedProblem.at_each, FreedProblem.costs

    def one(self: Problem, theta: Array) -> Point:
        asked.append(len(self.log.measured))
        return at(self, theta)

    def some(self: FreedProblem, thetas: Sequence[Array]) -> list[Point]:
        asked.extend(len(self.log.measured) for _ in thetas)
        return at_each(self, thetas)

    def sums(self: FreedProblem, thetas: Sequence[Array], *lanes: int) -> Array:
        asked.extend(len(self.log.measured) for _ in thetas)
        return costs(self, thetas, *lanes)

    with (
        patch.object(Problem, "at", one),
        patch.object(FreedProblem, "at_each", some),
        patch.object(FreedProblem, "costs", sums),
    ):
        yield asked


@cache
def growing() -> Record:
    """Return a log whose leakage trebles."""
    rng = np.random.default_rng(3)
    path = ParameterPath((0.0, 1.0), (circuit_of(WORN), circuit_of(replace(WORN, leakage_coefficient=6e-11))), "linear")
    return simulate(CIRCUIT, make_drive("steps", 1.0, 1e-3, WORN, rng), 1e-3, path, sensors=BENCH, rng=rng)


@NUMBERS.case(relative=0.01)
def hypotheses_about_strange_logs() -> dict[str, Any]:
    record = log(0.5)
    pressure = record[PRESSURE]
    late = np.concatenate([np.full(4, pressure[0]), pressure[:-4]])
    strange = {
        "pressure off": record.replace(**{PRESSURE: pressure + 2e5}),
        "pressure late": record.replace(**{PRESSURE: late}),
        "leakage grows": growing(),
        "pressure late and off": record.replace(**{PRESSURE: late + 1e5}),
    }
    names = {"leakage grows": ("leakage_growth", "leakage_rise", "volume")}
    usual = ("pressure_late", "pressure_offset", "speed_late", "relief_low")
    told: dict[str, Any] = {}
    for name, one in strange.items():
        asked = [some for some in HYPOTHESES if some.name in names.get(name, usual)]
        with counted() as points:
            found = explain(
                seen(one), PAPER, flow_starts(PAPER, 2e8)[:2], lambda fit: fit.chi_square[0] < 3.0, asked=asked
            )
        assert found is not None
        told[name] = {
            "names": list(found.names),
            "rivals": len(found.rivals),
            "delays": dict(found.delays),
            "points": Roughly(len(points), 0.1),
            "values": {of: Found(*pair) for of, pair in found.values.items()},
            "cost": found.fit.cost,
        }
    return told


@NUMBERS.case(relative=0.01)
def logs_that_no_start_explains() -> dict[str, Any]:
    record = log(0.5)
    drifting = record.replace(**{PRESSURE: record[PRESSURE] + np.linspace(0.0, 2e5, len(record))})
    told: dict[str, Any] = {}
    for name, one in (("drifting", drifting), ("noisy position", log(0.5, position_noise=3e-5)), ("plain", record)):
        with counted() as points:
            found = balance_fits(seen(one), PAPER, flow_starts(PAPER, 2.5e8))
        told[name] = {"points": Roughly(len(points), 0.1), "costs": [fit.cost for fit in found]}
    with counted() as points:
        fit = fit_flow(drifting, PAPER, 2e8)
    told["fit of a drifting one"] = {
        "points": Roughly(len(points), 0.1),
        "reasons": noted(fit.reasons),
        "bound": fit.bound,
    }
    loaded = fit_flow(record.replace(**{PRESSURE: record[PRESSURE] + 2e5}), PAPER, 2e8, traits=LogTraits(loaded=True))
    told["with a load"] = {
        "explained by": list(loaded.explanation.names) if loaded.explanation else None,
        "bound": loaded.bound,
    }
    return told


@NUMBERS.case(relative=0.01)
def starts_that_are_screened() -> dict[str, Any]:
    one = problem()
    guesses = [one.model.theta({"accumulator_stiffness": 0.0, **start}) for start in flow_starts(PAPER, 3e8)[::2]]
    bounds = flow_bounds(one.model, guesses, one.log)
    told: dict[str, Any] = {}
    for name, search in (
        ("usual", Search()),
        ("part by part", Search(screened=20)),
        ("two parts", Search(screened=50, screening=4, finalists=1)),
        ("all finalists", Search(screened=50, finalists=3, evaluations=6)),
    ):
        with counted() as points:
            found = coarse_optimum(one, guesses, search, bounds)
        told[name] = {
            "points by samples": sorted((n, points.count(n)) for n in set(points)),
            "cost": found.cost,
            "explained": explains_log(one, found),
        }
    with counted() as points:
        lone = coarse_optimum(one, guesses[:1], Search(), bounds, wanted=1e-3)
    told["in vain"] = {"points": Roughly(len(points), 0.1), "cost": lone.cost}
    return told


@NUMBERS.case(relative=0.01)
def fits_of_the_form_of_motion() -> dict[str, Any]:
    told: dict[str, Any] = {}
    shaken = log(0.5).replace(position_m=log(0.5)["position_m"] + 2e-5 * np.sin(0.2 * np.arange(500)))
    for name, record, rig in (("worn", log(0.5), WORN), ("worn, rig sound", log(0.5), PAPER), ("shaken", shaken, WORN)):
        with counted() as points:
            fit = fit_motion(record, rig, 2e8, {"chamber_volume": 0.1}, {"motor_speed_rad_s": 1e-4})
        told[name] = {
            "points": Roughly(len(points), 0.1),
            "bulk modulus [Pa]": Roughly(fit.parameters["bulk_modulus"][0], 0.06),
            "leakage [m^3/(s Pa)]": Roughly(fit.parameters["leakage_coefficient"][0], 0.06),
            "bound": Roughly(fit.bound, 0.5),
            "chi-square": Roughly(fit.chi_square, 0.02),
            "reasons": [note["code"] for note in noted(fit.reasons)],
        }
    return told


@NUMBERS.case()
def strays_by_their_size() -> dict[str, Any]:
    record = log(0.5)
    places = np.arange(60, 460, 40)
    sizes = np.geomspace(1e5, 9e6, 10)
    strayed = record[PRESSURE].copy()
    strayed[places] += sizes
    clean, _ = without_strays(record.replace(**{PRESSURE: strayed}))
    return {"left out of ten": [bool(np.isnan(clean[PRESSURE][place])) for place in places]}


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
