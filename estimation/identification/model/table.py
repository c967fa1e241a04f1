"""Several models in one table."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from estimation.identification.model.linear_model import LinearModel

if TYPE_CHECKING:
    import pandas as pd


def model_table(models: Mapping[str, LinearModel]) -> "pd.DataFrame":
    """Return one row for each model: coefficients, poles, gain with its deviation, bandwidth, and quality of fit.

    Parameters
    ----------
    models : Mapping[str, LinearModel]
        Models by name, e.g. of a condition.

    Returns
    -------
    pandas.DataFrame
        Indexed by name; ``b0, b1, ..., f1, ...``, ``pole_1, ...`` (complex), ``dc_gain``, ``dc_gain_std``,
        ``bandwidth_hz``, ``fit_percent``, ``rmse``, ``residual_std``, ``n_samples``, ``sample_time_s``,
        ``input``, ``output``. NaN where a model has no such entry.
    """
    import pandas as pd

    return pd.DataFrame.from_dict({name: _row(model) for name, model in models.items()}, orient="index")


def _row(model: LinearModel) -> dict[str, Any]:
    row: dict[str, Any] = {f"b{k}": value for k, value in enumerate(model.numerator.tolist())}
    row |= {f"f{k}": value for k, value in enumerate(model.denominator.tolist()) if k > 0}
    row |= {f"pole_{k + 1}": complex(pole) for k, pole in enumerate(model.poles)}
    bandwidth = model.bandwidth_hz
    return row | {
        "dc_gain": model.dc_gain,
        "dc_gain_std": model.dc_gain_std,
        "bandwidth_hz": float("nan") if bandwidth is None else bandwidth,
        "fit_percent": model.fit_percent,
        "rmse": model.rmse,
        "residual_std": model.residual_std,
        "n_samples": model.n_samples,
        "sample_time_s": model.sample_time,
        "input": model.input_name,
        "output": model.output_name,
    }
