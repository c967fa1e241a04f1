"""Our results beside the claims of the diaphragm-motor paper's text, by the key of ``claims.csv``."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from experiments.diaphragm_motor import sweeps
from experiments.diaphragm_motor.quoted import ML_MIN, load_straightness, straightness
from experiments.page.frames import Tables, cell
from experiments.papers.parts import Evidence
from experiments.papers.verdict import OurResult
from experiments.published import load
from plant.diaphragm_motor.composite_plate import PlateParameters
from plant.diaphragm_motor.parameters import DIAPHRAGMS, VALVES
from plant.diaphragm_motor.run import HIGHEST_VOLTAGE, motor_drive
from plant.units import notes

OPTIMA = (0.01378, 0.004562, 0.003384)
"""The frequencies in the abstract's triples [rad/s]."""


def motor_results(found: Evidence) -> Mapping[str, OurResult]:
    """Return our result for each claim of the diaphragm-motor paper."""
    motor, paper = found["diaphragm-motor"], found["motor-paper"]
    return {
        **_settings(),
        **_optima(),
        **_frequency(motor["frequency_sweep"]),
        **_voltage(motor["voltage_sweep"]),
        **_load(motor),
        **_linear(paper),
        **_regression(paper),
        "nothing": OurResult(None),
    }


def _settings() -> Mapping[str, OurResult]:
    return {
        "low_volts": OurResult(min(sweeps.SWINGS)),
        "high_volts": OurResult(2.0 * HIGHEST_VOLTAGE),
        "high_hz": OurResult(max(sweeps.FREQUENCIES)),
        "chambers": OurResult(float(DIAPHRAGMS)),
        "valves": OurResult(float(VALVES)),
        "substrate": OurResult("Brass" if "brass" in notes(PlateParameters)["brass_modulus"].meaning else None),
        "waveform": OurResult("Sine wave" if _is_sine() else None),
    }


