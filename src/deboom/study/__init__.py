"""What a study returns, and how a run of it becomes a folder.

Depends on: report, files. Studies import this room; this room imports no study.
"""

from deboom.study.result import StudyResult

__all__ = ["StudyResult"]
