"""Conversions between `jsonl/2` and the conventions of ROS 2 (REP-103, REP-105), as pure functions.

The world frame of the protocol is REP-103's already: x east, y north, metres, angles counter-clockwise from east. Messages, topics and
time limits are left to `bridge`; nothing here needs ROS.
"""

import math
from dataclasses import dataclass
from typing import Sequence

#: East and north, m.
Place = tuple[float, float]
#: x, y, z, w.
Quaternion = tuple[float, float, float, float]

#: East, north and up, m; or latitude and longitude, degrees, and height above the ellipsoid, m.
Point = tuple[float, float, float]

#: The ellipsoid WGS84: its half axis, m, and the square of its eccentricity.
HALF_AXIS, ECCENTRICITY_2 = 6_378_137.0, 6.69437999014e-3
#: The protocol's range of a curvature, 1/m.
MAX_CURVATURE = 10.0
#: The protocol's range of a rate of turn, rad/s.
MAX_TURN = 10.0
#: Values of a cell of `nav_msgs/OccupancyGrid`.
FREE, OCCUPIED = 0, 100
#: Smallest cell, m, and most cells of a grid: a larger world has larger cells.
CELL_M, MOST_CELLS = 0.25, 200_000


def stamp(seconds: float) -> tuple[int, int]:
    """Whole seconds and nanoseconds, to the microsecond that the protocol has."""
    micros = round(seconds * 1e6)
    return micros // 1_000_000, micros % 1_000_000 * 1000


def seconds(sec: int, nanosec: int) -> float:
    return sec + nanosec * 1e-9


def quaternion(yaw: float) -> Quaternion:
    """A turn about the vertical axis."""
    return 0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0)


def yaw(turn: Quaternion) -> float:
    """The turn about the vertical axis, rad in (-π, π]."""
    x, y, z, w = turn
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def drive(forward: float, turn: float) -> tuple[float, float]:
    """Speed, m/s, and curvature, 1/m, of a forward speed, m/s, and a rate of turn, rad/s.

    The protocol has no turn on the spot: without forward speed the vehicle stands, and a turn sharper than 0.1 m is one of 0.1 m.
    """
    if forward == 0.0:
        return 0.0, 0.0
    return forward, min(max(turn / forward, -MAX_CURVATURE), MAX_CURVATURE)


def lost(forward: float, turn: float) -> bool:
    """True if `drive` does not turn as the command asks."""
    return abs(turn) > MAX_CURVATURE * abs(forward)


def geodetic(place: Point, origin: Point) -> Point:
    """Latitude, longitude and height of a place in the plane that touches the ellipsoid below the origin."""
    east, north, up = place
    latitude, longitude = math.radians(origin[0]), math.radians(origin[1])
    sin, cos, sin_l, cos_l = math.sin(latitude), math.cos(latitude), math.sin(longitude), math.cos(longitude)
    x, y, z = geocentric(origin)
    outward = cos * up - sin * north
    x, y, z = x + cos_l * outward - sin_l * east, y + sin_l * outward + cos_l * east, z + cos * north + sin * up
    across = math.hypot(x, y)
    # Each round adds some five digits at the heights of vehicles.
    for _ in range(4):
        normal = HALF_AXIS / math.sqrt(1.0 - ECCENTRICITY_2 * math.sin(latitude) ** 2)
        latitude = math.atan2(z + ECCENTRICITY_2 * normal * math.sin(latitude), across)
    normal = HALF_AXIS / math.sqrt(1.0 - ECCENTRICITY_2 * math.sin(latitude) ** 2)
    height = across * math.cos(latitude) + z * math.sin(latitude) - HALF_AXIS**2 / normal
    return math.degrees(latitude), math.degrees(math.atan2(y, x)), height


def geocentric(place: Point) -> Point:
    """Latitude, longitude and height as metres from the middle of the Earth."""
    latitude, longitude, height = math.radians(place[0]), math.radians(place[1]), place[2]
    normal = HALF_AXIS / math.sqrt(1.0 - ECCENTRICITY_2 * math.sin(latitude) ** 2)
    across = (normal + height) * math.cos(latitude)
    upward = (normal * (1.0 - ECCENTRICITY_2) + height) * math.sin(latitude)
    return across * math.cos(longitude), across * math.sin(longitude), upward


def plan(route: Sequence[Place], looped: bool) -> list[tuple[Place, float]]:
    """The poses of a path: each way point, with the direction of the leg from it; a loop ends where it begins."""
    points = list(route) + ([route[0]] if looped and route else [])
    courses = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in zip(points, points[1:])]
    return list(zip(points, courses + courses[-1:] if courses else [0.0] * len(points)))


@dataclass(frozen=True)
class Grid:
    """Cells in rows from the south-west corner, row by row to the north, as `nav_msgs/OccupancyGrid` has them."""

    #: The south-west corner, m.
    origin: Place
    cell_m: float
    width: int
    height: int
    #: A byte a cell, `FREE` or `OCCUPIED`.
    cells: bytes

    def at(self, place: Place) -> int:
        """The cell of a place."""
        column, row = (math.floor((place[axis] - self.origin[axis]) / self.cell_m) for axis in (0, 1))
        return self.cells[row * self.width + column]


def grid(fence: Sequence[Place], blocks: Sequence[tuple[Place, tuple[float, float], float]]) -> Grid:
    """The map: occupied outside the fence, and where a cell touches a block, which is its middle, half of length and width, direction."""
    corners = fence or [corner for block in blocks for corner in outline(block, 1.0)] or [(0.0, 0.0)]
    west, south = (min(corner[axis] for corner in corners) for axis in (0, 1))
    wide, high = (max(corner[axis] for corner in corners) - least for axis, least in ((0, west), (1, south)))
    cell = max(CELL_M, math.sqrt(wide * high / MOST_CELLS))
    width, height = (max(1, math.ceil(length / cell)) for length in (wide, high))
    cells = bytearray([OCCUPIED if fence else FREE]) * (width * height)
    empty = Grid((west, south), cell, width, height, b"")
    if fence:
        _fill(empty, cells, fence, FREE)
    for block in blocks:
        # By half a cell's diagonal, so that one thinner than a cell is in the map.
        _fill(empty, cells, outline(block, cell * math.sqrt(0.5)), OCCUPIED)
    return Grid((west, south), cell, width, height, bytes(cells))


def outline(block: tuple[Place, tuple[float, float], float], wider: float = 0.0) -> list[Place]:
    """The corners of a block that is `wider` on each side, m."""
    (x, y), half, heading = block
    cos, sin = math.cos(heading), math.sin(heading)
    length, width = half[0] + wider, half[1] + wider
    signs = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
    return [(x + a * length * cos - b * width * sin, y + a * length * sin + b * width * cos) for a, b in signs]


def _fill(shape: Grid, cells: bytearray, corners: Sequence[Place], value: int) -> None:
    """Sets the cells whose middle is within a polygon."""
    for row in range(shape.height):
        y = shape.origin[1] + (row + 0.5) * shape.cell_m
        crossings = sorted(
            a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
            for a, b in zip(corners, [*corners[1:], corners[0]])
            if (a[1] > y) != (b[1] > y)
        )
        for enters, leaves in zip(crossings[::2], crossings[1::2]):
            first, end = (math.ceil((x - shape.origin[0]) / shape.cell_m - 0.5) for x in (enters, leaves))
            first, end = max(first, 0), min(end, shape.width)
            if first < end:
                start = row * shape.width
                cells[start + first : start + end] = bytes([value]) * (end - first)
