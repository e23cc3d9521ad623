"""Pure numerics over numpy arrays, compiled by numba; no Drake types, no state."""
