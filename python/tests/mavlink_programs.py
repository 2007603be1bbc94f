"""Programs for the tests of the bridge to MAVLink, by name: a bare end of pymavlink, with the port that it listens on. Run by the
interpreter of guests/mavlink. They print their observations, a line each.
"""

import math
import os
import random
import socket
import sys
import time
from typing import Any, Callable, Optional

os.environ["MAVLINK20"] = "1"

from pymavlink import mavutil

NAN = float("nan")
Message = Any


class End:
    """The end, which sends a heartbeat a second while it waits."""

    def __init__(self, port: str) -> None:
        self.link = mavutil.mavlink_connection(f"udpin:127.0.0.1:{port}", source_system=245, source_component=190)
        self.link.wait_heartbeat()
        self.beat_s = 0.0

    def beat(self) -> None:
        if time.monotonic() - self.beat_s > 1.0:
            self.beat_s = time.monotonic()
            self.link.mav.heartbeat_send(6, 8, 0, 0, 4)

    def wait(self, kind: str, true: Callable[[Message], bool] = lambda _: True, limit_s: float = 20.0) -> Optional[Message]:
        end = time.monotonic() + limit_s
        while time.monotonic() < end:
            self.beat()
            message = self.link.recv_match(type=kind, blocking=True, timeout=0.2)
            if message is not None and true(message):
                return message
        return None

    def armable(self) -> None:
        self.wait("SYS_STATUS", lambda m: bool(m.onboard_control_sensors_health & 0x10000000))

    def command(self, number: int, *values: float, component: int = 1) -> int:
        """The result of a command; -1 without an answer."""
        given = [*values, *[0.0] * (7 - len(values))]
        self.link.mav.command_long_send(1, component, number, 0, *given)
        ack = self.wait("COMMAND_ACK", lambda m: m.command == number, 3.0)
        return -1 if ack is None else int(ack.result)

    def stay(self) -> None:
        self.wait("NOTHING", limit_s=600.0)


def commands(end: End) -> None:
    """Commands of all kinds, with parameters that are no numbers and to every component."""
    print("disabled", end.command(400, 1.0))
    end.armable()
    print("unknown", end.command(31999))
    print("other", end.command(400, 1.0, component=0))
    print("take-off", end.command(22, NAN, NAN, NAN, NAN, NAN, NAN, NAN))
    end.wait("EXTENDED_SYS_STATE", lambda m: m.landed_state == 2)
    print("reposition", end.command(192, NAN, NAN, NAN, NAN, NAN, NAN, NAN))
    print("mission", end.command(176, 129.0, 4.0, 4.0))
    print("off-board", end.command(176, 129.0, 6.0))
    print("version", end.command(512, 148.0), end.link.messages["AUTOPILOT_VERSION"].capabilities & 0x2000 > 0)
    print("interval", end.command(511, 33.0, 50_000.0))
    print("disarm", end.command(400, 0.0))


def parameters(end: End) -> None:
    """Reads all, changes one, and tries values that are none."""
    end.link.mav.param_request_list_send(1, 1)
    first = end.wait("PARAM_VALUE")
    names = {first.param_id}
    while len(names) < first.param_count:
        names.add(end.wait("PARAM_VALUE").param_id)
    print("names", len(names))
    for value in (2.0, NAN, -5.0):
        end.link.mav.param_set_send(1, 0, b"MPC_XY_CRUISE", value, 9)
        print("cruise", end.wait("PARAM_VALUE").param_value)
    end.link.mav.timesync_send(0, 77)
    print("time", end.wait("TIMESYNC", lambda m: m.tc1 != 0).ts1)


