"""Output error on known systems: efficiency, global optimum, coverage of intervals, and time.

Each model of Table 6 is the truth in turn: random binary +-125.66 rad/s held for 50 ms, 20,000 samples at 1 ms, white
output noise of 1, 10 and 50 %. Then random stable systems of order 2 to 4. `--seeds 10 --systems 20` is a quick look.
"""

import argparse
import time
import warnings

import numpy as np
from threadpoolctl import threadpool_limits

from benchmarks.identification.identification_data import NOISES, TABLE_6, Case, random_system, table6_case
from estimation.finding import NORMAL_95
from estimation.identification import LinearModel, fit_output_error
from estimation.identification.fit.output_error import descend_from
from estimation.identification.fit.profile_interval import dc_gain_interval
from estimation.identification.search.criterion import Structure, sensitivities
from estimation.identification.search.experiments import Experiments
from plant.errors import LogWarning

FORM = {"n_numerator": 3, "n_denominator": 2}
MOST_EXCESS_COST = 1e-6
"""Excess cost relative to a fit started at the truth, above which the optimum counts as missed."""


def main(arguments: list[str]) -> int:
    """Print the figures of each case; return how many acceptance lines are missed."""
    parser = argparse.ArgumentParser(prog="identification", description=__doc__)
    parser.add_argument("--seeds", type=int, default=100, help="runs a case")
    parser.add_argument("--systems", type=int, default=200, help="random systems")
    options = parser.parse_args(arguments)
    with threadpool_limits(1), warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        return table6_figures(options.seeds) + random_figures(options.systems)


def table6_figures(seeds: int) -> int:
    """Print efficiency, missed optima and coverage on Table 6; return the lines missed."""
    print(f"{'case':40s} chi2/p  missed  cover  gain   flagged  profile  ms")
    rows: dict[tuple[str, float], dict[str, float]] = {}
    for name in TABLE_6:
        for noise in NOISES:
            row = rows[name, noise] = one_case(name, noise, seeds)
            print(
                f"{name + f' {noise:.0%}':40s} {row['efficiency']:6.3f} {row['missed']:6.0f} {row['cover']:7.3f} "
                f"{row['gain']:6.3f} {row['flagged']:7.2f} {row['profile']:8.3f} {row['ms']:6.1f}"
            )
    hard = ("minor_leakage", 0.5)
    usual = {key: row for key, row in rows.items() if key != hard}
    low, high = (limit(row["efficiency"] for row in usual.values()) for limit in (min, max))
    mean = float(np.mean([row["efficiency"] for row in usual.values()]))
    quiet = sum(row["missed"] for (_, noise), row in rows.items() if noise < 0.5)
    loud = sum(row["missed"] for (_, noise), row in rows.items() if noise == 0.5)
    covers = [row["cover"] for row in usual.values()]
    gains = [row["gain"] for row in usual.values()]
    slowest = max(row["ms"] for row in rows.values())
    lines = [
        (f"efficiency {low:.3f} to {high:.3f} (0.80 to 1.25)", low >= 0.80 and high <= 1.25),
        (f"mean efficiency {mean:.3f} (0.95 to 1.05)", 0.95 <= mean <= 1.05),
        (f"optimum missed at 1 and 10 %: {quiet:.0f} of {18 * seeds} (0)", quiet == 0),
        (f"optimum missed at 50 %: {loud:.0f} of {9 * seeds} (2)", loud <= 2 * seeds / 100),
        (f"pooled coverage {min(covers):.3f} to {max(covers):.3f} (0.92 to 0.98)", _all_within(covers, 0.92, 0.98)),
        (f"gain coverage {min(gains):.3f} to {max(gains):.3f} (0.90 to 0.99)", _all_within(gains, 0.90, 0.99)),
        (
            f"minor leakage at 50 %: flagged {rows[hard]['flagged']:.2f}, profile covers {rows[hard]['profile']:.3f}",
            rows[hard]["flagged"] >= 0.9 and rows[hard]["profile"] >= 0.90,
        ),
        (f"mean time of the slowest case {slowest:.0f} ms (100)", slowest <= 100.0),
    ]
    return report(lines)


