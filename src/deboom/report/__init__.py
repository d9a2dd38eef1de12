"""Reports: what a study found, as a page and files. Depends on: plain tables, arrays, pictures."""

from deboom.report.report import PAGE, SUMMARY, Report, Scalar, Sound, Step, Table

__all__ = ["PAGE", "SUMMARY", "Report", "Scalar", "Sound", "Step", "Table"]
