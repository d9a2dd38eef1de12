"""Sections, tables and figures of a study's page: functions of a report and the values it shows.

May import `deboom.report`, `deboom.plot`, `deboom.bench` and what stands below them; no runs, no
command line.
"""
