"""Rows of the candidates that were compared, by the names of the JSON contract."""

from typing import Any

import numpy as np

from estimation.identification.free_run.choose_absolute import AbsoluteCandidate
from estimation.identification.free_run.choose_hammerstein import HammersteinCandidate
from estimation.identification.free_run.choose_linear import Candidate
from estimation.identification.free_run.choose_polynomial import PolynomialCandidate


def linear_row(one: Candidate) -> dict[str, Any]:
    """Return the row of a linear candidate."""
    form = one.form
    return {
        "structure": "output-error",
        "order": form.order,
        "numerator": list(form.sizes),
        "delay": list(form.delays),
        "held_back_percent": 100.0 * (1.0 - one.held_back),
        "bic": one.bic,
        "aic": one.aic,
        "doubt": one.doubt or None,
    }


def hammerstein_row(one: HammersteinCandidate) -> dict[str, Any]:
    """Return the row of a candidate with a nonlinearity at its input."""
    form = one.fit.linear.form
    return {
        "structure": "hammerstein",
        "nonlinearity": one.fit.kind,
        "order": form.order,
        "numerator": list(form.sizes),
        "delay": list(form.delays),
        "held_back_percent": 100.0 * (1.0 - one.held_back),
        "bic": one.bic,
        "doubt": one.doubt or None,
    }


def polynomial_row(one: PolynomialCandidate) -> dict[str, Any]:
    """Return the row of a polynomial candidate."""
    terms = one.fit.terms
    return {
        "structure": "narx",
        "order": one.fit.variables.n_start,
        "terms": int(np.count_nonzero(terms[:, 1] >= 0)),
        **({"friction": one.fit.variables.friction} if one.fit.variables.friction else {}),
        "held_back_percent": 100.0 * (1.0 - one.held_back),
        "spread_percent": 100.0 * one.spread if np.isfinite(one.spread) else None,
        "bic": one.bic,
    }


def absolute_row(one: AbsoluteCandidate) -> dict[str, Any]:
    """Return the row of a candidate whose output is measured without its sign."""
    form = one.fit.linear.form
    return {
        "structure": "wiener",
        "nonlinearity": "absolute-value",
        "order": form.order,
        "numerator": list(form.sizes),
        "delay": list(form.delays),
        "held_back_percent": 100.0 * (1.0 - one.held_back),
        "bic": one.bic,
        "doubt": None,
    }
