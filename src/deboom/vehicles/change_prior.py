"""What the analysis believes of bodies and rubber before a car tells, and how wide intervals are.

Bounds are those of log-uniform draws. They are wider than any kind of body that the bench draws,
and nothing here is read from the bench: a prior that holds stiff bodies alone misses soft ones, and
the other way round, and a wider interval mends how often it holds, not where its middle lies.
"""

from __future__ import annotations

MODES = (8, 28)
"""Fewest and most modes of a trimmed body in the band of booming noise [1]; a mode per 3 to 10 Hz,
judgement."""

LOWEST, HIGHEST = (6.0, 18.0), (60.0, 110.0)
"""Where these modes begin and end [Hz]; judgement."""

SHAPE = (0.004, 0.06)
"""Size of the shapes at the mounts [kg^-1/2]: modal masses of 0.3 to 60 t, from a small body of
sheet metal to a stiff front end of a heavy car; judgement."""

ATTACHMENT = (2.5e6, 5e7)
"""Stiffness of an attachment by itself along one direction [N/m]: from a longitudinal member that
gives way, as in Courteille et al., European Journal of Mechanics A/Solids 24, 2005, to a cast
bracket; judgement."""

DAMPING = (0.003, 0.08)
"""Damping ratios of trimmed bodies [1]; judgement."""

SHAPE_SPREAD, ATTACHMENT_SPREAD = 0.4, 0.4
"""Of a shape's size from mode to mode, and of an attachment from direction to direction, log-normal
[1]; judgement."""

LATERAL = (0.3, 1.0)
"""Shapes along y over those along x and z [1]; judgement."""

RUBBER_TEST, RUBBER_MOUNT = 0.085, 0.04
"""Stiffness of the mounts in the car over that in the test, of all together and of each, log-normal
[1]: 10 K, age and hardness; judgement, on temperature and hardness see Gent, Engineering with
Rubber, 3rd ed., Hanser, 2012."""

RUBBER_AGE = 0.05
"""The same of all together where temperatures are stated [1]: age and hardness; judgement."""

SLOPE, SLOPE_SPREAD = (0.015, 0.30), 0.3
"""Exponent by which a stiffness falls with the amplitude, and its log-normal spread from mount to
mount [1]: hardly to strongly filled rubber, as of Payne, Journal of Applied Polymer Science 6,
1962; judgement."""

FLOOR = 0.03
"""Least half width of an interval before its factor [dB]: a car without a change has one, too."""

WIDTH = {"unknown": 0.97, "driving_points": 1.23, "receptances": 0.80}
"""Factor on both sides of the interval of one car, by what is known of its body [1]; 90 % bootstrap
intervals over platforms: 0.86 to 1.06, 1.11 to 1.36, 0.73 to 0.86."""

MEAN_WIDTH = {"unknown": 0.88, "driving_points": 1.27, "receptances": 0.82}
"""The same of the mean of vehicles [1]: 0.82 to 1.13, 1.01 to 1.49, 0.71 to 0.87."""

WORST_WIDTH = {"unknown": 1.02, "driving_points": 1.26, "receptances": 0.83}
"""The same of the vehicle that gains least [1]: 0.86 to 1.19, 1.05 to 1.48, 0.66 to 1.02."""

PEAK_WIDTH = {"unknown": 0.81, "driving_points": 0.87, "receptances": 0.85}
"""The same of the loudest line of a car [1]: 0.74 to 0.89, 0.80 to 0.97, 0.78 to 0.91."""

PEAK_CENTRE = (0.0, 1.0)
"""As `CENTRE`, of the loudest line [1]."""

CENTRE = {"unknown": (0.30, 0.65), "driving_points": (0.65, 0.31), "receptances": (0.43, 0.58)}
"""Parts of the model's change and of the mean of the draws in the expected change [1].

Centres and widths follow from 162 platforms of the bench by the rule in
``benchmarks/expected_change.py``, without bodies of the kinds light and truck."""
