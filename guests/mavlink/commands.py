"""COMMAND_LONG and COMMAND_INT, as orders to the vehicle. Every command is answered by a COMMAND_ACK, an unknown one too.

Parameters that a program leaves open are NaN from MAVSDK to PX4, and 0 elsewhere: neither must reach a comparison of the vehicle.
"""

import math
from dataclasses import dataclass
from typing import Any, Callable, Optional

from geodesy import UNITS, Globe, on_earth
from link import Link, mavlink
from modes import ArduPilotModes, Asked, Mode, Px4Modes
from telemetry import Telemetry
from vehicle import Result, Vehicle

#: The word of MAV_CMD_COMPONENT_ARM_DISARM that forces it.
FORCE = 21196
#: Frames whose height is above the sea; in all others it is above home.
SEA_FRAMES = {0, 5}


@dataclass(frozen=True)
class Command:
    """A command with its seven parameters; None for each that is left open."""

    number: int
    values: tuple[Optional[float], ...]
    #: Frame of a COMMAND_INT, whose place is in degrees here.
    frame: Optional[int]

    def __getitem__(self, parameter: int) -> Optional[float]:
        """By the number that MAVLink's documents give it, from 1."""
        return self.values[parameter - 1]

    def whole(self, parameter: int) -> int:
        value = self[parameter]
        return 0 if value is None else int(value)


def finite(value: float) -> Optional[float]:
    return value if math.isfinite(value) else None


def command_of(message: Any) -> Command:
    first = (message.param1, message.param2, message.param3, message.param4)
    if message.get_type() == "COMMAND_INT":
        values, frame = (*first, message.x / UNITS, message.y / UNITS, message.z), message.frame
    else:
        values, frame = (*first, message.param5, message.param6, message.param7), None
    return Command(message.command, tuple(map(finite, values)), frame)


class Commands:
    """The answers. `numbers` has the numbers of the flight modes."""

    def __init__(
        self, link: Link, vehicle: Vehicle, globe: Globe, telemetry: Telemetry, numbers: "Px4Modes | ArduPilotModes"
    ) -> None:
        self.link, self.vehicle, self.globe, self.telemetry, self.numbers = link, vehicle, globe, telemetry, numbers
        self.acts: dict[int, Callable[[Command], Result]] = {
            mavlink.MAV_CMD_COMPONENT_ARM_DISARM: self.arm,
            mavlink.MAV_CMD_NAV_TAKEOFF: self.take_off,
            mavlink.MAV_CMD_NAV_LAND: lambda _: self.mode(Mode.LAND),
            # MAVProxy's `land`.
            mavlink.MAV_CMD_DO_LAND_START: lambda _: self.mode(Mode.LAND),
            mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: lambda _: self.mode(Mode.RTL),
            mavlink.MAV_CMD_NAV_LOITER_UNLIM: lambda _: self.mode(Mode.HOLD),
            mavlink.MAV_CMD_MISSION_START: lambda _: self.mode(Mode.MISSION),
            mavlink.MAV_CMD_DO_PAUSE_CONTINUE: self.pause,
            mavlink.MAV_CMD_DO_SET_MODE: self.set_mode,
            mavlink.MAV_CMD_DO_REPOSITION: self.reposition,
            mavlink.MAV_CMD_DO_CHANGE_SPEED: self.change_speed,
            mavlink.MAV_CMD_DO_SET_HOME: self.set_home,
            mavlink.MAV_CMD_DO_SET_MISSION_CURRENT: self.seek,
            mavlink.MAV_CMD_REQUEST_MESSAGE: lambda c: supported(self.telemetry.send(c.whole(1))),
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: lambda c: supported(self.telemetry.change_period(c.whole(1), c[2] or 0.0)),
            mavlink.MAV_CMD_GET_HOME_POSITION: lambda _: supported(self.telemetry.send(mavlink.MAVLINK_MSG_ID_HOME_POSITION)),
            mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: lambda _: supported(
                self.telemetry.send(mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
            ),
        }

    def take(self, message: Any) -> None:
        """Carries out a command and answers it."""
        command = command_of(message)
        act = self.acts.get(command.number)
        # The answer to a request precedes the message in some vehicles and follows it in others: programs take both.
        result = Result.UNSUPPORTED if act is None else act(command)
        self.link.send(
            self.link.mav.command_ack_encode(command.number, result, 0, 0, message.get_srcSystem(), message.get_srcComponent())
        )

    def arm(self, command: Command) -> Result:
        if command.whole(1) == 1:
            return self.vehicle.arm()
        return self.vehicle.disarm(forced=command.whole(2) == FORCE)

    def take_off(self, command: Command) -> Result:
        height = command[7]
        if height is not None and not self.numbers.autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA:
            # PX4 has it above the sea.
            height -= self.globe.origin.height_m
        return self.vehicle.take_off(height if height is not None and height > 0.0 else None)

    def mode(self, mode: Mode) -> Result:
        return self.vehicle.change_mode(Asked(mode))

    def pause(self, command: Command) -> Result:
        return self.mode(Mode.MISSION if command.whole(1) == 1 else Mode.HOLD)

    def set_mode(self, command: Command) -> Result:
        asked = self.numbers.from_command(command[2] or 0.0, command[3] or 0.0)
        return Result.DENIED if asked is None else self.vehicle.change_mode(asked)

    def reposition(self, command: Command) -> Result:
        latitude, longitude, height = command[5], command[6], command[7]
        if latitude is None or longitude is None:
            # Without a place: stay here.
            return self.mode(Mode.HOLD)
        if not on_earth(latitude, longitude):
            return Result.DENIED
        if height is not None and command.frame in SEA_FRAMES | {None}:
            height -= self.globe.origin.height_m
        yaw = command[4]
        facing = None if yaw is None or self.vehicle.ardupilot else math.pi / 2.0 - yaw
        return self.vehicle.go_to(self.globe.place(latitude, longitude), height, facing)

    def change_speed(self, command: Command) -> Result:
        speed = command[2]
        if speed is None or speed <= 0.0:
            return Result.DENIED
        self.vehicle.plan.speed_m_s = speed
        self.vehicle.parameters.values["cruise"] = speed
        return Result.ACCEPTED

    def set_home(self, command: Command) -> Result:
        pose, home = self.vehicle.pose, self.vehicle.home
        latitude, longitude = command[5], command[6]
        if pose is None or home is None:
            return Result.TEMPORARILY_REJECTED
        if command.whole(1) == 1:
            self.vehicle.move_home(pose.at)
        elif latitude is None or longitude is None or not on_earth(latitude, longitude):
            return Result.DENIED
        else:
            self.vehicle.move_home(self.globe.place(latitude, longitude))
        return Result.ACCEPTED

    def seek(self, command: Command) -> Result:
        return Result.ACCEPTED if self.vehicle.plan.seek(command.whole(1)) else Result.DENIED


def supported(true: bool) -> Result:
    return Result.ACCEPTED if true else Result.UNSUPPORTED
