"""The languages of a supplier's sheet: words, and the decimal sign."""

from __future__ import annotations

import re
from enum import StrEnum

_FLOAT = re.compile(r"(?<=\d)\.(?=\d)")


class Language(StrEnum):
    """Language of a supplier's sheet."""

    en = "en"
    de = "de"

    def say(self, english: str, german: str) -> str:
        """Choose the words of the language."""
        return german if self is Language.de else english

    def local(self, text: str) -> str:
        """Return a text with the decimal sign of the language."""
        return _FLOAT.sub(",", text) if self is Language.de else text
