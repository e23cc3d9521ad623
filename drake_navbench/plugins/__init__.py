"""Plugins: kinds, names, parameters, and which one a file chooses."""
