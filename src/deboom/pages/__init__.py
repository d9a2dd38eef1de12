"""Sections, tables and figures of a study's page: functions of a report and the values it shows.

May import `report`, `plot`, `files`, `vehicles`, `compressor`, `mounts`, `measurement`,
`physics` and `explore`; it knows neither runs nor a command line.
"""
