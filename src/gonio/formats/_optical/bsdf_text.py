"""The text of Zemax's and LightTools' `.bsdf`: comments, words, lists of angles after their lengths, and tables."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

import numpy as np

from ...errors import FormatError
from .._reading import plain_text


def opened(path: Path) -> tuple[plain_text.Lines, tuple[str, ...]]:
    """The lines of a file without its comments, which begin with #, and these."""
    text = plain_text.text(path)
    comments = tuple(line[1:].strip() for line in text.split("\n") if line.startswith("#"))
    return plain_text.Lines(path, text, "#"), comments


def key_and_words(line: str) -> tuple[str, list[str]]:
    """The first word of a line, in lower case, and the others."""
    key, *rest = plain_text.split(line) or [""]
    return key.lower(), rest


def header(
    lines: plain_text.Lines, lists: Collection[str], end: Collection[str]
) -> tuple[dict[str, str], dict[str, list[float]]]:
    """Words by keys in lower case, and angles by the names in `lists`; up to a line that begins with a key in `end`.

    An entry of `lists` is followed by how many angles there are, and by these, in as many lines as they take.
    """
    words: dict[str, str] = {}
    angles: dict[str, list[float]] = {}
    names = {name.lower(): name for name in lists}
    while (line := lines.peek()) is not None and key_and_words(line)[0] not in end:
        lines.next()
        key, rest = key_and_words(line)
        if key not in names:
            words[key] = " ".join(rest)
            continue
        name = names[key]
        if not rest:
            raise lines.fault(line, f"{name} and how many angles")
        count = lines.count(rest[0], f"{name} and how many angles")
        angles[name] = numbers = [lines.float(token) for token in rest[1:]]
        numbers.extend(lines.numbers(count - len(numbers), f"angles of {name}") if count > len(numbers) else ())
        if len(numbers) != count:
            raise lines.fault(line, f"{count} angles, not {len(numbers)}")
    return words, angles


def one_of(lines: plain_text.Lines, words: dict[str, str], name: str, allowed: Sequence[str]) -> str:
    """The word of an entry, as it is in `allowed`. Raises FormatError for another one."""
    word = {word.lower(): word for word in allowed}.get(words.get(name, "").lower())
    if word is None:
        got = repr(words[name]) if name in words else "nothing"
        raise FormatError(f"{lines.path}: {name} is {got}, expected one of {', '.join(allowed)}")
    return word


def table(lines: plain_text.Lines, azimuths: int, radials: int) -> np.ndarray:
    """The next numbers (azimuth, radial)."""
    expected = f"values, one row for each of {azimuths} azimuths"
    return np.array([lines.numbers(radials, expected) for _ in range(azimuths)])


def listed(name: str, angles: list[float]) -> Iterator[str]:
    """An entry of angles as it is written."""
    yield f"{name}\t{len(angles)}\n"
    yield from plain_text.join([angles], "\t")
