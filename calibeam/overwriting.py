"""What a command may write over: `@writes(out=KIND)` in front of a command function.

Before the command begins, and so before a long calculation, each named path is checked against the files that the
command reads and against what stands there. The command gets the option --force.
"""

import functools
import inspect
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any, ParamSpec, TypeVar

from cyclopts import Parameter

from acquisition.recording.output import OutputKind, command_files, refuse_output

P = ParamSpec("P")
R = TypeVar("R")
FORCE = inspect.Parameter(
    "force",
    inspect.Parameter.KEYWORD_ONLY,
    default=False,
    annotation=Annotated[bool, Parameter(help="Replace an existing file of another kind; never a recording or input.")],
)


def writes(*folders: str, **kinds: OutputKind) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """`kinds`: parameter -> kind of the file that it names; `folders`: parameters that name a folder to write to.

    Every other path that a command is given is a file that it reads.
    """

    def decorated(command: Callable[P, R]) -> Callable[P, R]:
        signature = inspect.signature(command, eval_str=True)

        @functools.wraps(command)
        def guarded(*args: P.args, **kwargs: P.kwargs) -> R:
            force = bool(kwargs.pop("force", False))
            given = signature.bind(*args, **kwargs)
            given.apply_defaults()
            named = {**dict.fromkeys(folders), **kinds}
            inputs = _paths(value for name, value in given.arguments.items() if name not in named)
            with command_files(inputs, force=force):
                for name, kind in kinds.items():
                    if given.arguments[name] is not None:
                        refuse_output(given.arguments[name], kind)
                return command(*args, **kwargs)

        return with_option(guarded, command, FORCE)

    return decorated


def with_option(guarded: Callable[P, R], command: Callable[P, R], option: inspect.Parameter) -> Callable[P, R]:
    """`guarded`, which takes `option` beside what `command` takes, with that signature."""
    signature = inspect.signature(command, eval_str=True)
    *before, last = signature.parameters.values()
    ends = [option, last] if last.kind is inspect.Parameter.VAR_KEYWORD else [last, option]
    guarded.__signature__ = signature.replace(parameters=[*before, *ends])  # pyright: ignore[reportAttributeAccessIssue,reportFunctionMemberAccess]
    guarded.__annotations__ = {**command.__annotations__, option.name: option.annotation}
    return guarded


def _paths(values: Iterable[Any]) -> Iterator[Path]:
    """All paths among the values of a command's parameters; an address or a name of a model is none."""
    for value in values:
        if isinstance(value, Path):
            yield value
        elif isinstance(value, tuple | list):
            yield from _paths(value)
        elif isinstance(value, str) and value and len(value) < 4096 and "\0" not in value:
            yield Path(value)
