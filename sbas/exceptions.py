"""What stopped the work, where, with which evidence, and the cure."""

from __future__ import annotations


class SbasError(Exception):
    """Something stopped the work; the text says how to go on.

    Parameters
    ----------
    what : one sentence that names what is wrong.
    where : file, line, column, epoch or argument.
    evidence : what was seen, so that the reader can judge it.
    cure : what to do next, as a command line or a line of Python where possible.
    code : code of the finding behind it, if there is one (`sbas.findings.CODES`).
    """

    def __init__(
        self, what: str, *, where: str = "", evidence: str = "", cure: str = "", code: str = ""
    ) -> None:
        super().__init__(what)
        self.code = code
        self.what = what
        self.where = where
        self.evidence = evidence
        self.cure = cure

    def __str__(self) -> str:
        parts = {"where": self.where, "evidence": self.evidence, "cure": self.cure}
        what = f"{self.code}: {self.what}" if self.code else self.what
        lines = [what, *(f"  {key}: {text}" for key, text in parts.items() if text)]
        return "\n".join(lines)

    def __reduce__(self) -> tuple[object, ...]:
        return (_rebuild, (type(self), self.what, dict(vars(self))))


def _rebuild(kind: type[SbasError], what: str, state: dict[str, str]) -> SbasError:
    error = kind(what)
    vars(error).update(state)
    return error


class InputError(SbasError, ValueError):
    """A file, a table or an argument cannot be used as it is."""


class ModelError(SbasError, ValueError):
    """A model file says something impossible; `where` is the key path."""
