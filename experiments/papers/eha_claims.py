"""Our results beside the claims of the gear-pump paper's text, by the key of ``claims.csv``."""

from collections.abc import Mapping
from inspect import signature

import numpy as np
import pandas as pd
from scipy.constants import psi

from estimation.finding import NORMAL_95, interval_95
from estimation.identification.signals.preprocess import zero_phase_filter
from estimation.models.published_noise import PRINTED_Q, PRINTED_R, PUBLISHED_TIME
from experiments.circuit.first_tests import UNCERTAIN_BREAK_ROWS
from experiments.circuit.steady_experiments import FIGURE_9_VOLTS
from experiments.nine_conditions.bulk_modulus import (
    PRESSURE_STEPS,
    PUBLISHED_METHOD,
    PUBLISHED_METHOD_STICKING,
)
from experiments.nine_conditions.findings import by_experiment, recoveries
from experiments.page.frames import Tables, cell
from experiments.papers.parts import Evidence
from experiments.papers.verdict import OurResult
from experiments.published import SCALARS
from faults.eha.physical import VOLTS_A
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.drives import HOLD_TIME, sine
from plant.eha.model import EhaParameters, pressure_rate
from plant.eha.throttles import SHUT_VOLTS

RIG = EhaParameters()


def eha_results(found: Evidence) -> Mapping[str, OurResult]:
    """Return our result for each claim of the gear-pump paper."""
    return {
        **_rig(),
        **_settings(),
        **_conditions(found["study"], found["circuit"]),
        **_first_tests(found["study"], found["circuit"], found["library"]),
        **_steady(found["circuit"]),
        **_steps(found["circuit"]["figure_10_validation_input"]),
        **_published_filter(found["study"]["bulk_modulus"]),
        **_on_circuit(found["circuit"]["figure_11_bulk_modulus"]),
        **_modelled_chambers(found["circuit"]["figure_11_modelled_chambers"]),
    }


def _rig() -> Mapping[str, OurResult]:
    return {
        "accumulator_psi": OurResult(RIG.accumulator_pressure / psi),
        "relief_psi": OurResult(RIG.relief_pressure / psi),
        "shut_volts": OurResult(SHUT_VOLTS),
        "throttle_flow": OurResult(CircuitParameters().throttle_rated_flow),
        "kpa_58": OurResult(1e-3 * SCALARS["normal_differential_pressure"].si_value),
        "kpa_500": OurResult(1e-3 * 500.0 * psi),
        "throttle_a_minor": OurResult(VOLTS_A[1]),
        "throttle_a_major": OurResult(VOLTS_A[2]),
        "mass": OurResult(RIG.moving_mass),
        "rpm": OurResult(RIG.rated_speed * 30.0 / np.pi),
        "compression_factor": OurResult(_compression_factor()),
    }


def _compression_factor() -> float:
    """Return the ratio of the plant's compression flow to V_0/beta times the rate of differential pressure."""
    rate = float(pressure_rate(0.0, 0.0, RIG.rated_speed, RIG))
    pumped = RIG.rated_flow - RIG.flow_bias
    return pumped * RIG.bulk_modulus / (RIG.chamber_volume * rate)


def _settings() -> Mapping[str, OurResult]:
    of_filter = signature(zero_phase_filter).parameters
    quarter = sine(0.1, 1e-4, RIG.rated_speed)
    return {
        "prbs_volts": OurResult(RIG.rated_speed / RIG.motor_speed_per_volt),
        "prbs_hz": OurResult(1.0 / HOLD_TIME),
        "filter_order": OurResult(float(of_filter["order"].default)),
        "filter_cutoff": OurResult(float(of_filter["cutoff_hz"].default)),
        "friction_low": OurResult(min(FIGURE_9_VOLTS)),
        "friction_high": OurResult(max(FIGURE_9_VOLTS)),
        "sample_time": OurResult(1e3 * PUBLISHED_TIME),
        **{f"q{number}": OurResult(value) for number, value in enumerate(PRINTED_Q, start=1)},
        **{f"r{number}": OurResult(value) for number, value in enumerate(PRINTED_R.values(), start=1)},
        "sine_volts": OurResult(float(quarter.max()) / RIG.motor_speed_per_volt),
        "sine_hz": OurResult(float(signature(sine).parameters["frequency"].default)),
    }


