"""The only package that reads and writes files. Depends on: measurement, mounts."""
