"""The channel guessed for each heading, and the usual magnitudes, kept in `numbers_headings.json`."""

from typing import Any

import numpy as np
import pytest

from plant.log import any_columns
from plant.log.columns import check_columns, list_in_words, parse_columns, resolve_columns
from plant.log.guess import NAMES, guess_by_name, hint_of, missing_channels, points_by_name
from plant.log.headings import Heading, is_unit
from plant.log.plausibility import LIMITS, implausibility_notes, require_measurable
from plant.log.table import table_of
from tests.edges import edge
from tests.numbers import Numbers, or_refused

NUMBERS = Numbers(__file__)


@NUMBERS.case()
def channels_of_headings() -> dict[str, Any]:
    names = (
        "t",
        "Zeit [ms]",
        "motor_speed_rpm",
        "n",
        "Drehzahl [U/min]",
        "speed [mm/s]",
        "Weg [mm]",
        "pos soll",
        "x",
        "POS_MM",
        "v",
        "Kolben v [m/s]",
        "p",
        "dp [bar]",
        "pA [bar]",
        "druck_b",
        "press 1",
        "U_mot [V]",
        "volt",
        "temp [degC]",
        "position_m",
        "position",
        "motor speed error",
        "lvdt",
        "v_ist",
        "last_druck",
        "stack_displacement_um",
        "stack force",
        "electrode 3 [mV]",
        "chamber_pressure",
        "x_piston",
        "extension rod",
        "w",
    )
    headings = [Heading(one) for one in names]
    channels = (*NAMES, "stack_displacement_m", "electrode_3_v")
    return {
        "points": {
            one.name: {channel: points for channel in channels if (points := points_by_name(one, channel))}
            for one in headings
        },
        "stamped": [points_by_name(Heading("x", stamped=True), channel) for channel in ("time_s", "position_m")],
        "guessed": [[one.channel, one.place, one.spec, one.points, one.sure] for one in guess_by_name(headings)],
        "guessed of few": [
            [one.channel, one.spec, one.sure]
            for one in guess_by_name([Heading("Weg [mm]"), Heading("pos"), Heading("x")])
        ],
        "hints": [
            hint_of(channels, headings[at:])
            for channels, at in ((["position_m"], 6), (["velocity_m_s", "motor_speed_rad_s"], 3), (["position_m"], 8))
        ],
        "missing": str(missing_channels(["time_s", "position_m or velocity_m_s"], headings[:4], "a")),
        "units": [is_unit(one) for one in ("mm", "kPa", "l/min", "foo", "[bar]", "9", "°C", "%", "m m", "kg*m/s^2")],
        "listed": [list_in_words([f"a{k}" for k in range(count)], 3) for count in (0, 2, 3, 4, 9)],
        "a long name": list_in_words(["x" * 50]),
    }


@NUMBERS.case()
def columns_of_logs() -> dict[str, Any]:
    def told(names: Any, mapping: Any = None) -> Any:
        return or_refused(
            lambda: [
                {"at": one.position, "channel": one.channel, "factor": one.factor, "offset": one.offset}
                for one in resolve_columns(names, mapping, "a")
            ]
        )

    return {
        "own": told(
            ["time_ms", "motor_speed_rpm", "Position [mm]", "velocity_m_s", "pressure_a_bar", "note", "true_x", "true_"]
        ),
        "with other units": told(
            ["t [min]", "Motor speed (U/min)", "velocity_mm_per_s", "motor_voltage_mv", "stack_force_kn"]
        ),
        "mapped": told(["T", "POS", "N"], {"time_s": "T:ms", "position_m": "POS:mm", "motor_speed_rad_s": "N:-rpm"}),
        "mapped, with a unit of the file": told(["T [us]", "a:b"], {"time_s": "T", "position_m": "a:b"}),
        "stamped": told([Heading("when", stamped=True), Heading("position_mm")]),
        "twice stamped": told([Heading("when", stamped=True), Heading("then", stamped=True), Heading("t [s]")]),
        "two of one": told(["position_mm", "position_m"]),
        "one mapped, one strange": told(["position_foo", "POS"], {"position_m": "POS:mm"}),
        "strange alone": told(["position_foo"]),
        "missing": told(["a"], {"position_m": "b"}),
        "double": told(["a", "a"], {"position_m": "a"}),
        "unknown": told(["a"], {"positoin_m": "a"}),
        "a wrong unit": told(["a"], {"position_m": "a:bar"}),
        "a unit against its name": told(["position_m [mm]", "position_m [m]"]),
        "powers": told(["acceleration_m_s2", "velocity_m_s"]),
        "checked": [
            or_refused(lambda one=one: check_columns(one))
            for one in (
                {"position_m": "X:mm"},
                {"position_m": ":mm"},
                {"x_m": "X"},
                {"position_m": "X:bar"},
                {"true_x": "X:foo"},
            )
        ],
        "parsed": [
            or_refused(lambda one=one: parse_columns(one))
            for one in (["position_m = X:mm"], ["position_m"], ["=X"], ["position_m=X", "position_m=Y"])
        ],
    }


