"""Which condition is a log in? Every condition's model is run on it; the smallest root-mean-square error wins.

There are two banks, as in section 6 of the paper: identified transfer functions, and mathematical models.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from estimation.identification.model.linear_model import LinearModel
from estimation.identification.signals.preprocess import resample
from estimation.log_checks.bridging import bridged
from faults.eha.bank import predict_runs
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.errors import LogError
from plant.log.record import Record
from plant.sensors.sensors import differentiated

if TYPE_CHECKING:
    import pandas as pd


POSITION_WINDOW = 0.01
"""Window over which position is differentiated if velocity was not logged [s]; two samples of a slower log."""


@dataclass(frozen=True, eq=False)
class Scores:
    """Errors of a bank on a log.

    Parameters
    ----------
    by_condition : Mapping[str, float]
        Score by condition [m/s, or dimensionless if pressure counts too].
    rmse : Mapping[str, Mapping[str, float]]
        Root-mean-square error [SI] by channel that counts, and by condition name.
    """

    by_condition: Mapping[str, float]
    rmse: Mapping[str, Mapping[str, float]]

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels that counted."""
        return tuple(self.rmse)

    @property
    def condition(self) -> str:
        """The condition with the smallest score."""
        return min(self.by_condition, key=lambda name: self.by_condition[name])

    def of_one(self, channel: str) -> "Scores":
        """Return the scores of one channel alone.

        Parameters
        ----------
        channel : str
            One of `channels`.

        Returns
        -------
        Scores
            With the channel's RMSE [SI] as score.
        """
        return Scores(self.rmse[channel], {channel: self.rmse[channel]})

    @property
    def table(self) -> "pd.DataFrame":
        """One row per condition: ``score``, and ``rmse_<channel>`` [SI] for each channel that counts."""
        import pandas as pd

        errors = {f"rmse_{channel}": found for channel, found in self.rmse.items()}
        return pd.DataFrame({"score": self.by_condition, **errors}).rename_axis("condition")


def score_mathematical(record: Record, bank: Mapping[str, EhaParameters], *, pressure: bool = True) -> Scores:
    """Score every condition's lumped model on a log.

    If one channel counts, the score is its RMSE in SI. If velocity and differential pressure both count, each RMSE is
    divided by the channel's own root mean square in the log, and the score is the root mean square of the two
    [dimensionless]: friction shows in pressure, leakage in velocity. A channel that is 0 in every sample has no scale,
    and does not count. Position does not count: it accumulates every error of velocity.

    Parameters
    ----------
    record : Record
        The log. Without ``differential_pressure_pa`` friction classes are distinguished by velocity alone.
    bank : Mapping[str, EhaParameters]
        Parameters by condition name.
    pressure : bool
        Whether differential pressure counts if it is logged; Table 5 uses velocity alone.

    Raises
    ------
    LogError
        If the log has neither velocity nor position.
    """
    measured = {"velocity_m_s": measured_velocity(record)}
    if pressure and "differential_pressure_pa" in record:
        measured["differential_pressure_pa"] = record["differential_pressure_pa"]
    rows = {
        name: {channel: rmse(measured[channel], predicted[channel]) for channel in measured}
        for name, predicted in predict_runs(record, bank).items()
    }
    return _scores_of_rows(rows, measured)


def score_transfer_functions(record: Record, bank: Mapping[str, LinearModel]) -> Scores:
    """Score every condition's transfer function on a log, by its RMSE in velocity [m/s].

    Parameters
    ----------
    record : Record
        The log; it is resampled to the models' sample time.
    bank : Mapping[str, LinearModel]
        Transfer functions from motor speed to velocity, by condition name.

    Returns
    -------
    Scores
        Errors by condition.

    Raises
    ------
    LogError
        If the log has neither velocity nor position.
    """
    speed = bridged(record["motor_speed_rad_s"])
    velocity = measured_velocity(record)
    at = {
        sample_time: tuple(resample(x, record.sample_time, sample_time) for x in (speed, velocity))
        for sample_time in {model.sample_time for model in bank.values()}
    }
    rows: dict[str, dict[str, float]] = {}
    for name, model in bank.items():
        u, y = at[model.sample_time]
        rows[name] = {"velocity_m_s": rmse(y, model.simulate(u))}
    return _scores_of_rows(rows, {"velocity_m_s": velocity})


def measured_velocity(record: Record) -> Array:
    """Return the logged velocity, or the derivative of the logged position.

    Returns
    -------
    ndarray, shape (n,)
        Velocity [m/s]; NaN where it is missing.

    Raises
    ------
    LogError
        If the log has neither.
    """
    if "velocity_m_s" in record:
        return record["velocity_m_s"]
    if "position_m" not in record:
        raise LogError(f"velocity_m_s or position_m is needed; the log has {', '.join(record)}")
    window = max(POSITION_WINDOW, 2.0 * record.sample_time)
    return differentiated(bridged(record["position_m"]), record.sample_time, window)


def rmse(measured: Array, predicted: Array) -> float:
    """Return the root-mean-square difference over the measured samples; infinite if a model diverged.

    Parameters
    ----------
    measured : ndarray, shape (n,)
        A channel; NaN is missing.
    predicted : ndarray, shape (n,)
        The same channel from a model.

    Returns
    -------
    float
        Their root-mean-square difference, in the channel's unit.

    Examples
    --------
    >>> rmse(np.array([1.0, np.nan, 3.0]), np.array([0.0, 5.0, 4.0]))
    1.0
    """
    if not np.all(np.isfinite(predicted)):
        return float("inf")
    return _root_mean_square(measured - predicted)


def _root_mean_square(values: Array) -> float:
    """Return the root mean square over valid samples; if all are valid, none are searched for."""
    squares = values**2
    mean = float(np.mean(squares))
    return math.sqrt(float(np.nanmean(squares)) if math.isnan(mean) else mean)


def _scores_of_rows(rows: Mapping[str, Mapping[str, float]], measured: Mapping[str, Array]) -> Scores:
    errors = {channel: {name: row[channel] for name, row in rows.items()} for channel in measured}
    if len(measured) == 1:
        return Scores(next(iter(errors.values())), errors)
    sizes = {channel: _root_mean_square(values) for channel, values in measured.items()}
    shares = [np.array(list(errors[channel].values())) / size for channel, size in sizes.items() if size > 0.0]
    scores = np.sqrt(np.sum(np.square(shares), axis=0) / len(shares)) if shares else np.zeros(len(rows))
    return Scores(dict(zip(rows, scores.tolist(), strict=True)), errors)
