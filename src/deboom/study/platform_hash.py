"""One number for all files of a platform: does a model built today see the same data?"""

from __future__ import annotations

import hashlib

from deboom.files.platform import Platform
from deboom.files.run_folder import hash_files


def platform_sha256(platform: Platform) -> str:
    """Return a hash over names and contents of every file that was read, in hexadecimal."""
    hashes = hash_files(platform.input_files, relative_to=platform.folder)
    joined = "\n".join(f"{name} {value}" for name, value in sorted(hashes.items()))
    return hashlib.sha256(joined.encode()).hexdigest()
