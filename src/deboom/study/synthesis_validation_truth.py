"""The bench's own truth of a driven vehicle, for comparison only: no prediction ever sees it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.measurement.channels import Frf, Spectrum

_LOADS = ("x", "y", "z", "mx", "my", "mz")


@dataclass(frozen=True, eq=False)
class VehicleTruth:
    """What is exact about a vehicle and its run.

    Parameters
    ----------
    force : Spectrum
        Of every mount on the body, channels ``<mount> [<piece>] <axis>`` [N].
    pressure : Spectrum
        At the ears, through the mounts alone [Pa].
    noise_transfer : Frf
        Outputs are the ears, inputs ``<mount> [<piece>] x y z mx my mz`` [Pa/N].
    natural_frequency : array, shape (n_mode,)
        Of the trimmed body on average; between two measurements it changes a little [Hz].
    damping_ratio : array, shape (n_mode,)
        [1].
    shapes : array, shape (n_mode, n_interface, 6)
        At the interfaces, x y z rx ry rz [kg^-1/2].
    panel_shapes : array, shape (n_mode, n_panel)
        Inwards [kg^-1/2].
    """

    force: Spectrum
    pressure: Spectrum
    noise_transfer: Frf
    natural_frequency: RealArray
    damping_ratio: RealArray
    shapes: RealArray
    panel_shapes: RealArray

    def mode_shapes(self, n_outputs: int) -> RealArray:
        """Return every mode at the first outputs: translations at the interfaces, then panels.

        Returns
        -------
        array, shape (n_mode, n_outputs)
            [kg^-1/2].
        """
        at_interfaces = self.shapes[:, :, :3].reshape(len(self.shapes), -1)
        return np.hstack([at_interfaces, self.panel_shapes])[:, :n_outputs]


def read_vehicle_truth(folder: Path, run: str) -> VehicleTruth | None:
    """Read the truth of a virtual vehicle.

    Parameters
    ----------
    folder : Path
        Of the vehicle.
    run : str
        On the road.

    Returns
    -------
    VehicleTruth or None
        None for a vehicle that nobody knows the truth of.
    """
    paths = [Path(folder) / "truth" / f"{name}.npz" for name in (run, "vehicle")]
    if not all(path.is_file() for path in paths):
        return None
    driven, body = (_arrays(path) for path in paths)
    frequency = driven["frequency"].real
    ears, interfaces = (tuple(body[name].tolist()) for name in ("ears", "interfaces"))
    transfer: ComplexArray = body["noise_transfer"]
    return VehicleTruth(
        force=Spectrum(frequency, driven["force"], tuple(driven["channels"].tolist()), "N"),
        pressure=Spectrum(frequency, driven["pressure_of_mounts"], ears, "Pa"),
        noise_transfer=Frf(
            body["frequency"],
            transfer.reshape(*transfer.shape[:2], -1),
            ears,
            tuple(f"{name} {load}" for name in interfaces for load in _LOADS),
            "Pa/N",
        ),
        natural_frequency=body["natural_frequencies"],
        damping_ratio=body["damping_ratios"],
        shapes=body["shapes_at_interfaces"],
        panel_shapes=body["shapes_at_panels"],
    )


def _arrays(path: Path) -> dict[str, np.ndarray]:
    with np.load(path, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}
