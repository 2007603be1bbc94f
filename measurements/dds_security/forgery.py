"""Secured RTPS packets made with the keys that a writer hands to each of its readers (DDS Security 1.1, 9.5): AES-256-GCM of libcrypto.

A symmetric key shows that a packet comes from one of those who have the key, and each reader of a topic has it.
"""

import ctypes
import ctypes.util
import hashlib
import hmac
import struct

import packets

SEC_BODY, SEC_PREFIX, SEC_POSTFIX, SRTPS_PREFIX, SRTPS_POSTFIX, INFO_SOURCE = 0x30, 0x31, 0x32, 0x33, 0x34, 0x0C
GMAC, GCM = b"\0\0\0\3", b"\0\0\0\4"
GET_TAG = 0x10
# A session of the forger's own: the receiver derives its key from the number.
SESSION = b"\x66\x6f\x72\x67"

crypto = ctypes.CDLL(ctypes.util.find_library("crypto") or "libcrypto.so.3")
crypto.EVP_CIPHER_CTX_new.restype = crypto.EVP_aes_256_gcm.restype = ctypes.c_void_p


def seal(key, nonce, plain, beside=b""):
    """Ciphertext and tag; `beside` is authenticated and not encrypted."""
    context, length = ctypes.c_void_p(crypto.EVP_CIPHER_CTX_new()), ctypes.c_int()
    crypto.EVP_EncryptInit_ex(context, ctypes.c_void_p(crypto.EVP_aes_256_gcm()), None, key, nonce)
    if beside:
        crypto.EVP_EncryptUpdate(context, None, ctypes.byref(length), beside, len(beside))
    out, tag = ctypes.create_string_buffer(len(plain) + 16), ctypes.create_string_buffer(16)
    if plain:
        crypto.EVP_EncryptUpdate(context, out, ctypes.byref(length), plain, len(plain))
    crypto.EVP_EncryptFinal_ex(context, out, ctypes.byref(length))
    crypto.EVP_CIPHER_CTX_ctrl(context, GET_TAG, 16, tag)
    crypto.EVP_CIPHER_CTX_free(context)
    return out.raw[: len(plain)], tag.raw


class Key:
    """Key material as it is handed over: kind, salt, identifier, key; then the receiver's own part, which is not used here."""

    count = 0

    def __init__(self, material):
        self.kind, self.salt = material[:4], material[8:40]
        self.identifier, self.key = material[40:44], material[48:80]
        self.session_key = self.key_of(SESSION)

    def key_of(self, session):
        return hmac.new(self.key, b"SessionKey" + self.salt + session, hashlib.sha256).digest()

    def protect(self, plain):
        """Header, content and tag. A key of the kind GMAC leaves the content in plain."""
        Key.count += 1
        nonce = SESSION + struct.pack(">Q", Key.count)
        header = self.kind + self.identifier + nonce
        if self.kind == GMAC:
            return header, plain, seal(self.session_key, nonce, b"", plain)[1] + bytes(4)
        content, tag = seal(self.session_key, nonce, plain)
        return header, struct.pack(">I", len(content)) + content, tag + bytes(4)


def opened(packet, participant_key):
    """The packet, or its content where the whole message is encrypted. Counter mode decrypts as it encrypts."""
    header = 24
    if participant_key.kind == GMAC or packet[20] != SRTPS_PREFIX:
        return packet
    nonce, body = packet[header + 8 : header + 20], header + 20 + 4
    (length,) = struct.unpack_from(">I", packet, body)
    return seal(participant_key.key_of(nonce[:4]), nonce, packet[body + 4 : body + 4 + length])[0]


def used(keys, of, packets_of_writer):
    """The keys of a kind whose identifiers are in the packets: a reader has the keys of several writers, those of discovery too."""
    joined = b"".join(packets_of_writer)
    return [key for kind, key in keys if kind == of and key.identifier in joined]


class Forger:
    """Packets of `writer` for its readers. `level` says how they are protected; its keys are found by `captured`."""

    def __init__(self, level, writer, keys, captured):
        self.level, self.writer = level, writer
        participants = used(keys, "participant", captured)
        self.participant = participants[0] if participants else None
        captured = [opened(packet, self.participant) for packet in captured] if self.participant else captured
        writer_keys = used(keys, "writer", captured)
        # Fast DDS hands over one key for submessages and payload; the standard allows two, in this order.
        self.submessage_key, self.payload_key = writer_keys[0], writer_keys[-1]

    def data(self, number, content):
        header, body, tag = self.payload_key.protect(packets.ENCAPSULATION + content)
        payload = header + body + tag
        fields = struct.pack("<HH", 0, 16) + packets.ANY_READER + self.writer[12:] + packets.sequence_number(number)
        return packets.submessage(packets.DATA, packets.LITTLE_ENDIAN | packets.HAS_DATA, fields + payload)

    def protected_submessage(self, plain):
        header, body, tag = self.submessage_key.protect(plain)
        parts = (SEC_PREFIX, header), (SEC_BODY, body), (SEC_POSTFIX, tag)
        return b"".join(packets.submessage(kind, packets.LITTLE_ENDIAN, part) for kind, part in parts)

    def protected_message(self, submessages):
        source = packets.submessage(INFO_SOURCE, packets.LITTLE_ENDIAN, bytes(4) + packets.HEADER[4:] + self.writer[:12])
        header, body, tag = self.participant.protect(source + submessages)
        if self.participant.kind != GMAC:
            body = packets.submessage(SEC_BODY, packets.LITTLE_ENDIAN, body)
        begin = packets.submessage(SRTPS_PREFIX, packets.LITTLE_ENDIAN, header)
        return begin + body + packets.submessage(SRTPS_POSTFIX, packets.LITTLE_ENDIAN, tag)

    def packet(self, number, content):
        parts = self.data(number, content)
        if self.level != "data":
            parts = self.protected_submessage(parts)
        if self.level not in ("data", "meta"):
            parts = self.protected_message(parts)
        return packets.HEADER + self.writer[:12] + parts


def parse(lines):
    """Keys of the lines `key participant HEX` and `key writer HEX`, in their order."""
    found = [line.split() for line in lines]
    return [(of, Key(bytes.fromhex(material))) for _, of, material in found]
