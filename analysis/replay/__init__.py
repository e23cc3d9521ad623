"""Replays: static pages, drawn from the logs by Drake's Meshcat, that play offline in a browser."""

from drake_navbench.analysis.replay.pages import write_race_replay, write_trial_replay

__all__ = ["write_race_replay", "write_trial_replay"]
