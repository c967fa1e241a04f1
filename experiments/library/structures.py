"""Section 4's comparison on the circuit plant: four structures, nine conditions, and the order beside the paper's."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from scipy.signal import freqz

from estimation.identification.choose import STRUCTURES, fit_structure, split_record
from estimation.identification.design.input_design import Limits, multisine_for, prbs_for, rank_inputs
from estimation.identification.fit.order import order_table as criteria
from estimation.identification.fit.order import order_test
from estimation.identification.fit.validate import fit_percent, validate
from estimation.identification.model.linear_model import LinearModel
from experiments.circuit.passes import SAMPLE_TIME
from experiments.library.library import DURATION, Array, circuit_passes
from experiments.page.frames import Rows, as_table
from experiments.running.random_streams import stream
from plant.eha.circuit_parameters import CircuitParameters
from plant.sensors.sensors import BENCH

PAPER_ORDER, EARLIER_ORDER = 2, 3
"""The order found in section 4, and the order in the authors' earlier work."""

PAPER_BANDWIDTH = 25.0
"""Bandwidth stated in section 7 [Hz]."""

CLOCKS = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2)
"""Clocks compared [s]; 0.2 s is "5 Hz" read literally."""

COMPARED_FREQUENCIES = (1.0, 10.0, 25.0, 40.0)
"""Frequencies at which the clocks are compared [Hz]."""

MADE_FOR, ONE_TEST = "binary, made for 25 Hz", "multisine, 0.5 to 50 Hz"
"""Names of the tests without a plain clock."""


@as_table
def structure_table(
    rig: CircuitParameters, models: Mapping[str, LinearModel], seed: int, duration: float = DURATION
) -> Rows:
    """Return the errors of ARX, ARMAX, output error and Box-Jenkins on held-back passes, per condition.

    All have the order of the library's model, so that no structure is penalised for poles that the data do not
    determine.

    Parameters
    ----------
    models : Mapping[str, LinearModel]
        The library, which gives the orders.
    duration : float
        Duration of each test [s]; two thirds are fitted.

    Returns
    -------
    pandas.DataFrame
        Columns condition, order, structure, ``fit_percent`` of the free run, ``behind_percent`` (the best structure's
        less this one's) with the standard error of that difference over the passes, ``one_step_percent``,
        ``weight_above_percent`` (share of the criterion's weight above `PAPER_BANDWIDTH`), ``dc_gain``, and ``best``.
    """
    for name, model in models.items():
        fitted, kept = split_record(*circuit_passes(rig, name, stream(seed, "structures", name), duration))
        order = model.denominator.size - 1
        form = {"n_numerator": order + 1, "n_denominator": order}
        found = {one: fit_structure(one, *fitted, SAMPLE_TIME, form) for one in STRUCTURES}
        runs = {one: _held_back_fits(model, kept) for one, model in found.items()}
        best = max(runs, key=lambda one: runs[one][0].mean())
        for one, (free, ahead) in runs.items():
            yield {
                "condition": name,
                "order": order,
                "structure": one,
                "fit_percent": free.mean(),
                "behind_percent": (runs[best][0] - free).mean(),
                "behind_std_percent": (runs[best][0] - free).std(ddof=1) / np.sqrt(free.size),
                "one_step_percent": ahead.mean(),
                "weight_above_percent": 100.0 * weight_above(found[one], fitted[0], PAPER_BANDWIDTH),
                "dc_gain": found[one].dc_gain,
                "best": one == best,
            }


def _held_back_fits(model: LinearModel, kept: tuple[list[Array], list[Array]]) -> tuple[Array, Array]:
    """Return the fit of the free run and of the one-step prediction for each pass [%]."""
    pairs = list(zip(*kept, strict=True))
    free = [validate(model, u, y).fit_percent for u, y in pairs]
    return np.array(free), np.array([fit_percent(y, model.predict(u, y)) for u, y in pairs])


