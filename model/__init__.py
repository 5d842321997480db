"""What the vehicle and the wind are: symbols and data, nothing integrated and no C written."""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
