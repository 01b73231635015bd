"""Soft-tissue indentation in Python: recorded sessions as data frames, viscoelastic fits with uncertainties, runs on a rig.

>>> import palpate
>>> session = palpate.open("demo")
>>> samples = session.samples()
>>> fit = session.fit()
>>> fit.parameters["tau_eps"].unit
's'

The functions are those of the command ``palpate``, which is installed with the package, in the same process: a fit has
the numbers of ``palpate fit --json``, and samples are the columns of ``palpate export``. Units are in the names.
Whatever palpate cannot do is a :class:`PalpateError` whose text says what is wrong and what to do.
"""
from ._fit import Fit, Parameter, fit
from ._frames import PalpateWarning
from ._library import Library, library
from ._material import Material, material
from ._native import PalpateError, __version__
from ._plot import plot
from ._run import Run, run
from ._session import Session, open

__all__ = [
    "Fit",
    "Library",
    "Material",
    "PalpateError",
    "PalpateWarning",
    "Parameter",
    "Run",
    "Session",
    "__version__",
    "fit",
    "library",
    "material",
    "open",
    "plot",
    "run",
]
