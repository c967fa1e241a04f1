import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import csv as arrow_csv

from faults.conditions import CONDITIONS, parameters_for
from plant.eha.drives import nine_steps
from plant.eha.simulate import LUMPED, simulate
from plant.sensors.sensors import BENCH

COMMAND = Path(sys.executable).parent / "hydrostate"


def finding_and_peak(verb: str, path: Path) -> tuple[dict[str, object], int]:
    """What `hydrostate VERB` finds in a log, and the most memory that this one process held in bytes."""
    process = subprocess.Popen([COMMAND, verb, path, "--json"], stdout=subprocess.PIPE)  # noqa: S603 - our own command
    assert process.stdout is not None
    with process.stdout:
        (finding,) = json.load(process.stdout)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0
    return finding, used.ru_maxrss * (1 if sys.platform == "darwin" else 1024)


@pytest.mark.slow
def test_a_million_rows_are_estimated_and_diagnosed_in_under_a_gigabyte_and_a_half(tmp_path: Path) -> None:
    p, rng = parameters_for(CONDITIONS["minor_leakage"]), np.random.default_rng(0)
    steps = nine_steps(10.0, 1e-4, p, rng)
    record = simulate(LUMPED, np.tile(np.concatenate([steps, -steps]), 5), 1e-4, p, sensors=BENCH, rng=rng)
    path = tmp_path / "long.csv"
    arrow_csv.write_csv(pa.table({"time_s": record.time, **{name: record[name].copy() for name in record}}), path)
    estimated, peak_of_estimate = finding_and_peak("estimate", path)
    diagnosed, peak_of_diagnose = finding_and_peak("diagnose", path)
    modulus = estimated["bulk_modulus_pa"]
    assert isinstance(modulus, dict)
    assert modulus["value"] == pytest.approx(2.07e8, rel=0.005)
    assert diagnosed["condition"] == "minor_leakage"
    assert max(peak_of_estimate, peak_of_diagnose) < 1.5e9
