"""Receivers and the population of vehicles. Depends on: physics, explore, measurement, mounts."""
