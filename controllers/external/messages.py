"""The messages to and from a client; docs/external_controllers.md describes the protocol."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controller import (
    ROBOT_OUTLINE,
    ControllerError,
    ControllerSetup,
    ControllerTFError,
    InvalidPath,
    NoValidControl,
    Observation,
)

PROTOCOL_VERSION = 1
FAILURES: Mapping[str, type[ControllerError]] = {
    "no_valid_control": NoValidControl,
    "invalid_path": InvalidPath,
    "tf_error": ControllerTFError,
    "failed": ControllerError,
}
# Arrays that the replay draws: how many axes they have, and how long the last one is.
DRAWN: Mapping[str, tuple[int, int | None]] = {
    "predicted_trajectory": (2, 3),
    "sampled_trajectories": (3, 3),
    "sampled_costs": (1, None),
    "carrot": (1, 2),
    "stop_trajectory": (2, 3),
    "group_trajectories": (3, 3),
}

_PACKED_KEYS = ("shape", "data")


def configure_message(setup: ControllerSetup, parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the message `configure`, which a client gets once, before all others."""
    return {
        "call": "configure",
        "protocol": PROTOCOL_VERSION,
        "parameters": _with_outline(parameters, str(setup.footprint.tolist())),
        "control_period_s": setup.control_period_s,
        "footprint": setup.footprint.tolist(),
        "footprint_is_circle": setup.footprint_is_circle,
        "inscribed_radius_m": setup.inscribed_radius_m,
        "circumscribed_radius_m": setup.circumscribed_radius_m,
        "max_linear_velocity_mps": setup.max_linear_velocity_mps,
        "max_angular_velocity_radps": setup.max_angular_velocity_radps,
        "max_lateral_velocity_mps": setup.max_lateral_velocity_mps,
        "min_turning_radius_m": setup.min_turning_radius_m,
        "response_time_constant_s": setup.response_time_constant_s,
        "max_linear_acceleration_mps2": setup.max_linear_acceleration_mps2,
        "max_angular_acceleration_radps2": setup.max_angular_acceleration_radps2,
        "costmap_resolution_m": setup.costmap_resolution_m,
        "costmap_size_m": setup.costmap_size_m,
        "inflation_radius_m": setup.inflation_radius_m,
        "inflation_cost_scaling_factor": setup.inflation_cost_scaling_factor,
        "tracks_unknown_space": setup.tracks_unknown_space,
        "wants_diagnostics": setup.wants_diagnostics,
    }


def _with_outline(value: Any, outline: str) -> Any:
    if isinstance(value, Mapping):
        return {name: _with_outline(each, outline) for name, each in value.items()}
    return outline if value == ROBOT_OUTLINE else value


def not_read_of(answer: Mapping[str, Any]) -> tuple[str, ...]:
    """Returns the names of parameters that a client says it does not know."""
    names = answer.get("not_read", [])
    return tuple(map(str, names)) if isinstance(names, list) else ()


def set_plan_message(observation: Observation) -> dict[str, Any]:
    """Returns the message `set_plan`, which a client gets with every new global plan."""
    return {
        "call": "set_plan",
        "plan_id": observation.plan_id,
        "plan": _packed(observation.global_plan),
    }


def compute_message(observation: Observation, memory: Any) -> dict[str, Any]:
    """Returns the message `compute`, which a client gets once in every cycle."""
    costmap, limit, noise = observation.costmap, observation.speed_limit, observation.noise_key
    return {
        "call": "compute",
        "time_s": observation.time_s,
        "pose": observation.pose.tolist(),
        "twist": [*observation.twist.tolist(), observation.vy_mps],
        "plan_id": observation.plan_id,
        "local_plan": _packed(observation.plan),
        "goal": observation.goal.tolist(),
        "goal_xy_tolerance_m": observation.goal_xy_tolerance_m,
        "goal_yaw_tolerance_rad": observation.goal_yaw_tolerance_rad,
        "goal_xy_reached": bool(observation.goal_xy_reached),
        "speed_limit": None
        if limit is None
        else {"value": limit.value, "is_percentage": limit.is_percentage},
        "cancel_requested": observation.cancel_requested,
        "noise": {"seed": int(noise.seed), "stream": int(noise.stream), "step": int(noise.step)},
        "costmap": {
            "shape": costmap.costs.shape,
            "data": costmap.costs.data,
            "origin": [costmap.origin_x, costmap.origin_y],
            "resolution": costmap.resolution,
            "stamp_s": costmap.stamp_s,
            "tracks_unknown": costmap.tracks_unknown,
        },
        "memory": memory,
    }


