"""Writes the telemetry logs of a made rover that the tests of `holdsafe assess` read, by an implementation of MAVLink that is not ours.

    pip install pymavlink==2.4.50
    python3 tools/recordings/telemetry.py crates/judge/assess/tests/made

A winding drive at 1 m/s: attitude and places five times a second, a fix each 0.4 s that is wrong by a few centimetres, a heartbeat of the vehicle and
of the ground station each second, and a message that carries no input. `rover.tlog` has frames of version 2, `signed.tlog` these with signatures,
`first.tlog` frames of version 1. The same bytes come out each time.
"""

import math
import random
import struct
import sys
from pathlib import Path

from pymavlink.dialects.v10 import common as first
from pymavlink.dialects.v20 import common as second

RATE = 5
BEGIN_US = 1_700_000_000_000_000
ZERO = (48.1, 11.5)
SPEED = 1.0


class Log:
    """A telemetry log, the bytes so far."""

    def __init__(self, dialect, signed):
        self.dialect, self.bytes = dialect, bytearray()
        self.vehicle = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
        self.station = dialect.MAVLink(None, srcSystem=255, srcComponent=190)
        if signed:
            signing = self.vehicle.signing
            signing.secret_key, signing.sign_outgoing, signing.timestamp = bytes(range(32)), True, 1

    def put(self, us, name, *values, sender=None):
        sender = sender or self.vehicle
        message = getattr(self.dialect, f"MAVLink_{name}_message")(*values)
        self.bytes += struct.pack(">Q", us) + message.pack(sender)
        sender.seq = (sender.seq + 1) % 256


def drive(dialect, seconds, signed=False):
    """A drive as a telemetry log."""
    log, noise = Log(dialect, signed), random.Random(1)
    x, y, yaw = 0.0, 0.0, 0.4
    for i in range(seconds * RATE):
        ms, rate = 30_000 + i * 1000 // RATE, 0.3 * math.sin(0.4 * i / RATE)
        # The radio takes some milliseconds.
        us = BEGIN_US + i * 1_000_000 // RATE + noise.randrange(15_000)
        if i % RATE == 0:
            log.put(us, "heartbeat", 10, 3, 81, 10, 4, 3)
            log.put(us, "heartbeat", 6, 8, 0, 0, 4, 3, sender=log.station)
            log.put(us, "sys_status", 0, 0, 0, 500, 12_000, -1, -1, 0, 0, 0, 0, 0, 0)
        moment(log, us, ms, (x, y, yaw, rate))
        if i % 2 == 0:
            latitude, longitude = degrees(x + noise.gauss(0, 0.02), y + noise.gauss(0, 0.02))
            accuracy = [500_000, 20 + i % 3, 30, 50, 0, 0] if dialect is second else []
            log.put(us, "gps_raw_int", ms * 1000, 3, latitude, longitude, 500_000, 80, 120, 100, 0, 12, *accuracy)
        for _ in range(1000 // RATE):
            x, y, yaw = x + SPEED * math.cos(yaw) / 1000, y + SPEED * math.sin(yaw) / 1000, yaw + rate / 1000
    return bytes(log.bytes)


def degrees(x, y):
    """Ten-millionths of a degree of a place."""
    east = x / (111_320 * math.cos(math.radians(ZERO[0])))
    return round((ZERO[0] + y / 111_200) * 1e7), round((ZERO[1] + east) * 1e7)


def moment(log, us, ms, motion):
    """The estimates of one moment."""
    x, y, yaw, rate = motion
    north, east = SPEED * math.sin(yaw), SPEED * math.cos(yaw)
    clockwise = math.pi / 2 - yaw
    log.put(us, "attitude", ms, 0.0, 0.0, math.atan2(math.sin(clockwise), math.cos(clockwise)), 0.0, 0.0, -rate)
    log.put(us, "local_position_ned", ms, y, x, 0.0, north, east, 0.0)
    course = round(math.degrees(clockwise) % 360 * 100)
    place = degrees(x, y)
    log.put(us, "global_position_int", ms, *place, 500_000, 0, round(100 * north), round(100 * east), 0, course)
    log.put(us, "vfr_hud", SPEED, SPEED, course // 100, 30, 500.0, 0.0)


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    (folder / "rover.tlog").write_bytes(drive(second, 12))
    (folder / "signed.tlog").write_bytes(drive(second, 2, signed=True))
    (folder / "first.tlog").write_bytes(drive(first, 2))
