"""The refrigerant compressor in its vehicle: mass, mounts, unbalance, hoses and cabin noise.

May import `physics`, `explore`, `measurement` and `mounts`.
"""
