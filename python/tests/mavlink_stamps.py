"""Time stamps, keys and phases of an end of a signed link in trouble, for the vehicle's end and the program's.

An end has four phases: `begin`, `before` the trouble in the first second of flight, `during` it, and `after` it. The settings of a phase
change those of the phase before, by name:

    key      "right", "other" or "none"
    link_id  of the signatures
    clock_s  seconds by which the end's clock is ahead
    adopts   True if the end takes over later stamps that it receives, as pymavlink; False if it keeps to its own clock
    frozen   True if the stamp stands still
    restart  True if the end starts anew with these settings and has lost all stamps
    signs    False if it sends unsigned, for an end with a key that checks signatures nevertheless
    unsigned True if an end with a key admits unsigned messages
"""

import hashlib
import json
import sys
import time
from pathlib import Path
from typing import Any, Optional

MAVLINK = Path(__file__).resolve().parents[2] / "guests/mavlink"
sys.path[:0] = [str(MAVLINK), str(MAVLINK.parents[1] / "python")]

from link import EPOCH, TICKS, mavlink

Settings = dict[str, Any]
#: Settings of an end without trouble.
SOUND: Settings = {"key": "right", "link_id": 0, "clock_s": 0.0, "adopts": True, "frozen": False, "signs": True, "unsigned": False}
KEYS = {"right": hashlib.sha256(b"correct-horse").digest(), "other": hashlib.sha256(b"battery-staple").digest(), "none": None}
#: Time from the first sign of flight to the trouble, s.
BEFORE = 1.0
PHASES = ("begin", "before", "during", "after")


class Stamps(mavlink.MAVLinkSigning):  # type: ignore[misc]
    """pymavlink's state of signing, with a stamp that may keep to a clock or stand still."""

    def __init__(self, settings: Settings) -> None:
        self.settings, self.own = settings, 0
        super().__init__()
        self.own = self.clock()
        self.apply(settings)

    def apply(self, settings: Settings) -> None:
        self.settings = settings
        self.secret_key, self.link_id = KEYS[settings["key"]], settings["link_id"]
        self.sign_outgoing = self.secret_key is not None and settings["signs"]
        self.allow_unsigned_callback = (lambda *_: True) if settings["unsigned"] else None

    def clock(self) -> int:
        return int((time.time() + self.settings["clock_s"] - EPOCH) * TICKS)

    @property
    def timestamp(self) -> int:
        if not self.settings["frozen"] and not self.settings["adopts"]:
            # Strictly later than the one before, as the rules ask.
            self.own = max(self.clock(), self.own + 1)
        return max(self.own, 0)

    @timestamp.setter
    def timestamp(self, value: int) -> None:
        if self.settings["adopts"] and not self.settings["frozen"]:
            self.own = value


class Phases:
    """The phases of an end by the clock. The trouble begins with the first datagram if `at_contact`, else in flight."""

    def __init__(self, row: Settings, log: "Log") -> None:
        self.row, self.log, self.name = row, log, "begin"
        self.settings = {**SOUND, **row.get("begin", {})}
        self.due_s: Optional[float] = None

    def started(self) -> None:
        """Notes a sign of contact, or of flight: the first one starts the clock."""
        if self.due_s is None:
            self.due_s = time.monotonic()

    def turn(self) -> bool:
        """True if a new phase has begun."""
        if self.due_s is None or time.monotonic() < self.due_s or self.name == "after":
            return False
        self.name = PHASES[PHASES.index(self.name) + 1]
        lasts_s = 0.0 if self.row["at_contact"] else BEFORE
        self.due_s += lasts_s if self.name == "before" else self.row["seconds"]
        self.settings = {**self.settings, "restart": False, **self.row.get(self.name, {})}
        self.log.write(phase=self.name)
        return True

    def sign(self, stamps: Optional[Stamps]) -> Stamps:
        """The state of signing in this phase: a new one at the start and at a restart."""
        if stamps is None or self.settings.get("restart"):
            return Stamps(self.settings)
        stamps.apply(self.settings)
        return stamps


class Log:
    """Lines of JSON with the time of the host's monotonic clock, which all processes share."""

    def __init__(self, path: str) -> None:
        self.file = open(path, "a", encoding="utf-8", buffering=1)

    def write(self, **fields: Any) -> None:
        self.file.write(json.dumps({"at_s": round(time.monotonic(), 4), **fields}) + "\n")
