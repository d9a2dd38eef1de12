"""deboom takes the booming noise (15-140 Hz) out of vehicles.

`import deboom` offers the names that ``__init__.pyi`` lists; each is loaded when it is first used.
Everything else stands in the packages: `deboom.physics`, `measurement`, `mounts`, `vehicles`,
`compressor`, `explore`, `files`, `plot`, `report`, `pages`, `supplier`, `runs` and, for a virtual
laboratory with known truth, `bench`.
"""

import sys
from pathlib import Path

try:
    import lazy_loader
except ImportError:
    sentence = "deboom needs lazy_loader, which is not installed: pip install lazy-loader"
    if Path(sys.argv[0]).stem in ("deboom", "-m"):  # the command; a traceback says no more
        raise SystemExit(sentence) from None
    raise ImportError(sentence) from None

__version__ = "0.3.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
