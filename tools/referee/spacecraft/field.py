"""Dipole against the whole of IGRF-14 (ppigrf) at 500 km. Run: python field.py"""

from datetime import datetime

import numpy as np
import ppigrf

from crate_trace import trace

rows = trace("field")
latitude = np.array([row["latitude"] for row in rows], float)
longitude = np.array([row["longitude"] for row in rows], float)
ours = np.array([row["field"] for row in rows]) * 1e9
up, south, east = ppigrf.igrf_gc(6871.2, 90.0 - latitude, longitude, datetime(2025, 6, 21))
up, south, east = np.ravel(up), np.ravel(south), np.ravel(east)
lat, lon = np.radians(latitude), np.radians(longitude)
axis_up = np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], 1)
axis_south = np.stack([np.sin(lat) * np.cos(lon), np.sin(lat) * np.sin(lon), -np.cos(lat)], 1)
axis_east = np.stack([-np.sin(lon), np.cos(lon), 0 * lon], 1)
whole = axis_up * up[:, None] + axis_south * south[:, None] + axis_east * east[:, None]
share = np.linalg.norm(ours - whole, axis=1) / np.linalg.norm(whole, axis=1)
angle = np.degrees(np.arccos(np.sum(ours * whole, 1) / np.linalg.norm(ours, axis=1) / np.linalg.norm(whole, axis=1)))
weight = np.cos(lat)
print(
    f"difference as a share of the field: mean {np.average(share, weights=weight):.3f}, at most {share.max():.3f};",
    f"angle: mean {np.average(angle, weights=weight):.1f} deg, at most {angle.max():.1f} deg",
)
