"""The refrigerant compressor in its vehicle: what a roving hammer says of its mass and mounts.

May import `physics`, `explore`, `measurement` and `mounts`.
"""
