"""Another library's tracker on the same candidates: Stone Soup's JPDA with efficient hypothesis management (EHM2).

    cases/H7-1100/{L,R}.csv ─▶ kehai-sim replay ─▶ candidates.jsonl ─▶ JPDA ─▶ tracks.jsonl ─┐
                                       └────────▶ tracks.jsonl of this project's tracker ────┴─▶ kehai-sim score

    python3 -m venv target/stone-soup && target/stone-soup/bin/pip install stonesoup==1.9.1
    target/stone-soup/bin/python3 host-sim/stone_soup.py CASES --sim target/release/kehai-sim

It is a laboratory script and no part of the check: it prints the table of docs/design.md. JPDA gets the centres and
covariances of the candidates, in the site's frame, as `kehai` does, but no walls, no entries and nothing that says where
no person is. Each of its figures stands below with its reason; none was chosen by a case. Two cases were looked at while
it was put together: without the two rules of tracks of the same person, several tracks follow each.

Time is that of a processor: of JPDA its own, in Python; of this project's trackers that of the whole replay, devices
included, which is more than they take.

Source: Bar-Shalom, Daum, Huang, The probabilistic data association filter (2009); Stone Soup 1.9.1.
"""

import argparse
import collections
import json
import math
import resource
import subprocess
import tempfile
import time
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
from stonesoup.dataassociator.neighbour import GNNWith2DAssignment
from stonesoup.dataassociator.probability import JPDAwithEHM2
from stonesoup.deleter.error import CovarianceBasedDeleter
from stonesoup.deleter.multi import CompositeDeleter
from stonesoup.deleter.time import UpdateTimeDeleter
from stonesoup.functions import gm_reduce_single
from stonesoup.hypothesiser.distance import DistanceHypothesiser
from stonesoup.hypothesiser.probability import PDAHypothesiser
from stonesoup.initiator.simple import MultiMeasurementInitiator
from stonesoup.measures import Mahalanobis
from stonesoup.models.measurement.linear import LinearGaussian
from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
from stonesoup.predictor.kalman import KalmanPredictor
from stonesoup.types.array import StateVectors
from stonesoup.types.detection import Detection
from stonesoup.types.state import GaussianState
from stonesoup.types.update import GaussianStateUpdate
from stonesoup.updater.kalman import KalmanUpdater

# Spectral density of the acceleration, m²/s³: 1 m/s² that lasts for half a second, somebody who sets off or turns.
Q = 0.5
# A body in view gives a candidate in nearly every scan; in a crowd one in three is hidden.
PROB_DETECT = 0.8
# False candidates, 1/m²: arms, chairs, edges; one scan in ten has one in a room of 20 m².
CLUTTER = 0.005
# 99.9 % of two dimensions, in standard deviations.
GATE = 3.7
# A person who was not seen for two seconds is given up, or when the place is known to half a metre only: both variances
# together.
GONE_S = 2.0
LOST_M2 = 0.5
# A track begins after so many candidates.
BORN_AFTER = 4
# What the error of a centre does not say: how a body differs from the shape it is taken for. Half widths are 26 cm across
# and 14 cm along the heading, which nobody knows: 6 cm; and an arm before the torso moves a centre as far again, m².
SHAPE_M2 = 0.06**2 + 0.06**2
# Two torsos, front to back, are no nearer, m: of two tracks that are, the younger is another of the same person.
APART_M = 0.28

# As `kehai-sim experiment cases` judges.
REGION = "-2,-2.6,2,1"
BEFORE_DOOR_S = 3.0
EPOCH = datetime(2000, 1, 1)


def measurement(covariance):
    """A centre with its own covariance."""
    return LinearGaussian(4, (0, 2), np.asarray(covariance))


