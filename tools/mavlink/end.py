"""One end of a MAVLink 2 link over UDP on loopback: pymavlink as its users take it, told on standard input what to do.

A line in is a JSON object with one key, and each is answered by one line:
  start    the end starts, or starts again: {"key": hex or null, "behind_s": s, "accept_unsigned": bool, "to": port or null}.
           With "to" it sends to that port, without it receives on a port of the kernel's choice. Answer: {"port", "version"}.
  send     a number: the next COMMAND_LONG of the true sender, with the number in it. Answer: {"sent": n}.
  receive  seconds: one datagram, no later than that. Answer: {"datagram": hex or null, "accepted": [hex of each message's frame]}.

Every decision about a message is pymavlink's: this file neither reads nor checks a frame. It needs `pip install pymavlink==2.4.50`.
"""

import json
import os
import select
import sys
import time

os.environ["MAVLINK20"] = "1"

import pymavlink
from pymavlink import mavutil

# pymavlink's own epoch and unit: 1 January 2015, 10 microseconds.
EPOCH = 1420070400
TICKS = 100_000
# Calls of recv_msg for one datagram, at most: each gives one message or one span of bad bytes.
MOST = 4096


def accept(_mav, _message):
    """A broken receiver: it accepts whatever is not signed well."""
    return True


class End:
    def __init__(self):
        self.link = None
        self.seen = None

    def start(self, key, behind_s, accept_unsigned, to):
        if self.link is not None:
            self.link.close()
        device = "udpin:127.0.0.1:0" if to is None else f"udpout:127.0.0.1:{to}"
        self.link = mavutil.mavlink_connection(device, source_system=1, source_component=1, dialect="common")
        if key is not None:
            now = int((time.time() - EPOCH - behind_s) * TICKS)
            allow = accept if accept_unsigned else None
            self.link.setup_signing(bytes.fromhex(key), True, allow, now, 0)
        receive = self.link.recv
        self.seen = None

        def noted(n=None):
            data = receive(n)
            if data:
                self.seen = bytes(data)
            return data

        self.link.recv = noted
        port = self.link.port.getsockname()[1] if to is None else None
        return {"port": port, "version": pymavlink.__version__}

    def send(self, number):
        self.link.mav.command_long_send(2, 1, 31010, 0, number, 0, 0, 0, 0, 0, 1)
        return {"sent": number}

    def receive(self, seconds):
        self.seen, accepted = None, []
        ready, _, _ = select.select([self.link.port], [], [], seconds)
        for _ in range(MOST if ready else 0):
            message = self.link.recv_msg()
            if message is None:
                break
            if message.get_type() != "BAD_DATA":
                accepted.append(bytes(message.get_msgbuf()).hex())
        return {"datagram": self.seen and self.seen.hex(), "accepted": accepted}


def main():
    end = End()
    for line in sys.stdin:
        told = json.loads(line)
        if "start" in told:
            answer = end.start(**told["start"])
        elif "send" in told:
            answer = end.send(told["send"])
        else:
            answer = end.receive(told["receive"])
        print(json.dumps(answer), flush=True)


main()
