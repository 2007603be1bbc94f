"""The vehicle's end of the link: receives, answers, and tells of itself, from a thread that goes on whatever the steps do.

MAVSDK gives a vehicle up after 3 s without a HEARTBEAT, and a command after 2 s without an answer, so neither may wait for a step. The
thread and the steps take turns by `lock`.
"""

import select
import threading
import time
from dataclasses import dataclass
from typing import Any, Callable, Optional

from commands import Commands
from geodesy import Globe
from guidance import Motion
from holdsafe_guest import Origin, Place, Start, Step
from link import Link, Record, mavlink
from missions import Missions
from modes import ArduPilotModes, Mode, Px4Modes
from parameter_messages import ParameterMessages
from parameters import Parameters
from setpoints import set_point_of
from telemetry import Telemetry
from vehicle import Vehicle

#: System and component of an autopilot.
SYSTEM, COMPONENT = 1, 1
#: Longest wait of the thread, s: it also ends within it.
WAIT = 0.05
#: Origin where the core has none.
NOWHERE = Origin(0.0, 0.0, 0.0)
#: Kinds of message that change the vehicle's motion, by type.
KINDS = {
    "SET_POSITION_TARGET_LOCAL_NED": "set-point",
    "SET_POSITION_TARGET_GLOBAL_INT": "set-point",
    "COMMAND_LONG": "command",
    "COMMAND_INT": "command",
    "SET_MODE": "command",
}


@dataclass(frozen=True)
class Outcome:
    """State of the vehicle and of the link at the end of a step."""

    motion: Motion
    state: str
    #: Where the vehicle takes itself to be.
    place: Place
    #: Datagrams of the step.
    records: list[Record]
    #: Number of the datagram behind the set-point, command, mission or parameter in force, by kind.
    causes: dict[str, int]
    #: True if set-points are followed now.
    follows: bool


