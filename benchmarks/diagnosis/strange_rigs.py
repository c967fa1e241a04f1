"""Both verbs on strange logs of rigs other than the paper's: kinds of the open benchmark, scaled to the rig.

The rigs are the typed ones and random ones; their files are right unless a kind says otherwise. The open benchmark adds
disturbances in units of the paper's rig, such as a bar or a kilonewton. Here they are fractions of the rig's relief
pressure, speed, stroke and force. Unit mistakes, frozen sensors and lost rows are introduced into a written log. Each
rig takes the kinds in turn. Prints one line for each log, and summary figures. A relief valve that opens early is left
out: it stays shut in most logs of these rigs.
"""

import argparse
import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from benchmarks.diagnosis.random_rigs import FAILED, print_figures, row_as_text, score_log, score_results
from benchmarks.diagnosis.rig_draws import SAMPLE_TIMES, draw_rig, is_sound, rig_file_of
from benchmarks.diagnosis.typed_rigs import FILES, RIG_USES, RigUse, plain_setup, table_of
from benchmarks.targets import print_and_keep
from experiments.open_benchmark.drives import CLOSED, OPEN
from experiments.open_benchmark.kind import OWN_OR_UNKNOWN, UNKNOWN, Draw, Kind
from experiments.open_benchmark.kinds import KINDS
from experiments.open_benchmark.logger import DIFFERENCE, POSITION, PRESSURES, SPEED
from experiments.open_benchmark.logger_kinds import REVERSED_WORDS, RPM
from experiments.open_benchmark.oil import stiffness
from experiments.open_benchmark.setup import Setup
from experiments.running.random_streams import stream
from faults.conditions import CONDITIONS, parameters_for
from hydrostate import read
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig, read_rig
from plant.eha.scales import natural_frequency
from plant.errors import HydrostateError, LogWarning

RANDOM_PREFIX = "random "
"""Prefix of the names of random rigs, before their seed."""

RIGS = (*RIG_USES, *(f"{RANDOM_PREFIX}{seed}" for seed in (1780, 1783, 1785, 1786, 1791, 1793, 1795, 1797)))

SAMPLE_TIME_CHOICES = (*SAMPLE_TIMES, 5e-3)
"""Sample times that loggers offer [s]; the limit is the slowest with six samples in each period of the resonance."""

DURATION = 6.0
"""Length of a log [s]."""

UNSCALED_KINDS = (
    *("plain", "no_velocity", "chamber_pressures", "clock_jitters", "clock_stalls", "begins_in_motion"),
    *("pressure_lags_2_ms", "pressure_5_ms_late", "pressure_gain_3_percent_high", "pressure_gain_20_percent_high"),
    *("pressure_held", "pressure_averaged", "position_held", "position_zero_at_stop", "speed_held", "held_apart"),
    *("speed_sign_reversed", "speed_in_rpm", "pressure_reversed", "position_velocity_swapped"),
    *("rig_volume_25_percent_low", "rig_area_4_percent_high", "rig_mass_half_of_true", "pump_ripples"),
    *("worn_pump", "makeup_check_stuck_shut", "intermittent_friction", "entrained_air"),
    *("air_midway", "oil_warms", "pressure_gauges_differ"),
)
"""Kinds of the open benchmark whose draws suit a rig of any size."""

Change = Callable[[pd.DataFrame, np.random.Generator], pd.DataFrame]
"""Maps a written log to one with a mistake."""


def _times(channel: str, factor: float) -> Change:
    return lambda table, _: table.assign(**{channel: factor * table[channel]})


def _frozen(channel: str) -> Change:
    """Return a change that freezes a channel from 40 % to 60 % of the log."""

    def change(table: pd.DataFrame, _: np.random.Generator) -> pd.DataFrame:
        first, last = (int(share * len(table)) for share in (0.4, 0.6))
        values = table[channel].to_numpy(copy=True)
        values[first:last] = values[first]
        return table.assign(**{channel: values})

    return change


