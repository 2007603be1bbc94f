"""The properties, P1 to P12, of the platform under test: one function each, from the text of ARCHITECTURE.md and docs/.

Each gives (property, when, what). What processes owe that were killed is `owed`'s, where the unit takes itself to be `place`'s,
what is shown of commands and sessions `control`'s, what the plant does `plant`'s, what others know of P1's guards `guards`'s.
"""

import json
import math
from bisect import bisect_right

from links import gap, timely
from log import IMAGING, NOMINAL_MODES, OLD, RESTING_MODES, SLACK, STANDING, key, key_of_record, kind_name, planned, towards_safe


def p1_p11_acts(log):
    minted = [(e["t_us"], e["event"]) for e in log.of("minted", by="unit-a")]
    revoked = [(e["t_us"], e["event"]["authority"]) for e in log.of("revoked", by="unit-a")]
    intents, used = log.intents(), set()
    sound = {e["event"]["authority"] for e in log.of("acted") if not e["event"]["failing"]}
    for e in log.of("plant_act"):
        t, act = e["t_us"], e["event"]
        serial = act["authority"]
        if not any(at <= t and m["authority"] == serial for at, m in minted):
            yield "P1", t, "act without authority"
        if any(at <= t and r == serial for at, r in revoked) or serial in used:
            yield "P1", t, "act with authority that had ended"
        used.add(serial)
        if serial not in sound:
            yield "P1", t, "act without every guard"
        limit = log.bounds["command_limit_ms"] * 1000 + SLACK
        fresh = any(k == key(act["command"]) and kind_name(kind) == "confirm" and 0 <= t - at <= limit for at, k, kind in intents)
        if not fresh:
            yield "P1", t, "act without a fresh confirmation"
        if act["class"] != "vehicle" or act["distance_mm"] > log.bounds["designation_mm"]:
            yield "P11", t, "act on something else"
    for at, m in minted:
        ordered = any(k == key(m["command"]) and kind == {"arm": m["track"]} for _, k, kind in log.executed())
        if not ordered:
            yield "P11", at, "authority on a track that was not ordered"


def p1_lifetime(log):
    if any(planned(p)[0] in ("suspend", "kill") and planned(p)[1] == "unit-a" for p in log.head["planned"]):
        return  # a unit that does not run cannot end it
    limit = (log.bounds["authority_ms"] + log.bounds["control_period_ms"]) * 1000 + SLACK
    for i, (t, _, to, _) in enumerate(log.modes):
        until = log.modes[i + 1][0] if i + 1 < len(log.modes) else log.end
        if to == "PREPARE_TO_ACT" and until - t > limit:
            yield "P1", t + limit, "authority outlives its time"


def p2(log, faults):
    td = log.bounds["to_degraded_ms"] * 1000
    for sensor, kind, start, end in faults:
        # Nothing rests on odometry alone while fixes come.
        lost = kind == "dropout" and sensor != "odometry" or kind in OLD and sensor in IMAGING
        owed = lost and end - start > td and start + td <= log.end
        if owed and log.mode_at(start + td) in NOMINAL_MODES:
            yield "P2", start + td, sensor + " is lost and nothing follows"


def p3_place(log, faults):
    """Driving depends on localisation: a unit that lost it for good holds within Th."""
    th = log.bounds["to_hold_safe_ms"] * 1000
    for sensor, kind, start, end in faults:
        owed = kind == "dropout" and sensor == "localisation" and end - start > th and start + th <= log.end
        if owed and log.mode_at(log.able("unit-a", start + th)) not in RESTING_MODES:
            yield "P3", start + th, "localisation is lost and the unit goes on"


def p3_link(log):
    """Nothing timely at either end for Th, and the unit does not hold."""
    th = log.bounds["to_hold_safe_ms"] * 1000
    for node in ("gateway", "unit-a"):
        times = timely(log, node)
        gone = sorted(set(log.dead(node) + log.dead("unit-a")))
        times = [t for t in times if not any(a <= t <= b for a, b in gone)]
        times += [t for span in gone for t in span if t < log.end]
        times = sorted(times + [0, log.end])
        for before, after in zip(times, times[1:]):
            due = gap(log, before) or before + th
            if after <= due or any(a <= before and after <= b for a, b in gone):
                continue
            t = log.able("unit-a", due)
            if log.mode_at(t) not in RESTING_MODES:
                yield "P3", due, "nothing timely at %s and no hold" % node


