"""The logs on which two commits are compared: collected once into a folder, so that both see the same files.

Foreign logs are copied from ``$HYDROSTATE_SHARED`` (default ``../shared``), ours are simulated by the base commit with
fixed seeds, and the hostile ones are a short log of ours, spoilt.
"""

import os
import shutil
from collections.abc import Callable, Mapping
from itertools import cycle
from pathlib import Path
from zlib import crc32

import numpy as np
import pandas as pd

TIME, SPEED, POSITION, VELOCITY = "time_s", "motor_speed_rad_s", "position_m", "velocity_m_s"
PRESSURE = "differential_pressure_pa"

CONDITIONS = (
    "normal",
    "minor_leakage",
    "major_leakage",
    "minor_friction",
    "major_friction",
    "minor_leakage_minor_friction",
    "major_leakage_minor_friction",
    "minor_leakage_major_friction",
    "major_leakage_major_friction",
)

ONE_KHZ = ("--sample-time", "1e-3")
SHORT = (*ONE_KHZ, "--duration", "4")

SPECIAL: Mapping[str, tuple[str, ...]] = {
    "paper_lumped_steps.csv": (*ONE_KHZ, "--sensors", "paper", "--condition", "minor_leakage"),
    "paper_lumped_sine.csv": (*ONE_KHZ, "--sensors", "paper", "--drive", "sine"),
    "paper_circuit_prbs.csv": (
        *(*ONE_KHZ, "--sensors", "paper", "--plant", "circuit"),
        *("--drive", "prbs", "--condition", "major_friction"),
    ),
    "ideal_lumped.csv": (*SHORT, "--sensors", "ideal"),
    "reduced_sine.csv": (*SHORT, "--plant", "reduced", "--drive", "sine"),
    "severities.csv": (*ONE_KHZ, "--leakage-severity", "0.5", "--friction-severity", "1.5"),
    "ten_khz.csv": ("--duration", "3", "--condition", "major_leakage", "--drive", "prbs"),
    "parquet.parquet": (*SHORT, "--condition", "minor_friction"),
    "mat.mat": (*SHORT, "--plant", "circuit", "--condition", "normal"),
    "short.csv": (*SHORT, "--plant", "circuit", "--condition", "minor_leakage"),
}
"""Logs of the electro-hydrostatic actuator beside the nine conditions; of the last the hostile ones are made."""

STACK_RUNS: Mapping[str, tuple[str, ...]] = {
    "healthy.csv": (),
    "normal.csv": (),
    "minor_leakage.csv": ("--condition", "minor_leakage"),
    "minor_friction.csv": ("--condition", "minor_friction"),
    "major_both.csv": ("--condition", "major_leakage_major_friction"),
    "air_doubled.csv": ("--fault", "air_doubled"),
    "chamber_leakage.csv": ("--fault", "chamber_leakage_major"),
    "outlet_reed_soft.csv": ("--fault", "outlet_reed_soft"),
    "inlet_reed_jammed.csv": ("--fault", "inlet_reed_jammed"),
    "depolarised.csv": ("--fault", "depolarised_10_percent"),
    "loaded.csv": ("--load", "10", "--bias-pressure", "1.2e6", "--condition", "minor_leakage"),
    "slow.csv": ("--frequency", "100", "--voltage", "100"),
}

MOTOR_RUNS: Mapping[str, tuple[str, ...]] = {
    "healthy.csv": (),
    "normal.csv": (),
    "valve_4_leak.csv": ("--fault", "valve_4_leak=0.1"),
    "valve_2_blocked.csv": ("--fault", "valve_2_blocked=0.6"),
    "diaphragm_3_depolarised.csv": ("--fault", "diaphragm_3_depolarised=0.4"),
    "electrode_5_gain.csv": ("--fault", "electrode_5_gain=0.2"),
    "chamber_6_gas.csv": ("--fault", "chamber_6_gas=0.02"),
    "soft_clamp.csv": ("--fault", "soft_clamp=0.2"),
    "cylinder_leakage.csv": ("--fault", "cylinder_leakage=1e-11"),
    "friction.csv": ("--fault", "friction=9"),
    "loaded.csv": ("--load", "10"),
    "slow.csv": ("--frequency", "400", "--voltage", "150", "--duration", "0.15"),
}

