"""Receipts: a fault counts when two say so, its actor and an observer at the target that is another process.

Links are `links`' to look at, insiders `insiders`', what kept an injection from arriving `masked`'s; readings that a fault changed and
processes that end or do not run are looked at here.
"""

from disguise import disguise, perturbed, printed
from insiders import SENDERS, broker, feed, late, mouthed, rogue, swallowed, takeover
from links import DATAGRAM, datagram, stream
from log import IMAGING, planned, within
from masked import masked

EARLY, LATE = 5_000, 100_000  # by how much an actor may be before or behind its window
LAST_WORDS = 100_000  # how long what a process had said may still be on its way into the log
UNDER_WAY = 20_000  # how long after a process is stopped a mark of it may still be made
AROUND = 1_000_000  # how far around its stops a process is looked at for how often it leaves a mark
TELLING = 3  # so many marks have to be missing for a silence to say something


def receipts(log, faults):
    """Whether something that was planned provably happened and each thing that did not was provably kept from it, when the first did, and
    what there is no rule for."""
    whole, zeros, unknown, kept = True, [], set(), False
    for plan in log.head["planned"]:
        what, value = planned(plan)
        if what == "step":
            # That a step began is its actor's word; what it did has a receipt of its own.
            whole &= any(e["event"]["step"] == value and e["event"]["begun"] for e in log.of("step"))
            continue
        # The broker writes next to nothing: that it was gone is told by streams, for which there is no rule.
        if what not in RULES or what in ("kill", "suspend") and value == "broker":
            unknown.add("%s:%s" % (what, value))
            continue
        span = window(log, plan)
        at = RULES[what](log, faults, value, span) if span is not None else None
        if at is not None:
            zeros.append(at)
        elif span is not None and masked(log, plan, (span[0] + EARLY, span[1] - LATE), span, faults):
            kept = True
        else:
            whole = False
    # Where everything was kept from happening nothing was done.
    return whole and not (kept and not zeros), min(zeros) if zeros else None, unknown


def acted(log, faults, action, span):
    """An action is the relay's, or of the insiders who can do it."""
    return datagram(log, action, span) if action in DATAGRAM else mouthed(log, action, SENDERS[action], span)


def window(log, plan):
    """When it may have been done; none where the step that it belongs to never began."""
    if plan["step"] is None:
        return plan["from"] - EARLY, plan["until"] + LATE
    steps = [(e["t_us"], e["event"]["begun"]) for e in log.of("step") if e["event"]["step"] == plan["step"]]
    begun = [t for t, on in steps if on]
    ended = [t for t, on in steps if not on]
    if not begun:
        return None
    return begun[0] - EARLY, (ended[-1] if ended else float("inf")) + LATE


def sensor_faults(log):
    """Faults that the sim applied, and of which the consumer took in, to the last byte, a message that they changed: (sensor, kind, from,
    to)."""
    found = []
    took = {}
    for e in log.of("mouth_saw", by="campaign"):
        took.setdefault((e["event"]["reader"], e["event"]["hash"]), []).append(e["t_us"])
    applied = [(e["t_us"], e["event"]) for e in log.of("fault", by="sim")]
    for t, ev in applied:
        if not ev["active"]:
            continue
        sensor, kind = ev["sensor"], ev["kind"]
        over = (at for at, f in applied if at >= t and not f["active"] and (f["sensor"], f["kind"]) == (sensor, kind))
        end = next(over, log.end)
        reader = "perception" if sensor in IMAGING else "unit-a"
        changed = [e for e in log.of("altered", by="sim") if (e["event"]["sensor"], e["event"]["kind"]) == (sensor, kind)]
        changed = [(e["t_us"], e["event"]["hash"]) for e in changed if t <= e["t_us"] <= end]
        if any(at >= told for told, payload in changed for at in took.get((reader, payload), [])):
            found.append((sensor, kind, t, end))
    return found


def killed(log, node, span):
    """A kill counts when the dead said nothing more; who is started again speaks under another boot."""
    for e in log.of("ended"):
        t = e["t_us"]
        if e["event"]["node"] != node or not e["event"]["killed"] or not within(span, t):
            continue
        boots = [w["boot"] for w in log.events if w["node"] == node and w["t_us"] <= t]
        spoke = any(w["node"] == node and w["t_us"] > t + LAST_WORDS and boots and w["boot"] == boots[-1] for w in log.events)
        if not spoke:
            return t
    return None


