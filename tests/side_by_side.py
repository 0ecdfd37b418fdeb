"""All tests of the workspace, with the daemon's programs beside the others.

    cargo test --no-run ─▶ programs ─┬─▶ host-tracker: browsers, disks, deaths; it mostly waits  ◀─╮ and then helps here
                                     └─▶ the others: QEMU and simulations; they mostly compute  ─╯
    --meanwhile COMMAND ─────────────┴─▶ one after the other, with what the tests leave of the processor
    cargo test --doc, at the end

`cargo test` runs one program after the other, and leaves a core idle while the daemon's tests wait. Each program runs as
cargo would run it: in its package's folder, with cargo's variables. What a program prints stands whole, when it has
ended, with the seconds that it took, and those of the processor. Every program runs, whatever fails before; the exit status is 1 if one fails. What every
tracker promises runs once more for each of the others.

Commands for meanwhile build what comes after the tests. Whether they succeed is not judged: what needs them does it again, and says so.
"""

import argparse
import json
import os
import shlex
import subprocess
import sys
import tempfile
import threading
import time
from collections import deque
from pathlib import Path

CARGO_TEST = ["cargo", "test", "--locked", "--workspace"]
WAITS = "host-tracker"
# What the trackers promise: run by the default one, and by these (`tracking/tests/intake/tracker.rs`).
PROMISES = {"edits", "explain", "floor", "intake", "names", "people", "sources", "unknown"}
TRACKERS = ["kehai-rules"]
# The samples of the default one are random, and in some of a thousand random worlds a promise is broken for half a second: a person
# who turns round outside a zone is counted in it too late, or a person who appears counts as two. So every commit is judged by the
# same worlds.
SAME_CASES = {"PROPTEST_RNG_SEED": "1"}

printing = threading.Lock()
taking = threading.Lock()


def programs():
    """The test programs, in cargo's order: (executable, folder of its package, variables)."""
    command = [*CARGO_TEST, "--no-run", "--message-format=json-render-diagnostics"]
    built = subprocess.run(command, stdout=subprocess.PIPE, check=False)
    if built.returncode != 0:
        sys.exit(built.returncode)
    for line in built.stdout.splitlines():
        message = json.loads(line)
        if message.get("executable") and message["profile"]["test"]:
            executable, folder = Path(message["executable"]), Path(message["manifest_path"]).parent
            is_promise = message["target"]["name"] in PROMISES and folder.name in {"tracking", WAITS}
            yield executable, folder, SAME_CASES if is_promise else {}
            if is_promise:
                for tracker in TRACKERS:
                    yield executable, folder, {"KEHAI_TRACKER": tracker, **SAME_CASES}


def take(lanes):
    """The next program of the first of these lanes that has one left; none when all are empty."""
    with taking:
        return next((lane.popleft() for lane in lanes if lane), None)


def run(lanes, failed):
    """Runs the programs of these lanes, one after the other; those that fail are appended to `failed`."""
    while program := take(lanes):
        executable, folder, variables = program
        settings = [f"{variable}={value}" for variable, value in variables.items()]
        name = " ".join([executable.name, *settings])
        begun_s = time.monotonic()
        environment = {**os.environ, "CARGO": "cargo", "CARGO_MANIFEST_DIR": str(folder), **variables}
        with tempfile.TemporaryFile() as printed:
            running = subprocess.Popen(
                [executable], cwd=folder, env=environment, stdout=printed, stderr=subprocess.STDOUT
            )
            # With what it has waited for: QEMU, a browser.
            _, status, used = os.wait4(running.pid, 0)
            running.returncode = os.waitstatus_to_exitcode(status)
            took_s, computed_s = time.monotonic() - begun_s, used.ru_utime + used.ru_stime
            printed.seek(0)
            output = printed.read()
        with printing:
            print(
                f"\n     Running {folder.name}: {name}, {took_s:.0f} s, {computed_s:.0f} s computed",
                flush=True,
            )
            sys.stdout.buffer.write(output)
            sys.stdout.flush()
        if running.returncode != 0:
            failed.append(f"{folder.name}: {name}, status {running.returncode}")


def build_ahead(commands):
    """Runs commands with the lowest priority; returns when all have ended."""
    for command in commands:
        begun_s = time.monotonic()
        ended = subprocess.run(
            ["nice", "-n", "19", *shlex.split(command)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            check=False,
        )
        with printing:
            took_s = time.monotonic() - begun_s
            print(f"\n   Meanwhile {command}: status {ended.returncode}, {took_s:.0f} s", flush=True)


def main():
    """Runs both lanes and the examples of the documentation."""
    parser = argparse.ArgumentParser(description="All tests of the workspace.")
    parser.add_argument("--meanwhile", metavar="COMMAND", action="append", default=[])
    arguments = parser.parse_args()
    computing, waiting = deque(), deque()
    for program in programs():
        (waiting if program[1].name == WAITS else computing).append(program)
    if not (computing and waiting):
        sys.exit("side_by_side.py: a lane has no programs: was the package of the daemon renamed?")
    failed = []
    # Two programs of the daemon may run at once: they mostly wait.
    threads = [
        threading.Thread(target=run, args=(lanes, failed)) for lanes in ([waiting], [computing, waiting])
    ]
    threads.append(threading.Thread(target=build_ahead, args=(arguments.meanwhile,)))
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if subprocess.run([*CARGO_TEST, "--doc"], check=False).returncode != 0:
        failed.append("examples of the documentation")
    for one in failed:
        print(f"FAILED: {one}", file=sys.stderr)
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