def weight_above(model: LinearModel, inputs: Sequence[Array], frequency_hz: float) -> float:
    """Return the share of a criterion's weight that lies above a frequency.

    Least squares of the one-step prediction weighs an error of the transfer function at each frequency by the input's
    power times ``|D/C|^2``, the inverse power gain of the noise model (Ljung, System Identification, 1999, equation
    8.71).

    Parameters
    ----------
    model : LinearModel
        Fitted model; C = D for output error.
    inputs : sequence of ndarray, shape (n,)
        Inputs that the model was fitted to, all of the same length [input unit].
    frequency_hz : float
        Frequency [Hz].

    Returns
    -------
    float
        Fraction.

    Examples
    --------
    >>> held = [np.array([1.0, 1.0, 0.0, 0.0] * 50)]  # switches at a quarter of the sample rate, and nowhere else
    >>> weight_above(LinearModel([1.0], [1.0], 1e-3, "u", "y"), held, 100.0)
    1.0
    """
    f = np.fft.rfftfreq(inputs[0].size, model.sample_time)[1:]
    power = sum(np.abs(np.fft.rfft(u)[1:]) ** 2 for u in inputs)
    noise = np.abs(freqz(model.noise_numerator, model.noise_denominator, f, fs=1.0 / model.sample_time)[1])
    weight = power / noise**2
    return float(weight[f > frequency_hz].sum() / weight.sum())


@as_table
def order_and_bandwidth(
    rig: CircuitParameters, models: Mapping[str, LinearModel], seed: int, duration: float = 20.0
) -> Rows:
    """Return the order that each condition shows, and its break frequency, beside the paper's second order and 25 Hz.

    Parameters
    ----------
    models : Mapping[str, LinearModel]
        The library.
    duration : float
        Duration of each test [s].

    Returns
    -------
    pandas.DataFrame
        By condition: order above the noise floor, order by BIC, the first three projected singular values over the
        floor, the fit of orders 1 to 4, and the library's order and bandwidth.
    """
    for name, model in models.items():
        u, y = circuit_passes(rig, name, stream(seed, "order", name), duration)
        test, table = order_test(np.concatenate(u), np.concatenate(y)), criteria(u, y, SAMPLE_TIME)
        ratio = test.projected_singular_values[:3] / test.projected_noise_floor
        yield {
            "condition": name,
            "order_by_values": test.suggested_order,
            "order_by_bic": int(table.index[int(np.argmin(table["bic"]))]),
            **{f"value_{k}_over_floor": value for k, value in enumerate(ratio, 1)},
            **{f"fit_{order}_percent": fit for order, fit in table["fit_percent"].items()},
            "order_of_library": model.denominator.size - 1,
            "bandwidth_hz": model.bandwidth_hz,
            "bandwidth_std_hz": model.bandwidth_std_hz,
        }


def clock_table(model: LinearModel, limits: Limits, seed: int, *, duration: float = 20.0) -> pd.DataFrame:
    """Return the effect of a test's clock on accuracy at 25 Hz and elsewhere, by predicted covariance.

    Parameters
    ----------
    duration : float
        Duration of the test [s].

    Returns
    -------
    pandas.DataFrame
        Table from `rank_inputs`: binary tests of the clocks `CLOCKS`, one made for 25 Hz, and a multisine.
    """
    rng = stream(seed, "clock")
    T, n = model.sample_time, round(duration / model.sample_time)
    candidates = {
        MADE_FOR: prbs_for(PAPER_BANDWIDTH, T, limits, slowest=0.1, duration=duration),
        ONE_TEST: multisine_for(np.arange(0.5, 50.5, 0.5), T, limits, duration=duration),
    }
    for hold in CLOCKS:
        samples = round(hold / T)
        signs = np.repeat(rng.choice([-1.0, 1.0], n // samples + 1), samples)[:n]
        candidates[f"{1e3 * hold:g} ms"] = limits.speed * signs
    return rank_inputs(model, candidates, BENCH.velocity_noise, np.array(COMPARED_FREQUENCIES), limits)
