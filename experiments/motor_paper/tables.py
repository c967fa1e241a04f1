"""Tables 1, 2, 4 and 5 of the diaphragm-motor paper, and checks of them (errata M14 to M18, M23 to M29).

Printed units are kept, because they are part of the check.
"""

from collections.abc import Mapping
from math import pi

import numpy as np
import pandas as pd

from experiments.motor_paper.regression import FLOW, VELOCITY, reading
from experiments.published import load

PUMP_PISTON_MM = 38.0
"""Bore with which Table 4's theory was computed (errata M29) [mm]."""

UNIT_FACTOR = 1000.0
"""The factor missing from equation 17 in Table 2 (errata M17) [dimensionless]."""

PUBLISHED_FLOW_ML_MIN, PUBLISHED_VELOCITY_MM_S, PUBLISHED_FORCE_N = 110.11, 168.1, 141.0
"""Section 7.1 and Table 5 [mL/min, mm/s, N]."""

LARGEST_SCATTER_PERCENT = 0.5
"""A relation holds in Table 2 if no row deviates by more than this [percent]."""


def efficiency(table: pd.DataFrame, *, chambers: int = 5, inverted: bool = True, from_area: bool = True) -> pd.Series:
    """Return the efficiency of equation 17 that each row of Table 2 implies (errata M17).

    Parameters
    ----------
    table : pandas.DataFrame
        Table 2 in a reading.
    chambers : int
        Number of chambers whose square root is in equation 17 [count].
    inverted : bool
        Whether h_31 is deformation over voltage; otherwise it is voltage over deformation, as in equation 15.
    from_area : bool
        Whether the diameter is computed from the area; otherwise it is the printed one.

    Returns
    -------
    pandas.Series
        Efficiency [dimensionless] if h_31 is inverted, else a number in Table 2's units.

    Examples
    --------
    >>> efficiency(reading("physical")).round(3).tolist()
    [0.85, 0.85, 0.85, 0.85, 0.85, 0.85]
    """
    deformation, voltage = table["deformation_delta_mm"], table["driving_voltage_us"]
    diameter = table["diaphragm_diameter_mm"]
    square = 4.0 / pi * table["diaphragm_area_mm2"] if from_area else diameter**2
    calibration = deformation / voltage if inverted else voltage / deformation
    ideal = np.sqrt(chambers) * square * table["driving_frequency"] * voltage / (8.0 * calibration)
    return table[FLOW] / ideal / UNIT_FACTOR


def _variation_percent(values: pd.Series) -> float:
    return float(100.0 * values.std(ddof=0) / values.mean())


def efficiency_readings() -> pd.DataFrame:
    """Return the efficiency by equation 17 in the reading that works, and with each of its parts read otherwise.

    Returns
    -------
    pandas.DataFrame
        Columns reading, mean and variation_percent (standard deviation over mean).
    """
    physical, fitted = reading("physical"), reading("anova")
    variants = {
        "h₃₁ = δ/Us, √5, row 1's diameter from its area, row 6's flow 0.0568": efficiency(physical),
        "row 6's flow 0.0868, as Figure 12 has it": efficiency(fitted),
        "row 1's diameter as printed": efficiency(physical, from_area=False),
        "√7, for seven chambers": efficiency(physical, chambers=7),
        "h₃₁ = Us/δ, as equation 15 says": efficiency(physical, inverted=False),
    }
    rows = [(name, float(values.mean()), _variation_percent(values)) for name, values in variants.items()]
    return pd.DataFrame(rows, columns=["reading", "mean", "variation_percent"])


def table_2() -> pd.DataFrame:
    """Return the implications of Table 2's rows, in the physical reading.

    Returns
    -------
    pandas.DataFrame
        Columns row; area_ratio (printed area over that of the diameter); displacement_ratio (column 5 over column 4);
        d31_times_voltage_m, the d_31 U that equation 14 requires; d31_pm_v, with Table 5's voltage; calibration_v_um,
        the h_31 of equation 15; efficiency, by equation 17; piston_area_cm2, by equation 18; force_ratio, Table 5's
        force over the force in this table.
    """
    table, actuators = reading("physical"), load("table5_actuators")
    area, thickness = table["diaphragm_area_mm2"], table["diaphragm_thickness_mm"]
    deformation = table["deformation_delta_mm"]
    stroke = deformation * 1e-6 * 4.0 * pi * (thickness * 1e-3) ** 2 / (3.0 * area * 1e-6)
    unloaded = 1.0 - table["external_load_f"] / table["blocking_force_fmax"]
    return pd.DataFrame(
        {
            "row": np.arange(1, len(table) + 1),
            "area_ratio": area / (pi / 4.0 * table["diaphragm_diameter_mm"] ** 2),
            "displacement_ratio": table["displacement_u_mm"] / table["driving_frequency"],
            "d31_times_voltage_m": stroke,
            "d31_pm_v": 1e12 * stroke / actuators["voltage_vpp"],
            "calibration_v_um": table["driving_voltage_us"] / deformation,
            "efficiency": efficiency(table),
            "piston_area_cm2": unloaded * table[FLOW] / table[VELOCITY],
            "force_ratio": actuators["blocking_force_n"] / table["blocking_force_fmax"],
        }
    )


