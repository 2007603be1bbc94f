"""The attacks: each acts for a few seconds while plant and node run, and reports the messages that it sent.

Raw attacks are given the GUIDs of both ends and the node's next sequence number: the prefix stands in clear in every header, identifiers
of endpoints count up, and sequence numbers can be guessed.
"""

import struct
import time

import forgery
import packets
from credentials import DOMAIN, Authorities
from processes import BUILD, Process

SECONDS = 5
# Ports of RTPS for the first participant of a domain; each further one has the next two.
PLANT_DISCOVERY, PLANT, NODE = (7400 + 250 * DOMAIN + offset for offset in (10, 11, 13))
FAST = 1.5
FALSE_PLACE = -5.0
COMMAND, ODOMETRY = "rt/cmd_vel", "rt/odom"


def content(first, number):
    """Six doubles as the rogue program fills them: a negative count tells them from honest ones."""
    return struct.pack("<6d", first, 0, 0, -number, time.monotonic(), 0)


class Attack:
    """Base: no attack. `reads`: it listens; `topic` the topic whose honest messages count;
    `has_one_authority` that identities and permissions have one authority."""

    topic, reads, plant_options, has_one_authority = COMMAND, False, (), False

    def prepare(self, run):
        """Before plant and node have matched."""

    def act(self, run):
        time.sleep(SECONDS)

    def finish(self, run):
        """After the run: a dictionary with `sent`, `left` and `contents`."""
        return {"sent": 0, "left": 0, "contents": [], "invalid": ""}


class Participant(Attack):
    """A participant of its own: a stranger, one of another authority, or an insider."""

    def __init__(self, rate=100, topic=COMMAND, reads=False, identity="stranger", is_patched=False):
        self.rate, self.topic, self.reads, self.identity, self.is_patched = rate, topic, reads, identity, is_patched
        self.count, self.has_one_authority = rate * SECONDS, identity == "one-authority"

    def credentials(self, run):
        if self.identity == "stranger":
            return None
        own = Authorities(run.folder / "other", run.level)
        admit = run.authorities.admit
        return {
            "other-authority": lambda: own.admit("rogue", "everything"),
            "insider": lambda: admit("insider", "insider"),
            "own-permissions": lambda: admit("insider", "everything", permissions_of=own),
            "own-governance": lambda: run.authorities.admit_with_own_governance("insider", "insider", own),
            "own-signature": lambda: run.authorities.admit_with_own_signature("insider", "everything"),
            "one-authority": lambda: run.authorities.admit_with_own_signature("insider", "everything"),
        }[self.identity]()

    def prepare(self, run):
        options = ["--topic", self.topic, "--rate", self.rate, "--count", self.count]
        options += ["--listen", "yes"] if self.reads else []
        preload = BUILD / "unchecked.so" if self.is_patched else None
        self.process = Process("rogue", options, self.credentials(run), preload)
        run.processes.append(self.process)

    def act(self, run):
        self.begin = time.monotonic()
        self.process.signal()
        time.sleep(SECONDS)

    def missing(self, prefix, endpoint, announced, written):
        """The first receipt that the attack lacks, by which it is INVALID; empty if it has all."""
        receipts = {
            "its own library refuses the participant": prefix,
            "its own library refuses the endpoint": endpoint,
            "no packet of it on the wire": announced,
            "not all messages were written": self.reads or len(written) == self.count,
        }
        return next((name for name, receipt in receipts.items() if not receipt), "")

    def finish(self, run):
        prefix = self.process.guid("participant")[:12]
        endpoint = self.process.guid("reader" if self.reads else "writer", self.topic) if prefix else b""
        announced = len(run.sniffer.of_participant(prefix, run.ports)) if prefix else 0
        written = self.process.contents("sent", taken=True)
        missing = self.missing(prefix, endpoint, announced, written)
        return {"sent": 0 if self.reads else self.count, "left": 0 if missing else max(len(written), 1), "announced": announced,
                "contents": self.process.contents("received", since=self.begin) if self.reads else written,
                "invalid": missing, "prefix": prefix.hex()}


class Sniffer(Attack):
    """Looks for the honest content in the packets that are on the wire anyway."""

    reads = True

    def act(self, run):
        self.begin = time.monotonic()
        time.sleep(SECONDS)
        self.end = time.monotonic()

    def finish(self, run):
        seen = b"".join(p[3] for p in run.sniffer.packets if p[2] == PLANT and self.begin <= p[0])
        return {"sent": 0, "left": 1, "contents": [c for c in run.honest_contents() if c in seen], "invalid": ""}


