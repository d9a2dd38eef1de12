"""The only package that reads and writes files: readers, writers, checks, run folders.

May import `physics`, `explore`, `measurement`, `mounts`, `vehicles` and `compressor`.
"""
