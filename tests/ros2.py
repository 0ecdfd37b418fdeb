"""Judges what the tracker publishes to ROS 2, as a node with rmw_zenoh would take it: ros2.py ROUTER_PORT DOMAIN http://MAP

    zenoh-ros2-sdk (PyPI) ─▶ which topics there are, of which node, with which QoS
    rosbags (PyPI)        ─▶ hashes of the types, from their definitions; every message, decoded, and encoded to the same bytes
    the tracker's own GET /api/state ─▶ where people are, and what is known of them, at the same millisecond
    zenoh.ext's advanced subscriber  ─▶ /tf_static, long after it was said

It listens until a line comes on its standard input, says what it has heard as a line of JSON, and goes on until the input ends. Status 1
and what is wrong, if anything is.
"""

import json
import math
import os
import sys
import threading
import time
import traceback
import urllib.request
from collections import Counter

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from zenoh.ext import HistoryConfig, declare_advanced_subscriber
from zenoh_ros2_sdk import ROS2Subscriber
from zenoh_ros2_sdk.attachment import Attachment
from zenoh_ros2_sdk.discovery import get_topic_info, get_topic_names_and_types
from zenoh_ros2_sdk.keyexpr import topic_keyexpr
from zenoh_ros2_sdk.qos import QosDurability, QosProfile
from zenoh_ros2_sdk.session import ZenohSession
from zenoh_ros2_sdk.utils import compute_type_hash_from_msg, ros2_to_dds_type

HOST = "127.0.0.1"
PATIENCE_S = 60

PEOPLE = "people_msgs/msg/People"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
SCAN = "sensor_msgs/msg/LaserScan"
TOPICS = {
    "/people": PEOPLE,
    "/kehai/markers": "visualization_msgs/msg/MarkerArray",
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    "/tf_static": TRANSFORMS,
}

# Not in the distribution, but from https://github.com/wg-perception/people, branch ros2.
DEFINITIONS = {
    PEOPLE: "std_msgs/Header header\npeople_msgs/Person[] people\n",
    "people_msgs/msg/Person": "string name\ngeometry_msgs/Point position\ngeometry_msgs/Point velocity\n"
    "float64 reliability\nstring[] tagnames\nstring[] tags\n",
}


class Wrong(Exception):
    """What is not as it should be."""


def check(is_right: bool, *what) -> None:
    """Fails with `what` unless it is right."""
    if not is_right:
        raise Wrong(" ".join(str(part) for part in what))


def near(one: float, other: float) -> bool:
    """Whether two figures are the same but for the rounding of single precision."""
    return math.isclose(one, other, rel_tol=1e-6, abs_tol=1e-6)


class Heard:
    """A topic as a node subscribes to it, and each message of it."""

    def __init__(self, judge: "Judge", topic: str, kind: str) -> None:
        self.store, self.topic, self.kind = judge.store, topic, kind
        self.messages, self.last, self.gid, self.first = [], 0, None, 0
        self.wrong: Wrong | None = None
        key = topic_keyexpr(judge.domain, topic, ros2_to_dds_type(kind), judge.store.hash_rihs01(kind))
        self.subscriber = judge.session.session.declare_subscriber(key, self.take)

    def take(self, sample) -> None:
        """Judges a message; Zenoh's thread calls it, so that what is wrong is kept."""
        try:
            self.judge(sample)
        except Exception as error:  # noqa: BLE001
            self.wrong = self.wrong or Wrong(f"{self.topic}: {error!r}")

    def judge(self, sample) -> None:
        """Attachment, head and layout."""
        payload = sample.payload.to_bytes()
        check(payload[:4] == b"\x00\x01\x00\x00", "head", payload[:4])
        attachment = sample.attachment.to_bytes()
        check(len(attachment) == 33, "attachment", attachment)
        said = Attachment.from_bytes(attachment)
        check(len(said.gid) == 16 and self.gid in (None, said.gid), "gid", said.gid)
        # One may be dropped where Zenoh has no room at once.
        check(said.sequence_id > self.last, "number", said.sequence_id, "after", self.last)
        check(abs(said.timestamp_ns * 1e-9 - time.time()) < PATIENCE_S, "sent", said.timestamp_ns)
        self.first = self.first or said.sequence_id
        self.last, self.gid = said.sequence_id, said.gid
        message = self.store.deserialize_cdr(payload, self.kind)
        check(bytes(self.store.serialize_cdr(message, self.kind)) == payload, "not the bytes of rosbags")
        self.messages.append(message)


