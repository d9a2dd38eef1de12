"""Designs in, responses out: plans, robustness, searches, sensitivity, boxes and shared parts.

This package knows no physics. pymoo stands behind `search` and the decisions of `selection`, SALib
behind `sensitivity`, moocore behind `front`. May import `plot` alone, with which a front draws
itself.
"""
