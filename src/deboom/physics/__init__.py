"""Equations only: arrays in, arrays out; numpy and scipy. May import no other package."""
