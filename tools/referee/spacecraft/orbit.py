"""Orbit after a day against sgp4's Python, places and passes against skyfield. Run: python orbit.py"""

import math

import numpy as np
from scipy.optimize import brentq, minimize_scalar
from sgp4.api import WGS72, Satrec
from skyfield.api import EarthSatellite, load, wgs84
from skyfield.framelib import itrs

from crate_trace import trace

said = trace("orbit")
satrec = Satrec.twoline2rv(said["line_1"], said["line_2"], WGS72)
worst = [0.0, 0.0]
for row in said["states"]:
    code, r, v = satrec.sgp4_tsince(row["s"] / 60.0)
    assert code == 0
    worst[0] = max(worst[0], np.linalg.norm(np.array(r) * 1e3 - row["r"]))
    worst[1] = max(worst[1], np.linalg.norm(np.array(v) * 1e3 - row["v"]))
last = said["states"][-1]
_, r, v = satrec.sgp4_tsince(last["s"] / 60.0)
print(
    f"TEME against sgp4 (Python), every minute of a day: at most {worst[0]:.6f} m, {worst[1]:.6f} m/s;",
    f"after a day {np.linalg.norm(np.array(r) * 1e3 - last['r']):.6f} m",
)

ts = load.timescale(builtin=True)
satellite = EarthSatellite(said["line_1"], said["line_2"], "x", ts)
station = wgs84.latlon(said["latitude"], said["longitude"], said["height"])
epoch = satellite.epoch
# Seconds since the epoch as UTC, which has no leap second that day.
times = ts.utc(2025, 6, 21, 12, 0, [row["s"] for row in said["states"]])
fixed = satellite.at(times).frame_xyz(itrs).m.T
off = np.linalg.norm(fixed - np.array([row["fixed"] for row in said["states"]]), axis=1)
print(f"Earth-fixed against skyfield: mean {off.mean():.1f} m, at most {off.max():.1f} m")
ut1 = times[0].dut1
print(f"UT1-UTC there: {ut1:.3f} s, which turns the Earth by {abs(ut1) * 7.292115e-5 * 6.9e6:.1f} m at the satellite")
topocentric = (satellite - station).at(times)
altitude, _, distance = topocentric.altaz()
print(
    "elevation: at most"
    f" {np.abs(altitude.radians - [row['elevation'] for row in said['states']]).max() * 180 / math.pi:.5f} deg;",
    f"range: at most {np.abs(distance.m - [row['range'] for row in said['states']]).max():.1f} m",
)
rates = topocentric.frame_latlon_and_rates(station)[5].km_per_s * 1e3
print(f"range rate: at most {np.abs(rates - [row['range_rate'] for row in said['states']]).max():.3f} m/s")

start = ts.utc(2025, 6, 21, 12)
end = ts.utc(2025, 6, 22, 12)
events, kinds = satellite.find_events(station, start, end, altitude_degrees=5.0)


def height(seconds):
    return (satellite - station).at(ts.utc(2025, 6, 21, 12, 0, seconds)).altaz()[0].degrees


# find_events is good to half a second: its times are made exact.
times = [(t - start) * 86400.0 for t in events]
passes = []
for i in range(0, len(times) - 2, 3):
    assert list(kinds[i : i + 3]) == [0, 1, 2]
    rise, top, set_ = (times[i], times[i + 1], times[i + 2])
    rise = brentq(lambda s: height(s) - 5.0, rise - 2, rise + 2, xtol=1e-5)
    set_ = brentq(lambda s: height(s) - 5.0, set_ - 2, set_ + 2, xtol=1e-5)
    best = minimize_scalar(lambda s: -height(s), bounds=(top - 2, top + 2), method="bounded", options={"xatol": 1e-4})
    passes.append((rise, set_, -best.fun))
print(f"passes: {len(said['passes'])} here, {len(passes)} by skyfield")
for (a, b, c), (d, e, f) in zip(said["passes"], passes):
    print(
        f"  rise {a:9.3f} s ({a - d:+.3f}), set {b:9.3f} s ({b - e:+.3f}), highest {math.degrees(c):6.3f} deg"
        f" ({math.degrees(c) - f:+.4f})"
    )
