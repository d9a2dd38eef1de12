"""A spring with hysteretic loss, as it would stand in deboom.mounts.response_surface."""

import numpy as np

from deboom.mounts.response_surface import StiffnessModel


class HystereticModel(StiffnessModel):
    """A spring that follows the preload with one loss factor, ``K = k(F0) (1 + jη)``."""

    def _fit(self, lines):
        preload, stiffness = lines.points[:, :1], lines.stiffness
        self.spring_ = self._copy().fit(preload, stiffness.real, lines.weight)
        spring = self.spring_.predict(preload)
        # η by weighted least squares of Im K = η k
        self.loss_factor_ = np.sum(lines.weight * spring * stiffness.imag) / np.sum(
            lines.weight * spring**2
        )

    def _values(self, points):
        return self.spring_.predict(points[:, :1]) * (1 + 1j * self.loss_factor_)
