"""What a study returns, and how a run of it becomes a folder.

Depends on: all packages but the bench. Studies import this package; it imports no study.
"""
