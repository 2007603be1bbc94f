"""Whether the mission took place that the scenario presumes: what the operator was to do before the attack, done by then.

Witnesses are the unit's changes of mode, the authority it minted and the plant's own record of the act. What comes after
the attack took hold is owed by nobody: to prevent it may be the attack.
"""

import math

from log import NOMINAL_MODES, kind_name, planned

WAY = 500_000  # from the operator's look at the display until an order is executed
CLOCKS = 500_000  # what the console's clock may be off
STAGES = ("none", "enabled", "armed", "acted")
PASSED = 2000  # mm from a way point within which it counts as passed
STUCK_WITHIN, STUCK_AFTER = 500, 10_000_000  # mm and us: one that stays so near for so long does not get on, as Nav2's progress checker has it
LEG_WAIT, LEG_PACE = 120_000_000, 0.0005  # us and mm/us: a leg may take a wait, and its straight length at that pace
UNMOVED_AFTER = 5_000_000  # us in driving modes after which one that never came farther than that is stuck, too
LEADS = {"enable": "enabled", "arm": "armed", "confirm": "acted"}


def mission(log, zero):
    """What of the mission is missing, in words."""
    script = log.head["script"]
    # A named step has no time of its own: its parts do.
    starts = [plan["from"] for plan in log.head["planned"] if planned(plan)[0] != "step"]
    until = log.end if zero is None else zero
    before = [step for step in script["steps"] if step["at_us"] + step.get("after_us", 0) + WAY <= (min(starts) if starts else log.end)]
    owed = script["mission"] or max([LEADS.get(step["do"], "none") for step in before] + ["none"], key=STAGES.index)
    came = {
        "enabled": [c[0] for c in log.changes() if c[2] in NOMINAL_MODES],
        "armed": [e["t_us"] for e in log.of("minted", by="unit-a")],
        "acted": [e["t_us"] for e in log.of("plant_act")],
    }
    found = [
        "%s by %d ms is presumed and did not come" % (stage, until // 1000)
        for stage in STAGES[1 : STAGES.index(owed) + 1]
        if not any(t <= until for t in came[stage])
    ][:1]
    # Other orders that the attack waited for.
    if starts and script["mission"] is None:
        done = executions(log, script["steps"])
        for n, step in enumerate(script["steps"]):
            if step in before and step["do"] not in LEADS and (done[n] is None or done[n] > until):
                found.append("%s, due at %d ms before the attack: never" % (step["do"], step["at_us"] // 1000))
    return found


def executions(log, steps):
    """When each step was carried out: its orders are those of its kind from its time on, to the next of its kind."""
    given, executed, taken, found = log.intents(), log.executed(), set(), []
    for n, step in enumerate(steps):
        until = next((other["at_us"] - CLOCKS for other in steps[n + 1 :] if other["do"] == step["do"]), float("inf"))
        since = max(0, step["at_us"] - CLOCKS)
        own = [(t, c) for t, c, kind in given if kind_name(kind) == step["do"] and since <= t < until and c not in taken]
        if own and own[0][0] > step["at_us"] + step["within_us"] + CLOCKS:
            own = []
        ids = {c for _, c in own}
        taken |= ids
        found.append(next((t for t, c, _ in executed if c in ids), None))
    return found


def stuck(log):
    """Whether the vehicle was stuck, by truth, though its mode let it drive and way points were left: at the end, or for half of the time, or on one leg for too long. Logs from before have no route."""
    route = log.head.get("route") or {"points_mm": []}
    points, left = route["points_mm"], list(route["points_mm"])
    modes = NOMINAL_MODES + (("DEGRADED",) if route.get("in_degraded") else ())
    origin, anchor, before, here = None, None, None, None
    behind, on_leg = None, 0
    driving, farthest, stood, last = 0, 0.0, 0, 0
    for t, tr in log.truth():
        if not points or t > log.end:
            break
        here = (tr["x_mm"], tr["y_mm"])
        behind = behind or here
        spent = t - before if before is not None else 0
        driving, on_leg = driving + spent, on_leg + spent
        # At most a lap from one place.
        for _ in points:
            if not left or math.dist(here, left[0]) > PASSED:
                break
            behind, on_leg = left[0], 0
            left = left[1:] or (list(points) if route["looped"] else [])
        last = t - anchor[0] if anchor else 0
        drives = bool(left) and log.mode_at(t) in modes
        before = t if drives else None
        if drives:
            origin = origin or here
            farthest = max(farthest, math.dist(here, origin))
        if not drives or anchor and math.dist(here, anchor[1]) > STUCK_WITHIN:
            anchor, stood, last = None, stood + (last if last >= STUCK_AFTER else 0), 0
        if drives and anchor is None:
            anchor = (t, here)
    at_end = last >= STUCK_AFTER
    astray = bool(left) and behind is not None and on_leg > LEG_WAIT + math.dist(behind, left[0]) / LEG_PACE
    return at_end or astray or 0 < driving <= 2 * (stood + last * at_end) or driving >= UNMOVED_AFTER and farthest < STUCK_WITHIN
