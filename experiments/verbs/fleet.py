"""`hydrostate fleet FOLDER_OR_STORE`: one page with one row per actuator, the sick ones at the top."""

import math
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from experiments.command.json_output import write_whole
from experiments.command.options import (
    Columns,
    Plant,
    RigFile,
    SampleTime,
    argument,
    load_actuator,
    load_columns,
    option,
    require_positive,
)
from experiments.command.output_paths import require_folder
from experiments.command.terminal import INTERRUPTED, SOME_FAILED, USAGE, emit, note
from experiments.command.visible_text import valid_text
from plant.errors import HydrostateError, require_known

if TYPE_CHECKING:
    from experiments.batch.part_store import PartStore
    from experiments.fleet.actuators import ActuatorRow
    from experiments.fleet.naming import ActuatorAndDate

PAGE = "index.html"

RIG = "rig.toml"
"""Name of a rig file among logs."""

SUFFIXES = (".csv", ".txt", ".tsv", ".dat", ".gz", ".zst", ".parquet", ".feather", ".arrow", ".mat", ".h5", ".hdf5")
PACKAGE_SUFFIXES = (".tdms", ".mf4", ".mdf", ".xlsx")
"""Other file endings that count as logs; these formats need a package."""

commands = typer.Typer()


@commands.command(epilog="Example: hydrostate fleet archive --pattern '{actuator}_{date}.csv' --out fleet")
def fleet(
    place: Annotated[str, argument("FOLDER_OR_STORE", "Folder of logs, or the store of a batch study with diagnoses.")],
    out: Annotated[Path, option("DIR", "Folder of the pages.", "--out", "-o")] = Path("fleet"),
    pattern: Annotated[
        str | None,
        option(
            "PATTERN",
            "How files are named, such as '{actuator}_{date}.csv'; without it, names that hold a date are split there.",
            "--pattern",
        ),
    ] = None,
    names: Annotated[
        Path | None, option("CSV", "Table with the columns file, actuator and, if known, date.", "--names")
    ] = None,
    limit: Annotated[
        list[str] | None, option("NAME=VALUE", "Limit of a severity in its unit, such as leakage_flow=2.", "--limit")
    ] = None,
    maintenance: Annotated[
        Path | None,
        option("CSV", "Repairs, with the columns actuator and date; a trend restarts at a repair.", "--maintenance"),
    ] = None,
    pages: Annotated[int, option("N", "Write a page for each of the N worst actuators.", "--pages", min=0)] = 20,
    plant: Plant = None,
    rig: RigFile = None,
    columns: Columns = None,
    sample_time: SampleTime = None,
    workers: Annotated[
        int | None, option("N", "Number of processes; by default the number of cores.", "--workers", min=1)
    ] = None,
) -> None:
    """Write the page of a fleet: which actuators are faulty, how badly, with links to the pages of their logs.

    The command diagnoses the logs of a folder into a store beside the page. Run again, it diagnoses only logs that are
    new or have changed. Logs of actuators of another size or kind go into a folder of their own, with their rig file in
    it as rig.toml. The last line of standard output is the path of the page.
    """
    from experiments.batch.part_store import open_store
    from experiments.fleet.actuators import actuator_rows
    from experiments.fleet.log_pages import write_pages
    from experiments.fleet.outlook import read_maintenance
    from experiments.fleet.page import fleet_page, rig_hint, sickest_of, title_of
    from experiments.fleet.rows import log_rows

    require_folder(out)
    require_positive("--sample-time", sample_time, "s")
    limits, repairs = limits_of_options(limit or []), read_maintenance(maintenance)
    _names((), pattern, names)  # report errors here and in file names before any log is diagnosed
    if Path(place).is_file():
        raise HydrostateError(f"{place}: must be a folder with logs or a store, got a file")
    store = open_store(place)
    from_logs, rigs, logs = store.manifest() is None, dict[str, Path](), list[Path]()
    if from_logs:
        logs = _logs_in(Path(place))
        _names([valid_text(one.relative_to(place).as_posix()) for one in logs], pattern, names)
        rigs = rigs_of_folders(Path(place), logs, rig)
        rig = rigs.pop("", None)
        store = _diagnosed(Path(place), logs, out, plant, rig, rigs, load_columns(columns), sample_time, workers)
    table = store.rows(["file", "verb", "outcome", "found_condition", "reason", "quantities", "against"]).to_pylist()
    files = [row["file"] for row in table if row["file"]]
    named, unnamed = _names(files, pattern, names, Path(place).resolve().name if from_logs else "")
    if pattern is None and names is None:
        _say_split(named)
    rows = actuator_rows(log_rows(table, named, limits), repairs)
    if not rows:
        raise HydrostateError(f"{place}: must contain logs that were diagnosed (verb diagnose), but there are none")
    base = Path(place) if from_logs else Path()
    paths = {valid_text(one.relative_to(base).as_posix()): one for one in logs}
    links = write_pages(rows, out, pages, _page_writer(base, paths, plant, rig, rigs, columns, sample_time))
    write_whole(out / PAGE, fleet_page(rows, links, Path(place).resolve().name), "--out", parents=True)
    _warn(rows, repairs, unnamed)
    failed = sum(one.state == "failed" for row in rows for one in row.logs)
    total = sum(len(row.logs) for row in rows)
    if failed:
        note(f"{failed} of {total} logs could not be read; the page says why")
    if hint := rig_hint(rows):
        note(f"warning: {hint}")
    first = sickest_of(rows)
    note(title_of(rows) + (f" Start with {', '.join(first)}." if first else ""))
    emit(f"{out / PAGE}")
    if failed:
        raise typer.Exit(USAGE if failed == total else SOME_FAILED)


