"""The messages of `jsonl/1`, read from and written to lines of JSON.

World frame: x east, y north, metres; angles counter-clockwise from east, radians; times in seconds of the vehicle's clock, which has
an arbitrary zero. Fields that a request has beyond these are ignored. The loop over the lines is left to `serve`.
"""

import json
import math
from dataclasses import dataclass, field
from typing import Any, Callable, NoReturn, Optional, TypeVar, Union

#: The protocol of this package.
PROTOCOL = "jsonl/1"
#: Longest line in either direction, bytes, its end included.
MAX_LINE = 64 * 1024

#: Ranges that the other end holds a reply to.
_MAX_SPEED = 100.0
_MAX_CURVATURE = 10.0
_MAX_COORDINATE = 10_000.0
_MAX_WAKE = 1.0

#: East and north, m.
Place = tuple[float, float]
_T = TypeVar("_T")


class ProtocolError(Exception):
    """A line that is no message of the protocol: expected and got."""


@dataclass(frozen=True)
class Disc:
    """A disc to keep clear of."""

    at: Place
    radius_m: float


@dataclass(frozen=True)
class Block:
    """An obstacle by its length and width."""

    #: Its middle.
    at: Place
    #: Half of length and width, m.
    half_m: tuple[float, float]
    #: Direction of its length, rad.
    heading_rad: float


@dataclass(frozen=True)
class Start:
    """The mission and its surroundings, told once."""

    #: Time of the vehicle's clock, s.
    time_s: float
    #: Time between two steps, unless the guest asks for a longer one, s.
    period_s: float
    #: Largest speed of the vehicle, m/s.
    max_speed_m_s: float
    #: Deceleration that the vehicle is sure to reach, m/s².
    braking_m_s2: float
    #: Way points in order; none to stand.
    route: list[Place]
    #: True if the last way point leads to the first again.
    looped: bool
    #: Corners of the area that must not be left, in order.
    fence: list[Place]
    #: Obstacles on the map as discs that reach to their ends, the first 64.
    obstacles: list[Disc]
    #: The same obstacles by length and width; empty from a core that does not tell them.
    blocks: list[Block] = field(default_factory=list)


@dataclass(frozen=True)
class Fix:
    """A position fix."""

    #: Time at which it was taken, s.
    stamp_s: float
    at: Place
    #: Heading, rad in (-π, π].
    yaw_rad: float
    #: One standard deviation of the position as its source states it, m.
    sigma_m: float
    #: The receiver's own time, s.
    receiver_s: float


@dataclass(frozen=True)
class Odometry:
    """A reading of the wheels."""

    #: Time at which it was taken, s.
    stamp_s: float
    #: Forward speed, m/s.
    speed_m_s: float
    #: Yaw rate, rad/s.
    yaw_rate_rad_s: float


@dataclass(frozen=True)
class Track:
    """An object that perception tracks."""

    id: int
    #: `vehicle`, `person`, `decoy` or `other`.
    class_name: str
    at: Place
    #: Velocity east and north, m/s.
    velocity: Place
    #: Confidence, 0 to 1.
    confidence: float
    #: Time of the last update, s.
    updated_s: float


@dataclass(frozen=True)
class Step:
    """One control step."""

    #: Number of the step, from 1.
    number: int
    #: Time of the vehicle's clock, s.
    time_s: float
    #: The most that may be driven now, m/s: 0 unless an operator has enabled driving.
    limit_m_s: float
    #: Mode of the platform's state machine.
    mode: str
    #: The newest position fix; None where there is none, or the guest's file does not take `navigation`.
    fix: Optional[Fix]
    #: The newest reading of the wheels; None as for `fix`.
    odometry: Optional[Odometry]
    #: Objects that perception tracks; empty where the guest's file does not take `tracks`.
    tracks: list[Track]
    #: Places that other units claim; empty where the guest's file does not take `teammates`.
    teammates: list[Place]