class Autopilot:
    """The end and its thread, for one trial."""

    def __init__(self, start: Start, ardupilot: bool, key: Optional[bytes], link: Link) -> None:
        self.lock, self.link = threading.Lock(), link
        body = start.body
        self.parameters = Parameters(ardupilot, start.max_speed_m_s, (body.cruise_height_m or None) if body else None)
        self.vehicle = Vehicle(start, self.parameters, ardupilot, self.say)
        globe = Globe(start.origin or NOWHERE)
        numbers = ArduPilotModes(not self.vehicle.flies) if ardupilot else Px4Modes()
        self.globe, self.numbers = globe, numbers
        self.telemetry = Telemetry(link, self.vehicle, globe, numbers)
        self.commands = Commands(link, self.vehicle, globe, self.telemetry, numbers)
        self.missions = Missions(link, self.vehicle, globe)
        self.parameter_messages = ParameterMessages(link, self.parameters)
        self.transfers = {"mission": self.missions.handlers(), "parameter": self.parameter_messages.handlers()}
        #: As in `Outcome`.
        self.causes: dict[str, int] = {}
        #: Accepted messages of a system other than the vehicle.
        self.heard = 0
        self.ends = False
        #: Error that ended the thread before its time.
        self.error: Optional[BaseException] = None
        self.thread = threading.Thread(target=self.run, daemon=True)

    def begin(self) -> None:
        self.thread.start()

    def end(self) -> None:
        self.ends = True
        if self.thread.is_alive():
            self.thread.join()
        self.link.socket.close()

    def run(self) -> None:
        try:
            self.serve()
        except Exception as error:
            self.error = error

    def serve(self) -> None:
        due = 0.0
        while not self.ends:
            wait = min(max(due - time.monotonic(), 0.0), WAIT)
            select.select([self.link.socket], [], [], wait)
            with self.lock:
                self.receive()
                wall = time.monotonic()
                self.missions.tick(wall)
                self.parameter_messages.tick(wall)
                due = self.telemetry.tick(wall)

    def receive(self) -> None:
        """Takes the datagrams that have come. The lock is held."""
        for serial, messages in self.link.receive():
            for message in messages:
                self.take(serial, message)

    def take(self, serial: int, message: Any) -> None:
        """Acts on one accepted message, if it is for this vehicle."""
        to = getattr(message, "target_system", SYSTEM), getattr(message, "target_component", COMPONENT)
        # A companion computer has the vehicle's system and a component of its own.
        itself = (message.get_srcSystem(), message.get_srcComponent()) == (SYSTEM, COMPONENT)
        if itself or to[0] not in (0, SYSTEM) or to[1] not in (0, COMPONENT):
            return
        self.heard += 1
        self.vehicle.hear()
        name, wall = message.get_type(), time.monotonic()
        for kind, handlers in self.transfers.items():
            if name in handlers and handlers[name](message, wall):
                self.causes[kind] = serial
        if self.act(name, message):
            self.causes[KINDS[name]] = serial

    def act(self, name: str, message: Any) -> bool:
        """Carries out a message of no transfer; True if it can change the vehicle's motion."""
        if name in ("COMMAND_LONG", "COMMAND_INT"):
            self.commands.take(message)
        elif name == "SET_MODE":
            asked = self.numbers.from_number(message.custom_mode)
            if asked is not None:
                self.vehicle.change_mode(asked)
        elif name.startswith("SET_POSITION_TARGET"):
            given = set_point_of(message, self.vehicle.now_s, self.vehicle.pose, self.globe)
            if given is None:
                return False
            self.vehicle.take_set_point(given)
        else:
            self.respond(name, message)
            return False
        return True

    def respond(self, name: str, message: Any) -> None:
        """Answers a message that only asks."""
        mav = self.link.mav
        if name == "TIMESYNC" and message.tc1 == 0:
            self.link.send(mav.timesync_encode(time.monotonic_ns(), message.ts1))
        elif name == "PING" and message.target_system == 0:
            to = message.get_srcSystem(), message.get_srcComponent()
            self.link.send(mav.ping_encode(message.time_usec, message.seq, *to))
        elif name == "AUTOPILOT_VERSION_REQUEST":
            self.telemetry.send(mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
        elif name == "FILE_TRANSFER_PROTOCOL":
            self.refuse_file(message)

    def refuse_file(self, message: Any) -> None:
        """Refuses a file transfer, so that a program asks for the parameters one by one at once: operation 129, error 1."""
        asked = bytes(message.payload)
        number = (int.from_bytes(asked[:2], "little") + 1) % 65536
        answer = number.to_bytes(2, "little") + bytes([asked[2], 129, 1, asked[3], 0, 0]) + bytes(4) + bytes([1])
        payload = list(answer.ljust(251, b"\0"))
        to = message.get_srcSystem(), message.get_srcComponent()
        self.link.send(self.link.mav.file_transfer_protocol_encode(0, *to, payload))

    def say(self, text: str) -> None:
        """A text for the operator: MAV_SEVERITY_INFO where the vehicle is ready, WARNING for the rest."""
        severity = 6 if text.startswith("Ready") else 4
        self.link.send(self.link.mav.statustext_encode(severity, text.encode()[:50]))

    # The steps' side.

    def step(self, step: Step) -> None:
        if self.error is not None:
            raise RuntimeError("the vehicle's end of the link failed") from self.error
        with self.lock:
            self.vehicle.read(step)

    def finish_step(self) -> Outcome:
        """The outcome with all that has come until now."""
        with self.lock:
            self.receive()
            vehicle = self.vehicle
            follows = vehicle.armed and vehicle.mode is Mode.OFFBOARD
            place = vehicle.pose.at if vehicle.pose else (0.0, 0.0)
            return Outcome(vehicle.motion(), vehicle.state(), place, self.link.take_records(), dict(self.causes), follows)


def wait_until(true: Callable[[], bool], limit_s: float, ended: Callable[[], Optional[str]]) -> bool:
    """Waits until something is true, or for `limit_s` of real time.

    :raises RuntimeError: the sentence of `ended`, about a process that is needed.
    """
    end = time.monotonic() + limit_s
    wake = threading.Event()
    while not true():
        if sentence := ended():
            raise RuntimeError(sentence)
        if time.monotonic() >= end:
            return False
        wake.wait(0.01)
    return True
