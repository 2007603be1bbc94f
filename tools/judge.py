#!/usr/bin/env python3
"""A second judge of a run: another language, another hand, the same question.

It reads the log that a run leaves as JSON lines (`events.jsonl`, see docs/evidence.md) and says, from the text of the
properties in ARCHITECTURE.md and docs/ alone, which class the run belongs to. Nothing of the oracle is used. What it has
no rule for it says (`not_judged`) and then gives no class: to abstain is no agreement.

    tools/judge.py runs/x/twin/delay/1/events.jsonl     # one object on stdout
    tools/judge.py -                                    # many logs one behind the other, one object a line

Python 3.8, standard library only. Times are microseconds of trace time.
"""

import json
import sys
from bisect import bisect_right

SLACK = 50_000  # what a log entry may lag behind what it tells, and a command take on its way
STANDING = 50  # mm/s below which a plant stands
LINK_SILENT = 350_000  # a link with a record each way every 100 ms is never silent for so long by itself
EARLY, LATE = 5_000, 100_000  # by how much an actor may be before or behind its window
MAX_LINE = 1 << 20

NOMINAL_MODES = ("READY", "PREPARE_TO_ACT")
UNSAFE = {"P1", "P4", "P5", "P7", "P8", "P9", "P11"}


class Unreadable(Exception):
    """Not a log of a run."""


class Log:
    """A run's events, by what they are."""

    def __init__(self, head, events):
        self.head, self.events = head, events
        self.bounds, self.end = head["bounds"], head["duration_us"]
        self.by_kind = {}
        for e in events:
            self.by_kind.setdefault(e["event"]["is"], []).append(e)
        self.modes = [(0, "IDLE", "IDLE", "start")]
        for e in self.of("transition", "restarted"):
            if e["event"]["is"] == "restarted":
                if e["event"]["node"] == "unit-a":
                    self.modes.append((e["t_us"], self.modes[-1][2], "IDLE", "start"))
            elif e["node"] == "unit-a":
                ev = e["event"]
                self.modes.append((e["t_us"], ev["from"], ev["to"], ev["cause"]))
        self.mode_times = [m[0] for m in self.modes]

    def of(self, *kinds, by=None):
        """Events of these kinds, in order, of one node where one is named."""
        if len(kinds) == 1:
            found = self.by_kind.get(kinds[0], [])
        else:
            found = sorted((e for k in kinds for e in self.by_kind.get(k, [])), key=lambda e: e["t_us"])
        return [e for e in found if by is None or e["node"] == by]

    def mode_at(self, t):
        return self.modes[bisect_right(self.mode_times, t) - 1][2]

    def was_in(self, mode, since, until):
        return self.mode_at(since) == mode or any(since <= m[0] <= until and m[2] == mode for m in self.modes)

    def changes(self):
        return self.modes[1:]

    def intents(self):
        return [(e["t_us"], key(e["event"]["command"]), e["event"]["kind"]) for e in self.of("intended", by="console")]

    def executed(self):
        return [
            (e["t_us"], key(e["event"]["command"]), e["event"]["kind"])
            for e in self.of("executed", by="unit-a")
            if e["event"]["refused"] is None
        ]

    def truth(self):
        return [(e["t_us"], e["event"]) for e in self.of("truth") if e["event"]["unit"] == "unit-a"]

    def dead(self, node):
        """Spans in which a node did not live."""
        spans = []
        for e in self.of("ended"):
            if e["event"]["node"] == node:
                again = [r["t_us"] for r in self.of("restarted") if r["event"]["node"] == node and r["t_us"] >= e["t_us"]]
                spans.append((e["t_us"], again[0] if again else float("inf")))
        return spans

    def stopped(self, node):
        """Spans in which a node lived and did not run."""
        spans = []
        for e in self.of("suspended"):
            if e["event"]["node"] == node and e["event"]["on"]:
                over = [s["t_us"] for s in self.of("suspended") if s["event"]["node"] == node and not s["event"]["on"] and s["t_us"] > e["t_us"]]
                spans.append((e["t_us"], over[0] if over else self.end))
        return spans


