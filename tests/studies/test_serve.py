"""`deboom serve`: a real search watched in a real browser, and everybody else refused."""

import http.client
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from browser_samples import Browser
from deboom.errors import InputError

pytest.importorskip("starlette")
pytest.importorskip("uvicorn")
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
        ("/files/../secret.txt", {}, 404),
        ("/files/%2e%2e/secret.txt", {}, 404),
        ("/files/..%2fsecret.txt", {}, 404),
        ("/files//etc/passwd", {}, 404),
        ("/files/quad2_front/nothing", {}, 404),
        ("/api/search?run=../secret", {}, 404),
        ("/api/search?run=quad2_front", {}, 404),
    ],
)
def test_whoever_may_not_ask_is_refused(address, path, request_, status):
    answer, text = status_of(address, path, **request_)
    assert answer == status
    assert "secret\n" not in text
    assert "root:" not in text


def test_servers_of_one_computer_have_cookies_of_their_own(address):
    parts = urlsplit(address)
    connection = http.client.HTTPConnection(parts.hostname, parts.port, timeout=30)
    connection.request("GET", f"/?{parts.query}")
    cookie = connection.getresponse().headers["Set-Cookie"]
    connection.close()
    assert cookie.startswith(f"deboom{parts.port}=")


def test_a_link_out_of_the_results_is_no_file(address, results):
    link = results / "link.txt"
    link.symlink_to(results.parent / "secret.txt")
    try:
        assert status_of(address, "/files/link.txt")[0] == 404
    finally:
        link.unlink()


def test_a_page_of_a_run_reaches_nothing(address, results):
    parts = urlsplit(address)
    connection = http.client.HTTPConnection(parts.hostname, parts.port, timeout=30)
    name = next(results.glob("*/*/report.html")).relative_to(results).as_posix()
    token = parts.query.removeprefix("token=")
    connection.request("GET", f"/files/{name}", headers={"Cookie": f"deboom{parts.port}={token}"})
    answer = connection.getresponse()
    assert "connect-src 'none'" in answer.headers["Content-Security-Policy"]
    assert answer.headers["X-Content-Type-Options"] == "nosniff"
    connection.close()


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
