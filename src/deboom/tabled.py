"""Results that a notebook shows as a table."""

from __future__ import annotations

import pandas as pd

SHOWN_ROWS = 12
"""Rows that a notebook shows of a longer table."""


class Tabled:
    """A result whose numbers stand in `table`, columns ``name [unit]``."""

    @property
    def table(self) -> pd.DataFrame:
        """The result as a table."""
        raise NotImplementedError

    def to_frame(self) -> pd.DataFrame:
        """Return `table`."""
        return self.table

    def _repr_html_(self) -> str:
        """Show `table` in a notebook."""
        return self.table.to_html(
            max_rows=SHOWN_ROWS, float_format=lambda value: f"{value:.5g}", index=False
        )