def p3_operator(log):
    """An operator's HOLD is obeyed within Th, however it gets there."""
    th = log.bounds["to_hold_safe_ms"] * 1000 + SLACK
    tags = log.due()
    for given, k, kind in log.intents():
        t = given + tags.get(k, (0, 0))[0]
        due = t + th
        lived = all(due < died or again < t for died, again in log.dead("unit-a"))
        if kind == "hold" and due <= log.end and lived:
            if not log.was_in("HOLD_SAFE", t, log.able("unit-a", due)) and log.mode_at(t) != "IDLE":
                yield "P3", due, "a HOLD that is not obeyed"


def p4(log):
    for t, tr in log.truth():
        if tr["fence_mm"] < 0:
            yield "P4", t, "outside the fence"
            break
    touched = {}
    for e in log.of("collided"):
        if e["event"]["unit"] != "unit-a":
            continue
        speed, thing, before = e["event"]["speed_mm_s"], e["event"]["object"], touched.get(e["event"]["object"])
        touched[thing] = e["t_us"]
        # A thing that pushes on a body that it touched before, and that moves off, is no collision of the body's.
        if abs(speed) > STANDING and not (speed < 0 and before is not None and e["t_us"] - before <= PUSHES):
            yield "P4", e["t_us"], "drives into an object"
            return


def p12(log):
    """Energy for the way to safety, and the least distance to the surface below, of a platform that leaves the ground."""
    for what in ("energy", "clearance"):
        for t, tr in log.truth():
            if tr.get("margins", {}).get(what, 0) < 0:
                yield "P12", t, "too little %s" % what
                break


def p5(log):
    accepted, at_unit, given = set(), set(), {}
    for t, k, kind in log.intents():
        given.setdefault((k, json.dumps(kind, sort_keys=True)), t)
    rogue = {(key(e["event"]["command"]), e["event"]["key"]) for e in log.of("rogue")}
    for e in log.of("accepted", "displayed", "executed", "inconsistent"):
        ev, t = e["event"], e["t_us"]
        if ev["is"] == "accepted" and e["node"] == "gateway":
            accepted.add(key_of_record(ev["record"]))
        elif ev["is"] == "accepted" and e["node"] == "unit-a":
            at_unit.add(key_of_record(ev["record"]))
        elif ev["is"] == "inconsistent" and e["node"] == "unit-a" and key_of_record(ev["record"]) not in at_unit:
            yield "P5", t, "a teammate found out by what was never accepted"
        elif ev["is"] == "displayed" and ev["freshness"] != "lost" and ev["report"]["node"] != ev["unit"]:
            yield "P5", t, "displayed of a unit whose report it is not"
        elif ev["is"] == "displayed" and ev["freshness"] != "lost" and key_of_record(ev["report"]) not in accepted:
            yield "P5", t, "displayed and never accepted"
        elif ev["is"] == "executed" and e["node"] == "unit-a" and ev["refused"] is None:
            k = key(ev["command"])
            if given.get((k, json.dumps(ev["kind"], sort_keys=True)), float("inf")) > t:
                # With an operator's own key one may stop a unit: nobody can tell, and it is safe.
                operator = ev["command"]["operator"]
                if not ((k, operator) in rogue and kind_name(ev["kind"]) in ("hold", "disarm")):
                    yield "P5", t, "executed and never given"