def _is_sine() -> bool:
    """Return whether the motor's drive is a sine after its amplitude has built up."""
    wave = motor_drive(sweeps.PEAK, sweeps.SWING, 0.1, 1e-5)
    last = wave[len(wave) // 2 :]
    tones = np.abs(np.fft.rfft(last * np.hanning(len(last))))
    return bool(np.sort(tones)[-4:].sum() > 0.99 * tones.sum())


def _optima() -> Mapping[str, OurResult]:
    table = load("table2").set_index("driving_frequency")
    columns = {"flow": "output_flow_qg", "load": "external_load_f"}
    return {
        f"optimum_{words}_{number}": OurResult(cell(table, frequency, column))
        for number, frequency in enumerate(OPTIMA, start=1)
        for words, column in columns.items()
    }


def _frequency(frame: pd.DataFrame) -> Mapping[str, OurResult]:
    sweep = frame.set_index("frequency_hz")
    flow = sweep["flow_m3_s"] / ML_MIN
    rising = flow.loc[: sweeps.PEAK]
    a1 = np.interp((440.0, 600.0), sweep.index.to_numpy(dtype=np.float64), sweep["a1_v"])
    return {
        "flow_max": OurResult(float(flow.max())),
        "flow_max_hz": OurResult(float(str(flow.idxmax()))),
        "flow_falls": OurResult(float((rising.diff() <= 0.0).sum())),
        "flow_end": OurResult(float(flow.iloc[-1] / flow.max())),
        **{f"{name}_hz": OurResult(float(str(sweep[f"{name}_v"].idxmax()))) for name in ("a3", "a5", "a7")},
        "a1_rise": OurResult(float(a1[1] / a1[0])),
    }


def _voltage(swings: pd.DataFrame) -> Mapping[str, OurResult]:
    names = ["flow_m3_s", "a1_v", "a3_v", "a5_v"]
    straight = [straightness(swings["voltage_v"], swings[f"{name}_v"]) for name in ("a3", "a4", "a5")]
    return {
        "voltage_falls": OurResult(float((swings[names].diff() <= 0.0).to_numpy().sum())),
        "sensing_straight": OurResult(min(straight)),
        "a4_100": OurResult(cell(swings.set_index("voltage_v"), 100.0, "a4_v")),
    }


def _load(motor: Tables) -> Mapping[str, OurResult]:
    speeds = [1e3 * float(v) for v in motor["claimed_speeds"]["velocity_m_s"]]
    names = ("velocity_0", "velocity_50", "velocity_100", "velocity_100v")
    groups = motor["load_and_frequency"].groupby("load_n")
    tops = [rows.sort_values("velocity_m_s").iloc[-1] for _, rows in groups]
    best = [(float(top["frequency_hz"]), float(top["velocity_m_s"])) for top in tops]
    eta = motor["efficiency_by_the_root_of_7"]["efficiency"]
    moved = {float(str(spool)): _displacement(rows["position_m"]) for spool, rows in motor["reversal"].groupby("spool")}
    turned = moved[1.0] > 0.0 > moved[-1.0]
    return {
        **{name: OurResult(max(0.0, speed)) for name, speed in zip(names, speeds, strict=True)},
        "load_r2": OurResult(min(load_straightness(motor["load_sweep"], 0.7).values())),
        "load_r2_whole": OurResult(min(load_straightness(motor["load_sweep"], 1.0).values())),
        "best_rise": OurResult(best[-1][0] / best[0][0]),
        "velocity_falls": OurResult(best[-1][1] / best[0][1]),
        "efficiency_spread": OurResult(float(eta.max() / eta.min())),
        "reversed": OurResult("yes" if turned else "no"),
    }


def _displacement(position: pd.Series) -> float:
    return float(position.iloc[-1] - position.iloc[0])


def _linear(paper: Tables) -> Mapping[str, OurResult]:
    poles = paper["poles"]
    # the table has one pole of each complex pair
    swinging = poles[~poles["stable"].astype(bool)]["model"]
    tuning = paper["tuning"].set_index(["changed", "factor"])["frequency_hz"]
    width = paper["hysteresis"].set_index(["law", "frequency_hz"])["width_percent"]
    orders = paper["figures_7_to_9"].groupby("order")["derivative"].last()
    return {
        "unstable_printed": OurResult(2.0 * float((swinging == "equations 1 and 2, as printed").sum())),
        "unstable_mended": OurResult(2.0 * float((swinging == "equations 1 and 2, signs mended").sum())),
        "unstable_20": OurResult(2.0 * float((swinging == "equation 20, small voltages").sum())),
        "tuned_frequency": OurResult(float(tuning["load_stiffness", 2.0] / tuning["load_stiffness", 1.0])),
        **{f"width_{law}": OurResult(float(width[law, 480.0] / width[law, 1.0])) for law in ("printed", "mended")},
        **{f"fractional_{round(10 * order):02d}": OurResult(float(orders[order])) for order in (0.5, 1.0, 1.5)},
    }


def _regression(paper: Tables) -> Mapping[str, OurResult]:
    fitted = paper["regression"].set_index("quantity")
    rules = paper["decisions"].query("reading == 'anova'").set_index("quantity")
    sensing = paper["sensing_regressions"].set_index("regressors")
    claims = paper["published_motor"].set_index("claim")
    return {
        "sensing_r2": OurResult(cell(sensing, "A3, A4, A5, as the paper wants", "r_square")),
        "flow_velocity": OurResult(cell(claims, "velocity that 110.11 mL/min gives on Table 2's piston", "value")),
        "intercept": OurResult(cell(fitted, "intercept", "anova")),
        "deformation": OurResult(cell(fitted, "deformation_coefficient", "anova")),
        "velocity": OurResult(cell(fitted, "velocity_coefficient", "anova")),
        **{str(row["quantity"]): OurResult(row["value"]) for row in paper["regression_limits"].to_dict("records")},
        "rule_r2": OurResult(cell(rules, "adjusted R²", "value")),
        "rule_f": OurResult(cell(rules, "significance of F", "value")),
        "rule_p_deformation": OurResult(cell(rules, "P of deformation", "value")),
        "rule_p_velocity": OurResult(cell(rules, "P of velocity", "value")),
        "rule_beta": OurResult(cell(rules, "standardised β of velocity", "value")),
        "rule_vif": OurResult(cell(rules, "variance inflation factor", "value")),
    }
