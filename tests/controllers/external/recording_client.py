"""A client that writes every request, as it came, into the file that its argument names.

It counts the cycles in its memory, so that a test sees what comes back.
"""

import os
import struct
import sys

import msgpack

LENGTH = struct.Struct(">I")
requests = os.fdopen(int(os.environ["DRAKE_NAVBENCH_READ_FD"]), "rb")
answers = os.fdopen(int(os.environ["DRAKE_NAVBENCH_WRITE_FD"]), "wb")

with open(sys.argv[1], "ab") as record:
    while len(length := requests.read(LENGTH.size)) == LENGTH.size:
        body = requests.read(*LENGTH.unpack(length))
        record.write(body)
        record.flush()
        request = msgpack.unpackb(body)
        if request["call"] == "shutdown":
            break
        answer = {
            "configure": {"protocol": 1, "is_graceful": True},
            "reset": {"memory": 0},
            "set_plan": {},
        }.get(request["call"])
        if answer is None:
            cycles = request["memory"] + 1
            answer = {
                "command": [0.1, 0],
                "memory": cycles,
                "is_at_rest": cycles > 2,
                "predicted_trajectory": {"shape": [1, 3], "data": bytes(24)},
                "diagnostics": {"cycles": cycles},
            }
        body = msgpack.packb(answer)
        answers.write(LENGTH.pack(len(body)) + body)
        answers.flush()
