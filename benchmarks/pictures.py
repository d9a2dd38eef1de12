"""Make the pictures of README and guides again, and the run in results/: ``make pictures``."""

import shutil
import tempfile
from pathlib import Path

from deboom.bench.compressor_writer import write_operating_test
from deboom.runs.runner import load_study, run_study

ROOT = Path(__file__).parents[1]
PLATFORM = ROOT / "studies" / "data" / "u06_f39_f45"
PARTS = ROOT / "docs" / "guides" / "delivered_parts.csv"
EXAMPLE = ROOT / "results" / "u06_sensitivity" / "example"
PICTURES = ("spl_curves", "pareto_front", "stiffness_bars", "sobol", "families")


def main() -> None:
    """Run the study with its default budget, and copy its best figures."""
    target = ROOT / "docs" / "pictures"
    target.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        run = run_study(load_study(ROOT / "studies" / "u06_platform.py"), folder, {"seed": 1})
        for stem in PICTURES:
            _keep(run, stem, target, stem)
        front = run_study(load_study(ROOT / "studies" / "u06_robust_front.py"), folder, {"seed": 1})
        box = run_study(load_study(ROOT / "studies/solution_box.py"), folder, {"front": front})
        _keep(box, "box", target, "acceptance_box")
        given = {"box": box, "parts": PARTS, "platform": PLATFORM, "uncertainty": 0.02}
        delivery = run_study(load_study(ROOT / "studies" / "accept.py"), folder, given)
        _keep(delivery, "parts", target, "delivery")
        test = write_operating_test(folder / "compressor", 1)
        study = load_study(ROOT / "studies" / "unbalance.py")
        unbalance = run_study(study, folder, {"folder": test})
        _keep(unbalance, "figure_61a_static", target, "unbalance")
        _finished_run(folder)


def _finished_run(folder: Path) -> None:
    """Make the small finished run that a clone can open, under a name that stays."""
    options = {"seed": 1, "n": 256, "pairs": True}
    run = run_study(load_study(ROOT / "studies" / "u06_sensitivity.py"), folder, options)
    if EXAMPLE.exists():
        shutil.rmtree(EXAMPLE)
    shutil.copytree(run, EXAMPLE)
    print(EXAMPLE)


def _keep(run: Path, stem: str, target: Path, name: str) -> None:
    shutil.copyfile(run / "figures" / f"{stem}.png", target / f"{name}.png")
    print(target / f"{name}.png")


if __name__ == "__main__":
    main()
