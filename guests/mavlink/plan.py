"""A mission that the vehicle has: its items, which of them is in force, and the goal that follows. The transfer is left to `missions`.

Items are MAVLink's, by the numbers of their commands. Those that move the vehicle are flown one after another; a change of speed takes
effect when its turn comes; items of cameras and gimbals are passed over.
"""

import math
from dataclasses import dataclass, field
from typing import Optional

from holdsafe_guest import Place
from pose import Pose

WAYPOINT, LOITER, LOITER_TIME, RETURN, LAND, TAKE_OFF, SPEED = 16, 17, 19, 20, 21, 22, 178
MOVING = {WAYPOINT, LOITER, LOITER_TIME, RETURN, LAND, TAKE_OFF}
#: Commands of cameras, gimbals and regions of interest: without an effect here.
PASSED = {195, 197, 201, 203, 204, 205, 206, 530, 1000, 1001, 2000, 2001, 2500, 2501}
KNOWN = MOVING | PASSED | {SPEED}


@dataclass(frozen=True)
class Item:
    """One item as it came."""

    command: int
    #: The four parameters of the command.
    values: tuple[float, float, float, float]
    #: The frame and the fields as they came, for the way back.
    frame: int
    x: int
    y: int
    z: float
    #: Place and height of an item that has them; height above home.
    at: Optional[Place] = None
    height_m: Optional[float] = None
    autocontinue: int = 1

    def hold_s(self) -> float:
        """Time to stay at the item; for ever at a LOITER."""
        if self.command == LOITER:
            return math.inf
        held = self.values[0] if self.command in (WAYPOINT, LOITER_TIME) else 0.0
        return held if math.isfinite(held) else 0.0

    def radius_m(self, otherwise: float) -> float:
        radius = self.values[1] if self.command == WAYPOINT else 0.0
        return radius if math.isfinite(radius) and radius > 0.0 else otherwise


@dataclass
class Plan:
    """The items and the progress along them."""

    items: list[Item] = field(default_factory=list)
    #: Index of the item in force; the number of items at the end.
    current: int = 0
    #: Index of the first item that is flown.
    first: int = 0
    #: Indices of items reached since they were last told.
    reached: list[int] = field(default_factory=list)
    #: Speed by the last item about it, m/s.
    speed_m_s: Optional[float] = None
    #: Time since which the vehicle is at the item in force.
    there_since_s: Optional[float] = None

    def replace(self, items: list[Item]) -> None:
        """Takes new items. A mission on its way goes on at the same index, as on an autopilot that is given a mission in flight."""
        self.items = items
        self.current = self.current if self.first <= self.current < len(items) else self.first
        self.there_since_s = None

    def seek(self, index: int) -> bool:
        if not 0 <= index < len(self.items):
            return False
        self.current, self.there_since_s = index, None
        return True

    @property
    def finished(self) -> bool:
        return self.current >= len(self.items)

    def restart_if_finished(self) -> None:
        if self.finished:
            self.current, self.speed_m_s = self.first, None

    def item(self) -> Optional[Item]:
        """The item that the vehicle moves by now; None at the end. Items without a motion are carried out on the way there."""
        while not self.finished:
            item = self.items[self.current]
            if item.command in MOVING:
                return item
            if item.command == SPEED and math.isfinite(item.values[1]) and item.values[1] > 0.0:
                self.speed_m_s = item.values[1]
            self.complete()
        return None

    def complete(self) -> None:
        self.reached.append(self.current)
        self.current += 1
        self.there_since_s = None

    def arrive(self, pose: Pose, now_s: float, radius_m: float) -> None:
        """Goes on to the next item if the vehicle is at this one and has stayed for its time."""
        item = self.item()
        if item is None or item.command not in (WAYPOINT, LOITER_TIME, LOITER) or item.at is None:
            return
        if self.there_since_s is None:
            near = math.dist(pose.at, item.at) <= item.radius_m(radius_m)
            level = item.height_m is None or pose.height_m is None or abs(pose.height_m - item.height_m) <= 1.0
            self.there_since_s = now_s if near and level else None
        if self.there_since_s is not None and now_s - self.there_since_s >= item.hold_s():
            self.complete()