def _conditions(study: Tables, circuit: Tables) -> Mapping[str, OurResult]:
    table = study["conditions"].set_index("condition")
    shares = {
        f"{level}_{fault}_{of}": OurResult(cell(table, f"{level}_{fault}", f"{of}_percent_of_normal"))
        for fault, of in (("leakage", "velocity"), ("friction", "pressure"))
        for level in ("minor", "major")
    }
    throttle = circuit["figure_3_velocity_against_leakage_throttle"].set_index("throttle_a_v")
    pressures = circuit["figure_4_pressure_against_friction_throttle"]["differential_pressure_pa"]
    return {
        **shares,
        "minor_leakage_circuit": OurResult(cell(throttle, VOLTS_A[1], "percent_of_normal")),
        "major_leakage_circuit": OurResult(cell(throttle, VOLTS_A[2], "percent_of_normal")),
        "normal_psi": OurResult(cell(table, "normal", "steady_pressure_pa") / psi),
        "saturation_psi": OurResult(float(pressures.max()) / psi),
    }


def _first_tests(study: Tables, circuit: Tables, library: Tables) -> Mapping[str, OurResult]:
    tests = circuit["section_4_first_tests"].set_index(["test", "at"])["value"]
    errors = study["validation_on_circuit"]
    better = errors["rmse_mathematical_m_s"] < errors["rmse_transfer_function_m_s"]
    return {
        "mean_gain_spread": OurResult(float(tests["gain spread", "means from 2 V"])),
        "low_amplitude_spread": OurResult(float(tests["gain spread", "amplitudes from 0.5 V"])),
        **{f"break_{v}": OurResult(float(tests["break frequency", f"mean {v} V"])) for v in (2, 4, 7)},
        "break_7_doubted": OurResult(float(tests[UNCERTAIN_BREAK_ROWS, "mean 7 V, highest"])),
        "break_ratio_doubted": OurResult(float(tests[UNCERTAIN_BREAK_ROWS, "mean 2 V over mean 7 V, least"])),
        "dead_zone_major": OurResult(float(tests["dead zone", "major_leakage"])),
        "order_circuit": OurResult(float(circuit["figure_7_singular_values"]["suggested_order"].iloc[0])),
        "order_study": OurResult(float(study["order"]["suggested_order"].iloc[0])),
        "bandwidth_library": _bandwidth(library["library"]),
        "bandwidth_around_mean": _bandwidth(library["around_mean"]),
        "math_better": OurResult(float(better.sum())),
    }


def _bandwidth(models: pd.DataFrame) -> OurResult:
    table = models.set_index("condition")
    width = cell(table, "normal", "bandwidth_hz")
    return OurResult(width, *interval_95(width, cell(table, "normal", "bandwidth_std_hz")))


def _steady(circuit: Tables) -> Mapping[str, OurResult]:
    groups = circuit["figure_8_leakage_points"].groupby("level")
    straight = [
        float(np.corrcoef(rows["differential_pressure_pa"], rows["lost_flow_m3_s"])[0, 1] ** 2) for _, rows in groups
    ]
    refit = circuit["figure_8_leakage_flow_refitted"]
    bias = refit[refit["coefficient"] == "flow_bias"]
    return {"leakage_r2": OurResult(min(straight)), "bias_low": OurResult(float(bias["low"].min()))}


def _steps(drive: pd.DataFrame) -> Mapping[str, OurResult]:
    volts = drive["motor_voltage_v"].to_numpy()
    held = volts[np.append(True, np.abs(np.diff(volts)) > 0.0)]
    held = held[held != 0.0]
    size = np.abs(held)
    return {
        "steps": OurResult(float(len(held))),
        "step_low": OurResult(float(size.min())),
        "step_high": OurResult(float(size.max())),
        "switches": OurResult(float(np.sum(np.diff(np.sign(held)) != 0.0))),
    }


