"""The core's side of `jsonl/1` and `jsonl/2` over pipes: drives a guest on flat ground, attacks its position, measures the
rate and writes transcripts.

The vehicle is a point with the plant's limits (3 m/s, 1.5 m/s², 4 m/s² braking, 0.4 1/m) and exact sensors. A verdict about a guest is
left to holdsafe: this is for a first look at one, and for the tests of the clients.

    python3 -m tests.driver --attack freeze -- python3 ../guests/follower/follower.py
"""

import argparse
import json
import math
import resource
import subprocess
import sys
import time
from dataclasses import dataclass, field
from typing import Any, Optional

PERIOD = 0.05
#: Start of the vehicle's clock: guests must not take it for zero.
ZERO = 3600.0
#: Steps before the operator lets the vehicle drive.
IDLE_STEPS = 10
MAX_SPEED, ACCELERATION, BRAKING, MAX_CURVATURE = 3.0, 1.5, 4.0, 0.4

Place = tuple[float, float]

#: Missions by name: route, looped, obstacles as (east, north, half of the length to the east, half of the width).
MISSIONS: dict[str, tuple[list[Place], bool, list[tuple[float, float, float, float]]]] = {
    "straight": ([(10.0, 0.0), (20.0, 0.0)], False, [(10.0, 10.0, 0.5, 0.3)]),
    "corner": ([(12.0, 0.0), (15.0, 10.0), (5.0, 16.0)], False, [(6.0, 5.0, 0.5, 0.3)]),
    "blocked": ([(20.0, 0.0)], False, [(10.0, 0.0, 0.5, 0.5)]),
    "loop": ([(12.0, 0.0), (12.0, 12.0), (0.0, 12.0), (0.0, 0.0)], True, [(6.0, 6.0, 0.5, 0.5)]),
    "street": ([(20.0, 0.0)], False, [(10.0, 5.0, 7.0, 2.0), (10.0, -5.0, 7.0, 2.0)]),
}
FENCE: list[Place] = [(-10.0, -30.0), (60.0, -30.0), (60.0, 30.0), (-10.0, 30.0)]
ATTACKS = ["none", "freeze", "drift", "dropout"]


class Process:
    """A guest's process."""

    def __init__(self, command: list[str]) -> None:
        self.popen = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        assert self.popen.stdin is not None and self.popen.stdout is not None
        self.popen.stdin.write(json.dumps(request, separators=(",", ":")).encode() + b"\n")
        self.popen.stdin.flush()
        line = self.popen.stdout.readline()
        if not line:
            raise EOFError(f"the guest ended with status {self.popen.wait()}")
        answer = json.loads(line)
        assert isinstance(answer, dict)
        return answer

    def end(self) -> int:
        assert self.popen.stdin is not None and self.popen.stdout is not None
        self.popen.stdin.close()
        self.popen.stdout.close()
        return self.popen.wait()


@dataclass
class Vehicle:
    """The true motion."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    speed: float = 0.0
    curvature: float = 0.0

    def follow(self, speed: float, curvature: float, limit: float) -> None:
        asked = min(max(speed, -min(limit, 1.0)), limit)
        faster = abs(asked) > abs(self.speed)
        most = (ACCELERATION if faster else BRAKING) * PERIOD
        self.speed += min(max(asked - self.speed, -most), most)
        self.curvature = min(max(curvature, -MAX_CURVATURE), MAX_CURVATURE)
        turned = self.yaw + self.speed * self.curvature * PERIOD
        self.yaw = math.atan2(math.sin(turned), math.cos(turned))
        self.x += self.speed * PERIOD * math.cos(self.yaw)
        self.y += self.speed * PERIOD * math.sin(self.yaw)


@dataclass
class Drive:
    """One exercise: the exchanges, and the truth at each step."""

    exchanges: list[tuple[dict[str, Any], dict[str, Any]]] = field(default_factory=list)
    truth: list[Vehicle] = field(default_factory=list)
    states: list[tuple[float, str]] = field(default_factory=list)


def start_of(mission: str) -> dict[str, Any]:
    route, looped, obstacles = MISSIONS[mission]
    return {
        "start": {
            "protocol": "jsonl/1",
            "time_s": ZERO,
            "period_s": PERIOD,
            "max_speed_m_s": MAX_SPEED,
            "braking_m_s2": 3.0,
            "route": route,
            "looped": looped,
            "fence": FENCE,
            "obstacles": [{"at": [x, y], "radius_m": max(half)} for x, y, *half in obstacles],
            "blocks": [{"at": [x, y], "half_m": half, "heading_rad": 0.0} for x, y, *half in obstacles],
        }
    }


def second_start_of(mission: str) -> dict[str, Any]:
    """The start of `jsonl/2`."""
    start = start_of(mission)["start"]
    body = {"medium": "ground", "size_m": [1.2, 0.8], "max_curvature_per_m": MAX_CURVATURE}
    start["protocol"] = "jsonl/2"
    start["pose"] = {"at": [0.0, 0.0], "yaw_rad": 0.0, "height_m": None}
    start["body"] = {**body, "max_climb_m_s": 0.0, "cruise_height_m": 0.0, "max_reverse_m_s": 1.0}
    start["origin"] = {"latitude_deg": 47.0, "longitude_deg": 8.0, "height_m": 400.0}
    return {"start": start}


def second_step_of(step: dict[str, Any], bus: list[dict[str, Any]]) -> dict[str, Any]:
    """The same step in `jsonl/2`, with the attacks that are open in it."""
    content = {**step["step"], "height_m": None, "nearby": []}
    content["fix"] = content["fix"] and {**content["fix"], "height_m": None}
    return {"step": {**content, "bus": bus} if bus else content}


def step_of(number: int, vehicle: Vehicle, shown: Optional[Vehicle], enabled: bool) -> dict[str, Any]:
    """The step's request: `shown` is the pose of its fix, in the thousandths that the core has."""
    now = round(ZERO + number * PERIOD, 6)
    fix = shown and {
        "stamp_s": now,
        "at": [round(shown.x, 3), round(shown.y, 3)],
        "yaw_rad": round(shown.yaw, 3),
        "sigma_m": 0.04,
        "receiver_s": now,
    }
    rate = round(vehicle.speed * vehicle.curvature, 3)
    return {
        "step": {
            "number": number,
            "time_s": now,
            "limit_m_s": MAX_SPEED if enabled else 0.0,
            "mode": "READY" if enabled else "IDLE",
            "fix": fix,
            "odometry": {"stamp_s": now, "speed_m_s": round(vehicle.speed, 3), "yaw_rate_rad_s": rate},
            "tracks": [],
            "teammates": [],
        }
    }


