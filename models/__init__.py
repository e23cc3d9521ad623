"""The built-in robots: an SDF for the looks, a YAML for limits, sensors and footprint."""