Simulate = Callable[[list[str]], None]
"""Runs the base commit's `simulate` with these arguments."""


def simulated() -> dict[str, tuple[str, ...]]:
    """Return the arguments of `simulate` by the log's place in the folder, seeds included."""
    made: dict[str, tuple[str, ...]] = {}
    drives = cycle(("steps", "prbs", "multisine", "sine", "chirp"))
    for plant, sensors in (("lumped", cycle(("bench", "bench", "rig"))), ("circuit", cycle(("rig", "bench", "bench")))):
        for condition, drive, sensor in zip(CONDITIONS, drives, sensors, strict=False):
            options = ("--plant", plant, "--condition", condition, "--drive", drive, "--sensors", sensor)
            made[f"ours/{plant}_{condition}.csv"] = (*ONE_KHZ, *options)
    made |= {f"ours/{name}": options for name, options in SPECIAL.items()}
    made |= {f"stack/{name}": ("--plant", "piezo-stack", *options) for name, options in STACK_RUNS.items()}
    made |= {f"motor/{name}": ("--plant", "diaphragm-motor", *options) for name, options in MOTOR_RUNS.items()}
    return {name: (*options, "--seed", str(crc32(name.encode()) % 10_000)) for name, options in made.items()}


def collect(folder: Path, simulate: Simulate) -> None:
    """Write every log that is not there yet.

    Parameters
    ----------
    folder : Path
        Where to.
    simulate : callable
        Runs the base commit's `simulate` with the arguments given.
    """
    shared = Path(os.environ.get("HYDROSTATE_SHARED", "../shared"))
    for name, copy in (("bench", _copy_bench), ("strange", _copy_strange)):
        if (folder / name).exists():
            continue
        if not (shared / name).exists():
            print(f"left out: no {name} logs in {shared} (HYDROSTATE_SHARED)")
            continue
        copy(shared / name, _emptied(folder / f"{name}.part"))
        (folder / f"{name}.part").rename(folder / name)
    for name, options in simulated().items():
        if not (folder / name).exists():
            print(f"simulating {name}", flush=True)
            simulate([*options, "--out", str(folder / name)])
    if not (folder / "hostile").exists():
        write_hostile(folder / "ours" / "short.csv", _emptied(folder / "hostile.part"))
        (folder / "hostile.part").rename(folder / "hostile")


def _emptied(folder: Path) -> Path:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def _copy_bench(source: Path, folder: Path) -> None:
    for log in sorted(source.glob("run*.csv")):
        shutil.copyfile(log, folder / log.name)


def _copy_strange(source: Path, folder: Path) -> None:
    """Copy the first log of every set with its rig file and its row of the truth."""
    for truth in sorted(source.glob("*/truth.csv")):
        first = pd.read_csv(truth, dtype=str, keep_default_na=False).head(1)
        rig = first["rig"].iloc[0] if "rig" in first else ""
        place = folder / truth.parent.name
        place.mkdir()
        first.to_csv(place / "truth.csv", index=False)
        for name in (first["file"].iloc[0], rig):
            if name:
                shutil.copyfile(truth.parent / name, place / name)


