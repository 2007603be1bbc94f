"""One run: a plant, a node and an attack in a network of their own, with fresh keys. Prints one JSON object.

It is started by `experiment.py` in a new user, network and mount namespace: `python3 cell.py LEVEL ATTACK`.
"""

import collections
import hashlib
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import packets
from attacks import ATTACKS, COMMAND, NODE, ODOMETRY, PLANT, PLANT_DISCOVERY
from credentials import LEVELS, Authorities
from processes import Process

BEFORE_S, AFTER_S, SETTLE_S = 2.0, 3.0, 0.3
# The goal of the node and the wall, metres from the start.
GOAL_M, WALL_M = 6.0, 7.0


def isolate():
    """Shared memory and the loopback interface are this run's alone."""
    subprocess.run(["mount", "-t", "tmpfs", "tmpfs", "/dev/shm"], check=True)
    subprocess.run(["/usr/sbin/ip", "link", "set", "lo", "up"], check=True)


def digest(content):
    return hashlib.sha256(content).hexdigest()


class Run:
    """The processes of one run and the sniffer beside them."""

    ports = (PLANT_DISCOVERY, PLANT, NODE - 1, NODE)

    def __init__(self, level, attack, folder):
        self.level, self.attack, self.folder = level, ATTACKS[attack](), pathlib.Path(folder)
        self.authorities = Authorities(self.folder / "own", level, self.attack.has_one_authority) if LEVELS[level] else None
        self.sniffer = packets.Sniffer()
        self.processes = []

    def start(self, program, options):
        credentials = self.authorities.admit(program, program) if self.authorities else None
        process = Process(program, options, credentials)
        self.processes.append(process)
        process.guid("participant")
        return process

    def writer(self, topic):
        return (self.node if topic == COMMAND else self.plant).guid("writer", topic)

    def ends(self, topic):
        """Honest sender and receiver of a topic."""
        return (self.node, self.plant) if topic == COMMAND else (self.plant, self.node)

    def last_number(self, topic):
        """Sequence number of the honest sender's last message: it counts from 1."""
        return len(self.ends(topic)[0].all("sent"))

    def honest_contents(self):
        return [bytes.fromhex(line["bytes"]) for line in self.ends(self.attack.topic)[0].all("sent")]

    def play(self):
        """Quiet, attack, quiet. False if plant and node never matched."""
        self.sniffer.start()
        self.plant = self.start("plant", self.attack.plant_options)
        self.node = self.start("node", ["--goal", GOAL_M])
        self.attack.prepare(self)
        if not self.plant.wait_for("received") or not self.node.wait_for("received"):
            return False
        time.sleep(BEFORE_S)
        self.begin = time.monotonic()
        self.attack.act(self)
        self.end = time.monotonic()
        time.sleep(AFTER_S)
        self.stop = time.monotonic()
        self.node.stop()
        # What is on its way is still delivered.
        time.sleep(SETTLE_S)
        for process in self.processes:
            process.stop()
        self.dropped = self.sniffer.stop()
        return True


def counted(run, sent, received):
    """Honest messages sent while the receiver was there: from its first receipt to shortly before the first end stops."""
    return [line for line in sent if received[0]["t"] <= line["t"] < run.stop - SETTLE_S]


def phases(run, sent, received):
    """Honest messages delivered and sent before, during and after the attack, by content."""
    delivered = {line["bytes"] for line in received}
    counts = {"before": [0, 0], "during": [0, 0], "after": [0, 0]}
    for line in counted(run, sent, received):
        phase = "before" if line["t"] < run.begin else "during" if line["t"] < run.end else "after"
        counts[phase][0] += line["bytes"] in delivered
        counts[phase][1] += 1
    return counts


def attacked(run, attack, sent, received):
    """Messages of the attacker: delivered, of which under the honest writer's GUID, and the number of all."""
    honest, honest_guid = {line["bytes"] for line in sent}, run.writer(run.attack.topic).hex()
    if run.attack.reads:
        window = {line["bytes"] for line in sent if run.begin <= line["t"] < run.end}
        heard = {content.hex() for content in attack["contents"]}
        return len(window & heard), 0, len(window)
    if not attack["contents"]:
        # A replayed message has the content of an honest one: the second receipt of a content is the attacker's.
        again = len(received) - len({line["bytes"] for line in received})
        return again, again, attack["sent"]
    forged = {content.hex() for content in attack["contents"]} - honest
    under_honest = {line["bytes"] for line in received if line["bytes"] in forged and line["guid"] == honest_guid}
    return len({line["bytes"] for line in received} & forged), len(under_honest), attack["sent"]


def describe(run):
    sender, receiver = run.ends(run.attack.topic)
    sent, received = sender.all("sent"), receiver.all("received")
    attack = run.attack.finish(run)
    counts = phases(run, sent, received)
    delivered, under_honest, number = attacked(run, attack, sent, received)
    places = [line["place"] for line in run.plant.all("place")]
    prefix = attack.get("prefix", "")
    rogue = [line for line in receiver.lines if prefix and line.get("guid", "").startswith(prefix)]
    return {
        "attack_sent": number, "attack_left": attack["left"], "invalid": attack["invalid"], "announced": attack.get("announced"),
        "delivered": delivered, "delivered_under_honest_guid": under_honest, "honest": counts,
        "writers": dict(collections.Counter(line["guid"] for line in received)), "honest_writer": run.writer(run.attack.topic).hex(),
        "rogue_at_receiver": dict(collections.Counter(line["event"] for line in rogue)),
        "first_attack_sha256": digest(attack["contents"][0]) if attack["contents"] else None,
        "furthest_m": max(places), "last_m": places[-1], "harm_m": round(max(0.0, max(places) - WALL_M), 3),
        "ended": [process.process.returncode for process in run.processes],
        "sniffer_dropped": run.dropped, "complaints": [len(process.complaints()) for process in run.processes],
        "complaint": next((line for process in run.processes for line in process.complaints()), ""),
    }


def main(level, attack):
    isolate()
    with tempfile.TemporaryDirectory() as folder:
        run = Run(level, attack, folder)
        try:
            result = describe(run) if run.play() else {"invalid": "plant and node never matched"}
        finally:
            for process in run.processes:
                if process.process.poll() is None:
                    process.process.kill()
    print(json.dumps({"level": level, "attack": attack, "load": os.getloadavg()[0], **result}))


if __name__ == "__main__":
    main(*sys.argv[1:])
