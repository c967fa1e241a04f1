"""The regression of the diaphragm-motor paper's Figure 12, in three readings of its Table 2 (errata M24).

It is a least-squares fit of flow on deformation and velocity, with an intercept and six rows. Table 3's rules are
applied as printed. They miss that flow and velocity are one number by equations 17 and 18, which is reported
separately.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import norm

from experiments.page.frames import Frames, as_stacked_table
from experiments.published import load
from plant.errors import require_known

FLOW, DEFORMATION, VELOCITY = "output_flow_qg", "deformation_delta_mm", "fluid_velocity_v"

READINGS: Mapping[str, Mapping[tuple[int, str], float]] = {
    "as_printed": {},
    "anova": {(5, FLOW): 0.0868, (2, VELOCITY): 2.585e-3},
    "physical": {(2, VELOCITY): 2.585e-3},
}
"""Values that each reading replaces in Table 2, by row (from 0) and column."""

FITTED_AS = {"const": "intercept", DEFORMATION: "deformation", VELOCITY: "velocity"}
"""Statsmodels' names of the regressors, and those of the published table."""

HIGH_R_SQUARE, SIGNIFICANCE, HIGH_VIF = 0.9, 0.05, 5.0
"""Limits of Table 3's rules."""


def reading(name: str) -> pd.DataFrame:
    """Return Table 2 in one of its readings (errata M24).

    Raises
    ------
    HydrostateError
        If there is no such reading.

    Examples
    --------
    >>> reading("anova")["output_flow_qg"].tolist()[5], reading("physical")["output_flow_qg"].tolist()[5]
    (0.0868, 0.0568)
    """
    require_known("reading", name, READINGS)
    table = load("table2")
    for (row, column), value in READINGS[name].items():
        table.loc[row, column] = value
    return table


def fit(table: pd.DataFrame, regressors: Sequence[str] = (DEFORMATION, VELOCITY), of: str = FLOW) -> Any:
    """Return statsmodels' least-squares fit with an intercept; by default of flow on deformation and velocity.

    Parameters
    ----------
    table : pandas.DataFrame
        Table 2 in a reading, or another table.
    of : str
        The dependent variable's column.
    """
    from statsmodels.regression.linear_model import OLS  # slow to import, and few callers need it
    from statsmodels.tools.tools import add_constant

    return OLS(table[of], add_constant(table[list(regressors)])).fit()


def anova(found: Any) -> Mapping[str, float]:
    """Return the numbers of Figure 12 from a fit.

    Returns
    -------
    Mapping[str, float]
        Numbers by the names of the published table, ``motor_fig12_anova.csv``, in its order.

    Examples
    --------
    >>> f"{anova(fit(reading('anova')))['f']:.6f}"
    '79.863949'
    """
    whole = {
        "multiple_r": float(np.sqrt(found.rsquared)),
        "r_square": float(found.rsquared),
        "adjusted_r_square": float(found.rsquared_adj),
        "standard_error": float(np.sqrt(found.mse_resid)),
        "observations": float(found.nobs),
        "ss_regression": float(found.ess),
        "ss_residual": float(found.ssr),
        "ss_total": float(found.centered_tss),
        "f": float(found.fvalue),
        "significance_f": float(found.f_pvalue),
    }
    for theirs, ours in FITTED_AS.items():
        value = "intercept" if ours == "intercept" else f"{ours}_coefficient"
        whole[value] = float(found.params[theirs])
        whole[f"{ours}_se"] = float(found.bse[theirs])
        whole[f"{ours}_t"] = float(found.tvalues[theirs])
        whole[f"{ours}_p"] = float(found.pvalues[theirs])
    return whole


def anova_table() -> pd.DataFrame:
    """Return Figure 12's numbers, published and in every reading.

    Returns
    -------
    pandas.DataFrame
        Columns quantity, published, one for each reading, and relative_difference of the reading `anova`.
    """
    table = load("fig12_anova").rename(columns={"value": "published"})
    for name in READINGS:
        numbers = anova(fit(reading(name)))
        table[name] = [numbers[quantity] for quantity in table["quantity"].tolist()]
    return table.assign(relative_difference=(table["anova"] / table["published"] - 1.0).abs())


def limits_table() -> pd.DataFrame:
    """Return the numbers of Figure 12 that are limits, mean squares and degrees of freedom, in the reading `anova`.

    Returns
    -------
    pandas.DataFrame
        Columns quantity and value.
    """
    found = fit(reading("anova"))
    limits = found.conf_int(alpha=0.05)
    values = {
        "df_regression": float(found.df_model),
        "df_residual": float(found.df_resid),
        "df_total": float(found.df_model + found.df_resid),
        "ms_regression": float(found.mse_model),
        "ms_residual": float(found.mse_resid),
    }
    for theirs, ours in FITTED_AS.items():
        low, high = limits.loc[theirs]
        values |= {f"{ours}_low": float(low), f"{ours}_high": float(high)}
    return pd.DataFrame({"quantity": list(values), "value": list(values.values())})


