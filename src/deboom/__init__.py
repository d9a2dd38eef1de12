"""deboom takes the booming noise (15-140 Hz) out of vehicles.

`import deboom` offers the names that ``__init__.pyi`` lists; each is loaded when it is first used.
Everything else stands in the packages: `deboom.physics`, `measurement`, `mounts`, `vehicles`,
`compressor`, `explore`, `files`, `plot`, `report`, `pages`, `supplier`, `runs` and, for a virtual
laboratory with known truth, `bench`.
"""

import lazy_loader

__version__ = "0.3.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