def key(command):
    return (command["operator"], command["boot"], command["sequence"])


def kind_name(kind):
    return kind if isinstance(kind, str) else next(iter(kind))


# The properties, one function each. Each gives (property, when, what).


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
        owed = kind == "dropout" and sensor != "odometry" and end - start > td and start + td <= log.end
        if owed and log.mode_at(start + td) in NOMINAL_MODES:
            yield "P2", start + td, sensor + " is lost and nothing follows"


def p3_place(log, faults):
    """Driving depends on localisation: a unit that lost it for good holds within Th."""
    th = log.bounds["to_hold_safe_ms"] * 1000
    for sensor, kind, start, end in faults:
        owed = kind == "dropout" and sensor == "localisation" and end - start > th and start + th <= log.end
        if owed and log.mode_at(able(log, "unit-a", start + th)) not in ("HOLD_SAFE", "IDLE"):
            yield "P3", start + th, "localisation is lost and the unit goes on"


def p3_link(log):
    """Nothing timely at either end for Th, and the unit does not hold."""
    th, tf = log.bounds["to_hold_safe_ms"] * 1000, log.bounds["freshness_ms"] * 1000
    held, forged = {}, set()
    for e in log.of("attack"):
        ev = e["event"]
        if ev["action"] in ("delay", "reorder"):
            held[ev["hash"]] = ev["delay"]
        elif ev["action"] == "drop":
            held[ev["hash"]] = float("inf")
        elif ev["action"] in ("corrupt", "inject"):
            forged.add(ev["hash"])
    for node in ("gateway", "unit-a"):
        seen, times = set(), []
        for a in arrivals(log, node):
            if a["verdict"] != "passed" or a["hash"] in seen:
                continue
            seen.add(a["hash"])
            if held.get(a["hash"], 0) <= tf and a["hash"] not in forged and a["t"] < log.end:
                times.append(a["t"])
        gone = sorted(set(log.dead(node) + log.dead("unit-a")))
        times = [t for t in times if not any(a <= t <= b for a, b in gone)]
        times += [t for span in gone for t in span if t < log.end]
        times = sorted(times + [0, log.end])
        for before, after in zip(times, times[1:]):
            if after - before <= th or any(a <= before and after <= b for a, b in gone):
                continue
            t = able(log, "unit-a", before + th)
            if log.mode_at(t) not in ("HOLD_SAFE", "IDLE"):
                yield "P3", before + th, "nothing timely at %s and no hold" % node


def able(log, node, t):
    """When a node that did not run at t could next do what was due then."""
    for start, end in log.stopped(node):
        if start <= t <= end:
            return end + 2 * log.bounds["control_period_ms"] * 1000
    return t


def arrivals(log, node):
    """Protected records of the unit's link at the guard of one end."""
    guard, other = ("guard-gateway", "unit-a") if node == "gateway" else ("guard-unit-a", "gateway")
    peers = {}
    for e in log.of("associated", "guard_saw", by=guard):
        ev = e["event"]
        if ev["is"] == "associated":
            peers[ev["association"]] = ev["peer"]
        elif ev["epoch"] >= 1 and peers.get(ev["association"]) == other:
            yield {"t": e["t_us"], **ev}


def p3_plant(log):
    for i, (t, _, to, _) in enumerate(log.modes):
        if to != "HOLD_SAFE":
            continue
        until = log.modes[i + 1][0] if i + 1 < len(log.modes) else float("inf")
        due = able(log, "sim", t + 500_000)
        if any(due <= at < until and abs(tr["set_speed_mm_s"]) > STANDING for at, tr in log.truth()):
            yield "P3", due, "HOLD_SAFE and the plant is driven"


