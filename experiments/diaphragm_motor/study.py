"""The diaphragm motor's study: every table by name, and how the report shows them."""

from collections.abc import Callable, Mapping
from dataclasses import asdict

import pandas as pd

from experiments.diaphragm_motor import sweeps
from experiments.diaphragm_motor.control import averaged_course, control_runs
from experiments.diaphragm_motor.figures import MOTOR_FIGURES
from experiments.diaphragm_motor.quoted import claimed_speeds, claims_not_reproduced, claims_reproduced, root_efficiency
from experiments.page.frames import parameter_table
from experiments.page.numbers import MINUS, exact_if_short, pretty_unit
from experiments.page.tables import Column, Columns, name_in_words
from experiments.running.progress import Track
from experiments.running.study import SeedSettings, Study, StudyResult
from plant.diaphragm_motor.parameters import ROWS, DiaphragmMotorParameters

CLAIMED: Mapping[str, Callable[[DiaphragmMotorParameters], pd.DataFrame]] = {
    "frequency sweep": sweeps.sweep_frequency,
    "voltage sweep": sweeps.sweep_voltage,
    "load sweep": sweeps.sweep_load,
    "load and frequency": sweeps.best_frequencies,
    "reversal": sweeps.reversal,
}
"""Sweeps and runs with which the paper's claims are compared."""

SWEEPS: Mapping[str, Callable[[DiaphragmMotorParameters], pd.DataFrame]] = {
    **CLAIMED,
    "pump cycle": sweeps.pump_cycle,
    "sensitivity": sweeps.sensitivities,
    "other sets": sweeps.other_sets,
    "averaged": averaged_course,
}


def claim_tables(
    rig: DiaphragmMotorParameters,
    seed: int,
    track: Track,
    made_by: Mapping[str, Callable[[DiaphragmMotorParameters], pd.DataFrame]] = CLAIMED,
) -> dict[str, pd.DataFrame]:
    """Return the sweeps and runs with which the paper's claims are compared, and the result.

    Parameters
    ----------
    made_by : Mapping[str, callable]
        The sweeps by the name of their table; at least those that the claims need.

    Returns
    -------
    dict[str, pandas.DataFrame]
        The sweeps, control, modes, and the claims that hold and those that do not.
    """
    tables = {name: sweep(rig) for name, sweep in track(made_by.items(), description="studies")}
    tables["control courses"], tables["control"] = control_runs(rig, seed)
    tables["dry modes"] = sweeps.dry_modes()
    tables["reproduced"] = claims_reproduced(tables)
    tables["claimed speeds"] = claimed_speeds(rig)
    tables["efficiency by the root of 7"] = root_efficiency(rig, tables["frequency sweep"])
    tables["not reproduced"] = claims_not_reproduced(tables)
    return tables


def _find(settings: SeedSettings, track: Track) -> StudyResult:
    return StudyResult(claim_tables(RIG, settings.seed, track, SWEEPS))


def _seconds(value: float) -> str:
    return "never" if value == float("inf") else f"{value:.2f}"


def _signed_number(value: float) -> str:
    return f"{value:+.1f}".replace("-", MINUS)


def _parameters() -> pd.DataFrame:
    """Return the parameters as text; values given for each chamber or valve are the same for all."""
    table = parameter_table(RIG)
    values = [
        f"{exact_if_short(value[0])}, each of {ROWS[name]}" if isinstance(value, tuple) else exact_if_short(value)
        for name, value in zip(table["parameter"], table["value"], strict=True)
    ]
    return table.assign(value=values)


RIG = DiaphragmMotorParameters()

_CLAIM = ("section", "claim", "published", "ours")
_BLOCKING = Column("blocking_n", "blocking force", digits=3)

COLUMNS: Mapping[str, Columns] = {
    "reproduced": (*_CLAIM, "holds"),
    "not reproduced": (*_CLAIM, "why"),
    "blocking": ("voltage_v", _BLOCKING, Column("velocity_m_s", "velocity without load", digits=3)),
    "control": (
        "run",
        Column("settling_s", "to 2 mm/s", words=_seconds),
        Column("rise_s", "to 3.5 mm/s", words=_seconds),
        Column("recovery_s", "after the load", words=_seconds),
        Column("velocity_m_s", "true velocity", digits=3),
        Column("measured_m_s", "reported velocity", digits=3),
    ),
    "sensitivity": (
        *("part", "change"),
        Column("frequency_hz", "best frequency moves", words=_signed_number),
        Column("flow_percent", "flow changes", words=_signed_number),
    ),
    "dry modes": (
        Column("diameters", "nodal diameters"),
        Column("circles", "nodal circles"),
        Column("root", "λ²"),
        "frequency_hz",
    ),
    "other sets": (
        "set",
        Column("frequency_hz", "best frequency", digits=3),
        Column("flow_m3_s", "peak flow", "ml/min", 6e7),
        Column("blocking_n", "blocking force at 480 Hz", digits=3),
    ),
    "rig": (
        Column("parameter", "name", words=name_in_words),
        "value",
        Column("unit", words=pretty_unit),
        *("meaning", "source"),
    ),
}


def _facts(tables: Mapping[str, pd.DataFrame], _: SeedSettings) -> Mapping[str, pd.DataFrame]:
    loads = tables["load sweep"]
    return {"rig": _parameters(), "blocking": loads[loads["load_n"] == 0.0]}


DIAPHRAGM_MOTOR = Study(
    "diaphragm-motor", "diaphragm_motor/report.html", _find, MOTOR_FIGURES, COLUMNS, asdict(RIG), _facts
)