class Judge:
    """Everything that is heard, and what the tracker itself says meanwhile."""

    def __init__(self, port: int, domain: int, tracker: str) -> None:
        self.port, self.domain, self.tracker = port, domain, tracker
        self.store = get_typestore(Stores.ROS2_JAZZY)
        for kind, definition in DEFINITIONS.items():
            self.store.register(get_types_from_msg(definition, kind))
        self.session = ZenohSession.get_instance(HOST, port)
        # So that it gets no definitions from elsewhere.
        self.session.store = self.store
        self.session._registered_types = {kind: kind for kind in self.store.types}
        self.states: dict[int, dict] = {}
        self.tf_late: list = []
        self.late: dict = {}
        threading.Thread(target=self.poll, daemon=True).start()

    def poll(self) -> None:
        """Asks the tracker what it knows, more often than it finds out."""
        while True:
            try:
                with urllib.request.urlopen(f"{self.tracker}/api/state", timeout=PATIENCE_S) as answer:
                    state = json.load(answer)
            except OSError:
                # It has ended.
                return
            self.states[state["unix_ms"]] = state
            time.sleep(0.03)

    def graph(self) -> list[str]:
        """The topics as `ros2 topic list` and `ros2 topic info` show them; those of scans."""
        begun, names = time.time(), {}
        while not TOPICS.keys() <= names.keys():
            check(time.time() - begun < PATIENCE_S, "topics", names)
            names = dict(get_topic_names_and_types(self.domain, HOST, self.port))
        for topic, kind in TOPICS.items():
            check(names[topic] == [kind], topic, names[topic])
            # While the tracker and this program find a way without the router, a question may find nobody.
            while not (
                info := get_topic_info(topic, self.domain, HOST, self.port, timeout=2.0, verbose=True)
            ):
                check(time.time() - begun < PATIENCE_S, "no", topic)
            check(info.publisher_count == 1, topic, info)
            publisher = info.publishers[0]
            check(publisher.node_name.strip("/") == "kehai_tracker", publisher)
            check(publisher.node_namespace.strip("/") == "", publisher)
            check(publisher.type_hash == self.store.hash_rihs01(kind), publisher, kind)
            qos = QosProfile.decode(publisher.qos)
            durability = QosDurability.TRANSIENT_LOCAL if topic == "/tf_static" else QosDurability.VOLATILE
            depth = 1 if topic == "/tf_static" else 10
            check((qos.durability, qos.history_depth) == (durability, depth), publisher)
        for kind in [*TOPICS.values(), SCAN]:
            parts = {part: self.definition(part) for part in self.parts(kind)}
            own = compute_type_hash_from_msg(kind, self.definition(kind), parts)
            check(own == self.store.hash_rihs01(kind), "the two judges differ about", kind, own)
        while not (nodes := self.nodes()):
            check(time.time() - begun < PATIENCE_S, "no node")
        check(len(nodes) == 1, "nodes", [str(node.ok.key_expr) for node in nodes])
        check(str(nodes[0].ok.key_expr).endswith("/0/0/NN/%/%/kehai_tracker"), nodes[0].ok.key_expr)
        return sorted(topic for topic, kinds in names.items() if kinds == [SCAN])

    def nodes(self) -> list:
        """The nodes of the domain that answer: none while the tracker and this program change their way, see above."""
        return list(self.session.liveliness.get(f"@ros2_lv/{self.domain}/*/*/*/NN/**", timeout=2.0))

    def parts(self, kind: str) -> set[str]:
        """The types within a type."""
        own = {named for _, field in self.store.fielddefs[kind][1] for named in names(field)}
        return own.union(*(self.parts(part) for part in own))

    def definition(self, kind: str) -> str:
        """The text of a type, without those in it."""
        return DEFINITIONS.get(kind) or self.store.generate_msgdef(kind, ros_version=2)[0].split("=" * 80)[0]

    def gone(self) -> float:
        """Waits until the tracker has left; how long that took, s."""
        begun = time.time()
        # The SDK's own subscription is left.
        while (names := dict(get_topic_names_and_types(self.domain, HOST, self.port))).keys() - {
            "/tf_static"
        }:
            check(time.time() - begun < PATIENCE_S, "it is still there", names)
        # The SDK waits a moment for answers: on a busy machine none may have come, or not all.
        while (
            info := get_topic_info("/tf_static", self.domain, HOST, self.port)
        ) is None or info.publisher_count:
            check(time.time() - begun < PATIENCE_S, "transforms are still there", info)
        return time.time() - begun

    def listen_late(self) -> None:
        """Subscribes to transforms long after they were said, as rmw_zenoh does, and as the SDK does.

        Each asks once for what was said, the SDK for two seconds: on a busy machine no answer may have come. Those that have heard nothing
        subscribe anew.
        """
        type_hash = self.store.hash_rihs01(TRANSFORMS)
        key = topic_keyexpr(self.domain, "/tf_static", ros2_to_dds_type(TRANSFORMS), type_hash)
        take = self.tf_late.append

        def decode(sample) -> None:
            take(("zenoh.ext", self.store.deserialize_cdr(sample.payload.to_bytes(), TRANSFORMS)))

        def advanced():
            history = HistoryConfig(detect_late_publishers=True, max_samples=1)
            return declare_advanced_subscriber(self.session.session, key, decode, history=history)

        def sdk():
            return ROS2Subscriber(
                "/tf_static",
                TRANSFORMS,
                lambda message: take(("zenoh-ros2-sdk", message)),
                msg_definition=None,
                domain_id=self.domain,
                router_ip=HOST,
                router_port=self.port,
                type_hash=type_hash,
                qos=QosProfile(durability=QosDurability.TRANSIENT_LOCAL, history_depth=1),
            )

        subscribe = {"zenoh.ext": advanced, "zenoh-ros2-sdk": sdk}
        for by in subscribe.keys() - {by for by, _ in self.tf_late}:
            self.late[by] = subscribe[by]()