def p6(log):
    n = {}
    for e in log.of("count"):
        n[e["node"], json.dumps(e["event"]["account"], sort_keys=True)] = e["event"]["n"]

    def of(node, account):
        return n.get((node, json.dumps(account, sort_keys=True)), 0)

    killed = set(log.head["killed"])
    relay = "relay-telemetry"
    for frm, to, side, other, at in (
        ("unit-a", "gateway", "client", "server", "uplink"),
        ("gateway", "unit-a", "server", "client", "downlink"),
    ):
        guard = "guard-" + to
        if not killed & {frm, to, relay}:
            passed = of(relay, {"relay_in": side}) + of(relay, {"relay_added": other}) - of(relay, {"relay_dropped": side})
            if passed != of(relay, {"relay_out": other}):
                yield "P6", log.end, "the relay's account, " + frm + " to " + to
        if to not in killed:
            refused = 0
            for (node, account), count in n.items():
                account = json.loads(account)
                if node == to and isinstance(account, dict) and account.get("refused", [None])[0] == at:
                    refused += count
            if of(to, {"received": at}) != of(to, {"accepted": at}) + refused:
                yield "P6", log.end, "delivered and judged at " + to
            left = of(guard, "guard_in") - of(guard, "guard_refused") - of(guard, "delivered")
            if left != of(guard, "discarded") + of(guard, "handshake"):
                yield "P6", log.end, "the guard of " + to
            if of(guard, "delivered") != of(to, {"received": at}):
                yield "P6", log.end, "out of the session and into the core of " + to
        if not killed & {frm, to, relay, "insider-b", "unit-c"}:
            out = of(relay, {"relay_out": other}) - of("campaign", {"relay_unsent": other})
            if to == "gateway":
                out += of(relay, "relay_stranger") + sum(c for (_, a), c in n.items() if a == '"sent_direct"')
            if out != of(guard, "datagrams") + of(guard, "unguarded") + of(guard, "kernel_dropped"):
                yield "P6", log.end, "datagrams between the relay and the guard of " + to


# Time after a touch in which one more, with the unit on its way off, is the object's pushing, us.
PUSHES = 2_000_000
# An undisturbed fix is never off by more than six deviations, 40 mm each on an axis.
NEAR = 240


def off_its_way(log, poses, place, since, t):
    """How far a place is from the way between the poses of that time, or from what the unit can have driven since the last fix."""
    at = [when for when, _, _ in poses]
    way = poses[max(0, bisect_right(at, since) - 1) : bisect_right(at, t)]
    if not way:
        return float("inf")
    place = (place["x_mm"], place["y_mm"])
    far = [math.dist(place, way[-1][2]) - log.bounds["max_speed_mm_s"] * (t - way[-1][1]) / 1e6]
    for (_, _, a), (_, _, b) in zip(way, way[1:]):
        leg = math.dist(a, b)
        dot = sum((p - q) * (r - q) for p, q, r in zip(place, a, b))
        share = min(1.0, max(0.0, dot / leg**2)) if leg else 0.0
        far.append(math.dist(place, [q + share * (r - q) for q, r in zip(a, b)]))
    return min(far)


def p7(log):
    limit = (log.bounds["freshness_ms"] + log.bounds["telemetry_period_ms"]) * 1000 + SLACK
    accepted = {}
    for e in log.of("accepted", by="gateway"):
        accepted[key_of_record(e["event"]["record"])] = e["t_us"]
    went_by = [(e["t_us"], e["event"]) for e in log.of("judged", by="unit-a")]
    times = [t for t, _ in went_by]
    minted = [(e["t_us"], e["event"]["track"]) for e in log.of("minted", by="unit-a")]
    poses = [
        (e["t_us"], e["t_us"] - (e["local_us"] - e["event"]["stamp"]), (e["event"]["pose_x_mm"], e["event"]["pose_y_mm"]))
        for e in log.of("located", by="unit-a")
    ]
    for e in log.of("displayed"):
        ev, t = e["event"], e["t_us"]
        if ev["freshness"] != "fresh":
            continue
        if t - accepted.get(key_of_record(ev["report"]), t) > limit:
            yield "P7", t, "old and shown fresh"
        if ev["unit"] != "unit-a":
            continue
        since = max(0, t - limit)
        if not log.was_in(ev["mode"], since, t):
            yield "P7", t, "a mode shown fresh that the unit was not in"
        held = any(
            track == ev["authority"] and max(at, since) <= min(until, t) and log.was_in("PREPARE_TO_ACT", max(at, since), min(until, t))
            for (at, track), until in zip(minted, [at for at, _ in minted[1:]] + [float("inf")])
        )
        other = any(log.was_in(m, since, t) for m in ("IDLE", "READY", "DEGRADED", "HOLD_SAFE"))
        if ev["authority"] is not None and not held or ev["authority"] is None and not other:
            yield "P7", t, "authority shown fresh that was not so"
        # What the unit went by at the beginning of that time, and every change within it.
        lately = [ev for _, ev in went_by[max(0, bisect_right(times, since) - 1) : bisect_right(times, t)]]
        if not any(sorted(was["failing"]) == sorted(ev["failing"]) for was in lately):
            yield "P7", t, "guards shown fresh as failing that were not so"
        if ev["place"] is not None:
            if not any(was["placed"] for was in lately):
                yield "P7", t, "a place shown fresh that was older at the unit"
            elif off_its_way(log, poses, ev["place"], since, t) > NEAR:
                yield "P7", t, "a place shown fresh where the unit did not take itself to be"
        if ev["tracks_fresh"] > max((was["tracks"] for was in lately), default=0):
            yield "P7", t, "more tracks shown fresh than the unit had"


