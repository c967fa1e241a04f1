"""The calls of the command that are compared: which verb, with which options, on which logs."""

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

UNREADABLE = (
    *("empty.csv", "header_only.csv", "words.csv", "no_suffix", "junk.csv", "junk.parquet", "junk.mat", "junk.csv.gz"),
    *("directory.csv", "absent.csv", "no_time.csv", "no_speed.csv", "no_motion.csv", "one_row.csv", "two_rows.csv"),
    *("fifty_rows.csv", "nan_speed.csv", "other_names.csv", "time_back.csv", "constant.csv", "no_velocity.csv"),
)
"""Hostile logs that `identify` is shown, nearly all unreadable: a readable one takes it seconds."""

FEW = {"stack": ("minor_leakage", "air_doubled"), "motor": ("valve_4_leak", "cylinder_leakage")}
"""Logs of the other plants that are judged beside a healthy run."""


@dataclass(frozen=True)
class Call:
    """One call of the command.

    Parameters
    ----------
    name : str
        What the results are kept under.
    verb : str
        The verb.
    logs : tuple of str
        The logs' places in the folder of logs.
    options : tuple of str
        Options; ``{logs}`` stands for the folder of logs.
    """

    name: str
    verb: str
    logs: tuple[str, ...]
    options: tuple[str, ...] = ()

    def arguments(self, folder: Path) -> list[str]:
        """Return the command line after the program's name."""
        options = [option.replace("{logs}", str(folder)) for option in self.options]
        return [self.verb, *options, "--json", *(str(folder / log) for log in self.logs)]

    def files(self, folder: Path) -> list[Path]:
        """Return every file that the call may read."""
        named = [option.removeprefix("{logs}/") for option in self.options if option.startswith("{logs}/")]
        logs = [folder / name for name in (*self.logs, *named)]
        return [*logs, *(log.with_name(f"{log.name}.json") for log in logs)]


def calls(folder: Path) -> list[Call]:
    """Return every call on the logs of a folder.

    Parameters
    ----------
    folder : Path
        Where `benchmarks.same_numbers.same_numbers_logs.collect` wrote them.

    Returns
    -------
    list[Call]
        The calls, by verb; those on few logs come first, for the first compile what the others use.
    """
    found = [*_foreign(folder), *_ours(folder), *_filters(), *_identified(folder), *_other_plants(folder)]
    return sorted([*found, *_hostile(folder)], key=lambda call: (call.verb, len(call.logs)))


def _within(folder: Path, group: str) -> tuple[str, ...]:
    """Return the logs of a group, without what stands beside them."""
    logs = (path for path in sorted((folder / group).glob("*")) if path.suffix not in (".json", ".toml"))
    return tuple(f"{group}/{path.name}" for path in logs)


def _foreign(folder: Path) -> Iterator[Call]:
    bench, strange = _within(folder, "bench"), defaultdict[tuple[str, ...], list[str]](list)
    for truth in sorted((folder / "strange").glob("*/truth.csv")):
        row = pd.read_csv(truth, dtype=str, keep_default_na=False).iloc[0]
        place = f"strange/{truth.parent.name}"
        rig = ("--rig", f"{{logs}}/{place}/{row['rig']}") if row.get("rig") else ()
        columns = ("--columns", row["columns"]) if row.get("columns") else ()
        strange[*rig, *columns].append(f"{place}/{row['file']}")
    for verb in ("estimate", "diagnose"):
        if bench:
            yield Call(f"{verb}/bench", verb, bench)
            yield Call(f"{verb}/bench_no_pressure", verb, bench[:4], ("--no-pressure",))
        for options, logs in strange.items():
            name = logs[0].split("/")[1] if options else "strange"
            yield Call(f"{verb}/{name}", verb, tuple(logs), options)


def _ours(folder: Path) -> Iterator[Call]:
    ours = _within(folder, "ours")
    some = _named("ours", "circuit_major_leakage_minor_friction", "lumped_minor_leakage")
    for verb in ("estimate", "diagnose"):
        yield Call(f"{verb}/ours", verb, ours)
        yield Call(
            f"{verb}/ours_no_pressure", verb, _named("ours", "ideal_lumped", "lumped_normal"), ("--no-pressure",)
        )
        yield Call(f"{verb}/condition_told", verb, some, ("--condition", "minor_leakage"))
    yield Call("diagnose/scores", "diagnose", some, ("--scores",))


