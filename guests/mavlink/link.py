"""One end of a MAVLink 2 link over UDP on the loopback interface: pymavlink's parser and signatures, and a record of each datagram.

The end parses each datagram by itself: bytes left over from one do not take the next one with them, as they would in pymavlink's
stream. Whether a message is accepted is pymavlink's decision. A message whose id no dialect has is returned by pymavlink before it has
been checked, and is not accepted here.
"""

import hashlib
import socket
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Optional

from pymavlink.dialects.v20 import ardupilotmega

#: The dialect, for all that build or name messages.
mavlink: Any = ardupilotmega

#: Start of MAVLink's time for signatures, s of Unix time, and its units in a second.
EPOCH, TICKS = 1_420_070_400, 100_000
#: Datagrams read at once, so that a flood does not keep the end from its other work.
BATCH = 2000
#: Digest of a datagram in records, bytes.
DIGEST = 8
LOOPBACK = "127.0.0.1"
#: Beginnings of pymavlink's reasons, and the words for them.
REASONS = {
    "Invalid signature": "signature",
    "invalid MAVLink CRC": "checksum",
    "Bad prefix": "no frame",
    "invalid MAVLink message length": "length",
}


def digest(datagram: bytes) -> str:
    return hashlib.blake2b(datagram, digest_size=DIGEST).hexdigest()


def key_of(file: Optional[str]) -> Optional[bytes]:
    """The key of a link from the file with its passphrase, as MAVProxy and QGroundControl make it."""
    return hashlib.sha256(Path(file).read_text(encoding="utf-8").strip().encode()).digest() if file else None


@dataclass(frozen=True)
class Record:
    """A datagram that reached the socket."""

    #: Number of the datagram at this end, from 1.
    serial: int
    digest: str
    #: True if pymavlink accepted a message of it.
    accepted: bool
    #: Why it accepted none.
    why: Optional[str]


def open_socket(port: int = 0) -> socket.socket:
    """A socket on a port; by default on one of the kernel's choice.

    :raises OSError: another process has the port.
    """
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        made.bind((LOOPBACK, port))
    except OSError:
        made.close()
        raise
    made.setblocking(False)
    return made


def port_of(end: socket.socket) -> int:
    return int(end.getsockname()[1])


def parser(system: int, component: int, key: Optional[bytes] = None, link_id: int = 0) -> Any:
    """pymavlink's end of a link. With a key it signs each message, and accepts only those that are signed with the same."""
    made = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
    made.robust_parsing = True
    if key is not None:
        made.signing.secret_key, made.signing.sign_outgoing, made.signing.link_id = key, True, link_id
        made.signing.timestamp = int((time.time() - EPOCH) * TICKS)
    return made


def parsed(mav: Any, datagram: bytes) -> tuple[list[Any], Optional[str]]:
    """The accepted messages of a datagram, and why there are none."""
    mav.buf, mav.buf_index, mav.expected_length = bytearray(), 0, mavlink.HEADER_LEN_V1 + 2
    messages, why = [], "no whole frame"
    for message in mav.parse_buffer(datagram) or []:
        name = message.get_type()
        if name == "BAD_DATA":
            why = next((word for beginning, word in REASONS.items() if message.reason.startswith(beginning)), message.reason[:60])
        elif name.startswith("UNKNOWN"):
            why = "unknown message"
        else:
            messages.append(message)
    return messages, None if messages else why


class Link:
    """The socket and the parser of an end. `peer` is the port that it sends to."""

    def __init__(self, system: int, component: int, key: Optional[bytes], link_id: int = 0) -> None:
        self.socket, self.peer = open_socket(), 0
        self.mav = parser(system, component, key, link_id)
        self.records: list[Record] = []
        self.received = 0
        self.refused: dict[str, int] = {}

    def receive(self) -> list[tuple[int, list[Any]]]:
        """The messages of each datagram that has come, with its number."""
        found = []
        for _ in range(BATCH):
            try:
                datagram = self.socket.recv(65536)
            except BlockingIOError:
                break
            found.append(self.take(datagram))
        return found

    def take(self, datagram: bytes) -> tuple[int, list[Any]]:
        self.received += 1
        messages, why = parsed(self.mav, datagram)
        self.records.append(Record(self.received, digest(datagram), why is None, why))
        if why is not None:
            self.refused[why] = self.refused.get(why, 0) + 1
        return self.received, messages

    def take_records(self) -> list[Record]:
        """The records since the last call."""
        records, self.records = self.records, []
        return records

    def send(self, message: Any) -> None:
        self.send_bytes(message.pack(self.mav))
        self.mav.seq = (self.mav.seq + 1) % 256

    def send_bytes(self, datagram: bytes) -> None:
        try:
            self.socket.sendto(datagram, (LOOPBACK, self.peer))
        except OSError:
            # The other end is not there, or its buffer is full: UDP loses it.
            pass
