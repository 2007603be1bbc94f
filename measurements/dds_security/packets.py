"""RTPS packets by hand, and a sniffer of the loopback interface. No key and no library of DDS is used."""

import socket
import struct
import threading
import time

HEADER = b"RTPS\x02\x03\x01\x0f"
LITTLE_ENDIAN, FINAL, HAS_DATA, HAS_INLINE_QOS = 1, 2, 4, 2
DATA, HEARTBEAT, INFO_TIME = 0x15, 0x07, 0x09
ANY_READER = bytes(4)
# Entity identifiers of the participant discovery, as RTPS 2.3 defines them.
PARTICIPANT_WRITER, PARTICIPANT_READER = bytes.fromhex("000100c2"), bytes.fromhex("000100c7")
PARTICIPANT = bytes.fromhex("000001c1")
KEY_HASH, STATUS_INFO, SENTINEL = 0x70, 0x71, 0x01
DISPOSED_AND_UNREGISTERED = b"\0\0\0\x03"
ENCAPSULATION = b"\0\1\0\0"


def submessage(kind, flags, body):
    return struct.pack("<BBH", kind, flags, len(body)) + body


def sequence_number(number):
    return struct.pack("<iI", number >> 32, number & 0xFFFFFFFF)


def data_packet(writer, number, content, reader=ANY_READER):
    """DATA of one message: `writer` is a GUID of 16 bytes, `content` its CDR."""
    body = struct.pack("<HH", 0, 16) + reader + writer[12:] + sequence_number(number) + ENCAPSULATION + content
    seconds = time.time()
    stamp = struct.pack("<II", int(seconds), int((seconds % 1) * 2**32))
    info = submessage(INFO_TIME, LITTLE_ENDIAN, stamp)
    return HEADER + writer[:12] + info + submessage(DATA, LITTLE_ENDIAN | HAS_DATA, body)


def heartbeat_packet(writer, first, count, reader=ANY_READER):
    """HEARTBEAT that says that the first number still to be had is `first`."""
    body = reader + writer[12:] + sequence_number(first) + sequence_number(first) + struct.pack("<I", count)
    return HEADER + writer[:12] + submessage(HEARTBEAT, LITTLE_ENDIAN | FINAL, body)


def farewell_packet(prefix, number):
    """DATA of the participant discovery without content that disposes the participant `prefix`."""
    parameters = struct.pack("<HH", KEY_HASH, 16) + prefix + PARTICIPANT
    parameters += struct.pack("<HH", STATUS_INFO, 4) + DISPOSED_AND_UNREGISTERED + struct.pack("<HH", SENTINEL, 0)
    body = struct.pack("<HH", 0, 16) + PARTICIPANT_READER + PARTICIPANT_WRITER + sequence_number(number) + parameters
    return HEADER + prefix + submessage(DATA, LITTLE_ENDIAN | HAS_INLINE_QOS, body)


class Sender:
    """A socket of its own, so that the sniffer tells its packets by the source port."""

    def __init__(self, port):
        self.target = ("127.0.0.1", port)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.port = self.socket.getsockname()[1]
        self.sent = 0

    def send(self, packet):
        if self.socket.sendto(packet, self.target) == len(packet):
            self.sent += 1


class Sniffer(threading.Thread):
    """Every UDP packet of the loopback interface: time, source port, target port, payload."""

    SOL_PACKET, STATISTICS = 263, 6

    def __init__(self):
        super().__init__(daemon=True)
        self.packets = []
        # A socket of this one protocol sees each packet of loopback once, on its way in.
        self.socket = socket.socket(socket.AF_PACKET, socket.SOCK_DGRAM, socket.htons(0x0800))
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 24)
        self.socket.bind(("lo", 0x0800))
        self.socket.settimeout(0.2)
        self.is_on = True

    def run(self):
        while self.is_on:
            try:
                packet = self.socket.recv(65536)
            except TimeoutError:
                continue
            if packet[9] != socket.IPPROTO_UDP:
                continue
            start = (packet[0] & 15) * 4
            source, target = struct.unpack_from(">HH", packet, start)
            self.packets.append((time.monotonic(), source, target, packet[start + 8 :]))

    def stop(self):
        """Number of packets that the kernel dropped before they were read."""
        self.is_on = False
        self.join()
        _, dropped = struct.unpack("II", self.socket.getsockopt(self.SOL_PACKET, self.STATISTICS, 8))
        return dropped

    def of_participant(self, prefix, ports):
        """Packets of the participant `prefix`, as their header says, to one of `ports`."""
        return [p for p in list(self.packets) if p[3][:4] == b"RTPS" and p[3][8:20] == prefix and p[2] in ports]

    def from_port(self, source, target):
        return [p for p in list(self.packets) if p[1] == source and p[2] == target]
