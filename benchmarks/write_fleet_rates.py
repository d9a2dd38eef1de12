"""Draw fleets from the prior and keep what each shows: the rates beside the studies' figures.

    python benchmarks/write_fleet_rates.py

None of the fleets is chosen. The file is part of the package; the claims draw the fleets again.
"""

from __future__ import annotations

from pathlib import Path

import deboom.bench
from deboom.bench.unselected_fleets import DATA, draw_unselected
from deboom.files.folders import replace_text

SEEDS = range(1001, 1301)

if __name__ == "__main__":
    path = Path(deboom.bench.__file__).parent / "data" / DATA
    replace_text(path, draw_unselected(SEEDS).to_json())
    print(path)
