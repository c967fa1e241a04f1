"""`hydrostate batch STUDY`: runs a study file's cases into a store, or continues where the last run stopped."""

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from experiments.batch.run_on_terminal import RunSettings, duration, run_plan
from experiments.command.json_output import json_text
from experiments.command.options import Json, argument, flag, option
from experiments.command.output_paths import require_folder
from experiments.command.terminal import INTERRUPTED, SOME_FAILED, USAGE, emit, note
from plant.errors import HydrostateError

if TYPE_CHECKING:
    from experiments.batch.cases import Plan
    from experiments.batch.part_store import PartStore
    from experiments.batch.runner import Tally
    from experiments.batch.study_file import Study

commands = typer.Typer()


@commands.command(epilog="Example: hydrostate batch fleet-archive --logs 'archive/**/*.csv' --out results/fleet")
def batch(
    study: Annotated[
        str, argument("STUDY", "Study file (TOML), or the name of an installed study: eha-paper, fleet-archive.")
    ],
    out: Annotated[
        str | None, option("STORE", "Folder or URL (s3://...) of the store; results/<study> by default.", "--out", "-o")
    ] = None,
    dry_run: Annotated[bool, flag("--dry-run", "Print the number of cases and what they cost, and stop.")] = False,
    resume: Annotated[
        bool, flag("--resume/--no-resume", "Keep the cases that the store has, or run all again.")
    ] = True,
    retry_failed: Annotated[bool, flag("--retry-failed", "Run failed cases again.")] = False,
    workers: Annotated[int | None, option("N", "Number of processes; by default the number of cores.", min=1)] = None,
    cluster: Annotated[
        str | None, option("ADDRESS", "Scheduler of a Dask cluster to use, such as tcp://host:8786.")
    ] = None,
    max_failures: Annotated[int | None, option("N", "Stop once more than N cases have failed.", min=0)] = None,
    logs: Annotated[str | None, option("GLOB", "Glob of logs, instead of that in the study file.")] = None,
    pages: Annotated[
        int, option("N", "Also write a page for each of the N worst logs, to which the report leads.", min=0)
    ] = 0,
    as_json: Json = False,
) -> None:
    """Run a study of many cases into a store that survives interruptions, and write its report.

    Cases that are in the store are not run again: after a crash or Ctrl-C, the same command continues where it stopped;
    of a changed study, only the changed cases are run. A case that fails becomes a row with its reason. The last line
    of standard output is the path of the report.
    """
    from experiments.batch.cases import plan_study
    from experiments.batch.part_store import open_store
    from experiments.batch.study_file import STUDIES_PACKAGE, read_study, shipped_studies, study_path

    require_folder(None if out is None else Path(out))
    chosen = _with_logs(read_study(study), logs)
    shipped = study in shipped_studies() and not Path(study).exists()
    folder = Path() if shipped or logs is not None else study_path(study).parent
    plan = plan_study(chosen, folder)
    store = open_store(out or f"results/{chosen.name}")
    width = workers or os.cpu_count() or 1
    if dry_run:
        _say_plan(plan, store, width, retry_failed, as_json)
        return
    from experiments.batch.report import write_report

    settings = RunSettings(
        workers=width, cluster=cluster, max_failures=max_failures, resume=resume, retry_failed=retry_failed
    )
    begin = time.perf_counter()
    source = f"{STUDIES_PACKAGE}/{study}.toml" if shipped else Path(study).name
    with store.writing():
        tally, before = run_plan(plan, store, source, settings)
        if pages and not tally.stopped:
            from experiments.batch.log_pages import write_log_pages

            for sentence in write_log_pages(plan, store, pages):
                note(sentence)
        report = write_report(store, store.folder)
    _finish(plan, store, tally, before, report, as_json, time.perf_counter() - begin)


def _with_logs(study: "Study", pattern: str | None) -> "Study":
    if pattern is None:
        return study
    if not study.logs:
        raise HydrostateError(f"--logs replaces the logs of a study, and {study.name} has none")
    return study.model_copy(update={"logs": tuple(one.model_copy(update={"glob": pattern}) for one in study.logs)})


def _say_plan(plan: "Plan", store: "PartStore", workers: int, again: bool, as_json: bool) -> None:
    wanted = plan.keys
    left = set(wanted) - (set() if store.manifest() is None else store.done(again=again)[0])
    seconds = plan.seconds * (len(left) / len(wanted)) / workers
    series = sum(len(one) for one, _ in plan.blocks)
    if as_json:
        entries = {"outcome": "ok", "study": plan.study.name, "store": store.name, "cases": len(wanted)}
        emit(json_text([{**entries, "series": series, "left": len(left), "seconds": seconds, "workers": workers}]))
        return
    emit(f"{plan.study.name}: {len(wanted)} cases on {series} series; {len(left)} are not in {store.name} yet")
    width = f"{workers} worker{'s' if workers > 1 else ''}"
    emit(f"about {duration(seconds)} with {width} (a rough guess from typical costs)")


def _finish(
    plan: "Plan", store: "PartStore", tally: "Tally", before: int, report: str, as_json: bool, seconds: float
) -> None:
    total = len(plan.keys)
    failed = sum(outcome == "failed" for outcome in store.rows(["outcome"])["outcome"].to_pylist())
    done = before + tally.done
    if tally.stopped:
        note(f"{tally.stopped}: {done} of {total} cases are kept in {store.name}; the same command goes on from there")
    else:
        kept = f", {before} of them from before" if before else ""
        note(f"{done} of {total} cases done{kept}, {failed} failed")
    entries = {"study": plan.study.name, "store": store.name, "report": report, "cases": total, "done": done}
    if as_json:
        outcome = "interrupted" if tally.stopped else "ok"
        emit(json_text([{"outcome": outcome, **entries, "failed": failed, "ran": tally.done, "seconds": seconds}]))
    else:
        emit(report)
    if tally.stopped == "interrupted":
        raise typer.Exit(INTERRUPTED)
    if failed:
        raise typer.Exit(USAGE if failed == total else SOME_FAILED)
