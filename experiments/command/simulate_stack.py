"""`hydrostate simulate --plant piezo-stack`: a run of the piezo-stack actuator, as its bench would have logged it."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from experiments.command.options import require_one_of
from experiments.command.streams import note
from faults.piezo_stack import stack_with_fault
from plant.errors import HydrostateError
from plant.piezo_stack_flow import FLOW_TIME, mean_flow
from plant.piezo_stack_parameters import PiezoStackParameters
from plant.piezo_stack_run import SAMPLE_TIME, STACK_SENSORS, simulate_stack, sine_drive
from plant.piezo_stack_trajectory import NAME
from plant.record import Record
from plant.units import LITRE_PER_MINUTE

DEFAULTS: Mapping[str, float] = {"--frequency": 275.0, "--voltage": 140.0, "--bias-pressure": 1e6, "--load": 0.0}
"""What options are where they are not given: frequency [Hz], voltage [V], pressure [Pa], load [kg]."""


def simulated_stack(
    options: Mapping[str, Any],
    condition: str | None,
    duration: float | None,
    sample_time: float | None,
    sensors: str,
    seed: int,
) -> tuple[Record, dict[str, Any]]:
    """Return a run of the piezo-stack actuator, and what made it.

    Parameters
    ----------
    options : Mapping[str, Any]
        The plant's own options by name, None where not given.
    condition : str or None
        One of the nine conditions, in place of a fault.
    duration, sample_time : float or None
        Length and time between samples [s]; the bench's if not given.
    sensors : str
        ``bench`` or ``ideal``.
    seed : int
        Seed of the noise.

    Returns
    -------
    tuple of Record and dict[str, Any]
        The run, and what to say of it.

    Raises
    ------
    HydrostateError
        If an option is not usable, or both a condition and a fault are given.
    """
    require_one_of("--sensors", sensors, list(STACK_SENSORS))
    if condition is not None and options["--fault"] is not None:
        raise HydrostateError("a --condition or a --fault is wanted, got both")
    fault = condition or options["--fault"] or "normal"
    chosen = {name: value if options[name] is None else float(options[name]) for name, value in DEFAULTS.items()}
    frequency, swing, bias, load = chosen.values()
    healthy = replace(PiezoStackParameters(), bias_pressure=bias, load_mass=load)
    between = sample_time or SAMPLE_TIME
    drive = sine_drive(frequency, swing, duration or FLOW_TIME, between)
    record = simulate_stack(
        stack_with_fault(healthy, fault),
        drive,
        between,
        sensors=STACK_SENSORS[sensors],
        rng=np.random.default_rng(seed),
    )
    made_of = {"fault": fault, "frequency_hz": frequency, "voltage_v": swing, "load_kg": load, "seed": seed}
    if (
        float(record["position_m"].max())
        > healthy.cylinder_length - healthy.cylinder_start - 2.0 * healthy.end_clearance
    ):
        note(f"the rod reaches its end stop within {record.duration:g} s: the flow is that of a rod that stands")
    flow = mean_flow(record["position_m"], between, frequency, healthy.cylinder_area) / LITRE_PER_MINUTE
    said = {"plant": NAME, **made_of, "sensors": sensors, "flow_l_min": round(flow, 4)}
    return record.annotate(**made_of), said
