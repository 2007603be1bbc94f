"""Where the unit takes itself to be, against where it is.

The sim says where the unit is; the unit, another process, says what pose it drives by. Both are on one host, so their stamps
compare.
"""

from bisect import bisect_left
from math import hypot

from log import RESTING_MODES
from plant import OVERSPEED

GAP_US = 250_000  # truth is known between entries that are no further apart
# What odometry may be wrong by while fixes are not used: mm, a share of the way, and mm/s of wheels that hold a slope.
ODOMETRY = (100.0, 0.05, 5.0)


def located(log):
    for e in log.of("located", by="unit-a"):
        yield e["t_us"], e["event"]


class Series:
    """Values at stamps of the vehicle's host, read in between."""

    def __init__(self, values):
        self.values = sorted(values)
        self.stamps = [v[0] for v in self.values]

    def at(self, stamp):
        after = bisect_left(self.stamps, stamp)
        if after == len(self.stamps):
            return None
        t1, b = self.values[after]
        if t1 == stamp:
            return b
        if after == 0 or t1 - self.stamps[after - 1] > GAP_US:
            return None
        t0, a = self.values[after - 1]
        share = (stamp - t0) / max(1, t1 - t0)
        return tuple(x + share * (y - x) for x, y in zip(a, b))


def truth(log):
    mine = [e for e in log.of("truth", by="sim") if e["event"]["unit"] == "unit-a"]
    return Series((e["local_us"], (e["event"]["x_mm"], e["event"]["y_mm"])) for e in mine)


def p3_lost(log):
    """Further from where it takes itself to be than the fence margin allows for, for Th, and it does not hold."""
    th, true, since = log.bounds["to_hold_safe_ms"] * 1000, truth(log), None
    for t, ev in located(log):
        at = true.at(ev["stamp"])
        if at is None:
            continue
        lost = hypot(ev["pose_x_mm"] - at[0], ev["pose_y_mm"] - at[1]) > log.bounds["fence_margin_mm"]
        since = (since if since is not None else t) if lost else None
        if lost and t - since > th and log.mode_at(t) not in RESTING_MODES:
            yield "P3", t, "the unit is not where it takes itself to be, and goes on"
            return


def p5_distrusted(log):
    """While a test of the fixes fails none is used: the pose goes by odometry, which goes as the unit goes."""
    # A unit that goes round comes back to its place after a long way.
    true, start, way, last = truth(log), None, 0.0, None
    blind = [(e["t_us"], e["event"]["active"]) for e in log.of("fault") if e["event"]["sensor"] == "odometry"]
    for t, ev in located(log):
        at = true.at(ev["stamp"])
        if at is None:
            continue
        if not ev["distrusted"]:
            start = None
            continue
        way = way + hypot(at[0] - last[0], at[1] - last[1]) if start else 0.0
        last = at
        pose = (ev["pose_x_mm"], ev["pose_y_mm"])
        since, pose0, at0 = start = start or (t, pose, at)
        moved = (pose[0] - pose0[0], pose[1] - pose0[1])
        went = (at[0] - at0[0], at[1] - at0[1])
        # Without odometry the pose may lag behind by all that the unit can go.
        unseen = without(blind, since, t) / 1e6 * (log.bounds["max_speed_mm_s"] + OVERSPEED)
        allowed = ODOMETRY[0] + ODOMETRY[1] * way + ODOMETRY[2] * (t - since) / 1e6 + unseen
        if hypot(*moved) > ODOMETRY[0] and hypot(moved[0] - went[0], moved[1] - went[1]) > allowed:
            yield "P5", t, "a pose moved under fixes that the unit distrusts"
            return


def without(switched, since, until):
    """For how long of that time a fault stood that was switched on and off so."""
    total, on = 0, None
    for t, active in switched + [(until, False)]:
        if active and on is None:
            on = t
        elif not active and on is not None:
            total += max(0, min(t, until) - max(on, since))
            on = None
    return total
