"""The nine-condition library: transfer functions identified on the circuit plant, with Table 6 beside them.

The paper's nine are printed with four digits, without sample time, unit or uncertainty, and those digits do not
determine the gain of the first (errata E14, E15). This library has full precision and both covariances, and records the
data that it was fitted to. It ships as ``experiments/published/transfer_function_library.json``.
"""

import json
import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from estimation.identification.fit.output_error import fit_output_error
from estimation.identification.model.linear_model import LinearModel
from experiments.circuit.passes import CHANNELS, SAMPLE_TIME, Passes, in_condition, run_passes
from experiments.nine_conditions.printed_transfer_functions import finite_or_none, pair, pairs, printed_model
from experiments.published.library import FORMAT, VERSION
from experiments.running.random_streams import stream
from faults.conditions import CONDITIONS
from faults.eha.bank import LIBRARY_DURATION, identify_bank
from plant.arrays import Array
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.drives import HOLD_TIME as PRBS_HOLD_TIME
from plant.eha.simulate import CIRCUIT
from plant.errors import LogWarning

DURATION = 80.0
"""Total duration of all passes of a test [s]."""

PASS_HOLD_TIME = 0.05
"""Time between possible switches [s]: 10 to 20 ms suit 25 Hz; 200 ms makes the gain several times less certain."""

MEAN_V, AMPLITUDE_V = 4.0, 2.0
"""Mean and amplitude of the test [V]. Without a mean the circuit's piston sticks at every reversal, and a linear model
explains half of its motion; 2 to 6 V are above the dead zone of every condition (errata E8)."""

PASS_TIME, SETTLING = 4.0, 1.5
"""Duration of a pass, which covers about 0.7 of the stroke, and of the part omitted after each reversal [s]."""

HIGHEST_ORDER = 2
"""Highest order in the comparison."""

LARGEST_GAIN_STD = 0.1
"""Relative standard deviation above which a gain counts as not determined."""


def circuit_passes(
    rig: CircuitParameters, condition: str, rng: np.random.Generator, duration: float = DURATION
) -> tuple[list[Array], list[Array]]:
    """Return an identification test of the circuit plant, pass by pass, with each pass's mean removed.

    Each pass is a separate experiment with its own initial state. The sample time is that of the models, as inferred
    for Table 6 (errata E14).

    Parameters
    ----------
    duration : float
        Total duration of all passes [s].

    Returns
    -------
    speeds, velocities : list of ndarray
        Motor speed [rad/s] and velocity [m/s] of each pass, as measured by the bench's sensors.
    """
    test = Passes(MEAN_V, AMPLITUDE_V, max(1, round(duration / PASS_TIME)), PASS_TIME, PASS_HOLD_TIME, SETTLING)
    speeds, velocities = run_passes(in_condition(rig, condition), test, rng)
    return list(speeds), list(velocities)


def build_library(seed: int) -> dict[str, Any]:
    """Return the library as JSON values.

    Returns
    -------
    dict
        ``format``, ``version``, how it was made, and by condition the model of section 4's test (``model``, second
        order), the model of a test around an input mean (``around_mean``, of the order that the data support), and
        Table 6.
    """
    rig = CircuitParameters()
    with warnings.catch_warnings(action="ignore", category=LogWarning):  # the covariance expresses the doubts
        bank = identify_bank(rig, np.random.default_rng(seed), duration=LIBRARY_DURATION)

    def described_entry(name: str) -> dict[str, Any]:
        speeds, velocities = circuit_passes(rig, name, stream(seed, "library", name))
        around = _determined_model(speeds, velocities)
        models = {"model": bank[name].to_dict(), "around_mean": around.to_dict()}
        return {**models, **model_entries(bank[name]), "table_6": printed_model(name)}

    # not in threads: warning filters belong to the process, so threads would undo each other's
    entries = {name: described_entry(name) for name in CONDITIONS}
    return {
        "format": FORMAT,
        "version": VERSION,
        "plant": CIRCUIT.name,
        "seed": seed,
        "drive": {
            "kind": "random binary without a mean, as in section 4",
            "amplitude_v": rig.rated_speed / rig.motor_speed_per_volt,
            "hold_time_s": PRBS_HOLD_TIME,
            "duration_s": LIBRARY_DURATION,
        },
        "drive_around_mean": {
            "kind": "random binary around a mean, in passes",
            "mean_v": MEAN_V,
            "amplitude_v": AMPLITUDE_V,
            "hold_time_s": PASS_HOLD_TIME,
            "duration_s": DURATION,
        },
        "conditions": entries,
    }


def _determined_model(speeds: list[Array], velocities: list[Array]) -> LinearModel:
    """Return the output-error model, of order 1 at least, that BIC prefers among those the data determine.

    Excluded are models with a pole that a zero nearly cancels, a pole that decays more slowly than a pass lasts, or a
    vague gain: such a pole models the differences between the passes' means, and the gain would be that of a drift.
    """
    found: list[tuple[float, LinearModel]] = []
    names = dict(zip(("input_name", "output_name"), CHANNELS, strict=True))
    for order in range(1, HIGHEST_ORDER + 1):
        with warnings.catch_warnings(action="ignore", category=LogWarning):  # about models that are not kept
            form: Any = {"n_numerator": order + 1, "n_denominator": order, **names}
            model = fit_output_error(speeds, velocities, SAMPLE_TIME, covariance="coloured", **form)
        slowest = -SAMPLE_TIME / float(np.log(np.abs(model.poles[0])))
        known = model.dc_gain_std < LARGEST_GAIN_STD * abs(model.dc_gain) and slowest < PASS_TIME - SETTLING
        if order == 1 or (known and not model.cancellations):
            p = 2 * order + 1 + order * len(speeds)
            found.append((model.n_samples * float(np.log(model.rmse**2)) + p * float(np.log(model.n_samples)), model))
    return min(found, key=lambda one: one[0])[1]


def model_entries(model: LinearModel) -> dict[str, Any]:
    """Return poles, zeros, gain and bandwidth of a model, each with its standard deviation.

    Returns
    -------
    dict
        JSON values; complex numbers as pairs.
    """
    return {
        "poles": pairs(model.poles),
        "pole_std": pairs(model.pole_std),
        "zeros": pairs(model.zeros),
        "zero_std": pairs(model.zero_std),
        "dc_gain": {"value": model.dc_gain, "std": finite_or_none(model.dc_gain_std)},
        "bandwidth_hz": {"value": model.bandwidth_hz, "std": model.bandwidth_std_hz},
        "cancellations": [[pair(one.pole), pair(one.zero), one.deviations] for one in model.cancellations],
    }


def library_text(library: Mapping[str, Any]) -> str:
    """Return a library as the text of its file."""
    return json.dumps(library, indent=1, allow_nan=False) + "\n"
