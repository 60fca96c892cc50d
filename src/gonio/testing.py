"""For tests with pytest: hold reflectances of your own to the laws of `gonio.check`.

from gonio.testing import assert_lawful, each_law

def test_my_paint():
    assert_lawful(MyPaint(0.3))

@each_law                                   # one test per law, named after it
def test_my_measurement(law):
    assert_lawful(gonio.load("paint.bsdf"), laws=[law])
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, TypeVar

from .base.map_shape import map_shape
from .base.reflectance import Reflectance
from .errors import NotFoundError, ShapeError, needed
from .laws import LAWS, Report, check

if TYPE_CHECKING:
    Test = TypeVar("Test", bound=Callable[..., object])

    def each_law(test: Test) -> Test:
        """A test per law: its argument `law` is the name."""
        return test


def assert_lawful(m: Reflectance, except_: str | Iterable[str] = (), laws: str | Iterable[str] | None = None) -> Report:
    """Raise AssertionError, with the report, unless `m` obeys the laws; returns the report.

    A breach that the class declares in `breaks` passes. So does one named in `except_`, but only if it happens: an
    exception for a law that holds is an error too. `laws`: only these.

    Example
    >>> from gonio.testing import assert_lawful
    >>> print(assert_lawful(gn.Lambertian(0.5), laws="energy").passed)
    True
    """
    excused = {except_} if isinstance(except_, str) else set(except_)
    if unknown := sorted(excused - set(LAWS)):
        raise NotFoundError(f"assert_lawful(except_={unknown}): no such laws; expected some of {', '.join(LAWS)}")
    if maps := map_shape(m):
        raise ShapeError(
            f"assert_lawful: parameters are maps of shape {maps}; expected one material; maps: gn.check(m)"
        )
    report: Report = check(m, laws=[laws] if isinstance(laws, str) else list(LAWS if laws is None else laws))
    if broken := [law.name for law in report.laws if law.verdict == "FAIL" and law.name not in excused]:
        raise AssertionError(f"breaks {', '.join(broken)}\n{report}")
    if idle := sorted(law.name for law in report.laws if law.passed and law.name in excused):
        raise AssertionError(f"{', '.join(idle)}: excepted, but obeyed; drop the exception\n{report}")
    return report


def __getattr__(name: str) -> Any:
    if name != "each_law":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    with needed("each_law needs pytest", "pip install pytest"):
        import pytest
    return pytest.mark.parametrize("law", list(LAWS))
