"""The program's end of a signed link in trouble: it starts a program that cannot sign, and signs for it, as `proxy.py` does.

    mavlink_troubled_end.py FOLDER PORT -- command of the program

The folder has `row.json`; `end.log` is written to it: each datagram from the vehicle and to it, and each line that the program prints.
This end's trouble may last longer (`seconds`). Beside the settings of `mavlink_stamps` a phase may have:

    loss, late   share of the datagrams of both directions that are lost, or arrive behind later ones
    retry        sending of commands: "cached" sends the bytes of the first try, which was lost, again; "signed" signs each try anew,
                 of which the first is lost; "held" sends each try 0.5 s after it was signed; "none" as they come
"""

import json
import os
import random
import select
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Callable, Optional

sys.path.insert(0, str(Path(__file__).resolve().parent))

from mavlink_stamps import SOUND, Log, Phases

from bridge import reserved
from link import LOOPBACK, open_socket, parsed, parser, port_of
from relay import datagrams

#: Time by which a datagram is late that arrives behind later ones, and a held command, s.
LATE, HELD = 0.15, 0.5
#: Time in which tries of a command count as the same, s.
SAME = 2.4
#: Modes of flight in HEARTBEAT: OFFBOARD of PX4, AUTO of ArduPilot.
IN_FLIGHT = {6 << 16, 3}
WAIT = 0.02


class End:
    """The socket towards the vehicle, the one towards the program, and the trouble between them."""

    def __init__(self, row: dict[str, Any], port: int, log: Log, chance: random.Random) -> None:
        self.log, self.chance, self.peer = log, chance, 0
        given = {"seconds": row["seconds"], **row["end"], "at_contact": row["at_contact"]}
        self.phases = Phases(given, log)
        self.outside, self.inside, self.program = open_socket(port), open_socket(), 0
        self.mav, self.reader = parser(0, 0), parser(0, 0)
        self.mav.signing = self.phases.sign(None)
        #: Acts that are due at a time.
        self.waiting: list[tuple[float, Callable[[bytes], None], bytes]] = []
        #: Time and bytes of the first try of a command, by its content.
        self.tries: dict[bytes, tuple[float, bytes]] = {}

    def start(self, command: list[str]) -> "subprocess.Popen[bytes]":
        held = reserved()
        self.program = port_of(held)
        held.close()
        words = [word.replace("{inner}", str(self.program)) for word in command]
        return subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    def serve(self, process: "subprocess.Popen[bytes]") -> None:
        """Until this process is ended."""
        assert process.stdout is not None
        output, pending = process.stdout.fileno(), b""
        watched: list[Any] = [self.outside, self.inside, output]
        while True:
            ready, _, _ = select.select(watched, [], [], WAIT)
            if self.phases.turn():
                self.mav.signing = self.phases.sign(self.mav.signing)
            self.hear()
            for data in datagrams(self.inside):
                for message in parsed(self.reader, data)[0]:
                    self.pass_out(message)
            self.do_waiting()
            if output in ready:
                read = os.read(output, 65536)
                watched = watched if read else watched[:2]
                *lines, pending = (pending + read).split(b"\n")
                for line in lines:
                    self.log.write(said=line.decode(errors="replace"))

    def share(self, name: str) -> float:
        return float(self.phases.settings.get(name, 0.0))

    def troubled(self, act: Callable[[bytes], None], data: bytes) -> None:
        """Passes a datagram on, unless it is lost or late."""
        drawn = self.chance.random()
        if drawn < self.share("loss"):
            return
        if self.chance.random() < self.share("late"):
            self.waiting.append((time.monotonic() + LATE, act, data))
        else:
            act(data)

    def do_waiting(self) -> None:
        due = [one for one in self.waiting if one[0] <= time.monotonic()]
        self.waiting = [one for one in self.waiting if one not in due]
        for _, act, data in due:
            act(data)

    # From the vehicle.

    def hear(self) -> None:
        while True:
            try:
                data, (_, self.peer) = self.outside.recvfrom(65536)
            except BlockingIOError:
                return
            except OSError:
                continue
            self.phases_by(data)
            self.troubled(self.pass_in, data)

    def phases_by(self, data: bytes) -> None:
        """Starts the clock of the phases, as a witness without a key."""
        for message in parsed(WITNESS, data)[0]:
            flies = message.get_type() == "HEARTBEAT" and message.base_mode & 128 and message.custom_mode in IN_FLIGHT
            if flies or self.phases.row["at_contact"]:
                self.phases.started()

    def pass_in(self, data: bytes) -> None:
        messages, _ = parsed(self.mav, data)
        self.log.write(came=bool(messages))
        for message in messages:
            try:
                self.inside.sendto(bytes(message.get_msgbuf()), (LOOPBACK, self.program))
            except OSError:
                # The program is not there yet.
                pass

    # To the vehicle.

    def pass_out(self, message: Any) -> None:
        retry = self.phases.settings.get("retry")
        if retry in (None, "none") or message.get_type() != "COMMAND_LONG":
            return self.troubled(self.send, self.packed(message))
        if retry == "held":
            self.waiting.append((time.monotonic() + HELD, self.send, self.packed(message)))
            return
        content, now = bytes(message.get_payload()[:32]), time.monotonic()
        since, first = self.tries.get(content, (float("-inf"), b""))
        if now - since > SAME:
            # The first try is lost.
            self.tries[content] = (now, self.packed(message))
        else:
            self.send(first if retry == "cached" else self.packed(message))

    def packed(self, message: Any) -> bytes:
        self.mav.srcSystem, self.mav.srcComponent = message.get_srcSystem(), message.get_srcComponent()
        self.mav.seq = message.get_seq()
        return bytes(message.pack(self.mav))

    def send(self, data: bytes) -> None:
        if self.peer:
            self.outside.sendto(data, (LOOPBACK, self.peer))
            self.log.write(sent=1)


#: A parser that reads all, signed or not.
WITNESS = parser(0, 0)


def main(folder: str, port: str, command: list[str]) -> None:
    row = json.loads((Path(folder) / "row.json").read_text(encoding="utf-8"))
    end = End(row, int(port), Log(str(Path(folder) / "end.log")), random.Random(row["seed"]))
    end.serve(end.start([word.replace("{folder}", folder) for word in command]))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], sys.argv[4:])