def _published_filter(estimates: pd.DataFrame) -> Mapping[str, OurResult]:
    of = dict(by_experiment(estimates))
    own, sticks = of[PUBLISHED_METHOD], of[PUBLISHED_METHOD_STICKING]
    settled = own.groupby("condition")["filter_settled_at_pa"]
    spread = 100.0 * (settled.max() - settled.min()) / settled.mean()
    pressure = recoveries(estimates)[PRESSURE_STEPS]
    starts = own["start_pa"].astype(float)
    low, high = (1e-6 * float(getattr(sticks["filter_settled_at_pa"], end)()) for end in ("min", "max"))
    return {
        "ekf_spread": OurResult(float(spread.max())),
        "ekf_sticks": OurResult(
            float(sticks["filter_settled_at_pa"].mean()), said=f"{low:.3g} to {high:.3g} MPa; {_gate(sticks)}"
        ),
        "start_low": OurResult(float(starts.min())),
        "start_high": OurResult(float(starts.max())),
        "pressure_mean": OurResult(pressure.mean_pa, said=f"gate passes {pressure.passed} of {pressure.estimates}"),
    }


def _on_circuit(estimates: pd.DataFrame) -> Mapping[str, OurResult]:
    published = estimates[estimates["form"] == "acceleration"]
    ours = estimates[estimates["form"] == "flow"]
    out = 100.0 * float(published["value_pa"].notna().mean())
    return {
        "ekf_circuit_out": OurResult(out, said=_gate(published)),
        "flow_worst": OurResult(float(ours["error_percent"].abs().max()), said=_gate(ours)),
    }


def _modelled_chambers(estimates: pd.DataFrame) -> Mapping[str, OurResult]:
    z = float(np.sqrt(np.mean(estimates["z"] ** 2)))
    # NaN if the gate withholds any estimate
    worst = float(estimates["error_percent"].abs().max(skipna=False))
    return {"chambers_worst": OurResult(worst, said=f"{_gate(estimates)}, errors of {z:.2f} standard deviations rms")}


def settled_by_condition(estimates: pd.DataFrame) -> Mapping[str, OurResult]:
    """Return the final value of a filter in each condition, with its 95 % interval, gate and coverage.

    Returns
    -------
    Mapping[str, OurResult]
        By condition [Pa]: mean over the first guesses, whether or not the gate passes it.
    """
    rows = dict(by_experiment(estimates))[PUBLISHED_METHOD]
    return {str(name): _settled_result(of_one) for name, of_one in rows.groupby("condition", sort=False)}


def printed_by_condition(estimates: pd.DataFrame) -> Mapping[str, OurResult]:
    """Return the final error of the filter with equation 7.3 as printed.

    Returns
    -------
    Mapping[str, OurResult]
        By condition: largest error over the first guesses [percent]; no number if none of them stays finite.
    """
    return {str(name): _printed_filter_result(rows) for name, rows in estimates.groupby("condition", sort=False)}


def _printed_filter_result(rows: pd.DataFrame) -> OurResult:
    settled = rows["settled_pa"].dropna()
    said = f"finite from {len(settled)} of {len(rows)} first guesses"
    if len(settled):
        said += f", ends at {1e-6 * settled.min():.3g} to {1e-6 * settled.max():.3g} MPa"
    off = (settled / RIG.bulk_modulus - 1.0).abs().max()
    return OurResult(100.0 * float(off) if len(settled) == len(rows) else None, said=said)


def _settled_result(rows: pd.DataFrame) -> OurResult:
    value = float(rows["filter_settled_at_pa"].mean())
    spread = NORMAL_95 * float(rows["filter_std_pa"].mean())
    covered = (rows["filter_settled_at_pa"] - RIG.bulk_modulus).abs() <= NORMAL_95 * rows["filter_std_pa"]
    said = f"{_gate(rows)}; 95 % interval ± {1e-6 * spread:.2g} MPa contains 207 MPa in {covered.sum()} of {len(rows)}"
    return OurResult(value, said=said)


def _gate(rows: pd.DataFrame) -> str:
    return f"gate passes {int(rows['gate_passed'].sum())} of {len(rows)}"