def p8(log):
    limit = log.bounds["command_limit_ms"] * 1000 + SLACK
    given, done, tags = {}, set(), log.due()
    stores = {key(e["event"]["command"]): e["t_us"] for e in log.of("stored", by="unit-a")}
    voiding = [c[0] for c in log.changes()] + [at for at, _, kind in log.executed() if kind == "hold"]
    for t, k, _ in log.intents():
        given.setdefault(k, t)
    for t, k, kind in log.executed():
        if k in done:
            yield "P8", t, "executed twice"
        done.add(k)
        if k not in given:
            continue
        # The unit counts a time tag from a nonce that is older than the order, by the limit at most.
        after, within = tags.get(k, (0, limit - SLACK))
        if k in stores and towards_safe(kind):
            within = float("inf")  # made up for; P3 judges the delay
        if t - given[k] > after + within + SLACK:
            yield "P8", t, "executed late"
        stored = stores.get(k)
        if stored is not None and not towards_safe(kind) and any(stored < at < t - SLACK for at in voiding):
            yield "P8", t, "executed though the mode has changed or a hold has come since"
        if t - given[k] < after - limit:
            yield "P8", t, "executed before it was due"


def p9(log):
    intents = {(k, json.dumps(kind, sort_keys=True)): t for t, k, kind in reversed(log.intents())}
    orders = [(t, kind_name(kind)) for t, k, kind in log.executed() if intents.get((k, json.dumps(kind, sort_keys=True)), float("inf")) <= t]

    def by(kind, t):
        return any(k == kind and abs(at - t) <= 2 * SLACK for at, k in orders)

    degraded = 0
    for t, frm, to, cause in log.changes():
        if frm == "HOLD_SAFE" and to != frm and cause != "start" and not (cause == "operator" and by("resume", t)):
            yield "P9", t, "HOLD_SAFE left by itself"
        if frm == "IDLE" and to not in ("IDLE", "HOLD_SAFE") and not (cause == "operator" and by("enable", t)):
            yield "P9", t, "IDLE left by itself"
        if to == "PREPARE_TO_ACT" and not (cause == "operator" and by("arm", t)):
            yield "P9", t, "armed by itself"
        if cause == "recovered" and t - degraded < log.bounds["hysteresis_ms"] * 1000 - SLACK:
            yield "P9", t, "recovered too soon"
        if to == "DEGRADED":
            degraded = t


def p10(log):
    if log.head["broken_log"]:
        yield "P10", log.end, log.head["broken_log"]
    # Of a live run: what a core did otherwise when it was fed its mouth log again.
    for difference in log.head.get("differences", []):
        yield "P10", log.end, difference
    stalls = [e["event"]["by"] for e in log.of("stalled")]
    if stalls and max(stalls) > log.head["stall_limit_us"]:
        yield "P10", log.end, "the host overslept"
    # Of each life's chain no entry may be missing, whatever the chain's own hashes say.
    last = {}
    for e in sorted(log.events, key=lambda e: (e["node"], e["boot"], e["counter"])):
        life = (e["node"], e["boot"])
        if e["counter"] != last.get(life, 0) + 1:
            yield "P10", e["t_us"], "entries of %s are missing or double" % e["node"]
            return
        last[life] = e["counter"]
