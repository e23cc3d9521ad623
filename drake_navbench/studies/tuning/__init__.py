"""Searches parameters that beat a preset, and says what is left of it on fresh seeds."""
