"""Draw the pictures of the README again, from a study and a vehicle: ``make pictures``."""

import shutil
import tempfile
from pathlib import Path

from deboom.bench.vehicle_writer import write_vehicle
from deboom.files.vehicle import read_vehicle
from deboom.study.modal_figures import moving_shapes
from deboom.study.modal_part import modal_part
from deboom.study.runner import load_study, run_study

ROOT = Path(__file__).parents[1]
PICTURES = ("spl_curves", "pareto_front", "stiffness_bars", "sobol", "vehicle_matrix")


def main() -> None:
    """Run the study with its default budget, copy its best figures, and set a body in motion."""
    target = ROOT / "docs" / "pictures"
    target.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        study = load_study(ROOT / "studies" / "u06_platform.py")
        run = run_study(study, Path(folder), {"seed": 1})
        for stem in PICTURES:
            shutil.copyfile(run / "figures" / f"{stem}.png", target / f"{stem}.png")
            print(target / f"{stem}.png")
        vehicle = write_vehicle(Path(folder) / "car", 1, load_cases=(), accelerance=False)
        (target / "mode_shapes.gif").write_bytes(moving_shapes(modal_part(read_vehicle(vehicle))))
        print(target / "mode_shapes.gif")


if __name__ == "__main__":
    main()
