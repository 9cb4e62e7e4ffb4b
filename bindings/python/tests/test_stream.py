"""Packets, collected and over UDP."""

import socket
import struct
import time
import unittest
import zlib

import numpy as np
from cryptography.hazmat.primitives.ciphers.algorithms import AES
from cryptography.hazmat.primitives.cmac import CMAC

import dibs
from subjects import BEAT, TREE


def receive(line):
    packets = []
    try:
        while True:
            packets.append(line.recv(2_048))
    except socket.timeout:
        return packets


class Streams(unittest.TestCase):
    def test_packets_hold_the_positions(self):
        sender = dibs.Sender(TREE, quantised=False, heartbeat=None)
        sent = sender.send(BEAT.frames[4])
        packets = sender.packets()
        self.assertEqual((sent.content, sent.rows, sent.error), ("whole", 502, 0))
        self.assertEqual((sent.packets, sent.bytes), (len(packets), sum(map(len, packets))))
        self.assertTrue(all(len(packet) <= 1_024 for packet in packets))
        every = b"".join(packets)
        rows = BEAT.frames[4].astype("<f4")
        self.assertTrue(all(row.tobytes() in every for row in rows))
        self.assertEqual(sender.packets(), [])

    def test_partial_frames_are_shorter(self):
        sender = dibs.Sender(TREE, partial=0.5, mtu=64)
        whole, partial = sender.send(BEAT.frames[0]), sender.send(BEAT.frames[1])
        self.assertEqual((whole.content, partial.content), ("whole", "partial"))
        self.assertLess(partial.rows, whole.rows)
        self.assertLess(partial.error, 0.6)
        self.assertTrue(all(len(packet) <= 64 for packet in sender.packets()))
        self.assertEqual(sender.totals.frames, 2)
        self.assertEqual(sender.totals.partial, 1)

    def test_udp_carries_what_is_collected(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
            line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
            line.bind(("127.0.0.1", 0))
            line.settimeout(0.5)
            choices = {"heartbeat": None, "session": 7}
            over = dibs.Sender(TREE, f"udp:127.0.0.1:{line.getsockname()[1]}", **choices)
            here = dibs.Sender(TREE, **choices)
            totals = over.play(BEAT.frames[:5], rate=200)
            for frame in BEAT.frames[:5]:
                here.send(frame, age=0)
            received = receive(line)
        self.assertEqual(received, here.packets())
        self.assertEqual(totals, here.totals)
        self.assertEqual((over.in_flight, over.acknowledged), (here.in_flight, None))
        self.assertEqual(set(here.events.values()), {0}, "no status came")

    def test_a_frame_is_as_old_as_is_said(self):
        begins = []
        for age in [0, 5]:
            sender = dibs.Sender(TREE, heartbeat=None, session=7)
            sender.send(BEAT.frames[0], age=age)
            begins.append(sender.packets()[0])
        self.assertIn((5_000).to_bytes(2, "little"), begins[1])
        self.assertNotEqual(*begins)

    def test_positions_in_another_unit_are_the_same_frame(self):
        choices = {"heartbeat": None, "session": 7}
        here, there = dibs.Sender(TREE, **choices), dibs.Sender(TREE, unit="m", **choices)
        metres = BEAT.frames[4].astype(np.float64) / 1_000
        here.send(BEAT.frames[4], age=0)
        there.send(metres, age=0)
        self.assertEqual(here.packets(), there.packets())
        with self.assertRaisesRegex(ValueError, "times as long as at rest: it is in another unit .unit states its own"):
            here.send(metres)
        with self.assertRaisesRegex(ValueError, "unit is 'ft'"):
            dibs.Sender(TREE, unit="ft")

    def test_far_from_the_origin_the_same_frame_is_sent(self):
        far = np.array([4e6, 0, 0])
        mesh = dibs.Mesh(BEAT.frames[0] + far, dibs.generate("heart", 1_000)[0].triangles)
        sender = dibs.Sender(dibs.build(mesh), quantised=False, heartbeat=None)
        sender.send(BEAT.frames[4] + far)
        every = b"".join(sender.packets())
        local = (BEAT.frames[4] + far - mesh.origin).astype("<f4")
        self.assertTrue(all(row.tobytes() in every for row in local))


KEY = bytes(range(16))
RECEIVER = 3
CHALLENGE = 0x5EED_0000_00C0_FFEE
TO_RECEIVER, TO_SENDER = b"dibs to receiver", b"dibs to sender"


def cmac(key, message):
    """AES-CMAC, RFC 4493."""
    code = CMAC(AES(key))
    code.update(message)
    return code.finalize()


def tag(message, direction, session, challenge=CHALLENGE):
    """The tag of all bytes before it, as docs/wire.md has it under *Authenticity*."""
    label = bytes([1]) + direction + bytes([0]) + RECEIVER.to_bytes(4, "little") + (128).to_bytes(4, "big")
    names = challenge.to_bytes(8, "little") + session.to_bytes(4, "little")
    return cmac(cmac(KEY, label), names + message)[:6]


class Tags(unittest.TestCase):
    def test_every_packet_carries_the_keys_tag(self):
        sender = dibs.Sender(TREE, heartbeat=None, session=7, key=KEY, receiver=RECEIVER, challenge=CHALLENGE)
        self.assertTrue(sender.is_ready)
        sender.send(BEAT.frames[4], age=0)
        packets = sender.packets()
        self.assertGreater(len(packets), 3)
        for packet in packets:
            self.assertEqual(packet[-10:-4], tag(packet[:-10], TO_RECEIVER, 7))
        sender = dibs.Sender(TREE, heartbeat=None, session=7, challenge=CHALLENGE, key=KEY)
        sender.send(BEAT.frames[4], age=0)
        self.assertNotEqual(sender.packets(), packets, "for another receiver")

    def test_a_sender_asks_for_the_challenge(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
            line.bind(("127.0.0.1", 0))
            line.settimeout(5)
            to = f"udp:127.0.0.1:{line.getsockname()[1]}"
            sender = dibs.Sender(TREE, to, heartbeat=None, session=7, key=KEY, receiver=RECEIVER)
            self.assertFalse(sender.is_ready)
            sender.poll()
            hello, address = line.recvfrom(2_048)
            self.assertEqual((hello[1], len(hello)), (128 + 8, 48))
            # The sender does not know the challenge yet.
            self.assertEqual(hello[-10:-4], tag(hello[:-10], TO_RECEIVER, 7, challenge=0))
            for is_forged in [True, False]:
                # Nothing is published yet, a whole frame is needed.
                nonce, = struct.unpack("<Q", hello[22:30])
                body = struct.pack("<HBBIIQQ", 0, 2, 0, 1, 0, nonce, CHALLENGE) + bytes(8)
                status = bytes([4, 128 + 9, 0, 0]) + hello[4:8] + bytes(10) + body
                status += bytes(6) if is_forged else tag(status, TO_SENDER, 0)
                line.sendto(status + zlib.crc32(status).to_bytes(4, "little"), address)
                time.sleep(0.05)
                sender.poll()
                self.assertEqual(sender.is_ready, not is_forged)
            sender.wait()
            totals = sender.play(BEAT.frames[:2], rate=200)
            self.assertEqual((totals.frames, totals.statuses), (2, 1))
            # A status with a count of each event.
            count = len(sender.events)
            body = struct.pack("<HBBIIfI", 0, 2, 0, 2, 0, 0, 0) + struct.pack(f"<{count}I", *range(count))
            status = bytes([4, 128 + 7, 0, 0]) + hello[4:8] + bytes(6) + bytes([count]) + bytes(3) + body
            status += tag(status, TO_SENDER, 0)
            line.sendto(status + zlib.crc32(status).to_bytes(4, "little"), address)
            time.sleep(0.05)
            sender.poll()
            self.assertEqual(list(sender.events.values()), list(range(count)))
            self.assertEqual(sender.events["forged"], list(sender.events).index("forged"))


if __name__ == "__main__":
    unittest.main()
