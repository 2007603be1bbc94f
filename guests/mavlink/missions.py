"""The transfer of a mission: up by MISSION_COUNT and MISSION_REQUEST_INT, down by MISSION_REQUEST_LIST, and its removal."""

import math
from dataclasses import replace
from typing import Any, Callable, Optional

from geodesy import UNITS, Globe, on_earth
from link import Link
from plan import KNOWN, MOVING, Item
from vehicle import Vehicle

#: MAV_MISSION_RESULT.
ACCEPTED, ERROR, UNSUPPORTED, TOO_MANY, INVALID, OUT_OF_ORDER, DENIED = 0, 1, 3, 4, 5, 13, 14
#: MAV_MISSION_TYPE of a mission; fences and rally points are others.
MISSION = 0
#: Items of a mission at most.
MOST = 500
#: Frames with degrees, whose height is above the sea, and above home.
SEA, HOME = {0, 5}, {3, 6, 10, 11}
#: Real time after which a request is sent again, s, and how often.
AGAIN, TRIES = 0.4, 5


class Missions:
    """The protocol's end. At most one transfer up is open."""

    def __init__(self, link: Link, vehicle: Vehicle, globe: Globe) -> None:
        self.link, self.vehicle, self.globe = link, vehicle, globe
        self.count, self.items = 0, []  # type: int, list[Item]
        #: System and component of the program that sends, while a transfer is open.
        self.sender: Optional[tuple[int, int]] = None
        self.asked_s, self.tries = 0.0, 0

    def handlers(self) -> dict[str, Callable[[Any, float], bool]]:
        """By the type of the message; each is True if it has changed the mission."""
        return {
            "MISSION_COUNT": self.on_count,
            "MISSION_ITEM_INT": self.on_item,
            "MISSION_REQUEST_LIST": self.on_list,
            "MISSION_REQUEST_INT": self.on_request,
            "MISSION_REQUEST": self.on_request,
            "MISSION_CLEAR_ALL": self.on_clear,
            "MISSION_SET_CURRENT": self.on_seek,
        }

    def tick(self, wall_s: float) -> None:
        """Asks again for an item that has not come."""
        if self.sender is None or wall_s < self.asked_s + AGAIN:
            return
        if self.tries >= TRIES:
            self.sender = None
        else:
            self.ask(wall_s, self.tries + 1)

    def ask(self, wall_s: float, tries: int = 1) -> None:
        assert self.sender is not None  # an open transfer has one
        self.asked_s, self.tries = wall_s, tries
        self.link.send(self.link.mav.mission_request_int_encode(*self.sender, len(self.items), MISSION))

    def answer(self, to: tuple[int, int], result: int, kind: int = MISSION) -> None:
        self.link.send(self.link.mav.mission_ack_encode(*to, result, kind))

    def on_count(self, message: Any, wall_s: float) -> bool:
        if message.mission_type != MISSION:
            self.answer(source(message), ACCEPTED if message.count == 0 else UNSUPPORTED, message.mission_type)
            return False
        if message.count > MOST:
            self.answer(source(message), TOO_MANY)
            return False
        self.sender, self.count, self.items = source(message), message.count, []
        return self.go_on(wall_s)

    def go_on(self, wall_s: float) -> bool:
        """Asks for the next item, or takes the mission if it is whole."""
        if len(self.items) < self.count:
            self.ask(wall_s)
            return False
        to, self.sender = self.sender, None
        assert to is not None  # as in `ask`
        self.vehicle.plan.replace(self.items)
        self.answer(to, ACCEPTED)
        return True

    def on_item(self, message: Any, wall_s: float) -> bool:
        if source(message) != self.sender or message.mission_type != MISSION or message.seq != len(self.items):
            return False
        item = self.read(message)
        if isinstance(item, int):
            self.answer(source(message), item)
            self.sender = None
            return False
        self.items.append(item)
        return self.go_on(wall_s)

    def read(self, message: Any) -> "Item | int":
        """The item of a message, or the reason why it is refused."""
        if message.command not in KNOWN:
            return UNSUPPORTED
        values = (message.param1, message.param2, message.param3, message.param4)
        raw = Item(message.command, values, message.frame, message.x, message.y, message.z, autocontinue=message.autocontinue)
        if message.command not in MOVING or (message.x, message.y) == (0, 0):
            return raw
        if message.frame not in SEA | HOME:
            return UNSUPPORTED
        if not math.isfinite(message.z) or not on_earth(message.x / UNITS, message.y / UNITS):
            return INVALID
        at = self.globe.place(message.x / UNITS, message.y / UNITS)
        height = message.z - (self.globe.origin.height_m if message.frame in SEA else 0.0)
        return replace(raw, at=at, height_m=height)

    def on_list(self, message: Any, _wall_s: float) -> bool:
        count = len(self.vehicle.plan.items) if message.mission_type == MISSION else 0
        self.link.send(self.link.mav.mission_count_encode(*source(message), count, message.mission_type))
        return False

    def on_request(self, message: Any, _wall_s: float) -> bool:
        items = self.vehicle.plan.items
        if message.mission_type != MISSION or message.seq >= len(items):
            self.answer(source(message), INVALID, message.mission_type)
            return False
        item = items[message.seq]
        current = int(message.seq == self.vehicle.plan.current)
        self.link.send(
            self.link.mav.mission_item_int_encode(
                *source(message), message.seq, item.frame, item.command, current, item.autocontinue, *item.values,
                item.x, item.y, item.z, MISSION,
            )
        )
        return False

    def on_clear(self, message: Any, _wall_s: float) -> bool:
        if message.mission_type in (MISSION, 255):
            self.vehicle.plan.replace([])
        self.answer(source(message), ACCEPTED, message.mission_type)
        return message.mission_type in (MISSION, 255)

    def on_seek(self, message: Any, _wall_s: float) -> bool:
        return self.vehicle.plan.seek(message.seq)


def source(message: Any) -> tuple[int, int]:
    return message.get_srcSystem(), message.get_srcComponent()
