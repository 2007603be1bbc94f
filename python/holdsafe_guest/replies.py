"""The answers of `jsonl/1` and `jsonl/2`, checked where they are made and written as lines of JSON."""

import json
from dataclasses import dataclass
from typing import Any, Optional, Sequence

from .messages import Place

#: The answer to a start, its end included.
READY = b'{"ready":{}}\n'

#: Ranges that the other end holds a reply to.
_MAX_SPEED = 100.0
_MAX_CURVATURE = 10.0
_MAX_TURN = 10.0
_MAX_COORDINATE = 10_000.0
_MAX_WAKE = 1.0
_MAX_COUNT = 2**32 - 1
_MAX_WHY = 80


@dataclass(frozen=True)
class Velocity:
    """A set-point in place of speed and curvature, of `jsonl/2`: in the vehicle's frame. On wheels, left and up are 0."""

    #: Speeds within ±100 m/s.
    forward_m_s: float
    left_m_s: float = 0.0
    up_m_s: float = 0.0
    #: Rate of turn to the left, rad/s, within ±10.
    turn_rad_s: float = 0.0

    def __post_init__(self) -> None:
        for name in ("forward_m_s", "left_m_s", "up_m_s"):
            _within(name, getattr(self, name), -_MAX_SPEED, _MAX_SPEED)
        _within("turn_rad_s", self.turn_rad_s, -_MAX_TURN, _MAX_TURN)

    def fields(self) -> dict[str, Any]:
        return {name: float(value) for name, value in vars(self).items()}


@dataclass(frozen=True)
class Receipt:
    """What became of an order in its step, of `jsonl/2`: counted by a witness, by the sender's identity and never by content."""

    #: The order's.
    id: int
    #: Messages that the attacker put on the bus.
    sent: int
    #: Those of them that the witness received.
    received: int
    #: Messages of the honest sender that the witness received.
    honest: int
    #: True if the message in force at the end of the step is the attacker's.
    used: bool
    #: The reason why messages are not received, at most 80 characters.
    why: Optional[str] = None

    def __post_init__(self) -> None:
        for name in ("id", "sent", "received", "honest"):
            _within(name, getattr(self, name), 0, _MAX_COUNT)
        if self.why is not None and len(self.why) > _MAX_WHY:
            raise ValueError(f"why: at most {_MAX_WHY} characters expected, got {len(self.why)}")

    def fields(self) -> dict[str, Any]:
        return dict(vars(self))


@dataclass(frozen=True)
class Reply:
    """A set-point: speed and curvature, or a velocity. A value out of its range is a ValueError where the reply is made."""

    #: Forward speed, m/s, within ±100.
    speed_m_s: Optional[float] = None
    #: Curvature, 1/m, positive to the left, within ±10.
    curvature_per_m: Optional[float] = None
    #: Name of the guest's state: needed where its file gives `state`, refused where not.
    state: Optional[str] = None
    #: Place that the guest drives by, m, within ±10,000: needed where its file gives `place`, refused where not.
    place: Optional[Place] = None
    #: Time until the guest wants the next step, s, up to 1; None for the next period.
    wake_s: Optional[float] = None
    #: In place of speed and curvature, of `jsonl/2`.
    velocity: Optional[Velocity] = None
    #: A receipt for each order of the step, of `jsonl/2`.
    bus: Sequence[Receipt] = ()

    def __post_init__(self) -> None:
        if [self.speed_m_s is None, self.curvature_per_m is None] != [self.velocity is not None] * 2:
            raise ValueError("speed_m_s and curvature_per_m expected, or velocity")
        if self.speed_m_s is not None and self.curvature_per_m is not None:
            _within("speed_m_s", self.speed_m_s, -_MAX_SPEED, _MAX_SPEED)
            _within("curvature_per_m", self.curvature_per_m, -_MAX_CURVATURE, _MAX_CURVATURE)
        if self.place is not None:
            for coordinate in self.place:
                _within("place", coordinate, -_MAX_COORDINATE, _MAX_COORDINATE)
        if self.wake_s is not None:
            _within("wake_s", self.wake_s, 0.0, _MAX_WAKE)

    def line(self, number: int) -> bytes:
        """The answer to step `number`, its end included."""
        reply: dict[str, Any] = {"number": number, **self._set_point()}
        if self.state is not None:
            reply["state"] = self.state
        if self.place is not None:
            reply["place"] = [float(coordinate) for coordinate in self.place]
        if self.wake_s is not None:
            reply["wake_s"] = float(self.wake_s)
        if self.bus:
            reply["bus"] = [receipt.fields() for receipt in self.bus]
        return json.dumps({"reply": reply}, separators=(",", ":"), allow_nan=False).encode() + b"\n"

    def _set_point(self) -> dict[str, Any]:
        if self.velocity is not None:
            return {"velocity": self.velocity.fields()}
        assert self.speed_m_s is not None and self.curvature_per_m is not None  # as `__post_init__` checks
        return {"speed_m_s": float(self.speed_m_s), "curvature_per_m": float(self.curvature_per_m)}


def _within(name: str, got: float, least: float, most: float) -> None:
    if not least <= got <= most:
        raise ValueError(f"{name}: {least:g} to {most:g} expected, got {got}")