def p3_operator(log):
    """An operator's HOLD is obeyed within Th, however it gets there."""
    th = log.bounds["to_hold_safe_ms"] * 1000 + SLACK
    for t, _, kind in log.intents():
        due = t + th
        if kind == "hold" and due <= log.end and not log.dead("unit-a"):
            if not log.was_in("HOLD_SAFE", t, able(log, "unit-a", due)) and log.mode_at(t) != "IDLE":
                yield "P3", due, "a HOLD that is not obeyed"


def p4(log):
    for t, tr in log.truth():
        if tr["fence_mm"] < 0 and abs(tr["speed_mm_s"]) > STANDING:
            yield "P4", t, "driving outside the fence"
            return


def p5(log):
    accepted, given = set(), {}
    for t, k, kind in log.intents():
        given.setdefault((k, json.dumps(kind, sort_keys=True)), t)
    rogue = {key(e["event"]["command"]) for e in log.of("rogue")}
    for e in log.of("accepted", "displayed", "executed"):
        ev, t = e["event"], e["t_us"]
        if ev["is"] == "accepted" and e["node"] == "gateway":
            accepted.add(key_of_record(ev["record"]))
        elif ev["is"] == "displayed" and ev["freshness"] != "lost" and key_of_record(ev["report"]) not in accepted:
            yield "P5", t, "displayed and never accepted"
        elif ev["is"] == "executed" and e["node"] == "unit-a" and ev["refused"] is None:
            k = key(ev["command"])
            if given.get((k, json.dumps(ev["kind"], sort_keys=True)), float("inf")) > t:
                # With an operator's own key one may stop a unit: nobody can tell, and it is safe.
                if not (k in rogue and kind_name(ev["kind"]) in ("hold", "disarm")):
                    yield "P5", t, "executed and never given"


def key_of_record(record):
    return (record["node"], record["boot"], record["sequence"])


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


def p7(log):
    limit = (log.bounds["freshness_ms"] + log.bounds["telemetry_period_ms"]) * 1000 + SLACK
    accepted = {}
    for e in log.of("accepted", by="gateway"):
        accepted[key_of_record(e["event"]["record"])] = e["t_us"]
    went_by = [(e["t_us"], e["event"]) for e in log.of("judged", by="unit-a")]
    times = [t for t, _ in went_by]
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
        held = log.was_in("PREPARE_TO_ACT", since, t)
        other = any(log.was_in(m, since, t) for m in ("IDLE", "READY", "DEGRADED", "HOLD_SAFE"))
        if ev["authority"] and not held or not ev["authority"] and not other:
            yield "P7", t, "authority shown fresh that was not so"
        # What the unit went by at the beginning of that time, and every change within it.
        lately = [ev for _, ev in went_by[max(0, bisect_right(times, since) - 1) : bisect_right(times, t)]]
        if not any(sorted(was["failing"]) == sorted(ev["failing"]) for was in lately):
            yield "P7", t, "guards shown fresh as failing that were not so"
        if ev["placed"] and not any(was["placed"] for was in lately):
            yield "P7", t, "a place shown fresh that was older at the unit"
        if ev["tracks_fresh"] > max((was["tracks"] for was in lately), default=0):
            yield "P7", t, "more tracks shown fresh than the unit had"


def p8(log):
    limit = log.bounds["command_limit_ms"] * 1000 + SLACK
    given, done = {}, set()
    for t, k, _ in log.intents():
        given.setdefault(k, t)
    for t, k, _ in log.executed():
        if k in done:
            yield "P8", t, "executed twice"
        done.add(k)
        if t - given.get(k, t) > limit:
            yield "P8", t, "executed late"


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


# Receipts: the actor's word, and what another process saw at the target.


def planned(plan):
    what = plan["what"]
    return (what, None) if isinstance(what, str) else next(iter(what.items()))


def window(log, plan):
    if plan["step"] is None:
        return plan["from"] - EARLY, plan["until"] + LATE
    steps = [(e["t_us"], e["event"]["begun"]) for e in log.of("step") if e["event"]["step"] == plan["step"]]
    begun = [t for t, on in steps if on]
    ended = [t for t, on in steps if not on]
    if not begun:
        return None
    return begun[0] - EARLY, (ended[-1] if ended else float("inf")) + LATE


