"""What tests all over the suite drive: a straight plan, the wheelchair's outline, a scenario."""

from __future__ import annotations

import numpy as np

# The published wheelchair: 1.1 m x 0.6 m, its base frame 0.25 m ahead of the rear edge. (4, 2) m.
WHEELCHAIR = np.array([[0.85, 0.3], [0.85, -0.3], [-0.25, -0.3], [-0.25, 0.3]])
WHEELCHAIR.flags.writeable = False
# The fields of a scenario of some seconds.
SHORT_DRIVE = {
    "name": "short",
    "description": "round a corner",
    "plan": {"type": "polyline", "points": [[0.0, 0.0], [1.0, 0.0], [1.5, 0.5]]},
    "goal": (1.5, 0.5, 0.8),
    "timeout_s": 8.0,
}


def straight_plan(
    length_m: float, spacing_m: float = 0.05, *, x_m: float = 0.0, y_m: float = 0.0
) -> np.ndarray:
    """Returns a plan (N, 3) along x from (x_m, y_m), both ends included."""
    x = x_m + spacing_m * np.arange(round(length_m / spacing_m) + 1)
    return np.column_stack([x, np.full_like(x, y_m), np.zeros_like(x)])
