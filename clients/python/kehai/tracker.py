"""A tracker, asked over HTTP and heard over its WebSocket.

    Tracker ─┬─ people(), frames(), reports() ─▶ ws://…/ws     again and again, until the caller has had enough
             └─ state(), get(), put() … ───────▶ http://…/api/…

Callers need not watch the connection: while it is down, every count is None. What no further try can mend is raised: an address that
is none, a certificate that is not trusted, a refusal.
"""

import json
import ssl
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from email.message import Message
from typing import Any, cast

from websockets.datastructures import Headers
from websockets.exceptions import InvalidStatus, InvalidURI, WebSocketException
from websockets.sync.client import ClientConnection, connect

from kehai.types import Frame, ReportLine

JSON = "application/json"

# Between two tries, s: doubled from one to the other.
AGAIN_S = (0.5, 8.0)

# Longer than a frame of a thousand modules.
LONGEST = 1 << 26

# Frames come ten times a second, and a ping every 20 s: a connection that is silent for longer is none.
SILENT_S = 5.0

# A tracker that is silent takes no farewell either.
CLOSE_S = 1.0


class Refused(Exception):
    """The tracker refused: the HTTP status and the reason."""

    def __init__(self, status: int, why: str):
        super().__init__(f"{status}: {why}")
        self.status = status
        self.why = why


class Tracker:
    """A tracker by its address, as `http://127.0.0.1:8420`, and a token if it has users.

    Raises `ValueError` for an address without `http://` or `https://`.
    """

    def __init__(self, url: str, token: str | None = None, tls: ssl.SSLContext | None = None):
        if not url.startswith(("http://", "https://")):
            raise ValueError(f'"{url}": an address begins with http:// or https://')
        self._url = url.rstrip("/")
        self._headers = {} if token is None else {"Authorization": f"Bearer {token}"}
        self._tls = tls
        self._opener = urllib.request.build_opener(_Unmoved, urllib.request.HTTPSHandler(context=tls))

    def people(self) -> Iterator[dict[str, int | None]]:
        """How many people are in each zone, whenever that changes. None: it is not known."""
        known: dict[str, int | None] = {}
        said = None
        for frame in self.frames():
            if frame is None:
                known = dict.fromkeys(known)
            else:
                known = {name: zone["count"] for name, zone in frame["zones"].items()}
            if known != said:
                said = known
                yield dict(known)

    def frames(self) -> Iterator[Frame | None]:
        """All that is known, ten times a second. None, once, when the tracker cannot be reached any more."""
        for message in self._messages({"frames": True}):
            if message is None:
                yield None
            elif "frame" in message:
                yield cast(Frame, message["frame"])

    def reports(self) -> Iterator[ReportLine | None]:
        """All tracks right after each report of a module. None, once, when the tracker cannot be reached any more."""
        for message in self._messages({"frames": False, "reports": True}, patient=True):
            if message is None:
                yield None
            elif "report" in message:
                yield cast(ReportLine, message["report"])

    def state(self) -> Frame:
        """The newest frame."""
        return cast(Frame, self.get("/api/state"))

    def get(self, path: str) -> Any:
        """What a `GET` of this path is answered with: the value of JSON, `str` for other text, else `bytes`.

        Raises `Refused`, `ssl.SSLCertVerificationError`, or another `OSError` if nobody answers; so do the other three.
        """
        return self._ask("GET", path)

    def post(self, path: str, body: Any) -> Any:
        """What a `POST` of this path, with this body as JSON, is answered with."""
        return self._ask("POST", path, json.dumps(body).encode())

    def put(self, path: str, body: Any, content_type: str = JSON) -> Any:
        """What a `PUT` of this path is answered with. A body of another type than JSON is `bytes`, and sent as it is."""
        body = json.dumps(body).encode() if content_type == JSON else body
        return self._ask("PUT", path, body, content_type)

    def delete(self, path: str) -> Any:
        """What a `DELETE` of this path is answered with."""
        return self._ask("DELETE", path)

    def _ask(self, method: str, path: str, body: bytes | None = None, content_type: str = JSON) -> Any:
        headers = self._headers if body is None else {**self._headers, "Content-Type": content_type}
        request = urllib.request.Request(self._url + path, data=body, headers=headers, method=method)
        try:
            with self._opener.open(request, timeout=30) as answer:
                return _content(answer.headers, answer.read())
        except urllib.error.HTTPError as error:
            raise Refused(error.code, _why_refused(error.headers, error.read())) from None
        except urllib.error.URLError as error:
            if isinstance(error.reason, ssl.SSLCertVerificationError):
                raise error.reason from None
            raise

    def _messages(self, wish: dict[str, bool], patient: bool = False) -> Iterator[dict[str, Any] | None]:
        """Every message; None when a connection ends, or the first one does not come about."""
        pause_s, is_known = AGAIN_S[0], True
        while True:
            try:
                with self._connect() as socket:
                    socket.send(json.dumps(wish))
                    while True:
                        message = json.loads(socket.recv(timeout=None if patient else SILENT_S))
                        pause_s, is_known = AGAIN_S[0], True
                        yield message
            except InvalidStatus as error:
                status = error.response.status_code
                # A token that is wrong stays so, and an address that is another's; a tracker that is full or starts may not.
                if status < 500:
                    why = _why_refused(error.response.headers, error.response.body or b"")
                    raise Refused(status, why) from None
            except (InvalidURI, ssl.SSLCertVerificationError):
                raise
            except (OSError, TimeoutError, WebSocketException):
                pass
            if is_known:
                is_known = False
                yield None
            time.sleep(pause_s)
            pause_s = min(2 * pause_s, AGAIN_S[1])

    def _connect(self) -> ClientConnection:
        # http to ws, https to wss.
        url = f"ws{self._url.removeprefix('http')}/ws"
        tls = self._tls if url.startswith("wss") else None
        return connect(
            url, additional_headers=self._headers, ssl=tls, max_size=LONGEST, close_timeout=CLOSE_S
        )


class _Unmoved(urllib.request.HTTPRedirectHandler):
    """Follows no redirection, so that it is an error: one that is followed takes the token along, which the first request has
    sent in clear, and nobody is told.
    """

    def redirect_request(self, *_: object) -> None:
        return None


def _content(headers: Message, body: bytes) -> Any:
    if headers.get_content_type() == JSON:
        return json.loads(body)
    # What tells its letters is text, whatever else it is.
    charset = headers.get_content_charset()
    return body if charset is None else body.decode(charset)


def _why_refused(headers: Message | Headers, body: bytes) -> str:
    # A tracker that speaks TLS says where, without a body.
    if there := headers.get("Location"):
        return f"it is at {there}"
    return _reason(body)


def _reason(body: bytes) -> str:
    try:
        return json.loads(body)["error"]
    except (ValueError, KeyError, TypeError):
        return body.decode(errors="replace")
