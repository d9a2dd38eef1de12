"""`python -m deboom` is the command `deboom`."""

from deboom.cli import app

app(prog_name="deboom")
