"""Scores made-up runs with py-motmetrics, TrackEval and small computations of its own.

    score_reference.py make  FOLDER     writes NAME-truth.jsonl and NAME-tracks.jsonl for every case, from fixed seeds
    score_reference.py score FOLDER     prints {"NAME": {figure: value}, ..., "pooled": {...}} as JSON

`score_reference.rs` runs both and compares with kehai-sim. Nothing here is shared with the Rust code: pairs come
from SciPy's assignment, CLEAR MOT and its pairs from py-motmetrics, HOTA and IDF1 from TrackEval, GOSPA from
trying every assignment, the rest from its definition.
"""

import itertools
import json
import math
import pathlib
import random
import sys

GATE_M = 0.5
# Name: seed, region of interest or None.
CASES = {
    "calm": (1, None),
    "crowd": (2, None),
    "swaps": (3, None),
    "gaps": (4, None),
    "clutter": (5, None),
    "edge": (6, (-1.5, -1.5, 1.5, 1.5)),
    "edge-swaps": (7, (-1.0, -2.0, 2.0, 1.0)),
    "nobody": (8, None),
    "blind": (9, None),
}
POOLED = ["crowd", "swaps", "gaps", "clutter"]


def make(folder):
    """Writes every case."""
    for name, (seed, _) in CASES.items():
        rng = random.Random(seed)
        truth, tracks = run(name, rng)
        for kind, key, lines in (("truth", "people", truth), ("tracks", "tracks", tracks)):
            with open(folder / f"{name}-{kind}.jsonl", "w", encoding="utf-8") as out:
                frames = enumerate(lines)
                out.writelines(json.dumps({"t": round(i * 0.1, 1), key: line}) + "\n" for i, line in frames)


def run(name, rng):
    """People who wander, and what a bad tracker makes of them."""
    people = {}
    for number in range(0 if name == "nobody" else 2 if name == "calm" else rng.randint(5, 7)):
        start = rng.randrange(60)
        people[100 + number] = {
            "at": [rng.uniform(-2, 2), rng.uniform(-2, 2)],
            "stay": (start, start + rng.randrange(80, 200)),
            "track": None,
            "lost_until": 0,
        }
    jitter = 0.03 if name == "calm" else 0.16
    next_track, ghosts = 1, []
    truth, tracks = [], []
    for index in range(220):
        here = []
        for number, person in people.items():
            if not person["stay"][0] <= index < person["stay"][1]:
                continue
            person["at"] = [place + rng.gauss(0, 0.06) - 0.01 * place for place in person["at"]]
            here.append((number, person))
        if name in ("swaps", "edge-swaps") and len(here) > 1 and rng.random() < 0.08:
            (_, one), (_, other) = rng.sample(here, 2)
            one["track"], other["track"] = other["track"], one["track"]
        line = []
        for _, person in here:
            if rng.random() < (0.002 if name == "calm" else 0.02):
                person["lost_until"] = index + rng.randrange(2, 25)
                if name == "gaps" or rng.random() < 0.3:
                    person["track"] = None
            if name == "blind" or index < person["lost_until"]:
                continue
            if person["track"] is None:
                person["track"], next_track = next_track, next_track + 1
            if rng.random() > 0.05:
                line.append(estimate(rng, person["track"], person["at"], jitter))
        if name in ("clutter", "edge", "nobody") and rng.random() < 0.1:
            ghosts.append(
                (next_track, [rng.uniform(-3, 3), rng.uniform(-3, 3)], index + rng.randrange(3, 20))
            )
            next_track += 1
        ghosts = [ghost for ghost in ghosts if ghost[2] > index]
        line += [estimate(rng, track, at, 0.05) for track, at, _ in ghosts]
        if rng.random() < 0.02:
            line = []
        rng.shuffle(line)
        # Numbers may stand for one track only within a line.
        line = list({track["id"]: track for track in line}.values())
        truth.append(
            [
                {"id": number, "x": person["at"][0], "y": person["at"][1], "beams": rng.randrange(30)}
                for number, person in here
            ]
        )
        tracks.append(line)
    return truth, tracks


def estimate(rng, track, at, jitter):
    """A track somewhere near a place."""
    xx, yy = rng.uniform(0.5, 2) * jitter**2, rng.uniform(0.5, 2) * jitter**2
    xy = rng.uniform(-0.9, 0.9) * math.sqrt(xx * yy)
    if rng.random() < 0.01:
        xx = -xx
    return {
        "id": track,
        "x": at[0] + rng.gauss(0, jitter),
        "y": at[1] + rng.gauss(0, jitter),
        "cov": [xx, xy, yy],
        "state": rng.choice(
            ["confirmed", "confirmed", "occluded", "tentative"] if track % 5 == 0 else ["confirmed"]
        ),
    }


def read(path):
    """The lines of a file."""
    with open(path, encoding="utf-8") as lines:
        return [json.loads(line) for line in lines]


def distances(people, tracks):
    """Of everybody from every track."""
    import numpy as np

    return np.array(
        [[math.hypot(p["x"] - t["x"], p["y"] - t["y"]) for t in tracks] for p in people], dtype=float
    ).reshape(len(people), len(tracks))