def shown_at(attack: str, since: float, truth: list[Vehicle], vehicle: Vehicle) -> Optional[Vehicle]:
    """The pose that a fix states `since` seconds after the attack began."""
    if attack == "none" or since < 0.0:
        return vehicle
    if attack == "dropout":
        return None
    if attack == "freeze":
        return truth[-1 - round(since / PERIOD)]
    return Vehicle(vehicle.x, vehicle.y + 0.5 * since, vehicle.yaw)


def drive(
    guest: Process, mission: str, seconds: float, attack: str = "none", at: float = 4.0, bus: Optional[list[dict[str, Any]]] = None
) -> Drive:
    """Drives one exercise; `attack` begins `at` seconds, and so do the orders in `bus`, with which the protocol is `jsonl/2`."""
    done = Drive()
    vehicle = Vehicle()
    request = start_of(mission) if bus is None else second_start_of(mission)
    done.exchanges.append((request, guest.ask(request)))
    for number in range(1, round(seconds / PERIOD) + 1):
        enabled = number > IDLE_STEPS
        done.truth.append(Vehicle(**vars(vehicle)))
        shown = shown_at(attack, number * PERIOD - at, done.truth, vehicle)
        request = step_of(number, vehicle, shown, enabled)
        if bus is not None:
            request = second_step_of(request, bus if number * PERIOD > at else [])
        answer = guest.ask(request)
        done.exchanges.append((request, answer))
        reply = answer["reply"]
        if reply["number"] != number:
            raise ValueError(f"step {number} expected, got {reply['number']}")
        if reply.get("state") and (not done.states or done.states[-1][1] != reply["state"]):
            done.states.append((number * PERIOD, reply["state"]))
        vehicle.follow(reply["speed_m_s"], reply["curvature_per_m"], MAX_SPEED if enabled else 0.0)
    return done


def report(done: Drive, at: float) -> str:
    """The course of an exercise in a few lines."""
    last = done.truth[-1]
    begun = done.truth[min(round(at / PERIOD), len(done.truth) - 1)]
    path = sum(abs(v.speed) * PERIOD for v in done.truth)
    after = sum(abs(v.speed) * PERIOD for v in done.truth[round(at / PERIOD) :])
    stands = [i for i, v in enumerate(done.truth) if abs(v.speed) > 0.05]
    place = done.exchanges[-1][1]["reply"].get("place")
    lines = [
        f"driven {path:.1f} m in {len(done.truth) * PERIOD:.1f} s, {after:.1f} m of it after {at:.1f} s",
        f"truth ({last.x:.2f}, {last.y:.2f}), at {at:.1f} s ({begun.x:.2f}, {begun.y:.2f}); place {place}",
        f"moves last at {(stands[-1] + 1) * PERIOD if stands else 0.0:.2f} s; speed at the end {last.speed:.2f} m/s",
        "states " + ", ".join(f"{name} from {when:.2f} s" for when, name in done.states),
    ]
    return "\n".join(lines)


def rate(guest: Process, n: int) -> float:
    """Exchanges per second over `n` steps of a standing vehicle."""
    guest.ask(start_of("straight"))
    requests = [step_of(number, Vehicle(), Vehicle(), True) for number in range(1, n + 1)]
    begun = time.perf_counter()
    for request in requests:
        guest.ask(request)
    return n / (time.perf_counter() - begun)


def main() -> None:
    parser = argparse.ArgumentParser(description="Drives a guest over pipes.")
    parser.add_argument("--mission", choices=sorted(MISSIONS), default="straight")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--attack", choices=ATTACKS, default="none")
    parser.add_argument("--at", type=float, default=4.0, help="start of the attack, s")
    parser.add_argument("--rate", type=int, metavar="N", help="measure N exchanges and nothing else")
    parser.add_argument("--transcript", metavar="FILE", help="write the exchanges: a request and its answer, line by line")
    parser.add_argument("command", nargs="+", help="the guest, after --")
    asked = parser.parse_args()
    guest = Process(asked.command)
    if asked.rate:
        fast = rate(guest, asked.rate)
        status = guest.end()
        spent = resource.getrusage(resource.RUSAGE_CHILDREN)
        cost = 1e6 * (spent.ru_utime + spent.ru_stime) / asked.rate
        print(f"{fast:,.0f} exchanges/s, {cost:.0f} µs of the guest's CPU time for one, its start included, n = {asked.rate:,}")
        sys.exit(status)
    done = drive(guest, asked.mission, asked.seconds, asked.attack, asked.at)
    print(report(done, asked.at))
    if asked.transcript:
        with open(asked.transcript, "w", encoding="utf-8") as file:
            for pair in done.exchanges:
                file.writelines(json.dumps(line, separators=(",", ":")) + "\n" for line in pair)
    sys.exit(guest.end())


if __name__ == "__main__":
    main()