@dataclass(frozen=True)
class Reply:
    """A set-point. A value out of its range is a ValueError where the reply is made."""

    #: Forward speed, m/s, within ±100.
    speed_m_s: float
    #: Curvature, 1/m, positive to the left, within ±10.
    curvature_per_m: float
    #: Name of the guest's state: needed where its file gives `state`, refused where not.
    state: Optional[str] = None
    #: Place that the guest drives by, m, within ±10,000: needed where its file gives `place`, refused where not.
    place: Optional[Place] = None
    #: Time until the guest wants the next step, s, up to 1; None for the next period.
    wake_s: Optional[float] = None

    def __post_init__(self) -> None:
        _within("speed_m_s", self.speed_m_s, -_MAX_SPEED, _MAX_SPEED)
        _within("curvature_per_m", self.curvature_per_m, -_MAX_CURVATURE, _MAX_CURVATURE)
        if self.place is not None:
            for coordinate in self.place:
                _within("place", coordinate, -_MAX_COORDINATE, _MAX_COORDINATE)
        if self.wake_s is not None:
            _within("wake_s", self.wake_s, 0.0, _MAX_WAKE)

    def line(self, number: int) -> bytes:
        """The answer to step `number`, its end included."""
        reply: dict[str, Any] = {
            "number": number,
            "speed_m_s": float(self.speed_m_s),
            "curvature_per_m": float(self.curvature_per_m),
        }
        if self.state is not None:
            reply["state"] = self.state
        if self.place is not None:
            reply["place"] = [float(coordinate) for coordinate in self.place]
        if self.wake_s is not None:
            reply["wake_s"] = float(self.wake_s)
        return json.dumps({"reply": reply}, separators=(",", ":"), allow_nan=False).encode() + b"\n"


#: The answer to a start, its end included.
READY = b'{"ready":{}}\n'


def _within(name: str, got: float, least: float, most: float) -> None:
    if not least <= got <= most:
        raise ValueError(f"{name}: {least:g} to {most:g} expected, got {got}")


def request(line: bytes) -> Union[Start, Step]:
    """The request of a line.

    :raises ProtocolError: the line is none.
    """
    try:
        value = json.loads(line, parse_constant=_no_number)
    except (ValueError, RecursionError) as error:
        raise ProtocolError(f"a line of JSON expected: {error}") from None
    if not isinstance(value, dict) or len(value) != 1:
        raise ProtocolError("an object with one field expected, `start` or `step`")
    (kind, content), *_ = value.items()
    if kind == "start":
        return _start(_Fields(content, "start"))
    if kind == "step":
        return _step(_Fields(content, "step"))
    raise ProtocolError(f"`start` or `step` expected, got `{kind[:40]}`")


def _no_number(text: str) -> NoReturn:
    raise ValueError(f"{text} is no number of JSON")