def judged(people, tracks, region):
    """Drops what the rule of the region drops."""
    from scipy.optimize import linear_sum_assignment

    tracks = [track for track in tracks if track["state"] != "tentative"]
    if region is None:
        return people, tracks
    inside = lambda place: region[0] < place["x"] < region[2] and region[1] < place["y"] < region[3]
    far = distances(people, tracks)
    # A pair beyond the gate costs more than all others together.
    far[far > GATE_M] = 1e4
    owner = {}
    for row, column in zip(*linear_sum_assignment(far), strict=True):
        if far[row, column] <= GATE_M:
            owner[column] = people[row]
    tracks = [track for index, track in enumerate(tracks) if inside(owner.get(index, track))]
    return [person for person in people if inside(person)], tracks


def gospa(far):
    """The best of all assignments with c = 1 m, p = 2: (GOSPA, localisation, missed, false)."""
    rows, columns = far.shape
    best = (math.inf, 0, 0, 0)
    for size in range(min(rows, columns) + 1):
        for some in itertools.combinations(range(rows), size):
            for others in itertools.permutations(range(columns), size):
                near = [far[row, column] for row, column in zip(some, others, strict=True)]
                if any(distance >= 1 for distance in near):
                    continue
                parts = sum(distance**2 for distance in near), (rows - size) / 2, (columns - size) / 2
                best = min(best, (math.sqrt(sum(parts)), *parts))
    return best


def dynamic_gospa(far):
    """The same by dynamic programming over the tracks that are taken: for frames with many."""
    rows, columns = far.shape
    states = {0: (0.0, 0)}
    for row in range(rows):
        after = dict(states)
        for taken, (saved, pairs) in states.items():
            for column in range(columns):
                if not taken >> column & 1 and far[row, column] < 1:
                    key = taken | 1 << column
                    new = (saved + 1 - far[row, column] ** 2, pairs + 1)
                    if key not in after or after[key][0] < new[0]:
                        after[key] = new
        states = after
    saved, pairs = max(states.values())
    parts = pairs - saved, (rows - pairs) / 2, (columns - pairs) / 2
    return (math.sqrt(max(sum(parts), 0)), *parts)


def share(part, whole):
    """None where there is no whole."""
    return float(part) / float(whole) if whole else None


def score(folder):
    """Every figure of every case."""
    cases = {name: frames(folder, name, region) for name, (_, region) in CASES.items()}
    result = {name: figures([case]) for name, case in cases.items()}
    result["pooled"] = figures([cases[name] for name in POOLED])
    json.dump(result, sys.stdout)


def frames(folder, name, region):
    """(people, tracks, number counted right) of every frame that is judged."""
    lines = zip(read(folder / f"{name}-truth.jsonl"), read(folder / f"{name}-tracks.jsonl"), strict=True)
    case = []
    for truth, tracks in lines:
        confirmed = [track for track in tracks["tracks"] if track["state"] != "tentative"]
        inside = lambda place: (
            not region or (region[0] < place["x"] < region[2] and region[1] < place["y"] < region[3])
        )
        surplus = sum(map(inside, confirmed)) - sum(map(inside, truth["people"]))
        case.append((*judged(truth["people"], tracks["tracks"], region), surplus))
    return case


def figures(cases):
    """Of one run or of many pooled."""
    every = [frame for case in cases for frame in case]
    number = len(every)
    people = sum(len(frame[0]) for frame in every)
    tracks = sum(len(frame[1]) for frame in every)
    result = {
        "frames": number,
        "people": people,
        "tracks": tracks,
        "exact_count_rate": share(sum(frame[2] == 0 for frame in every), number),
        "over_count": share(sum(max(frame[2], 0) for frame in every), number),
        "under_count": share(sum(max(-frame[2], 0) for frame in every), number),
        "lost": sum(
            int((far > GATE_M).all(axis=1).sum()) for far in (distances(*frame[:2]) for frame in every)
        ),
    }
    parts = [best_gospa(distances(*frame[:2])) for frame in every]
    for index, name in enumerate(["gospa_m", "gospa_localisation_m2", "gospa_missed_m2", "gospa_false_m2"]):
        result[name] = share(sum(part[index] for part in parts), number)
    result.update(clear(cases))
    result.update(hota_and_identity(cases))
    return result


def best_gospa(far):
    """By trying everything where that is little; the two ways must agree."""
    fast = dynamic_gospa(far)
    if max(far.shape) <= 4:
        assert all(abs(a - b) < 1e-9 for a, b in zip(fast, gospa(far), strict=True)), (fast, gospa(far))
    return fast


