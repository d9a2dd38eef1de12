"""What a mount supplier gets and sends back: sheet, workbook, delivery, acceptance.

May import `deboom.pages`, `deboom.report`, `deboom.plot` and what stands below them; no runs, no
command line.
"""
