"""Array types for annotations."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from plant.arrays import Array as Array

ComplexArray: TypeAlias = NDArray[np.complex128]
BoolArray: TypeAlias = NDArray[np.bool_]
IntArray: TypeAlias = NDArray[np.int64]