def _warn(rows: "Sequence[ActuatorRow]", repairs: Mapping[str, Sequence[float]], unnamed: str) -> None:
    """Report which files have no actuator or usable date, and which repairs do not restart a trend."""
    every = [one for row in rows for one in row.logs]
    alone = [one.file for one in every if not (one.named.actuator or one.named.problem)]
    if alone and unnamed:
        note(f"warning: {len(alone)} of {len(every)} files {unnamed}, so each has its own row, such as {alone[0]}")
    undated = [one for one in every if one.named.problem]
    if undated:
        said = f"{undated[0].file}: {undated[0].named.problem}"
        note(
            f"warning: {len(undated)} of {len(every)} logs have no usable date, so each has its own row, such as {said}"
        )
    twins = [row.name for row in rows if row.last.named.actuator.count("/")]
    if twins:
        note(
            f"warning: {len(twins)} actuators have the same name as another, and logs of the same time in another "
            f"folder, so each has its own row, such as {twins[0]}. If they are one, give --names"
        )
    known = {row.name: row for row in rows}
    for name in repairs:
        if name not in known:
            note(f"warning: --maintenance has a repair of {name!r}, but no log is of that actuator")
        elif not all(one.named.place is not None for one in known[name].logs):
            note(f"warning: --maintenance has a repair of {name!r}, but its logs have no dates, so its trend goes on")


def limits_of_options(texts: Sequence[str]) -> dict[str, float]:
    """Return ``--limit`` as limits by severity.

    Parameters
    ----------
    texts : sequence of str
        ``NAME=VALUE``.

    Returns
    -------
    dict[str, float]
        Limits [their units].

    Raises
    ------
    HydrostateError
        If a severity is not known, or a value is no finite number.
    """
    if not texts:
        return {}
    from faults.diagnosis.severity import UNITS  # not needed without such limits

    found: dict[str, float] = {}
    for text in texts:
        name, _, value = text.partition("=")
        require_known("--limit", name, list(UNITS))
        try:
            found[name] = float(value)
        except ValueError:
            found[name] = math.nan
        if not math.isfinite(found[name]):
            raise HydrostateError(f"--limit {name} must be a number in {UNITS[name]}, got {value!r:.80}")
    return found


def _names(
    files: Sequence[str], pattern: str | None, names: Path | None, folder: str = ""
) -> "tuple[Mapping[str, ActuatorAndDate], str]":
    """Return actuator and date of each log, and a message about logs that have none."""
    from experiments.fleet.naming import by_dates, by_pattern, by_table

    if pattern is not None and names is not None:
        raise HydrostateError("--pattern and --names say the same: give one of them")
    if pattern is not None:
        return by_pattern(files, pattern), f"do not match --pattern {pattern}"
    if names is not None:
        return by_table(files, names), f"are not in {names}"
    found = by_dates(files, folder)
    return found, "do not hold one date" if found else ""


def _say_split(named: "Mapping[str, ActuatorAndDate]") -> None:
    """Report how file names were split if no option gives the pattern."""
    known = {file: one for file, one in named.items() if one.actuator}
    if not known:
        return
    file, first = next(iter(known.items()))
    count = len({one.actuator for one in known.values()})
    note(
        f"file names hold dates: {file} is taken for actuator {first.actuator}, {first.date}; {len(known)} file names "
        f"give {count} actuator{'s' if count > 1 else ''}. If that is wrong, give --pattern or --names"
    )