def suspended(log, node, span):
    """A process that was kept from running left marks before and after and none meanwhile, and would have left some: what it
    writes, and what its core is fed."""
    begun = [t for t in log.turned("suspended", node, True) if within(span, t)]
    if not begun:
        return None
    over = log.turned("suspended", node, False, begun[0] + 1)
    died = next((start for start, _ in log.dead(node) if start > begun[0]), float("inf"))
    until = min(over[0] if over else log.end, log.end, died)
    hung = any(e["t_us"] == begun[0] and e["event"]["node"] == node and e["event"]["how"] == "hang" for e in log.of("suspended"))
    stops = [(begun[0], until)] if hung else halts(log, node, begun[0], until)
    if not stops:
        return None
    first, last = stops[0][0], stops[-1][1]
    own = [e["t_us"] for e in log.events if e["node"] == node and e["event"]["is"] != "ran"]
    fed = [e["t_us"] for e in log.of("ran", by="campaign") if e["event"]["node"] == node]
    marks = sorted(t for t in own + fed if max(0, first - AROUND) <= t <= last + AROUND)
    silent = sum(max(0, end - start - UNDER_WAY) for start, end in stops)
    ran = max(1, last + AROUND - max(0, first - AROUND) - silent)
    # Who was ended while stopped leaves no mark after.
    lived = bool(marks) and marks[0] <= first and (last == died or marks[-1] >= last)
    spoke = any(start + UNDER_WAY < t < end for t in marks for start, end in stops)
    return begun[0] if lived and not spoke and len(marks) * silent // ran >= TELLING else None


def guest_bus(log, attack, span):
    """The first step in which an attack on the guest's bus reached the attacked end, or was refused there."""
    for e in log.of("guest_bus", by="campaign"):
        ev, t = e["event"], e["t_us"]
        if ev["attack"] == attack and within(span, t) and ev["sent"] > 0 and (ev["received"] > 0 or ev["refused"]):
            return t
    return None


def halts(log, node, since, until):
    """The stops of a slow process."""
    stops = []
    for start in log.turned("halted", node, True, since):
        if start <= until:
            stops.append((start, min(log.turned("halted", node, False, start) + [until])))
    return stops


def filled(log, node, span):
    """A disk was full when the recording, looked at from outside, grew before and not from then on although others had
    something to write; and grew again where there was room again."""
    full = [t for t in log.turned("disk_full", node, True) if within(span, t)]
    if not full:
        return None
    start = full[0]
    freed = [t for t in log.turned("disk_full", node, False, start) if t < log.end]
    end = freed[0] if freed else log.end
    quiet = start + LAST_WORDS

    def grew(since, until):
        return any(since < e["t_us"] < until for e in log.of("kept", by="campaign"))

    # The launcher's word, the guards' and the mouths' are not the recorder's to write.
    others = [e for e in log.events if quiet < e["t_us"] < end and e["node"] not in (node, "campaign") and not e["node"].startswith("guard-")]
    whole = not freed or grew(end, end + AROUND)
    return start if grew(start - AROUND, start) and len(others) >= TELLING and not grew(quiet, end) and whole else None


# By the name of what was planned: (log, faults, value, span) to when it first provably happened.
RULES = {
    "action": acted,
    "malformed": lambda log, faults, value, span: mouthed(log, "inject", ("insider-b",), span),
    "stream": lambda log, faults, deed, span: stream(log, deed, span),
    "broker": lambda log, faults, action, span: broker(log, action, span),
    "feed": lambda log, faults, action, span: feed(log, action, span),
    "late": lambda log, faults, by, span: late(log, by, span),
    "swallowed": lambda log, faults, value, span: swallowed(log, span),
    "guest_bus": lambda log, faults, attack, span: guest_bus(log, attack, span),
    "rogue": lambda log, faults, value, span: rogue(log, span),
    "takeover": lambda log, faults, peer, span: takeover(log, peer, span),
    "disguise": lambda log, faults, of, span: disguise(log, of, span),
    "print": lambda log, faults, of, span: printed(log, of, span),
    "perturbation": lambda log, faults, aim, span: perturbed(log, aim, span),
    "kill": lambda log, faults, node, span: killed(log, node, span),
    "suspend": lambda log, faults, node, span: suspended(log, node, span),
    "fill": lambda log, faults, node, span: filled(log, node, span),
    "fault": lambda log, faults, of, span: next((f[2] for f in faults if f[:2] == tuple(of) and within(span, f[2])), None),
}
