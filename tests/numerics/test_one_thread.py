"""BLAS has one thread where many small matrices are multiplied, and its own number afterwards."""

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import gonio as gn
from gonio.layers import response
from gonio.numerics.one_thread import one_thread


def blas_threads():
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


def test_it_ends_with_the_last_in_any_order():
    with threadpool_limits(2, "blas"):
        before, first, second = blas_threads(), one_thread(), one_thread()
        first.__enter__()
        second.__enter__()
        first.__exit__(None, None, None)
        assert blas_threads() == {1}
        second.__exit__(None, None, None)
        assert blas_threads() == before


def test_it_ends_after_errors():
    with threadpool_limits(2, "blas"):
        before = blas_threads()
        with pytest.raises(ZeroDivisionError), one_thread():
            _ = 1 / 0
        assert blas_threads() == before


def test_stacks_are_computed_so(monkeypatch):
    seen, whole = [], response._shared
    monkeypatch.setattr(response, "_shared", lambda *args: (seen.append(blas_threads()), whole(*args))[1])
    with threadpool_limits(2, "blas"):
        gn.Stack([gn.Medium(1.0)], gn.Lambertian(0.5)).f([0, 0, 1], [0, 0, 1])
    assert seen == [{1}]
