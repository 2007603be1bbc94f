"""The requests of `jsonl/1` and `jsonl/2`, as types.

World frame: x east, y north, metres; angles counter-clockwise from east, radians; times in seconds of the vehicle's clock, which has
an arbitrary zero. `jsonl/2` has all of `jsonl/1`: a field of `jsonl/2` alone is optional here, so a guest for `jsonl/1` serves both.
Reading lines is left to `reading`, answers to `replies`.
"""

from dataclasses import dataclass, field
from typing import Optional

#: The protocols of this package; which of them is spoken stands in the guest's file.
PROTOCOL_1, PROTOCOL_2 = "jsonl/1", "jsonl/2"
#: The protocol of a guest's file without attacks on a bus.
PROTOCOL = PROTOCOL_1
#: Longest line in either direction, bytes, its end included.
MAX_LINE = 64 * 1024

#: East and north, m.
Place = tuple[float, float]


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
class Pose:
    """A place with a heading."""

    at: Place
    yaw_rad: float
    #: Height above the ground, m; None where it is not known.
    height_m: Optional[float]


@dataclass(frozen=True)
class Body:
    """Measures of the vehicle."""

    #: Where it moves: `ground`, `air` or `space`.
    medium: str
    #: Length and width, m; 0 for a line of sight.
    size_m: Place
    #: Sharpest turn, 1/m.
    max_curvature_per_m: float
    #: Largest speed backwards, m/s.
    max_reverse_m_s: float
    #: Largest speed up and down, m/s; 0 on the ground.
    max_climb_m_s: float
    #: Height to travel at, m; 0 on the ground.
    cruise_height_m: float


@dataclass(frozen=True)
class Origin:
    """Place of the world's origin on the ellipsoid WGS84: a convention, for a program that needs degrees."""

    latitude_deg: float
    longitude_deg: float
    #: Height above the ellipsoid, m.
    height_m: float


@dataclass(frozen=True)
class Start:
    """The mission and its surroundings: at the beginning, and again for each further trial where the guest's file has `reuse`."""

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
    #: Protocol of the exchange: that of the guest's file.
    protocol: str = PROTOCOL_1
    #: Surveyed pose at the start, of `jsonl/2`; None without one.
    pose: Optional[Pose] = None
    #: The vehicle, of `jsonl/2`.
    body: Optional[Body] = None
    #: The world's origin, of `jsonl/2`.
    origin: Optional[Origin] = None


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
    #: Height above the ground, m, of `jsonl/2`; None without one.
    height_m: Optional[float] = None


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
    #: One standard deviation of the place, m, of `jsonl/2`.
    sigma_m: Optional[float] = None


@dataclass(frozen=True)
class Cluster:
    """Points of the LiDAR that belong together, without a class."""

    id: int
    at: Place
    #: Velocity east and north, m/s.
    velocity: Place
    width_m: float


@dataclass(frozen=True)
class Order:
    """An attack that the guest's adapter carries out on its own bus, for as long as steps list it."""

    #: The same over the trial.
    id: int
    #: Name of the attack, one of those that the guest's file lists as `bus`.
    attack: str
    #: Messages a second of the vehicle's clock.
    rate_hz: float
    #: Size of the attack, in the unit that its name has.
    amount: float


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
    #: Height above the ground by the unit's own sensors, m, of `jsonl/2`; None without one.
    height_m: Optional[float] = None
    #: Clusters of the LiDAR, of `jsonl/2`; empty where the guest's file does not take `nearby`.
    nearby: list[Cluster] = field(default_factory=list)
    #: Attacks that are open in this step, of `jsonl/2`; the reply has a receipt for each.
    bus: list[Order] = field(default_factory=list)
