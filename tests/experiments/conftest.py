"""One small study a session: its shape is what figures, report and store stand on, not its numbers."""

from pathlib import Path

import pytest
from matplotlib.figure import Figure

from experiments.figures import FIGURES, draw
from experiments.figures.style import styled
from experiments.store import write_study
from experiments.studies.settings import StudySettings
from experiments.study import StudyResult, run_study

SMALL = StudySettings(seed=7, starts=(0.0, 4e8), duration=1.0, sample_time=1e-3, identification_duration=2.5, seeds=1)


@pytest.fixture(scope="session")
def study() -> StudyResult:
    return run_study(SMALL, lambda _: None)


@pytest.fixture(scope="session")
def written(study: StudyResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the written study."""
    return write_study(study, tmp_path_factory.mktemp("results") / "study").parent


@pytest.fixture(scope="session")
def drawn(study: StudyResult) -> dict[str, Figure]:
    """Return every figure, drawn and laid out once."""
    figures = {name: draw(name, study) for name in FIGURES}
    with styled():
        for figure in figures.values():
            figure.draw_without_rendering()
    return figures
