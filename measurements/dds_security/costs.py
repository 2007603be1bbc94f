"""The cost of one level: a node writes 2,000 commands at 200 Hz to a plant, without an attack, each end its own process.

It is started by `experiment.py` in namespaces of its own: `python3 costs.py LEVEL`. Prints one JSON object.
"""

import json
import os
import struct
import sys
import tempfile
import time

from cell import isolate
from credentials import LEVELS, Authorities
from processes import Process

MESSAGES, RATE = 2000, 200
TIME_OF_SENDING = 4


def latency_ms(line):
    """From the call of `write` to the listener; both processes read one monotonic clock."""
    content = struct.unpack("<6d", bytes.fromhex(line["bytes"]))
    return 1000 * (line["t"] - content[TIME_OF_SENDING])


def measure(level, folder):
    authorities = Authorities(folder + "/own", level) if LEVELS[level] else None
    admit = lambda name: authorities.admit(name, name) if authorities else None
    # Reports wait in a buffer, so that writing them costs little; they are read at the end.
    plant = Process("plant", [], admit("plant"), is_live=False)
    time.sleep(0.5)
    node = Process("node", ["--rate", RATE, "--count", MESSAGES], admit("node"), is_live=False)
    time.sleep(MESSAGES / RATE + 3)
    node.stop()
    time.sleep(0.3)
    plant.stop()
    matched = [line["t"] for line in node.all("audience") + node.all("matched")]
    received = plant.all("received")
    return {
        "level": level,
        "load": os.getloadavg()[0],
        "sent": len(node.all("sent")),
        "latency_ms": [round(latency_ms(line), 4) for line in received],
        "first_match_ms": round(1000 * (max(matched) - node.all("start")[0]["t"]), 2),
        "sender_cpu_s": node.all("end")[0]["processor"],
        "receiver_cpu_s": plant.all("end")[0]["processor"],
    }


def main(level):
    isolate()
    with tempfile.TemporaryDirectory() as folder:
        print(json.dumps(measure(level, folder)))


if __name__ == "__main__":
    main(*sys.argv[1:])
