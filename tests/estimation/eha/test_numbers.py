"""Explanations of a log, and the rig file's share in a result, kept in `numbers.json`."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimation.eha import explanation_notes
from estimation.eha.changing_leakage import relative_leakage
from estimation.eha.explanation_notes import corrected_log, corrected_rig, notes_of
from estimation.eha.rig_share import GAIN, rig_notes, scaled_responses, with_total
from estimation.finding import Quantity
from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.log_checks.clean import CleanLog
from plant.eha.doubts import PRESSURE_GAIN
from plant.eha.model import EhaParameters
from plant.log.record import Record
from tests.edges import edge
from tests.numbers import Numbers

NUMBERS = Numbers(__file__)
P = EhaParameters()
PRESSURE, SPEED, POSITION, VELOCITY = "differential_pressure_pa", "motor_speed_rad_s", "position_m", "velocity_m_s"
N = 60


def explanation(
    names: tuple[str, ...], delays: dict[str, float] | None = None, rivals: tuple[str, ...] = (), **values: Any
) -> Explanation:
    fit: Any = None
    return Explanation(names, values, {PRESSURE: 0.0, **(delays or {})}, (fit,), rivals, 3e5)


VALUES: dict[str, tuple[float, float]] = {
    "pressure_lag": (1e-3, 1e-4),
    "speed_lag": (2e-3, 2e-4),
    "position_lag": (3e-3, 3e-4),
    "pressure_offset": (-1e5, 2e3),
    "pressure_drift": (5e4, 1e3),
    "pressure_sides": (0.01, 1e-4),
    "position_zero": (4e-3, 1e-4),
    "position_play": (5e-5, 1e-6),
    "pump_displacement": (0.8 * P.pump_displacement, 0.01 * P.pump_displacement),
    "chamber_volume": (1.3 * P.chamber_volume, 0.02 * P.chamber_volume),
    "area_difference": (0.25, 0.01),
    "volume_difference": (-0.2, 0.1),
    "pilot_share": (1.0, 0.1),
    "start_pressure": (5e5, 1e3),
    "start_level": (2e5, 1e3),
    "air_softness": (300.0, 20.0),
    "bulk_modulus": (1.5e8, 1e6),
    "relief_pressure": (2e6, 1e4),
    "leakage_coefficient": (2e-11, 1e-12),
    "makeup_share_b": (0.1, 0.01),
    "crack_pressure": (2e4, 1e3),
    "crack_difference": (-5e3, 5e2),
    "leakage_before": (-0.8, 0.01),
    "step_at": (0.4, 1e-3),
    "step_width": (1e-3, 1e-4),
    "makeup_bend": (5e-5, 1e-5),
    "case_leakage": (4e-12, 1e-13),
    "drain_share_a": (1.7, 0.1),
    "drain_share_b": (0.3, 0.1),
    "leakage_growth": (0.4, 0.05),
    "leakage_rise": (0.1, 0.05),
    "leakage_turbulent": (0.3, 0.05),
    "pump_compression": (1.1, 0.1),
}


@NUMBERS.case()
def what_explains_a_log() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name in explanation_notes._NOTES:  # pyright: ignore[reportPrivateUsage]
        delays = {PRESSURE: 2e-3, SPEED: 1e-3, POSITION: 4e-3}
        (note,) = notes_of(explanation((name,), delays, **VALUES), P)
        told[name] = {"code": str(note.code), **note.data}

    def code(name: str, **changed: float) -> str:
        values = VALUES | {key: (value, 0.01) for key, value in changed.items()}
        return str(notes_of(explanation((name,), **values), P)[0].code)

    rivals = notes_of(explanation(("volume",), None, ("encoder_zero", "air and volume"), **VALUES), P)
    midway = notes_of(explanation(("air_midway",), air_onset=(0.4, 0.01), **VALUES), P)[0]
    return {
        **told,
        "rivals": [[str(one.code), dict(one.data)] for one in rivals],
        "air midway": [str(midway.code), dict(midway.data)],
        "worn from a share of": edge(
            lambda one: code("delivery", pump_displacement=one * P.pump_displacement), 0.5, 1.2
        ),
        "grows from": edge(lambda one: code("leakage_growth", leakage_growth=one, leakage_rise=0.0), 0.0, 1.9),
        "shrinks from": edge(lambda one: code("leakage_growth", leakage_growth=-one, leakage_rise=0.0), 0.0, 1.9),
        "blocked side": [
            notes_of(explanation(("makeup_blocked",), **(VALUES | {"makeup_share_b": (one, 0.0)})), P)[0].data["side"]
            for one in (0.5, 1.0, 3.0)
        ],
        "least leakage": relative_leakage(explanation((), leakage_growth=(5.0, 0.1)), np.array([0.0, 0.5, 1.0])),
    }


@NUMBERS.case()
def logs_that_are_set_right() -> dict[str, Any]:
    k = np.arange(float(N))
    record = Record(
        1e-2,
        {
            SPEED: np.sin(0.3 * k),
            POSITION: 0.01 * np.sin(0.1 * k),
            VELOCITY: 0.1 * np.cos(0.1 * k),
            PRESSURE: 1e5 * np.cos(0.2 * k),
        },
    )
    log = CleanLog(record, {}, (), ())
    changes: dict[str, Any] = {
        "nothing": {},
        "zero": {"position_zero": (4e-3, 0.0)},
        "play": {"position_play": (5e-5, 0.0)},
        "offset": {"pressure_offset": (-1e5, 0.0)},
        "drift": {"pressure_drift": (5e4, 0.0)},
        "late pressure": {"pressure_lag": (2.5e-2, 0.0)},
        "late speed": {"speed_lag": (1.5e-2, 0.0)},
        "late position": {"position_lag": (3e-2, 0.0), "position_zero": (1e-3, 0.0)},
        "leakage": {"leakage_growth": (0.4, 0.0)},
    }
    told: dict[str, Any] = {}
    for name, values in changes.items():
        found = corrected_log(log, explanation((), **values)).record
        told[name] = {
            one: found[one][[0, 7, 30, 58, 59]]
            for one in found
            if one not in record or not np.array_equal(found[one], record[one])
        }
    own = record.replace(**{VELOCITY: 0.1 * np.cos(0.1 * (k - 3.0))})
    late = corrected_log(replace(log, record=own), explanation((), {POSITION: 3e-2})).record
    told["velocity that is late too"] = late[VELOCITY][[0, 7, 30, 59]]
    told["without velocity"] = list(
        corrected_log(replace(log, record=record.replace(velocity_m_s=None)), explanation((), {POSITION: 3e-2})).record
    )
    right = corrected_rig(P, explanation((), **VALUES))
    told["rig"] = {name: getattr(right, name) for name in explanation_notes.RIG_ENTRIES}
    return told


@NUMBERS.case()
def what_is_owed_to_the_rig() -> dict[str, Any]:
    spreads = {
        "chamber_volume": (0.05, 0.08),
        "pump_displacement": (0.02, 0.01),
        "piston_area": (0.01, 0.01),
        PRESSURE_GAIN: (0.005, 0.005),
        "moving_mass": (0.1, 0.1),
    }
    one = Quantity.normal(2e8, 1e6, "Pa")
    told: dict[str, Any] = {"gain": dict(GAIN)}
    for pressure in (True, False):
        responses = scaled_responses(
            P, {"leakage_coefficient": 2e-11, "flow_bias": 1e-8, "bulk_modulus": 1.5e8}, pressure=pressure
        )
        told[f"with pressure {pressure}"] = {name: dict(some) for name, some in responses.items()}
        told[f"total, with pressure {pressure}"] = {
            name: list(with_total(one, some, spreads).ci95_total or ()) for name, some in responses.items()
        }
    responses = {"chamber_volume": 1.0, "pump_displacement": -1.0}
    near = Quantity.normal(1e-11, 4e-12, "m^3/(s Pa)")
    total = with_total(one, responses, spreads)
    (note,) = rig_notes("bulk_modulus", total, responses, spreads)

    def noted(std: float) -> int:
        return len(rig_notes("x", with_total(Quantity.normal(2e8, std, "Pa"), responses, spreads), responses, spreads))

    return told | {
        "near zero": [
            list(with_total(near, {"pump_displacement": 9.0}, {"pump_displacement": (0.2, 0.2)}, size).ci95_total or ())
            for size in (None, 3e-11)
        ],
        "negative": list(with_total(Quantity.normal(-2.0, 0.1, "1"), responses, spreads).ci95_total or ()),
        "of nothing": [
            with_total(one, None, spreads).ci95_total,
            list(with_total(one, {"x": 1.0}, spreads).ci95_total or ()),
        ],
        "note": dict(note.data),
        "noted to a deviation of": edge(noted, 1e5, 1e8),
        "not noted": [len(rig_notes("x", quantity, responses, spreads)) for quantity in (one, Quantity(None, "Pa"))],
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
