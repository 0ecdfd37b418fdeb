"""Judges a recording as viewers read it: foxglove.py RECORDING.mcap SCHEMAS.json

    mcap (PyPI) ─▶ each message ─┬─ against the schema beside it in the file
                                 └─ foxglove.…: against Foxglove's own, of npm @foxglove/schemas
    LaserScan    ─▶ also decoded by Foxglove's own protobuf classes

Prints a line of JSON: how many messages each derived topic has, the beams that were known and unknown, and how many bytes are
derived and not. Status 1 and what is wrong, if anything is.
"""

import json
import math
import sys
from collections import Counter

from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from jsonschema import Draft7Validator
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

# What Lichtblick takes as the type of a field.
SIMPLE = {"boolean", "string", "number", "integer"}


def time(stamp) -> dict:
    """A time of protobuf as it stands in JSON."""
    return {"sec": stamp.seconds, "nsec": stamp.nanos}


def plain(message) -> dict:
    """A scan as it stands in JSON; NaN stays."""
    fields = {field.name: getattr(message, field.name) for field in message.DESCRIPTOR.fields}
    pose = {
        part: {
            field.name: getattr(getattr(message.pose, part), field.name) for field in kind.DESCRIPTOR.fields
        }
        for part, kind in [("position", message.pose.position), ("orientation", message.pose.orientation)]
    }
    lists = {name: list(fields[name]) for name in ["ranges", "intensities"]}
    return {**fields, **lists, "timestamp": time(message.timestamp), "pose": pose}


def readable(schema: dict, path: str) -> None:
    """Fails where Lichtblick would refuse a schema: it knows an object by its fields, and lists of anything but lists."""
    kind = schema.get("type")
    if kind == "object":
        for name, field in schema["properties"].items():
            readable(field, f"{path}.{name}")
    elif kind == "array" and schema["items"].get("type") != "array":
        readable(schema["items"], f"{path}[]")
    elif kind not in SIMPLE:
        raise ValueError(f"viewers cannot read {path}: {schema}")


def main(recording: str, schemas: str) -> None:
    """Judges it."""
    with open(schemas, encoding="utf-8") as file:
        theirs = {schema["title"]: Draft7Validator(schema) for schema in json.load(file).values()}
    own: dict[int, Draft7Validator] = {}
    topics, beams, sizes = Counter(), Counter(), Counter()
    decoder = DecoderFactory()
    with open(recording, "rb") as file:
        # Its checksums and lengths are judged, too.
        messages = make_reader(file, validate_crcs=True).iter_messages(log_time_order=False)
        for schema, channel, message in messages:
            is_derived = channel.metadata.get("derived") == "true"
            sizes["derived" if is_derived else "recorded"] += len(message.data)
            if schema is None:
                continue
            if is_derived != schema.name.startswith("foxglove."):
                raise ValueError(f"{channel.topic} has {schema.name}, and metadata {channel.metadata}")
            if schema.encoding == "protobuf":
                scan = decoder.decoder_for("protobuf", schema)(message.data)
                value = plain(scan)
                official = plain(LaserScan.FromString(message.data))
                if repr(value) != repr(official):
                    raise ValueError(f"{channel.topic}: {value} is read as {official}")
                unknown = sum(math.isnan(range_m) for range_m in value["ranges"])
                beams["unknown"] += unknown
                beams["known"] += len(value["ranges"]) - unknown
                if not all(math.isnan(range_m) or range_m > 0 for range_m in value["ranges"]):
                    raise ValueError(f"{channel.topic} has a range of 0")
            else:
                value = json.loads(message.data)
                if schema.id not in own:
                    definition = json.loads(schema.data)
                    readable(definition, schema.name)
                    own[schema.id] = Draft7Validator(definition)
                own[schema.id].validate(value)
            if is_derived:
                theirs[schema.name].validate(value)
                topics[channel.topic] += 1
    print(json.dumps({"topics": topics, "beams": beams, "bytes": sizes}))


if __name__ == "__main__":
    main(*sys.argv[1:])
