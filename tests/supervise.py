"""A service's unit, carried out in a chroot: what systemd would do of it that can be judged without systemd.

    supervise.py ROOT UNIT MAP_URL

It runs ExecStart as the unit's user, with the unit's environment file, waits for READY=1 and WATCHDOG=1 at the notify socket,
asks the map for its page and its health, for its state as the first user, whose password is in the log, sends SIGTERM, and wants STOPPING=1 and an exit status of 0.
"""

import json
import os
import pathlib
import shlex
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request

WAIT_S = 60
# Whether it can be heard on this machine does not depend on the proxies that this machine has.
MAP = urllib.request.build_opener(urllib.request.ProxyHandler({}))


def settings(text: str) -> dict[str, str]:
    """The `KEY=VALUE` lines of a unit or an environment file; the last of a key counts."""
    lines = (line.strip() for line in text.splitlines())
    pairs = (line.split("=", 1) for line in lines if "=" in line and line[0] not in "#[;")
    return {key: value for key, value in pairs}


def get(url: str, headers: dict[str, str] | None = None) -> bytes:
    """The body of an answer with status 200."""
    with MAP.open(urllib.request.Request(url, headers=headers or {}), timeout=10) as answer:
        return answer.read()


def log_in(url: str, password: str) -> dict[str, str]:
    """The headers of the session that this password begins."""
    body = json.dumps({"name": "admin", "password": password}).encode()
    request = urllib.request.Request(f"{url}/api/session", body, {"Content-Type": "application/json"})
    with MAP.open(request, timeout=10) as answer:
        return {"Cookie": answer.headers["Set-Cookie"].split(";")[0]}


def password(log: pathlib.Path) -> str:
    """What the log says of the first user."""
    said = log.read_text().split("the first user is admin, with the password ")
    if len(said) != 2:
        sys.exit(f"supervise.py: the log does not say the first password once:\n{log.read_text()}")
    return said[1].split(":")[0]


def expect(notices: socket.socket, wanted: bytes) -> None:
    """Waits for a notice."""
    end = time.monotonic() + WAIT_S
    while time.monotonic() < end:
        notices.settimeout(max(0.1, end - time.monotonic()))
        try:
            if wanted in notices.recv(4096).split():
                return
        except TimeoutError:
            break
    sys.exit(f"supervise.py: no {wanted.decode()} within {WAIT_S} s")


def main() -> None:
    root, name, url = pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3]
    unit = settings((root / f"lib/systemd/system/{name}.service").read_text())
    default = root / unit["EnvironmentFile"].lstrip("-/")
    environment = dict([unit["Environment"].split("=", 1)])
    environment |= {
        key: shlex.split(value)[0] if value else "" for key, value in settings(default.read_text()).items()
    }
    # systemd splits an unbraced variable into words.
    command = []
    for word in shlex.split(unit["ExecStart"]):
        command += environment.get(word[1:], "").split() if word.startswith("$") else [word]

    notices = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    notices.bind(str(root / "run/notices"))
    os.chmod(root / "run/notices", 0o777)

    log = root / "run/log"
    service = subprocess.Popen(
        ["chroot", f"--userspec={unit['User']}:{unit['Group']}", root, *command],
        env={"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "NOTIFY_SOCKET": "/run/notices", **environment},
        umask=int(unit["UMask"], 8),
        stderr=log.open("w"),
    )
    try:
        expect(notices, b"READY=1")
        if b"<!doctype html>" not in get(f"{url}/").lower():
            sys.exit("supervise.py: the map is no page")
        try:
            get(f"{url}/api/state")
            sys.exit("supervise.py: the map shows its state to everybody")
        except urllib.error.HTTPError as error:
            if error.code != 401:
                raise
        session = log_in(url, password(log))
        json.loads(get(f"{url}/api/state", session))
        listed = json.loads(get(f"{url}/api/firmware", session))
        for file in (file["name"] for file in listed["files"]):
            if (
                get(f"{url}/api/firmware/{file}", session)
                != (root / "usr/share/kehai/firmware" / file).read_bytes()
            ):
                sys.exit(f"supervise.py: the map hands out another {file}")
        boards = sorted({file["board"] for file in listed["files"] if file["board"]})
        if get(f"{url}/healthz") != b"ok\n":
            sys.exit("supervise.py: the tracker is not healthy")
        expect(notices, b"WATCHDOG=1")
    finally:
        service.send_signal(signal.SIGTERM)
    expect(notices, b"STOPPING=1")
    status = service.wait(WAIT_S)
    notices.close()
    (root / "run/notices").unlink()
    log.unlink()
    if status != 0:
        sys.exit(f"supervise.py: exit status {status}")
    print(
        f"   the service ran as {unit['User']}: ready, the map answers, alive, stopped; firmware of {boards}"
    )


if __name__ == "__main__":
    main()
