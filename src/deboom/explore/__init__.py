"""Designs in, responses out: robustness, optimisation, selection.

Depends on: numpy and scipy, pymoo behind `problems`, moocore behind `fronts`, SALib behind
`sensitivity`; it knows no physics.
"""
