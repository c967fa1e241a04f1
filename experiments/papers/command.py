"""`hydrostate papers`: every table, figure and claim of the three papers, as one page."""

from pathlib import Path
from typing import Annotated

import typer

from experiments.command.options import SEED, Json, Seed, flag
from experiments.command.study_verb import Folder, finish_study

commands = typer.Typer()


@commands.command(epilog="Example: hydrostate papers --out results/papers --quick")
def papers(
    out: Folder = Path("results/papers"),
    seed: Seed = SEED,
    quick: Annotated[bool, flag("--quick", "The same rows from fewer first guesses and shorter runs.")] = False,
    as_json: Json = False,
) -> None:
    """Compare every table, figure and claim of the three papers with our results; one rule gives every verdict.

    The studies behind the rows are kept in a folder beside the page, whose name ends in `-parts`. An interrupted run
    continues where it stopped. Takes a few minutes; the last line of standard output is the path of the page.
    """
    from experiments.papers.parts import PapersSettings, quick_papers
    from experiments.papers.study import papers_study

    settings = quick_papers(seed) if quick else PapersSettings(seed)
    finish_study(papers_study(out.with_name(f"{out.name}-parts")), settings, out, as_json=as_json)
