"""Rows of a store as a batch writes them."""

import json
from collections.abc import Mapping
from typing import Any

from faults.notes import AgainstCode


def store_row(file: str, leakage: float, spread: float = 0.2, **more: Any) -> Mapping[str, Any]:
    """Return the row of a log with a given leakage: healthy is 1, the limit is 3."""
    ends = [leakage - spread, leakage + spread]
    amount = {"value": leakage, "unit": "L/min", "ci95": ends, "healthy": 1.0, "limit": 3.0}
    stiff = {"value": 2.0e8, "unit": "Pa", "ci95": [1.9e8, 2.1e8], "healthy": 2.07e8, "limit": 1.656e8}
    row = {"file": file, "verb": "diagnose", "outcome": "ok", "found_condition": "normal", "reason": None}
    return {**row, "quantities": json.dumps({"leakage_flow": amount, "bulk_modulus": stiff}), **more}


def between(leakage: float, friction: float) -> str:
    """Return the objection to a log whose leakage and friction lie between those of two conditions, as in a row."""
    return json.dumps(
        [{"code": str(AgainstCode.BETWEEN_CONDITIONS), "data": {"leakage": leakage, "friction": friction}}]
    )


def beside(leakage: float, friction: float) -> str:
    """Return the objection to a log whose circuit does not even lie between two conditions, as in a row."""
    data = {"leakage": leakage, "friction": friction, "part": "flow bias", "ratio": 0.2}
    return json.dumps([{"code": str(AgainstCode.OUTSIDE_CONDITIONS), "data": data}])
