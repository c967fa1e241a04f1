"""`hydrostate compare A B`: what changed between two logs, or what got better and worse between two batch studies."""

from pathlib import Path
from typing import Annotated, Any

import typer

from experiments.command.json_output import json_text, write_whole
from experiments.command.options import SEED, Columns, Json, Plant, RigFile, SampleTime, Seed, argument, option
from experiments.command.output_paths import with_page_ending
from experiments.command.terminal import emit, note, render_text, table

commands = typer.Typer()


@commands.command(epilog="Example: hydrostate compare before.csv after.csv --report comparison.html")
def compare(
    first: Annotated[str, argument("A", "The first log, or the store of the first study.")],
    second: Annotated[str, argument("B", "The second log, or the store of the second study.")],
    out: Annotated[Path | None, option("HTML", "Also write a page.", "--out", "-o", "--report", "--html")] = None,
    plant: Plant = None,
    rig: RigFile = None,
    columns: Columns = None,
    sample_time: SampleTime = None,
    seed: Seed = SEED,
    as_json: Json = False,
) -> None:
    """Show what changed between two logs: every severity, the difference, and its 95 % interval.

    Of two batch studies, show what got better and what got worse from A to B, with 95 % intervals by bootstrap, which
    uses the seed. Cases are paired: the same series with the same treatment. If each study uses one filter (or form,
    plant, ...) throughout and the two studies differ in it, that difference is compared.
    """
    from experiments.batch.compare import compare_studies
    from experiments.batch.pages import render_comparison
    from experiments.batch.part_store import open_store
    from experiments.batch.summary import frame_of
    from plant.errors import HydrostateError

    if out is not None:
        out = with_page_ending("--report (--out)", out)
    files = [place for place in (first, second) if Path(place).is_file()]
    if len(files) == 2:
        from experiments.log_pages.two_logs import compare_logs

        chosen: dict[str, Any] = {"plant": plant, "rig": rig, "columns": columns, "sample_time": sample_time}
        compare_logs([Path(first), Path(second)], out, **chosen, seed=seed, as_json=as_json)
        return
    if files:
        other = second if files[0] == first else first
        if not Path(other).exists():
            raise HydrostateError(f"{other}: there is no such file")
        raise HydrostateError(f"{files[0]} is a log, and {other} is none: compare takes two logs, or two stores")
    names = [Path(place.rstrip("/")).name for place in (first, second)]
    if names[0] == names[1]:
        names = ["A", "B"]
    try:
        frames = [frame_of(open_store(place).rows()) for place in (first, second)]
    except HydrostateError as error:
        raise HydrostateError(f"{error}; compare takes two logs, or two stores of batch studies") from error
    found = compare_studies(*frames, seed=seed)
    if out is not None:
        write_whole(out, render_comparison(found, names), "--out", parents=True)
        note(f"written: {out}")
    if as_json:
        about = {"outcome": "ok", "first": first, "second": second, "seed": seed}
        emit(json_text([{**about, "rows": found.to_dict("records")}]))
        return
    numbers = (*(f"{name} [%]" for name in names), "difference [%]", "95 % interval [%]")
    shown = table("asked", "measure", *numbers, "verdict")
    for row in found[found["condition"] == "all"].to_dict("records"):
        known = row["low"] is not None and row["low"] == row["low"]
        interval = f"{row['low']:+.3g} to {row['high']:+.3g}" if known else "-"
        numbers = (f"{row['first']:.3g}", f"{row['second']:.3g}", f"{row['difference']:+.3g}", interval)
        shown.add_row(row["verb"], row["measure"], *numbers, row["verdict"])
    changed = [f"changed: {text}" for text in dict.fromkeys(found["changed"]) if text]
    single = found.loc[found["condition"] != "all", "verdict"]
    better, worse = (int((single == verdict).sum()) for verdict in ("better", "worse"))
    emit(render_text(*changed, shown, f"by condition: {better} better, {worse} worse, of {len(single)}"))
