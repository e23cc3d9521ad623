"""A user's critic, as docs/controllers.md shows it."""

import re
from pathlib import Path

import numpy as np
from dwb_cases import SETUP, parameters, scene_of

DOCUMENT = Path(__file__).parents[3] / "docs" / "controllers.md"


def documented_critic():
    section = DOCUMENT.read_text(encoding="utf-8").split("## Your own DWB critic")[1]
    code = re.search(r"```python\n(.*?)```", section, re.DOTALL).group(1)
    names = {}
    exec(code, names)
    return names["KeepLeft"]


def test_documented_critic_scores_and_rejects():
    keep_left = documented_critic()
    block = keep_left.Parameters(scale=2.0, margin_m=0.1)
    critic = keep_left(block, parameters(), setup=SETUP)
    # Ends 0.3 m to the left, 0.05 m to the right (within the margin), 0.2 m to the right.
    poses = [[(0.0, 0.0, 0.0), (1.0, y, 0.0)] for y in (0.3, -0.05, -0.2)]
    verdict = critic.score(scene_of(poses), critic.initial_memory())
    np.testing.assert_allclose(verdict.scores, [0.3, 0.05, 0.2], rtol=0, atol=1e-12)
    np.testing.assert_array_equal(verdict.violations, [0, 0, 1])
    assert critic.reasons[verdict.violations[2] - 1] == "Trajectory ends right of the start."
