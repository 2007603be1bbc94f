"""PARAM_REQUEST_LIST, PARAM_REQUEST_READ and PARAM_SET, each answered by PARAM_VALUE.

PX4 sends the four bytes of a whole number in the float's field, ArduPilot sends the number converted.
"""

import struct
from typing import Any, Callable

from link import Link
from parameters import INT32, Parameters

#: Values of a list that are sent at once: the rest follow at the next ticks, so that a slow reader loses none.
BATCH = 4


class ParameterMessages:
    """The protocol's end."""

    def __init__(self, link: Link, parameters: Parameters) -> None:
        self.link, self.parameters = link, parameters
        #: Names of a list that are still to be sent.
        self.waiting: list[str] = []

    def handlers(self) -> dict[str, Callable[[Any, float], bool]]:
        """By the type of the message; each is True if it has changed a value."""
        return {"PARAM_REQUEST_LIST": self.on_list, "PARAM_REQUEST_READ": self.on_read, "PARAM_SET": self.on_set}

    def tick(self, _wall_s: float) -> None:
        for name in self.waiting[:BATCH]:
            self.send(name)
        del self.waiting[:BATCH]

    def on_list(self, _message: Any, _wall_s: float) -> bool:
        self.waiting = list(self.parameters.names)
        return False

    def on_read(self, message: Any, _wall_s: float) -> bool:
        names, index = self.parameters.names, message.param_index
        name = names[index] if 0 <= index < len(names) else message.param_id
        if name in self.parameters.rows:
            self.send(name)
        return False

    def on_set(self, message: Any, _wall_s: float) -> bool:
        name = message.param_id
        if name not in self.parameters.rows:
            return False
        changed = self.parameters.change(name, self.decoded(name, message.param_value))
        # The value in force, also where it is the old one: that is the refusal.
        self.send(name)
        return changed

    def send(self, name: str) -> None:
        names, shown = self.parameters.names, self.parameters.shown(name)
        assert shown is not None  # the name is one of the table
        kind = self.parameters.kind(name)
        value = self.encoded(name, shown)
        self.link.send(self.link.mav.param_value_encode(name.encode(), value, kind, len(names), names.index(name)))

    def by_bytes(self, name: str) -> bool:
        return not self.parameters.ardupilot and self.parameters.kind(name) == INT32

    def encoded(self, name: str, shown: float) -> float:
        return float(struct.unpack("<f", struct.pack("<i", int(shown)))[0]) if self.by_bytes(name) else shown

    def decoded(self, name: str, value: float) -> float:
        return float(struct.unpack("<i", struct.pack("<f", value))[0]) if self.by_bytes(name) else value
