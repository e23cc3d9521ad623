"""A base on two driven wheels and casters that moves in the plane, without slip.

The casters' wheels roll where they point, so that each turns by the motion of the base alone:
  d(angle)/dt = (uy cos(angle) - ux sin(angle)) / trail - w
with (ux, uy) = (v - w y, w x) the velocity of a swivel at (x, y). The friction of a swivel and the
    resistance of a rolling wheel act on the base according to their power, torque times rate:
the generalized force on v is the torque times the derivative of the rate by v, that on w likewise.
The body obeys m dv/dt = F + m c w^2 and I dw/dt = M - m c v w, its centre of mass c ahead of the
axle, I about the origin. Friction is Coulomb's, linear below a very small rate.
Source of the kinematics: R. Siegwart and I. R. Nourbakhsh, Introduction to Autonomous Mobile
Robots, 2004, 3.2.3 (castor wheel).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

# State: x m, y m, yaw rad, v m/s, w rad/s, the motors' set v and w, the angles by which the right
# and the left wheel lag behind their set angles rad, then the casters' angles rad.
TOLD_V, TOLD_W, BEHIND, FIRST_ANGLE = 5, 6, 7, 9

# Below these rates friction is proportional to the rate: rad/s of a swivel, rad/s of a driven
# wheel, m/s of a rolling wheel.
SWIVEL_SLACK_RADPS = 0.1
WHEEL_SLACK_RADPS = 0.05
ROLLING_SLACK_MPS = 0.01


@njit(cache=True)
def caster_rates(v, w, x, y, angle, trail):
    """Returns (d(angle)/dt rad/s, speed m/s at which its wheel rolls) of a caster."""
    ux, uy = v - w * y, w * x
    cos_angle, sin_angle = math.cos(angle), math.sin(angle)
    swivelling = (uy * cos_angle - ux * sin_angle) / trail - w
    return swivelling, ux * cos_angle + uy * sin_angle


@njit(cache=True)
def dry(rate, slack):
    """Returns the share, -1 to 1, of Coulomb friction that acts at a rate; linear up to `slack`."""
    return min(max(rate / slack, -1.0), 1.0)


@njit(cache=True)
def followed(wanted, value, time_constant, max_rate, step):
    """Returns a value after one step of a first-order response to `wanted` with a limited rate."""
    rate = min(max((wanted - value) / time_constant, -max_rate), max_rate)
    return value + step * rate


@njit(cache=True)
def _rates(state, body, motors, casters, frictions, rates):
    """Writes the time derivatives of the state, except for the motors' set speeds."""
    yaw, v, w = state[2], state[3], state[4]
    mass, center, inertia = body[0], body[1], body[2]
    radius, half, nominal_radius = motors[0], motors[1], motors[6]
    stiffness, integral = motors[2], motors[3]
    max_torque, dry_torque = motors[4], motors[5]
    force = mass * center * w * w
    moment = -mass * center * v * w
    for wheel in range(2):
        side = 1.0 - 2.0 * wheel
        speed = (v + side * half * w) / radius
        slower = (state[TOLD_V] + side * half * state[TOLD_W]) / nominal_radius - speed
        rates[BEHIND + wheel] = slower
        wanted = stiffness * slower + integral * state[BEHIND + wheel]
        torque = min(max(wanted, -max_torque), max_torque)
        torque -= dry_torque * dry(speed, WHEEL_SLACK_RADPS)
        force += torque / radius
        moment += side * half * torque / radius
    swivel_torque, rolling_force = frictions[0], frictions[1]
    for k in range(casters.shape[0]):
        x, y, trail = casters[k, 0], casters[k, 1], casters[k, 2]
        angle = state[FIRST_ANGLE + k]
        cos_angle, sin_angle = math.cos(angle), math.sin(angle)
        swivelling, rolling = caster_rates(v, w, x, y, angle, trail)
        rates[FIRST_ANGLE + k] = swivelling
        torque = -swivel_torque * dry(swivelling, SWIVEL_SLACK_RADPS)
        force += torque * -sin_angle / trail
        moment += torque * ((x * cos_angle + y * sin_angle) / trail - 1.0)
        drag = -rolling_force * dry(rolling, ROLLING_SLACK_MPS)
        force += drag * cos_angle
        moment += drag * (x * sin_angle - y * cos_angle)
    rates[0] = v * math.cos(yaw)
    rates[1] = v * math.sin(yaw)
    rates[2] = w
    rates[3] = force / mass
    rates[4] = moment / inertia
    rates[TOLD_V] = rates[TOLD_W] = 0.0


@njit(cache=True)
def advanced(state, command, limits, body, motors, casters, frictions, steps):
    """Returns the state after some steps (midpoint rule) under a held command (v m/s, w rad/s).

    state: (9 + C,), see FIRST_ANGLE. limits: min v, max v, max w, time constant s, max dv/dt, max
    dw/dt of the motors' set speeds; inf for none. body: mass kg with that of the turning wheels,
    centre of mass ahead of the axle m, moment of inertia about the base origin. motors: wheel
    radius m, half the wheels' separation m, torque by speed N m s and by angle N m, largest torque
    N m, dry friction N m, radius m that the motors reckon with. casters: (C, 3) x m, y m, trail m.
    frictions: friction torque of a swivel N m, resistance of a rolling caster N. steps: their
    number, and their duration together, s.
    """
    state = state.copy()
    count, duration = steps
    step = duration / count
    rates = np.empty_like(state)
    wanted_v = min(max(command[0], limits[0]), limits[1])
    wanted_w = min(max(command[1], -limits[2]), limits[2])
    for _ in range(count):
        state[TOLD_V] = followed(wanted_v, state[TOLD_V], limits[3], limits[4], step)
        state[TOLD_W] = followed(wanted_w, state[TOLD_W], limits[3], limits[5], step)
        _rates(state, body, motors, casters, frictions, rates)
        middle = state + 0.5 * step * rates
        _rates(middle, body, motors, casters, frictions, rates)
        state += step * rates
    return state