class Jpda:
    """Stone Soup's parts, put together."""

    def __init__(self):
        motion = CombinedLinearGaussianTransitionModel([ConstantVelocity(Q), ConstantVelocity(Q)])
        predictor = KalmanPredictor(motion)
        self.updater = KalmanUpdater(measurement(np.eye(2) * SHAPE_M2))
        self.associator = JPDAwithEHM2(
            PDAHypothesiser(predictor, self.updater, CLUTTER, PROB_DETECT, prob_gate=0.999)
        )
        self.deleter = CompositeDeleter(
            [UpdateTimeDeleter(timedelta(seconds=GONE_S)), CovarianceBasedDeleter(LOST_M2, mapping=[0, 2])],
            intersect=False,
        )
        near = GNNWith2DAssignment(DistanceHypothesiser(predictor, self.updater, Mahalanobis(), GATE))
        self.initiator = MultiMeasurementInitiator(
            prior_state=GaussianState([[0], [0], [0], [0]], np.diag([0.0, 1.0, 0.0, 1.0]), timestamp=EPOCH),
            measurement_model=measurement(np.eye(2) * SHAPE_M2),
            deleter=UpdateTimeDeleter(timedelta(seconds=0.5)),
            data_associator=near,
            updater=self.updater,
            min_points=BORN_AFTER,
        )
        self.tracks = set()

    def scan(self, t, candidates):
        """A scan's candidates, as (x, y, covariance)."""
        at = EPOCH + timedelta(seconds=t)
        detections = {
            Detection([[x], [y]], timestamp=at, measurement_model=measurement(covariance))
            for x, y, covariance in candidates
        }
        held = collections.Counter()
        for track, hypotheses in self.associator.associate(self.tracks, detections, at).items():
            posteriors, weights = [], []
            for hypothesis in hypotheses:
                if hypothesis:
                    posteriors.append(self.updater.update(hypothesis))
                    held[hypothesis.measurement] += float(hypothesis.probability)
                else:
                    posteriors.append(hypothesis.prediction)
                weights.append(hypothesis.probability)
            if len(posteriors) == 1 and not hypotheses[0]:
                track.append(posteriors[0])
                continue
            means = StateVectors([posterior.state_vector for posterior in posteriors])
            covariances = np.stack([posterior.covar for posterior in posteriors], axis=2)
            mean, covariance = gm_reduce_single(means, covariances, np.asarray(weights, dtype=float))
            is_seen = sum(float(one.probability) for one in hypotheses if one) > 0.5
            state = GaussianStateUpdate(mean, covariance, hypotheses, at) if is_seen else None
            track.append(state or GaussianState(mean, covariance, timestamp=at))
        self.tracks -= self.deleter.delete_tracks(self.tracks)
        self.merge()
        # What the tracks explain together begins no other one, or two tracks of one person would become three.
        free = {one for one in detections if held[one] < 0.5 and self.is_apart(one)}
        self.tracks |= self.initiator.initiate(free, at)

    def merge(self):
        """Gives up the younger of two tracks where there is room for one."""
        kept = []
        for track in sorted(self.tracks, key=lambda track: track.states[0].timestamp):
            x, _, y, _ = track.state_vector.flatten()
            if all(math.hypot(x - other_x, y - other_y) > APART_M for other_x, other_y in kept):
                kept.append((x, y))
            else:
                self.tracks.discard(track)

    def is_apart(self, detection):
        """Whether no track is there."""
        x, y = (float(one) for one in detection.state_vector)
        places = (track.state_vector.flatten() for track in self.tracks)
        return all(math.hypot(x - other_x, y - other_y) > APART_M for other_x, _, other_y, _ in places)


def of(line):
    """The candidates of a line, as (x, y, covariance)."""
    for seen in line["candidates"]:
        xx, xy, yy = seen["cov"]
        yield seen["x"], seen["y"], [[xx + SHAPE_M2, xy], [xy, yy + SHAPE_M2]]


