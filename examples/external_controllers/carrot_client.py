"""A controller in a process of its own: drives towards a point ahead on the plan.

    drake-navbench run empty --controllers "external:command=python carrot_client.py"

It needs the package `msgpack` alone. docs/external_controllers.md describes the protocol.
"""

from __future__ import annotations

import math
import os
import struct

import msgpack

PROTOCOL_VERSION = 1
LENGTH = struct.Struct(">I")
LETHAL = 254
POSE = struct.Struct("<3d")


class CarrotController:
    """Turns and drives towards the first plan pose farther away than the lookahead distance."""

    def configure(self, request):
        """Takes what is fixed for a trial; what is wrong is answered as `error`."""
        parameters = {"speed": 0.4, "lookahead_m": 0.6} | request["parameters"]
        unknown = set(parameters) - {"speed", "lookahead_m"}
        if unknown:
            return {"error": f"{min(unknown)} is not a parameter"}
        self.speed = min(parameters["speed"], request["max_linear_velocity_mps"])
        self.turn_limit = request["max_angular_velocity_radps"]
        self.lookahead_m = parameters["lookahead_m"]
        self.front_m = max(x for x, _ in request["footprint"])
        self.wants_diagnostics = request["wants_diagnostics"]
        return {"protocol": PROTOCOL_VERSION}

    def compute(self, request):
        """Returns the decision of one cycle."""
        x, y, yaw = request["pose"]
        carrot_x, carrot_y = self.carrot(request["local_plan"]["data"], x, y)
        if self.is_blocked(request["costmap"], x, y, yaw):
            return {"failure": "no_valid_control", "message": "something stands in front"}
        bearing = wrapped(math.atan2(carrot_y - y, carrot_x - x) - yaw)
        if request["goal_xy_reached"]:
            speed, turn = 0.0, 2.0 * wrapped(request["goal"][2] - yaw)
        else:
            speed, turn = self.speed * max(0.0, math.cos(bearing)), 2.0 * bearing
        limit = request["speed_limit"]
        if limit is not None:
            share = limit["value"] / 100.0 * self.speed
            speed = min(speed, share if limit["is_percentage"] else limit["value"])
        turn = max(-self.turn_limit, min(self.turn_limit, turn))
        decision = {"command": [speed, turn], "diagnostics": {"bearing_rad": bearing}}
        if self.wants_diagnostics:
            decision["carrot"] = {"shape": [2], "data": struct.pack("<2d", carrot_x, carrot_y)}
        return decision

    def carrot(self, plan, x, y):
        """Returns the first point of a packed plan beyond the lookahead distance, or its last."""
        point = x, y
        for point_x, point_y, _ in POSE.iter_unpack(plan):
            point = point_x, point_y
            ahead, beside = point_x - x, point_y - y
            if math.sqrt(ahead * ahead + beside * beside) >= self.lookahead_m:
                break
        return point

    def is_blocked(self, costmap, x, y, yaw):
        """Tells whether a lethal cell lies within 0.3 m ahead of the middle of the front."""
        rows, columns = costmap["shape"]
        origin_x, origin_y = costmap["origin"]
        for step in range(7):
            ahead_m = self.front_m + 0.05 * step
            column = math.floor((x + ahead_m * math.cos(yaw) - origin_x) / costmap["resolution"])
            row = math.floor((y + ahead_m * math.sin(yaw) - origin_y) / costmap["resolution"])
            is_inside = 0 <= row < rows and 0 <= column < columns
            if is_inside and costmap["data"][row * columns + column] == LETHAL:
                return True
        return False


def wrapped(angle):
    """Returns an angle within -pi and pi."""
    return math.atan2(math.sin(angle), math.cos(angle))


def main():
    """Answers one request after the other, until `shutdown` or the end of the pipe."""
    requests = os.fdopen(int(os.environ["DRAKE_NAVBENCH_READ_FD"]), "rb")
    answers = os.fdopen(int(os.environ["DRAKE_NAVBENCH_WRITE_FD"]), "wb")
    controller = CarrotController()
    while len(length := requests.read(LENGTH.size)) == LENGTH.size:
        request = msgpack.unpackb(requests.read(*LENGTH.unpack(length)))
        if request["call"] == "shutdown":
            break
        if request["call"] == "configure":
            answer = controller.configure(request)
        elif request["call"] == "compute":
            answer = controller.compute(request)
        else:
            # reset and set_plan: nothing is remembered, and the local plan comes every cycle.
            answer = {}
        body = msgpack.packb(answer)
        answers.write(LENGTH.pack(len(body)) + body)
        answers.flush()


if __name__ == "__main__":
    main()
