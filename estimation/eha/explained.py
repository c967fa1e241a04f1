"""What a log that the plain flow form does not explain says of its rig and logger, in notes; and the log set right."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from estimation.fits.hypotheses import Explanation
from estimation.log_checks.clean import CleanLog
from estimation.log_checks.sensor_check import PRESSURE
from estimation.notes import RigCode
from plant.arrays import Array
from plant.components.oil import ATMOSPHERE
from plant.eha.model import EhaParameters
from plant.log.record import Record
from plant.notes import Note

Values = Mapping[str, tuple[float, float]]

WORN = 0.9
"""Delivery over the pump's displacement below which the pump counts as worn, and not the rig file as rounded."""

OUTSIDE = {RigCode.PUMP_WORN, RigCode.LEAKAGE_GROWS, RigCode.MAKEUP_BLOCKED, RigCode.PORT_DRAINS}
"""Faults that are none of the nine conditions."""


def notes_of(found: Explanation, parameters: EhaParameters) -> tuple[Note, ...]:
    """Return what explains a log, each with its value and 95 % half width.

    Parameters
    ----------
    found : Explanation
        The hypotheses that were accepted.
    parameters : EhaParameters
        The rig.

    Returns
    -------
    tuple of Note
        One a hypothesis, and one where others explain the log about as well.
    """
    notes = [_NOTES[name](found, parameters) for name in found.names]
    if found.rivals:
        notes.append(RigCode.EXPLAINED_OTHERWISE.note(count=found.rivals))
    return tuple(notes)


def _half_width(found: Explanation, name: str) -> float:
    return 1.96 * found.values[name][1]


def _late(found: Explanation, _: EhaParameters) -> Note:
    late = found.delay + found.values["pressure_lag"][0]
    return RigCode.PRESSURE_LATE.note(late_ms=1e3 * late, half_width_ms=1e3 * _half_width(found, "pressure_lag"))


def _offset(found: Explanation, _: EhaParameters) -> Note:
    value = found.values["pressure_offset"][0]
    return RigCode.PRESSURE_OFFSET.note(offset_pa=value, half_width_pa=_half_width(found, "pressure_offset"))


def _zero(found: Explanation, _: EhaParameters) -> Note:
    value = found.values["position_zero"][0]
    return RigCode.ENCODER_ZERO.note(zero_mm=1e3 * value, half_width_mm=1e3 * _half_width(found, "position_zero"))


def _delivery(found: Explanation, p: EhaParameters) -> Note:
    value = found.values["pump_displacement"][0]
    share, half_width = value / p.pump_displacement, _half_width(found, "pump_displacement") / p.pump_displacement
    code = RigCode.PUMP_WORN if share < WORN else RigCode.AREA_TO_DISPLACEMENT
    return code.note(percent=100.0 * share, half_width=100.0 * half_width)


def _volume(found: Explanation, p: EhaParameters) -> Note:
    value = found.values["chamber_volume"][0]
    half_width = _half_width(found, "chamber_volume") / p.chamber_volume
    return RigCode.VOLUME_DIFFERS.note(percent=100.0 * value / p.chamber_volume, half_width=100.0 * half_width)


def _load(found: Explanation, p: EhaParameters) -> Note:
    value = found.values["start_pressure"][0]
    return RigCode.STARTS_UNDER_LOAD.note(pressure_pa=value, force_n=value * p.piston_area)


def _air(found: Explanation, _: EhaParameters) -> Note:
    softness, std = found.values["air_softness"]
    return RigCode.AIR_ENTRAINED.note(
        percent=100.0 * softness / ATMOSPHERE,
        half_width=196.0 * std / ATMOSPHERE,
        liquid_pa=found.values["bulk_modulus"][0],
    )


def _growth(found: Explanation, _: EhaParameters) -> Note:
    first = found.values["leakage_coefficient"][0]
    growth = found.values["leakage_growth"][0] + found.values["leakage_bend"][0]
    return RigCode.LEAKAGE_GROWS.note(factor=1.0 + growth, first=first, last=first * (1.0 + growth))


def _blocked(found: Explanation, _: EhaParameters) -> Note:
    return RigCode.MAKEUP_BLOCKED.note(side="B" if found.values["makeup_share_b"][0] < 1.0 else "A")


def _crack(found: Explanation, _: EhaParameters) -> Note:
    value = found.values["crack_pressure"][0]
    return RigCode.CHECKS_CRACK.note(crack_pa=value, half_width_pa=_half_width(found, "crack_pressure"))


def _drains(side: str) -> Callable[[Explanation, EhaParameters], Note]:
    def note(found: Explanation, _: EhaParameters) -> Note:
        share = found.values[f"drain_share_{side}"][0]
        return RigCode.PORT_DRAINS.note(side=side.upper(), drain=share * found.values["case_leakage"][0])

    return note


_NOTES: Mapping[str, Callable[[Explanation, EhaParameters], Note]] = {
    "pressure_late": _late,
    "pressure_offset": _offset,
    "encoder_zero": _zero,
    "delivery": _delivery,
    "volume": _volume,
    "start_load": _load,
    "air": _air,
    "leakage_growth": _growth,
    "makeup_blocked": _blocked,
    "checks_crack": _crack,
    "port_a_drains": _drains("a"),
    "port_b_drains": _drains("b"),
}


def set_right(log: CleanLog, found: Explanation) -> CleanLog:
    """Return a log as its channels would be without the sensors' offsets and delays that explain it.

    Parameters
    ----------
    log : CleanLog
        The log.
    found : Explanation
        What explains it.

    Returns
    -------
    CleanLog
        The log; pressures at its end that are not known any more are missing.
    """
    value = {name: pair[0] for name, pair in found.values.items()}
    record, changed = log.record, dict[str, Array]()
    if zero := value.get("position_zero", 0.0):
        changed["position_m"] = record["position_m"] - zero
    late, offset = found.delay + value.get("pressure_lag", 0.0), value.get("pressure_offset", 0.0)
    if late or offset:
        changed[PRESSURE] = _brought_forward(record, PRESSURE, late) - offset
    return replace(log, record=record.replace(**changed))


def _brought_forward(record: Record, channel: str, late: float) -> Array:
    times = np.arange(len(record)) * record.sample_time
    return np.interp(times + late, times, record[channel], right=np.nan)


def rig_set_right(parameters: EhaParameters, found: Explanation) -> EhaParameters:
    """Return the rig with the pump's delivery and the chambers' volume that explain a log.

    Parameters
    ----------
    parameters : EhaParameters
        What the rig file says.
    found : Explanation
        What explains the log.

    Returns
    -------
    EhaParameters
        The rig.
    """
    names = [name for name in ("pump_displacement", "chamber_volume") if name in found.values]
    return replace(parameters, **{name: found.values[name][0] for name in names})
