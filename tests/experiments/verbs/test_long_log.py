import json
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


# A child process inherits the peak memory of its parent. So a small process starts the command,
# and reports the peak memory of its only child.
BETWEEN = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss, file=sys.stderr)
"""


def finding_and_peak(verb: str, path: Path) -> tuple[dict[str, object], int]:
    """Return the finding of `hydrostate VERB` for a log, and the peak memory of its process in bytes."""
    command = [sys.executable, "-c", BETWEEN, COMMAND, verb, path, "--json"]
    run = subprocess.run(command, capture_output=True, check=True, text=True)  # noqa: S603 - our own command
    (finding,) = json.loads(run.stdout)
    return finding, int(run.stderr.split()[-1]) * (1 if sys.platform == "darwin" else 1024)


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
