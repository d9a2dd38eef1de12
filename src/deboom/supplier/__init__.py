"""What a mount supplier gets and sends back: sheet, workbook, delivery, acceptance.

May import `pages`, `report`, `plot`, `files`, `vehicles`, `compressor`, `mounts`, `measurement`,
`physics` and `explore`; it knows neither runs nor a command line.
"""
