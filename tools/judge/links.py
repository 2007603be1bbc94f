"""What relays did to links, against what was seen at the far end: a guard's log for datagrams, a mouth's for byte streams.

A relay's word alone is no receipt.
"""

from log import CLOCKS, within

LINK_SILENT = 350_000  # a link with a record each way every 100 ms is never silent for so long by itself
CONTACT_NEAR, CONTACT_TAKEN_UP = 2_050_000, 2_050_000  # when supervision may be given over a gap, and has to be given anew
DRIFT = 1_000  # clocks of two hosts differ by less than a thousandth


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


def timely(log, node):
    """When something came to the guard of one end that was neither older than Tf there nor an adversary's: the first of its bytes."""
    limit, taken = log.bounds["freshness_ms"] * 1000 + CLOCKS, log.taken()
    forged = {e["event"]["hash"] for e in log.of("attack") if e["event"]["action"] in ("corrupt", "inject")}
    seen, times = set(), []
    for a in arrivals(log, node):
        if a["verdict"] != "passed" or a["hash"] in seen:
            continue
        seen.add(a["hash"])
        if a["t"] - taken.get(a["hash"], a["t"]) <= limit and a["hash"] not in forged and a["t"] < log.end:
            times.append(a["t"])
    return times


def contacts(log):
    """The planned contacts, at times of the run."""
    relay = log.of("started", by="relay-telemetry")
    zero = relay[0]["t_us"] if relay else 0
    return [(zero + c["from"], zero + c["until"]) for c in log.head.get("contacts", [])]


def gaps(log):
    """The times without a planned contact; none without a plan."""
    plan = contacts(log)
    begins, ends = [0] + [end for _, end in plan], [begin for begin, _ in plan] + [log.end]
    return [span for span in zip(begins, ends) if span[0] < span[1]] if plan else []


def gap(log, last):
    """Until when the plan of contacts lets a unit go on that was last heard of near the end of one: soon after the next has begun."""
    plan = contacts(log)
    for (_, end), (begin, _) in zip(plan, plan[1:]):
        if last < begin and last >= end - CONTACT_NEAR - log.bounds["freshness_ms"] * 1000:
            return begin + CONTACT_TAKEN_UP + log.bounds["control_period_ms"] * 1000
    return None


DATAGRAM = ("delay", "drop", "duplicate", "reorder", "replay", "corrupt", "reoriginate", "inject")


def datagram(log, action, span):
    seen = {}
    for e in log.of("guard_saw"):
        seen.setdefault(e["event"]["hash"], []).append(e["t_us"])
    closed = any(e["event"]["account"] == "guard_in" for e in log.of("count"))
    for e in log.of("attack", by="relay-telemetry"):
        ev, t = e["event"], e["t_us"]
        if ev["action"] != action or not within(span, t):
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


def stream(log, deed, span):
    """A relay and the mouth of the end that the bytes lead to share the direction's name and the place in it."""
    for e in log.of("tampered", by="relay-command"):
        ev, t = e["event"], e["t_us"]
        if ev["deed"] == deed and within(span, t) and arrived(log, ev, t):
            return t
    return None


def arrived(log, told, t):
    """Held bytes come so much later, damaged ones come damaged, and what was ended is over there, by nobody else's doing."""
    mouth = "guard-unit-a" if told["side"] == "client" else "guard-broker"
    seen = [(e["t_us"], e["event"]) for e in log.of("stream_saw", by=mouth) if e["event"]["stream"] == told["stream"]]
    if told["deed"] == "held":
        came = [at for at, s in seen if s["sight"] == "arrived" and s["offset"] + s["length"] > told["offset"]]
        return bool(came) and came[0] >= t + told["delay"] - told["delay"] // DRIFT
    if told["deed"] == "damaged":
        same = ("offset", "length", "hash")
        return any(at >= t and s["sight"] == "arrived" and all(s[k] == told[k] for k in same) for at, s in seen)
    over = [(at, s) for at, s in seen if s["sight"] in ("closed", "hung_up")]
    if not over or over[0][1]["sight"] != "closed" or not t <= over[0][0] < log.end:
        return False
    # What was still held is lost with a connection that is reset.
    place = over[0][1]["offset"]
    return place <= told["offset"] if told["deed"] == "reset" else place == told["offset"]
