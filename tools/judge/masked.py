"""What kept an injection from happening, where two did not see it: no actor's word counts for that.

That a process was gone is the launcher's word and its own silence. That there was nothing to take hold of is told by whoever would have
sent it, or by guards; that there was no link, by the plan of contacts and the silence at its ends. That a fault was hidden by another is told by the other's receipt.
"""

from links import DATAGRAM, LINK_SILENT, arrivals, datagram, gaps
from log import key, planned, within

AT_MOST = 200_000  # what is kept from it begins within so long of its time, which is too short to have done anything
UNDER_WAY = 50_000  # how long something may have been under way to the actor when its time began
LAST_WORDS = 100_000  # how long what a process had said may still be on its way into the log
EARLY, LATE = 5_000, 100_000  # by how much a deed may be told before or behind its time


def masked(log, plan, span, window, faults):
    """Whether something kept `plan` from happening all through its time."""
    what, value = planned(plan)
    span = (max(0, span[0]), max(span[0], min(span[1], log.end)))
    if out_of_contact(log, what, value, span) or gone(log, what, value, plan["needs"]["running"], span):
        return True
    takes = plan["needs"]["takes"]
    if takes is not None and not claimed(log, what, value, window):
        if nothing(log, takes, span):
            return True
    return what == "fault" and any(
        f[0] == value[0] and f[1] != value[1] and f[1] in ("dropout", "freeze") and covers(f[2:4], span) for f in faults
    )


def out_of_contact(log, what, value, span):
    """Whether the plan of contacts had no link for all that time, and nothing came to its ends."""
    if not (what in ("stream", "broker") or what == "action" and value in DATAGRAM):
        return False
    if not any(covers(gap, span) for gap in gaps(log)):
        return False
    if any(within(span, a["t"]) for node in ("gateway", "unit-a") for a in arrivals(log, node)):
        return False
    return not any(within(span, e["t_us"]) for e in log.of("stream_saw") if e["event"]["sight"] in ("arrived", "delivered"))


def covers(of, span):
    return of[0] <= span[0] + min(AT_MOST, (span[1] - span[0]) // 2) and of[1] >= span[1]


def gone(log, what, value, nodes, span):
    """Whether these, one after the other, did not run for all that time; what a kill or a stop did itself kept it from nothing."""
    spans = []
    for node in nodes:
        if what == "suspend" and value == node:
            spans += ended(log, node)
        elif what == "kill" and value == node:
            spans += [s for s in ended(log, node) if s[0] + UNDER_WAY <= span[0]]
        else:
            spans += away(log, node)
    spans.sort()
    for i, (start, end) in enumerate(spans):
        for since, until in spans[i:]:
            if since <= end:
                end = max(end, until)
        if covers((start, end), span):
            return True
    return False


def ended(log, node):
    """Spans in which a process did not live, by the launcher's word and its own silence."""
    return [s for s in log.dead(node) if silent(log, node, s)]


def away(log, node):
    """The same, or in which it hung."""
    spans = []
    for e in log.of("suspended", by="campaign"):
        if e["event"]["node"] == node and e["event"]["on"] and e["event"]["how"] == "hang":
            over = [t for t in log.turned("suspended", node, False, e["t_us"]) if t > e["t_us"]]
            spans.append((e["t_us"], over[0] if over else log.end))
    return ended(log, node) + [s for s in spans if silent(log, node, s)]


def silent(log, node, span):
    """No mark of it: its own entries, what its core was fed, and of the broker what came out of it at clients' mouths."""
    since, until = span[0] + LAST_WORDS, min(span[1], log.end)
    for e in log.events:
        if not since < e["t_us"] < until:
            continue
        ev = e["event"]
        if ev["is"] == "ran":
            if ev["node"] == node and e["node"] == "campaign":
                return False
        elif e["node"] == node:
            return False
        elif node == "broker" and ev["is"] == "stream_saw" and ev["sight"] == "delivered":
            return False
    return True


def claimed(log, what, value, window):
    """Whether the actor says that it took hold of something."""
    dropped = {e["event"]["hash"]: e["t_us"] for e in log.of("attack", by="relay-telemetry") if e["event"]["action"] == "drop"}
    for e in log.of("attack", "tampered", "withheld", "swallowed"):
        ev, node = e["event"], e["node"]
        if not within(window, e["t_us"]):
            continue
        if what == "action" and ev["is"] == "attack" and node == "relay-telemetry" and ev["action"] == value:
            if dropped.get(ev["hash"], -1) < e["t_us"]:
                return True
        elif what == "stream" and ev["is"] == "tampered" and node == "relay-command" and ev["deed"] == value:
            return True
        elif what == "broker" and ev["is"] == "attack" and node == "insider-broker" and ev["action"] == value:
            return True
        elif what in ("feed", "late") and ev["is"] == "withheld" and node == "insider-gateway":
            return True
        elif what == "swallowed" and ev["is"] == "swallowed" and node == "insider-gateway":
            return True
    return False


def nothing(log, takes, span):
    """Whether there was nothing to take hold of."""
    since = (span[0] - UNDER_WAY, span[1])
    kind, of = (takes, None) if isinstance(takes, str) else next(iter(takes.items()))
    if kind == "records":
        return no_records(log, of, since, span)
    if kind == "pieces":
        came = any(within(since, e["t_us"]) for e in log.of("stream_saw") if e["event"]["sight"] == "arrived")
        return not came and not published(log, None, None, since)
    if kind == "publications":
        return not published(log, of["to"], of["asks"], (0, span[1]) if of["ever"] else since)
    if kind == "orders":
        return not any(within(since, t) and (of is None or asked(ordered) == of) for t, _, ordered in log.intents())
    accepted = (e for e in log.of("accepted", by="gateway") if e["event"]["at"] == "uplink")
    return not any(within(since, e["t_us"]) and e["event"]["record"]["node"] == "unit-a" for e in accepted)


def asked(kind):
    return kind if isinstance(kind, str) else next(iter(kind))


def published(log, to, asks, span):
    """Whether somebody says that it published something on the command plane: orders, the unit's answers, a rogue's."""
    kinds = {}
    for _, k, kind in log.intents():
        kinds.setdefault(k, []).append(asked(kind))
    for e in log.of("staged", "executed", "stored", "rogue"):
        ev = e["event"]
        if not within(span, e["t_us"]):
            continue
        if ev["is"] == "rogue":
            if to != "server":
                return True
            continue
        down = ev["is"] == "staged" and ev["stage"] == "sent" and e["node"] == "gateway" and to != "server"
        up = ev["is"] in ("executed", "stored") and e["node"] == "unit-a" and to != "client"
        if (down or up) and (asks is None or all(k == asks for k in kinds.get(key(ev["command"]), []))):
            return True
    return False


def no_records(log, to, since, span):
    """Whether no record of the link came: before any session, or since an end or the relay was gone, or since the relay dropped them."""
    last = None
    for side, node in (("server", "gateway"), ("client", "unit-a")):
        if to not in (None, side):
            continue
        times = [a["t"] for a in arrivals(log, node)]
        if any(within(since, t) for t in times):
            return False
        before = [t for t in times if t < span[0]]
        if before:
            last = max(before) if last is None else max(last, max(before))
    if last is None:
        return True
    began = (last, last + LINK_SILENT)
    for node in ("gateway", "unit-a", "relay-telemetry"):
        if any(within(began, s[0]) or covers(s, began) for s in away(log, node)):
            return True
    return datagram(log, "drop", (began[0] - EARLY, began[1] + LATE)) is not None
