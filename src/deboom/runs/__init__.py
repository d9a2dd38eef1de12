"""Run a study: its options, its folder, its record, and how a finished run is opened again.

May import every other package but `deboom.cli`; studies import it, and it imports no study.
"""
