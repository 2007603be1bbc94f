"""Telemetry of the vehicle: each message by its number, with its period.

A program waits for ever for a message that does not come, so all are sent that MAVSDK and MAVProxy read, and at once after a
change of mode or state. Without a position those about the position stop.
"""

import math
import time
from typing import Any, Callable, Optional

from geodesy import Globe
from link import Link, mavlink
from modes import QUADROTOR, ROVER, ArduPilotModes, Mode, Px4Modes
from pose import Pose
from vehicle import Vehicle

#: Periods by the number of the message, s of real time.
PERIODS = {
    mavlink.MAVLINK_MSG_ID_HEARTBEAT: 1.0,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: 0.5,
    mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: 1.0,
    mavlink.MAVLINK_MSG_ID_GPS_RAW_INT: 0.5,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: 0.1,
    mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: 0.1,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 0.1,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 0.1,
    mavlink.MAVLINK_MSG_ID_MISSION_CURRENT: 1.0,
    mavlink.MAVLINK_MSG_ID_VFR_HUD: 0.5,
    mavlink.MAVLINK_MSG_ID_BATTERY_STATUS: 2.0,
    mavlink.MAVLINK_MSG_ID_HOME_POSITION: 1.0,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 0.5,
}
#: Bits of SYS_STATUS: gyro, accelerometer, magnetometer, GPS, position control, geofence, check before arming.
SENSORS = 0x1 | 0x2 | 0x4 | 0x20 | 0x4000 | 0x100000 | 0x10000000
POSITION, PREARM = 0x20 | 0x4000, 0x10000000
#: Of AUTOPILOT_VERSION: MISSION_INT, COMMAND_INT, set-points in local and global frame, MAVLink 2; 0x10 for parameters whose whole
#: numbers are bytes of the float, as PX4 has them, 2 for those converted to it.
CAPABILITIES, BYTES_PARAMETERS, FLOAT_PARAMETERS = 0x4 | 0x8 | 0x80 | 0x100 | 0x2000, 0x10, 0x2
ARMED, SAFETY_ENABLED, CUSTOM, GUIDED, STABILIZED, AUTO = 128, 0, 1, 8, 16, 4
STANDBY, ACTIVE, CRITICAL = 3, 4, 5
ON_GROUND, IN_AIR, TAKEOFF, LANDING = 1, 2, 3, 4


