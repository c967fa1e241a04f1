"""Table 5 on a plant that differs from the model: both kinds of model on nine steps of circuits with spread parameters.

On the lumped plant the mathematical model's error is only the sensor noise, since plant and model are the same
equations.
"""

from collections.abc import Mapping

import numpy as np

from estimation.identification.model.linear_model import LinearModel
from experiments.nine_conditions.settings import StudySettings
from experiments.page.frames import Rows, as_table
from experiments.running.executors import map_in_parallel
from experiments.running.progress import Track, without_progress
from experiments.running.random_streams import stream
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.rmse import score_mathematical, score_transfer_functions
from faults.eha.bank import mathematical_bank
from faults.eha.inject import varied_actuator
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

MOST_CIRCUITS = 5
"""Number of circuits for each condition, unless the study asks for fewer."""


def _nine_steps(rig: EhaParameters, condition: str, settings: StudySettings, seed: int) -> Record:
    rng, T = stream(settings.seed, "validation on the circuit", condition, seed), settings.classification_sample_time
    p = varied_actuator(parameters_for(CONDITIONS[condition], rig), rng)
    drive = make_drive("steps", settings.duration, T, p, rng)
    return simulate(CIRCUIT, drive, T, p, sensors=BENCH, rng=rng)


@as_table
def validation_on_circuit(
    rig: EhaParameters, library: Mapping[str, LinearModel], settings: StudySettings, track: Track = without_progress
) -> Rows:
    """Compare both kinds of model, at the tables' parameters, with circuits spread about them.

    Leakage, flow bias and friction of a circuit are drawn within 10 %, bulk modulus within 20 %.

    Returns
    -------
    pandas.DataFrame
        One row for each condition: root mean square of both models' errors over the circuits, and the smallest and
        largest error of a single circuit [m/s].
    """
    bank = mathematical_bank(rig)
    circuits = range(min(settings.seeds, MOST_CIRCUITS))

    def errors(name: str) -> list[tuple[float, float]]:
        runs = [_nine_steps(rig, name, settings, seed) for seed in circuits]
        return [
            (
                score_transfer_functions(run, {name: library[name]}).by_condition[name],
                score_mathematical(run, {name: bank[name]}, pressure=False).by_condition[name],
            )
            for run in runs
        ]

    done = track(map_in_parallel(errors, CONDITIONS), len(CONDITIONS), description="validating on circuits")
    for name, found in zip(CONDITIONS, done, strict=True):
        row: dict[str, object] = {"condition": name, "circuits": len(found)}
        for words, values in zip(("transfer_function", "mathematical"), np.array(found).T, strict=True):
            row |= {
                f"rmse_{words}_m_s": float(np.sqrt(np.mean(values**2))),
                f"least_{words}_m_s": float(values.min()),
                f"largest_{words}_m_s": float(values.max()),
            }
        yield row