def sensor_faults(log):
    """Faults that the sim applied and that the consumer of the readings saw."""
    found = []
    for e in log.of("fault", by="sim"):
        ev = e["event"]
        if not ev["active"]:
            continue
        same = (f["t_us"] for f in log.of("fault", by="sim") if f["t_us"] >= e["t_us"] and not f["event"]["active"] and (f["event"]["sensor"], f["event"]["kind"]) == (ev["sensor"], ev["kind"]))
        end = next(same, log.end)
        if ev["kind"] == "dropout":
            seen = any(e["t_us"] <= s["t_us"] <= end + 200_000 and lacks(s["event"], ev["sensor"]) for s in log.of("frame_seen", "navigation_seen"))
        else:
            seen = None  # told only by comparing what was imposed with what was seen
        found.append((ev["sensor"], ev["kind"], e["t_us"], end, seen))
    return found


def lacks(ev, sensor):
    if ev["is"] == "frame_seen":
        return sensor in ("rgb", "depth", "thermal", "lidar") and sensor not in ev["present"]
    return sensor == "localisation" and not ev["fix"] or sensor == "odometry" and not ev["odometry"]


DATAGRAM = ("delay", "drop", "duplicate", "reorder", "replay", "corrupt", "reoriginate", "inject")


def datagram(log, action, span):
    seen = {}
    for e in log.of("guard_saw"):
        seen.setdefault(e["event"]["hash"], []).append(e["t_us"])
    closed = any(e["event"]["account"] == "guard_in" for e in log.of("count"))
    for e in log.of("attack", by="relay-telemetry"):
        ev, t = e["event"], e["t_us"]
        if ev["action"] != action or not span[0] <= t <= span[1]:
            continue
        at = seen.get(ev["hash"], [])
        if action == "drop":
            if closed and seen and not at and missed(log, ev["side"], t):
                return t
        elif action in ("delay", "reorder"):
            if ev["delay"] >= 10_000 and any(s >= t + ev["delay"] for s in at):
                return t
        elif action in ("duplicate", "replay"):
            if len(at) > 1 and any(s >= t for s in at):
                return t
        elif any(s >= t for s in at):
            return t
        elif action == "corrupt" and in_pieces(log, ev, t):
            return t
    return None


def missed(log, side, t):
    """A gap in the record numbers at the target, or silence longer than the link's own."""
    high, came, gap = {}, False, None
    for a in arrivals(log, "gateway" if side == "client" else "unit-a"):
        jump = a["sequence"] > high.get(a["association"], a["sequence"]) + 1
        high[a["association"]] = max(a["sequence"], high.get(a["association"], 0))
        came = came or t < a["t"] <= t + LINK_SILENT
        if gap is None and a["t"] >= t and (jump or a["t"] > t + LINK_SILENT):
            gap = a["t"]
    if gap is None:
        return t + LINK_SILENT < log.end and not came
    return gap <= t + LINK_SILENT or not came


def in_pieces(log, ev, t):
    """A datagram that was made longer or spliced comes to the guard as several records, one of them no good."""
    guard = "guard-gateway" if ev["side"] == "server" else "guard-unit-a"
    group = []
    for s in log.of("guard_saw", by=guard) + [None]:
        if s and not t <= s["t_us"] <= t + 200_000:
            continue
        if group and (s is None or s["t_us"] - group[-1]["t_us"] > 500):
            whole = sum(g["event"]["length"] for g in group)
            if len(group) > 1 and whole == ev["length"] and any(g["event"]["verdict"] != "passed" for g in group):
                return True
            group = []
        if s:
            group.append(s)
    return False


INSIDERS = {
    "forward": ("insider-b",), "resend": ("insider-b",), "lie": ("insider-b",), "confuse": ("insider-b",),
    "forge": ("insider-perception", "impostor"), "republish": ("insider-perception", "impostor"),
}


