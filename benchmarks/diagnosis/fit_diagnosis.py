"""Fit what diagnosis ships: weights of the evidence and widths of the intervals, on simulated training logs only.

A quarter of the logs are from the open benchmark, whose physics no estimator shares: on the circuit's own logs hardly
any class is wrong, and weights learnt there would be too confident elsewhere. Writes
``faults/diagnosis/calibration.json`` (or the file given by ``--out``). Test seeds, other splits of the benchmark and
foreign logs are never used. ``--widths`` fits only the widths with pressure, which need only the fitted circuits, and
leaves everything else unchanged.
"""

import argparse
import json
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

import hydrostate
from benchmarks.diagnosis.population import DRIVES, TRAINING, DrawnLog, draw_logs
from experiments.open_benchmark.folders import write_set
from experiments.open_benchmark.kinds import VERSION
from experiments.open_benchmark.loaders import read_truth, rows_of
from experiments.open_benchmark.score import COEFFICIENTS
from experiments.published.library import read_library
from faults.conditions import CONDITIONS
from faults.diagnosis.changes.onset import last_part
from faults.diagnosis.circuits.actuator import Actuator, actuator_of
from faults.diagnosis.circuits.circuit_runs import coordinates_of
from faults.diagnosis.circuits.class_regions import ClassFits
from faults.diagnosis.evidence import EVIDENCES, weigh_evidence
from faults.diagnosis.severity import UNITS, severities, severities_at
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.log.record import Record

RIDGE = 1e-3
"""Penalty on squared weights [dimensionless]: if all training logs are right, weights would otherwise grow without
bound."""

HELD, HELD_ALIKE = 0.96, 0.95
"""Shares of all training logs, and of those of the first population, whose interval must contain the truth."""

FAR, TWICE = 0.995, 2.0
"""Share of all training logs whose error must be within this many half-widths: tails are longer than a Gaussian's."""

POPULATIONS = ((0.1, True), (0.2, True), (0.1, False))
"""Spread, and whether the circuits are of the fitted kind. Weights use the first two populations, widths all three;
both use the open benchmark's logs, as many as in one population."""

PRESSURE = "differential_pressure_pa"