def _without_some_rows(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    return table[rng.random(len(table)) > 0.02].reset_index(drop=True)


FROZEN_WORDS = r"fr[eo]ze|\bdead\b|\bheld\b"
"""Words for a frozen sensor."""

LOG_MISTAKES: Mapping[str, tuple[Change, Kind]] = {
    "rows_lost": (_without_some_rows, Kind("rows_lost", "2 % of the rows are lost")),
    "position_freezes": (_frozen(POSITION), Kind("", "", accept=OWN_OR_UNKNOWN, named=FROZEN_WORDS)),
    "pressure_freezes": (_frozen(DIFFERENCE), Kind("", "", accept=OWN_OR_UNKNOWN, named=FROZEN_WORDS)),
    "speed_freezes": (_frozen(SPEED), Kind("", "", accept=OWN_OR_UNKNOWN, named=FROZEN_WORDS)),
    "pressure_in_bar": (_times(DIFFERENCE, 1e-5), Kind("", "", accept=(UNKNOWN,), named=r"\bbar\b")),
    "position_in_mm": (_times(POSITION, 1e3), Kind("", "", accept=(UNKNOWN,), named=r"\bmm\b")),
    "position_reversed": (_times(POSITION, -1.0), Kind("", "", accept=(UNKNOWN,), named=REVERSED_WORDS)),
    "speed_in_degrees": (_times(SPEED, 6.0 * RPM), Kind("", "", accept=(UNKNOWN,), named=r"deg/s")),
}
"""Mistakes introduced into a written log, and the right answer for each."""


def _random_signed(low: float, high: float, rng: np.random.Generator) -> float:
    """Return a number between two limits, of random sign."""
    return float(rng.choice((-1.0, 1.0)) * rng.uniform(low, high))


def draws_for_rig(healthy: EhaParameters) -> Mapping[str, Draw]:
    """Return draws of kinds of the open benchmark, scaled to a rig."""
    p, force = healthy, healthy.relief_pressure * healthy.piston_area
    stroke = healthy.stroke or 0.0
    major = parameters_for(CONDITIONS["major_leakage"], healthy).leakage_coefficient

    def pressure(name: str, low: float, high: float) -> Draw:
        return lambda s, rng: s.with_sensor(PRESSURES, **{name: rng.uniform(low, high) * p.relief_pressure})

    def coarse(s: Setup, _: np.random.Generator) -> Setup:
        position = s.with_sensor((POSITION,), quantum=stroke / 2**16)
        return position.with_sensor(PRESSURES, quantum=2.0 * p.relief_pressure / 2**12)

    def sprung(s: Setup, rng: np.random.Generator) -> Setup:
        return s.with_machine(spring=s.machine.spring + rng.uniform(0.2, 0.6) * force / stroke)

    def set_in(s: Setup, rng: np.random.Generator) -> Setup:
        return s.with_change(late_wear=major / s.machine.leakage, late_from=rng.uniform(0.3, 0.7))

    return {
        "pressure_1_bar_off": pressure("offset", 0.005, 0.03),
        "pressure_offset_drifts": pressure("drift", 0.01, 0.06),
        "pressure_hums": pressure("hum", 0.003, 0.015),
        "coarse_converters": coarse,
        "speed_offset": lambda s, rng: s.with_sensor((SPEED,), offset=_random_signed(0.001, 0.02, rng) * p.rated_speed),
        "position_has_play": lambda s, rng: s.with_sensor((POSITION,), play=rng.uniform(1e-4, 4e-4) * stroke),
        "stiff_oil": lambda s, rng: s.with_machine(bulk_modulus=rng.uniform(1.4, 2.0) * p.bulk_modulus),
        "soft_oil": lambda s, rng: s.with_machine(bulk_modulus=rng.uniform(0.25, 0.5) * p.bulk_modulus),
        "constant_load": lambda s, rng: s.with_machine(load=s.machine.load + _random_signed(0.08, 0.25, rng) * force),
        "spring_load": sprung,
        "makeup_check_leaks": lambda s, rng: s.with_machine(seat_leak_a=rng.uniform(0.5, 2.0) * major),
        "leakage_grows": lambda s, _: s.with_change(wear=major / s.machine.leakage),
        "leakage_sets_in": set_in,
    }


NAMES = (*UNSCALED_KINDS, *draws_for_rig(EhaParameters(stroke=0.5)), *LOG_MISTAKES)
"""Every kind by name."""


def rig_of(name: str) -> tuple[EhaParameters, RigUse]:
    """Return the content of a rig's right file, and how the rig is used.

    Parameters
    ----------
    name : str
        Name of a typed rig or of a random one.
    """
    if name in RIG_USES:
        return read_rig(FILES / f"{name}.toml").parameters, RIG_USES[name]
    rng = stream(int(name.removeprefix(RANDOM_PREFIX)), "strange rigs")
    drawn = draw_rig(rng)
    while not is_sound(drawn):
        drawn = draw_rig(rng)
    return rig_file_of(drawn), RigUse((*OPEN, *CLOSED), SAMPLE_TIMES[0], drawn.accumulator_gas)


def draw_strange_log(rig: str, kind: str, seed: int) -> tuple[pd.DataFrame, dict[str, Any], Setup]:
    """Return a strange log of a rig, its truth, and its setup.

    Parameters
    ----------
    rig, kind : str
        One of `RIGS` or any random rig, and one of `NAMES`.
    seed : int
        Seed of the log.

    Returns
    -------
    tuple of (pandas.DataFrame, dict, Setup)
        The log as in its file; the truth as `score_log` takes it; the setup.
    """
    (healthy, use), rng = rig_of(rig), stream(seed, "strange rigs", rig, kind)
    change, one = LOG_MISTAKES.get(kind) or (None, KINDS[kind])
    slowest = max(1.0 / (6.0 * natural_frequency(healthy)), SAMPLE_TIME_CHOICES[0])
    sample_time = float(rng.choice([some for some in SAMPLE_TIME_CHOICES if some <= slowest]))
    drives = one.drives if one.drives != tuple(OPEN) else (*use.drives, *OPEN)
    condition = str(rng.choice(one.conditions))
    use = replace(use, sample_time=sample_time, drives=drives)
    setup = replace(plain_setup(healthy, use, condition, int(rng.integers(99)), rng), duration=DURATION)
    setup = draws_for_rig(healthy).get(kind, one.draw)(setup, rng)
    table = table_of(setup, rng)
    m, air = setup.machine, setup.change.air + setup.change.late_air
    truth = {
        "bulk_modulus": m.bulk_modulus,
        "beta_lo": stiffness(m.supply, air, m) if air > 0.0 else m.bulk_modulus,
        "condition": condition,
        "accept": ";".join(one.right_verdicts(condition)),
        "named": one.named,
    }
    return change(table, rng) if change else table, truth, setup


def score_strange_log(rig: str, kind: str, seed: int) -> dict[str, Any]:
    """Return the results of both verbs for one log, compared with its truth.

    Parameters
    ----------
    rig, kind, seed
        As of `draw_strange_log`.

    Returns
    -------
    dict[str, Any]
        As from `benchmarks.diagnosis.random_rigs.score_rig`.
    """
    (table, truth, setup), began = draw_strange_log(rig, kind, seed), time.process_time()
    try:
        row = score_log(read(table, rig=Rig(rig, rig_of(rig)[0])), truth, pressure=True)
    except HydrostateError as error:
        refused = {**FAILED, "message": str(error)}
        row = score_results(refused, refused, truth)
    about = f"{setup.condition}; {setup.drive}, {1e3 * setup.logger.sample_time:g} ms"
    unnamed = ", not named" if row["named"] is False else ""
    about = f"{kind}{unnamed}; {rig}; {about}"
    return {"seed": seed, "about": about, **row, "seconds": time.process_time() - began}


def main(arguments: list[str]) -> int:
    """Print one line for each log, and every figure with its target; return how many fall short."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", default="0:2", metavar="A:B", help="first and last seed of each rig")
    parser.add_argument("--rigs", default=",".join(RIGS), metavar="NAME,NAME")
    parser.add_argument("--kinds", default=",".join(NAMES), metavar="NAME,NAME")
    options = parser.parse_args(arguments)
    first, _, last = options.seeds.partition(":")
    rigs, kinds = options.rigs.split(","), options.kinds.split(",")
    warnings.simplefilter("ignore", LogWarning)
    rows: list[dict[str, Any]] = []
    for seed in range(int(first), int(last or first) + 1):
        for place, rig in enumerate(rigs):
            rows.append(score_strange_log(rig, kinds[(seed + place) % len(kinds)], seed))
            print(row_as_text(rows[-1]), flush=True)
    # for many kinds, "unknown" is the right verdict
    judged = [{**row, "verdict": "right"} if row["right"] else row for row in rows]
    checks = print_and_keep(print_figures(judged, wrong=True))
    told = [row["named"] for row in rows if row["named"] is not None]
    print(f"causes named: {sum(told)} of {len(told)}")
    return sum(not check.met for check in checks)


if __name__ == "__main__":
    import sys

    sys.exit(main(sys.argv[1:]))
