"""What the platform owes when a process is killed, hangs, is slow or finds its disk full: the table of docs/reference/scenarios.md.

A late restriction is P2's, a late HOLD_SAFE P3's. A process that does not run for a time owes what a dead one does, as far as the
bound ends within that time. Where nothing can be learnt (the unit was not in nominal control, the run ends before) it is P10.
"""

from log import NOMINAL_MODES, RESTING_MODES, SLACK

NEVER = float("inf")
SAMPLE = 100_000  # between two samples of the plant's truth


def bounds_of(log, node):
    """Latest time without READY or authority, and latest in HOLD_SAFE, microseconds; None where nothing is owed."""
    b = {name: ms * 1000 for name, ms in log.bounds.items() if name.endswith("_ms")}
    td, th = b["to_degraded_ms"], b["to_hold_safe_ms"]
    return {
        "sim": (td, th),
        "perception": (td, th),
        "unit-a": (None, th),
        "gateway": (None, th),
        "relay-telemetry": (None, th),
        "broker": (None, th),
        "recorder": (b["seal_limit_ms"] + b["control_period_ms"], None),
        "console": (None, None),
    }.get(node)


def p2_p3_processes(log):
    for e in log.of("ended", "suspended", "disk_full"):
        ev, t = e["event"], e["t_us"]
        node = ev["node"]
        if bounds_of(log, node) is None or not (ev["killed"] if ev["is"] == "ended" else ev["on"]):
            continue
        if ev["is"] == "suspended" and any(died <= t < again for died, again in log.dead(node)):
            continue  # what has ended is not stopped: its end owes the response
        runs = runs_again(log, ev, t)
        killed = ev["is"] == "ended"
        if log.mode_at(t) not in NOMINAL_MODES and not own_step(log, t):
            yield "P10", t, "the unit was not in nominal control when it happened to " + node
            continue
        zero = t
        if node == "broker":
            # By itself its death owes nothing: only a HOLD that cannot be acknowledged does.
            zero = next((at for at, _, kind in log.intents() if kind == "hold" and t <= at < runs), None)
        if zero is None:
            if killed:
                yield "P10", t, "no HOLD after the broker was killed"
        elif node == "unit-a":
            yield from plant_stops(log, zero, runs)
            yield from holds_again(log, t, runs)
        else:
            yield from platform_responds(log, node, zero, runs)
        if ev["is"] == "disk_full":
            yield from held_up(log, t, min(runs, log.end))


def runs_again(log, ev, t):
    """When it runs again: after a start, once there is room, after the longest of its stops."""
    node = ev["node"]
    if ev["is"] == "suspended":
        return next(end for start, end in log.stopped(node) if start == t)
    if ev["is"] == "disk_full":
        return min(log.turned("disk_full", node, False, t) + [NEVER])
    return next(end for start, end in log.dead(node) if start == t)


def own_step(log, t):
    """Whether it was a named step: put where it is on purpose, whatever the unit's mode."""
    return any(e["event"]["begun"] and 0 <= t - e["t_us"] < SAMPLE for e in log.of("step", by="campaign"))


def platform_responds(log, node, zero, runs):
    due = [zero + bound if bound is not None and zero + bound <= runs else None for bound in bounds_of(log, node)]
    if any(at is not None and at > log.end for at in due):
        yield "P10", log.end, "the run ends before what is owed for %s is due" % node
        return
    for at, prop, restful in zip(due, ("P2", "P3"), (lambda m: m not in NOMINAL_MODES, lambda m: m in RESTING_MODES)):
        if at is None or any(died <= at < again for died, again in log.dead("unit-a")):
            continue  # of a unit that is dead itself only its plant can be asked, for its own death
        judged = log.able("unit-a", at)
        if judged <= log.end and not restful(log.mode_at(judged)):
            yield prop, at, "%s for too long after what happened to %s" % (log.mode_at(judged), node)
    if bounds_of(log, node)[1] is not None and node != "sim":
        yield from stands(log, zero, runs)


def plant_stops(log, zero, runs):
    """Under a dead unit the last set-point's lease ends, in any case within Th, and the plant stands when the brakes have had their time."""
    lease = log.bounds["set_point_lease_ms"] * 1000 + SLACK
    ends = zero + lease + stood_still(log, zero, zero + lease)
    leased = next((at for at, tr in log.truth() if ends < at < runs and tr["leased"]), None)
    if leased is not None:
        yield "P3", leased, "the plant is leased for longer than its last set-point was"
    due = zero + log.bounds["to_hold_safe_ms"] * 1000
    due += stood_still(log, zero, due)
    if due > runs:
        return
    if not any(at >= due for at, _ in log.truth()):
        yield "P10", due, "nothing tells of the plant under the dead unit"
    for at, tr in log.truth():
        if due < at < runs and (tr["leased"] or tr["set_speed_mm_s"]):
            yield "P3", at, "the plant is driven under a dead unit"
            break
    yield from stands(log, zero, runs)


def stands(log, zero, runs):
    b = log.bounds
    braking = b["max_speed_mm_s"] * 1_000_000 // b["braking_mm_s2"]
    due = zero + b["to_hold_safe_ms"] * 1000 + braking + SAMPLE
    due += stood_still(log, zero, due)
    if any(due < at < runs and not tr["safe"] for at, tr in log.truth()):
        yield "P3", due, "the plant has not come to rest"


def stood_still(log, since, until):
    """For how long the plant's world did not go on from then on, of stops that began by the end: nothing brakes in it, no lease ends."""
    return sum(max(0, end - max(start, since)) for start, end in log.stopped("sim") if start <= until)


def holds_again(log, t, runs):
    """A unit that did not run for lease + Tc holds at its first judgement."""
    b = log.bounds
    if runs >= log.end or runs - t <= (b["lease_ms"] + b["control_period_ms"]) * 1000:
        return
    first = runs + b["control_period_ms"] * 1000 + 50_000
    if first <= log.end and log.mode_at(first) not in RESTING_MODES:
        yield "P3", first, "the unit goes on after it had not run"


def held_up(log, since, until):
    """A log that cannot be written holds up nothing: reports come within Tf of each other, and the plant is driven."""
    reports = [e["t_us"] for e in log.of("accepted", by="gateway") if e["event"]["record"]["node"] == "unit-a"]
    marks = [since] + [t for t in reports if since <= t < until] + [until]
    for before, after in zip(marks, marks[1:]):
        if after - before > log.bounds["freshness_ms"] * 1000:
            yield "P2", after, "no report while no log could be written"
            break
    for at, tr in log.truth():
        if since <= at < until and not tr["leased"] and log.mode_at(at) not in RESTING_MODES:
            yield "P2", at, "no set-point while no log could be written"
            break
