"""Entry of the command `sbas`: its verbs, and how errors reach the user."""

from __future__ import annotations

import difflib
import importlib
import io
import os
import sys
from collections.abc import Sequence
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

import sbas
from sbas.exceptions import SbasError

VERBS = {
    **dict.fromkeys(("demo", "simulate", "check"), "recordings"),
    **dict.fromkeys(("evaluate", "rate"), "evaluation"),
    "decorrelation": "processes",
    "compare": "comparing",
    **dict.fromkeys(("kfactor", "plan"), "planning"),
    **dict.fromkeys(("protect", "raim"), "ranges"),
    **dict.fromkeys(("states", "depend"), "localisation"),
    "multisensor": "sensor_fusion",
}
"""Verbs by the module that has them: a verb loads what it needs, not what all need."""


class _Verbs(TyperGroup):
    """The verbs, each loaded when it is asked for."""

    def list_commands(self, ctx: Any) -> list[str]:
        return list(VERBS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if cmd_name not in VERBS:
            return None
        module = importlib.import_module(f"sbas.cli.{VERBS[cmd_name]}")
        verbs = typer.Typer()
        module.register(verbs)
        return typer.main.get_group(verbs).commands[cmd_name]

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        near = difflib.get_close_matches(args[0], VERBS, n=1) if args else []
        if near and args[0] not in VERBS:
            ctx.fail(f"No such command {args[0]!r}. Did you mean {near[0]!r}?")
        return super().resolve_command(ctx, args)


app = typer.Typer(
    cls=_Verbs,
    name="sbas",
    help="SBAS/EGNOS protection levels and integrity risk for railway signalling: from a "
    "receiver recording to a failure rate that a safety case can carry.",
    epilog="Exit codes: 0 done, and any claim asked about is met; 1 done, claim not "
    "demonstrated; 2 bad input. Begin with:  sbas demo",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"sbas {sbas.__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


def _stop(text: str, code: int) -> NoReturn:
    print(text, file=sys.stderr)
    sys.exit(code)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; every way out is an exit code with a readable message."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # File names are bytes: one that is no text of the terminal must not end in a crash.
            stream.reconfigure(errors="backslashreplace")
    try:
        app(None if arguments is None else list(arguments), prog_name="sbas")
    except SbasError as error:
        _stop(f"sbas: {error}", 2)
    except BrokenPipeError:
        # The reader of our output went away, as `| head` does: nothing is wrong.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
    except OSError as error:
        _stop(f"sbas: {error.strerror or error}\n  where: {error.filename or 'system'}", 2)
    except MemoryError:
        _stop("sbas: not enough memory\n  cure: write the recording as Parquet, which streams", 2)
    except Exception as error:
        # A defect of sbas itself; the user still gets a sentence instead of a traceback.
        place = _innermost(error)
        _stop(
            f"sbas: internal error, please report it: {type(error).__name__}: {error}\n"
            f"  where: {place}\n  cure: no figure was printed; the input may be unusual",
            2,
        )


def _innermost(error: BaseException) -> str:
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    if trace is None:
        return "unknown"
    code = trace.tb_frame.f_code
    return f"{os.path.basename(code.co_filename)}:{trace.tb_lineno} in {code.co_name}"
