"""Good files: a receiver on a roof and a train's journey, written in every form."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace

from sbas.recording import Recording
from sbas.truth import Truth
from tests.corruption.binary_forms import BINARY_FORMS
from tests.corruption.forms import Form, Pieces
from tests.corruption.table_forms import TABLE_FORMS
from tests.corruption.text_forms import TEXT_FORMS
from tests.input_check.journeys import POINT, journey, standing

FORMS: tuple[Form, ...] = (*BINARY_FORMS, *TEXT_FORMS, *TABLE_FORMS)
EPOCHS = 1200


@dataclass(frozen=True, eq=False)
class GoodLog:
    """A recording, the form it is written in, and where the antenna was."""

    form: Form
    recording: Recording
    truth: Truth
    moving: bool

    @property
    def name(self) -> str:
        return f"{self.form.name}, {'moving' if self.moving else 'standing'}"

    @functools.cached_property
    def pieces(self) -> Pieces:
        return self.form.write(self.recording)

    def rewritten(self, recording: Recording) -> bytes:
        """The file of a recording that was changed before it was written."""
        return self.form.write(recording).data

    def with_recording(self, recording: Recording, truth: Truth | None = None) -> GoodLog:
        return replace(self, recording=recording, truth=truth or self.truth)


@functools.cache
def good_log(form_name: str, moving: bool) -> GoodLog:
    """The good file of a form."""
    form = next(form for form in FORMS if form.name == form_name)
    if moving:
        recording, truth = journey(EPOCHS)
        return GoodLog(form, recording, truth, moving)
    return GoodLog(form, standing(EPOCHS), POINT, moving)


def good_logs() -> tuple[GoodLog, ...]:
    """All of them."""
    return tuple(good_log(form.name, moving) for form in FORMS for moving in (False, True))
