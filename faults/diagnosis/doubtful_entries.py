"""Entries of a rig file that contradict each other."""

from faults.diagnosis.circuits.actuator import with_room_for_stroke
from faults.notes import ClassCode
from plant.eha.model import EhaParameters
from plant.notes import Note

PUMP_AND_PISTON, ANOTHER = ("pump_displacement", "piston_area"), 0.1
"""Entries that define the actuator, and the share by which they must differ for it to be another one [fraction]:
judged, twice the usual error of an area."""

HEALTHY_ENTRIES = ("leakage_coefficient", "flow_bias", "friction_quadratic", "friction_linear", "friction_coulomb")
"""Entries that a class and its severities are relative to."""


def doubtful_entries(p: EhaParameters) -> tuple[Note, ...]:
    """Return notes on entries of a rig file that contradict each other."""
    larger = with_room_for_stroke(p).chamber_volume / p.chamber_volume - 1.0
    tight = (ClassCode.VOLUME_FOR_STROKE.note(percent=100.0 * larger),) if larger > 0.0 else ()
    return (*_healthy_of_the_paper(p), *tight, *_makeup_too_small(p))


def _healthy_of_the_paper(p: EhaParameters) -> tuple[Note, ...]:
    """Return a note if a rig file has another pump or piston than the paper's, but the paper's healthy values."""
    of_paper = EhaParameters()
    another = any(abs(getattr(p, name) / getattr(of_paper, name) - 1.0) > ANOTHER for name in PUMP_AND_PISTON)
    left = all(getattr(p, name) == getattr(of_paper, name) for name in HEALTHY_ENTRIES)
    return (ClassCode.HEALTHY_OF_THE_PAPER.note(),) if another and left else ()


def _makeup_too_small(p: EhaParameters) -> tuple[Note, ...]:
    """Return a note if a single rod's flow through its make-up valves needs more pressure than there is."""
    share = abs(p.area_difference)
    flow, most = 2.0 * share / (1.0 + share) * p.rated_flow, p.makeup_conductance * p.accumulator_pressure
    if not 0.0 < most < flow:
        return ()
    return (ClassCode.MAKEUP_TOO_SMALL.note(drop_pa=flow / p.makeup_conductance, has_pa=p.accumulator_pressure),)
