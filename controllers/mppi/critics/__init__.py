"""MPPI's critics: formulas by what they look at, and the plugins that carry their parameters."""
