"""Receivers and the population of vehicles: what a driver hears of a design.

May import `physics`, `explore`, `measurement` and `mounts`.
"""
