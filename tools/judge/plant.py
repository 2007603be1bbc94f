"""What the plant does, against the mode that its unit is in and the commands that it says it executed.

Set-points are those that the plant holds, speeds its true ones. A command is executed once, and an order to stop stops.
"""

from log import SLACK, STANDING, key, kind_name

# By how much a driving plant may be above its set-point: 1 m/s^2 of slope, and its control gives 4 m/s^2 for each m/s.
OVERSPEED = 250


def lapsed(log, t):
    """When a set-point from before t no longer drives the plant."""
    return log.able("sim", t + log.bounds["set_point_lease_ms"] * 1000 + SLACK)


def slowed(log, t, to):
    """When a plant that brakes since t has come down to that speed; in a world that hangs nothing brakes."""
    takes = max(0, log.bounds["max_speed_mm_s"] - to) * 1_000_000 // log.bounds["braking_mm_s2"]
    when = log.able("sim", t + takes)
    return when + takes if when > t + takes else when


def set_speed(log, t):
    """The speed that an operator has set since the unit last started."""
    started = max([m[0] for m in log.changes() if m[3] == "start" and m[0] <= t], default=0)
    values = [k["configure"]["speed_mm_s"] for at, _, k in log.executed() if kind_name(k) == "configure" and started <= at <= t]
    return values[-1] if values else float("inf")


def speeds(log):
    """P2 in DEGRADED, P3 in HOLD_SAFE, P9 in IDLE; P4 above the largest speed, which the fence's margin is derived from."""
    full, slow = log.bounds["max_speed_mm_s"], log.bounds["degraded_speed_mm_s"]
    broken = {"DEGRADED": "P2", "HOLD_SAFE": "P3", "IDLE": "P9"}
    for i, (t, _, mode, _) in enumerate(log.modes):
        until = log.modes[i + 1][0] if i + 1 < len(log.modes) else float("inf")
        stands = mode in ("HOLD_SAFE", "IDLE")
        limit = STANDING if stands else min(slow if mode == "DEGRADED" else full, set_speed(log, t))
        due = lapsed(log, t)
        braked = slowed(log, due, limit)
        for at, tr in log.truth():
            asks = not tr["asked_safe"] if stands else abs(tr["set_speed_mm_s"]) > limit
            goes = not tr["safe"] if stands else tr["moves"] > limit + OVERSPEED
            fast = at >= due and asks or at >= braked and goes
            if fast and at < until:
                yield broken.get(mode, "P4"), at, "too fast for %s" % mode
                break


def p8_effects(log):
    executed = log.executed()
    for t, _, kind in executed:
        if kind_name(kind) == "hold":
            yield from p8_hold(log, t, executed)
        elif kind_name(kind) == "disarm" and log.mode_at(t + SLACK) == "PREPARE_TO_ACT":
            if not any(t < e["t_us"] <= t + SLACK for e in log.of("minted", by="unit-a")):
                yield "P8", t + SLACK, "disarmed by word, and authority is held"
    changed = set()
    for e in log.of("transition", by="unit-a"):
        because, t = e["event"]["because"], e["t_us"]
        if not isinstance(because, dict) or "command" not in because:
            continue
        k = key(because["command"])
        lost = any(t <= died <= t + SLACK for died, _ in log.dead("unit-a"))
        if not lost and not any(k == done and abs(at - t) <= SLACK for at, done, _ in executed):
            yield "P8", t, "a mode changed for a command that was not executed"
        if k in changed:
            yield "P8", t, "a mode changed twice for one command"
        changed.add(k)
    acted = set()
    for e in log.of("plant_act"):
        k = key(e["event"]["command"])
        if k in acted:
            yield "P8", e["t_us"], "two acts on one command"
        acted.add(k)


def p8_hold(log, t, executed):
    if not log.was_in("HOLD_SAFE", max(0, t - SLACK), t + SLACK):
        yield "P8", t, "held by word, and in another mode"
        return
    on = [at for at, _, kind in executed if at > t and kind_name(kind) in ("resume", "enable")]
    on += [m[0] for m in log.changes() if m[3] == "start" and m[0] > t]
    due = lapsed(log, t)
    still = slowed(log, due, STANDING)
    for at, tr in log.truth():
        goes = at >= due and not tr["asked_safe"] or at >= still and not tr["safe"]
        if goes and at < min(on, default=float("inf")):
            yield "P8", at, "held by word, and the plant goes"
            return
