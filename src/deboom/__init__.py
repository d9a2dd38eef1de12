"""deboom takes the booming noise (15-140 Hz) out of vehicles."""

__version__ = "0.1.0"
