"""Columns of the tables in the report of `hydrostate motor-paper`."""

from collections.abc import Mapping

from experiments.motor_paper.regression_figure import READING_WORDS
from experiments.page.tables import Column, Columns, decimals, exact_cell, name_in_words

_PAPER: Mapping[str, Columns] = {
    "table 1": ("item", Column("value", words=exact_cell), "unit", "remark"),
    "relations": (
        *("relation", Column("constant", "constant (median)")),
        Column("worst_percent", "furthest off", words=decimals(2)),
        Column("worst_row", "in row"),
        Column("holds", "holds within 0.5 %"),
    ),
    "table 2": (
        "row",
        Column("area_ratio", "area over π d²/4"),
        Column("displacement_ratio", "column 5 over column 4"),
        Column("d31_pm_v", "d₃₁ by equation 14", "pm/V", digits=3),
        Column("calibration_v_um", "h₃₁ by equation 15", "V/µm", digits=3),
        Column("efficiency", "efficiency by 17"),
        Column("piston_area_cm2", "piston by 18", "cm²", digits=5),
        Column("force_ratio", "Table 5's force over Table 2's", digits=3),
    ),
    "efficiency": (
        Column("reading", "reading of equation 17"),
        Column("mean", "mean efficiency"),
        Column("variation_percent", "variation over rows", digits=2),
    ),
    "table 4": (
        Column("frequency_hz", digits=2),
        Column("pumping_displacement_mm", "displacement", "printed mm"),
        Column("theoretical_flow_ml_per_min", "theory", "mL/min", digits=5),
        Column("theory_ml_per_min", "theory anew", "mL/min", digits=5),
        Column("flowmeter_ml_per_min", "flow meter", "mL/min"),
        Column("error_percent", "error, published", digits=3),
        Column("error_by_flowmeter_percent", "by the flow meter", digits=3),
        Column("error_by_theory_percent", "by theory", digits=3),
    ),
    "table 5": (
        "actuator",
        Column("voltage_vpp", "voltage", "V", words=exact_cell),
        Column("frequency_hz", words=exact_cell),
        Column("no_load_velocity_mm_per_s", "velocity without load", "mm/s", words=exact_cell),
        Column("blocking_force_n", words=exact_cell),
        Column("most_power_w", digits=3),
    ),
    "published motor": (Column("claim", "what follows"), Column("value", digits=3), "unit"),
    "regression": (
        Column("quantity", words=name_in_words),
        Column("published", digits=9),
        *(Column(name, words, digits=9) for name, words in READING_WORDS.items()),
        Column("relative_difference", digits=2),
    ),
    "decisions": (
        Column("reading", words=READING_WORDS.__getitem__),
        *("rule", "quantity", "value", "limit", "met", "decision"),
    ),
}

_SENSING: Mapping[str, Columns] = {
    "sensing regressions": (
        Column("regressors", "velocity from"),
        Column("r_square", "R²", words=decimals(3)),
        Column("predictive_r_square", "R² left out", words=decimals(3)),
        Column("error_m_s", "standard error", digits=2),
        Column("largest_vif", "largest variance inflation", digits=2),
        Column("smallest_coefficient", "smallest coefficient", "mm/s a volt", 1e3, 2),
        Column("largest_coefficient", "largest", "mm/s a volt", 1e3, 2),
    ),
    "sensing faults": (
        *("fault", Column("velocity_m_s", digits=3)),
        lambda name: Column(name, name, "mm/s off", 1e3, 2),
    ),
    "distortion": (
        Column("signal", words=lambda name: name.split(" [")[0]),
        lambda name: Column(name, f"{name.removeprefix('thd_')} V", "%", digits=2),
    ),
}

_LINEAR: Mapping[str, Columns] = {
    "poles": (
        "model",
        Column("real_rad_s", "real part", "1/s"),
        Column("imaginary_rad_s", "imaginary part", "rad/s", digits=5),
        *("frequency_hz", Column("damping_ratio", digits=3), "stable"),
    ),
    "margins": (
        "model",
        Column("gain_margin", digits=3),
        Column("phase_margin_deg", digits=3),
        Column("crossover_hz", "at"),
        Column("open_unstable_poles", "unstable poles"),
        Column("turns", "clockwise turns"),
        Column("closed_unstable_poles", "unstable poles, closed"),
        Column("stable", "stable, closed"),
    ),
    "tuning": (
        Column("changed", words=name_in_words),
        Column("factor", "times", digits=2),
        Column("frequency_hz", "first mode"),
        Column("damping_ratio", digits=3),
        Column("peak_gain", "peak over rest", digits=3),
        Column("decay_time_s", "decay to a tenth", "ms", 1e3, 3),
    ),
    "loop": (
        *("controller", Column("overshoot_percent", digits=3)),
        Column("settling_time_s", "settles within", "ms", 1e3, 3),
        Column("error_percent", "error left", digits=2),
        Column("ripple_m", "ripple", "nm", 1e9, 2),
    ),
    "relay": (
        *("quantity", Column("relay", "found by a relay in the loop"), Column("model", "from the model"), "unit"),
    ),
    "hysteresis": (
        *("law", "frequency_hz", Column("area_v2", "area", "V²")),
        Column("width_percent", unit="% of stroke", digits=3),
        Column("gain", "gain of the first harmonic"),
        Column("lag_deg", digits=3),
        Column("distortion_percent", "harmonic distortion", digits=2),
    ),
}

COLUMNS: Mapping[str, Columns] = {**_PAPER, **_SENSING, **_LINEAR}