@NUMBERS.case()
def usual_sizes() -> dict[str, Any]:
    wave = np.sin(0.02 * np.arange(700.0))
    told: dict[str, Any] = {}

    def notes(sample_time: float = 1e-3, **channels: Any) -> list[str]:
        return [f"{one.code} {one.data.get('channel', '')}" for one in implausibility_notes(sample_time, channels)]

    for name, limits in LIMITS.items():
        told[name] = [
            edge(lambda one, name=name: notes(**{name: one * wave}), low, high)
            for low, high in ((0.01 * limits.least, 3.0 * limits.least), (0.2 * limits.most, 9.0 * limits.most))
        ]
        told[f"{name}, data"] = [
            dict(one.data)
            for size in (1e-9 * limits.least, 1e3 * limits.most)
            for one in implausibility_notes(1e-3, {name: size * wave})
        ]
    motion = {"position_m": 0.05 * wave, "velocity_m_s": 0.05 * 20.0 * np.cos(0.02 * np.arange(700.0))}
    told["position over velocity"] = [
        edge(lambda one: notes(**{**motion, "velocity_m_s": one * motion["velocity_m_s"]}), low, high)
        for low, high in ((1e-3, 0.5), (2.0, 9.0))
    ]
    slow = {"position_m": 5e-5 * wave, "velocity_m_s": 1e-3 * np.cos(0.02 * np.arange(700.0))}
    told["velocity over position"] = [
        edge(lambda one: notes(**{**slow, "velocity_m_s": one * slow["velocity_m_s"]}), 2.0, 300.0)
    ]
    told["travel"] = [
        edge(lambda one: notes(velocity_m_s=one * wave, motor_speed_rad_s=1.0 * wave), 1e-2, 0.9),
        edge(lambda one: notes(velocity_m_s=1e-4 * wave, motor_speed_rad_s=one * wave), 5.0, 1900.0),
    ]
    told["travel of small ways"] = edge(
        lambda one: notes(velocity_m_s=one * wave, motor_speed_rad_s=100.0 * wave), 2e-5, 1e-2
    )
    told["travel by position"] = edge(
        lambda one: notes(position_m=one * wave, motor_speed_rad_s=100.0 * np.cos(0.02 * np.arange(700.0))), 2e-6, 1e-2
    )
    other = np.cos(0.073 * np.arange(700.0))
    told["shapes alike from"] = edge(
        lambda one: notes(velocity_m_s=0.5 * wave, motor_speed_rad_s=one * wave + (1.0 - one**2) ** 0.5 * other),
        0.05,
        0.999,
    )
    told["sums alike from"] = edge(
        lambda one: notes(
            position_m=1e-3 * wave,
            motor_speed_rad_s=1.0 * np.gradient(one * wave + (1.0 - one**2) ** 0.5 * other) * 100.0,
            sample_time=1e-5,
        ),
        0.3,
        0.999,
    )
    noise = np.random.default_rng(1).standard_normal(700)
    told["above noise from"] = edge(lambda one: notes(position_m=1e-7 * (0.3 * noise + one * wave)), 0.01, 3.0)
    told["sample times [s]"] = [
        edge(lambda one: notes(one, motor_speed_rad_s=100.0 * wave), low, high)
        for low, high in ((1e-7, 1e-3), (1e-3, 9.0))
    ]
    told["still"] = [
        notes(**channels)
        for channels in (
            {"motor_speed_rad_s": np.ones(9), "velocity_m_s": np.arange(9.0)},
            {"motor_speed_rad_s": np.arange(9.0), "position_m": np.ones(9), "velocity_m_s": np.zeros(9)},
            {"position_m": np.ones(9), "velocity_m_s": np.arange(9.0)},
            {"motor_speed_rad_s": np.ones(9), "position_m": np.ones(9)},
        )
    ]
    told["measurable"] = [
        edge(lambda one: or_refused(lambda: require_measurable({"x": np.array([0.0, -one])}, "a")) is None, low, high)
        for low, high in ((1e-33, 1e-28), (1e13, 1e17))
    ]
    told["of a few"] = [notes(position_m=np.arange(n) * 1.0, velocity_m_s=np.arange(n) * 900.0) for n in (2, 3, 9)]
    return told


@NUMBERS.case()
def columns_of_anything() -> dict[str, Any]:
    table = table_of(
        "a",
        {
            "time_ms": np.arange(9.0),
            "x": 2.0 * np.arange(9.0),
            "position_mm": np.arange(9.0),
            "note": np.array(["a"] * 9, dtype=object),
        },
    )
    headings = list(table.headings)

    def named(name: str) -> Any:
        return or_refused(
            lambda: {
                "at": any_columns._column_named(table, headings, name, "a").position,
                "factor": any_columns._column_named(table, headings, name, "a").factor,
            }
        )  # pyright: ignore[reportPrivateUsage]

    units = (
        "t",
        "time [ms]",
        "t_us",
        "zeit_min",
        "Time (h)",
        "t_usec",
        "t_msec",
        "timestamp_sec",
        "t_seconds",
        "t_second",
        "t [foo]",
        "x",
    )
    dates: Any = np.array(["2026-03-01T00:00:00", "NaT", "2026-03-01T00:00:02.5"], dtype="datetime64[ns]")
    dated = table_of("a", {"t": dates})
    wanted = any_columns._wanted_columns(table, headings, None, ["x", "position_m", "x"], "a")  # pyright: ignore[reportPrivateUsage]
    return {
        "named": {name: named(name) for name in ("x", "X", "position_m", "velocity_m_s", "noet", "zzz")},
        "time columns": [
            None if (one := any_columns._time_column([Heading(unit)])) is None else [one.factor, one.channel]
            for unit in units
        ],  # pyright: ignore[reportPrivateUsage]
        "every": list(any_columns._all_columns(table, headings, None)),  # pyright: ignore[reportPrivateUsage]
        "wanted": {name: values[:3] for name, values in wanted.items()},
        "text": or_refused(lambda: any_columns._wanted_columns(table, headings, None, ["note"], "a")),  # pyright: ignore[reportPrivateUsage]
        "seconds": any_columns._in_seconds(dates, any_columns.Column(0, "t", "time_s"), dated.headings[0])[0],  # pyright: ignore[reportPrivateUsage]
        "table of most": [any_columns._table((table, dated), names).headings[0].name for names in (None, ["t"], ["X"])],  # pyright: ignore[reportPrivateUsage]
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
