"""Commands whose options follow from the signatures of public functions.

    @command("planning.plan", "planning.Goniometer", short_help="Plan which directions to measure.")
    @material_argument
    def plan(material: TypedMaterial, asked: TypedArguments) -> None:
        planned = asked.call("planning.plan", material.read(), goniometer=asked.call("planning.Goniometer"))

Each declared argument of `gn.planning.plan` and `gn.planning.Goniometer` is an option: angles are typed in degrees,
shares in %, words in any case, several values with commas between. What is not typed is left to the function. The
functions are imported when a command is parsed or its help is shown.
"""

from __future__ import annotations

import inspect
import math
import os
import re
import typing
from collections.abc import Callable, Collection, Mapping
from functools import cached_property
from types import UnionType
from typing import Any

import click
from click.core import ParameterSource
from click.shell_completion import CompletionItem

from ..declared.arguments import ABOVE_ZERO, BELOW, Declared, FunctionArgument, arguments
from ..declared.typed import all_in_degrees, is_number, suspect_radians
from ..errors import Error, MeaningWarning, ParameterError, warn
from ..facts.public import public
from . import completion

METAVARS = {bool: "BOOL", int: "N", float: "X", str: "TEXT"}
"""Kinds of values -> how the help calls one of them."""

UNITS = {"rad": "ANGLE", "share": "PERCENT", "direction": "THETA,PHI"}
"""Units of values -> how the help calls one of them."""

LONGEST = 24
"""Characters of words that the help lists in the place of a value."""

FAINT, FAINT_PART = 0.1, 1.0
"""Shares [%] without their sign below which it is told that they were taken in %: any, and those that may be all."""

COMPLETED = {"format": completion.formats}
"""Declared arguments -> what the shell completes them by; words and files complete themselves."""


TYPED = "gonio.typed"
"""Where the context of a command holds its options as they were typed, by the names of arguments."""


