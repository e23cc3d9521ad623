"""The logarithmic barrier of an interior-point method: its terms, and the longest step allowed.

Primal-dual, with a constant barrier parameter (Wächter, Biegler 2006). Quantities lie strictly
between bounds (N,) that may be infinite; `low` and `high` are the bounds' multipliers.
"""

from __future__ import annotations

import math

from numba.extending import register_jitable

# The largest share of the way to a bound, or of a multiplier to zero, that a step takes.
TO_BOUND_RATIO = 0.99


@register_jitable(error_model="numpy")
def barrier_terms(quantities, lower, upper, low, high, barrier, stiffness, push):
    """Writes the barrier's second derivatives, by the multipliers, and its first ones (`push`)."""
    for i in range(quantities.shape[0]):
        stiffness[i] = push[i] = 0.0
        if lower[i] > -math.inf:
            room = quantities[i] - lower[i]
            stiffness[i] += low[i] / room
            push[i] -= barrier / room
        if upper[i] < math.inf:
            room = upper[i] - quantities[i]
            stiffness[i] += high[i] / room
            push[i] += barrier / room


@register_jitable(error_model="numpy")
def share_to_bounds(quantities, steps, lower, upper):
    """Returns the largest share of the steps, up to 1, that keeps off all bounds."""
    share = 1.0
    for i in range(quantities.shape[0]):
        if steps[i] < 0.0 and lower[i] > -math.inf:
            share = min(share, TO_BOUND_RATIO * (quantities[i] - lower[i]) / -steps[i])
        if steps[i] > 0.0 and upper[i] < math.inf:
            share = min(share, TO_BOUND_RATIO * (upper[i] - quantities[i]) / steps[i])
    return share


@register_jitable(error_model="numpy")
def next_multiplier(multiplier, room, step, moved, barrier, spread):
    """Returns a bound's multiplier after a step.

    room: distance to the bound before the step. step: the change of the room in a whole step.
    moved: the share of the step that was taken. The result is within a factor `spread` of barrier /
    new room, as IPOPT's kappa_sigma demands.
    """
    change = (barrier - multiplier * step) / room - multiplier
    if change < 0.0:
        change *= min(1.0, TO_BOUND_RATIO * multiplier / -change)
    own = barrier / (room + moved * step)
    return min(max(multiplier + change, own / spread), own * spread)