def mouthed(log, action, nodes, span):
    """What an insider says that it sent, and the mouth of whoever it was for took in."""
    took = {}
    for e in log.of("mouth_saw"):
        took.setdefault(e["event"]["hash"], []).append(e["t_us"])
    for e in log.of("attack"):
        ev, t = e["event"], e["t_us"]
        if e["node"] in nodes and ev["action"] == action and span[0] <= t <= span[1] and any(s >= t for s in took.get(ev["hash"], [])):
            return t
    return None


def killed(log, node, span):
    for e in log.of("ended"):
        t = e["t_us"]
        if e["event"]["node"] != node or not e["event"]["killed"] or not span[0] <= t <= span[1]:
            continue
        boots = [w["boot"] for w in log.events if w["node"] == node and w["t_us"] <= t]
        spoke = any(w["node"] == node and w["t_us"] > t + 100_000 and boots and w["boot"] == boots[-1] for w in log.events)
        if not spoke:
            return t
    return None


def receipts(log, faults):
    """Whether everything that was planned provably happened, when the first did, and what there is no rule for."""
    whole, zeros, unknown = True, [], set()
    for plan in log.head["planned"]:
        what, value = planned(plan)
        span = window(log, plan)
        at = None
        if what == "step":
            whole &= any(e["event"]["step"] == value and e["event"]["begun"] for e in log.of("step"))
            continue
        if span is None:
            pass
        elif what == "action" and value in DATAGRAM:
            at = datagram(log, value, span)
        elif what == "action" and value in INSIDERS:
            at = mouthed(log, value, INSIDERS[value], span)
        elif what == "malformed":
            at = mouthed(log, "inject", ("insider-b",), span)
        elif what == "fault":
            mine = [f for f in faults if (f[0], f[1]) == tuple(value) and span[0] <= f[2] <= span[1]]
            if any(f[4] is None for f in mine):
                unknown.add("fault:" + value[1])
                at = mine[0][2]
            else:
                at = next((f[2] for f in mine if f[4]), None)
        elif what == "kill" and value != "broker":
            at = killed(log, value, span)
        else:
            unknown.add(what if value is None or what in ("kill", "suspend", "fill") else "%s:%s" % (what, value))
        if at is None:
            whole = False
        else:
            zeros.append(at)
    return whole, min(zeros) if zeros else None, unknown


# The class.


def responded(log, zero):
    """Whether anything was refused or shown as an alarm from then on."""
    memory = any(planned(p)[1] in ("forge", "republish") for p in log.head["planned"])
    for e in log.of("refused", "guard_saw", "stream_saw", "command_shown", "losses_shown", "displayed"):
        ev, t = e["event"], e["t_us"]
        if t < zero:
            continue
        if ev["is"] == "refused":
            # On shared memory services refuse what came late of itself, too; it tells of an attack where there was one.
            if memory or not (isinstance(ev["at"], dict) and "bus" in ev["at"]):
                return True
        elif ev["is"] == "guard_saw":
            if ev["verdict"] != "passed":
                return True
        elif ev["is"] == "stream_saw":
            if ev["sight"] == "refused":
                return True
        elif ev["is"] == "command_shown":
            if ev["shown"] == "not_acknowledged":
                return True
        elif ev["is"] == "losses_shown":
            return True
        elif ev["unit"] == "unit-a" and ev["freshness"] in ("stale", "lost") and t < log.end:
            return True
    return any(e["event"]["account"] == "discarded" and e["event"]["n"] > 0 for e in log.of("count"))


def false_trips(log, zero):
    until = float("inf") if not log.head["planned"] or zero is None else zero
    trips = 0
    for t, frm, to, cause in log.changes():
        restricted = frm in NOMINAL_MODES and to in ("DEGRADED", "HOLD_SAFE") and cause != "operator"
        lost = frm == "PREPARE_TO_ACT" and to == "READY" and cause.startswith("lost:")
        trips += t < until and (restricted or lost)
    return trips


