"""A plant from another tool: an FMU for co-simulation, run under a drive; it gives a record like any other plant.

So a study, a fit or a diagnosis can be tested on physics that do not come from this project. Its variables are mapped
in the same way as the columns of a foreign log. FMPy runs it (``hydrostate[fmu]``). An FMU is a program: do not run one
that you do not trust.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from plant.arrays import Array
from plant.errors import HydrostateError, LogError
from plant.log.columns import TIME, Column, resolve_columns
from plant.log.record import Record
from plant.runs import checked_series, require_finite
from plant.sensors.sensors import IDEAL, Sensors, measure

SPEED = "motor_speed_rad_s"


def simulate_fmu(
    path: Path,
    drive: Array,
    sample_time: float,
    *,
    columns: Mapping[str, str] | None = None,
    parameters: Mapping[str, float] | None = None,
    sensors: Sensors = IDEAL,
    rng: np.random.Generator | None = None,
) -> Record:
    """Run an FMU for co-simulation under a drive and return the sensors' log.

    Parameters
    ----------
    path : Path
        The FMU, of FMI 2.0 or 3.0, with a binary for this machine.
    drive : ndarray, shape (n,)
        Motor speed at the samples [rad/s], linear between; an FMU holds its inputs, so it gets the mean of each step.
    sample_time : float
        Seconds between samples [s], one communication step.
    columns : Mapping[str, str], optional
        Foreign variable for each channel, with its unit if it is not SI: ``{"position_m": "cylinder.x:mm"}``. The motor
        speed is an input; all others are outputs of the FMU.
    parameters : Mapping[str, float], optional
        Start values of the FMU's own variables [each in its own unit].
    sensors : Sensors
        Sensors of the bench; `IDEAL` by default.
    rng : numpy.random.Generator, optional
        Source of sensor noise; needed unless the sensors are ideal.

    Returns
    -------
    Record
        The run; position or velocity, and pressure if the FMU has it.

    Raises
    ------
    DriveError
        If the drive is not a finite series of at least two samples.
    HydrostateError
        If FMPy is missing, the FMU cannot be run, lacks a requested variable, or its run stops being finite.
    """
    speed, fmpy = checked_series(drive), _package()
    told = _description(path)
    if told.coSimulation is None:
        raise HydrostateError(f"{path}: an FMU for co-simulation is needed, this one is for model exchange alone")
    numbers = [one for one in told.modelVariables if one.causality in ("input", "output", "local")]
    inputs = {one.name for one in numbers if one.causality == "input"}
    names = [one.name for one in numbers if one.type in ("Real", "Float64")]
    unknown = sorted(set(parameters or {}) - {one.name for one in told.modelVariables})
    if unknown:
        raise HydrostateError(f"{path}: the FMU has no variable {unknown[0]!r}")
    found = [one for one in resolve_columns(names, columns, str(path)) if one.channel != TIME]
    seen = [one for one in found if one.name not in inputs]
    driven = [one for one in found if one.channel == SPEED and one.name in inputs]
    if len(driven) != 1 or not any(one.channel in ("position_m", "velocity_m_s") for one in seen):
        raise LogError(
            f"an FMU needs an input for {SPEED} and an output for position_m or velocity_m_s, named by `columns` where "
            f"they are called otherwise; it has inputs {', '.join(sorted(inputs)) or 'none'}",
            str(path),
        )
    run = _run(fmpy, path, speed, sample_time, driven[0], [one.name for one in seen], dict(parameters or {}))
    channels = {one.channel: run[one.name] * one.factor + one.offset for one in seen}
    require_finite(np.column_stack(list(channels.values())), sample_time, path.name)
    truth = Record(sample_time, {SPEED: speed, **channels}, {"plant": path.name, "fmu": told.modelName})
    if sensors == IDEAL and rng is None:
        return truth
    if rng is None:
        raise HydrostateError("simulate_fmu() needs rng for sensors with noise, got None")
    lacking = [name for name in ("position_m", "velocity_m_s", "differential_pressure_pa") if name not in truth]
    if lacking:
        raise LogError(f"sensors with noise need {', '.join(lacking)}, which the FMU does not give", str(path))
    return measure(truth, sensors, rng)


def fmu_variables(path: Path) -> frozenset[str]:
    """Return the names of an FMU's variables.

    Raises
    ------
    HydrostateError
        If FMPy is missing or the file is not an FMU.
    """
    return frozenset(one.name for one in _description(path).modelVariables)


def _description(path: Path) -> Any:
    fmpy = _package()
    try:
        return fmpy.read_model_description(str(path))
    except Exception as error:  # a foreign file may be wrong in any way
        reason = (error.strerror if isinstance(error, OSError) else None) or error
        raise HydrostateError(f"{path}: an FMU is needed: {reason}") from error


def _package() -> Any:
    try:
        import fmpy
    except ImportError as error:
        raise HydrostateError("a foreign FMU needs FMPy: pip install 'hydrostate[fmu]'") from error
    return fmpy


def _run(
    fmpy: Any, path: Path, speed: Array, sample_time: float, driven: Column, wanted: list[str], start: dict[str, float]
) -> Mapping[str, Array]:
    """Return the requested variables at every sample, by name."""
    time = sample_time * np.arange(len(speed))
    foreign = (speed - driven.offset) / driven.factor
    foreign[:-1] = 0.5 * (foreign[:-1] + foreign[1:])
    signals = np.array(list(zip(time, foreign, strict=True)), dtype=[("time", float), (driven.name, float)])
    span: dict[str, Any] = {"start_time": 0.0, "stop_time": time[-1], "step_size": sample_time}
    try:
        with np.errstate(all="ignore"):
            found = fmpy.simulate_fmu(
                str(path),
                **span,
                output_interval=sample_time,
                input=signals,
                output=wanted,
                start_values=start,
                fmi_type="CoSimulation",
            )
    except Exception as error:  # a foreign program may fail in any way
        raise HydrostateError(f"{path}: the FMU stopped: {error}") from error
    if len(found) != len(speed):
        raise HydrostateError(f"{path}: {len(speed)} samples are needed, the FMU gave {len(found)}")
    return {name: np.asarray(found[name], np.float64) for name in wanted}
