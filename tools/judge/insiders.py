"""What insiders did under valid credentials, against what whoever it was for took in.

What was sent has the witness of the mouth that it came to, by its hash. What was kept back is told by the command or the report that
it was about: somebody had sent it, and it never came although others did.
"""

from links import DRIFT
from log import SLACK, key, key_of_record, within

ON_THE_WAY = 1_000_000  # longest from a sender's own entry to the broker's
AT_ONCE = 100_000  # within so long the console has what the gateway's insider passed on
DIALLED = 2_000_000  # longest from a thief's word to the broker's: dialling and a handshake on a loaded host

SENDERS = {
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
        if e["node"] in nodes and ev["action"] == action and within(span, t) and any(s >= t for s in took.get(ev["hash"], [])):
            return t
    return None


def broker(log, action, span):
    """What a hostile broker did to publications: a client's mouth sees each that comes out of its stream."""
    for e in log.of("attack", by="insider-broker"):
        ev, t = e["event"], e["t_us"]
        if ev["action"] != action or not within(span, t):
            continue
        client = "guard-unit-a" if ev["side"] == "client" else "guard-gateway"
        out = [(s["t_us"], s["event"]["hash"]) for s in log.of("stream_saw", by=client) if s["event"]["sight"] == "delivered"]
        mine = [at for at, payload in out if payload == ev["hash"]]
        if action == "drop":
            done = out and not mine and published(log, ev["side"], t)
        elif action == "delay":
            done = any(at >= t + ev["delay"] - ev["delay"] // DRIFT for at in mine)
        elif action in ("duplicate", "replay"):
            done = len(mine) > 1 and mine[-1] >= t
        else:
            done = any(at >= t for at in mine)
        if done:
            return t
    return None


def published(log, side, t):
    """Whether somebody says that it had just published what leads to this side: orders, or the unit's answers."""
    if side == "client":
        said = [e["t_us"] for e in log.of("staged", by="gateway") if e["event"]["stage"] == "sent"]
    else:
        said = [e["t_us"] for e in log.of("executed", "stored", by="unit-a")]
    return any(-SLACK <= t - at <= ON_THE_WAY for at in said)


def feed(log, action, span):
    """What a gateway's insider told the display, or kept from it for good."""
    if action != "drop":
        return mouthed(log, action, ("insider-gateway",), span)
    shown = shown_reports(log)
    for t, record in withheld(log, span):
        if all(r != record for _, r in shown) and lacking(shown, record, t, float("inf")):
            return t
    return None


def late(log, by, span):
    """Reports that it passed on so much later: none was shown before, and what it then sent came."""
    shown = shown_reports(log)
    came = {}
    for e in log.of("mouth_saw"):
        came.setdefault(e["event"]["hash"], []).append(e["t_us"])
    sent = [(e["t_us"], e["event"]["hash"]) for e in log.of("attack", by="insider-gateway") if e["event"]["action"] == "delay"]
    arrived = [at for t, payload in sent for at in came.get(payload, []) if at >= t]
    for t, record in withheld(log, span):
        due = t + by - by // DRIFT
        early = any(r == record and at < due for at, r in shown)
        passed_on = any(due <= at <= t + by + AT_ONCE for at in arrived)
        if not early and passed_on and (by <= AT_ONCE or lacking(shown, record, t, due)):
            return t
    return None


def withheld(log, span):
    """Reports that the insider says it kept and that the honest half of the gateway had accepted."""
    accepted = {}
    for e in log.of("accepted", by="gateway"):
        accepted.setdefault(key_of_record(e["event"]["record"]), e["t_us"])
    for e in log.of("withheld", by="insider-gateway"):
        record = key_of_record(e["event"]["record"])
        if within(span, e["t_us"]) and accepted.get(record, float("inf")) <= e["t_us"]:
            yield e["t_us"], record


def shown_reports(log):
    return [(e["t_us"], key_of_record(e["event"]["report"])) for e in log.of("displayed") if e["event"]["unit"] == "unit-a"]


def lacking(shown, record, since, until):
    """Whether the display went by an older report when this one had long been due."""
    return any(since + AT_ONCE <= at < until and r[1:] < record[1:] for at, r in shown)


def swallowed(log, span):
    """A command that the operator gave and the gateway never heard of."""
    given = {}
    for t, k, _ in log.intents():
        given.setdefault(k, t)
    staged = {key(e["event"]["command"]) for e in log.of("staged", by="gateway")}
    for e in log.of("swallowed", by="insider-gateway"):
        k = key(e["event"]["command"])
        if within(span, e["t_us"]) and given.get(k, float("inf")) <= e["t_us"] and k not in staged:
            return e["t_us"]
    return None


def rogue(log, span):
    """An order of a rogue's that somebody judged: the unit and the gateway name it, the broker names the certificate."""
    judged = {}
    for e in log.of("executed", "stored", by="unit-a") + log.of("staged", by="gateway"):
        judged.setdefault(key(e["event"]["command"]), []).append(e["t_us"])
    barred = [(e["t_us"], e["event"]["peer"]) for e in log.of("refused") if e["event"]["at"] == "broker"]
    for e in log.of("rogue", by="insider-operator"):
        ev, t = e["event"], e["t_us"]
        known = any(at >= t for at in judged.get(key(ev["command"]), []))
        refused = any(at >= t and peer is not None and peer == ev["certificate"] for at, peer in barred)
        if within(span, t) and (known or refused):
            return t
    return None


def takeover(log, peer, span):
    """A thief says that it joins, the broker that the session changed hands, and its owner that it lost it."""

    def said(kind, by, since):
        return any(e["event"]["peer"] == peer and since <= e["t_us"] < since + DIALLED for e in log.of(kind, by=by))

    for e in log.of("joins", by="impostor"):
        t = e["t_us"]
        if e["event"]["certificate"] == peer and within(span, t) and said("taken_over", "broker", t) and said("session_lost", peer, t):
            return t
    return None