class Telemetry:
    """The senders. `numbers` has the numbers of the flight modes."""

    def __init__(self, link: Link, vehicle: Vehicle, globe: Globe, numbers: "Px4Modes | ArduPilotModes") -> None:
        self.link, self.mav, self.vehicle, self.globe, self.numbers = link, link.mav, vehicle, globe, numbers
        self.makers: dict[int, Callable[[], Any]] = {
            mavlink.MAVLINK_MSG_ID_HEARTBEAT: self.heartbeat,
            mavlink.MAVLINK_MSG_ID_SYS_STATUS: self.status,
            mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: self.system_time,
            mavlink.MAVLINK_MSG_ID_GPS_RAW_INT: self.gps,
            mavlink.MAVLINK_MSG_ID_ATTITUDE: self.attitude,
            mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: self.quaternion,
            mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: self.local_position,
            mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: self.global_position,
            mavlink.MAVLINK_MSG_ID_MISSION_CURRENT: self.mission_current,
            mavlink.MAVLINK_MSG_ID_VFR_HUD: self.head_up,
            mavlink.MAVLINK_MSG_ID_BATTERY_STATUS: self.battery,
            mavlink.MAVLINK_MSG_ID_HOME_POSITION: self.home,
            mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: self.extended,
            mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION: self.version,
            mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: self.origin,
        }
        self.periods = dict(PERIODS)
        self.due = {number: 0.0 for number in self.periods}
        self.told: tuple[Any, ...] = ()

    def tick(self, wall_s: float) -> float:
        """Sends the messages that are due; the time of the next."""
        self.tell_changes()
        for number, due in self.due.items():
            if wall_s >= due:
                self.due[number] = max(due + self.periods[number], wall_s)
                self.send(number)
        return min(self.due.values(), default=wall_s + 1.0)

    def tell_changes(self) -> None:
        vehicle = self.vehicle
        now = (vehicle.armed, vehicle.landed, vehicle.mode, vehicle.guided, vehicle.armable(), vehicle.plan.current)
        if now != self.told:
            self.told = now
            for number in (0, mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE, mavlink.MAVLINK_MSG_ID_SYS_STATUS):
                self.send(number)
            for index in vehicle.plan.reached:
                self.link.send(self.mav.mission_item_reached_encode(index))
            vehicle.plan.reached.clear()
            self.send(mavlink.MAVLINK_MSG_ID_MISSION_CURRENT)

    def send(self, number: int) -> bool:
        """Sends one message; False if the vehicle has none of that number."""
        if number not in self.makers:
            return False
        message = self.makers[number]()
        if message is not None:
            self.link.send(message)
        return True

    def change_period(self, number: int, interval_us: float) -> bool:
        """The interval of MAV_CMD_SET_MESSAGE_INTERVAL: 0 for the default, less for never."""
        if number not in self.makers:
            return False
        if interval_us < 0.0:
            self.due.pop(number, None)
            return True
        default = PERIODS.get(number, 1.0)
        self.periods[number] = max(interval_us / 1e6, 0.02) if interval_us > 0.0 else default
        self.due[number] = 0.0
        return True

    def pose(self) -> Optional[Pose]:
        return self.vehicle.pose if self.vehicle.located() else None

    def boot_ms(self) -> int:
        return int(self.vehicle.now_s * 1000.0) % 2**32

    def heartbeat(self) -> Any:
        vehicle = self.vehicle
        moves = {Mode.OFFBOARD: 0, Mode.HOLD: AUTO, Mode.MISSION: AUTO}.get(vehicle.mode, AUTO)
        mode = CUSTOM | STABILIZED | GUIDED | moves | (ARMED if vehicle.armed else 0)
        status = CRITICAL if vehicle.failsafe else ACTIVE if vehicle.armed else STANDBY
        number = self.numbers.number(vehicle.mode, vehicle.guided)
        return self.mav.heartbeat_encode(QUADROTOR if vehicle.flies else ROVER, self.numbers.autopilot, mode, number, status)

    def status(self) -> Any:
        health = SENSORS
        if not self.vehicle.located():
            health &= ~POSITION
        if not self.vehicle.armable():
            health &= ~PREARM
        return self.mav.sys_status_encode(SENSORS, SENSORS, health, 200, 15200, 500, 90, 0, 0, 0, 0, 0, 0)

    def system_time(self) -> Any:
        return self.mav.system_time_encode(int(time.time() * 1e6), self.boot_ms())

    def gps(self) -> Any:
        pose = self.pose()
        at, height = self.spot(pose)
        fix, speed = (3, math.hypot(*pose.velocity)) if pose else (1, 0.0)
        stamp, satellites = int(self.vehicle.now_s * 1e6), 12 if pose else 0
        return self.mav.gps_raw_int_encode(stamp, fix, *at, height, 80, 120, int(speed * 100.0), 65535, satellites)

    def spot(self, pose: Optional[Pose]) -> tuple[tuple[int, int], int]:
        """Latitude, longitude and height above the sea in integer fields; zeros without a position."""
        if pose is None:
            return (0, 0), 0
        return self.globe.units(pose.at), int((self.globe.origin.height_m + (pose.height_m or 0.0)) * 1000.0)

    def attitude(self) -> Any:
        pose = self.pose()
        return pose and self.mav.attitude_encode(self.boot_ms(), 0.0, 0.0, north_yaw(pose), 0.0, 0.0, -pose.turn_rad_s)

    def quaternion(self) -> Any:
        pose = self.pose()
        if pose is None:
            return None
        half = north_yaw(pose) / 2.0
        return self.mav.attitude_quaternion_encode(self.boot_ms(), math.cos(half), 0.0, 0.0, math.sin(half), 0.0, 0.0, -pose.turn_rad_s)

    def local_position(self) -> Any:
        pose = self.pose()
        if pose is None:
            return None
        (east, north), (to_east, to_north) = pose.at, pose.velocity
        return self.mav.local_position_ned_encode(
            self.boot_ms(), north, east, -(pose.height_m or 0.0), to_north, to_east, -pose.climb_m_s
        )

    def global_position(self) -> Any:
        pose = self.pose()
        if pose is None:
            return None
        at, height = self.spot(pose)
        heading = int(math.degrees(north_yaw(pose)) % 360.0 * 100.0)
        east, north = (int(speed * 100.0) for speed in pose.velocity)
        relative = int((pose.height_m or 0.0) * 1000.0)
        down = int(-pose.climb_m_s * 100.0)
        return self.mav.global_position_int_encode(self.boot_ms(), *at, height, relative, north, east, down, heading)

    def mission_current(self) -> Any:
        plan = self.vehicle.plan
        # The last item stays the current one at the end.
        current = min(plan.current, max(len(plan.items) - 1, 0))
        state = 1 if not plan.items else 5 if plan.finished else 3 if self.vehicle.mode is Mode.MISSION else 2
        return self.mav.mission_current_encode(current, len(plan.items), state)

    def head_up(self) -> Any:
        pose = self.pose()
        if pose is None:
            return None
        speed, heading = math.hypot(*pose.velocity), int(math.degrees(north_yaw(pose)) % 360.0)
        height = self.globe.origin.height_m + (pose.height_m or 0.0)
        return self.mav.vfr_hud_encode(speed, speed, heading, 50 if self.vehicle.armed else 0, height, pose.climb_m_s)

    def battery(self) -> Any:
        return self.mav.battery_status_encode(0, 0, 3, 2500, [3800] * 4 + [65535] * 6, 500, -1, -1, 90)

    def home(self) -> Any:
        home = self.vehicle.home
        if home is None:
            return None
        at, height = self.globe.units(home.at), int(self.globe.origin.height_m * 1000.0)
        return self.mav.home_position_encode(*at, height, home.at[1], home.at[0], 0.0, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0)

    def extended(self) -> Any:
        vehicle = self.vehicle
        if not vehicle.flies or vehicle.landed:
            state = ON_GROUND
        else:
            state = {Mode.TAKEOFF: TAKEOFF, Mode.LAND: LANDING}.get(vehicle.mode, IN_AIR)
        return self.mav.extended_sys_state_encode(0, state)

    def version(self) -> Any:
        # ArduPilot 4.5.0, or PX4 1.15.0, each a release (255).
        major, minor, parameters = (4, 5, FLOAT_PARAMETERS) if self.vehicle.ardupilot else (1, 15, BYTES_PARAMETERS)
        release = major << 24 | minor << 16 | 255
        return self.mav.autopilot_version_encode(CAPABILITIES | parameters, release, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 1)

    def origin(self) -> Any:
        origin = self.globe.origin
        return self.mav.gps_global_origin_encode(*self.globe.units((0.0, 0.0)), int(origin.height_m * 1000.0))


def north_yaw(pose: Pose) -> float:
    """The heading from north to the right, in (-π, π]."""
    return math.remainder(math.pi / 2.0 - pose.yaw_rad, math.tau)
