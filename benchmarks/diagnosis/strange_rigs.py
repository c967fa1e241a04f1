"""Both verbs on strange logs of rigs that are not the paper's: kinds of the open benchmark in sizes of the rig.

The rigs are typed ones and random ones, their files right but where the kind says otherwise. What a kind of the open
benchmark adds in SI units of the paper's rig, as a bar or a kilonewton, is added here in parts of the rig's own relief
pressure, rated speed, stroke and force. A line a log, and what is right of all.
"""

import argparse
import time
import warnings
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from benchmarks.diagnosis.random_rigs import line_of, row_of, summarised
from benchmarks.diagnosis.rig_draws import SAMPLE_TIMES, draw_rig, file_of
from benchmarks.diagnosis.typed_rigs import FILES, USES, Use, plain_setup, table_of
from benchmarks.targets import printed
from experiments.open_benchmark.drives import OPEN
from experiments.open_benchmark.judge import named
from experiments.open_benchmark.kind import MAYBE, OWN, UNKNOWN, Draw, Kind
from experiments.open_benchmark.kinds import KINDS
from experiments.open_benchmark.logger import POSITION, PRESSURES, SPEED, VELOCITY
from experiments.open_benchmark.oil import stiffness
from experiments.open_benchmark.setup import Setup
from experiments.running.random_streams import stream
from faults.conditions import CONDITIONS, parameters_for
from hydrostate import read
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig, read_rig
from plant.eha.scales import natural_frequency
from plant.errors import HydrostateError, LogWarning

RIGS = (*USES, "random 1780", "random 1781", "random 1782", "random 1783", "random 1784", "random 1785")
"""Typed rigs by name, and random ones by their seed."""

SAMPLED = (*SAMPLE_TIMES, 5e-3)
"""Times between samples that loggers offer [s]; the slowest that sees a period of the ring six times is the limit."""


def _either(low: float, high: float, rng: np.random.Generator) -> float:
    """Return a number between two, of either sign."""
    return float(rng.choice((-1.0, 1.0)) * rng.uniform(low, high))


def _pressure(name: str, low: float, high: float) -> Draw:
    """Return a draw of an error of pressure, between two shares of what opens the relief valve."""
    return lambda s, rng: s.with_sensor(PRESSURES, **{name: abs(_either(low, high, rng)) * s.machine.relief})


def _force(s: Setup) -> float:
    return s.machine.relief * min(s.machine.area_a, s.machine.area_b)


def _major(s: Setup, share: float = 1.0) -> float:
    """Return a share of what major leakage adds, which an actuator has for its own size [m^3/(s Pa)]."""
    return share * MAJOR * s.rated_speed * s.machine.displacement / s.machine.relief


def _coarse(s: Setup, _: np.random.Generator) -> Setup:
    position = s.with_sensor((POSITION,), quantum=s.machine.stroke / 2**16)
    return position.with_sensor(PRESSURES, quantum=2.0 * s.machine.relief / 2**12)


MAJOR = 0.1
"""Major leakage at the relief pressure, over the rated flow; replaced by the rig's own below."""

SIZED: Mapping[str, Draw] = {
    "pressure_1_bar_off": _pressure("offset", 0.005, 0.03),
    "pressure_offset_drifts": _pressure("drift", 0.01, 0.06),
    "pressure_hums": _pressure("hum", 0.003, 0.015),
    "speed_offset": lambda s, rng: s.with_sensor((SPEED,), offset=_either(0.001, 0.02, rng) * s.rated_speed),
    "position_has_play": lambda s, rng: s.with_sensor((POSITION,), play=rng.uniform(1e-4, 4e-4) * s.machine.stroke),
    "coarse_converters": _coarse,
    "stiff_oil": lambda s, rng: s.with_machine(bulk_modulus=rng.uniform(1.4, 2.0) * s.machine.bulk_modulus),
    "soft_oil": lambda s, rng: s.with_machine(bulk_modulus=rng.uniform(0.25, 0.5) * s.machine.bulk_modulus),
    "makeup_check_leaks": lambda s, rng: s.with_machine(seat_leak_a=_major(s, rng.uniform(0.5, 2.0))),
    "constant_load": lambda s, rng: s.with_machine(load=s.machine.load + _either(0.08, 0.25, rng) * _force(s)),
    "spring_load": lambda s, rng: s.with_machine(
        spring=s.machine.spring + rng.uniform(0.1, 0.3) * _force(s) / (0.5 * s.machine.stroke)
    ),
}
"""Draws in the rig's own size in place of those in the paper's."""

AS_THEY_ARE = (
    *("plain", "no_velocity", "chamber_pressures", "clock_jitters", "begins_in_motion", "clock_stalls"),
    *("pressure_lags_2_ms", "pressure_5_ms_late", "pressure_gain_3_percent_high", "pressure_gain_20_percent_high"),
    *("pressure_held", "pressure_averaged", "position_held", "position_zero_at_stop", "speed_held", "held_apart"),
    *("speed_sign_reversed", "speed_in_rpm", "pressure_reversed", "position_velocity_swapped"),
    *("rig_volume_25_percent_low", "rig_area_4_percent_high", "rig_mass_half_of_true", "pump_ripples"),
    *("worn_pump", "makeup_check_stuck_shut", "relief_set_low", "intermittent_friction", "entrained_air"),
    *("air_midway", "leakage_grows", "leakage_sets_in", "oil_warms", "pressure_gauges_differ"),
)
"""Kinds of the open benchmark whose draws hold for a rig of any size."""


def _frozen(channel: str, begin: float, end: float) -> Any:
    def change(table: pd.DataFrame, _: np.random.Generator) -> pd.DataFrame:
        a, b = int(begin * len(table)), int(end * len(table))
        table.loc[a:b, channel] = table.loc[a, channel]
        return table

    return change


