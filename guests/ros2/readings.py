"""Messages of ROS 2 from the requests of the protocol: readings of a step, and the mission at the start.

Frames are those of REP-105, units and axes those of REP-103. Topics, qualities of service and times to send are left to `graph`.
"""

import array
import math
from typing import Any

from geometry_msgs.msg import Pose, PoseArray, PoseStamped, PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, NavSatFix, NavSatStatus

import holdsafe_guest
from conversion import Place, geodetic, grid, plan, quaternion, stamp
from holdsafe_guest import Fix, Origin, Start, Step

#: Frames of REP-105.
MAP, ODOM, BASE = "map", "odom", "base_link"
#: The first element of a covariance whose quantity is not measured (REP-145, `sensor_msgs/Imu`).
NOT_MEASURED = -1.0


def header(message: Any, frame: str, at_s: float) -> Any:
    """The message, with its header set."""
    message.header.frame_id = frame
    message.header.stamp.sec, message.header.stamp.nanosec = stamp(at_s)
    return message


def turned(turn: Any, yaw_rad: float) -> None:
    turn.x, turn.y, turn.z, turn.w = quaternion(yaw_rad)


def pose(at: Place, yaw_rad: float, height_m: float = 0.0) -> Pose:
    made = Pose()
    made.position.x, made.position.y = at
    made.position.z = height_m
    turned(made.orientation, yaw_rad)
    return made


def transform(parent: str, child: str, at_s: float, at: Place, yaw_rad: float) -> TransformStamped:
    made = header(TransformStamped(child_frame_id=child), parent, at_s)
    made.transform.translation.x, made.transform.translation.y = at
    turned(made.transform.rotation, yaw_rad)
    return made


def clock_of(time_s: float) -> Clock:
    clock = Clock()
    clock.clock.sec, clock.clock.nanosec = stamp(time_s)
    return clock


def map_of(start: Start) -> OccupancyGrid:
    cells = grid(start.fence, [(block.at, block.half_m, block.heading_rad) for block in start.blocks])
    made = header(OccupancyGrid(), MAP, start.time_s)
    made.info.resolution, made.info.width, made.info.height = cells.cell_m, cells.width, cells.height
    made.info.origin = pose(cells.origin, 0.0)
    made.data = array.array("b", cells.cells)
    return made


def path_of(start: Start, frame: str) -> Path:
    made = header(Path(), frame, start.time_s)
    for at, course in plan(start.route, start.looped):
        made.poses.append(header(PoseStamped(pose=pose(at, course)), frame, start.time_s))
    return made


def initial_of(surveyed: holdsafe_guest.Pose, at_s: float) -> PoseWithCovarianceStamped:
    """The surveyed pose, for a node that localises itself."""
    made = header(PoseWithCovarianceStamped(), MAP, at_s)
    made.pose.pose = pose(surveyed.at, surveyed.yaw_rad, surveyed.height_m or 0.0)
    return made


def odometry_of(step: Step, fix: Fix) -> Odometry:
    """The pose of the fix, at its time, and the twist of the wheels."""
    made = header(Odometry(child_frame_id=BASE), ODOM, fix.stamp_s)
    made.pose.pose = pose(fix.at, fix.yaw_rad, fix.height_m or 0.0)
    made.pose.covariance[0] = made.pose.covariance[7] = fix.sigma_m**2
    if step.odometry is not None:
        made.twist.twist.linear.x = step.odometry.speed_m_s
        made.twist.twist.angular.z = step.odometry.yaw_rate_rad_s
    return made


def imu_of(odometry: holdsafe_guest.Odometry) -> Imu:
    """The rate of turn alone, from the wheels: the protocol has no other quantity of an inertial unit."""
    made = header(Imu(), BASE, odometry.stamp_s)
    made.angular_velocity.z = odometry.yaw_rate_rad_s
    made.orientation_covariance[0] = made.linear_acceleration_covariance[0] = NOT_MEASURED
    return made


def satellite_fix_of(fix: Fix, origin: Origin) -> NavSatFix:
    """The fix in degrees. Without a height the altitude is no number, as `sensor_msgs/NavSatFix` asks."""
    made = header(NavSatFix(), BASE, fix.stamp_s)
    made.status.status, made.status.service = NavSatStatus.STATUS_FIX, NavSatStatus.SERVICE_GPS
    place = (origin.latitude_deg, origin.longitude_deg, origin.height_m)
    made.latitude, made.longitude, height = geodetic((*fix.at, fix.height_m or 0.0), place)
    made.altitude = math.nan if fix.height_m is None else height
    made.position_covariance[0] = made.position_covariance[4] = made.position_covariance[8] = fix.sigma_m**2
    made.position_covariance_type = NavSatFix.COVARIANCE_TYPE_APPROXIMATED
    return made


def tracks_of(step: Step) -> PoseArray:
    """Places of the tracks with their courses; classes, speeds and confidence have no field."""
    made = header(PoseArray(), MAP, step.time_s)
    for track in step.tracks:
        made.poses.append(pose(track.at, math.atan2(track.velocity[1], track.velocity[0])))
    return made
