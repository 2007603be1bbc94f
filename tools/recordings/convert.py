"""Turns published recordings of wheeled vehicles into MCAP files with JSON messages, as `holdsafe assess` reads them with the maps beside this file.

    pip install rosbags==0.11.9 mcap==1.6.0 numpy
    python3 tools/recordings/convert.py car project.bag car.mcap
    holdsafe assess car.mcap --map tools/recordings/maps/car.toml --platform tools/recordings/platforms/fine.toml

Inputs, by repository on GitHub and commit:
  mecanum    Davv-M/RoboticsProject12022 169410b, bags/bag1.bag to bag3.bag
  car        henriettestadler/first_project 3170ccf, project.bag
  husky      cra-ros-pkg/robot_localization 1cb9533, test/test1.bag
  kart       Amonsuzuki/mcap_reader ba299ac, the folder rosbag2_2025_09_30_12_52_32 with its CSV
  commuter   commaai/comma2k19 4c7f1a6, the folder Example_1/b0c9d2329ad1606b|2018-08-02--08-34-47/40 with its numpy arrays
  turtlebot  MichaelGrupp/evo 26d0953, test/data/nav2_turtlebot.mcap; `assess` reads it as it is, so here it is asked for its ways alone

Topics are `fix`, `odometry` and, where fixes have no heading, `heading`; the stamp `t` is in microseconds of the recording's own clock. Values are
the recording's but for twists and headings that no topic has, which are derived below. Printed is the sum of ways by odometry over that by fixes, of
chords of a second. Without an output nothing is written.
"""

import json
import sys
from pathlib import Path

import numpy as np
from mcap.writer import Writer
from rosbags.highlevel import AnyReader

# Calibrated on these bags by the repository's authors: launch/project_1.launch.
MECANUM = {"radius_m": 0.069, "half_length_m": 0.195, "half_width_m": 0.164, "gear": 5, "ticks": 38}
# Stated in src/odometer.cpp of the car's repository.
CAR = {"wheelbase_m": 1.765, "steering": 32.0}
# Mounting of the Husky's IMU, with which it stands level: yaw -90 degrees, then roll 90 degrees; conjugated, as w, x, y, z.
HUSKY_IMU = (0.5, -0.5, 0.5, 0.5)
RADIUS_M = 6_378_137.0


def messages(path, *topics):
    """Messages of a bag by topic, in order."""
    found = {topic: [] for topic in topics}
    with AnyReader([Path(path)]) as reader:
        for connection, _, raw in reader.messages([c for c in reader.connections if c.topic in topics]):
            found[connection.topic].append(reader.deserialize(raw, connection.msgtype))
    return [found[topic] for topic in topics]


