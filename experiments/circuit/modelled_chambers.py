"""Figure 11 on the circuit by an extended Kalman filter whose process model has two chambers, make-up and drain."""

from collections.abc import Sequence

from estimation.eha.bulk_modulus import estimate_bulk_modulus
from experiments.circuit.passes import in_condition
from experiments.page.frames import Rows, as_table
from experiments.running.executors import map_in_parallel
from experiments.running.random_streams import stream
from faults.conditions import CONDITIONS
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.sensors.sensors import BENCH

SAMPLE_TIME = 1e-3
"""Sample time of the logs [s]."""


@as_table
def modelled_chambers(
    rig: CircuitParameters, seed: int, duration: float, conditions: Sequence[str] = tuple(CONDITIONS)
) -> Rows:
    """Return the results of `hydrostate estimate --method chamber-ekf` on nine steps, the condition unknown.

    Parameters
    ----------
    rig : CircuitParameters
        The healthy circuit; its `bulk_modulus` is the truth.
    duration : float
        Duration of each log [s].

    Returns
    -------
    pandas.DataFrame
        One row for each condition: value_pa, std_pa, error_percent, z (error over standard deviation) and gate_passed.
    """

    def found(condition: str) -> dict[str, object]:
        p, rng = in_condition(rig, condition), stream(seed, "modelled chambers", condition)
        log = simulate(
            CIRCUIT, make_drive("steps", duration, SAMPLE_TIME, p, rng), SAMPLE_TIME, p, sensors=BENCH, rng=rng
        )
        estimate = estimate_bulk_modulus(log, EhaParameters(), method="chamber-ekf")
        value, std = (float("nan") if one is None else one for one in (estimate.value, estimate.std))
        error = value - rig.bulk_modulus
        return {
            "condition": condition,
            "value_pa": value,
            "std_pa": std,
            "error_percent": 100.0 * error / rig.bulk_modulus,
            "z": error / std,
            "gate_passed": estimate.gate.passed,
        }

    yield from map_in_parallel(found, conditions)
