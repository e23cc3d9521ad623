"""The offsets of a trial's stages within a cycle.

Updates due at one instant all read the state from before it. With these offsets each stage reads
the output of the one before it: first the scan, then the costmap, then the command, then the
monitors of the command and the task.
"""

COSTMAP_OFFSET_S = 0.01
CONTROLLER_OFFSET_S = 0.02
BEHAVIOR_OFFSET_S = CONTROLLER_OFFSET_S
# Nav2 ticks the behaviour tree every 10 ms.
NAVIGATOR_OFFSET_S = CONTROLLER_OFFSET_S + 0.01
# A floor changes before the navigator's next leg begins, at an instant that no other clock shares.
FLOOR_OFFSET_S = NAVIGATOR_OFFSET_S - 0.0037
SMOOTHER_OFFSET_S = CONTROLLER_OFFSET_S + 0.005
MONITOR_OFFSET_S = CONTROLLER_OFFSET_S + 0.01

# The longest step of the integrator; events cut steps shorter.
MAX_STEP_S = 0.02
