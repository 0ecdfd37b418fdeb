#!/usr/bin/env python3
"""Decodes what a kehai module sends: docs/wire.md in code. Standard library only, but for modules with keys.

    kehai_wire.py FILE...                one datagram a file, raw bytes or hexadecimal text
    kehai_wire.py --listen HOST[:PORT]   subscribes to a module and prints what comes
    kehai_wire.py --listen HOST[:PORT] --key ID:HEX
                                         the same from a module with keys: kehai-tracker module key says one

Prints one JSON object a line. As a library: decode(datagram) -> dict.
"""

import argparse
import json
import os
import select
import socket
import struct
import sys
import time

MAGIC = b"\xe6\xb0\x97"
VERSION = 1
PORT = 4040
HEADER = struct.Struct("<3sBI6sBBQ16s")  # 40 bytes
FROZEN = (0x80, 0x81, 0x82, 0x83)
NO_RETURN = 65535
UNANSWERED = 3  # opens of a session without an answer: one or two of them may be lost

# fmt: off
ENDS = ("free", "body", "wall", "view", "neck")
REASONS = ("no_return", "too_short", "overflow")
BEAM_STATES = ("unknown", "open", "wall")
SENSOR_CODES = ("searching", "booting", "starting", "streaming", "stalled", "abnormal", "too_large", "unusable",
                "refused", "paused")
EVENTS = ("learn_started", "learned", "learn_restarted", "absorbed", "background_forgotten",
          "background_drifted", "settings_changed", "restarting", "address_unusable", "address_returned",
          "address_default", "factory_reset", "keys_set", "image_on_trial", "image_confirmed", "image_reverted",
          "image_forged", "image_damaged", "image_other", "image_too_old")
ALARMS = ("no_scans", "no_background", "learning_waits", "suspects", "store_failed", "clock_uncertain",
          "watchdog")
REFUSALS = ("version", "unsupported", "malformed", "bad_cookie", "full", "wrong_module", "wrong_boot",
            "not_allowed", "superseded", "moved", "no_background", "span", "report", "too_few_scans",
            "no_sensor", "busy", "setting", "not_stored", "needs_key", "no_such_key", "bad_keys", "image")
COUNTERS = (
    "lost_scans", "scans_accepted", "scans_missing", "scans_damaged", "scans_repeated", "scans_unstable",
    "sensor_stalls", "sensor_resumes", "sensor_starts", "sensor_clock_restarts", "sensor_reboots",
    "sensor_baud_changes", "sensor_refusals", "sensor_timeouts", "sensor_link_failures",
    "sensor_checksum", "sensor_character", "sensor_line_length", "sensor_value_count",
    "sensor_buffer_too_short", "sensor_echo", "sensor_status", "sensor_foreign_reply",
    "sensor_parameters", "sensor_info_line", "sensor_unexpected", "foreign_scans", "short_scans",
    "candidates_over", "spans_merged", "reports_dropped", "health_dropped", "parts_dropped",
    "answers_dropped", "sockets_reopened", "datagrams_foreign", "datagrams_too_short",
    "datagrams_too_long", "datagrams_wrong_direction", "cookies_given", "subscribers_forgotten",
    "requests_repeated", "refused_version", "refused_unsupported", "refused_malformed",
    "refused_bad_cookie", "refused_full", "refused_wrong_module", "refused_wrong_boot",
    "refused_not_allowed", "refused_superseded", "refused_absorb", "refused_learn", "refused_busy",
    "refused_setting", "store_failures", "watchdog_resets", "link_losses",
    "datagrams_dropped", "discovery_dropped", "sessions_opened", "open_forged",
    "open_replayed", "sealed_unknown", "sealed_replayed", "sealed_forged", "refused_key",
    "refused_image",
)
# fmt: on


class Malformed(ValueError):
    """Not a datagram of a module, or a damaged one."""


