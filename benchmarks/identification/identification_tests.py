"""Tools around a fit: order, bands of spectra, size and power of tests, robust intervals, and three measured records.

`--share 0.1` runs a tenth of the full size. The measured records are read from ``$HYDROSTATE_SHARED/data``.
"""

import argparse
import os
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.signal import lfilter
from threadpoolctl import threadpool_limits

from benchmarks.identification.identification import coefficients, report
from benchmarks.identification.identification_data import TABLE_6, Case, noisy_case, random_binary, table6_case
from estimation.finding import NORMAL_95
from estimation.identification import (
    FrequencyResponse,
    LinearModel,
    automatic_response,
    choose_model,
    detrend,
    etfe_welch,
    fit_arx,
    fit_output_error,
    order_table,
    order_test,
    zero_phase_filter,
)
from estimation.identification.fit.inverse_dynamics import fit_rigid_body, force_error
from estimation.identification.fit.validate import validate
from plant.errors import LogWarning

FORM = {"n_numerator": 3, "n_denominator": 2}
SHOWN = ("normal", "minor_friction", "major_leakage", "major_leakage_minor_friction")
"""Conditions whose spectra are evaluated: slow poles and resonances from 22 to 32 Hz."""

NEWTONS_PER_VOLT = 35.15065
"""Force constant of the EMPS motor and its drive; from upstream's scripts."""

Line = tuple[str, bool]


def main(arguments: list[str]) -> int:
    """Print the figures; return how many acceptance lines are missed."""
    parser = argparse.ArgumentParser(prog="identification_tests", description=__doc__)
    parser.add_argument("--share", type=float, default=1.0, help="share of the full size")
    options = parser.parse_args(arguments)

    def sized(full: int) -> int:
        return max(2, round(full * options.share))

    with threadpool_limits(1), warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        lines = [*measured_records(), *robust_lines(sized(100)), *spectra_lines(sized(100))]
        lines += [*size_lines(sized(1000)), *power_lines(sized(20)), *order_lines(sized(10))]
    return report(lines)


def order_lines(seeds: int) -> list[Line]:
    """Return how often the order of Table 6 is found, at 1 and 10 % noise."""
    lines: list[Line] = []
    for n, wanted in ((20_000, 0.95), (5_000, 0.90)):
        by_criterion: list[bool] = []
        by_values: list[bool] = []
        for name in TABLE_6:
            for noise in (0.01, 0.1):
                for seed in range(seeds):
                    case = table6_case(name, noise, seed, n)
                    by_criterion.append(int(order_table(case.u, case.y, 1e-3)["bic"].idxmin()) == 2)
                    by_values.append(order_test(case.u, case.y).suggested_order == 2)
        share = float(np.mean(by_criterion))
        text = f"order by BIC, N = {n}: {share:.3f} of {len(by_criterion)} right ({wanted}); "
        lines.append((text + f"by projected singular values {np.mean(by_values):.3f}", share >= wanted))
    return lines


def spectra_lines(seeds: int) -> list[Line]:
    """Return the coverage of 95 % bands of the gain at nine frequencies, at 10 % noise."""
    estimators: dict[str, Callable[[Case], FrequencyResponse]] = {
        "automatic window": lambda case: automatic_response(case.u, case.y, 1e-3),
        "Welch": lambda case: etfe_welch(case.u, case.y, 1e-3),
    }
    lines: list[Line] = []
    for label, estimator in estimators.items():
        worst, best, where = 1.0, 0.0, ""
        for name in SHOWN:
            truth = TABLE_6[name]
            covered = [_bands_cover(estimator(table6_case(name, 0.1, seed)), truth) for seed in range(seeds)]
            shares = np.mean(covered, axis=0)
            if shares.min() < worst:
                worst, where = float(shares.min()), f"{name} at {nine_frequencies(truth)[shares.argmin()]:.3g} Hz"
            best = max(best, float(shares.max()))
        lines.append((f"bands by {label} cover {worst:.2f} ({where}) to {best:.2f} (0.88 to 1)", worst >= 0.88))
    return lines


