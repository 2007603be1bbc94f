"""A core of `jsonl/2` for the tests of the bridge to MAVLink: a point that follows its set-points, in the air or on wheels.

Times are of the vehicle's clock; the bridge paces the steps by the wall clock. The caller gives limits and attacks by the time.
"""

import json
import math
import subprocess
import time
from dataclasses import dataclass, field
from typing import Any, Callable, Optional

PERIOD, ZERO, HEIGHT, FASTEST = 0.05, 3600.0, 3.0, 3.0
#: Greatest change of speed, m/s².
ACCELERATION = 2.5
ORIGIN = {"latitude_deg": 47.397742, "longitude_deg": 8.545594, "height_m": 488.0}
ROUTE = [[8.0, 0.0], [8.0, 6.0]]

Answer = dict[str, Any]
#: Fields of a step beside the vehicle: `limit`, `fix` (False for none), `bus`.
Scene = Callable[[float], dict[str, Any]]


def enabled(_at_s: float) -> dict[str, Any]:
    return {}


@dataclass
class Body:
    """The true motion."""

    rotors: bool
    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    height: float = HEIGHT
    forward: float = 0.0
    left: float = 0.0
    turn: float = 0.0

    def follow(self, reply: Answer, limit: float) -> None:
        velocity = reply.get("velocity") or {
            "forward_m_s": reply["speed_m_s"],
            "left_m_s": 0.0,
            "up_m_s": 0.0,
            "turn_rad_s": reply["speed_m_s"] * reply["curvature_per_m"],
        }
        asked = math.hypot(velocity["forward_m_s"], velocity["left_m_s"])
        share = min(1.0, limit / asked) if asked > 0.0 else 0.0
        self.forward = near(self.forward, share * velocity["forward_m_s"])
        self.left = near(self.left, share * velocity["left_m_s"])
        self.turn = velocity["turn_rad_s"] if limit > 0.0 else 0.0
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        self.x += (cos * self.forward - sin * self.left) * PERIOD
        self.y += (sin * self.forward + cos * self.left) * PERIOD
        self.yaw = math.remainder(self.yaw + self.turn * PERIOD, math.tau)
        if limit > 0.0:
            self.height = max(0.0, self.height + velocity["up_m_s"] * PERIOD)


def near(value: float, goal: float) -> float:
    most = ACCELERATION * PERIOD
    return value + min(max(goal - value, -most), most)


@dataclass
class Flight:
    """Places and replies, step by step."""

    places: list[tuple[float, float, float]] = field(default_factory=list)
    replies: list[Answer] = field(default_factory=list)
    body: Optional[Body] = None

    def states(self) -> list[str]:
        """The states in their order, without repeats."""
        found: list[str] = []
        for reply in self.replies:
            if found[-1:] != [reply["state"]]:
                found.append(reply["state"])
        return found

    def receipts(self, id: int) -> list[Answer]:
        return [receipt for reply in self.replies for receipt in reply.get("bus", []) if receipt["id"] == id]

    def total(self, id: int, name: str) -> int:
        return sum(receipt[name] for receipt in self.receipts(id))


class Core:
    """One trial with a bridge's process."""

    def __init__(self, command: list[str], rotors: bool = True, route: Optional[list[list[float]]] = None) -> None:
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.body, self.flight, self.number = Body(rotors), Flight(), 0
        self.flight.body = self.body
        self.ready = self.ask(start_of(rotors, ROUTE if route is None else route))

    def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        assert self.process.stdin is not None and self.process.stdout is not None and self.process.stderr is not None
        self.process.stdin.write(json.dumps(request).encode() + b"\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            raise EOFError(self.end()[1])
        answer = json.loads(line)
        assert isinstance(answer, dict)
        return answer

    def step(self, scene: Scene = enabled) -> Answer:
        self.number += 1
        now = self.number * PERIOD
        seen = scene(now)
        limit = seen.get("limit", FASTEST)
        reply: Answer = self.ask(step_of(self.number, self.body, limit, seen))["reply"]
        self.body.follow(reply, limit)
        self.flight.places.append((self.body.x, self.body.y, self.body.height))
        self.flight.replies.append(reply)
        return reply

    def fly(self, seconds: float, scene: Scene = enabled) -> Flight:
        for _ in range(round(seconds / PERIOD)):
            self.step(scene)
        return self.flight

    def until(self, true: Callable[[Answer], bool], within_s: float, scene: Scene = enabled) -> bool:
        """Steps until a reply fits, for at most a time of the vehicle's clock."""
        return any(true(self.step(scene)) for _ in range(round(within_s / PERIOD)))

    def until_state(self, state: str, within_s: float, scene: Scene = enabled) -> bool:
        return self.until(lambda reply: bool(reply["state"] == state), within_s, scene)

    def timed(self, seconds: float) -> float:
        """Real time of some of the vehicle's."""
        begun = time.monotonic()
        self.fly(seconds)
        return time.monotonic() - begun

    def end_if_there(self) -> None:
        if self.process.stdin is not None and not self.process.stdin.closed:
            self.end()

    def end(self) -> tuple[int, str]:
        """The bridge's status and last words."""
        _, words = self.process.communicate()
        return self.process.returncode, words.decode()


def start_of(rotors: bool, route: list[list[float]]) -> dict[str, Any]:
    body = {
        "medium": "air" if rotors else "ground",
        "size_m": [0.5, 0.5],
        "max_curvature_per_m": 0.4,
        "max_climb_m_s": 1.0 if rotors else 0.0,
        "cruise_height_m": HEIGHT if rotors else 0.0,
        "max_reverse_m_s": 0.0 if rotors else 1.0,
    }
    return {
        "start": {
            "protocol": "jsonl/2",
            "time_s": ZERO,
            "period_s": PERIOD,
            "max_speed_m_s": FASTEST,
            "braking_m_s2": 2.0,
            "route": route,
            "looped": False,
            "fence": [[-50.0, -50.0], [50.0, -50.0], [50.0, 50.0], [-50.0, 50.0]],
            "obstacles": [],
            "blocks": [],
            "pose": {"at": [0.0, 0.0], "yaw_rad": 0.0, "height_m": HEIGHT if rotors else 0.0},
            "body": body,
            "origin": ORIGIN,
        }
    }


def step_of(number: int, body: Body, limit: float, seen: dict[str, Any]) -> dict[str, Any]:
    now = round(ZERO + number * PERIOD, 6)
    height = round(body.height, 3) if body.rotors else None
    fix = {
        "stamp_s": now,
        "at": [round(body.x, 3), round(body.y, 3)],
        "yaw_rad": round(body.yaw, 3),
        "sigma_m": 0.04,
        "receiver_s": now,
        "height_m": height,
    }
    step: dict[str, Any] = {
        "number": number,
        "time_s": now,
        "limit_m_s": limit,
        "mode": "READY" if limit > 0.0 else "IDLE",
        "fix": fix if seen.get("fix", True) else None,
        "odometry": {"stamp_s": now, "speed_m_s": round(body.forward, 3), "yaw_rate_rad_s": round(body.turn, 3)},
        "tracks": [],
        "teammates": [],
        "height_m": height,
        "nearby": [],
    }
    if orders := seen.get("bus"):
        step["bus"] = orders
    return {"step": step}


def order(id: int, attack: str, rate_hz: float = 20.0, amount: float = 0.0) -> dict[str, Any]:
    return {"id": id, "attack": attack, "rate_hz": rate_hz, "amount": amount}
