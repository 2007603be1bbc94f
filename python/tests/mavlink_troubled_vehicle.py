"""The vehicle of guests/mavlink with trouble at its own end of the link: an entry in place of `mavlink_guest.py`.

    mavlink_troubled_vehicle.py FOLDER -- command of the program

The folder has `row.json`; `vehicle.log` is written to it: each datagram at the vehicle's socket, and the state after each step.
"""

import json
import shutil
import signal
import sys
import tempfile
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent))

from mavlink_stamps import Log, Phases, Stamps

from bridge import Bridge, Options
from holdsafe_guest import Reply, Step, run
from link import Link

#: States of a vehicle that flies by the program.
FLIES = {"OFFBOARD", "MISSION"}


class TroubledLink:
    """The trouble of a link's end, put around its receiver."""

    def __init__(self, link: Link, row: dict[str, Any], log: Log) -> None:
        self.link, self.log, self.phases = link, log, Phases(row, log)
        self.inner_take, self.inner_receive = link.take, link.receive
        link.mav.signing = self.phases.sign(None)
        if row["at_contact"]:
            self.phases.started()

    def receive(self) -> list[tuple[int, list[Any]]]:
        if self.phases.turn():
            signing: Stamps = self.link.mav.signing
            self.link.mav.signing = self.phases.sign(signing)
        return self.inner_receive()

    def take(self, datagram: bytes) -> tuple[int, list[Any]]:
        serial, messages = self.inner_take(datagram)
        self.log.write(accepted=bool(messages), name=messages[0].get_type() if messages else "")
        return serial, messages


class TroubledBridge(Bridge):
    """A bridge whose link is in trouble."""

    def __init__(self, options: Options, folder: str, row: dict[str, Any], log: Log) -> None:
        super().__init__(options, folder)
        self.row, self.log = row, log

    def connect(self) -> Link:
        link = super().connect()
        self.trouble = TroubledLink(link, self.row, self.log)
        link.receive, link.take = self.trouble.receive, self.trouble.take  # type: ignore[method-assign]
        return link

    def step(self, step: Step) -> Reply:
        reply = super().step(step)
        self.log.write(state=reply.state)
        if reply.state in FLIES:
            self.trouble.phases.started()
        return reply


def main() -> None:
    where, command = Path(sys.argv[1]), sys.argv[3:]
    row = json.loads((where / "row.json").read_text(encoding="utf-8"))
    given = {**row["vehicle"], "at_contact": row["at_contact"], "seconds": row["seconds"]}
    folder = tempfile.mkdtemp(prefix="mavlink-guest-")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    # The program's end signs by itself; the vehicle's key is of its phases.
    options = Options(command=command, ardupilot=row["ardupilot"], signs_itself=True, ready_s=row["ready_s"])
    bridge = TroubledBridge(options, folder, given, Log(str(where / "vehicle.log")))
    try:
        run(lambda: bridge)
    finally:
        bridge.end()
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
