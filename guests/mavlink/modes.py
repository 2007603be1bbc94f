"""Flight modes: the vehicle's own, and how PX4 and ArduPilot number them in HEARTBEAT and in commands.

The vehicle has seven modes. PX4 has a number for each. ArduPilot has GUIDED in place of three of them, in which a take-off, a goal and
a program's set-points follow one another without a change of mode; `guided` tells it from a mode that takes no set-points.
"""

from dataclasses import dataclass
from enum import Enum
from typing import Optional

PX4, ARDUPILOT = 12, 3
#: Types of vehicle in HEARTBEAT.
QUADROTOR, ROVER = 2, 10


class Mode(Enum):
    """Mode of an armed vehicle."""

    HOLD = "HOLD"
    TAKEOFF = "TAKEOFF"
    MISSION = "MISSION"
    GOTO = "GOTO"
    OFFBOARD = "OFFBOARD"
    RTL = "RTL"
    LAND = "LAND"


#: Main mode and sub-mode of PX4 (px4_custom_mode.h). A goal is flown in HOLD there.
PX4_MODES = {
    Mode.HOLD: (4, 3),
    Mode.TAKEOFF: (4, 2),
    Mode.MISSION: (4, 4),
    Mode.GOTO: (4, 3),
    Mode.OFFBOARD: (6, 0),
    Mode.RTL: (4, 5),
    Mode.LAND: (4, 6),
}
#: Modes of ArduPilot's copter and rover; GUIDED is apart.
COPTER_MODES = {Mode.HOLD: 5, Mode.MISSION: 3, Mode.RTL: 6, Mode.LAND: 9}
ROVER_MODES = {Mode.HOLD: 4, Mode.MISSION: 10, Mode.RTL: 11}
COPTER_GUIDED, ROVER_GUIDED = 4, 15
#: Further numbers for a mode that the vehicle has: copter BRAKE and POSHOLD, rover LOITER.
COPTER_LIKE, ROVER_LIKE = {17: Mode.HOLD, 16: Mode.HOLD}, {5: Mode.HOLD}


@dataclass(frozen=True)
class Asked:
    """A mode that a command asks for; `guided` if it is ArduPilot's GUIDED."""

    mode: Mode
    guided: bool = False


@dataclass(frozen=True)
class Px4Modes:
    """Numbers of PX4."""

    autopilot: int = PX4

    def number(self, mode: Mode, guided: bool) -> int:
        main, sub = PX4_MODES[mode]
        return main << 16 | sub << 24

    def from_command(self, main: float, sub: float) -> Optional[Asked]:
        """The mode of MAV_CMD_DO_SET_MODE."""
        found = {numbers: mode for mode, numbers in PX4_MODES.items() if mode is not Mode.GOTO}
        mode = found.get((int(main), int(sub) if int(main) == 4 else 0))
        return mode and Asked(mode)

    def from_number(self, number: int) -> Optional[Asked]:
        """The mode of SET_MODE."""
        return self.from_command(number >> 16 & 0xFF, number >> 24 & 0xFF)


@dataclass(frozen=True)
class ArduPilotModes:
    """Numbers of ArduPilot's copter, or of its rover."""

    rover: bool
    autopilot: int = ARDUPILOT

    def table(self) -> dict[Mode, int]:
        return ROVER_MODES if self.rover else COPTER_MODES

    def guided_number(self) -> int:
        return ROVER_GUIDED if self.rover else COPTER_GUIDED

    def number(self, mode: Mode, guided: bool) -> int:
        if mode in (Mode.TAKEOFF, Mode.GOTO, Mode.OFFBOARD) or guided and mode is Mode.HOLD:
            return self.guided_number()
        return self.table().get(mode, self.table()[Mode.HOLD])

    def from_command(self, main: float, _sub: float) -> Optional[Asked]:
        number = int(main)
        if number == self.guided_number():
            return Asked(Mode.HOLD, guided=True)
        like = ROVER_LIKE if self.rover else COPTER_LIKE
        mode = {at: mode for mode, at in self.table().items()}.get(number) or like.get(number)
        return mode and Asked(mode)

    def from_number(self, number: int) -> Optional[Asked]:
        return self.from_command(number, 0)
