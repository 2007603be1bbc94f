"""P1's guards at an act, by others than the unit: truth, the guards of the link, receipts, the launcher, the recorder."""

from math import hypot

from links import gap, timely
from log import IMAGING, OLD, SLACK, kind_name
from place import located, truth

RECENT = 250_000  # truth is told ten times a second
SAID = 500_000  # what a unit says of its place, a few times a second


def p1_witnessed(log, faults):
    for e in log.of("plant_act"):
        t, serial = e["t_us"], e["event"]["authority"]
        for what in (mode(log, t), ended(log, t, serial), fence(log, t), astray(log, t), lease(log, t), blind(log, t, faults), seals(log, t)):
            if what:
                yield "P1", t, "act " + what


def mode(log, t):
    return None if log.was_in("PREPARE_TO_ACT", max(0, t - SLACK), t) else "in " + log.mode_at(t)


def ended(log, t, serial):
    minted = [e["t_us"] for e in log.of("minted", by="unit-a") if e["event"]["authority"] == serial and e["t_us"] <= t]
    if minted and any(minted[-1] < at < t and kind_name(kind) in ("hold", "disarm") for at, _, kind in log.executed()):
        return "after its authority was taken away"


def fence(log, t):
    """The margin is for errors of place: without it the unit still stops inside."""
    samples = [tr for at, tr in log.truth() if t - RECENT <= at <= t]
    if not samples:
        return "without any truth of the plant"
    speed = samples[-1]["moves"]
    stop = speed * log.reaction_ms // 1000 + speed * speed // (2 * log.bounds["braking_mm_s2"])
    return "too near to the fence" if samples[-1]["fence_mm"] < stop else None


def astray(log, t):
    said = [ev for at, ev in located(log) if t - SAID <= at <= t][-1:]
    for ev in said:
        at = truth(log).at(ev["stamp"])
        if at and hypot(ev["pose_x_mm"] - at[0], ev["pose_y_mm"] - at[1]) > log.bounds["fence_margin_mm"]:
            return "away from where the unit takes itself to be"


def lease(log, t):
    """A grant came within its length; and before the gateway wrote it, something of the unit no older than Tf had."""
    granted = log.bounds["lease_ms"] * 1000
    for node, limit in (("unit-a", granted), ("gateway", granted + log.bounds["freshness_ms"] * 1000)):
        heard = [at for at in timely(log, node) if at <= t]
        if not heard or t > (gap(log, heard[-1]) or heard[-1] + limit + SLACK):
            return "without supervision: nothing timely at " + node


def blind(log, t, faults):
    td = log.bounds["to_degraded_ms"] * 1000
    gone = [(start, end) for sensor, kind, start, end in faults if kind == "dropout" and sensor != "odometry" or kind in OLD and sensor in IMAGING]
    return "without a sensor" if any(start + td < t < end for start, end in gone + log.dead("perception")) else None


def seals(log, t):
    limit = log.bounds["seal_limit_ms"] * 1000 + SLACK
    return None if any(t - limit <= e["t_us"] <= t for e in log.of("sealed", by="recorder")) else "without a seal"
