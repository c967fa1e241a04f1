"""Coverage of 95 % intervals, and whether their width is appropriate, if the rig file is right.

Prints one line for each plant, form and rate: our lumped plant and our circuit in the nine conditions, each under steps
and a binary signal of 10 s with the bench's sensors, and plain logs of the open benchmark's validation split, whose
physics no form here was written for. Every log of our own plants is of another actuator. Its rig is drawn, and the rig
file states it. Leakage, friction, bulk modulus and seals are drawn about its condition, and the rig file does not state
them, so no search begins at the truth. ``z`` is the error divided by its standard deviation, as root mean square: 1 if
intervals are right. Bulk modulus is estimated by the flow form and, where equation 5.8 holds, by the pressure form with
noise tuned to the log; ``--severities`` adds the severities of `diagnose`.
"""

import argparse
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np
import pandas as pd

from benchmarks.targets import Check, keep_figure
from estimation.eha.bulk_modulus import estimate_bulk_modulus
from estimation.finding import NORMAL_95
from experiments.open_benchmark.kinds import make
from experiments.open_benchmark.logger import PLAIN_CHANNELS
from experiments.running.executors import map_in_parallel
from experiments.running.random_streams import stream
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.circuit_runs import coordinates_of
from faults.diagnosis.diagnose import diagnose_log
from faults.diagnosis.severity import severities_at
from faults.eha.inject import varied_actuator
from plant.eha.circuit_parameters import circuit_of
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import CIRCUIT, PLANTS, simulate
from plant.errors import HydrostateError
from plant.log.record import Record
from plant.sensors.sensors import BENCH

HEALTHY = EhaParameters()

OPEN_BENCHMARK = "open benchmark"
"""Name of the plant that is not ours."""

DRIVES = ("steps", "prbs")

RIG_SPREAD = 0.1
"""Half-width of area, displacement, chamber volume and mass, which the rig file states [fraction]."""

SPREAD = 0.2
"""Half-width of leakage, flow bias, friction, bulk modulus and presliding, which it does not state [fraction]."""

DURATION = 10.0
"""Length of a log of our own plants [s]."""

WANTED_COVERAGE = (90.0, 98.0)
"""Required coverage on each line [%]."""

WANTED_Z = (0.8, 1.3)
"""Required root mean square of z on our own plants [dimensionless]."""


@dataclass(frozen=True)
class Case:
    """A log, and the estimate to make from it."""

    plant: str
    form: str
    rate: int
    drive: str
    condition: str
    seed: int


class Log(NamedTuple):
    """The logged record, the true actuator, and the healthy actuator that the rig file describes."""

    record: Record
    true: EhaParameters
    rig: EhaParameters


def draw_log(case: Case) -> Log:
    """Return a log of a randomly drawn actuator."""
    if case.plant == OPEN_BENCHMARK:
        return _foreign_log(case)
    rng = stream(case.seed, "coverage", case.plant, case.drive, case.condition, case.rate)
    known = ("piston_area", "pump_displacement", "chamber_volume", "moving_mass")
    rig = replace(HEALTHY, **{name: getattr(HEALTHY, name) * _factor_near_one(RIG_SPREAD, rng) for name in known})
    faulty = parameters_for(CONDITIONS[case.condition], rig)
    true = varied_actuator(faulty, rng, SPREAD, SPREAD, SPREAD)
    if case.plant == CIRCUIT.name:
        circuit = circuit_of(true)
        true = replace(circuit, presliding_displacement=circuit.presliding_displacement * _factor_near_one(SPREAD, rng))
    drive = make_drive(case.drive, DURATION, 1.0 / case.rate, rig, rng)
    return Log(simulate(PLANTS[case.plant], drive, 1.0 / case.rate, true, sensors=BENCH, rng=rng), true, rig)


def _factor_near_one(width: float, rng: np.random.Generator) -> float:
    return float(rng.uniform(1.0 - width, 1.0 + width))


def _foreign_log(case: Case) -> Log:
    made = make("plain", "validation", case.seed)
    logger = replace(made.setup.logger, sample_time=1.0 / case.rate)
    log = logger.log(made.states, stream(case.seed, "coverage", case.plant, case.rate))
    machine = made.setup.machine
    true = replace(
        HEALTHY,
        leakage_coefficient=machine.leakage,
        flow_bias=machine.flow_bias,
        bulk_modulus=machine.bulk_modulus,
        friction_quadratic=machine.quadratic,
        friction_linear=machine.linear,
        friction_coulomb=machine.coulomb,
    )
    return Log(Record(1.0 / case.rate, {name: log[name].to_numpy() for name in PLAIN_CHANNELS}), true, HEALTHY)


