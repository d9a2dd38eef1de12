"""The numbers of a model that a page computes with.

Names and sizes are JSON, numbers one block of little-endian float64 in base64: float32 would change
levels by up to 5e-5 dB, and a page shall say what Python says.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from deboom.arrays import RealArray

MAX_MODEL_BYTES = 3_000_000
"""Size of the model in a page that is not exceeded [byte]."""


@dataclass(frozen=True, eq=False)
class LiveModel:
    """A booming model as a page carries it.

    - `header`: names and sizes, plain values of JSON.
    - `arrays`: numbers by name, in the order in which they stand in the page.
    """

    header: Mapping[str, Any]
    arrays: Mapping[str, RealArray]

    @property
    def words(self) -> str:
        """Header with the lengths of the arrays, JSON that cannot end a script element."""
        lengths = [[name, int(values.size)] for name, values in self.arrays.items()]
        header = {**self.header, "arrays": lengths}
        text = json.dumps(header, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
        return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")

    @property
    def numbers(self) -> str:
        """All arrays as one base64 text."""
        block = np.concatenate([np.ravel(values) for values in self.arrays.values()])
        return base64.b64encode(block.astype("<f8").tobytes()).decode("ascii")

    @property
    def n_bytes(self) -> int:
        """Size in the page [byte]."""
        numbers = 8 * sum(values.size for values in self.arrays.values())
        return len(self.words.encode("utf-8")) + 4 * -(-numbers // 3)

    def with_header(self, more: Mapping[str, Any]) -> LiveModel:
        """Return the same numbers with further words in the header."""
        return replace(self, header={**self.header, **more})
