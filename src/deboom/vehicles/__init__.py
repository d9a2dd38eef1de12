"""The receiver side and the population of vehicles. Depends on: physics, measurement, mounts."""