class Reader:
    """Takes one value after the other from a message."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def bytes(self, count):
        if self.at + count > len(self.data):
            raise Malformed("the message ends too soon")
        self.at += count
        return self.data[self.at - count : self.at]

    def fixed(self, layout):
        """Little-endian values of fixed length."""
        layout = struct.Struct("<" + layout)
        return layout.unpack(self.bytes(layout.size))

    def u8(self):
        return self.bytes(1)[0]

    def varint(self):
        """Seven bits a byte, the lowest first; all bytes but the last have the highest bit set."""
        value = 0
        for shift in range(0, 70, 7):
            byte = self.u8()
            value |= (byte & 0x7F) << shift
            if byte < 0x80:
                return value
        raise Malformed("a number without end")

    def text(self):
        return self.bytes(self.varint()).decode("utf-8")

    def option(self, read):
        """0, or 1 and the value."""
        return read() if self.u8() else None

    def list(self, read):
        """The number of items and the items."""
        return [read() for _ in range(self.varint())]

    def added_list(self, read):
        """A list that peers of an older version do not send."""
        return self.list(read) if self.at < len(self.data) else []


def name(names, code, unknown="unknown"):
    return names[code] if code < len(names) else unknown


def beyond(step):
    """The range step beyond an end, mm; None where nothing returned."""
    return None if step == 127 else step * 20


def report(reader):
    keys = (
        "sequence",
        "setup",
        "background_version",
        "stamp_us",
        "sensor_ms",
        "uncertainty_us",
        "lost_scans",
    )
    result = dict(zip(keys, reader.fixed("IHHQQII"), strict=True))
    result["candidates"] = reader.list(lambda: candidate(reader))
    result["unseen"] = reader.list(lambda: unseen_span(reader))
    result["sizes"] = reader.added_list(lambda: size(reader))
    return result


def candidate(reader):
    keys = (
        "first_step",
        "last_step",
        "near_step",
        "beams",
        "first_mm",
        "mid_mm",
        "last_mm",
        "near_mm",
        "static_ds",
    )
    *numbers, first_beyond, last_beyond, ends, counts = reader.fixed("9HbbBB")
    result = dict(zip(keys, numbers, strict=True))
    # An unknown kind of end counts as the edge of view: nothing is taken from it.
    result["first_end"] = name(ENDS, ends & 15, "view")
    result["last_end"] = name(ENDS, ends >> 4, "view")
    result["first_beyond_mm"], result["last_beyond_mm"] = beyond(first_beyond), beyond(last_beyond)
    result["touches"], result["narrow"] = bool(counts & 0x40), bool(counts & 0x80)
    result["contour_mm"] = [result["near_mm"] + 4 * point for point in reader.bytes(counts & 15)]
    necks = [reader.fixed("HB") for _ in range(counts >> 4 & 3)]
    result["necks"] = [{"step": step, "depth_mm": depth * 4} for step, depth in necks]
    return result


def unseen_span(reader):
    first_step, beams, near_mm, reason = reader.fixed("HHHB")
    return {
        "first_step": first_step,
        "beams": beams,
        "near_mm": None if near_mm == NO_RETURN else near_mm,
        "reason": name(REASONS, reason, "overflow"),
    }


def size(reader):
    """Of a candidate of a device that measures sizes; None where it knows none."""
    volume_l, top_cm = reader.fixed("HB")
    return {"volume_l": volume_l, "top_cm": top_cm} if top_cm else None


def health(reader):
    result = {
        "uptime_us": reader.varint(),
        "sequence": reader.varint(),
        "setup": reader.varint(),
        "background_version": reader.varint(),
        "sensor": name(SENSOR_CODES, reader.u8()),
        "sensor_detail": [reader.varint(), reader.varint()],
    }
    alarms = reader.varint()
    result["alarms"] = [alarm for bit, alarm in enumerate(ALARMS) if alarms >> bit & 1]
    result["storing"], result["subscribers"] = bool(reader.u8()), reader.u8()
    result["learning"] = reader.option(
        lambda: {
            "scans": reader.varint(),
            "of": reader.varint(),
            "restarts": reader.varint(),
            "moved": reader.option(lambda: [reader.varint(), reader.varint()]),
        }
    )
    # A newer module has more counters than are known here, an older one fewer.
    counters = reader.list(reader.varint)
    result["counters"] = {key: counters[at] if at < len(counters) else 0 for at, key in enumerate(COUNTERS)}
    result["suspects"] = reader.added_list(
        lambda: {"first_step": reader.varint(), "last_step": reader.varint(), "near_mm": reader.varint()}
    )
    result["events"] = reader.added_list(
        lambda: {
            "number": reader.varint(),
            "at_us": reader.varint(),
            "kind": name(EVENTS, reader.u8()),
            "background_version": reader.varint(),
            "by": ".".join(str(byte) for byte in reader.bytes(4)),
        }
    )
    return result


def info(reader):
    result = {"request_id": reader.fixed("I")[0], "version_min": reader.u8(), "version_max": reader.u8()}
    result.update((key, reader.text()) for key in ("firmware", "build", "board", "name"))
    result.update((key, reader.varint()) for key in ("uptime_us", "setup", "background_version"))
    result["sensor"] = reader.option(lambda: sensor_info(reader))
    return result


def sensor_info(reader):
    result = {key: reader.text() for key in ("model", "serial", "firmware")}
    result.update(
        (key, reader.varint())
        for key in (
            "first_step",
            "last_step",
            "cluster",
            "front_step",
            "steps_per_turn",
            "period_us",
            "range_min_mm",
            "range_max_mm",
        )
    )
    result["skip"] = reader.u8()
    result["open_range_mm"] = reader.varint()
    return result


def refused(reader):
    request_id, kind, code, one, two = reader.fixed("IBBBB")
    result = {"request_id": request_id, "kind": kind, "refusal": name(REFUSALS, code)}
    if code == 0:
        result["version_min"], result["version_max"] = one, two
    if code == 16:
        result["line"], result["fault"] = one, two
    if code == 21:
        result["fault"] = one
    return result


def cookie(reader):
    request_id, t1, value = reader.fixed("I8s8s")
    return {"request_id": request_id, "t1": t1.hex(), "cookie": value.hex()}


def subscribed(reader):
    request_id, t1, t2_us, t3_us, lease_ms, may_control, subscribers = reader.fixed("I8sQQHBB")
    return {
        "request_id": request_id,
        "t1": t1.hex(),
        "t2_us": t2_us,
        "t3_us": t3_us,
        "lease_ms": lease_ms,
        "may_control": bool(may_control),
        "subscribers": subscribers,
    }


def done(reader):
    return {"request_id": reader.fixed("I")[0]}


def settings(reader):
    return {"request_id": reader.fixed("I")[0], "text": reader.text()}


def receiving(reader):
    return dict(zip(("request_id", "next"), reader.fixed("II"), strict=True))


def absorbed(reader):
    return dict(zip(("request_id", "beams", "background_version"), reader.fixed("IHH"), strict=True))


def part_head(reader):
    return dict(zip(("object", "part", "parts", "first_step", "setup"), reader.fixed("IBBHH"), strict=True))


def profile_part(reader):
    result = part_head(reader)
    keys = ("far_mm", "near_mm", "spread_mm", "state")
    result["beams"] = reader.list(lambda: dict(zip(keys, reader.fixed("HHBB"), strict=True)))
    for beam in result["beams"]:
        beam["state"] = name(BEAM_STATES, beam["state"])
    return result


def raw_part(reader):
    result = part_head(reader)
    result.update(zip(("stamp_us", "sensor_ms", "uncertainty_us"), reader.fixed("QQI"), strict=True))
    result["ranges_mm"] = reader.list(lambda: reader.fixed("H")[0])
    return result


def pressed(reader):
    keys = (
        "sequence",
        "setup",
        "background_version",
        "stamp_us",
        "sensor_ms",
        "uncertainty_us",
        "lost_scans",
    )
    result = dict(zip(keys, reader.fixed("IHHQQII"), strict=True))
    columns, rows = reader.fixed("BB")
    down, faulty = reader.list(reader.u8), reader.list(lambda: reader.fixed("H")[0])
    panels = columns * rows
    known = all(code & 0x7FFF < panels for code in faulty) and len(faulty) <= 32
    if not 1 <= panels <= 1024 or len(down) != (panels + 7) // 8 or not known:
        raise Malformed("panels that the floor does not have")
    result["columns"], result["rows"] = columns, rows
    result["down"] = [panel for panel in range(panels) if down[panel // 8] >> panel % 8 & 1]
    result["faulty"] = [
        {"panel": code & 0x7FFF, "fault": "dead" if code >> 15 else "stuck"} for code in faulty
    ]
    return result


MESSAGES = {
    0x80: refused,
    0x81: cookie,
    0x82: subscribed,
    0x83: info,
    0x84: done,
    0x85: settings,
    0x86: absorbed,
    0x88: receiving,
    0x90: report,
    0x91: health,
    0x92: profile_part,
    0x93: raw_part,
    0x94: pressed,
}


def decode(datagram):
    """A datagram of a module as a dict. Raises Malformed."""
    if len(datagram) < HEADER.size or not datagram.startswith(MAGIC):
        raise Malformed("not a datagram of this protocol")
    _, version, boot, module, kind, _key, _counter, _tag = HEADER.unpack_from(datagram)
    read = MESSAGES.get(kind)
    if read is None:
        raise Malformed(f"not a kind of message that modules send here: {kind:#04x}")
    if version != VERSION and kind not in FROZEN:
        raise Malformed(f"the module speaks version {version} of the protocol")
    try:
        # Whatever follows the known fields comes from a newer version, and is passed over.
        message = read(Reader(datagram[HEADER.size :]))
    except UnicodeDecodeError as error:
        raise Malformed(str(error)) from error
    return {"message": read.__name__, "module": module.hex(":"), "boot": boot, **message}


def subscribe(request_id, value):
    """A subscribe request to any module; `value` is the cookie, 8 zeros in the first one."""
    header = HEADER.pack(MAGIC, VERSION, 0, bytes(6), 0x01, 0, 0, bytes(16))
    return header + struct.pack("<I8sQ", request_id, value, time.monotonic_ns() // 1000)


def listen(host, channel=None):
    """Subscribes to HOST[:PORT] every second; yields what the module sends."""
    host, _, port = host.partition(":")
    where = socket.getaddrinfo(host, int(port or PORT), type=socket.SOCK_DGRAM)[0]
    link = socket.socket(where[0], socket.SOCK_DGRAM)
    link.connect(where[4])
    value, request_id, due = bytes(8), int.from_bytes(os.urandom(4), "little"), 0.0
    is_said = False
    while True:
        try:
            if time.monotonic() >= due:
                due, request_id = time.monotonic() + 1.0, (request_id + 1) % 2**32
                request = subscribe(request_id, value)
                link.send(channel.seal(request) if channel else request)
                if channel and channel.unanswered > UNANSWERED and not is_said:
                    is_said = True
                    why = "the module answers, but opens no session: its key is another one"
                    print(f"kehai_wire.py: {why}", file=sys.stderr)
            if not select.select([link], [], [], max(0.0, due - time.monotonic()))[0]:
                continue
            datagram = link.recv(2048)
            if channel:
                datagram = channel.take(datagram)
                due = 0.0 if channel.is_due else due
                if datagram is None:
                    continue
            message = decode(datagram)
        except (Malformed, ConnectionError) as error:
            print(f"kehai_wire.py: {error}", file=sys.stderr)
            continue
        if message["message"] == "cookie":
            value, due = bytes.fromhex(message["cookie"]), 0.0
        yield message


def datagram_of(path):
    """The bytes of a file, or those its hexadecimal text stands for."""
    with open(path, "rb") as file:
        data = file.read()
    return data if data.startswith(MAGIC) else bytes.fromhex(data.decode("ascii"))


def main():
    parser = argparse.ArgumentParser(description="Decodes what a kehai module sends into JSON.")
    parser.add_argument("file", nargs="*", help="a datagram, raw bytes or hexadecimal text")
    parser.add_argument("--listen", metavar="HOST[:PORT]", help="subscribe to the module at this address")
    parser.add_argument(
        "--key", metavar="ID:HEX", help="a key of that module, as kehai-tracker module key says it"
    )
    arguments = parser.parse_args()
    if not arguments.file and not arguments.listen:
        parser.error("give files, or --listen HOST[:PORT]")
    try:
        for path in arguments.file:
            print(json.dumps(decode(datagram_of(path)), ensure_ascii=False))
        channel = None
        if arguments.key:
            from kehai_seal import Channel

            key_id, _, key = arguments.key.partition(":")
            channel = Channel(int(key_id), bytes.fromhex(key))
        for message in listen(arguments.listen, channel) if arguments.listen else ():
            print(json.dumps(message, ensure_ascii=False), flush=True)
    except (OSError, ValueError) as error:
        sys.exit(f"kehai_wire.py: {error}")
    except KeyboardInterrupt:
        pass


if __name__ == "__main__":
    main()