def stamps(found):
    return np.array([m.header.stamp.sec * 1_000_000 + m.header.stamp.nanosec // 1000 for m in found])


def product(a, b):
    """Product of two quaternions w, x, y, z."""
    (aw, ax, ay, az), (bw, bx, by, bz) = a, b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def yaw(quaternion):
    w, x, y, z = quaternion
    return np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def parts(orientation):
    return orientation.w, orientation.x, orientation.y, orientation.z


def plane(latitude, longitude):
    """Metres east and north of the first, on a sphere: for ways and for one heading out of two receivers, not for places."""
    north, east = np.radians(latitude - latitude[0]), np.radians(longitude - longitude[0])
    return RADIUS_M * east * np.cos(np.radians(latitude[0])), RADIUS_M * north


def table(**columns):
    return {name: np.asarray(values) for name, values in columns.items()}


def mecanum(path):
    poses, wheels = messages(path, "/robot/pose", "/wheel_states")
    fix = table(
        t=stamps(poses),
        x=[m.pose.position.x for m in poses],
        y=[m.pose.position.y for m in poses],
        yaw=[yaw(parts(m.pose.orientation)) for m in poses],
    )
    t, ticks = stamps(wheels), np.array([m.position[:4] for m in wheels])
    turned = np.diff(ticks, axis=0) * 2 * np.pi / (MECANUM["gear"] * MECANUM["ticks"])
    # Of an interval each, so it stands for the interval's middle.
    front_left, front_right, rear_left, rear_right = (turned / (np.diff(t) / 1e6)[:, None] * MECANUM["radius_m"] / 4).T
    across = MECANUM["half_length_m"] + MECANUM["half_width_m"]
    return fix, table(
        t=(t[1:] + t[:-1]) // 2,
        speed=front_left + front_right + rear_left + rear_right,
        sideways=-front_left + front_right + rear_left - rear_right,
        yaw_rate=(-front_left + front_right - rear_left + rear_right) / across,
    ), None


def car(path):
    front, rear, wheels = messages(path, "/swiftnav/front/gps_pose", "/swiftnav/rear/gps_pose", "/speedsteer")
    # A receiver without a fix says status 0 and latitude 0.
    front, rear = ([m for m in found if m.status.status > 0] for found in (front, rear))
    t, other = stamps(front), stamps(rear)
    # Of each front fix the nearest rear one: both receivers make ten a second.
    apart = np.abs(other[:, None] - t[None, :])
    paired = apart.min(axis=0) <= 60_000
    nearest, t, front = apart.argmin(axis=0)[paired], t[paired], [m for m, pair in zip(front, paired) if pair]
    latitude, longitude = np.array([(m.latitude, m.longitude) for m in front]).T
    behind = np.array([(rear[i].latitude, rear[i].longitude) for i in nearest]).T
    east = np.radians(longitude - behind[1]) * np.cos(np.radians(latitude))
    heading = np.arctan2(np.radians(latitude - behind[0]), east)
    fix = table(t=t, latitude=latitude, longitude=longitude, yaw=heading)
    speed = np.array([m.point.y for m in wheels]) / 3.6
    steering = np.radians([m.point.x for m in wheels]) / CAR["steering"]
    rate = speed * np.tan(steering) / CAR["wheelbase_m"]
    return fix, table(t=stamps(wheels), speed=speed, yaw_rate=rate), None


def husky(path):
    fixes, wheels, imu = messages(path, "/fix", "/husky_velocity_controller/odom", "/imu/data")
    fix = table(
        t=stamps(fixes),
        latitude=[m.latitude for m in fixes],
        longitude=[m.longitude for m in fixes],
        variance=[m.position_covariance[0] for m in fixes],
    )
    odometry = table(
        t=stamps(wheels),
        speed=[m.twist.twist.linear.x for m in wheels],
        yaw_rate=[m.twist.twist.angular.z for m in wheels],
    )
    headings = [yaw(product(parts(m.orientation), HUSKY_IMU)) for m in imu]
    heading = table(t=stamps(imu), yaw=headings)
    # A compass is off by declination and mounting: by one angle, which turns the way by wheels onto the way by fixes.
    by_fixes, by_wheels = chords(fix, odometry, heading, 5.0)
    heading["yaw"] = heading["yaw"] + np.angle(np.sum(by_fixes * np.conj(by_wheels)))
    return fix, odometry, heading


def kart(folder):
    def read(name):
        rows = np.genfromtxt(Path(folder) / f"{name}.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
        return rows, rows["stamp"] // 1000

    (gnss, at), (wheels, t) = read("sensing_gnss_pose_with_covariance"), read("vehicle_status_velocity_status")
    (imu, of_imu), (estimate, of_estimate) = read("sensing_imu_imu_data"), read("localization_kinematic_state")
    rate = np.interp(t, of_imu, imu["gyro_z"])
    odometry = table(t=t, speed=wheels["vx"], yaw_rate=rate)
    return table(t=at, x=gnss["gnss_x"], y=gnss["gnss_y"]), odometry, table(t=of_estimate, yaw=estimate["ekf_yaw"])


def commuter(folder):
    def read(name):
        at, values = (np.load(Path(folder) / "processed_log" / name / part) for part in ("t", "value"))
        return np.round(at * 1e6).astype(np.int64), values

    (at, gnss), (t, speed), (of_gyro, gyro) = read("GNSS/live_gnss_ublox"), read("CAN/speed"), read("IMU/gyro")
    # The receiver's heading is its course, clockwise from north; the gyro's third axis points down.
    course = np.radians(90 - gnss[:, 5])
    fix = table(t=at, latitude=gnss[:, 0], longitude=gnss[:, 1], time_ms=gnss[:, 3], yaw=course)
    return fix, table(t=t, speed=speed[:, 0], yaw_rate=-np.interp(t, of_gyro, gyro[:, 2])), None


def turtlebot(path):
    poses, wheels = messages(path, "/amcl_pose", "/odom")
    fix = table(
        t=stamps(poses),
        x=[m.pose.pose.position.x for m in poses],
        y=[m.pose.pose.position.y for m in poses],
        yaw=[yaw(parts(m.pose.pose.orientation)) for m in poses],
    )
    return fix, table(t=stamps(wheels), speed=[m.twist.twist.linear.x for m in wheels]), None


def chords(fix, odometry, heading, seconds):
    """Ways between fixes so far apart at least, by fixes and by odometry along the heading: complex numbers, metres east and north."""
    x, y = plane(fix["latitude"], fix["longitude"]) if "latitude" in fix else (fix["x"], fix["y"])
    kept = [0]
    for i, t in enumerate(fix["t"]):
        if t - fix["t"][kept[-1]] >= seconds * 1e6:
            kept.append(i)
    t, ends = odometry["t"] / 1e6, fix["t"][kept] / 1e6
    velocity = odometry["speed"] + 1j * odometry.get("sideways", 0.0)
    velocity = velocity * np.exp(1j * np.interp(t, heading["t"] / 1e6, np.unwrap(heading["yaw"])))
    way = np.concatenate([[0], np.cumsum((velocity[1:] + velocity[:-1]) / 2 * np.diff(t))])
    at = np.interp(ends, t, way.real) + 1j * np.interp(ends, t, way.imag)
    return np.diff(x[kept]) + 1j * np.diff(y[kept]), np.diff(at)


def write(path, topics):
    with open(path, "wb") as file:
        writer = Writer(file)
        writer.start()
        for name, columns in topics.items():
            schema = writer.register_schema(name, "jsonschema", b'{"type":"object"}')
            channel = writer.register_channel(name, "json", schema)
            for row in zip(*(values.tolist() for values in columns.values())):
                message = dict(zip(columns, row))
                writer.add_message(channel, message["t"] * 1000, json.dumps(message).encode(), message["t"] * 1000)
        writer.finish()


VEHICLES = {f.__name__: f for f in (mecanum, car, husky, kart, commuter, turtlebot)}

if __name__ == "__main__":
    if len(sys.argv) not in (3, 4) or sys.argv[1] not in VEHICLES:
        sys.exit(f"usage: convert.py {'|'.join(VEHICLES)} INPUT [OUTPUT.mcap]")
    fix, odometry, heading = VEHICLES[sys.argv[1]](sys.argv[2])
    by_fixes, by_odometry = (np.abs(way).sum() for way in chords(fix, odometry, heading or fix, 1.0))
    print(f"{by_odometry:.1f} m by odometry, {by_fixes:.1f} m by fixes: {by_odometry / by_fixes:.2f}")
    if len(sys.argv) == 4:
        topics = {"fix": fix, "odometry": odometry, "heading": heading}
        write(sys.argv[3], {name: columns for name, columns in topics.items() if columns is not None})
