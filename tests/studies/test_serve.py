"""`deboom serve`: a real search watched in a real browser, and everybody else refused."""

import http.client
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from interactive_front_samples import live_front

from browser_samples import Browser
from deboom.errors import InputError
from deboom.report.interactive import render_interactive

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
    ],
)
def test_whoever_may_not_ask_is_refused(address, files, path, request_, status):
    answer, text = status_of(address, path.replace("FILES", files), **request_)
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


def test_a_page_of_a_run_reaches_nothing(address, files, results):
    parts = urlsplit(address)
    connection = http.client.HTTPConnection(parts.hostname, parts.port, timeout=30)
    name = next(results.glob("*/*/report.html")).relative_to(results).as_posix()
    connection.request("GET", files + name)
    answer = connection.getresponse()
    policy = answer.headers["Content-Security-Policy"].split("; ")
    assert {"sandbox allow-scripts allow-downloads", "connect-src 'none'"} <= set(policy)
    assert answer.headers["X-Content-Type-Options"] == "nosniff"
    connection.close()


HOSTILE = """<!DOCTYPE html><title>hostile</title><p id="said">nothing</p>
<iframe id="frame" src="/api/runs"></iframe><script>
const said = [];
const tell = () => { document.getElementById("said").textContent = said.join(" "); };
const attempt = async (name, read) => {
  try { said.push(`${name}:${String(await read()).includes("quad2_front")}`); }
  catch { said.push(`${name}:refused`); }
  tell();
};
attempt("fetch", async () => (await fetch("/api/runs")).text());
attempt("window", async () => {
  const other = open("/api/runs");
  await new Promise((then) => setTimeout(then, 500));
  return other.document.body.textContent;
});
addEventListener("load", () => attempt("frame", () =>
  document.getElementById("frame").contentDocument.body.textContent));
attempt("cookie", () => document.cookie);
</script>"""


def test_a_hostile_page_of_a_run_reads_nothing_of_the_server(address, files, results):
    page = next(results.glob("*/*")) / "hostile.html"
    page.write_text(HOSTILE, encoding="utf-8")
    browser = Browser()
    try:
        browser.open_address(address)  # the browser holds the cookie from now on
        browser.open_address(place_of(address, files, page, results))
        browser.wait("document.getElementById('said').textContent.split(' ').length === 4")
        assert sorted(browser.text("#said").split()) == [
            "cookie:refused", "fetch:refused", "frame:refused", "window:refused",
        ]  # fmt: skip
    finally:
        browser.close()
        page.unlink()


def test_the_model_of_a_served_page_answers(address, files, results):
    page = next(results.glob("*/*")) / "live.html"
    page.write_text(render_interactive(live_front()[0]), encoding="utf-8")
    browser = Browser()
    try:
        browser.open_address(address)
        browser.open_address(place_of(address, files, page, results))
        browser.wait("live.session.band !== null && live.session.band.fresh")
        assert browser.complaints == []
    finally:
        browser.close()
        page.unlink()


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
