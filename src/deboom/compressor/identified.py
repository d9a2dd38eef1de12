"""What is kept of an identification: the compressor, and the placement that the test revealed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from deboom.arrays import RealArray
from deboom.compressor.minimal_parameters import MinimalParameters
from deboom.errors import InputError

if TYPE_CHECKING:
    from deboom.compressor.identify import Identification
    from deboom.compressor.model import CompressorModel


@dataclass(frozen=True, eq=False)
class IdentifiedCompressor:
    """An identified compressor, its uncertainty, and the sensors that it was seen with.

    Parameters
    ----------
    name : str
        Of the test.
    model : CompressorModel
        About the origin of the position sheet, which is the virtual point.
    length : float
        Characteristic length of the parameters [m].
    reference_frequency : float
        Where the real part of the gain is 1 [Hz].
    parameter_names : tuple of str
        Of `MinimalParameters`, in its order.
    values : array, shape (n,)
        Of the parameters [1].
    covariance : array, shape (n, n)
        Posterior, placement errors integrated out [1].
    channels : tuple of str
        Of the accelerometers.
    response : array, shape (n_channel, 6)
        Motion at the virtual point → channels, as calibrated [1, m].
    impacts : tuple of str
    excitation : array, shape (n_impact, 6)
        Wrench at the virtual point per newton of the hammer, as calibrated [1, m].
    placement_names : tuple of str
        Of the placement errors.
    placement_errors, placement_deviations : array, shape (n_errors,)
        As found, and their posterior standard deviations [1, m, rad].
    reduced_chi : float
        Residuals over noise [1].
    bands : tuple of (float, float)
        That were fitted [Hz].
    alarms : tuple of str
        Reasons not to trust it; empty where there are none.
    inputs_sha256 : mapping of str to str
        Files that it was identified from.

    Raises
    ------
    InputError
        Shapes that do not fit together.
    """

    name: str
    model: CompressorModel
    length: float
    reference_frequency: float
    parameter_names: tuple[str, ...]
    values: RealArray
    covariance: RealArray
    channels: tuple[str, ...]
    response: RealArray
    impacts: tuple[str, ...]
    excitation: RealArray
    placement_names: tuple[str, ...]
    placement_errors: RealArray
    placement_deviations: RealArray
    reduced_chi: float
    bands: tuple[tuple[float, float], ...]
    alarms: tuple[str, ...]
    inputs_sha256: Mapping[str, str]

    def __post_init__(self) -> None:
        n, n_errors = len(self.parameter_names), len(self.placement_names)
        shapes = {
            "values": (n,),
            "covariance": (n, n),
            "response": (len(self.channels), 6),
            "excitation": (len(self.impacts), 6),
            "placement_errors": (n_errors,),
            "placement_deviations": (n_errors,),
        }
        for field, shape in shapes.items():
            array = np.array(getattr(self, field), dtype=float)
            if array.shape != shape or not np.all(np.isfinite(array)):
                raise InputError(f"{field} of compressor {self.name} needs {shape} finite numbers")
            array.setflags(write=False)
            object.__setattr__(self, field, array)


def identified_compressor(
    found: Identification,
    bands: tuple[tuple[float, float], ...],
    inputs_sha256: Mapping[str, str],
) -> IdentifiedCompressor:
    """Keep what later work needs of an identification.

    Parameters
    ----------
    found : Identification
    bands : tuple of (float, float)
        That were fitted [Hz].
    inputs_sha256 : mapping of str to str
        Of the files of the test.

    Returns
    -------
    IdentifiedCompressor
    """
    calibrated = found.calibrated
    n = calibrated.values.size
    return IdentifiedCompressor(
        name=found.test.name,
        model=calibrated.model,
        length=found.length,
        reference_frequency=MinimalParameters(found.length).reference_frequency,
        parameter_names=calibrated.parametrisation.names,
        values=calibrated.values,
        covariance=calibrated.parameter_covariance,
        channels=found.test.frf.outputs,
        response=calibrated.placement.response_matrix(calibrated.errors),
        impacts=found.test.frf.inputs,
        excitation=calibrated.placement.excitation_matrix(calibrated.errors),
        placement_names=calibrated.placement.names,
        placement_errors=calibrated.errors,
        placement_deviations=np.sqrt(np.diag(calibrated.covariance)[n:]),
        reduced_chi=calibrated.reduced_chi,
        bands=bands,
        alarms=found.alarms,
        inputs_sha256=inputs_sha256,
    )
