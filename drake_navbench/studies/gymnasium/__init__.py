"""Trials as an environment of Gymnasium; to import this registers `drake_navbench/Navigation-v0`.

docs/gymnasium.md describes it.
"""

import gymnasium

gymnasium.register(
    id="drake_navbench/Navigation-v0",
    entry_point=f"{__name__}.environment:NavigationEnvironment",
)
