"""`Array`: the type of the arrays of float64 that most functions take and return."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
