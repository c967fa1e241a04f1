"""Tests of a sensor's scale in the unit of a column."""

from pathlib import Path

import numpy as np
import pytest

from plant.eha.rig import read_rig
from plant.errors import RigError
from plant.log.columns import check_columns
from plant.log.files import read_record
from plant.log.scale import conversion_of

PRESSURE = "differential_pressure_pa"


@pytest.mark.parametrize(
    ("unit", "wanted", "logged", "factor", "offset"),
    [
        ("50 bar", "Pa", None, 5e6, 0.0),
        ("50bar", "Pa", None, 5e6, 0.0),
        ("50 bar/V", "Pa", None, 5e6, 0.0),
        ("50 bar/V", "Pa", "V", 5e6, 0.0),
        ("50 bar/V", "Pa", "mV", 5e3, 0.0),
        ("15.625 bar/mA - 62.5 bar", "Pa", None, 1.5625e6, -6.25e6),
        ("-50 bar/V + 1e5 Pa", "Pa", "V", -5e6, 1e5),
        ("20 mm/V - 0.01 m", "m", None, 0.02, -0.01),
        ("10 mm/s", "m/s", None, 0.01, 0.0),
        ("10 mm/s/V", "m/s", None, 0.01, 0.0),
        ("100 rpm/V", "rad/s", "V", 100.0 * np.pi / 30.0, 0.0),
        ("mm", "m", None, 1e-3, 0.0),
        ("-bar", "Pa", None, -1e5, 0.0),
        ("1/min", "rad/s", None, np.pi / 30.0, 0.0),
    ],
)
def test_a_sensor_scale_gives_the_factor_and_offset_to_si(
    unit: str, wanted: str, logged: str | None, factor: float, offset: float
) -> None:
    assert conversion_of(unit, wanted, logged) == pytest.approx((factor, offset), rel=1e-12)


@pytest.mark.parametrize(
    ("unit", "said"),
    [
        ("V", "give the sensor's scale, as in 50 bar/V"),
        ("50 bar/furlong", "must convert to 'Pa', or to that for each V or A"),
        ("50 mm/V", "'mm' does not convert to 'Pa'"),
        ("0 bar", "must be a finite number that is not zero"),
        ("1e999 bar", "must be a finite number that is not zero"),
        ("50 bar - 3", "cannot|unknown|50 bar - 3"),
        ("50 bar*9**9**9", "unknown"),
    ],
)
def test_an_invalid_sensor_scale_is_refused_with_a_reason(unit: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        conversion_of(unit, "Pa")
    with pytest.raises(RigError, match=PRESSURE):
        check_columns({PRESSURE: f"CH2:{unit}"})


def test_an_oscilloscope_s_volts_are_read_by_the_scales_of_a_rig_file(tmp_path: Path) -> None:
    time = 0.01 * np.arange(100)
    speed, position, pressure = 60.0 * np.sin(time), 0.03 * np.cos(time), 1e6 * np.sin(3.0 * time)
    lines = ["time_s,CH1,CH2 [mV],CH3"]
    volts = zip(time, speed / 100.0, 1e3 * (pressure + 25e5) / 50e5, position / 0.02 + 1.0, strict=True)
    log, rig = tmp_path / "scope.csv", tmp_path / "rig.toml"
    log.write_text("\n".join([*lines, *(",".join(map(repr, map(float, row))) for row in volts)]) + "\n")
    rig.write_text(
        'plant = "eha"\nname = "scope"\n[columns]\nmotor_speed_rad_s = "CH1:100 rad/s/V"\n'
        f'{PRESSURE} = "CH2:50 bar/V - 25 bar"\nposition_m = "CH3:20 mm/V - 20 mm"\n'
    )
    record = read_record(log, columns=read_rig(rig).columns)
    np.testing.assert_allclose(record["motor_speed_rad_s"], speed, atol=1e-9)
    np.testing.assert_allclose(record[PRESSURE], pressure, atol=1e-3)
    np.testing.assert_allclose(record["position_m"], position, atol=1e-12)
