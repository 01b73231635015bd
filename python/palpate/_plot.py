"""Figures with matplotlib."""
from __future__ import annotations

from typing import TYPE_CHECKING, Any, Optional, Union

from ._fit import Fit
from ._native import PalpateError
from ._session import Session, open as open_session

if TYPE_CHECKING:
    import os

    from matplotlib.axes import Axes

#: More points than a screen has columns: beyond that a line is drawn through the lowest and highest of each bucket.
_POINTS_MAX = 8000


def _thinned(t: Any, values: Any) -> Any:
    """At most `_POINTS_MAX` points that keep every extreme."""
    import numpy as np

    known = np.isfinite(values)
    t, values = t[known], values[known]
    if len(t) <= _POINTS_MAX:
        return t, values
    size = -(-2 * len(t) // _POINTS_MAX)
    whole = len(t) // size * size
    buckets = values[:whole].reshape(-1, size)
    starts = np.arange(0, whole, size)
    ends = np.stack([starts + buckets.argmin(axis=1), starts + buckets.argmax(axis=1)], axis=1)
    picked = np.append(np.sort(ends, axis=1).ravel(), np.arange(whole, len(t)))
    return t[picked], values[picked]


def plot(
    session: "Union[Session, str, os.PathLike[str]]", fit: Optional[Fit] = None, ax: "Optional[Axes]" = None
) -> "Axes":
    """Draws force and depth of a session over time, and a fit of it over the force; the axes of the force.

    ``ax`` are axes to draw on; without them a new figure is made. Every extreme is drawn, however long the session.

    >>> session = palpate.open("demo")
    >>> axes = palpate.plot(session, fit=session.fit())
    >>> axes.get_xlabel(), axes.get_ylabel(), len(axes.lines)
    ('time (s)', 'force (N)', 2)
    """
    try:
        import matplotlib.pyplot as pyplot
    except ImportError:
        raise PalpateError("matplotlib is not installed; install it with pip install 'palpate[plot]'") from None
    if not isinstance(session, Session):
        session = open_session(session)
    samples = session.samples("numpy", columns="t_s,depth_mm,force_N")
    if ax is None:
        ax = pyplot.subplots(figsize=(8, 4.5), layout="constrained")[1]
    deep = ax.twinx()
    deep.plot(*_thinned(samples["t_s"], samples["depth_mm"]), color="0.6", linewidth=1)
    deep.set_ylabel("depth (mm)", color="0.4")
    # The force is in front of the depth, whose axes were made later.
    ax.set_zorder(deep.get_zorder() + 1)
    ax.patch.set_visible(False)
    ax.plot(*_thinned(samples["t_s"], samples["force_N"]), linewidth=1, label="measured")
    if fit is not None:
        for number, curve in enumerate(fit.curves):
            label = f"fit, {fit.get('family', 'model')}" if number == 0 else None
            ax.plot(*_thinned(curve.t, curve.modelled), linewidth=1.5, label=label)
        ax.legend(loc="upper right")
    ax.set_xlabel("time (s)")
    ax.set_ylabel("force (N)")
    specimen = session.manifest.get("specimen") or session.path.name
    ax.set_title(str(specimen))
    return ax
