"""A client that does at `compute` what its first argument says; else it stands still."""

import os
import signal
import struct
import sys
import time

import msgpack

LENGTH = struct.Struct(">I")
requests = os.fdopen(int(os.environ["DRAKE_NAVBENCH_READ_FD"]), "rb")
answers = os.fdopen(int(os.environ["DRAKE_NAVBENCH_WRITE_FD"]), "wb")


def frame(answer):
    body = msgpack.packb(answer)
    return LENGTH.pack(len(body)) + body


def send(data):
    answers.write(data)
    answers.flush()


def die():
    print("the last straw", flush=True)
    os._exit(3)


def chat():
    # More than a pipe holds.
    os.write(1, b"chatter\n" * 20_000)
    send(frame({"command": [0.0, 0.0]}))


DEEDS = {
    "dies": die,
    "crashes": lambda: os.kill(os.getpid(), signal.SIGSEGV),
    "is killed": lambda: os.kill(os.getpid(), signal.SIGKILL),
    "hangs": lambda: time.sleep(1000.0),
    "closes": lambda: (answers.close(), time.sleep(1000.0)),
    "raises": lambda: 1 / 0,
    "sends too much": lambda: send(LENGTH.pack(2**31) + b"x" * 100),
    "sends garbage": lambda: send(LENGTH.pack(4) + b"\xc1\xc1\xc1\xc1"),
    "sends half": lambda: (send(frame({"command": [0.0, 0.0]})[:-3]), time.sleep(1000.0)),
    "sends two": lambda: send(2 * frame({"command": [0.0, 0.0]})),
    "sends a list": lambda: send(frame([0.0, 0.0])),
    "sends nothing of use": lambda: send(frame({})),
    "sends text": lambda: send(frame({"command": ["0.1", "0.0"]})),
    "sends four": lambda: send(frame({"command": [0.1, 0.0, 0.0, 0.0]})),
    "fails oddly": lambda: send(frame({"failure": "bored"})),
    "says it is broken": lambda: send(frame({"error": "out of ideas"})),
    "finds no control": lambda: send(
        frame({"failure": "no_valid_control", "message": "no way", "details": {"tried": 3}})
    ),
    "finds no path": lambda: send(frame({"failure": "invalid_path", "message": "no plan"})),
    "draws a wrong shape": lambda: send(
        frame({"command": [0.0, 0.0], "carrot": {"shape": [3], "data": bytes(24)}})
    ),
    "chats": chat,
    "stands": lambda: send(frame({"command": [0.0, 0.0]})),
}
AT_CONFIGURE = {
    "refuses": {"error": "speed: expected a number"},
    "speaks another protocol": {"protocol": 7},
}

deed = sys.argv[1]
while len(length := requests.read(LENGTH.size)) == LENGTH.size:
    request = msgpack.unpackb(requests.read(*LENGTH.unpack(length)))
    if request["call"] == "shutdown":
        break
    if request["call"] == "configure":
        if deed == "dies at once":
            die()
        send(frame(AT_CONFIGURE.get(deed, {"protocol": 1})))
    elif request["call"] == "compute":
        DEEDS[deed]()
    else:
        send(frame({}))
        if deed == "reads no more":
            time.sleep(1000.0)
