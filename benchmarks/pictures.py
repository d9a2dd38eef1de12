"""Draw the pictures of the README again from a run of the front study: ``make pictures``."""

import shutil
import tempfile
from pathlib import Path

from deboom.study.runner import load_study, run_study

ROOT = Path(__file__).parents[1]
PICTURES = ("spl_curves", "pareto_front", "stiffness_bars")


def main() -> None:
    """Run the study with its default budget and copy three figures."""
    target = ROOT / "docs" / "pictures"
    target.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        study = load_study(ROOT / "studies" / "u06_robust_front.py")
        run = run_study(study, Path(folder), {"seed": 1})
        for stem in PICTURES:
            shutil.copyfile(run / "figures" / f"{stem}.png", target / f"{stem}.png")
            print(target / f"{stem}.png")


if __name__ == "__main__":
    main()
