"""Equations only: arrays in, arrays out. Depends on: nothing."""
