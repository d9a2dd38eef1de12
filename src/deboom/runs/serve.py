"""Look at a results folder in the browser while searches run: read-only, on this computer alone."""

from __future__ import annotations

import json
import re
import secrets
import shlex
import threading
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from starlette.applications import Starlette
from starlette.datastructures import Headers, QueryParams
from starlette.requests import HTTPConnection, Request
from starlette.responses import (
    FileResponse,
    HTMLResponse,
    PlainTextResponse,
    RedirectResponse,
    Response,
)
from starlette.routing import Route
from starlette.types import ASGIApp, Receive, Scope, Send

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.choices import Pick
from deboom.explore.front import nondominated
from deboom.explore.robust import kept_values
from deboom.files.disk import read_text
from deboom.files.run_folder import (
    DAMAGED,
    RECORD,
    SEARCH,
    CheckpointFolder,
    RunEntry,
    read_record,
    readable_runs,
)
from deboom.names import path_inside
from deboom.report import PAGE
from deboom.report.interactive import is_interactive, script_policy
from deboom.report.live_results import live_results_page
from deboom.runs.overview import files_of, options, run_cards

TOKEN_BYTES = 24
"""Random bytes of the address that is printed, and of the paths of files; nobody guesses them."""
MOST_PAGES = 60
"""Pages of a run that are linked at most; the folder lists the others."""
_GUARDS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
    "Cross-Origin-Resource-Policy": "same-origin",
}
# A file of a results folder may come from elsewhere: a page gets an origin of its own, so that it
# reads nothing of this address, and no scripts, without which it goes nowhere by itself. Links and
# pictures of the overview come from that origin, too: they may, and no script can read them.
_FILE_GUARDS = {
    **_GUARDS,
    "Cross-Origin-Resource-Policy": "cross-origin",
    "X-DNS-Prefetch-Control": "off",
}
_NO_FRAMES = "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
_PASSIVE = (
    "default-src 'none'; img-src 'self' data:; media-src 'self' data:; style-src 'unsafe-inline'; "
    + _NO_FRAMES
)


_KINDS = {
    ".csv": "text/csv",
    ".json": "application/json",
    ".md": "text/plain",
    ".png": "image/png",
    ".txt": "text/plain",
    ".wav": "audio/wav",
}
"""Files that a browser shows; it saves the others: an SVG or a PDF may do what a page does."""
_CONNECTS = re.compile(r"<(?=(i?frame|link)\b)", re.IGNORECASE)
"""Elements for which browsers open a connection elsewhere, even where nothing may be loaded."""


def file_answer(path: Path) -> Response:
    """Return a file as it is; of pages, the scripts of `is_interactive` alone run.

    - raises InputError: a page that is no UTF-8 text.
    """
    if path.suffix != ".html":
        kind = _KINDS.get(path.suffix, "application/octet-stream")
        return FileResponse(path, media_type=kind, headers=_file_guards(_PASSIVE))
    page = read_text(path)
    if is_interactive(page):
        policy = f"sandbox allow-scripts allow-downloads; {script_policy()}; {_NO_FRAMES}"
    else:
        policy = f"sandbox allow-downloads; {_PASSIVE}"
    return HTMLResponse(_CONNECTS.sub("&lt;", page), headers=_file_guards(policy))


def _file_guards(policy: str) -> dict[str, str]:
    return {**_FILE_GUARDS, "Content-Security-Policy": policy}


@dataclass
class SearchProgress:
    """Front of a search as far as its evaluations are on disk; `update` reads what is new.

    - `folder`: with ``evaluations`` and ``search.json``; `variables`: of its designs.
    - `generation`: the last that was read; `evaluated`: designs so far.
    - `designs` (n, n_variables), `sums` (n, 2): nondominated designs without a limit that is
      missed, and their sums of mean and of sigma over the responses [unit of the responses].
    """

    folder: Path
    variables: tuple[str, ...]
    generation: int = 0
    evaluated: int = 0
    designs: RealArray = field(init=False)
    sums: RealArray = field(init=False)

    def __post_init__(self) -> None:
        self.designs, self.sums = np.empty((0, len(self.variables))), np.empty((0, 2))

    def update(self) -> None:
        """Read the generations that were kept since the last time.

        - raises InputError: a damaged file.
        """
        checkpoint = CheckpointFolder(self.folder)
        while (arrays := checkpoint.kept(self.generation + 1)) is not None:
            values = kept_values(arrays)
            sums = np.column_stack([values.mean_sum, values.sigma_sum])[values.feasible]
            designs = values.designs[values.feasible]
            fits = designs.shape[1] == len(self.variables)
            if not (fits and np.isfinite(sums).all() and np.isfinite(designs).all()):
                raise InputError(
                    f"{self.folder}: generation {self.generation + 1} is of other variables or not "
                    f"finite: {DAMAGED}"
                )
            self.generation += 1
            self.evaluated += len(values)
            sums = np.concatenate([self.sums, sums])
            designs = np.concatenate([self.designs, designs])
            if len(sums):
                kept = nondominated(sums)
                order = np.argsort(sums[kept][:, 0], kind="stable")
                self.sums, self.designs = sums[kept][order], designs[kept][order]

    def as_json(self) -> dict[str, Any]:
        """Return what the page draws: the front, and the designs at its ends."""
        ends: dict[str, dict[str, float]] = {}
        if len(self.sums):
            for pick, column in ((Pick.best_mean, 0), (Pick.best_sigma, 1)):
                design = self.designs[self.sums[:, column].argmin()]
                ends[pick.value] = dict(zip(self.variables, map(float, design), strict=True))
        return {
            "generation": self.generation,
            "evaluated": self.evaluated,
            "front": self.sums.tolist(),
            "ends": ends,
        }


