"""Table 6 by section 4's own experiment, exactly as printed, on the circuit.

The input is a binary signal of 4 V with zero mean that may switch at 5 Hz. Only the output is filtered, forward and
backward, by a 12th-order Butterworth filter of 30 Hz. The model is an output-error model of second order.
"""

from estimation.finding import NORMAL_95
from estimation.identification.fit.output_error import fit_output_error
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.signals.preprocess import zero_phase_filter
from experiments.nine_conditions.transfer_functions import COEFFICIENTS
from experiments.page.frames import Rows, as_table
from experiments.published import as_printed
from experiments.published.digits import digits_half
from experiments.running.executors import map_in_parallel
from experiments.running.progress import Track, without_progress
from experiments.running.random_streams import stream
from faults.conditions import CONDITIONS, parameters_for
from faults.eha.bank import IDENTIFICATION_TIME
from plant.eha.drives import prbs
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.sensors.sensors import BENCH

CLOCK_HZ = 5.0
"""Clock of the printed signal: the rate at which it may switch [Hz]."""


def _printed_test_model(rig: EhaParameters, condition: str, seed: int, duration: float) -> LinearModel:
    """Return the model that section 4's experiment gives for a circuit."""
    rng = stream(seed, "Table 6 to the letter", condition)
    p, T = parameters_for(CONDITIONS[condition], rig), IDENTIFICATION_TIME
    drive = prbs(duration, T, p.rated_speed, 1.0 / CLOCK_HZ, rng)
    run = simulate(CIRCUIT, drive, T, p, sensors=BENCH, rng=rng)
    u, y = zero_phase_filter(run["motor_speed_rad_s"], run["velocity_m_s"], T, filter_input=False)
    return fit_output_error(
        u,
        y,
        T,
        n_numerator=3,
        n_denominator=2,
        covariance="coloured",
        input_name="motor_speed_rad_s",
        output_name="velocity_m_s",
    )


@as_table
def printed_test(rig: EhaParameters, seed: int, duration: float, track: Track = without_progress) -> Rows:
    """Return the models that section 4's experiment gives for nine circuits, beside Table 6.

    Parameters
    ----------
    duration : float
        Duration of each test [s].

    Returns
    -------
    pandas.DataFrame
        One row for each condition: coefficients with standard deviations, gain, bandwidth, fit, and ``held``, the
        coefficients whose 95 % interval meets the printed value within half a unit of its last digit.
    """
    published = as_printed("transfer_functions").set_index("condition")
    done = map_in_parallel(lambda name: _printed_test_model(rig, name, seed, duration), CONDITIONS)
    done = track(done, len(CONDITIONS), description="Table 6 to the letter")
    for name, model in zip(CONDITIONS, done, strict=True):
        values = dict(zip(COEFFICIENTS, [*model.numerator, *model.denominator[1:]], strict=True))
        stds = dict(zip(COEFFICIENTS, model.coefficient_std, strict=True))
        printed = {key: str(published.loc[name, key]) for key in COEFFICIENTS}
        held = [
            key
            for key in COEFFICIENTS
            if abs(values[key] - float(printed[key])) <= NORMAL_95 * stds[key] + digits_half(printed[key])
        ]
        yield {
            "condition": name,
            **values,
            **{f"{key}_std": float(std) for key, std in stds.items()},
            "dc_gain": model.dc_gain,
            "dc_gain_std": model.dc_gain_std,
            "bandwidth_hz": model.bandwidth_hz,
            "fit_percent": model.fit_percent,
            "held": len(held),
        }