class _Fields:
    """The fields of one object; `at` is its place in the line, for errors."""

    def __init__(self, value: Any, at: str) -> None:
        if not isinstance(value, dict):
            raise ProtocolError(f"{at}: an object expected, got {_kind(value)}")
        self._value = value
        self._at = at

    def has(self, name: str) -> bool:
        return name in self._value

    def _get(self, name: str) -> Any:
        if name not in self._value:
            raise ProtocolError(f"{self._at}: the field `{name}` is missing")
        return self._value[name]

    def _of(self, name: str, expected: str, right: Callable[[Any], bool]) -> Any:
        value = self._get(name)
        if not right(value):
            raise ProtocolError(f"{self._at}.{name}: {expected} expected, got {_kind(value)}")
        return value

    def number(self, name: str) -> float:
        return float(self._of(name, "a number", _is_number))

    def whole(self, name: str) -> int:
        return int(self._of(name, "a whole number", lambda v: isinstance(v, int) and not isinstance(v, bool)))

    def text(self, name: str) -> str:
        return str(self._of(name, "a text", lambda v: isinstance(v, str)))

    def flag(self, name: str) -> bool:
        return bool(self._of(name, "true or false", lambda v: isinstance(v, bool)))

    def place(self, name: str) -> Place:
        return _place(self._get(name), f"{self._at}.{name}")

    def pair(self, name: str, expected: str) -> tuple[float, float]:
        return _place(self._get(name), f"{self._at}.{name}", expected)

    def places(self, name: str) -> list[Place]:
        values = enumerate(self._of(name, "a list", lambda v: isinstance(v, list)))
        return [_place(value, f"{self._at}.{name}[{i}]") for i, value in values]

    def many(self, name: str, read: "Callable[[_Fields], _T]") -> list[_T]:
        values = enumerate(self._of(name, "a list", lambda v: isinstance(v, list)))
        return [read(_Fields(value, f"{self._at}.{name}[{i}]")) for i, value in values]

    def maybe(self, name: str, read: "Callable[[_Fields], _T]") -> Optional[_T]:
        value = self._get(name)
        return None if value is None else read(_Fields(value, f"{self._at}.{name}"))


def _is_number(value: Any) -> bool:
    if isinstance(value, int):
        # A longer one has no float.
        return not isinstance(value, bool) and value.bit_length() <= 1023
    return isinstance(value, float) and math.isfinite(value)


def _kind(value: Any) -> str:
    names = {dict: "an object", list: "a list", str: "a text", bool: "a truth value", type(None): "null"}
    return names.get(type(value), f"the number {str(value)[:40]}")


def _place(value: Any, at: str, expected: str = "[east, north]") -> Place:
    if not isinstance(value, list) or len(value) != 2 or not all(map(_is_number, value)):
        raise ProtocolError(f"{at}: {expected} expected")
    return float(value[0]), float(value[1])


def _start(fields: _Fields) -> Start:
    protocol = fields.text("protocol")
    if protocol != PROTOCOL:
        raise ProtocolError(f"protocol {PROTOCOL} expected, got {protocol[:40]}")
    return Start(
        time_s=fields.number("time_s"),
        period_s=fields.number("period_s"),
        max_speed_m_s=fields.number("max_speed_m_s"),
        braking_m_s2=fields.number("braking_m_s2"),
        route=fields.places("route"),
        looped=fields.flag("looped"),
        fence=fields.places("fence"),
        obstacles=fields.many("obstacles", lambda f: Disc(f.place("at"), f.number("radius_m"))),
        blocks=fields.many("blocks", _block) if fields.has("blocks") else [],
    )


def _block(fields: _Fields) -> Block:
    return Block(fields.place("at"), fields.pair("half_m", "[length, width]"), fields.number("heading_rad"))


def _step(fields: _Fields) -> Step:
    return Step(
        number=fields.whole("number"),
        time_s=fields.number("time_s"),
        limit_m_s=fields.number("limit_m_s"),
        mode=fields.text("mode"),
        fix=fields.maybe("fix", _fix),
        odometry=fields.maybe("odometry", _odometry),
        tracks=fields.many("tracks", _track),
        teammates=fields.places("teammates"),
    )


def _fix(fields: _Fields) -> Fix:
    return Fix(
        stamp_s=fields.number("stamp_s"),
        at=fields.place("at"),
        yaw_rad=fields.number("yaw_rad"),
        sigma_m=fields.number("sigma_m"),
        receiver_s=fields.number("receiver_s"),
    )


def _odometry(fields: _Fields) -> Odometry:
    return Odometry(fields.number("stamp_s"), fields.number("speed_m_s"), fields.number("yaw_rate_rad_s"))


def _track(fields: _Fields) -> Track:
    return Track(
        id=fields.whole("id"),
        class_name=fields.text("class"),
        at=fields.place("at"),
        velocity=fields.place("velocity"),
        confidence=fields.number("confidence"),
        updated_s=fields.number("updated_s"),
    )
