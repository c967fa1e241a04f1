"""Formulas by which an MDF file converts raw numbers to physical values.

They are evaluated here because asammdf returns raw numbers for a formula that it cannot evaluate, never ends with
``9**9**9**9``, and with SymPy installed runs any program that the formula contains.
"""

import ast
import operator
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from plant.arrays import Array

LONGEST_FORMULA = 300
"""Characters of the longest formula that is evaluated; it cannot be nested too deeply for Python then."""

_OPERATORS: Mapping[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
}
_FUNCTIONS: Mapping[str, tuple[int, Callable[..., Any]]] = {
    **{name: (1, getattr(np, name)) for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log", "log10")},
    **{name: (1, getattr(np, name)) for name in ("sqrt", "abs", "arcsin", "arccos", "arctan")},
    "pow": (2, np.power),
}
"""How many arguments each function has, and what computes it."""


def evaluate_formula(formula: str, raw: Array) -> Array:
    """Return the physical values of raw numbers.

    Parameters
    ----------
    formula : str
        Sums, products, powers and common functions of ``X`` or ``X1``, in any case.
    raw : ndarray, shape (n,)
        Raw numbers.

    Returns
    -------
    ndarray, shape (n,)
        Physical numbers, in the unit that the file gives.

    Raises
    ------
    ValueError
        If the formula is too long, or holds anything else.

    Examples
    --------
    >>> evaluate_formula("X1/100 + 2", np.array([50, 100])).tolist()
    [2.5, 3.0]
    """
    if len(formula) > LONGEST_FORMULA:
        raise ValueError(f"it has more than {LONGEST_FORMULA} characters")
    try:
        tree = ast.parse(formula.strip(), mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        raise ValueError("it is no formula") from None
    with np.errstate(all="ignore"):
        return np.array(np.broadcast_to(_value(tree, np.asarray(raw, dtype=np.float64)), raw.shape))


def _value(node: ast.AST, raw: Array) -> Any:
    match node:
        case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
            return np.float64(number)
        case ast.Name(id=name) if name.upper() in ("X", "X1"):
            return raw
        case ast.UnaryOp(op=op, operand=one) if type(op) in _OPERATORS:
            return _OPERATORS[type(op)](_value(one, raw))
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
            return _OPERATORS[type(op)](_value(left, raw), _value(right, raw))
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name.lower() in _FUNCTIONS:
            count, function = _FUNCTIONS[name.lower()]
            if len(args) == count:
                return function(*(_value(one, raw) for one in args))
        case _:
            pass
    raise ValueError("only sums, products, powers and common functions of X are evaluated")
