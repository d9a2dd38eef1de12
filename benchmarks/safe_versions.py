"""Check that no lower bound in pyproject.toml allows a version with a known hole (`make lint`).

Each look at the advisories ends with new lines below, and its date in SECURITY.md.
"""

import sys
import tomllib
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

SAFE_FROM = {
    "asammdf": ("8.8.28", "issue 1304: names of channels ran as code in 8.8.20"),
    "dask": ("2026.8", "CVE-2024-10096; released with distributed"),
    "distributed": ("2026.8", "CVE-2026-23528, pull request 9328"),
    "filelock": ("3.20.3", "CVE-2025-68146, CVE-2026-22701"),
    "h5py": ("3.16", "CVE-2025-44905 and others, with HDF5 2.0 in its wheels"),
    "jinja2": ("3.1.6", "CVE-2025-27516"),
    "joblib": ("1.2", "CVE-2022-21797"),
    "openpyxl": ("2.4.2", "CVE-2017-5992"),
    "pillow": ("13", "CVE-2026-112403 and others; CVE-2026-59199 in 12.2"),
    "pydantic": ("2.4", "CVE-2024-3772"),
    "scikit-learn": ("1.5", "CVE-2024-5206"),
    "sqlalchemy": ("1.3", "CVE-2019-7164"),
    "starlette": ("1.3.1", "CVE-2025-62727, CVE-2026-48710, PYSEC-2026-248"),
    "tqdm": ("4.66.3", "CVE-2024-34062"),
    "uvicorn": ("0.11.7", "CVE-2020-7694, CVE-2020-7695"),
}
"""Package → first version without a known hole, and the advisories."""


def allowed(project: dict[str, object]) -> list[str]:
    """Return a sentence for each bound that allows a hole, and each package that has no bound."""
    extras = project["optional-dependencies"]
    texts = [*project["dependencies"], *(text for extra in extras.values() for text in extra)]
    bounds = {}
    for requirement in map(Requirement, texts):
        lowest = [each.version for each in requirement.specifier if each.operator in (">=", "~=")]
        bounds[canonicalize_name(requirement.name)] = Version(lowest[0] if lowest else "0")
    return [
        f"{name}>={bounds.get(name, 'no bound')} allows {advisory}: require {safe} or newer"
        for name, (safe, advisory) in SAFE_FROM.items()
        if name not in bounds or bounds[name] < Version(safe)
    ]


if __name__ == "__main__":
    text = (Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8")
    sys.exit("\n".join(allowed(tomllib.loads(text)["project"])) or None)
