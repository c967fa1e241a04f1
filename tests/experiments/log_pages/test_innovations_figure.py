"""The figure of a filtered log: it has a title and labels, and is written as a whole."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from estimation.eha.bulk_modulus import BulkModulusEstimate, estimate_bulk_modulus
from experiments.log_pages.innovations_figure import draw_innovations, write_innovations
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH


@cache
def log() -> Record:
    p, rng = EhaParameters(), np.random.default_rng(1)
    return simulate(LUMPED, make_drive("steps", 4.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)


@cache
def filtered() -> BulkModulusEstimate:
    return estimate_bulk_modulus(log(), EhaParameters(), form="pressure", method="ekf")


def test_the_figure_names_log_form_and_gate_and_labels_its_axes() -> None:
    found = filtered()
    figure = draw_innovations(found, "run.csv")
    title = figure.get_suptitle()
    assert "run.csv" in title
    assert "pressure form" in title
    assert ("the gate passes" in title) == found.gate.passed
    assert [axis.get_ylabel() != "" for axis in figure.axes] == [True] * 3
    assert figure.axes[-1].get_xlabel() == "time [s]"


def test_the_figure_is_written_as_a_single_png_file(tmp_path: Path) -> None:
    write_innovations(filtered(), "run.csv", tmp_path / "run.png")
    assert [path.name for path in tmp_path.iterdir()] == ["run.png"]
    assert (tmp_path / "run.png").read_bytes()[:4] == b"\x89PNG"


def test_the_innovations_of_a_fitted_log_cannot_be_drawn() -> None:
    fitted = estimate_bulk_modulus(log(), EhaParameters())
    with pytest.raises(ValueError, match="fitted, not filtered"):
        draw_innovations(fitted, "run.csv")
