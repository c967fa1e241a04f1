"""Exported FMUs: FMPy's validation, and the native trajectory in FMPy, in libcosim (FMI Library) and in Ecos (fmi4c).

The three plants as FMI 2.0 and 3.0. The other tools run in the Python given by ``--tools``, with ``libcosimpy`` and
``ecospy``; libcosim supports only FMI 2.0.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.targets import Check, keep_figure
from plant.arrays import Array
from plant.eha.drives import sine
from plant.eha.model import EhaParameters
from plant.eha.simulate import PLANTS, Plant
from plant.export.c_plant import substeps_of
from plant.export.fmu import plant_fmu
from plant.solvers.steps import parameter_row
from plant.solvers.trajectory import compile_trajectory

STEP, SECONDS, WANTED = 1e-3, 2.0, 1e-6
TOOLS = {"libcosim": ("2.0",), "ecos": ("2.0", "3.0")}
WORKER = Path(__file__).parents[1] / "peers" / "fmu_tools.py"


def native_velocity(plant: Plant, parameters: EhaParameters, speeds: Array) -> Array:
    """Return the velocity for a drive held between samples, shape (samples + 1,) [m/s]."""
    row = parameter_row(plant.complete(parameters))
    run = compile_trajectory(plant.name, plant.step, len(plant.states), plant.parameter_class)
    states = [np.asarray(plant.start(row), dtype=np.float64)]
    for speed in speeds:
        states.append(run(states[-1], np.full(2, speed), row[None], STEP, substeps_of(plant, STEP, row))[-1])
    return np.asarray(plant.channels(np.array(states), row[None])["velocity_m_s"])


def fmpy_velocity(path: Path, speeds: Array) -> tuple[list[str], Array]:
    """Return the complaints of FMPy's validation, and its velocity, shape (samples + 1,) [m/s]."""
    import fmpy
    from fmpy.validation import validate_fmu

    time = STEP * np.arange(len(speeds) + 1)
    drive = np.append(speeds, speeds[-1])
    signals = np.array(list(zip(time, drive, strict=True)), dtype=[("time", float), ("motor_speed_rad_s", float)])
    span: dict[str, Any] = {"start_time": 0.0, "stop_time": time[-1], "step_size": STEP, "output_interval": STEP}
    with np.errstate(all="ignore"):
        found = fmpy.simulate_fmu(str(path), **span, input=signals)
    return list(validate_fmu(str(path))), np.asarray(found["velocity_m_s"])


def tool_velocity(python: Path, tool: str, path: Path, speeds: Array) -> Array:
    """Return the velocity computed by a tool, shape (samples + 1,) [m/s]."""
    command = [str(python), str(WORKER), tool, str(path), repr(STEP)]
    given = "\n".join(map(repr, speeds.tolist()))
    done = subprocess.run(command, input=given, capture_output=True, text=True, check=False)  # noqa: S603  our own
    if done.returncode:
        raise RuntimeError(f"{tool} failed on {path.name}: {done.stderr.strip()[-300:]}")
    return np.array([float(line) for line in done.stdout.rpartition("velocities\n")[2].split()])


def main(arguments: list[str]) -> int:
    """Print each plant, version and tool; return how many deviate from the native run by more than allowed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tools", type=Path, help="a Python with libcosimpy and ecospy")
    python: Path | None = parser.parse_args(arguments).tools
    if python is None:
        print("--tools names no Python: libcosim and Ecos are not run", file=sys.stderr)
    missed, p = 0, EhaParameters(leakage_coefficient=2e-11)
    speeds = sine(SECONDS, STEP, p.rated_speed, 5.0)
    with tempfile.TemporaryDirectory() as folder:
        for plant in PLANTS.values():
            wanted = native_velocity(plant, p, speeds)
            for version in ("2.0", "3.0"):
                path = Path(folder) / f"{plant.name}_{version[0]}.fmu"
                path.write_bytes(plant_fmu(plant, p, STEP, version, name=f"{plant.name}_plant"))
                objections, seen = fmpy_velocity(path, speeds)
                found = {"FMPy": seen}
                if python is not None:
                    found |= {
                        tool: tool_velocity(python, tool, path, speeds) for tool in TOOLS if version in TOOLS[tool]
                    }
                for tool, velocity in found.items():
                    apart = float(np.max(np.abs(velocity - wanted)) / np.max(np.abs(wanted)))
                    check = keep_figure(
                        Check(f"{plant.name} FMI {version} in {tool}: relative difference", apart, most=WANTED)
                    )
                    met = check.met and not (tool == "FMPy" and objections)
                    missed += not met
                    said = f"; validation: {objections or 'no objection'}" if tool == "FMPy" else ""
                    print(f"{plant.name:8s} FMI {version} in {tool:9s}{apart:9.1e}{said}{'' if met else '  MISSED'}")
    return missed