def _filters() -> Iterator[Call]:
    short, long = _named("ours", "short"), _named("ours", "circuit_normal", "lumped_major_leakage")
    for name, options in {
        "ekf": ("--method", "ekf"),
        "ukf": ("--method", "ukf"),
        "svsf": ("--method", "svsf"),
        "smooth": ("--smooth",),
        "robust": ("--method", "ekf", "--robust", "student-t"),
        "flow_ekf": ("--form", "flow", "--method", "ekf"),
        "acceleration": ("--form", "acceleration"),
        "states": ("--states", "leakage,friction"),
        "states_leakage": ("--states", "leakage"),
        "sensors": ("--sensors", "position,dp"),
        "start": ("--form", "pressure", "--start", "5e7", "--start-std", "1e8"),
    }.items():
        yield Call(f"estimate/{name}", "estimate", (*short, *long), options)
    yield Call("estimate/tuned", "estimate", short, ("--form", "pressure", "--no-pressure", "--tune"))
    yield Call("estimate/no_such_method", "estimate", short, ("--method", "guess"))


def _identified(folder: Path) -> Iterator[Call]:
    ours = _named("ours", "lumped_minor_leakage", "circuit_normal", "circuit_major_friction", "short")
    yield Call("identify/ours", "identify", (*ours, *_within(folder, "bench")[:2]))
    yield Call("identify/order_auto", "identify", (ours[0], ours[-1]), ("--order", "auto"))
    yield Call("identify/arx", "identify", (ours[0], ours[-1]), ("--structure", "arx", "--delay", "1"))
    yield Call("identify/hostile", "identify", tuple(f"hostile/{name}" for name in UNREADABLE))


def _other_plants(folder: Path) -> Iterator[Call]:
    for group, plant in (("stack", "piezo-stack"), ("motor", "diaphragm-motor")):
        logs = tuple(log for log in _within(folder, group) if not log.endswith("/loaded.csv"))
        loaded = ("--plant", plant, "--load", "10", *(("--bias-pressure", "1.2e6") if group == "stack" else ()))
        calibrated = ("--plant", plant, "--healthy", f"{{logs}}/{group}/healthy.csv")
        bad = ("hostile/good.csv", "hostile/empty.csv", f"{group}/normal.csv")
        for verb in ("estimate", "diagnose"):
            yield Call(f"{verb}/{group}", verb, logs, ("--plant", plant))
            yield Call(f"{verb}/{group}_loaded", verb, _named(group, "loaded"), loaded)
            yield Call(f"{verb}/{group}_calibrated", verb, _named(group, *FEW[group]), calibrated)
            yield Call(f"{verb}/{group}_bad", verb, bad, ("--plant", plant))
    sensors = ("--plant", "piezo-stack", "--sensors", "position,force")
    yield Call("estimate/stack_sensors", "estimate", _named("stack", "normal", "minor_leakage"), sensors)


def _hostile(folder: Path) -> Iterator[Call]:
    good, bad = "hostile/good.csv", "hostile/words.csv"
    mapped = "position_m=POS,motor_speed_rad_s=N"
    for verb in ("estimate", "diagnose"):
        yield Call(f"{verb}/hostile", verb, (*_within(folder, "hostile"), "hostile/absent.csv"))
        yield Call(f"{verb}/one_bad_of_two", verb, (bad, good))
        yield Call(f"{verb}/bad_alone", verb, (bad,))
        yield Call(f"{verb}/columns", verb, ("hostile/other_names.csv",), ("--columns", mapped))
        yield Call(f"{verb}/columns_absent", verb, (good,), ("--columns", mapped))
        yield Call(f"{verb}/rig_words", verb, (good,), ("--rig", "{logs}/hostile/rig_words.toml"))
    for rig in ("rig_broken", "rig_absent"):
        yield Call(f"estimate/{rig}", "estimate", (good,), ("--rig", f"{{logs}}/hostile/{rig}.toml"))
    for name, columns in (("unit", "position_m=position_m:furlong_per_pascal"), ("nonsense", "nonsense")):
        yield Call(f"diagnose/columns_{name}", "diagnose", (good,), ("--columns", columns))


def _named(group: str, *names: str) -> tuple[str, ...]:
    return tuple(f"{group}/{name}.csv" for name in names)


def cells(wanted: Iterable[Call]) -> tuple[int, int]:
    """Return how many logs there are, and how many pairs of a call and a log."""
    logs = [log for call in wanted for log in call.logs]
    return len(set(logs)), len(logs)
