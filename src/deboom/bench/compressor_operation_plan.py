"""What is written of a running compressor: which one, its hoses, the state of its mounts."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from deboom.bench.compressor_plan import CompressorPlan, HoseCase
from deboom.errors import InputError

PRESSURES = (7.5, 13.5)
"""Of the gas at the outlet [bar]; the frozen data say how gas forces grow from first to second."""


@dataclass(frozen=True)
class OperationPlan:
    """The compressor, what is done to it and what is recorded.

    Parameters
    ----------
    compressor : CompressorPlan
        As struck, without hoses, rigid; softening there is that of the hits.
    hoses : HoseCase
        The true standard hoses.
    hammer_with_hoses : bool
        Strike it with the standard hoses as well.
    mount_storage, mount_loss : float
        Real and imaginary part of the mounts' dynamic stiffness in operation, over those under the
        hammer [1].
    softening : bool
        Mounts soften with their amplitude while it runs.
    sense : int
        1: the rotor turns from y to z; −1: from z to y.
    time_record : bool
        One short run-up over time with tacho as well.

    Raises
    ------
    InputError
        A factor that is not positive, another sense, a compressor with hoses or of two parts.
    """

    compressor: CompressorPlan = field(default_factory=CompressorPlan)
    hoses: HoseCase = HoseCase.SCATTERED
    hammer_with_hoses: bool = False
    mount_storage: float = 1.0
    mount_loss: float = 1.0
    softening: bool = False
    sense: int = 1
    time_record: bool = False

    def __post_init__(self) -> None:
        for name in ("mount_storage", "mount_loss"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise InputError(
                    f"{name.replace('_', ' ')} {value} is no factor on a stiffness: give a "
                    "positive number, such as 0.9"
                )
        if self.sense not in (1, -1):
            raise InputError(
                f"sense {self.sense} is no sense of rotation: give 1 (from y to z) or -1"
            )
        if self.compressor.hoses is not None or self.compressor.flexible_body:
            raise InputError(
                "a running compressor is planned rigid and without hoses; its hoses are `hoses`"
            )

    @property
    def struck_with_hoses(self) -> CompressorPlan:
        """The compressor under the hammer with its standard hoses."""
        return replace(self.compressor, hoses=self.hoses)

    @property
    def running_with_hoses(self) -> CompressorPlan:
        """The compressor with its standard hoses, mounts as they are in operation."""
        return replace(self.compressor, hoses=self.hoses, softening=self.softening)