def main(arguments: list[str]) -> int:
    """Fit and write; return 0."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=24)
    parser.add_argument("--out", type=Path, default=Path("faults/diagnosis/calibration.json"))
    parser.add_argument("--widths", action="store_true", help="fit the widths with pressure alone")
    options = parser.parse_args(arguments)
    if options.widths:
        return _fit_widths(options.seeds, options.out)
    modes = {"with_pressure": True, "without_pressure": False}
    with ProcessPoolExecutor(len(modes)) as pool:
        parts = pool.map(weights_and_widths, len(modes) * [options.seeds], modes.values())
        found: dict[str, object] = dict(zip(modes, parts, strict=True))
    for name, part in found.items():
        print(name, len(CONDITIONS) * len(DRIVES) * options.seeds * (len(POPULATIONS) + 1), "logs", part)
    found["provenance"] = {
        "script": "python -m benchmarks fit_diagnosis",
        "population": "benchmarks.diagnosis.population.draw_logs, and as many logs as one of its populations has of "
        f"the open benchmark {VERSION}, kind plain, split training",
        "first_seed": TRAINING,
        "seeds": options.seeds,
        "spread, and whether the circuit is of the kind that is fitted": [list(one) for one in POPULATIONS],
        "ridge": RIDGE,
        "held of all, of the first": [HELD, HELD_ALIKE],
        "share of all within so many half-widths": [FAR, TWICE],
        "least width": 1.0,
    }
    options.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return 0


def _fit_widths(seeds: int, out: Path) -> int:
    """Fit the widths with pressure and add them to the existing file; return 0."""
    actuator = actuator_of(EhaParameters())
    ratios = _empty_ratios()
    for _, log in _training_logs(range(TRAINING, TRAINING + seeds)):
        _add_ratios(ratios, last_part(log.record, actuator).fits, log.parameters, actuator)
    found = json.loads(out.read_text(encoding="utf-8"))
    found["with_pressure"]["widths"] = _widths(ratios)
    found["provenance"] |= {
        "seeds of the widths with pressure": seeds,
        "share of all within so many half-widths with pressure": [FAR, TWICE],
        "least width": 1.0,
    }
    out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    print(found["with_pressure"]["widths"])
    for name, values in ratios.items():
        print(name, np.quantile(values, (0.5, 0.9, HELD, 0.98, FAR, 1.0)).round(2))
    return 0


def weights_and_widths(seeds: int, pressure: bool) -> dict[str, dict[str, float]]:
    """Return the weights and the widths, with or without pressure."""
    odds, truths, ratios = training_data(range(TRAINING, TRAINING + seeds), pressure=pressure)
    weights = fitted_weights(odds, truths)
    return {
        "weights": dict(zip(EVIDENCES, weights.round(4).tolist(), strict=True)),
        "widths": _widths(ratios),
    }


def _widths(ratios: dict[str, list[float]]) -> dict[str, float]:
    return {key: round(fitted_width(values), 3) for key, values in ratios.items()}


def training_data(seeds: Sequence[int], *, pressure: bool) -> tuple[Array, NDArray[np.int64], dict[str, list[float]]]:
    """Return log-odds (logs, evidences, 9), true conditions, and errors divided by half-widths for each severity."""
    actuator, library = actuator_of(EhaParameters()), read_library()
    odds: list[Array] = []
    truths: list[int] = []
    ratios = _empty_ratios()
    for weighed, log in _training_logs(seeds):
        record = log.record if pressure else log.record.replace(**{PRESSURE: None})
        board = weigh_evidence(record, actuator, library)
        if weighed:
            odds.append(np.array([board.log_odds[name] for name in EVIDENCES]))
            truths.append(list(CONDITIONS).index(log.condition))
        _add_ratios(ratios, board.fits, log.parameters, actuator)
    return np.array(odds), np.array(truths), ratios


def _training_logs(seeds: Sequence[int]) -> Iterator[tuple[bool, "DrawnLog | OpenLog"]]:
    """Yield each training log, and whether the weights use it."""
    for width, like in POPULATIONS:
        for log in draw_logs(seeds, width=width, like=like):
            yield like, log
    for log in open_logs(len(CONDITIONS) * len(DRIVES) * len(seeds)):
        yield True, log


def _empty_ratios() -> dict[str, list[float]]:
    return {name: [] for name in UNITS if name != "entrained_air"}


def _add_ratios(ratios: dict[str, list[float]], fits: ClassFits, p: EhaParameters, actuator: Actuator) -> None:
    """Add a log's errors divided by half-widths, for each severity."""
    true = severities_at(coordinates_of(p, actuator.rated), actuator)
    for name, one in severities(fits, actuator).items():
        if name in ratios and one.value is not None and one.ci95 is not None:
            reach = one.ci95[1] - one.value if true[name] > one.value else one.value - one.ci95[0]
            ratios[name].append(abs(true[name] - one.value) / max(reach, np.finfo(float).tiny))


class OpenLog(NamedTuple):
    """A log of the open benchmark: the truth and the record."""

    condition: str
    parameters: EhaParameters
    record: Record


def open_logs(count: int) -> Iterator[OpenLog]:
    """Yield the first plain logs of the open benchmark's training split, read as a user would read them."""
    with tempfile.TemporaryDirectory() as folder:
        truth = write_set("plain", "training", count, Path(folder))
        for row in rows_of(read_truth(truth.parent)):
            known = {name: float(row[column]) for name, column in COEFFICIENTS.items()}
            record = hydrostate.read(truth.parent / row["file"]).record
            yield OpenLog(row["condition"], replace(EhaParameters(), **known), record)


def fitted_width(ratios: Sequence[float]) -> float:
    """Return the factor that stretches an interval to its coverage; populations follow in order, of equal length.

    No interval becomes narrower than its own theory says: a few hundred logs do not show how rare a large error is.
    """
    first = ratios[: len(ratios) // (len(POPULATIONS) + 1)]
    far = float(np.quantile(ratios, FAR)) / TWICE
    return max(1.0, float(np.quantile(ratios, HELD)), float(np.quantile(first, HELD_ALIKE)), far)


def fitted_weights(odds: Array, truths: NDArray[np.int64]) -> Array:
    """Return the non-negative weights that make the true conditions most probable."""

    def loss(weights: Array) -> tuple[float, Array]:
        total = np.einsum("e,lec->lc", weights, odds)
        shares = np.exp(total - total.max(axis=1, keepdims=True))
        shares /= shares.sum(axis=1, keepdims=True)
        rows = np.arange(len(truths))
        value = -float(np.mean(np.log(np.maximum(shares[rows, truths], 1e-300))))
        slope = np.mean(np.einsum("lc,lec->le", shares, odds) - odds[rows, :, truths], axis=0)
        return value + RIDGE * float(weights @ weights), slope + 2.0 * RIDGE * weights

    start = np.full(odds.shape[1], 0.1)
    return minimize(loss, start, jac=True, bounds=[(0.0, None)] * len(start), method="L-BFGS-B").x
