"""The piezo-stack actuator as a kind: the options it understands and what they do."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from estimation.finding import Finding
from estimation.piezo_stack.finding import stack_finding, stack_prospect
from experiments.actuator_kind import ActuatorKind, Experiment, LogVerb, Options, Run, Simulation
from experiments.command.json_output import Result
from experiments.command.options import split_names
from experiments.command.terminal import short_names, table
from experiments.log_pages.entries import BLANK, finding_entries
from experiments.log_pages.screens import messages_shown
from experiments.page.condition_names import condition_in_words
from faults.conditions import CONDITIONS
from faults.piezo_stack.diagnose import calibrated_stack, diagnose_stack
from faults.piezo_stack.faults import stack_with_fault
from plant.eha.rig import UNNAMED, Rig
from plant.errors import HydrostateError, require_known
from plant.log.columns import CHANNELS
from plant.notes import Code
from plant.piezo_stack.flow import FLOW_TIME, mean_flow
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.piezo_stack.run import SAMPLE_TIME, STACK_SENSORS, simulate_stack, sine_drive
from plant.piezo_stack.trajectory import NAME
from plant.units import LITRE_PER_MINUTE

if TYPE_CHECKING:
    from rich.console import RenderableType

DRIVE = "drive_voltage_v"

SENSORS: Mapping[str, str] = {
    "stack": "stack_displacement_m",
    "force": "stack_force_n",
    "position": "position_m",
    "pressure": "chamber_pressure_pa",
}
"""Channels by the names of ``--sensors``."""

SINE = {"frequency": 275.0, "voltage": 140.0}
"""The default drive: frequency [Hz], voltage peak to peak [V]."""

BENCH = {"sensors": "bench", "duration": None, "sample_time": SAMPLE_TIME}
"""Default sensors, duration [s] and sample time [s]."""

RUN_OPTIONS = {"bias_pressure": None, "load": None}
"""Operating conditions of a run; by default the rig's own."""


class StackRunCode(Code):
    """Notes on a simulated run."""

    END_STOP_REACHED = "the rod reaches its end stop within {duration_s:g} s: the flow is then that of a rod at rest"


def _simulate(rig: Rig[Any], options: Options) -> Run:
    require_known("--sensors", options["sensors"], list(STACK_SENSORS))
    if options["condition"] is not None and options["fault"] is not None:
        raise HydrostateError("a --condition or a --fault is needed, got both")
    fault = options["condition"] or options["fault"] or "normal"
    healthy = _at_operating_point(rig, options).parameters
    frequency, swing, between = (options[name] for name in ("frequency", "voltage", "sample_time"))
    drive = sine_drive(frequency, swing, options["duration"] or FLOW_TIME, between)
    rng, sensors = np.random.default_rng(options["seed"]), STACK_SENSORS[options["sensors"]]
    record = simulate_stack(stack_with_fault(healthy, fault), drive, between, sensors=sensors, rng=rng)
    made_of = {"fault": fault, "frequency_hz": frequency, "voltage_v": swing, "load_kg": healthy.load_mass}
    made_of |= {"seed": options["seed"]}
    end = healthy.cylinder_length - healthy.cylinder_start - 2.0 * healthy.end_clearance
    stopped = float(record["position_m"].max()) > end
    flow = mean_flow(record["position_m"], between, frequency, healthy.cylinder_area) / LITRE_PER_MINUTE
    return Run(
        record.annotate(**made_of),
        {**made_of, "sensors": options["sensors"], "flow_l_min": round(flow, 4)},
        (StackRunCode.END_STOP_REACHED.note(duration_s=record.duration),) if stopped else (),
    )


def _at_operating_point(rig: Rig[Any], options: Options) -> Rig[Any]:
    """Return the rig at the bias pressure and load of its runs."""
    given = {"bias_pressure": options["bias_pressure"], "load_mass": options["load"]}
    return replace(rig, parameters=replace(rig.parameters, **{n: v for n, v in given.items() if v is not None}))


def _prepare(rig: Rig[Any], options: Options) -> tuple[Rig[Any], tuple[str, ...]]:
    """Return the actuator calibrated to a healthy run, if there is one, and the channels that are used."""
    channels, healthy = _channels(options.get("sensors", "")), _at_operating_point(rig, options)
    if options["healthy"] is not None:
        healthy = replace(healthy, parameters=calibrated_stack(options["healthy"], healthy.parameters))
    return healthy, channels


def _channels(sensors: str) -> tuple[str, ...]:
    names = split_names(sensors)
    for name in names:
        if name not in SENSORS:
            raise HydrostateError(f"--sensors must be of {', '.join(SENSORS)}, got {name!r}")
    return tuple(SENSORS[name] for name in names or SENSORS)


def _prospects(rig: Rig[Any], options: Options) -> list[Finding]:
    between = 1.0 / options["rate"]
    drive = sine_drive(options["frequency"], options["voltage"], options["seconds"], between)
    return [
        stack_prospect(
            _at_operating_point(rig, options).parameters, drive, between, channels=_channels(options["sensors"])
        )
    ]


def _entries(found: Finding) -> dict[str, Any]:
    return {**finding_entries(found), "misfit": dict(found.evidence.misfit)}


def _conditions_shown(results: Sequence[Result], options: Options) -> "Iterable[RenderableType]":
    del options
    if len(results) > 1:
        shown = table("log", "condition", "verdict")
        for name, result in zip(short_names(results), results, strict=True):
            shown.add_row(name, condition_in_words(result["condition"] or "-"), result["outcome"].replace("_", " "))
        yield shown
    yield from messages_shown(results)


OF_A_LOG: Any = {"prepare": _prepare, "entries": _entries, "blank": {**BLANK, "misfit": {}}}

PIEZO_STACK = ActuatorKind(
    name=NAME,
    description="a piezo stack that pumps through reed valves into a cylinder",
    parameters=PiezoStackParameters,
    channels={name: CHANNELS[name] for name in (DRIVE, *SENSORS.values())},
    required=(DRIVE,),
    conditions=tuple(CONDITIONS),
    rig_name=UNNAMED,
    simulate=Simulation(run=_simulate, options=SINE | RUN_OPTIONS | BENCH | {"condition": None, "fault": None}),
    estimate=LogVerb(
        run=lambda record, rig, channels: stack_finding(record, rig.parameters, channels=channels),
        options=RUN_OPTIONS | {"healthy": None, "sensors": ""},
        **OF_A_LOG,
    ),
    diagnose=LogVerb(
        run=lambda record, rig, channels: diagnose_stack(record, rig.parameters, channels=channels),
        options=RUN_OPTIONS | {"healthy": None},
        screen=_conditions_shown,
        **OF_A_LOG,
    ),
    identifiability=Experiment(
        run=_prospects, options=SINE | RUN_OPTIONS | {"sensors": "", "seconds": 0.1, "rate": 1.0 / SAMPLE_TIME}
    ),
)