def failure_of(answer: Mapping[str, Any], memory: Any) -> ControllerError | None:
    """Returns the failure that an answer reports, or None.

    Raises ValueError for a kind of failure that does not exist.
    """
    kind = answer.get("failure")
    if kind is None:
        return None
    if kind not in FAILURES:
        raise ValueError(f"failure: got {kind!r}, expected {', '.join(FAILURES)}")
    details = answer.get("details", {})
    if not isinstance(details, dict):
        raise ValueError(f"details: got {details!r}, expected a map")
    text = str(answer.get("message", kind))
    return FAILURES[kind](text, details=details, memory=memory)


def command_of(answer: Mapping[str, Any]) -> NDArray[np.float64]:
    """Returns the command of an answer, (2,) v m/s, w rad/s or (3,) with vy m/s.

    Raises ValueError where it has none.
    """
    command = answer.get("command")
    kinds = [type(number) for number in command] if isinstance(command, list) else []
    if len(kinds) not in (2, 3) or not {*kinds} <= {int, float}:
        raise ValueError(f"command: got {command!r}, expected [v, w] or [v, w, vy]")
    return np.array(command, dtype=np.float64)


def diagnostics_of(answer: Mapping[str, Any], *, wants_arrays: bool) -> dict[str, Any]:
    """Returns an answer's diagnostics: its notes, and with `wants_arrays` the arrays to be drawn.

    Raises ValueError where the notes are no map, or name an array that is drawn.
    """
    notes = answer.get("diagnostics", {})
    if not isinstance(notes, dict):
        raise ValueError(f"diagnostics: got {notes!r}, expected a map")
    taken = set(DRAWN) & set(notes)
    if taken:
        raise ValueError(f"diagnostics: got {min(taken)}, expected it beside diagnostics")
    if not wants_arrays:
        return dict(notes)
    drawn = {name: _unpacked(name, answer[name]) for name in DRAWN if name in answer}
    return {**notes, **drawn}


def _packed(array: NDArray[np.float64]) -> dict[str, Any]:
    """Returns an array as its shape and its numbers, 8 bytes each, least significant first."""
    array = np.ascontiguousarray(array, dtype="<f8")
    return {"shape": array.shape, "data": array.tobytes()}


def _unpacked(name: str, packed: Any) -> NDArray[np.float64]:
    """Returns the array that a client has packed; raises ValueError where it is none."""
    axes, last = DRAWN[name]
    shape, data = (packed.get(key) if isinstance(packed, dict) else None for key in _PACKED_KEYS)
    if not isinstance(shape, list) or not all(type(n) is int and n >= 0 for n in shape):
        raise ValueError(f"{name}: expected a map with shape and data, got the shape {shape!r}")
    if len(shape) != axes or last not in (None, shape[-1]):
        wanted = ", ".join([*["N"] * (axes - 1), str(last or "N")])
        raise ValueError(f"{name}: got the shape {shape}, expected [{wanted}]")
    byte_count = 8 * math.prod(shape)
    if not isinstance(data, bytes) or len(data) != byte_count:
        raise ValueError(f"{name}: expected {byte_count} bytes of data for the shape {shape}")
    return np.frombuffer(data, dtype="<f8").astype(np.float64).reshape(shape)
