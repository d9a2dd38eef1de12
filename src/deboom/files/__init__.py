"""The only door to disk. Depends on: measurement, mounts."""
