"""The families, one file for each thing that a term depends on."""

import pkgutil
from importlib import import_module

for _module in pkgutil.iter_modules(__path__, __name__ + "."):
    import_module(_module.name)
