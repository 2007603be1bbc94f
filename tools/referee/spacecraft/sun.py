"""Sun direction against ERFA (VSOP2000 Earth, IAU 2006/2000A), turned to TEME. Run: python sun.py"""

import erfa
import numpy as np

from crate_trace import trace

rows = trace("sun")
jd = np.array([row["jd"] for row in rows])
ours = np.array([row["sun"] for row in rows])
tt = jd + 69.2 / 86400.0
heliocentric, _ = erfa.epv00(tt, 0.0)
geometric = -heliocentric["p"]
# Light left the sun 499 s per astronomical unit ago; what a sensor on a satellite sees is the apparent place.
distance = np.linalg.norm(geometric, axis=1)
velocity = erfa.epv00(tt, 0.0)[1]["v"]
direction = geometric / distance[:, None] + velocity / 173.1446
direction /= np.linalg.norm(direction, axis=1)[:, None]
true = np.einsum("nij,nj->ni", erfa.pnm06a(tt, 0.0), direction)
equinoxes = erfa.ee06a(tt, 0.0)
cos, sin = np.cos(equinoxes), np.sin(equinoxes)
# The turn by apparent sidereal time from the true equinox is that by mean sidereal time from TEME's.
teme = np.stack([cos * true[:, 0] + sin * true[:, 1], -sin * true[:, 0] + cos * true[:, 1], true[:, 2]], axis=1)
off = np.degrees(np.arctan2(np.linalg.norm(np.cross(ours, teme), axis=1), np.sum(ours * teme, axis=1)))
print(f"sun direction in TEME: mean {off.mean():.5f} deg, at most {off.max():.5f} deg over {len(jd)} days from 2020")
