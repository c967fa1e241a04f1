import json
import resource
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


@pytest.mark.slow
def test_a_million_rows_are_estimated_and_diagnosed_in_under_a_gigabyte_and_a_half(tmp_path: Path) -> None:
    p, rng = parameters_for(CONDITIONS["minor_leakage"]), np.random.default_rng(0)
    steps = nine_steps(10.0, 1e-4, p, rng)
    record = simulate(LUMPED, np.tile(np.concatenate([steps, -steps]), 5), 1e-4, p, sensors=BENCH, rng=rng)
    path = tmp_path / "long.csv"
    arrow_csv.write_csv(pa.table({"time_s": record.time, **{name: record[name].copy() for name in record}}), path)
    found: dict[str, dict[str, object]] = {}
    for verb in ("estimate", "diagnose"):
        done = subprocess.run([COMMAND, verb, path, "--json"], capture_output=True, text=True, check=True)  # noqa: S603 - our own command
        (found[verb],) = json.loads(done.stdout)
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    modulus = found["estimate"]["bulk_modulus_pa"]
    assert isinstance(modulus, dict)
    assert modulus["value"] == pytest.approx(2.07e8, rel=0.005)
    assert found["diagnose"]["condition"] == "minor_leakage"
    assert peak < 1.5e9
