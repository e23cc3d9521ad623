"""MPPI's critics: formulas grouped by their inputs, and the plugins with their parameters."""
