"""The program's end of a signed link, beside a program that cannot sign: it has the link's key, as a companion computer or MAVProxy has it.

    proxy.py --program PORT --sign FILE

Messages of the program are signed and sent on to the relay; those of the relay are passed on to the program if their signature is
right. The first line that it writes has its port for the relay, the first that it reads the relay's port. Each further line is
answered by one with the datagrams that have come from the relay since the last one, each accepted or refused.
"""

import argparse
import json
import os
import select
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "python"))

from link import LOOPBACK, Link, key_of, open_socket, parsed, parser, port_of
from relay import datagrams

#: Link id of the signatures: the vehicle's is 0.
LINK_ID = 1


class Proxy:
    """The signed end towards the relay, and the unsigned one towards the program."""

    def __init__(self, program: int, key: bytes) -> None:
        self.link = Link(0, 0, key, LINK_ID)
        self.inside, self.program = open_socket(), program
        self.parser = parser(0, 0)

    def serve(self, pending: bytes = b"") -> None:
        """Until the end of standard input."""
        while True:
            ready, _, _ = select.select([sys.stdin, self.link.socket, self.inside], [], [])
            self.pass_in()
            self.pass_out()
            if sys.stdin in ready:
                read = os.read(0, 65536)
                if not read:
                    return
                *lines, pending = (pending + read).split(b"\n")
                for _ in lines:
                    self.pass_in()
                    print(json.dumps([vars(record) for record in self.link.take_records()]), flush=True)

    def pass_in(self) -> None:
        """From the relay to the program, as it came: a program without a key does not look at signatures."""
        for _, messages in self.link.receive():
            for message in messages:
                try:
                    self.inside.sendto(bytes(message.get_msgbuf()), (LOOPBACK, self.program))
                except OSError:
                    # The program is not there yet.
                    pass

    def pass_out(self) -> None:
        """From the program to the relay, under its own name and signed. A message that no dialect has cannot be."""
        for data in datagrams(self.inside):
            for message in parsed(self.parser, data)[0]:
                self.sign(message)

    def sign(self, message: Any) -> None:
        mav = self.link.mav
        mav.srcSystem, mav.srcComponent, mav.seq = message.get_srcSystem(), message.get_srcComponent(), message.get_seq()
        self.link.send_bytes(message.pack(mav))


def main() -> None:
    asked = argparse.ArgumentParser(description="The signing end of a program that cannot sign.")
    asked.add_argument("--program", type=int, required=True, metavar="PORT", help="port of the program")
    asked.add_argument("--sign", required=True, metavar="FILE", help="file with the passphrase of the link's key")
    given = asked.parse_args()
    key = key_of(given.sign)
    assert key is not None  # the option is required
    proxy = Proxy(given.program, key)
    print(json.dumps({"relay": port_of(proxy.link.socket)}), flush=True)
    first, _, rest = os.read(0, 65536).partition(b"\n")
    proxy.link.peer = json.loads(first)["relay"]
    proxy.serve(rest)


if __name__ == "__main__":
    main()
