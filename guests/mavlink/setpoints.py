"""SET_POSITION_TARGET_LOCAL_NED and SET_POSITION_TARGET_GLOBAL_INT as set-points of the vehicle.

A mask says which fields count. Places and velocities are in north, east and down, or in the body's forward, right and down; accelerations
are not followed.
"""

import math
from typing import Any, Optional

from geodesy import UNITS, Globe
from pose import Pose
from vehicle import SetPoint

#: Bits of the mask: fields that do not count.
NO_PLACE, NO_VELOCITY, NO_YAW, NO_TURN = 0x7, 0x38, 0x400, 0x800
#: Frames by the numbers of MAV_FRAME: along the world's axes, from where the vehicle is, along the body's axes.
LOCAL, OFFSET, BODY = 1, 7, {8, 9, 12}
SEA_FRAMES = {0, 5}


def set_point_of(message: Any, now_s: float, pose: Optional[Pose], globe: Globe) -> Optional[SetPoint]:
    """The set-point of a message; None if it has neither place nor velocity, or numbers that are none."""
    mask = message.type_mask
    at, height = place_of(message, pose, globe) if mask & NO_PLACE != NO_PLACE else (None, None)
    velocity, up = velocity_of(message) if mask & NO_VELOCITY != NO_VELOCITY else (None, 0.0)
    if at is None and velocity is None:
        return None
    of_body = message.coordinate_frame in BODY
    yaw = None if mask & NO_YAW else (pose.yaw_rad if pose else 0.0) - message.yaw if of_body else math.pi / 2.0 - message.yaw
    turn = None if mask & NO_TURN else -message.yaw_rate
    numbers = [*(at or ()), *(velocity or ()), up, *(value for value in (height, yaw, turn) if value is not None)]
    if not all(map(math.isfinite, numbers)):
        return None
    return SetPoint(now_s, at, height, velocity, up, of_body, yaw, turn)


def place_of(message: Any, pose: Optional[Pose], globe: Globe) -> tuple[Optional[tuple[float, float]], Optional[float]]:
    if message.get_type() == "SET_POSITION_TARGET_GLOBAL_INT":
        height = message.alt - (globe.origin.height_m if message.coordinate_frame in SEA_FRAMES else 0.0)
        return globe.place(message.lat_int / UNITS, message.lon_int / UNITS), height
    north, east, height = message.x, message.y, -message.z
    if message.coordinate_frame == LOCAL or pose is None:
        return (east, north), height
    height += pose.height_m or 0.0
    if message.coordinate_frame == OFFSET:
        return (pose.at[0] + east, pose.at[1] + north), height
    forward, right = north, east
    cos, sin = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    return (pose.at[0] + cos * forward + sin * right, pose.at[1] + sin * forward - cos * right), height


def velocity_of(message: Any) -> tuple[tuple[float, float], float]:
    """East and north, or forward and left; and up."""
    if message.coordinate_frame in BODY:
        return (message.vx, -message.vy), -message.vz
    return (message.vy, message.vx), -message.vz
