"""What a study returns, and how a run of it becomes a folder.

Depends on: all rooms but the bench. Studies import this room; it imports no study.
"""
