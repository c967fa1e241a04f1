"""One small study a session: its shape is what figures, report and store stand on. A browser, where there is one."""

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

from experiments.diaphragm_motor.study import DIAPHRAGM_MOTOR
from experiments.motor_paper.study import MOTOR_PAPER
from experiments.nine_conditions.figures import FIGURES
from experiments.nine_conditions.settings import StudySettings
from experiments.nine_conditions.study import NINE_CONDITIONS
from experiments.page import figure_files
from experiments.page.frames import Tables
from experiments.page.style import styled
from experiments.piezo_stack.study import PIEZO_STACK, StackSettings
from experiments.running.progress import untracked
from experiments.running.study import Found, Seeded, write_result

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
    """Draw PNG figures of few pixels: what is asked of them is asked of these too."""
    with pytest.MonkeyPatch.context() as patch:
        for resolution in ("PNG_DOTS_PER_INCH", "LOG_DOTS_PER_INCH"):
            patch.setattr(figure_files, resolution, 20)
        yield


@pytest.fixture(scope="session")
def study() -> Found:
    return NINE_CONDITIONS.find(SMALL, untracked)


@pytest.fixture(scope="session")
def drawn(study: Found) -> dict[str, Figure]:
    """Return every figure, drawn and laid out once."""
    with styled():
        figures = {name: draw(study.frames) for name, draw in FIGURES.items()}
        for figure in figures.values():
            figure.draw_without_rendering()
    return figures


@pytest.fixture(scope="session")
def written(study: Found, drawn: dict[str, Figure], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the written study, with the figures as they were drawn."""
    folder = tmp_path_factory.mktemp("results") / "study"
    figures = {name: lambda _, figure=figure: figure for name, figure in drawn.items()}
    write_result(replace(NINE_CONDITIONS, figures=figures), SMALL, study, folder)
    return folder


STACK = StackSettings(seed=7, quick=True, voltage_limit_v=140.0, power_limit_w=1e3)


@pytest.fixture(scope="session")
def stack_tables() -> Tables:
    return PIEZO_STACK.find(STACK, untracked).frames


@pytest.fixture(scope="session")
def motor_tables() -> Tables:
    return DIAPHRAGM_MOTOR.find(Seeded(7), untracked).frames


@pytest.fixture(scope="session")
def motor_paper_tables() -> Tables:
    return MOTOR_PAPER.find(Seeded(2024), untracked).frames


CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update"]


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright")
    if CHROMIUM is None:
        pytest.skip("needs Chromium (Debian's package chromium)")
    with playwright.sync_playwright() as started:
        one = started.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield one
        one.close()