def quantity_rows(case: Case) -> list[dict[str, object]]:
    """Return one row for each quantity of a log: its z, and why it has no usable interval, if so."""
    warnings.simplefilter("ignore")
    log = draw_log(case)
    try:
        found = list(_severities(log) if case.form == "severities" else _bulk_modulus(case, log))
    except HydrostateError as error:
        found = [(case.form, float("nan"), str(error))]
    names = {"plant": case.plant, "form": case.form, "rate": case.rate}
    return [{**names, "quantity": name, "z": z, "refused": refused} for name, z, refused in found]


def _bulk_modulus(case: Case, log: Log) -> Iterator[tuple[str, float, str]]:
    if case.form == "pressure":
        found = estimate_bulk_modulus(log.record, log.true, form="pressure", tuned=True)
    else:
        found = estimate_bulk_modulus(log.record, log.rig)
    if found.value is None or found.std is None:
        yield "bulk_modulus", float("nan"), found.outcome.value
    else:
        yield "bulk_modulus", (found.value - log.true.bulk_modulus) / found.std, "" if found.gate.passed else "gate"


def _severities(log: Log) -> Iterator[tuple[str, float, str]]:
    actuator = actuator_of(log.rig)
    exact = severities_at(coordinates_of(log.true, actuator.rated), actuator)
    found = diagnose_log(log.record, Rig(parameters=log.rig))
    for name, one in found.severities.items():
        if name != "entrained_air" and one.value is not None and one.ci95 is not None:
            low, high = one.ci95
            yield name, NORMAL_95 * (2.0 * exact[name] - low - high) / (low - high), ""


def summarise(rows: pd.DataFrame) -> pd.DataFrame:
    """Return a line for each plant, form, rate and quantity."""
    lines: list[dict[str, object]] = []
    for key, part in rows.groupby(["plant", "form", "rate", "quantity"], sort=False):
        z = part["z"].dropna()
        plant, form, rate, quantity = key
        lines.append(
            {
                "plant": plant,
                "form": form,
                "rate": rate,
                "quantity": quantity,
                "logs": len(part),
                "numbers": len(z),
                "refused": int((part["refused"] != "").sum()),
                "z": float(np.sqrt(np.mean(np.square(z)))),
                "mean_z": float(z.mean()),
                "covered_%": 100.0 * float((z.abs() < NORMAL_95).mean()),
            }
        )
    return pd.DataFrame(lines)


def cases_of(options: argparse.Namespace) -> list[Case]:
    """Return the cases: each log with the estimate to make from it."""
    forms = ["flow", *(["severities"] if options.severities else [])]
    cases: list[Case] = []
    for plant, rate in product(options.plants, options.rates):
        if plant == OPEN_BENCHMARK:
            cases += [Case(plant, form, rate, "", "", seed) for form in forms for seed in range(9 * options.seeds)]
            continue
        # the pressure form is equation 5.8, which describes the lumped plant
        own = [*forms, *(["pressure"] if plant == "lumped" and options.pressure else [])]
        cases += [
            Case(plant, form, rate, DRIVES[seed % len(DRIVES)], condition, seed)
            for form, condition, seed in product(own, CONDITIONS, range(options.seeds))
        ]
    return cases


def main(arguments: list[str]) -> int:
    """Print one line for each plant, form, rate and quantity; return how many miss their target."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=2, help="logs a condition; 20 is the acceptance")
    parser.add_argument("--rates", type=int, nargs="+", default=[1000, 10000], help="samples a second")
    parser.add_argument(
        "--plants",
        nargs="+",
        choices=["lumped", "circuit", OPEN_BENCHMARK],
        default=["lumped", "circuit", OPEN_BENCHMARK],
    )
    parser.add_argument("--pressure", action="store_true", help="also by the pressure form, which takes longer")
    parser.add_argument("--severities", action="store_true", help="also those of a diagnosis")
    parser.add_argument("--rows", help="CSV file for a row a quantity of each log")
    options = parser.parse_args(arguments)
    rows = pd.DataFrame([row for some in map_in_parallel(quantity_rows, cases_of(options)) for row in some])
    if options.rows:
        rows.to_csv(options.rows, index=False)
    table = summarise(rows)
    print(table.to_string(index=False, float_format="%.2f"))
    missed = 0
    for line in table.to_dict("records"):
        which = f"{line['plant']}, {line['form']} form, {line['rate']} Hz, {line['quantity']}"
        keep_figure(Check(f"{which}: coverage [%]", line["covered_%"], *WANTED_COVERAGE))
        fits = WANTED_COVERAGE[0] <= line["covered_%"] <= WANTED_COVERAGE[1]
        if line["plant"] != OPEN_BENCHMARK:
            keep_figure(Check(f"{which}: z", line["z"], *WANTED_Z))
            fits = fits and WANTED_Z[0] <= line["z"] <= WANTED_Z[1]
        missed += not fits
    print(
        f"\noutside {WANTED_COVERAGE[0]:g} to {WANTED_COVERAGE[1]:g} %, or of z on our own plants {WANTED_Z[0]} to "
        f"{WANTED_Z[1]}: {missed}"
    )
    return missed
