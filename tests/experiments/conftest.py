"""One small study per session, for tests of figures, report and store."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from matplotlib.figure import Figure

from experiments.diaphragm_motor.study import RIG, SWEEPS, claim_tables
from experiments.motor_paper.study import MOTOR_PAPER
from experiments.nine_conditions.figures import FIGURES
from experiments.nine_conditions.settings import StudySettings
from experiments.nine_conditions.study import NINE_CONDITIONS
from experiments.page import figure_files
from experiments.page.frames import Tables
from experiments.page.style import project_style
from experiments.piezo_stack import study as stack_study
from experiments.piezo_stack.study import PIEZO_STACK, StackSettings
from experiments.running.progress import without_progress
from experiments.running.study import SeedSettings, StudyResult, write_result

SMALL = StudySettings(
    seed=7,
    starts=(0.0, 4e8),
    duration=1.0,
    sample_time=1e-3,
    identification_duration=2.5,
    seeds=1,
    filterpy_samples=100,
)


@pytest.fixture(scope="session", autouse=True)
def _few_dots() -> Iterator[None]:
    """Draw PNG figures with few pixels: no test needs more."""
    with pytest.MonkeyPatch.context() as patch:
        for resolution in ("PNG_DOTS_PER_INCH", "LOG_DOTS_PER_INCH"):
            patch.setattr(figure_files, resolution, 20)
        yield


@pytest.fixture(scope="session")
def study() -> StudyResult:
    return NINE_CONDITIONS.find(SMALL, without_progress)


class Drawn(dict[str, Figure]):
    """Figures of the small study, each drawn and laid out at its first use."""

    def __init__(self, study: StudyResult) -> None:
        super().__init__()
        self.study = study

    def __missing__(self, name: str) -> Figure:
        with project_style():
            self[name] = FIGURES[name](self.study.frames)
            self[name].draw_without_rendering()
        return self[name]


@pytest.fixture(scope="session")
def drawn(study: StudyResult) -> Drawn:
    return Drawn(study)


WRITTEN = "forms_on_sticking_plant"
"""The figure that the written study contains; the others are empty, since writing all of them takes 5 s."""


@pytest.fixture(scope="session")
def written(study: StudyResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the written study, with one real figure and the others empty."""
    folder = tmp_path_factory.mktemp("results") / "study"
    figures = {name: FIGURES[name] if name == WRITTEN else lambda _: Figure(figsize=(1.0, 1.0)) for name in FIGURES}
    write_result(replace(NINE_CONDITIONS, figures=figures), SMALL, study, folder)
    return folder


STACK = StackSettings(seed=7, quick=True, voltage_limit_v=140.0, power_limit_w=1e3)


@pytest.fixture(scope="session")
def stack_tables() -> Tables:
    """Return the stack's tables except that of figure 12 left out, which `test_left_out` makes itself."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stack_study, "figure_12_left_out", lambda *_: pd.DataFrame())
        frames = PIEZO_STACK.find(STACK, without_progress).frames
    return {name: frame for name, frame in frames.items() if name != "figure 12 left out"}


@pytest.fixture(scope="session")
def motor_tables() -> Tables:
    """Return the motor's tables except that of other sets of plates, which takes as long as most others together."""
    sweeps = {name: sweep for name, sweep in SWEEPS.items() if name != "other sets"}
    return claim_tables(RIG, 7, without_progress, sweeps)


@pytest.fixture(scope="session")
def motor_paper_tables() -> Tables:
    return MOTOR_PAPER.find(SeedSettings(2024), without_progress).frames