def relations() -> pd.DataFrame:
    """Return which of equations 14 to 18 Table 2 satisfies, and how far its rows scatter about one constant.

    Returns
    -------
    pandas.DataFrame
        Columns relation, constant (the rows' median), worst_percent, worst_row and holds.
    """
    rows = table_2()
    columns: Mapping[str, str] = {
        "area = π d²/4": "area_ratio",
        "column 5 = 45.6 times column 4": "displacement_ratio",
        "equation 14, with Table 5's voltages: one d₃₁ [pm/V]": "d31_pm_v",
        "equation 15: one h₃₁ [V/µm]": "calibration_v_um",
        "equation 17: one efficiency": "efficiency",
        "equation 18: one piston area [cm²]": "piston_area_cm2",
        "Table 5's blocking force is ten times Table 2's": "force_ratio",
    }
    found: list[tuple[str, float, float, int, bool]] = []
    for words, column in columns.items():
        middle = float(rows[column].median())
        off = 100.0 * (rows[column] / middle - 1.0).abs()
        worst = int(off.to_numpy().argmax())
        found.append((words, middle, float(off.iloc[worst]), worst + 1, bool(off.max() < LARGEST_SCATTER_PERCENT)))
    return pd.DataFrame(found, columns=["relation", "constant", "worst_percent", "worst_row", "holds"])


def table_4() -> pd.DataFrame:
    """Return Table 4 with its theory and errors recomputed (errata M29).

    Returns
    -------
    pandas.DataFrame
        The printed columns; theory_ml_per_min, from a piston of 38 mm; error_by_flowmeter_percent, the error as
        printed; error_by_theory_percent.

    Examples
    --------
    >>> table_4()["error_by_flowmeter_percent"].round(2).tolist()
    [0.75, 1.45, 3.58, 2.66, 2.43]
    """
    table = load("table4_flow")
    stroke_m = 1e-6 * table["pumping_displacement_mm"]
    swept = pi / 4.0 * (1e-3 * PUMP_PISTON_MM) ** 2 * stroke_m
    theory, metered = table["theoretical_flow_ml_per_min"], table["flowmeter_ml_per_min"]
    return table.assign(
        theory_ml_per_min=60.0e6 * swept * table["frequency_hz"],
        error_by_flowmeter_percent=100.0 * (theory - metered) / metered,
        error_by_theory_percent=100.0 * (theory - metered) / theory,
    )


def table_5() -> pd.DataFrame:
    """Return Table 5 with the power that its no-load velocity and blocking force allow.

    Returns
    -------
    pandas.DataFrame
        The printed columns, and most_power_w: for a linear force-velocity line the maximum power is a quarter of the
        product of both.
    """
    table = load("table5_actuators")
    return table.assign(most_power_w=0.25e-3 * table["no_load_velocity_mm_per_s"] * table["blocking_force_n"])


def published_motor() -> pd.DataFrame:
    """Return why the proposed actuator's published numbers are inconsistent (errata M26).

    Returns
    -------
    pandas.DataFrame
        Columns claim, value and unit.

    Examples
    --------
    >>> published_motor()["value"].round(2).tolist()
    [4.84, 10.92, 12.92]
    """
    area_cm2 = float(table_2()["piston_area_cm2"].median())
    flow_mm3_s = PUBLISHED_FLOW_ML_MIN * 1e3 / 60.0
    needed = flow_mm3_s / PUBLISHED_VELOCITY_MM_S
    rows = [
        ("velocity that 110.11 mL/min gives on Table 2's piston", flow_mm3_s / (100.0 * area_cm2), "mm/s"),
        ("piston on which it would give 168.1 mm/s", needed, "mm²"),
        ("pressure at which that piston would push 141 N", PUBLISHED_FORCE_N / needed, "MPa"),
    ]
    return pd.DataFrame(rows, columns=["claim", "value", "unit"])


def table_1() -> pd.DataFrame:
    """Return Table 1 with the quantities that follow from it.

    Returns
    -------
    pandas.DataFrame
        Columns item, value, unit and remark.
    """
    remarks = {
        "pump length": "seven substrates fit only on two faces in a zigzag without a wall between them; five fit",
        "ceramic thickness": "Table 2's thicknesses, 0.65 to 6.52 mm, are not it",
        "ceramic diameter": "Table 2's diameters, 23.8 to 27 mm, lie around it",
        "chamber height": "Table 2's deformation of 1.4 to 13.5 mm cannot be in millimetres",
        "cylinder width": "the bore of 22 mm that Table 2 implies fits in",
    }
    table = load("table1_geometry")
    return table.assign(remark=[remarks.get(item, "") for item in table["item"].tolist()])
