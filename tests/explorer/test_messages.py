"""Requests are checked before the worker sees them; answers hold JSON without NaN, and arrays as float32."""

import json
import math
from base64 import b64decode

import numpy as np
import pytest
from explorer_server import unpacked

from gonio.errors import ParameterError
from gonio.explorer import messages

UP = [[0.0, 0.0, 1.0]]
GOOD = {"text": "gold", "replaced": {"alpha": 0.3}}


def refused(**request):
    with pytest.raises(ParameterError) as error:
        messages.request(request)
    return str(error.value)


def test_a_request_reaches_the_worker_with_its_arguments_alone():
    name, content = messages.request({"id": 3, "call": "f", **GOOD, "wi": UP, "wo": UP, "more": 1})
    assert name == "f"
    arguments = {**GOOD, "wi": UP, "wo": UP}
    assert json.loads(content) == {"id": 3, "call": "f", "arguments": arguments}


def test_arguments_that_may_be_left_out():
    _, content = messages.request({"id": 3, "call": "source", "text": "gold", "language": "c"})
    assert json.loads(content)["arguments"] == {"text": "gold", "language": "c"}


@pytest.mark.parametrize(
    "wrong",
    [
        {"text": 5},
        {"text": ""},
        {"text": "x" * 20_001},
        {"text": None},
        {"replaced": []},
        {"replaced": {"alpha": True}},
        {"replaced": {"alpha": None}},
        {"replaced": {"alpha": 10**400}},
        {"replaced": {"alpha": math.inf}},
        {"replaced": {"alpha": []}},
        {"replaced": {"alpha": [0.1] * 4097}},
        {"replaced": {"alpha": {"a": 1}}},
        {"replaced": {"": 1.0}},
        {"replaced": {str(k): 1.0 for k in range(1001)}},
        {"wi": UP[0]},
        {"wi": [[0.0, 0.0]]},
        {"wi": [[0.0, 0.0, "1"]]},
        {"wi": UP * 16_385},
        {"wo": []},
    ],
    ids=lambda wrong: repr(wrong)[:40],
)
def test_wrong_arguments_are_refused(wrong):
    words = refused(**{"id": 1, "call": "f", **GOOD, "wi": UP, "wo": UP, **wrong})
    assert words.startswith(f"f({next(iter(wrong))}=") and "expected" in words


def test_unknown_calls_are_refused():
    assert "did you mean 'check'" in refused(id=1, call="chek")
    assert "no such call" in refused(id=1, call=["f"])
    with pytest.raises(ParameterError):
        messages.request([1])


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, "NaN", '{"id": -Infinity}', "9" * 5000])
def test_text_that_is_no_json_is_refused(text):
    with pytest.raises(ParameterError, match="no JSON"):
        messages.decoded(text)


@pytest.mark.parametrize("data, number", [({"id": 3}, 3), ({"id": True}, None), ({"id": 2**60}, None), ([], None)])
def test_id(data, number):
    assert messages.number_of(data) == number


def test_answers_hold_arrays_behind_the_header():
    arrays = [np.arange(6.0).reshape(2, 3), np.array([np.nan, 0.1])]
    sent = {
        "id": 1,
        "result": {"a": arrays[0], "b": [arrays[1]], "c": (math.nan, math.inf, np.float64(2.0), np.int64(3))},
    }
    message = messages.answer(sent)
    found = unpacked(message)
    assert found["result"]["c"] == [None, None, 2.0, 3]
    assert np.array_equal(found["result"]["a"], arrays[0])
    assert np.array_equal(found["result"]["b"][0], arrays[1].astype(np.float32), equal_nan=True)


def test_arrays_in_base64():
    packed = messages.in_base64({"a": np.array([[1.5, -2.0]])})["a"]
    assert packed["shape"] == [1, 2]
    assert np.frombuffer(b64decode(packed["base64"]), "<f4").tolist() == [1.5, -2.0]
