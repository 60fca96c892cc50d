"""Messages of any kind to the explorer's socket, by number: JSON that is nearly a request, broken JSON, bytes."""

from __future__ import annotations

import json
from collections.abc import Iterator
from random import Random
from typing import Any

TEXTS = (
    *("gold", "Lambertian(0.3)", "Lambertian()", "upload:1/a.json", "upload:1/../../../etc/passwd", "/etc/passwd"),
    *("load('/etc/passwd')", 'Lambertian(load("/etc/passwd"))', "GGX(0.1)", "EnvironmentLight('/etc/passwd')", "-", ""),
    *("x" * 30_000, "(" * 500, "Lambertian(0.3)" + " + Lambertian(0.3)" * 40, "\0", "\ud800", "gold\n", "\u202e"),
    *(
        "__import__('os').system('true')",
        "1e999 * Lambertian(0.3)",
        "Lambertian(" + "9" * 5000 + ")",
        "material('gold')",
    ),
)
NUMBERS = (0, 1, -1, 0.5, 1e308, -1e308, 1e-320, 2**53, 10**400, True, False, None, "1", [], {}, [0.1], [0.1] * 5000)
QUICK = ("names", "source", "data", "f", "material", "", "exit", "__class__", "check\0", 5, None, [], {})
"""Calls; "check", "fit" and "albedo" take seconds each."""


def value(random: Random, depth: int = 0) -> Any:
    """Any value of JSON."""
    kind = random.randrange(6)
    if kind == 0 and depth < 4:
        return [value(random, depth + 1) for _ in range(random.randrange(4))]
    if kind == 1 and depth < 4:
        return {random.choice(("rho", "0.rho", "", "x" * 300)): value(random, depth + 1) for _ in range(3)}
    return random.choice(TEXTS if kind < 4 else NUMBERS)


def near(random: Random) -> dict[str, Any]:
    """A request, of which some arguments are wrong."""
    request: dict[str, Any] = {
        "id": random.randrange(1000),
        "call": random.choice(QUICK[:4]),
        "text": random.choice(TEXTS[:3]),
        "replaced": {},
        "language": random.choice(("glsl", "c", "wgsl")),
        "function": random.choice(("f", "pdf", ["f", "pdf"])),
        "parameters": random.choice(("constants", "arguments")),
        "theta_i": random.choice((0, 45.0, 89)),
        "phi_i": 0,
        "wi": [[0.0, 0.6, 0.8]],
        "wo": [[0.0, 0.0, 1.0]],
    }
    for name in random.sample(list(request), random.randrange(3)):
        if random.random() < 0.3:
            del request[name]
        else:
            request[name] = random.choice(QUICK) if name == "call" else value(random)
    return request


def message(random: Random) -> str | bytes:
    """Text or bytes."""
    kind = random.randrange(10)
    if kind == 0:
        return random.randbytes(random.randrange(300))
    if kind == 1:
        return random.choice(
            (
                "",
                " ",
                "{",
                "[" * 100_000,
                '{"a":' * 20_000,
                "NaN",
                '{"id": NaN}',
                '{"id": 1e999}',
                "9" * 10_000,
                "null",
                '""',
            )
        )
    text = json.dumps(near(random))
    if kind == 2:
        place = random.randrange(len(text))
        return text[:place] + random.choice(("", "}", '"', "\0", "NaN", "\U0001f600", "\\")) + text[place + 1 :]
    return text


def messages(count: int, seed: int) -> Iterator[str | bytes]:
    """A number of messages."""
    random = Random(seed)
    for _ in range(count):
        yield message(random)
