"""Wind response statistics of ascending launch vehicles by the method of adjoint systems; every public name is here.

Names are imported when first used, so that ``import ascentwind`` and a help text wait for nothing; ``__init__.pyi``
lists them, for people, editors and type checkers alike.
"""

from importlib.metadata import version as _version

import lazy_loader as _lazy

__version__ = _version("ascentwind")
__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