def _logs_in(folder: Path) -> list[Path]:
    from glob import escape

    from experiments.batch.log_files import matching_files

    if not folder.is_dir():
        raise HydrostateError(f"{folder}: must be a folder with logs or a store, but there is no such folder")
    known = (*SUFFIXES, *PACKAGE_SUFFIXES)
    found = [one for one in map(Path, matching_files(f"{escape(str(folder))}/**/*")) if one.suffix.lower() in known]
    if not found:
        raise HydrostateError(f"{folder}: must hold logs, files that end in {', '.join(known)}, but there are none")
    return found


def _diagnosed(
    folder: Path,
    logs: Sequence[Path],
    out: Path,
    plant: str | None,
    rig: Path | None,
    rigs: Mapping[str, Path],
    columns: Mapping[str, str],
    sample_time: float | None,
    workers: int | None,
) -> "PartStore":
    """Diagnose the logs of a folder into a store; Ctrl-C ends without a page, which would lack some actuators."""
    from experiments.batch.cases import plan_study
    from experiments.batch.part_store import open_store
    from experiments.batch.run_on_terminal import RunSettings, run_plan
    from experiments.batch.study_file import parse_study

    kind, _ = load_actuator(plant, rig)
    ends = sorted({one.suffix for one in logs})
    methods = [{"verb": "diagnose"}]
    how = {"columns": dict(columns), "sample_time_s": sample_time, "methods": methods}
    globs = [{"glob": f"**/*{end}", **how} for end in ends]
    content: dict[str, Any] = {
        "name": "fleet",
        "plant": kind.name,
        "rig": str(rig.resolve()) if rig else "",
        "rigs": {name: str(file.resolve()) for name, file in rigs.items()},
        "logs": globs,
    }
    plan = plan_study(parse_study(content, f"{folder}"), folder)
    store = open_store(out / "store")
    with store.writing():
        tally, before = run_plan(plan, store, "fleet", RunSettings(workers=workers or os.cpu_count() or 1))
    if tally.stopped:
        done, total = before + tally.done, len(plan.keys)
        note(f"{tally.stopped}: {done} of {total} logs are kept in {store.name}; the same command goes on from there")
        raise typer.Exit(INTERRUPTED)
    return store


def rigs_of_folders(folder: Path, logs: Sequence[Path], given: Path | None = None) -> dict[str, Path]:
    """Return the rig files found among logs, each valid for the logs in and below its folder, and report them.

    Parameters
    ----------
    folder : Path
        Folder of the fleet.
    logs : sequence of Path
        Logs of the fleet.
    given : Path or None
        Rig file for logs outside all folders with their own rig file; it replaces the one in the fleet's folder.

    Returns
    -------
    dict[str, Path]
        By the folder's path relative to the fleet's, with slashes; empty for the fleet's own.
    """
    above = {one for log in logs for one in log.parents if one == folder or folder in one.parents}
    found = {
        "" if one == folder else valid_text(one.relative_to(folder).as_posix()): one / RIG
        for one in sorted(above)
        if (one / RIG).is_file()
    }
    for name, file in found.items():
        if name or given is None:
            note(f"rig file of {f'the logs in {name}' if name else 'logs in no folder that has its own'}: {file}")
    return found if given is None else {**found, "": given}


def _page_writer(
    base: Path,
    paths: Mapping[str, Path],
    plant: str | None,
    rig: Path | None,
    rigs: Mapping[str, Path],
    columns: Any,
    sample_time: float | None,
) -> Callable[[str, Path], bool]:
    """Return a function that writes the page of a log and returns whether the log still exists."""
    from experiments.actuators import kind_of_rig, read_own_rig, verb_of_kind
    from experiments.batch.logs_listed import nearest_folder

    usual, common = load_actuator(plant, rig)
    own = {name: read_own_rig(file, usual) for name, file in rigs.items()}
    mapping = load_columns(columns)

    def write(file: str, path: Path) -> bool:
        log = paths.get(file, base / file)
        if not log.exists():
            return False
        from experiments.command.log_verb import page_of  # not needed for pages of a store alone
        from experiments.command.logs import catch_log_warnings, read_log

        bench = own.get(nearest_folder(file, own), common)
        kind = kind_of_rig(bench, usual.name)
        chosen = verb_of_kind(kind, "diagnose")
        with catch_log_warnings():
            record = read_log(log, bench.columns, mapping, kind.required, sample_time=sample_time)
            found = chosen.run(record, *chosen.prepare(bench, {**chosen.options, "seed": 0}))
        result = {**chosen.blank, "file": file, "rig": bench.name, **chosen.entries(found)}
        write_whole(path, page_of(chosen, result, found, record, bench), "--out", parents=True)
        return True

    return write
