"""Entry of the command `sbas`: its verbs, and how errors reach the user."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Sequence
from typing import Annotated, NoReturn

import typer

import sbas
from sbas.cli import comparing, evaluation, localisation, planning, processes, recordings
from sbas.exceptions import SbasError

app = typer.Typer(
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
for module in (recordings, evaluation, processes, comparing, planning, localisation):
    module.register(app)


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