@as_stacked_table
def residual_table() -> Frames:
    """Return the data behind the residual, line-fit and probability plots of Figures 10 to 16, per reading.

    Returns
    -------
    pandas.DataFrame
        One row for each reading and row of Table 2: flow, deformation, velocity, predicted, residual,
        standardised_residual (residual over its own standard deviation, sqrt(1 - leverage) included), leverage;
        percentile and sorted_flow, as in Figure 12's probability output; normal_score, the normal quantile of that
        percentile.
    """
    for name in READINGS:
        table = reading(name)
        found = fit(table)
        influence = found.get_influence()
        percentile = 100.0 * (np.arange(len(table)) + 0.5) / len(table)
        yield {
            "reading": name,
            "row": np.arange(1, len(table) + 1),
            "flow": table[FLOW],
            "deformation": table[DEFORMATION],
            "velocity": table[VELOCITY],
            "predicted": found.fittedvalues,
            "residual": found.resid,
            "standardised_residual": influence.resid_studentized_internal,
            "leverage": influence.hat_matrix_diag,
            "percentile": percentile,
            "sorted_flow": np.sort(table[FLOW].to_numpy()),
            "normal_score": norm.ppf(percentile / 100.0),
        }


def inflations(found: Any) -> list[float]:
    """Return the variance inflation factor of each regressor.

    Returns
    -------
    list of float
        1/(1 - r^2), with r^2 from the regression of the regressor on the others [dimensionless].
    """
    from statsmodels.stats.outliers_influence import variance_inflation_factor

    design = np.asarray(found.model.exog)
    return [float(variance_inflation_factor(design, k)) for k in range(1, design.shape[1])]


def predictive_r_square(found: Any) -> float:
    """Return R^2 of predictions of each row from the others (PRESS).

    Returns
    -------
    float
        One minus the ratio of the predictions' squared errors to the squared deviations from the mean [dimensionless].
    """
    left_out = found.get_influence().resid_press
    return float(1.0 - np.sum(left_out**2) / found.centered_tss)


def decisions() -> pd.DataFrame:
    """Return the results of Table 3's five rules for each reading.

    Returns
    -------
    pandas.DataFrame
        Columns reading, rule, quantity, value, limit, met, decision.
    """
    rows = [(name, *rule) for name in READINGS for rule in _rules(reading(name))]
    columns = ["reading", "rule", "quantity", "value", "limit", "met", "decision"]
    return pd.DataFrame(rows, columns=columns)


def _rules(table: pd.DataFrame) -> Iterator[tuple[str, str, float, str, bool, str]]:
    found = fit(table)
    good = bool(found.rsquared_adj > HIGH_R_SQUARE)
    yield "1", "adjusted R²", float(found.rsquared_adj), "> 0.9", good, "use for control" if good else "do not use"
    valid = bool(found.f_pvalue < SIGNIFICANCE)
    yield "2", "significance of F", float(found.f_pvalue), "< 0.05", valid, "proceed" if valid else "stop"
    for column in (DEFORMATION, VELOCITY):
        p = float(found.pvalues[column])
        kept = p < SIGNIFICANCE
        yield "3", f"P of {FITTED_AS[column]}", p, "< 0.05", kept, "retain" if kept else "remove"
    betas = {column: _standardised(found, table, column) for column in (DEFORMATION, VELOCITY)}
    for column, beta in betas.items():
        most = abs(beta) == max(abs(value) for value in betas.values())
        yield "4", f"standardised β of {FITTED_AS[column]}", beta, "largest", most, "focus on it" if most else "second"
    factor = inflations(found)[0]
    apart = factor < HIGH_VIF
    yield "5", "variance inflation factor", factor, "< 5", apart, "keep both" if apart else "drop one"


def _standardised(found: Any, table: pd.DataFrame, column: str) -> float:
    return float(found.params[column] * table[column].std() / table[FLOW].std())


def circularity() -> pd.DataFrame:
    """Return why the regression says nothing about a motor, in the physical reading.

    Equation 18 gives velocity from flow and load, so velocity divided by ``1 - F/F_max`` is flow divided by one area.
    The pairs that the paper's text claims to relate, flow or velocity and sensing voltage, are listed beside it.

    Returns
    -------
    pandas.DataFrame
        Columns pair, r_square (of a straight line), meaning.
    """
    table = reading("physical")
    unloaded = table[VELOCITY] / (1.0 - table["external_load_f"] / table["blocking_force_fmax"])
    pairs = (
        ("flow, and velocity over (1 - F/F_max)", unloaded, FLOW, "the same number twice, by equation 18"),
        ("flow, and velocity", table[VELOCITY], FLOW, "what Figure 12 fits, with deformation"),
        ("flow, and deformation", table[DEFORMATION], FLOW, "what Figure 12 fits, with velocity"),
        ("flow, and sensing voltage", table["driving_voltage_us"], FLOW, "what the text claims"),
        ("velocity, and sensing voltage", table["driving_voltage_us"], VELOCITY, "what the text claims"),
    )
    rows = [
        (words, float(np.corrcoef(x.to_numpy(), table[y].to_numpy())[0, 1] ** 2), meaning)
        for words, x, y, meaning in pairs
    ]
    return pd.DataFrame(rows, columns=["pair", "r_square", "meaning"])
