"""Numbers in exported C code, and the size of the code, kept in `numbers.json`."""

import re
from functools import cache
from typing import Any

import numpy as np
import pytest

from estimation.export.c_filter import EXPORTED, filter_in_c, numbers_of, row_notes
from estimation.export.c_model import model_in_c
from estimation.export.task import EXPORTED_FORMS, filter_task
from estimation.identification.free_run.model import FreeRunModel
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from tests.estimation.export.test_c_model import linear
from tests.numbers import Numbers

NUMBERS = Numbers(__file__)
P = EhaParameters()


@cache
def log() -> Record:
    rng = np.random.default_rng(3)
    return simulate(LUMPED, make_drive("steps", 0.3, 1e-3, P, rng), 1e-3, P, sensors=BENCH, rng=rng)


def told(files: dict[str, str]) -> dict[str, Any]:
    """Return each file's number of lines, its numbers with a point or a power (each once, in order), and its sizes."""
    found: dict[str, Any] = {}
    for name, text in files.items():
        literals = dict.fromkeys(re.findall(r"(?<![\w.])\d+\.\d*(?:[eE][-+]?\d+)?|(?<![\w.])\d+[eE][-+]?\d+", text))
        counts = re.findall(r"#define \w+ (\d+)\b|\[(\d+)\]", text)
        found[name] = {
            "lines": text.count("\n"),
            "numbers": {str(k): float(one) for k, one in enumerate(literals)},
            "sizes": [int(one or other) for one, other in counts][:40],
        }
    return found


@NUMBERS.case()
def filters_in_c() -> dict[str, Any]:
    made: dict[str, Any] = {}
    for form in EXPORTED_FORMS:
        problem = filter_task(log(), P, form, start=1.7e8)
        method = EXPORTED[0] if isinstance(EXPORTED, tuple | list) else next(iter(EXPORTED))
        for precision in ("double", "float"):
            made[f"{form}, {precision}"] = told(filter_in_c(problem, method, name="kept", precision=precision))
        made[f"{form}, rows"] = {
            name: [one, unit]
            for (name, unit, _), one in zip(row_notes(problem, method), numbers_of(problem, method)[0], strict=True)
        }
    return made


@NUMBERS.case()
def models_in_c() -> dict[str, Any]:
    model: FreeRunModel = linear((1.0, -1.6, 0.68))
    return {precision: told(model_in_c(model, name="kept", precision=precision)) for precision in ("double", "float")}


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