class Raw(Attack):
    """Packets from a socket without a participant, at a steady rate. `packet` makes one of its number."""

    def __init__(self, packet, rate=100, port=PLANT, topic=COMMAND, plant_options=()):
        self.packet, self.rate, self.port, self.topic, self.plant_options = packet, rate, port, topic, plant_options

    def act(self, run):
        self.sender, self.contents = packets.Sender(self.port), []
        start, self.count = time.monotonic(), self.rate * SECONDS
        for number in range(self.count):
            self.sender.send(self.packet(self, run, number))
            time.sleep(max(0.0, start + (number + 1) / self.rate - time.monotonic()))

    def finish(self, run):
        seen = len(run.sniffer.from_port(self.sender.port, self.port))
        missing = "" if seen == self.sender.sent == self.count else "not all packets were seen on the wire"
        return {"sent": self.count, "left": seen, "contents": self.contents, "invalid": missing}

    def new_content(self, number):
        made = content(FAST if self.topic == COMMAND else FALSE_PLACE, number + 1)
        self.contents.append(made)
        return made


class ReaderForges(Raw):
    """A participant with the right to read commands uses the keys that it has as a reader, to write in the node's name."""

    def __init__(self):
        super().__init__(lambda attack, run, number: attack.forger.packet(attack.first + number, attack.new_content(number)))

    def prepare(self, run):
        credentials = run.authorities.admit("monitor", "monitor")
        self.reader = Process("rogue", ["--topic", COMMAND, "--listen", "yes"], credentials, BUILD / "keys.so")
        run.processes.append(self.reader)

    def act(self, run):
        self.forger = self.forger_of(run)
        self.first = run.last_number(COMMAND) + 1
        self.reader.signal()
        super().act(run)

    def forger_of(self, run):
        writer = run.writer(COMMAND)
        captured = [p[3] for p in run.sniffer.of_participant(writer[:12], [PLANT])]
        return forgery.Forger(run.level, writer, forgery.parse(self.reader.handed_keys()), captured)


def forged(attack, run, number):
    if number == 0:
        attack.first = run.last_number(attack.topic) + 1
    return packets.data_packet(run.writer(attack.topic), attack.first + number, attack.new_content(number))


def ahead(attack, run, number):
    return packets.data_packet(run.writer(attack.topic), 100_000 + number, attack.new_content(number))


def heartbeat(attack, run, number):
    return packets.heartbeat_packet(run.writer(attack.topic), 100_000, 2**30 + number)


def farewell(attack, run, number):
    return packets.farewell_packet(run.writer(COMMAND)[:12], 1_000 + number)


def flood(attack, run, number):
    unknown = bytes([1, 15]) + bytes(range(10)) + run.writer(COMMAND)[12:]
    return packets.data_packet(unknown, number + 1, attack.new_content(number))


def replay(attack, run, number):
    if number == 0:
        attack.captured = [p[3] for p in run.sniffer.of_participant(run.writer(COMMAND)[:12], [PLANT])]
    return attack.captured[number % len(attack.captured)]


ATTACKS = {
    "control": Attack,
    "stranger-20": lambda: Participant(20),
    "stranger-100": lambda: Participant(100),
    "stranger-500": lambda: Participant(500),
    "stranger-odometry": lambda: Participant(100, ODOMETRY),
    "stranger-listens": lambda: Participant(reads=True),
    "sniffer": Sniffer,
    "other-authority": lambda: Participant(identity="other-authority"),
    "insider": lambda: Participant(identity="insider"),
    "insider-own-permissions": lambda: Participant(identity="own-permissions"),
    "insider-own-governance": lambda: Participant(identity="own-governance"),
    "insider-own-signature": lambda: Participant(identity="own-signature"),
    "insider-one-authority": lambda: Participant(identity="one-authority"),
    "insider-patched": lambda: Participant(identity="insider", is_patched=True),
    "insider-patched-odometry": lambda: Participant(100, ODOMETRY, identity="insider", is_patched=True),
    "insider-patched-listens": lambda: Participant(reads=True, identity="insider", is_patched=True),
    "data-forged": lambda: Raw(forged),
    "data-forged-odometry": lambda: Raw(forged, port=NODE, topic=ODOMETRY),
    "data-ahead": lambda: Raw(ahead, plant_options=("--reliability", "best-effort")),
    "heartbeat": lambda: Raw(heartbeat, rate=20),
    "heartbeat-watchdog": lambda: Raw(heartbeat, rate=20, plant_options=("--patience", 0.5)),
    "reader-forges": ReaderForges,
    "replay": lambda: Raw(replay),
    "flood": lambda: Raw(flood, rate=1000),
    "farewell": lambda: Raw(farewell, rate=20, port=PLANT_DISCOVERY),
}
