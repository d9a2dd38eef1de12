"""Virtual test bench with known truth; it writes measurement files.

Depends on: physics, files.
"""