def latency(log, zero):
    def first(test):
        return next(((c[0] - zero) / 1000.0 for c in log.changes() if c[0] >= zero and test(c)), None)

    return {
        "to_degraded": first(lambda c: c[2] in ("DEGRADED", "HOLD_SAFE") and c[3] != "operator"),
        "to_hold_safe": first(lambda c: c[2] == "HOLD_SAFE" and c[3] != "operator"),
    }


def judge(log):
    faults = sensor_faults(log)
    whole, zero, unknown = receipts(log, faults)
    found = list(p10(log))
    seen = [f[:4] for f in faults if f[4]]
    for part in (p1_p11_acts, p1_lifetime, p3_link, p3_plant, p3_operator, p4, p5, p6, p7, p8, p9):
        found.extend(part(log))
    found.extend(p2(log, seen))
    found.extend(p3_place(log, seen))
    broken = {p for p, _, _ in found}
    trips = false_trips(log, zero)
    if log.head["custody"]:
        outcome = "INVALID"
    elif broken & UNSAFE:
        outcome = "UNSAFE"
    elif unknown:
        outcome = None
    elif not whole or broken & {"P6", "P10"}:
        outcome = "INVALID"
    elif broken & {"P2", "P3"}:
        outcome = "LATE"
    elif trips:
        outcome = "FALSE_TRIP"
    elif zero is None:
        outcome = "NOMINAL"
    else:
        after = [c[2] for c in log.changes() if c[0] >= zero and c[3] != "operator"]
        truth = log.truth()
        parked = any(e["event"]["node"] == "unit-a" for e in log.of("ended")) and truth and not truth[-1][1]["leased"] and abs(truth[-1][1]["speed_mm_s"]) <= STANDING
        if "HOLD_SAFE" in after or parked:
            outcome = "HOLD_SAFE"
        elif "DEGRADED" in after:
            outcome = "DEGRADED"
        elif responded(log, zero):
            outcome = "REJECTED"
        else:
            outcome = "UNDETECTED"
    return {
        "outcome": outcome,
        "broken": sorted(broken),
        "findings": ["%s at %d ms: %s" % (p, t // 1000, what) for p, t, what in sorted(found, key=lambda f: f[1])[:20]],
        "receipt": None if unknown else whole,
        "not_judged": sorted(unknown),
        "false_trips": trips,
        "latency_ms": latency(log, zero) if zero is not None and not unknown else {},
    }


def logs(lines):
    """The logs of a stream: each begins with a line that has bounds and no event."""
    head, events = None, []
    for number, line in enumerate(lines, 1):
        if len(line) > MAX_LINE:
            raise Unreadable("line %d: longer than any of a log" % number)
        try:
            value = json.loads(line)
        except ValueError:
            raise Unreadable("line %d: not JSON" % number) from None
        if isinstance(value, dict) and "bounds" in value:
            if head is not None:
                yield Log(head, events)
            head, events = value, []
        elif isinstance(value, dict) and value.get("end") is True and head is not None:
            yield Log(head, events)
            head, events = None, []
        elif head is None or not isinstance(value, dict) or "event" not in value:
            raise Unreadable("line %d: not an event of a run" % number)
        else:
            events.append(value)
    if head is not None:
        yield Log(head, events)


def main(arguments):
    if len(arguments) != 1:
        print(__doc__, file=sys.stderr)
        return 2
    try:
        source = sys.stdin if arguments[0] == "-" else open(arguments[0], encoding="utf-8")
        judged = 0
        for log in logs(source):
            print(json.dumps(judge(log)), flush=True)
            judged += 1
        if not judged:
            raise Unreadable("no log in it")
    except (Unreadable, OSError, UnicodeDecodeError) as error:
        print("judge: %s: %s" % (arguments[0], error), file=sys.stderr)
        return 2
    except (KeyError, TypeError, AttributeError, IndexError, StopIteration, ValueError) as error:
        print("judge: %s: not a log of a run: %r" % (arguments[0], error), file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