@dataclass(frozen=True)
class ResultsFolder:
    """What the page asks for: runs as they are now, and searches as they grow.

    - `folder`: of all results.
    - `address`: that files are served below.
    - `searches`: progress of each search that was looked at, so that a file is read once.
    - `records`: by path, each ``run.json`` with the time and size that it had when it was read.
    - `reading`: held while a search is updated; several pages may ask at once.
    """

    folder: Path
    address: str
    searches: dict[tuple[Path, tuple[str, ...]], SearchProgress] = field(default_factory=dict)
    records: dict[Path, tuple[tuple[int, int], dict[str, Any]]] = field(default_factory=dict)
    reading: threading.Lock = field(default_factory=threading.Lock)

    def runs(self) -> dict[str, Any]:
        """Return every run of the folder, and what could not be read."""
        entries, damaged = readable_runs(self.folder, self.record)
        cards = run_cards(entries, self.folder)
        runs = [
            {
                **asdict(card),
                "id": entry.folder.relative_to(self.folder).as_posix(),
                "typed": shlex.quote(_from_here(entry.folder)),
                "options": {n: str(value) for n, value in options(entry.record).items()},
                "files": self.address_of(entry.folder),
                "pages": list(self.pages(entry)),
                "picks": [pick.value for pick in Pick] if _has_front(entry) else [],
            }
            for entry, card in zip(entries, cards, strict=True)
        ]
        return {"runs": runs, "problems": [str(error) for error in damaged]}

    def address_of(self, path: Path) -> str:
        """Return where a file or folder of the results is served."""
        return self.address + quote(path.relative_to(self.folder).as_posix())

    def pages(self, entry: RunEntry) -> Iterator[dict[str, str]]:
        """Yield title and address of the pages of a run, its report first."""
        pages = [*files_of(entry, "*.html"), *files_of(entry, "*/*.html")]
        pages.sort(key=lambda path: path.name != PAGE)
        for path in pages[:MOST_PAGES]:
            name = path.relative_to(entry.folder).as_posix().removesuffix(".html")
            yield {"title": name, "url": self.address_of(path)}

    def record(self, path: Path) -> dict[str, Any]:
        """Return what a ``run.json`` says, which is read again when it has changed.

        - raises InputError: a file that is damaged or gone.
        """
        try:
            status = path.stat()
        except OSError:  # taken away since the folder was listed, which the reader words
            return read_record(path)
        changed = status.st_mtime_ns, status.st_size
        kept = self.records.get(path)
        if kept is None or kept[0] != changed:
            kept = self.records[path] = changed, read_record(path)
        return kept[1]

    def search(self, run: str) -> dict[str, Any]:
        """Return the searches of a run as they are now, each with its problem where it has one.

        - raises InputError: no such run, or a damaged record of it.
        """
        folder = path_inside(self.folder, run)
        record = self.record(path_inside(folder, RECORD))
        planned = record["arguments"].get("generations")
        searches = []
        for facts in sorted(folder.glob(f"*/{SEARCH}")):
            answer = {"name": facts.parent.name, "planned": planned, "problem": ""}
            try:
                answer |= self._progress(path_inside(folder, facts.parent.name))
            except InputError as error:
                answer["problem"] = str(error)
            searches.append(answer)
        return {"searches": searches}

    def _progress(self, folder: Path) -> dict[str, Any]:
        facts = CheckpointFolder(folder).load() or {}
        key = folder, tuple(facts.get("variables", ()))
        with self.reading:
            progress = self.searches.setdefault(key, SearchProgress(*key))
            progress.update()
            return progress.as_json()


def _from_here(folder: Path) -> str:
    """Return a folder as it is typed where the server was started."""
    here = Path.cwd().resolve()
    inside = folder.is_relative_to(here)
    return (folder.relative_to(here) if inside else folder).as_posix()


def _has_front(entry: RunEntry) -> bool:
    return entry.finished and (entry.folder / "front.csv").is_file()


