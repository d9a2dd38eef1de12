"""An acceptance box of the shipped platform, as the study solution_box writes it."""

from deboom.files.acceptance import AcceptanceBox, BoxVariable


def variable(name, lower, upper, **changes):
    """Return an interval of one direction."""
    defaults = {"searched": (0.5, 1.5), "nominal": 0.9, "reference_stiffness_n_per_m": None}
    defaults |= {"condition": "mean |K| over 20 to 60 Hz", "weight": 1.0, "required": True}
    return BoxVariable(name=name, lower=lower, upper=upper, **defaults | changes)


def acceptance_box(variables, responses, **changes):
    """Return a box of the mean level of U06 with prescribed motion."""
    defaults = {
        "title": "Compact platform: acceptance box",
        "platform": "u06_f39_f45",
        "platform_sha256": "0" * 64,
        "group": "U06",
        "motion": "prescribed",
        "mounts": "library-inside",
        "load_cases": (("g5_wot220", 1.0),),
        "band_hz": (20.0, 60.0),
        "quantity": "mean level of the lines",
        "unit": "dB(A)",
        "together": False,
        "share_stated": 0.95,
        "share_verified": 0.96,
        "share_bound": 0.955,
        "share_measured_again": None,
        "confidence": 0.95,
        "n_parts": 1024,
        "law": "uniform in the box",
        "seed": 1,
    }
    return AcceptanceBox(
        variables=tuple(variables), responses=tuple(responses), **defaults | changes
    )
