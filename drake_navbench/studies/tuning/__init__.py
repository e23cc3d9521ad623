"""Searches for parameters that beat a preset, and validates them on fresh seeds."""
