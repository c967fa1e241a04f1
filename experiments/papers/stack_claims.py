"""Our results beside the claims of the piezo-stack paper's text, by the key of ``claims.csv``."""

from collections.abc import Mapping

import pandas as pd

from experiments.page.frames import Tables, cell
from experiments.papers.verdict import OurResult
from experiments.piezo_stack import flow
from experiments.piezo_stack.left_out import PEAK
from plant.piezo_stack.run import HIGHEST_VOLTAGE
from plant.units import LITRE_PER_MINUTE


def stack_results(found: Tables) -> Mapping[str, OurResult]:
    """Return our result for each claim of the piezo-stack paper."""
    return {
        **figure_results(found),
        **_hysteresis(found),
        **_left_out(found),
        **_settings(),
        "nothing": OurResult(None),
    }


def figure_results(found: Tables) -> Mapping[str, OurResult]:
    """Return our result for each claim about a curve of Figures 10 to 14.

    Parameters
    ----------
    found : Mapping[str, pandas.DataFrame]
        As for `stack_results`; the tables of the figures and of the loops' widths are enough.
    """
    widths = found["figure_10_loop_widths"]["width_percent"]
    return {**_no_load(found), **_loaded(found), "loops_narrowing": OurResult(float((widths.diff() <= 0.0).sum()))}


def _curve(frame: pd.DataFrame, by: str, value: float, axis: str = "frequency_hz") -> pd.Series:
    """Return flow [L/min] by frequency or load."""
    return frame[frame[by] == value].set_index(axis)["flow_m3_s"].astype(float) / LITRE_PER_MINUTE


def _best_frequency(flows: pd.Series) -> OurResult:
    return OurResult(float(str(flows.idxmax())))


def _no_load(found: Tables) -> Mapping[str, OurResult]:
    bias, voltage = found["figure_11_flow_over_bias_pressure"], found["figure_12_flow_over_voltage"]
    high = _curve(bias, "bias_pressure_pa", flow.HIGH_BIAS)
    low = _curve(bias, "bias_pressure_pa", flow.LOW_BIAS)
    weak = _curve(voltage, "voltage_v", flow.LOW_VOLTAGE)
    return {
        "flow_max": OurResult(float(high.max())),
        "flow_max_hz": _best_frequency(high),
        "flow_at_275": OurResult(float(high.loc[PEAK] / high.max())),
        "flow_max_hz_low": _best_frequency(low),
        "decline": OurResult(float(high.iloc[-1] / high.max())),
        "bias_ratio": OurResult(float(low.loc[PEAK] / high.loc[PEAK])),
        "bias_crossings": OurResult(float((low > high).sum())),
        "voltage_ratio": OurResult(float(weak.loc[PEAK] / high.loc[PEAK])),
        "flow_max_hz_weak": _best_frequency(weak),
    }


def _loaded(found: Tables) -> Mapping[str, OurResult]:
    fixed, loads = found["figure_13_flow_with_fixed_weight"], found["figure_14_flow_over_load"]
    heavy = _curve(fixed, "load_kg", 20.0)
    at_peak = _curve(fixed, "frequency_hz", PEAK, "load_kg")
    falling = [_curve(loads, "frequency_hz", frequency, "load_kg") for frequency in flow.LOAD_FREQUENCIES]
    rise = max(float((curve.diff() / curve.iloc[0]).max()) for curve in falling)
    return {
        "flow_20kg": OurResult(float(heavy.loc[225.0:325.0].max())),
        "weight_rise": OurResult(float(at_peak.diff().max())),
        "load_rise": OurResult(100.0 * rise),
        "least_20kg": OurResult(min(float(curve.loc[20.0]) for curve in falling)),
        "flow_50kg": OurResult(max(float(curve.loc[50.0]) for curve in falling)),
    }


def _hysteresis(found: Tables) -> Mapping[str, OurResult]:
    hysteresis = found["hysteresis_parameters"].set_index("parameter")
    ratios = {
        key: cell(hysteresis, name, "printed") / cell(hysteresis, name, "truth")
        for key, name in (("printed_alpha", "hysteresis"), ("printed_phi", "hysteresis_phi_1"))
    }
    return {
        **{key: OurResult(ratio if ratio == ratio else None) for key, ratio in ratios.items()},
        "reynolds": OurResult(float(found["pump_cycle"]["reynolds_number"].abs().max())),
    }


def _left_out(found: Tables) -> Mapping[str, OurResult]:
    """Return the worst prediction of Figure 12 by calibrations without it."""
    table = found["figure_12_left_out"]
    best = table["best_weak_hz"]
    worst = best[(best - PEAK).abs().idxmax()]
    told = "Hz, ".join(f"{value:.0f} " for value in best)
    return {
        "left_out_ratio": OurResult(
            float(table["ratio"].max()), said=f"{len(table)} calibrations from separate beginnings"
        ),
        "left_out_hz": OurResult(float(worst), said=f"{told}Hz by {len(table)} calibrations from separate beginnings"),
        "left_out_both_peaks": OurResult(
            float((table[["best_high_hz", "best_low_hz"]] - PEAK).abs().max(axis=1).min()),
            said="the nearest that a calibration comes with both bias pressures",
        ),
    }


def _settings() -> Mapping[str, OurResult]:
    return {
        "loop_volts": OurResult(flow.LOOP_VOLTAGE),
        "high_volts": OurResult(flow.HIGH_VOLTAGE),
        "high_bias": OurResult(1e-6 * flow.HIGH_BIAS),
        "low_bias": OurResult(1e-6 * flow.LOW_BIAS),
        "high_hz": OurResult(max(flow.FREQUENCIES)),
        "rated_volts": OurResult(HIGHEST_VOLTAGE),
        "load_hz": OurResult(flow.LOAD_FREQUENCIES[1]),
    }
