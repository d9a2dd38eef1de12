"""What all tests of whole studies share."""

import pytest

from deboom.report.figures import canvas

PAGE_SIZES = ("test_supplier_report", "test_interactive_front")
"""Modules that hold the size of a page against its limit: there pictures are as delivered."""


@pytest.fixture(scope="module", autouse=True)
def coarse_pictures(request):
    """Draw every figure in full, in fewer dots: most of a small study's time goes into dots.

    What a figure shows, and its size, is the business of the tests of `deboom.report.figures`.
    """
    with pytest.MonkeyPatch.context() as patch:
        if request.module.__name__ not in PAGE_SIZES:
            patch.setattr(canvas, "DPI", 100)
        yield