def follow(candidates, out):
    """Writes tracks as a line a scan; the mean time of a scan, ms."""
    jpda, numbers, spent, scans = Jpda(), {}, 0.0, 0
    with candidates.open() as lines, out.open("w") as tracks:
        for line in map(json.loads, lines):
            begun = time.process_time()
            jpda.scan(line["t"], list(of(line)))
            spent, scans = spent + time.process_time() - begun, scans + 1
            found = []
            for track in jpda.tracks:
                (x, _, y, _), covariance = track.state_vector.flatten(), track.covar
                found.append(
                    {
                        "id": numbers.setdefault(track.id, len(numbers) + 1),
                        "x": float(x),
                        "y": float(y),
                        "cov": [float(covariance[0, 0]), float(covariance[0, 2]), float(covariance[2, 2])],
                        "state": "confirmed",
                    }
                )
            tracks.write(json.dumps({"t": line["t"], "tracks": found, "zones": {}}) + "\n")
    return 1e3 * spent / scans


def thinned(tracks, out):
    """The lines of tracks, no two at one time, as score wants them."""
    last = None
    with tracks.open() as lines, out.open("w") as to:
        for text in lines:
            t = json.loads(text)["t"]
            if last is None or t > last:
                to.write(text)
                last = t


def counted(tracks, door_s, area):
    """The most frequent number of tracks in the area before the door opens."""
    numbers = collections.Counter()
    x0, x1, y0, y1 = area
    with tracks.open() as lines:
        for line in map(json.loads, lines):
            if door_s - BEFORE_DOOR_S <= line["t"] < door_s:
                sure = (track for track in line["tracks"] if track["state"] != "tentative")
                numbers[sum(x0 < track["x"] < x1 and y0 < track["y"] < y1 for track in sure)] += 1
    return numbers.most_common(1)[0][0] if numbers else None


def cpu_s():
    """Time that the programs started so far have taken of a processor, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def judged(options, folder, kept):
    """Each tracker's IDF1, whether it counted right, and ms a scan, in one case."""
    case = json.loads((folder / "case.json").read_text())
    sensors = [f"{name}={folder / name}.csv" for name in case["modules"]]
    replay = [options.sim, "replay", "--site", folder / "site.toml", *sensors, "--learn", "60", "--out", kept]

    def judge(name, tracks, ms):
        lines = kept / "judged.jsonl"
        thinned(tracks, lines)
        command = [options.sim, "score", folder / "truth.jsonl", lines, "--region", REGION, "--json"]
        figures = json.loads(subprocess.check_output(command))
        number = counted(lines, case["door"][0][0], case["meta"]["area"])
        return (case["cond"], case["n"], name), (figures["idf1"], number == case["n"], ms)

    for tracker in options.tracker:
        begun_s = cpu_s()
        subprocess.run([*replay, "--tracker", tracker], check=True, stdout=subprocess.DEVNULL)
        spent_s = cpu_s() - begun_s
        scans = len((kept / "candidates.jsonl").read_text().splitlines())
        yield judge(f"`{tracker}`", kept / "tracks.jsonl", 1e3 * spent_s / scans)
    ms = follow(kept / "candidates.jsonl", kept / "jpda.jsonl")
    yield judge("Stone Soup, JPDA", kept / "jpda.jsonl", ms)


def main():
    """The table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("cases", type=Path)
    parser.add_argument("--sim", default="kehai-sim")
    parser.add_argument("--only", action="append", help="cases whose names begin so")
    parser.add_argument(
        "--tracker", action="append", help="this project's, beside it; kehai if none is named"
    )
    options = parser.parse_args()
    options.tracker = options.tracker or ["kehai"]
    rows = collections.defaultdict(list)
    for folder in sorted(options.cases.iterdir()):
        if (folder / "case.json").exists() and folder.name.startswith(tuple(options.only or [""])):
            with tempfile.TemporaryDirectory() as kept:
                for row, figures in judged(options, folder, Path(kept)):
                    rows[row].append(figures)
    print("| | tracker | runs | IDF1 | counted right, % | ms a scan |\n|---|---|--:|--:|--:|--:|")
    for (condition, people, name), runs in sorted(rows.items()):
        idf1, right, ms = np.mean(runs, axis=0)
        print(f"| {condition}, {people} | {name} | {len(runs)} | {idf1:.3f} | {100 * right:.0f} | {ms:.2g} |")


if __name__ == "__main__":
    main()
