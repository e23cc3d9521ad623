"""The time until an outline touches a moving body, if all keep their velocities.

By conservative advancement, as in `swept_contact`: no touch happens before the gap divided by an
upper bound of the speed at which two points close it.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.kernels.moving_bodies import place_discs, place_edges
from drake_navbench.kernels.swept_contact import clearance_at

# Slower turning bends the path by less than 1e-5 m over 10 m.
STRAIGHT_BELOW_RADPS = 1e-6
TOUCHING_M = 1e-3


@njit(cache=True)
def time_to_moving_contact(footprint, pose, twist, bodies, poses, rates, reaches, horizon):
    """Returns the time until the outline first touches a body, s; inf if not within `horizon` s.

    footprint: (K, 2) corners, base frame, m. pose: (3,) x m, y m, yaw rad and twist: (3,) v m/s, w
    rad/s, vy m/s of the robot, which keeps its twist. bodies: their edges and discs, see
    `moving_bodies`. poses, rates: (B, 3) x m, y m, yaw rad of each body, and their time
    derivatives, which it keeps. reaches: (B,) largest distance of each body's outline from its
    origin, m. A gap of a millimetre counts as a touch.
    """
    edges, discs = bodies
    radius = 0.0
    for k in range(footprint.shape[0]):
        radius = max(radius, math.hypot(footprint[k, 0], footprint[k, 1]))
    speed = math.hypot(twist[0], twist[2]) + radius * abs(twist[1])
    fastest = 0.0
    for body in range(poses.shape[0]):
        own = math.hypot(rates[body, 0], rates[body, 1]) + reaches[body] * abs(rates[body, 2])
        fastest = max(fastest, own)
    speed += fastest
    time = 0.0
    placed = np.empty_like(poses)
    while time <= horizon:
        x, y, yaw = _pose_after(pose, twist, time)
        for body in range(poses.shape[0]):
            for i in range(3):
                placed[body, i] = poses[body, i] + time * rates[body, i]
        reach = speed * (horizon - time) + TOUCHING_M
        gap = clearance_at(
            footprint, x, y, yaw, place_edges(edges, placed), place_discs(discs, placed), reach
        )
        if gap <= TOUCHING_M:
            return time
        if math.isinf(gap) or speed == 0.0:
            return math.inf
        time += gap / speed
    return math.inf


@njit(cache=True)
def _pose_after(pose, twist, time):
    """Returns x, y, yaw of a base that kept its twist for some time, s."""
    v, w, vy = twist
    yaw = pose[2] + w * time
    if abs(w) < STRAIGHT_BELOW_RADPS:
        ahead, aside = v * time, vy * time
    else:
        sine, cosine = math.sin(w * time), math.cos(w * time)
        ahead = (v * sine - vy * (1.0 - cosine)) / w
        aside = (v * (1.0 - cosine) + vy * sine) / w
    cos_yaw, sin_yaw = math.cos(pose[2]), math.sin(pose[2])
    return (
        pose[0] + ahead * cos_yaw - aside * sin_yaw,
        pose[1] + ahead * sin_yaw + aside * cos_yaw,
        yaw,
    )