def nine_frequencies(truth: LinearModel) -> np.ndarray:
    """Return frequencies that include the slow pole and the resonance, or 25 Hz if there is none [Hz]."""
    natural = np.log(truth.poles.astype(complex)) / (2.0 * np.pi * truth.sample_time)
    resonance = float(abs(natural[np.argmax(truth.poles.imag)])) if truth.poles.imag.any() else 25.0
    fixed = [0.5, 1.0, 2.0, 5.0, 10.0, 15.0, 30.0]
    return np.sort(np.array([*fixed, 0.1 + float(abs(natural).min()), resonance]))


def _bands_cover(estimate: FrequencyResponse, truth: LinearModel) -> np.ndarray:
    at = [int(np.argmin(np.abs(estimate.frequency_hz - f))) for f in nine_frequencies(truth)]
    gain = np.abs(truth.frequency_response(estimate.frequency_hz[at]))
    low, high = estimate.gain_band()
    return (low[at] <= gain) & (gain <= high[at])


def size_lines(seeds: int) -> list[Line]:
    """Return how often the tests reject a correct model at the 5 % level."""
    white, crossed = [], []
    truth = TABLE_6["major_leakage"]
    for seed in range(seeds):
        rng = np.random.default_rng([5, seed])
        case = noisy_case(truth, random_binary(rng, 5_000), 0.1, rng)
        found = validate(fit_output_error(case.u, case.y, 1e-3, **FORM), case.u, case.y, fitted=True)
        white.append(not found.whiteness.passed())
        crossed.append(not found.cross_correlation.passed())
    shares = {"whiteness": float(np.mean(white)), "cross-correlation": float(np.mean(crossed))}
    return [
        (f"size of the {name} test {share:.3f} of {seeds} (0.03 to 0.07)", 0.03 <= share <= 0.07)
        for name, share in shares.items()
    ]


def power_lines(seeds: int) -> list[Line]:
    """Return how often a model of order 1 is rejected, at 10 % noise, in the worst condition."""
    powers: dict[str, float] = {}
    for name in TABLE_6:
        rejected: list[bool] = []
        for seed in range(seeds):
            case = table6_case(name, 0.1, seed)
            model = fit_output_error(case.u, case.y, 1e-3, n_numerator=2, n_denominator=1)
            found = validate(model, case.u, case.y, fitted=True)
            rejected.append(not (found.whiteness.passed(0.025) and found.cross_correlation.passed(0.025)))
        powers[name] = float(np.mean(rejected))
    worst = min(powers, key=lambda name: powers[name])
    mean = float(np.mean(list(powers.values())))
    return [(f"power against order 1: mean {mean:.3f}, least {powers[worst]:.2f} ({worst}) (0.9)", mean >= 0.9)]


def robust_lines(seeds: int) -> list[Line]:
    """Return the coverage of robust 95 % intervals of the coefficients, pooled, and of the gain."""
    lines: list[Line] = []
    for label, spoil in (("both filtered", _filtered), ("AR(1) noise", _ar1), ("differentiated encoder", _encoder)):
        for name in ("strictly proper 30 Hz", "major_leakage", "major_leakage_major_friction"):
            truth = proper_plant() if name.startswith("strictly") else TABLE_6[name]
            covered, white, gains = [], [], []
            for seed in range(seeds):
                rng = np.random.default_rng([87, seed])
                hold = 20 if name.startswith("strictly") else 50
                u, y = spoil(truth, random_binary(rng, 20_000, hold), rng)
                form = {"n_numerator": truth.free_numerator.size, "n_denominator": 2, "delay": truth.delay}
                model = fit_output_error(u, y, 1e-3, **form, covariance="coloured")
                error = np.abs(coefficients(model) - coefficients(truth))
                covered.append(error <= NORMAL_95 * model.coefficient_std)
                white.append(error <= NORMAL_95 * np.sqrt(np.diag(model.covariance_white)))
                gains.append(abs(model.dc_gain - truth.dc_gain) <= NORMAL_95 * model.dc_gain_std)
            share, gain = float(np.mean(covered)), float(np.mean(gains))
            text = f"{label}, {name}: robust {share:.3f}, gain {gain:.2f}, nominal {np.mean(white):.3f} (0.87 to 0.99)"
            lines.append((text, 0.87 <= share <= 0.99))
    return lines