def clear(cases):
    """CLEAR MOT from py-motmetrics, and from its pairs all that is said of pairs."""
    import motmetrics
    import numpy as np

    accumulators, pairs = [], []
    own_track, own_person = [], []
    for case in cases:
        accumulator = motmetrics.MOTAccumulator()
        for index, (people, tracks, _) in enumerate(case):
            far = distances(people, tracks)
            far[far > GATE_M] = np.nan
            accumulator.update([p["id"] for p in people], [t["id"] for t in tracks], far, frameid=index)
        accumulators.append(accumulator)
        together, events = {}, accumulator.mot_events
        for (index, _), event in events[events.Type.isin(["MATCH", "SWITCH"])].iterrows():
            people, tracks, _ = case[index]
            pairs.append(
                (
                    next(p for p in people if p["id"] == event.OId),
                    next(t for t in tracks if t["id"] == event.HId),
                )
            )
            key = (int(event.OId), int(event.HId))
            together[key] = together.get(key, 0) + 1
        for side, own in ((0, own_person), (1, own_track)):
            lives = {}
            for frame in case:
                for one in frame[side]:
                    lives[one["id"]] = lives.get(one["id"], 0) + 1
            for one, life in lives.items():
                own.append(max([n for key, n in together.items() if key[side] == one], default=0) / life)
    names = [
        "num_misses",
        "num_false_positives",
        "num_switches",
        "num_objects",
        "num_detections",
        "num_matches",
        "mota",
        "motp",
        "idf1",
        "idp",
        "idr",
        "precision",
        "recall",
    ]
    handler = motmetrics.metrics.create()
    table = handler.compute_many(accumulators, metrics=names, generate_overall=True).loc["OVERALL"]
    value = lambda name: None if math.isnan(table[name]) or math.isinf(table[name]) else float(table[name])
    pairs_of = lambda seen: [
        math.hypot(p["x"] - t["x"], p["y"] - t["y"]) for p, t in pairs if seen(p["beams"])
    ]
    rms = lambda errors: math.sqrt(sum(error**2 for error in errors) / len(errors)) if errors else None
    visible, hidden = pairs_of(lambda beams: beams >= 10), pairs_of(lambda beams: beams < 10)
    nees = []
    for person, track in pairs:
        xx, xy, yy = track["cov"]
        covariance = np.array([[xx, xy], [xy, yy]])
        if (np.linalg.eigvalsh(covariance) > 0).all():
            error = np.array([track["x"] - person["x"], track["y"] - person["y"]])
            nees.append(float(error @ np.linalg.solve(covariance, error)))
    from scipy.stats import chi2

    detected = int(table["num_detections"])
    return {
        "misses": int(table["num_misses"]),
        "false_tracks": int(table["num_false_positives"]),
        "id_switches": int(table["num_switches"]),
        "mota": value("mota"),
        "motp_m": value("motp"),
        "detection_precision": share(detected, detected + table["num_false_positives"]),
        "detection_recall": share(detected, table["num_objects"]),
        "motmetrics_idf1": value("idf1"),
        "motmetrics_idp": value("idp"),
        "motmetrics_idr": value("idr"),
        "trajectory_precision": share(sum(own_track), len(own_track)),
        "trajectory_recall": share(sum(own_person), len(own_person)),
        "rms_visible_m": rms(visible),
        "visible_pairs": len(visible),
        "rms_hidden_m": rms(hidden),
        "hidden_pairs": len(hidden),
        "nees_pairs": len(pairs),
        "nees_improper": len(pairs) - len(nees),
        "nees_coverage": share(sum(value <= chi2.ppf(0.95, 2) for value in nees), len(pairs)),
        "nees_mean": share(sum(nees), len(nees)),
    }


def hota_and_identity(cases):
    """From TrackEval, over similarities 1 − d."""
    import numpy as np
    import trackeval

    def data(case):
        people = {one["id"]: None for frame in case for one in frame[0]}
        tracks = {one["id"]: None for frame in case for one in frame[1]}
        row, column = ({one: index for index, one in enumerate(ids)} for ids in (people, tracks))
        return {
            "num_timesteps": len(case),
            "num_gt_ids": len(people),
            "num_tracker_ids": len(tracks),
            "num_gt_dets": sum(len(frame[0]) for frame in case),
            "num_tracker_dets": sum(len(frame[1]) for frame in case),
            "gt_ids": [np.array([row[p["id"]] for p in frame[0]], dtype=int) for frame in case],
            "tracker_ids": [np.array([column[t["id"]] for t in frame[1]], dtype=int) for frame in case],
            "similarity_scores": [np.maximum(0, 1 - distances(*frame[:2])) for frame in case],
        }

    together = [data(case) for case in cases]
    result = {}
    hota = trackeval.metrics.HOTA()
    identity = trackeval.metrics.Identity({"THRESHOLD": 1 - GATE_M, "PRINT_CONFIG": False})
    for metric, names in (
        (hota, {"hota": "HOTA", "det_a": "DetA", "ass_a": "AssA"}),
        (identity, {"idf1": "IDF1", "id_precision": "IDP", "id_recall": "IDR"}),
    ):
        each = {str(index): metric.eval_sequence(one) for index, one in enumerate(together)}
        pooled = metric.combine_sequences(each)
        for name, theirs in names.items():
            result[name] = float(np.mean(pooled[theirs]))
    return result


if __name__ == "__main__":
    {"make": make, "score": score}[sys.argv[1]](pathlib.Path(sys.argv[2]))