def names(field: tuple) -> list[str]:
    """The type that a field has, or its elements, if it has a name."""
    node, what = field
    if node == Nodetype.NAME:
        return [what]
    return names(what[0]) if node in (Nodetype.ARRAY, Nodetype.SEQUENCE) else []


def stamp_ms(header) -> int:
    """When a message was true."""
    return header.stamp.sec * 1000 + header.stamp.nanosec // 1_000_000


def counted(state: dict) -> list[dict]:
    """Those who are persons."""
    return [track for track in state["tracks"] if track["state"] != "tentative"]


def judge_people(messages: list, states: dict[int, dict]) -> Counter:
    """People are where the tracker says, and nobody is said only where that is known."""
    figures = Counter()
    said = {stamp_ms(message.header): message for message in messages}
    for at_ms, message in said.items():
        check(message.header.frame_id == "map", message.header)
        state = states.get(at_ms)
        if state is None:
            continue
        tracks = {f"track-{track['id']}": track for track in counted(state)}
        check({person.name for person in message.people} == tracks.keys(), "people", message, tracks)
        figures["matched"] += 1
        if not tracks:
            check(state["total"] == {"count": 0, "state": "known"}, "a false empty", state["total"])
            figures["empty"] += 1
        for person in message.people:
            track = tracks[person.name]
            place = (person.position.x, person.position.y, person.position.z)
            check(place == (track["x"], track["y"], 0.0), person, track)
            velocity = (person.velocity.x, person.velocity.y, person.velocity.z)
            check(velocity == (track["vx"], track["vy"], 0.0), person, track)
            check(person.reliability == track["existence"], person, track)
            tags = dict(zip(person.tagnames, person.tags, strict=True))
            state_of = {"confirmed": "seen", "occluded": "occluded"}[track["state"]]
            check(tags["state"] == state_of, tags, track)
            if not near(track["x"], 2.5):
                check(tags.get("zone") == ("left" if track["x"] < 2.5 else "right"), tags, track)
            figures[f"persons {state_of}"] += 1
    begun_ms, ended_ms = min(said, default=math.inf), max(said, default=0)
    for at_ms, state in states.items():
        if at_ms in said:
            continue
        is_silent = not counted(state) and state["total"] != {"count": 0, "state": "known"}
        figures["silent"] += is_silent
        # Between the first and the last, each other one was to be said.
        check(is_silent or not begun_ms < at_ms < ended_ms, "not published", at_ms, state["total"])
    return figures


