"""Places by latitude and longitude, in m east (x) and north (y) of a datum, on the plane there.

The plane touches the ellipsoid of WGS 84 at the datum, as Gazebo has it. 10 km away it lies 8 m
above the ellipsoid, and distances on it are right to 0.01 m.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from drake_navbench.errors import InputError, as_line
from drake_navbench.inputs.goal_poses import FoundPose, checked, is_numbers, number_of, shown

# The ellipsoid of WGS 84: its equatorial radius, m, and the square of its eccentricity.
RADIUS_M, ECCENTRICITY_2 = 6378137.0, 6.69437999014e-3
DATUM = "datum"


class Datum(NamedTuple):
    """The origin of a map or world on the earth, degrees; its x axis points east."""

    latitude: float
    longitude: float


def datum_in(value: Mapping[Any, Any], where: str) -> Datum | None:
    """Returns the `datum` of a file; None if it has none. Raises InputError.

    As in navsat_transform it is [latitude, longitude], degrees, or with a heading of 0 behind them.
    """
    if DATUM not in value:
        return None
    numbers = value[DATUM]
    if not (isinstance(numbers, list) and len(numbers) in (2, 3) and is_numbers(numbers)):
        raise InputError(
            f"{shown(where)}: {DATUM}: expected [latitude, longitude], in degrees, got "
            f"{as_line(str(numbers))}"
        )
    latitude, longitude, *turn = (float(number_of(one) or 0.0) for one in numbers)
    if turn and turn[0] != 0.0:
        raise InputError(
            f"{shown(where)}: {DATUM}: a heading of {turn[0]:g}; expected 0, x to the east"
        )
    checked(FoundPose(longitude, latitude, is_on_earth=True), f"{shown(where)}: {DATUM}")
    return Datum(latitude, longitude)


def on_plane(pose: FoundPose, datum: Datum | None, where: str) -> FoundPose:
    """Returns a pose in m; one on the earth needs the datum. Raises InputError without it."""
    if not pose.is_on_earth:
        return pose
    if datum is None:
        raise InputError(
            f"{shown(where)}: latitude and longitude; expected a Gazebo world with "
            f"<spherical_coordinates>, or `{DATUM}: [LATITUDE, LONGITUDE]` of the map's origin in "
            "this file, or x, y in m in the map's frame"
        )
    x, y = east_and_north(pose.y, pose.x, datum)
    return checked(FoundPose(x, y, pose.yaw), where)


def east_and_north(latitude: float, longitude: float, datum: Datum) -> tuple[float, float]:
    """Returns the distances of a point to the east and north of a datum, m."""
    here, there = _from_centre(latitude, longitude), _from_centre(*datum)
    dx, dy, dz = (a - b for a, b in zip(here, there, strict=True))
    phi, lam = math.radians(datum.latitude), math.radians(datum.longitude)
    outward = math.cos(lam) * dx + math.sin(lam) * dy
    east = math.cos(lam) * dy - math.sin(lam) * dx
    return east, math.cos(phi) * dz - math.sin(phi) * outward


def _from_centre(latitude: float, longitude: float) -> tuple[float, float, float]:
    """Returns a point of the ellipsoid in the frame of the earth's centre, m."""
    phi, lam = math.radians(latitude), math.radians(longitude)
    normal = RADIUS_M / math.sqrt(1.0 - ECCENTRICITY_2 * math.sin(phi) ** 2)
    ring = normal * math.cos(phi)
    height = normal * (1.0 - ECCENTRICITY_2) * math.sin(phi)
    return ring * math.cos(lam), ring * math.sin(lam), height