class Typed(click.ParamType):
    """The value of a declared argument, as typed; errors are in the units of the command line."""

    name = "value"

    def __init__(self, argument: FunctionArgument):
        doc = _NAMED.sub(lambda match: _option_of(match[1]), argument.declared.doc)
        self.declared = argument.declared._replace(doc=doc)
        self.argument = argument._replace(declared=self.declared)
        self.kinds = [hint for of in argument.kinds for hint in _flat(of)]

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:
        """The word of the help: ANGLE,ANGLE, or [log|cosine]."""
        listed = f"[{'|'.join(map(str, self.declared.words))}]"
        several = next((hint for hint in self.kinds if typing.get_origin(hint) not in (None, os.PathLike)), None)
        if self.declared.words and len(listed) <= LONGEST and several is None:
            return listed
        if several is not None:
            inner = typing.get_args(several)
            one = self._one(_flat(inner[0])[0])
            return ",".join([one] * len(inner)) if typing.get_origin(several) is tuple else f"{one},.."
        return next((name for hint in self.kinds if (name := self._one(hint)) != "VALUE"), "VALUE")

    def _one(self, hint: Any) -> str:
        if hint in (float, Any) and self.declared.unit in UNITS:
            return UNITS[self.declared.unit]
        return "FILE" if self.is_path else "WORD" if self.declared.words else METAVARS.get(hint, "VALUE")

    @property
    def is_path(self) -> bool:
        """Whether it names a file."""
        return any(os.PathLike in (hint, typing.get_origin(hint)) for hint in self.kinds)

    def help(self) -> str:
        """What the argument means, in which unit."""
        d = self.declared
        unit = f" [{d.typed.unit}]" if d.unit else ""
        shown = d.words and self.get_metavar(click.Option(["-x"]))[0] != "["
        words = f" One of {', '.join(map(str, d.words))}." if shown else ""
        first = d.doc[0] if re.split(r"\W", d.doc)[0] in d.words else d.doc[0].upper()
        return f"{first}{d.doc[1:]}{unit}.{words}"

    def settings(self, usual: str, multiple: bool = False) -> dict[str, Any]:
        """Those of the option that takes it; its help says the default."""
        told = f"{self.help()}{' May be repeated.' * multiple}{f'  [default: {usual}]' if usual else ''}"
        return {"type": self, "help": told, "multiple": multiple}

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The value of the text that was typed, in the unit of Python."""
        if not isinstance(value, str):
            return value
        option = _shown(param)
        quoted = f"{option} {value!r:.60}"
        if param is not None and ctx is not None:
            ctx.meta.setdefault(TYPED, {})[param.name] = quoted
        result = self.argument.checked_text(value, quoted)
        if result is not None:
            self._suspect(option, value)
        return result

    def _suspect(self, option: str, text: str) -> None:
        """Warn of polar angles that look like radians, of percents that look like shares."""
        d = self.declared
        if d.unit == "rad" and d.low in (0.0, ABOVE_ZERO) and BELOW.get(d.high, d.high) == 0.5 * math.pi:
            suspect_radians(option, text, all_in_degrees(text))
        faint = FAINT_PART if d.high == 1.0 else FAINT
        if d.unit == "share" and is_number(text) and 0.0 < float(text) < faint:
            share = f"a share of 1? write {100.0 * float(text):g}%, and to be rid of this {text}%"
            warn(f"{option} {text}: taken as {text} %; {share}", MeaningWarning)

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """Words, formats and files."""
        if self.argument.name in COMPLETED:
            return COMPLETED[self.argument.name](ctx, param, incomplete)
        if self.is_path:
            return [CompletionItem(incomplete, type="file")]
        words = map(str, self.declared.words)
        return [CompletionItem(word) for word in words if word.lower().startswith(incomplete.lower())]


def _shown(parameter: click.Parameter | None) -> str:
    """How people call a parameter: --theta-i, or N."""
    if isinstance(parameter, click.Argument):
        return parameter.human_readable_name
    return parameter.opts[-1] if parameter is not None else ""


def _flat(hint: Any) -> tuple[Any, ...]:
    """The types in `A | B`, without their declarations."""
    hint = typing.get_args(hint)[0] if hasattr(hint, "__metadata__") else hint
    return typing.get_args(hint) if typing.get_origin(hint) in (UnionType, typing.Union) else (hint,)


def _option_of(name: str, negative: str = "") -> str:
    """The option for an argument: --theta-i, --no-fits, -k."""
    return f"--{negative}{name.replace('_', '-')}" if len(name) > 1 else f"-{name}"


_NAMED = re.compile(r"`(\w+)`")
"""An argument that what another one means speaks of."""


def option(
    *names: str, kind: Any = str, means: Declared, default: Any = None, **settings: Any
) -> Callable[[Callable], Callable]:
    """An option of a command alone, declared as arguments of functions are: `option("-k", "factor", ...)`."""
    argument = FunctionArgument(names[-1].lstrip("-"), (kind,), default, means)
    return click.option(*names, **Typed(argument).settings(argument.usual), default=default, **settings)


class TypedArguments:
    """The declared arguments of functions that were typed; of others the function has its own default."""

    def __init__(self, functions: Mapping[str, Callable], values: dict[str, Any], typed: Mapping[str, str]):
        self._functions, self._values, self._typed = functions, values, typed

    def of(self, *names: str) -> dict[str, Any]:
        """The keyword arguments of a function, or those that all of several have."""
        declared = [arguments(self._functions[name]) for name in names]
        return {key: value for key, value in self._values.items() if all(key in of for of in declared)}

    def call(self, name: str, *args: Any, **more: Any) -> Any:
        """Call a public function with its typed arguments, and with the values of this command for others."""
        return public(name)(*args, **{**self.of(name), **more})

    def refuse_others(self, why: str, *names: str) -> None:
        """Raise ParameterError for an option that none of these functions has."""
        declared = {key for name in names for key in arguments(self._functions[name])}
        for key, option in self._typed.items():
            if key not in declared:
                raise ParameterError(f"{option}: does nothing {why}; leave it out")


class Command(click.Command):
    """A command with the declared arguments of functions as options; its callback gets them as `asked`.

    asks       public names of gonio, and functions, in the order of the help
    options    names of arguments -> the option's: "-d" beside the usual one, "-b --basis" in its place, "" for none
    usual      values that this command takes where the function has other ones
    repeated   arguments that are typed once for each of their values, which may hold commas
    """

    def __init__(
        self,
        asks: Collection[str | Callable] = (),
        options: Mapping[str, str] | None = None,
        usual: Mapping[str, Any] | None = None,
        repeated: Collection[str] = (),
        **settings: Any,
    ):
        super().__init__(**settings)
        self._asks, self._options, self._usual, self._repeated = asks, options or {}, usual or {}, repeated

    @cached_property
    def functions(self) -> dict[str, Callable]:
        """The functions whose declared arguments are options."""
        return {
            (name if isinstance(name, str) else name.__name__): (public(name) if isinstance(name, str) else name)
            for name in self._asks
        }

    @cached_property
    def asked(self) -> list[click.Parameter]:
        """The options; of arguments of several functions that of the first."""
        every: dict[str, FunctionArgument] = {}
        for function in self.functions.values():
            every |= {name: of for name, of in arguments(function).items() if name not in every}
        return [self._parameter(name, of) for name, of in every.items() if self._options.get(name) != ""]

    def _parameter(self, name: str, argument: FunctionArgument) -> click.Parameter:
        param_type, flags = Typed(argument), self._options.get(name, "").split()
        if argument.default is inspect.Parameter.empty and not flags:
            return click.Argument([name], type=param_type, metavar=name.upper())
        negative = "no-" if argument.default is True else ""
        names = [*flags, name]
        if not any(option.startswith("--") for option in flags):
            names.append(_option_of(name, negative))
        if param_type.kinds == [bool]:
            told = param_type.help()
            told = f"Without it {told[0].lower()}{told[1:]}" if negative else told
            return click.Option(names, is_flag=True, flag_value=not negative, default=bool(negative), help=told)
        usual = argument._replace(default=self._usual[name]).usual if name in self._usual else argument.usual
        return click.Option(names, **param_type.settings(usual, multiple=name in self._repeated))

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """The command's own parameters, those of the functions, and --help."""
        parameters = super().get_params(ctx)
        return [*parameters[: len(self.params)], *self.asked, *parameters[len(self.params) :]]

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the arguments that are declared, and the options."""
        told = [
            (p.make_metavar(ctx), p.type.help())
            for p in self.asked
            if isinstance(p, click.Argument) and isinstance(p.type, Typed)
        ]
        if told:
            with formatter.section("Arguments"):
                formatter.write_dl(told)
        super().format_options(ctx, formatter)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        values, typed = {**self._usual}, {}
        for parameter in self.asked:
            name = str(parameter.name)
            value = ctx.params.pop(name)
            if ctx.get_parameter_source(name) not in (ParameterSource.DEFAULT, None):
                values[name], typed[name] = value, parameter.opts[-1]
        if self._asks:
            ctx.params["asked"] = TypedArguments(self.functions, values, typed)
        try:
            return super().invoke(ctx)
        except Error as error:
            named, rule = re.match(r"(?:\w+\(|--option ')?(\w+)=", str(error)), str(error).find(": expected")
            text = ctx.meta.get(TYPED, {}).get(named[1]) if named else None
            if text is None or rule < 0:
                raise
            raise ParameterError(text + str(error)[rule:]) from None


def command(*asks: str | Callable, **settings: Any) -> Callable[[Callable], Command]:
    """Make a command of a function, which gets the declared arguments of public functions as `asked`."""
    return click.command(cls=settings.pop("cls", Command), asks=asks, **settings)