def judge_markers(messages: list, states: dict[int, dict]) -> Counter:
    """A cylinder for each person at its place, a strip and words for each zone."""
    figures = Counter()
    for message in messages:
        check(all(marker.header.frame_id == "map" for marker in message.markers), "frame")
        ids = [(marker.ns, marker.id) for marker in message.markers]
        check(len(set(ids)) == len(ids), "a marker stands there twice", ids)
        by = {(marker.ns, marker.id): marker for marker in message.markers}
        state = states.get(stamp_ms(message.markers[0].header))
        if state is None:
            continue
        figures["matched"] += 1
        tracks = {track["id"]: track for track in counted(state)}
        check({number for ns, number in ids if ns == "people"} == tracks.keys(), ids, tracks)
        for number, track in tracks.items():
            body = by["people", number]
            check(body.type == body.CYLINDER and body.action == body.ADD, body)
            check((body.pose.position.x, body.pose.position.y) == (track["x"], track["y"]), body, track)
            check(by["names", number].text == str(number), by["names", number])
            figures["bodies"] += 1
            arrow = by.get(("velocity", number))
            check((arrow is not None) == (math.hypot(track["vx"], track["vy"]) > 0.2), arrow, track)
        for number, zone in enumerate(["left", "right"]):
            count = state["zones"].get(zone, {}).get("count")
            check(
                by["counts", number].text == f"{zone}: {'?' if count is None else count}",
                by["counts", number],
            )
            strip = by["zones", number]
            check(strip.type == strip.LINE_STRIP and len(strip.points) == 5, strip)
            figures["unknown zones"] += count is None
    return figures


def judge_diagnostics(messages: list, states: dict[int, dict]) -> Counter:
    """What is known, and how each module is."""
    figures = Counter()
    levels = {"known": 0, "partly": 1, "unknown": 3}
    for message in messages:
        state = states.get(stamp_ms(message.header))
        if state is None:
            continue
        # rosbags has a byte as a number.
        by = {status.name: status for status in message.status}
        people = by["kehai_tracker: people"]
        check(people.level == levels[state["total"]["state"]], people, state["total"])
        figures["matched"] += 1
        for module in state["modules"]:
            status = by[f"kehai_tracker: module {module['name']}"]
            check((status.level == 3) == (module["state"] == "missing"), status, module)
            if module["state"] == "watching" and not module["alarms"]:
                check(status.level == 0, status)
                figures["watching"] += 1
            figures["missing"] += module["state"] == "missing"
    return figures


def judge_scans(messages: list) -> Counter:
    """Free space within the sensor's range."""
    figures = Counter()
    for scan in messages:
        count = len(scan.ranges)
        check(near(scan.angle_min + (count - 1) * scan.angle_increment, scan.angle_max) or count == 0, scan)
        for range_m in scan.ranges.tolist():
            check(math.isnan(range_m) or 0 < range_m <= scan.range_max, range_m, scan.range_max)
            figures["known" if not math.isnan(range_m) else "unknown"] += 1
        figures["scans"] += 1
    return figures


def judge_transforms(late: list) -> dict:
    """The modules' places."""
    places = {}
    for _, message in late:
        for transform in message.transforms:
            check(transform.header.frame_id == "map", transform)
            move, turn = transform.transform.translation, transform.transform.rotation
            yaw_deg = math.degrees(2 * math.atan2(turn.z, turn.w))
            places[transform.child_frame_id] = [
                round(value, 3) for value in (move.x, move.y, move.z, yaw_deg)
            ]
    return places


def main(port: str, domain: str, tracker: str) -> None:
    """Listens and judges."""
    judge = Judge(int(port), int(domain), tracker)
    scans = judge.graph()
    heard = {topic: Heard(judge, topic, kind) for topic, kind in TOPICS.items()}
    print(json.dumps({"scans": scans}), flush=True)
    scan = None
    for line in sys.stdin:
        if line.strip() == "scan":
            judge.listen_late()
            scan = Heard(judge, scans[0], SCAN)
        elif line.strip() == "no scan":
            scan.subscriber.undeclare()
        elif line.strip() == "gone":
            print(json.dumps({"gone_s": judge.gone()}), flush=True)
            continue
        elif scan:
            judge.listen_late()
        # What was answered last is of before what was heard last.
        time.sleep(0.3)
        everything = [*heard.values(), *([scan] if scan else [])]
        for topic in everything:
            if topic.wrong:
                raise topic.wrong
        states = dict(judge.states)
        of = {topic: list(heard[topic].messages) for topic in TOPICS}
        said = {
            "people": judge_people(of["/people"], states),
            "markers": judge_markers(of["/kehai/markers"], states),
            "diagnostics": judge_diagnostics(of["/diagnostics"], states),
            "transforms": judge_transforms(list(judge.tf_late)),
            "late": sorted({by for by, _ in judge.tf_late}),
            "scan": judge_scans(scan.messages) if scan else {},
            "first_scan": scan.first if scan else 0,
            "total": states[max(states)]["total"],
        }
        print(json.dumps(said), flush=True)


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    finally:
        # The threads of subscribers never end, and an ordinary exit after a fault waits for them.
        fault = sys.exc_info()[1]
        if fault is not None:
            traceback.print_exception(fault)
            sys.stderr.flush()
            os._exit(1)
