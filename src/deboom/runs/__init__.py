"""Run a study: its options, its folder, its record, and how a finished run is opened again.

May import `supplier`, `pages`, `report`, `plot`, `bench`, `files`, `vehicles`, `compressor`,
`mounts`, `measurement`, `physics` and `explore`. Studies import it; it imports no study.
"""