def garbage(end: End) -> None:
    """Datagrams that are none of MAVLink's, halves of frames, wrong checksums, and then an order as it should be."""
    end.armable()
    to = next(iter(end.link.clients))
    good = end.link.mav.command_long_encode(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0).pack(end.link.mav)
    wrong = bytearray(good)
    wrong[-1] ^= 0xFF
    unknown = bytes([0xFD, 2, 0, 0, 0, 245, 190, 0xEE, 0xEE, 0x0E, 1, 2, 3, 4])
    for data in (b"", b"\x00", b"\xfd", b"\xfd\xff\x00", os.urandom(1400), good[: len(good) // 2], bytes(wrong), unknown, b"\xfe" * 300):
        assert isinstance(end.link.port, socket.socket)
        end.link.port.sendto(data, to)
    print("armed", end.command(400, 1.0))


def set_points(end: End) -> None:
    """Flies forward by set-points, for two seconds, and is silent then, but for heartbeats."""
    end.armable()
    send = lambda: end.link.mav.set_position_target_local_ned_send(0, 1, 1, 8, 0xDC7, 0, 0, 0, 1.0, 0, 0, 0, 0, 0, 0, 0)  # noqa: E731
    send()
    print("armed", end.command(400, 1.0), "off-board", end.command(176, 129.0, 6.0))
    until = time.monotonic() + 2.0
    while time.monotonic() < until:
        send()
        end.wait("NOTHING", limit_s=0.05)


def silent(end: End) -> None:
    """Arms, enters a mission of one item, and is silent for good."""
    end.armable()
    end.link.mav.mission_count_send(1, 1, 1)
    end.wait("MISSION_REQUEST_INT")
    end.link.mav.mission_item_int_send(1, 1, 0, 3, 16, 0, 1, 0, 0, 0, 0, 473977420, 85475940, 3.0)
    print("upload", end.wait("MISSION_ACK").type)
    print("armed", end.command(400, 1.0), "mission", end.command(300))
    time.sleep(600.0)


def mute(_end: End) -> None:
    """Stays silent."""
    time.sleep(600.0)


def refused(end: End) -> None:
    """An upload with an item that the vehicle does not know."""
    end.armable()
    end.link.mav.mission_count_send(1, 1, 1)
    end.wait("MISSION_REQUEST_INT")
    end.link.mav.mission_item_int_send(1, 1, 0, 3, 93, 0, 1, 0, 0, 0, 0, 0, 0, 3.0)
    print("upload", end.wait("MISSION_ACK").type)
    end.link.mav.mission_request_list_send(1, 1)
    print("count", end.wait("MISSION_COUNT").count)


def every(end: End) -> None:
    """Messages of every type with numbers of every kind, and then an order as it should be."""
    end.armable()
    chance = random.Random(1)
    for _ in range(8):
        for kind in mavutil.mavlink.mavlink_map.values():
            end.link.mav.send(kind(*[value(kind, name, chance) for name in kind.fieldnames]))
        end.wait("NOTHING", limit_s=0.2)
    end.command(400, 0.0, 21196.0)
    print("armed", end.command(400, 1.0))


def value(kind: Any, name: str, chance: random.Random) -> Any:
    """A value of a field: numbers at the ends of their range, and floats that are none."""
    if name.startswith("target_"):
        return chance.choice((0, 1))
    form = kind.fieldtypes[kind.fieldnames.index(name)]
    length = kind.array_lengths[kind.ordered_fieldnames.index(name)]
    if form == "char":
        return bytes(chance.randrange(256) for _ in range(max(length, 1)))
    made = [number(form, chance) for _ in range(max(length, 1))]
    return made if length else made[0]


def number(form: str, chance: random.Random) -> Any:
    if form in ("float", "double"):
        return chance.choice((NAN, math.inf, -math.inf, 0.0, -1.0, 1.0, 3e38, chance.uniform(-300.0, 300.0)))
    bits = int("".join(digit for digit in form if digit.isdigit()))
    least, most = (0, 2**bits - 1) if form.startswith("u") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    return chance.choice((least, most, 0 if least else 1, chance.randint(max(least, -500), min(most, 500))))


PROGRAMS = (every, commands, parameters, garbage, set_points, silent, mute, refused)

if __name__ == "__main__":
    chosen = {program.__name__: program for program in PROGRAMS}[sys.argv[1]]
    there = End(sys.argv[2])
    chosen(there)
    print("done")
    there.stay()
