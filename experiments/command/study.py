"""What `hydrostate study` does: run the nine-condition study with progress, and write its folder."""

from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from experiments.store import check_target, write_study
from experiments.studies.settings import StudySettings, quick_settings
from experiments.study import STAGES, run_study, stage_lengths


def study_command(out: Path, seed: int, quick: bool, console: Console) -> Path:
    """Run the study and write its folder.

    Parameters
    ----------
    out : Path
        Folder of the result; replaced whole if it holds an earlier study.
    seed : int
        Seed of every random stream.
    quick : bool
        Fewer first guesses and seeds.
    console : rich.console.Console
        Where progress goes.

    Returns
    -------
    Path
        The report.

    Raises
    ------
    HydrostateError
        If the folder cannot be written, or holds something that is not a study.
    """
    check_target(out)
    settings = quick_settings(seed) if quick else StudySettings(seed=seed)
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console) as progress:
        bars = {
            stage: progress.add_task(STAGES[stage], total=length) for stage, length in stage_lengths(settings).items()
        }
        result = run_study(settings, lambda stage: progress.advance(bars[stage]))
        writing = progress.add_task("drawing and writing", total=1)
        report = write_study(result, out)
        progress.advance(writing)
    return report
