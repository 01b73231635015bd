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
from ._population import Agreement, Population, agreement, population
from ._run import Run, run
from ._session import Session, open

__all__ = [
    "Agreement",
    "Fit",
    "Library",
    "Material",
    "PalpateError",
    "PalpateWarning",
    "Parameter",
    "Population",
    "Run",
    "Session",
    "__version__",
    "agreement",
    "fit",
    "library",
    "material",
    "open",
    "plot",
    "population",
    "run",
]
