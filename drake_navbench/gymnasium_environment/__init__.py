"""Trials as an environment of Gymnasium, `drake_navbench/Navigation-v0`; see docs/gymnasium.md."""
