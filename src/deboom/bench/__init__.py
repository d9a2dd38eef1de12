"""Virtual test bench with known truth: each function writes the files of one measurement.

May import `physics` and `files`; no code that identifies imports it.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
