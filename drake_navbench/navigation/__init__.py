"""Nav2's servers around a controller, as pure parts: planner, checkers, behaviours, smoothers."""