def one_case(name: str, noise: float, seeds: int) -> dict[str, float]:
    """Return the figures for one true model at one noise level, over seeds."""
    distance, covered, gains, missed, flagged, profiles, spent = [], [], [], 0, [], [], []
    for seed in range(seeds):
        case = table6_case(name, noise, seed)
        begun = time.process_time()
        model = fit_output_error(case.u, case.y, 1e-3, **FORM)
        spent.append(time.process_time() - begun)
        error = coefficients(model) - coefficients(case.truth)
        distance.append(float(error @ information(case) @ error) / error.size)
        covered.append(np.abs(error) <= NORMAL_95 * model.coefficient_std)
        gains.append(abs(model.dc_gain - case.truth.dc_gain) <= NORMAL_95 * model.dc_gain_std)
        missed += cost_of(model, case) > (1.0 + MOST_EXCESS_COST) * cost_from_truth(case)
        flagged.append(bool(model.cancellations))
        if model.cancellations:
            low, high = dc_gain_interval(model, case.u, case.y)
            profiles.append(low <= case.truth.dc_gain <= high)
    return {
        "efficiency": float(np.mean(distance)),
        "cover": float(np.mean(covered)),
        "gain": float(np.mean(gains)),
        "missed": float(missed),
        "flagged": float(np.mean(flagged)),
        "profile": float(np.mean(profiles)) if profiles else float("nan"),
        "ms": 1e3 * float(np.mean(spent)),
    }


def coefficients(model: LinearModel) -> np.ndarray:
    """Return the free coefficients in the order of the covariance."""
    return np.concatenate([model.numerator[model.delay :], model.denominator[1:]])


def information(case: Case) -> np.ndarray:
    """Return the Fisher information of the coefficients at the truth, with known initial state."""
    form = Structure(case.truth.numerator.size, case.truth.denominator.size - 1, 0, estimate_initial_state=False)
    jacobian = sensitivities(form, coefficients(case.truth), case.u)
    return jacobian.T @ jacobian / case.noise_std**2


def cost_of(model: LinearModel, case: Case) -> float:
    """Return the sum of squared residuals of a model from its own initial state."""
    residual = case.y - model.simulate(case.u, initial=model.initial_state)
    return float(residual @ residual)


def cost_from_truth(case: Case) -> float:
    """Return the smallest cost of a fit started at the truth."""
    n_b, n_f = case.truth.numerator.size, case.truth.denominator.size - 1
    size_u, size_y = float(np.sqrt(np.mean(case.u**2))), float(np.sqrt(np.mean(case.y**2)))
    start = coefficients(case.truth)
    start[:n_b] *= size_u / size_y
    everything = np.ones(case.u.size, dtype=bool)
    data = Experiments(case.u / size_u, case.y / size_y, everything, np.array([0, case.u.size]))
    return descend_from(Structure(n_b, n_f), start, data, 200)[0] * size_y**2


def random_figures(systems: int) -> int:
    """Print how often the optimum is missed on random stable systems; return the lines missed."""
    missed: dict[int, list[bool]] = {2: [], 3: [], 4: []}
    spent: list[float] = []
    for seed in range(systems):
        case = random_system(seed)
        order = case.truth.denominator.size - 1
        begun = time.process_time()
        model = fit_output_error(case.u, case.y, 1.0, n_numerator=case.truth.numerator.size, n_denominator=order)
        spent.append(time.process_time() - begun)
        missed[order].append(cost_of(model, case) > (1.0 + MOST_EXCESS_COST) * cost_from_truth(case))
        if missed[order][-1]:
            print(
                f"  missed: system {seed}, order {order}, excess {cost_of(model, case) / cost_from_truth(case) - 1:.2g}"
            )
    total = sum(sum(found) for found in missed.values())
    shares = ", ".join(f"order {order}: {sum(found)} of {len(found)}" for order, found in missed.items())
    print(f"random systems, N = 2000: {shares}; {1e3 * np.mean(spent):.0f} ms a fit")
    return report(
        [(f"missed {total} of {systems} (3 %)", total <= 0.03 * systems), ("none at order 2", not any(missed[2]))]
    )


def report(lines: list[tuple[str, bool]]) -> int:
    """Print acceptance lines with their verdict; return how many are missed."""
    for text, met in lines:
        print(f"{'met   ' if met else 'MISSED'}  {text}")
    return sum(not met for _, met in lines)


def _all_within(values: list[float], low: float, high: float) -> bool:
    return min(values) >= low and max(values) <= high
