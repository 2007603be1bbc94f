"""The mission of a trial for the program: a file of JSON for programs, and one of way points for ground stations.

Way points are those of the start; the height is the platform's. The second file has the format "QGC WPL 110", which Mission Planner,
QGroundControl and MAVProxy read.
"""

import json
from pathlib import Path
from typing import Any

from geodesy import Globe
from holdsafe_guest import Start
from plan import LOITER, WAYPOINT

#: Frames of way points: above the sea, above home.
SEA, HOME = 0, 3
ROUTE, WAYPOINTS = "route.json", "route.waypoints"


def height_of(start: Start) -> float:
    return start.body.cruise_height_m if start.body else 0.0


def route_of(start: Start, globe: Globe) -> dict[str, Any]:
    """The route for a program: degrees, and metres above home."""
    points = [globe.degrees(at) for at in start.route]
    return {
        "medium": start.body.medium if start.body else "ground",
        "looped": start.looped,
        "relative_altitude_m": height_of(start),
        "max_speed_m_s": start.max_speed_m_s,
        "points": [{"latitude_deg": latitude, "longitude_deg": longitude} for latitude, longitude in points],
    }


def waypoints_of(start: Start, globe: Globe) -> str:
    """The same for a ground station: home first, and a stay without an end last."""
    home = start.pose.at if start.pose else (0.0, 0.0)
    rows = [(SEA, WAYPOINT, home, globe.origin.height_m)]
    rows += [(HOME, WAYPOINT, at, height_of(start)) for at in start.route]
    if start.route:
        rows.append((HOME, LOITER, start.route[-1], height_of(start)))
    lines = ["QGC WPL 110"]
    for number, (frame, command, at, height) in enumerate(rows):
        latitude, longitude = globe.degrees(at)
        values = [number, int(number == 0), frame, command, 0, 0, 0, 0, f"{latitude:.8f}", f"{longitude:.8f}", f"{height:.3f}", 1]
        lines.append("\t".join(map(str, values)))
    return "\n".join(lines) + "\n"


def write(folder: Path, start: Start, globe: Globe) -> None:
    (folder / ROUTE).write_text(json.dumps(route_of(start, globe), indent=1), encoding="utf-8")
    (folder / WAYPOINTS).write_text(waypoints_of(start, globe), encoding="utf-8")