class LoopbackOnly:
    """Answer this computer, this address and the holder of the token; everybody else gets 403.

    A page of another site that the same browser shows can send requests here, and a name of
    another site can be made to lead here: both are told by the headers Origin and Host.

    - `app`: what answers those who may ask.
    - `token`: of the printed address; afterwards a cookie that scripts cannot read.
    - `authorities`: allowed values of Host, such as ``127.0.0.1:8000``.
    - `files`: secret beginning of the paths of files. Their pages have an origin of their own, for
      which no browser sends the cookie; whoever knows the path holds what the cookie would say.
    """

    def __init__(self, app: ASGIApp, token: str, authorities: frozenset[str], files: str) -> None:
        self.app, self.token, self.authorities, self.files = app, token, authorities, files

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it in a sentence."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        await self._answer(scope)(scope, receive, send)

    def _answer(self, scope: Scope) -> ASGIApp:
        headers = Headers(scope=scope)
        if scope["type"] != "http" or scope["method"] not in ("GET", "HEAD"):
            return _refusal(405, "deboom serve shows results and changes nothing")
        if headers.get("host", "") not in self.authorities:
            return _refusal(403, "deboom serve answers at the address that it printed only")
        origins = {f"http://{authority}" for authority in self.authorities}
        foreign = headers.get("origin", min(origins)) not in origins
        if not foreign and scope["path"].startswith(self.files):
            return self.app
        if foreign or headers.get("sec-fetch-site", "none") not in ("none", "same-origin"):
            return _refusal(403, "deboom serve answers no page of another site")
        # cookies of one host go to all of its ports: each server has a name for its token
        name = f"deboom{headers['host'].rpartition(':')[2]}"
        query = QueryParams(scope.get("query_string", b""))
        if _is_equal(query.get("token", ""), self.token):
            answer = RedirectResponse(scope["path"] or "/", status_code=303, headers=_GUARDS)
            answer.set_cookie(name, self.token, httponly=True, samesite="strict")
            return answer
        cookie = HTTPConnection(scope).cookies.get(name, "")
        if not _is_equal(cookie, self.token):
            return _refusal(403, "open the whole address that deboom serve printed")
        return self.app


def _is_equal(text: str, secret: str) -> bool:
    """Compare in a time that does not depend on where texts differ, which may be any text."""
    return secrets.compare_digest(text.encode("utf-8", "replace"), secret.encode("utf-8"))


def _refusal(status: int, sentence: str) -> Response:
    return PlainTextResponse(sentence + "\n", status_code=status, headers=_GUARDS)


def results_app(results: Path, *, token: str, authorities: frozenset[str]) -> ASGIApp:
    """Return the application that shows a results folder.

    - `results`: the folder; nothing outside of it is read.
    - `token`, `authorities`: see `LoopbackOnly`.
    """
    address = f"/files/{secrets.token_urlsafe(TOKEN_BYTES)}/"
    folder = ResultsFolder(results, address)

    def page(_request: Request) -> Response:
        text, policy = live_results_page()
        return HTMLResponse(text, headers={**_GUARDS, "Content-Security-Policy": policy})

    def runs(_request: Request) -> Response:
        return _json(folder.runs())

    def search(request: Request) -> Response:
        try:
            return _json(folder.search(request.query_params.get("run", "")))
        except InputError as error:
            return _refusal(404, str(error))

    def file(request: Request) -> Response:
        name = request.path_params["name"]
        try:
            path = path_inside(results, name)
            hidden = any(part.startswith(".") for part in Path(name).parts)
            if not hidden and path.is_dir():
                return _json(sorted(each.name for each in path.iterdir() if each.name[0] != "."))
            if not hidden and path.is_file():  # a pipe is none
                return file_answer(path)
        except OSError:
            pass  # as if it were not there
        except InputError as error:
            return _refusal(404, str(error))
        return _refusal(404, "there is no such file in the results folder")

    routes = [
        Route("/", page),
        Route("/api/runs", runs),
        Route("/api/search", search),
        Route(address + "{name:path}", file),
    ]
    return LoopbackOnly(Starlette(routes=routes), token, authorities, files=address)


def _json(content: Mapping[str, Any] | list[str]) -> Response:
    # names of files may hold bytes that are no letters: JSON has escapes for them, UTF-8 none
    text = json.dumps(content, allow_nan=False)
    return Response(text, media_type="application/json", headers=_GUARDS)


def serve_results(results: Path, *, port: int) -> Iterator[str]:
    """Serve a results folder until the process is stopped; yield the address first.

    - `results`: an existing folder.
    - `port`: of this computer; 0 takes a free one.
    - raises InputError: no such folder, or a port that is taken.
    """
    import socket

    import uvicorn

    if not results.is_dir():
        raise InputError(f"{results} is no folder: name the folder with the results")
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    with listening:
        try:
            listening.bind(("127.0.0.1", port))
            listening.listen()  # whoever opens the address at once waits instead of failing
        except OSError as error:
            raise InputError(
                f"port {port} cannot be used ({error.strerror}): try --port 0"
            ) from error
        port = listening.getsockname()[1]
        token = secrets.token_urlsafe(TOKEN_BYTES)
        authorities = frozenset({f"127.0.0.1:{port}", f"localhost:{port}"})
        yield f"http://127.0.0.1:{port}/?token={token}"
        app = results_app(results.resolve(), token=token, authorities=authorities)
        config = uvicorn.Config(app, log_level="warning", access_log=False, server_header=False)
        uvicorn.Server(config).run(sockets=[listening])
