"""`deboom unbalance`: refusals are one sentence, and nothing is left behind."""

import pytest
from typer.testing import CliRunner

from deboom.cli import app


def call(*arguments):
    return CliRunner().invoke(app, ["unbalance", *map(str, arguments)])


def test_help_teaches():
    done = call("--help")
    assert done.exit_code == 0
    for words in ("operation.toml", "at_most_g_mm2", "deboom bench operation"):
        assert words in done.stdout
    assert "\n  format = 1\n  risk_percent = 5.0\n  [static_unbalance]\n" in done.stdout


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), "there is no such folder; `deboom bench operation"),
        (("--band", "17"), "write it as LOW-HIGH"),
        (("--confidence", 1.5), "a confidence lies between 0 and 1"),
        (("--limits", "none.toml"), "none.toml cannot be read"),
    ],
)
def test_refusals(tmp_path, options, words):
    done = call(tmp_path / "test", *options, "--out", tmp_path / "results")
    assert done.exit_code == 2
    assert words in done.stderr
    assert len([line for line in done.stderr.splitlines() if line.startswith("deboom:")]) == 1
    assert not list(tmp_path.glob("results/unbalance/*"))


def test_an_unknown_limit_is_named(tmp_path):
    path = tmp_path / "limits.toml"
    path.write_text("format = 1\n[static_unbalance]\nat_most_gmm = 20.0\n", encoding="utf-8")
    done = call(tmp_path, "--limits", path, "--out", tmp_path / "results")
    assert done.exit_code == 2
    assert "did you mean 'at_most_g_mm'?" in done.stderr
