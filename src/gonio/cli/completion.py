"""Completion of words by the shell: `gonio completion SHELL` prints its script, the rest says what there is to type."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable

import click
from click.shell_completion import CompletionItem, get_completion_class

from .terminal import echo

SHELLS = ("bash", "zsh", "fish")

VARIABLE = "_GONIO_COMPLETE"
"""How the script of a shell asks for words: click's name for it."""


@click.command(short_help="Print the script that completes words in a shell.")
@click.argument("shell", type=click.Choice(SHELLS))
@click.pass_context
def completion(ctx: click.Context, shell: str) -> None:
    """Print the script by which SHELL completes commands, options, built-in materials, models, formats and files.

    \b
    Once, for all shells to come:
      bash   gonio completion bash >> ~/.bashrc
      zsh    gonio completion zsh >> ~/.zshrc          (below compinit)
      fish   gonio completion fish > ~/.config/fish/completions/gonio.fish
    """
    kind = get_completion_class(shell)
    assert kind is not None  # one of click's own
    root = ctx.find_root()
    made = kind(root.command, {}, "gonio", VARIABLE)
    echo((made.source_template % made.source_vars()).strip())


def materials(ctx: click.Context, param: click.Parameter, typed: str) -> list[CompletionItem]:
    """Names of built-in materials, and files."""
    from ..catalogue.builtin import materials as entries

    return _and_files((entry.name for entry in entries()), typed)


def models(ctx: click.Context, param: click.Parameter, typed: str) -> list[CompletionItem]:
    """Names of models, distributions and Fresnel terms."""
    from ..facts.models import kinds

    return _starting((name for of in kinds().values() for name in of), typed)


def formats(ctx: click.Context, param: click.Parameter, typed: str) -> list[CompletionItem]:
    """Names of file formats."""
    from ..formats import formats as every

    return _starting((module.NAME for module in every()), typed)


def lights(ctx: click.Context, param: click.Parameter, typed: str) -> list[CompletionItem]:
    """Words for lights, and files."""
    from ..lights._words import words

    return _and_files((word.name for word in words() if not word.name.startswith("FILE")), typed)


def _starting(names: Iterable[str], typed: str) -> list[CompletionItem]:
    return [CompletionItem(name) for name in names if name.lower().startswith(typed.lower())]


def _and_files(names: Iterable[str], typed: str) -> list[CompletionItem]:
    found = _starting(names, typed)
    if os.environ.get(VARIABLE, "").startswith("bash") and found:  # where bash has words, it adds no files by itself
        found += [CompletionItem(path) for path in sorted(glob.glob(glob.escape(typed) + "*")) if os.path.isfile(path)]
    return [CompletionItem(typed, type="file"), *found]
