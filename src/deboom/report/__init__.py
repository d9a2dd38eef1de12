"""Reports: what a study found, as a page and files. May import `plot` alone."""

from deboom.answer import Scalar, Step
from deboom.report.report import PAGE, SUMMARY, Link, Picture, Report, Sound, Table

__all__ = ["PAGE", "SUMMARY", "Link", "Picture", "Report", "Scalar", "Sound", "Step", "Table"]