def _lost(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    return table[rng.random(len(table)) > 0.02].reset_index(drop=True)


def _repeated(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    rows = np.flatnonzero(rng.random(len(table)) < 0.02)
    names = [name for name in table if name != "time_s"]
    table.loc[rows[rows > 0], names] = table.loc[rows[rows > 0] - 1, names].to_numpy()
    return table


def _in_unit(channel: str, factor: float) -> Any:
    def change(table: pd.DataFrame, _: np.random.Generator) -> pd.DataFrame:
        table[channel] *= factor
        return table

    return change


DP = PRESSURES[0]

TABLES: Mapping[str, tuple[Any, Kind]] = {
    "rows_lost": (_lost, Kind("rows_lost", "2 % of the rows are lost")),
    "rows_repeated": (_repeated, Kind("rows_repeated", "2 % of the rows repeat the one before", accept=MAYBE)),
    "encoder_freezes": (_frozen(POSITION, 0.4, 0.6), Kind("encoder_freezes", "", accept=MAYBE, named=r"fr[eo]ze|dead|stays")),
    "pressure_freezes": (_frozen(DP, 0.5, 1.0), Kind("pressure_freezes", "", accept=MAYBE, named=r"fr[eo]ze|dead|stays")),
    "speed_freezes": (_frozen(SPEED, 0.3, 0.5), Kind("speed_freezes", "", accept=MAYBE, named=r"fr[eo]ze|dead|stays")),
    "pressure_in_bar": (_in_unit(DP, 1e-5), Kind("pressure_in_bar", "", accept=(UNKNOWN,), named=r"\bbar\b")),
    "pressure_in_psi": (_in_unit(DP, 1 / 6894.76), Kind("pressure_in_psi", "", accept=(UNKNOWN,), named=r"\bpsi\b")),
    "position_in_mm": (_in_unit(POSITION, 1e3), Kind("position_in_mm", "", accept=(UNKNOWN,), named=r"\bmm\b")),
    "velocity_reversed": (_in_unit(VELOCITY, -1.0), Kind("velocity_reversed", "", accept=MAYBE, named=r"sign|revers|other way|velocity")),
    "position_reversed": (_in_unit(POSITION, -1.0), Kind("position_reversed", "", accept=(UNKNOWN,), named=r"sign|revers|other way|opposite")),
}

STRANGE: Mapping[str, Kind] = {
    **{name: KINDS[name] for name in AS_THEY_ARE},
    **{name: replace(KINDS[name], draw=draw) for name, draw in SIZED.items()},
    **{name: kind for name, (_, kind) in TABLES.items()},
}


def rig_of(name: str) -> tuple[EhaParameters, Use]:
    """Return what the right rig file says, and how the rig is used."""
    if name in USES:
        return read_rig(FILES / f"{name}.toml").parameters, USES[name]
    drawn = draw_rig(stream(int(name.split()[1]), "strange rigs"))
    return file_of(drawn), Use((*OPEN, "track", "posn"), 1e-3, drawn.accumulator_gas)


def made(rig: str, kind: str, seed: int) -> tuple[Setup, pd.DataFrame, dict[str, Any], EhaParameters]:
    one, (healthy, use) = STRANGE[kind], rig_of(rig)
    rng = stream(seed, "strange rigs", rig, kind)
    slowest = max(1.0 / (6.0 * natural_frequency(healthy)), SAMPLED[0])
    use = replace(use, sample_time=float(rng.choice([some for some in SAMPLED if some <= slowest])))
    drives = one.drives if one.drives != tuple(OPEN) else (*use.drives, *OPEN)
    use = replace(use, drives=drives)
    condition = str(rng.choice(one.conditions))
    setup = plain_setup(healthy, use, condition, int(rng.integers(99)), rng)
    setup = replace(setup, duration=6.0)
    major = parameters_for(CONDITIONS["major_leakage"], healthy).leakage_coefficient
    global MAJOR
    MAJOR = major * healthy.relief_pressure / (healthy.rated_speed * healthy.pump_displacement)
    if kind == "leakage_grows":
        setup = setup.with_change(wear=major / setup.machine.leakage)
    elif kind == "leakage_sets_in":
        setup = setup.with_change(late_wear=major / setup.machine.leakage, late_from=rng.uniform(0.3, 0.7))
    else:
        setup = one.draw(setup, rng)
    table = table_of(setup, rng)
    if kind in TABLES:
        table = TABLES[kind][0](table, rng)
    m, air = setup.machine, setup.change.air + setup.change.late_air
    low = stiffness(m.supply, air, m) if air > 0.0 else m.bulk_modulus
    truth = {"bulk_modulus": m.bulk_modulus, "beta_lo": low, "beta_hi": m.bulk_modulus, "condition": condition}
    truth |= {"accept": ";".join(one.accepted(condition)), "named": one.named}
    return setup, table, truth, healthy


def scored(rig: str, kind: str, seed: int) -> dict[str, Any]:
    setup, table, truth, healthy = made(rig, kind, seed)
    about = f"{kind} {rig}; {setup.condition}; {setup.drive}, {1e3 * setup.logger.sample_time:g} ms"
    began = time.process_time()
    try:
        log = read(table, rig=Rig(rig, healthy))
    except HydrostateError as error:
        return {"seed": seed, "kind": kind, "rig": rig, "about": about, "refused": str(error), "seconds": 0.0}
    row = row_of(log, truth, pressure=True)
    return {"seed": seed, "kind": kind, "rig": rig, "about": about, **row, "seconds": time.process_time() - began}
