"""The studies that supply the rows' results: each is run once, kept as a folder of tables, and read from there."""

import hashlib
import json
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

import pandas as pd

import estimation
import experiments
import faults
import plant
from experiments.circuit.study import RIG as CIRCUIT_RIG
from experiments.circuit.study import circuit_studies
from experiments.diaphragm_motor.study import RIG as MOTOR_RIG
from experiments.diaphragm_motor.study import claim_tables
from experiments.library.tables import library_table, root_table
from experiments.motor_paper.study import MOTOR_PAPER
from experiments.nine_conditions.printed_equations import printed_equations
from experiments.nine_conditions.settings import StudySettings
from experiments.nine_conditions.study import NINE_CONDITIONS
from experiments.nine_conditions.study import RIG as NINE_RIG
from experiments.page.folder import check_target, write_tables
from experiments.page.frames import Tables
from experiments.piezo_stack import flow
from experiments.piezo_stack.hysteresis import hysteresis_table
from experiments.piezo_stack.left_out import TURNS, figure_12_left_out
from experiments.piezo_stack.study import RIG as STACK_RIG
from experiments.published.library import read_library
from experiments.running.progress import Track, run_as_one_piece
from experiments.running.study import SeedSettings, versions
from plant.errors import LogWarning

Evidence: TypeAlias = Mapping[str, Tables]
"""Tables by part and name, as stored in the folders."""


@dataclass(frozen=True)
class PapersSettings(StudySettings):
    """Size of the studies that supply the rows' results.

    Parameters
    ----------
    calibrations, turns : int
        Calibrations of the piezo-stack plant without Figure 12, and the maximum number of steps in each [count].
    """

    filterpy_samples: int = 2
    """Number of samples in a comparison that no row uses [count]."""

    calibrations: int = 3
    turns: int = TURNS


def quick_papers(seed: int) -> PapersSettings:
    """Return a small size: the same rows, from fewer first guesses and shorter runs."""
    return PapersSettings(
        seed, (0.0, 5e8), duration=2.0, sample_time=1e-3, identification_duration=8.0, seeds=1, calibrations=1, turns=1
    )


def _nine(settings: PapersSettings, track: Track) -> Tables:
    found = NINE_CONDITIONS.find(settings, track).frames
    make = partial(printed_equations, NINE_RIG, settings)
    return {**found, "printed equations": run_as_one_piece(track, "the published filter as printed", make)}


def _circuit(settings: PapersSettings, track: Track) -> Tables:
    studies = circuit_studies(CIRCUIT_RIG, settings.seed, settings)
    return {name: run() for name, run in track(studies.items(), description="the circuit's experiments")}


def _library(_: PapersSettings, track: Track) -> Tables:
    models, around = read_library(), read_library(which="around_mean")
    makers = {
        "library": lambda: library_table(models),
        "roots": lambda: root_table(models),
        "around_mean": lambda: library_table(around),
    }
    return {name: make() for name, make in track(makers.items(), description="the library")}


def _stack(settings: PapersSettings, track: Track) -> Tables:
    wanted = flow.figure_points()
    points = [point for some in wanted.values() for point in some]
    rows = iter(track(flow.sweep(STACK_RIG, points), len(points), description="the stack's operating points"))
    tables = {name: pd.DataFrame([next(rows) for _ in some]) for name, some in wanted.items()}
    tables["figure 10 loop widths"] = flow.loop_widths(flow.stack_loops(STACK_RIG))
    peak = flow.OperatingPoint(275.0, flow.HIGH_VOLTAGE, flow.HIGH_BIAS, 0.0)
    tables["pump cycle"] = flow.pump_cycle(STACK_RIG, peak)
    tables["hysteresis parameters"] = hysteresis_table(STACK_RIG, settings.seed)
    tables["figure 12 left out"] = figure_12_left_out(
        STACK_RIG, settings.seed, settings.calibrations, settings.turns, track
    )
    return tables


def _motor(settings: PapersSettings, track: Track) -> Tables:
    return claim_tables(MOTOR_RIG, settings.seed, track)


def _motor_paper(settings: PapersSettings, track: Track) -> Tables:
    return MOTOR_PAPER.find(SeedSettings(settings.seed), track).frames


PARTS: Mapping[str, Callable[[PapersSettings, Track], Tables]] = {
    "study": _nine,
    "circuit": _circuit,
    "library": _library,
    "piezo-stack": _stack,
    "diaphragm-motor": _motor,
    "motor-paper": _motor_paper,
}
"""Function that makes each part, by the verb that shows it."""


def gather_tables(folder: Path, settings: PapersSettings, track: Track) -> Evidence:
    """Return the tables of every part; unchanged parts of an earlier run are reused.

    Each part is written completely when it is finished, so that an interrupted run continues where it stopped.

    Parameters
    ----------
    folder : Path
        The folder of the parts, with one sub-folder for each part.

    Raises
    ------
    HydrostateError
        If a part's folder cannot be written, or holds something that is not a study.
    """
    sources = sources_digest()
    for name, make in PARTS.items():
        # through JSON, so that it equals a stored manifest
        manifest = json.loads(json.dumps(_manifest(name, settings, sources)))
        if _kept_manifest(folder / name) != manifest:
            check_target(folder / name)
            with warnings.catch_warnings(action="ignore", category=LogWarning):
                tables = make(settings, track)
            run_as_one_piece(track, f"writing {name}", lambda: write_tables(tables, manifest, folder / name))  # noqa: B023 - called at once
    return {name: read_tables(folder / name) for name in PARTS}


def read_tables(folder: Path) -> Tables:
    """Return the tables of a folder, by file name without its extension.

    Parameters
    ----------
    folder : Path
        A folder written by `write_tables`.
    """
    return {
        path.stem: pd.read_csv(path, keep_default_na=False, na_values=[""])
        for path in sorted((folder / "tables").glob("*.csv"))
    }


def sources_digest() -> str:
    """Return a digest of the packages' sources, excluding this folder, which only reads results."""
    digest = hashlib.sha256()
    for path in _sources():
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _sources() -> Iterator[Path]:
    for package in (plant, estimation, faults, experiments):
        root = Path(str(package.__file__)).parent
        for path in sorted(root.rglob("*.py")):
            if Path(__file__).parent not in path.parents:
                yield path


def _manifest(name: str, settings: PapersSettings, sources: str) -> dict[str, Any]:
    return {
        "study": f"papers: {name}",
        "settings": asdict(settings),
        "versions": versions(),
        "sources": sources,
    }


def _kept_manifest(folder: Path) -> dict[str, Any]:
    """Return the manifest of an earlier run without its list of files; empty if there is none."""
    try:
        found = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
        whole = all((folder / name).is_file() for name in found.pop("files"))
    except (OSError, ValueError, KeyError, AttributeError, TypeError):
        return {}
    return found if whole else {}
