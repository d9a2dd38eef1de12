"""The command line, called in this process."""

from functools import cache

from typer import testing

from deboom.cli import app

# making all commands takes longer than most calls, and each call would make them again
testing._get_command = cache(testing._get_command)


def call(*words, code=0):
    """Run a command, which must end with this exit code; return what it wrote."""
    done = testing.CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == code, done.output or repr(done.exception)
    assert done.exception is None or isinstance(done.exception, SystemExit)
    return done


def refused(command, *words):
    """After what it says of its progress, a command ends with one sentence and exit code 2."""
    *progress, sentence = call(*command, code=2).stderr.strip().splitlines()
    assert [line for line in (*progress, sentence) if line.startswith("deboom: ")] == [sentence]
    assert all(word in sentence for word in words), sentence
