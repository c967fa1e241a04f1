"""Rows of the candidates that were compared, by the names of the JSON contract."""

from typing import Any

import numpy as np

from estimation.identification.free_run.choose_absolute import AbsoluteCandidate
from estimation.identification.free_run.choose_hammerstein import HammersteinCandidate
from estimation.identification.free_run.choose_linear import Candidate
from estimation.identification.free_run.choose_polynomial import PolynomialCandidate
from estimation.identification.free_run.held_back import ComparedModel
from estimation.identification.free_run.linear_problem import Form


def form_row(structure: str, one: ComparedModel, form: Form, doubt: str = "", **beside: Any) -> dict[str, Any]:
    """Return the row of a candidate with a linear part.

    Parameters
    ----------
    structure : str
        Name in the command line.
    one : ComparedModel
        The candidate.
    form : Form
        Of its linear part.
    doubt : str
        Why it may not be chosen; empty if it may.
    **beside : object
        Further entries.
    """
    return {
        "structure": structure,
        **beside,
        "order": form.order,
        "numerator": list(form.sizes),
        "delay": list(form.delays),
        "held_back_percent": 100.0 * (1.0 - one.held_back),
        "bic": one.bic,
        "doubt": doubt or None,
    }


def linear_row(one: Candidate) -> dict[str, Any]:
    """Return the row of a linear candidate."""
    return form_row("output-error", one, one.form, one.doubt, aic=one.aic)


def hammerstein_row(one: HammersteinCandidate) -> dict[str, Any]:
    """Return the row of a candidate with a nonlinearity at its input."""
    return form_row("hammerstein", one, one.fit.linear.form, one.doubt, nonlinearity=one.fit.kind)


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
    return form_row("wiener", one, one.fit.linear.form, nonlinearity="absolute-value")
