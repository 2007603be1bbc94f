"""Reads a request from its line of JSON, whole, or refuses it by the field.

Fields that a request has beyond those of the types in `messages` are ignored. The loop over the lines is left to `serve`.
"""

import json
import math
from typing import Any, Callable, NoReturn, Optional, TypeVar, Union

from .messages import (
    PROTOCOL_1,
    PROTOCOL_2,
    Block,
    Body,
    Cluster,
    Disc,
    Fix,
    Odometry,
    Order,
    Origin,
    Place,
    Pose,
    ProtocolError,
    Start,
    Step,
    Track,
)

_T = TypeVar("_T")


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

    def optional_number(self, name: str) -> Optional[float]:
        """None where the number is null, or missing, as each number of `jsonl/2` is from `jsonl/1`."""
        return None if self._value.get(name) is None else self.number(name)

    def object(self, name: str) -> "_Fields":
        return _Fields(self._get(name), f"{self._at}.{name}")

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
    if protocol not in (PROTOCOL_1, PROTOCOL_2):
        raise ProtocolError(f"protocol {PROTOCOL_1} or {PROTOCOL_2} expected, got {protocol[:40]}")
    second = protocol == PROTOCOL_2
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
        protocol=protocol,
        pose=fields.maybe("pose", _pose) if second else None,
        body=_body(fields.object("body")) if second else None,
        origin=_origin(fields.object("origin")) if second else None,
    )


def _block(fields: _Fields) -> Block:
    return Block(fields.place("at"), fields.pair("half_m", "[length, width]"), fields.number("heading_rad"))


def _pose(fields: _Fields) -> Pose:
    return Pose(fields.place("at"), fields.number("yaw_rad"), fields.optional_number("height_m"))


def _body(fields: _Fields) -> Body:
    return Body(
        medium=fields.text("medium"),
        size_m=fields.place("size_m"),
        max_curvature_per_m=fields.number("max_curvature_per_m"),
        max_reverse_m_s=fields.number("max_reverse_m_s"),
        max_climb_m_s=fields.number("max_climb_m_s"),
        cruise_height_m=fields.number("cruise_height_m"),
    )


def _origin(fields: _Fields) -> Origin:
    return Origin(fields.number("latitude_deg"), fields.number("longitude_deg"), fields.number("height_m"))


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
        height_m=fields.optional_number("height_m"),
        nearby=fields.many("nearby", _cluster) if fields.has("nearby") else [],
        bus=fields.many("bus", _order) if fields.has("bus") else [],
    )


def _fix(fields: _Fields) -> Fix:
    return Fix(
        stamp_s=fields.number("stamp_s"),
        at=fields.place("at"),
        yaw_rad=fields.number("yaw_rad"),
        sigma_m=fields.number("sigma_m"),
        receiver_s=fields.number("receiver_s"),
        height_m=fields.optional_number("height_m"),
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
        sigma_m=fields.optional_number("sigma_m"),
    )


def _cluster(fields: _Fields) -> Cluster:
    return Cluster(fields.whole("id"), fields.place("at"), fields.place("velocity"), fields.number("width_m"))


def _order(fields: _Fields) -> Order:
    return Order(fields.whole("id"), fields.text("attack"), fields.number("rate_hz"), fields.number("amount"))
