"""The bench's own truth, for comparison only: no identification ever sees it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.mounts.operating_map import OperatingMap


@dataclass(frozen=True, eq=False)
class SetTruth:
    """True stiffness of all mounts of one set, run by run.

    Parameters
    ----------
    path : Path
        Where it was read.
    runs, channels : tuple of str
        Names along the first and the last axis.
    frequency : array, shape (n_frequency,)
        [Hz].
    stiffness : array, shape (n_run, n_frequency, n_channel)
        Complex dynamic stiffness [N/m].
    """

    path: Path
    runs: tuple[str, ...]
    channels: tuple[str, ...]
    frequency: RealArray
    stiffness: ComplexArray

    def at(self, measured: OperatingMap) -> ComplexArray:
        """Return the true stiffness at every line of a map, shape (n,) [N/m].

        Raises
        ------
        InputError
            A line that the truth does not know.
        """
        labels, inverse = np.unique(measured.run, return_inverse=True)
        places = []
        for label in labels:
            run, _, piece = str(label).partition(" ")
            channel = " ".join(filter(None, (measured.mount, piece, measured.axis)))
            if run not in self.runs or channel not in self.channels:
                raise InputError(f"{self.path}: no truth of channel {channel} in run {run}")
            places.append((self.runs.index(run), self.channels.index(channel)))
        rows = np.searchsorted(self.frequency, measured.frequency - 1e-6)
        known = self.frequency[np.minimum(rows, self.frequency.size - 1)]
        if not np.allclose(known, measured.frequency, rtol=0, atol=1e-6):
            raise InputError(f"{self.path}: its frequency lines are not those of the campaign")
        run_place, channel_place = np.array(places)[inverse].T
        return np.asarray(self.stiffness[run_place, rows, channel_place])


def read_set_truth(campaign_folder: Path, mount_set: str) -> SetTruth | None:
    """Read the truth of a virtual campaign.

    Parameters
    ----------
    campaign_folder : Path
        Folder of ``campaign.toml``.
    mount_set : str
        Parts on the bench.

    Returns
    -------
    SetTruth or None
        None for a campaign that nobody knows the truth of.
    """
    path = Path(campaign_folder) / "truth" / f"{mount_set}.npz"
    if not path.is_file():
        return None
    with np.load(path, allow_pickle=False) as arrays:
        return SetTruth(
            path=path,
            runs=tuple(arrays["runs"].tolist()),
            channels=tuple(arrays["channels"].tolist()),
            frequency=arrays["frequency"],
            stiffness=arrays["stiffness"],
        )