def write_hostile(source: Path, folder: Path) -> None:
    """Write logs that no reader expects, from a good one.

    Parameters
    ----------
    source : Path
        A good log with differential pressure.
    folder : Path
        Where to.
    """
    good = pd.read_csv(source)[[TIME, SPEED, POSITION, VELOCITY, PRESSURE]]
    frames = {**_incomplete(good), **_badly_timed(good), **_badly_measured(good), **_misnamed(good)}
    for name, frame in frames.items():
        frame.to_csv(folder / f"{name}.csv", index=False)
    text = good.to_csv(index=False)
    lines = text.splitlines()
    words = [*lines[:500], "0.4990,sensor fault,#N/A,--,1.0", *lines[501:]]
    (folder / "good.csv").write_text(text, encoding="utf-8")
    (folder / "empty.csv").write_text("", encoding="utf-8")
    (folder / "words.csv").write_text("\n".join(words), encoding="utf-8")
    (folder / "cut_short.csv").write_text(text[: len(text) // 2], encoding="utf-8")
    (folder / "semicolons.csv").write_text(text.replace(",", ";"), encoding="utf-8")
    (folder / "decimal_commas.csv").write_text(text.replace(",", ";").replace(".", ","), encoding="utf-8")
    (folder / "no_suffix").write_text(text, encoding="utf-8")
    junk = np.random.default_rng(1).bytes(5000)
    for name in ("junk.csv", "junk.parquet", "junk.mat", "junk.csv.gz"):
        (folder / name).write_bytes(junk)
    (folder / "directory.csv").mkdir()
    (folder / "rig_words.toml").write_text('[parameters]\npiston_area = "wide"\n', encoding="utf-8")
    (folder / "rig_broken.toml").write_text("piston_area = = 1\n", encoding="utf-8")


def _incomplete(good: pd.DataFrame) -> dict[str, pd.DataFrame]:
    half = len(good) // 2
    late = good.index >= half
    hole = (good.index // 100 % 5 == 3) & late
    return {
        "header_only": good.head(0),
        "one_row": good.head(1),
        "two_rows": good.head(2),
        "fifty_rows": good.head(50),
        "no_time": good.drop(columns=TIME),
        "no_speed": good.drop(columns=SPEED),
        "no_motion": good.drop(columns=[POSITION, VELOCITY]),
        "no_position": good.drop(columns=POSITION),
        "no_velocity": good.drop(columns=VELOCITY),
        "nan_speed": good.assign(**{SPEED: np.nan}),
        "nan_position": good.assign(**{POSITION: np.nan}),
        "nan_pressure": good.assign(**{PRESSURE: np.nan}),
        "nan_gaps": good.assign(**{name: good[name].mask(hole) for name in (POSITION, PRESSURE)}),
        "gaps": good[~hole],
        "few_gaps": good[good.index % 200 < 195],
    }


def _badly_timed(good: pd.DataFrame) -> dict[str, pd.DataFrame]:
    half = len(good) // 2
    repeated = np.where(good.index % 100 == 0, 2, 1)
    return {
        "time_back": good.iloc[[*range(half), *range(half - 300, len(good))]],
        "time_reversed": good[::-1],
        "time_since_1970": good.assign(**{TIME: good[TIME] + 1.7e9}),
        "duplicate_stamps": good.loc[good.index.repeat(repeated)],
        "two_rates": pd.concat([good[:half], good[half::4]]),
    }


def _badly_measured(good: pd.DataFrame) -> dict[str, pd.DataFrame]:
    half = len(good) // 2
    wild = good.copy()
    for place, name in enumerate((SPEED, POSITION, VELOCITY, PRESSURE)):
        wild.loc[np.random.default_rng(place).choice(len(good), 20, replace=False), name] *= 100.0
    frozen = {
        f"frozen_{name.split('_')[0]}": good.assign(
            **{name: good[name].where(good.index < half, good[name].iloc[half])}
        )
        for name in (SPEED, POSITION, VELOCITY, PRESSURE)
    }
    return {
        "outliers": wild,
        "infinite": good.assign(**{VELOCITY: good[VELOCITY].where(good.index != half, np.inf)}),
        "constant": good.assign(**{name: good[name].iloc[half] for name in good.columns if name != TIME}),
        "constant_speed": good.assign(**{SPEED: 100.0}),
        "constant_pressure": good.assign(**{PRESSURE: 1e5}),
        "zero": good.assign(**{name: 0.0 for name in good.columns if name != TIME}),
        **frozen,
    }


def _misnamed(good: pd.DataFrame) -> dict[str, pd.DataFrame]:
    return {
        "swapped": good.rename(columns={POSITION: VELOCITY, VELOCITY: POSITION}),
        "speed_in_rpm": good.assign(**{SPEED: good[SPEED] * 30.0 / np.pi}),
        "pressure_in_bar": good.assign(**{PRESSURE: good[PRESSURE] * 1e-5}),
        "pressure_reversed": good.assign(**{PRESSURE: -good[PRESSURE]}),
        "position_in_mm": good.assign(**{POSITION: good[POSITION] * 1e3}),
        "other_units": good.assign(position_mm=good[POSITION] * 1e3).drop(columns=POSITION),
        "other_names": good.rename(columns={POSITION: "POS", SPEED: "N"}),
    }