def proper_plant() -> LinearModel:
    """Return a strictly proper second-order plant, 30 Hz and damping 0.6, at 1 ms (errata E15)."""
    radius, angle = np.exp(-0.6 * 0.06 * np.pi), 0.8 * 0.06 * np.pi
    f = np.array([1.0, -2.0 * radius * np.cos(angle), radius**2])
    return LinearModel(np.array([0.0, 0.52, 0.48]) * f.sum(), f, 1e-3, "u", "y", delay=1)


def _filtered(truth: LinearModel, u: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    clean = truth.simulate(u)
    return zero_phase_filter(u, clean + 0.05 * clean.std() * rng.standard_normal(u.size), 1e-3)


def _ar1(truth: LinearModel, u: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    clean = truth.simulate(u)
    noise = np.asarray(lfilter([1.0], [1.0, -0.95], rng.standard_normal(u.size + 500)))[500:]
    return u, clean + 0.1 * clean.std() * noise / noise.std()


def _encoder(truth: LinearModel, u: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    clean = truth.simulate(u)
    noise = np.diff(rng.uniform(-0.5, 0.5, u.size + 1))
    return u, clean + 0.3 * clean.std() * noise / noise.std()


def measured_records() -> list[Line]:
    """Return the figures of the hair dryer and the robot arm."""
    folder = Path(os.environ.get("HYDROSTATE_SHARED", "../shared")) / "data" / "daisy"
    if not (folder / "dryer.csv").exists():
        print(f"skipped: no measured records in {folder}")
        return []
    dryer = pd.read_csv(folder / "dryer.csv").to_numpy()[:300]
    u, y = detrend(dryer[:, 0]), detrend(dryer[:, 1])
    lines: list[Line] = []
    for order, wanted in ((2, 88.77), (3, 89.35)):
        form = {"n_numerator": order, "n_denominator": order, "delay": 3, "estimate_initial_state": False}
        fit = fit_output_error(u, y, 0.08, **form).fit_percent
        lines.append((f"hair dryer OE({order},{order},3): fit {fit:.2f} % ({wanted})", fit >= wanted))
    arx = fit_arx(u, y, 0.08, n_numerator=2, n_denominator=2, delay=3)
    found = [*arx.denominator[1:], *arx.free_numerator]
    published = [-1.2738, 0.3936, 0.06662, 0.04448]
    near = all(abs(a - b) <= 1e-4 for a, b in zip(found, published, strict=True))
    lines.append((f"hair dryer ARX(2,2,3): {', '.join(f'{value:.5f}' for value in found)} ({published}, 1e-4)", near))
    arm = pd.read_csv(folder / "robot_arm.csv").to_numpy()
    half = len(arm) // 2
    model = choose_model(arm[:half, 0], arm[:half, 1], 1.0, orders=range(1, 9), structures=("output-error",)).model
    run = validate(model, arm[half:, 0], arm[half:, 1]).fit_percent
    order = model.denominator.size - 1
    lines += positioning_lines(folder.parent / "emps")
    lines.append(
        (f"robot arm, order {order} chosen: fit {model.fit_percent:.1f} %, free run {run:.1f} % (93)", run >= 93.0)
    )
    return lines


def positioning_lines(folder: Path) -> list[Line]:
    """Return mass and friction of the EMPS positioning system with the published values."""
    if not (folder / "train.csv").exists():
        print(f"skipped: no measured records in {folder}")
        return []
    logs = [pd.read_csv(folder / name) for name in ("train.csv", "test_pulses.csv")]
    signals = [(log["position_qm_m"], NEWTONS_PER_VOLT * log["vir_V"]) for log in logs]
    body = fit_rigid_body(*signals[0], 1e-3)
    pulses = force_error(body, *signals[1], 1e-3)
    away = (body.values[:3] - np.array([95.11, 203.5, 20.39])) / np.array([0.11, 1.15, 0.10])
    text = f"EMPS mass {body.mass:.2f} kg, viscous {body.viscous:.1f}, Coulomb {body.coulomb:.2f} N: "
    return [
        (text + f"{np.abs(away).max():.1f} published deviations (2)", bool((np.abs(away) <= 2.0).all())),
        (f"EMPS force error {body.relative_force_error:.2%} (4.0 %)", body.relative_force_error <= 0.04),
        (f"EMPS force error on pulses {pulses:.2%} (5.0 %)", pulses <= 0.05),
    ]
