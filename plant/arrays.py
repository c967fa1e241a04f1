"""Names of the array types that all layers share."""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
"""Numbers in double precision."""

Floats: TypeAlias = NDArray[np.floating[Any]]
"""Numbers of any precision, as linear algebra gives them."""

Tones: TypeAlias = NDArray[np.complexfloating[Any, Any]]
"""Amplitudes and phases of sines."""
