"""Options that belong together as one parameter of a verb.

The command-line library takes a verb's options from its signature. A verb names a group, a
frozen dataclass whose fields are options; the signature shown to the library has the fields in
its place, so that no verb spells them out again.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
from collections.abc import Callable
from typing import Any, get_type_hints


def with_option_groups(verb: Callable[..., None]) -> Callable[..., None]:
    """The verb with every parameter that is annotated with a dataclass spread into its fields.

    A field's annotation and default become an option's; one name in two groups is an error.
    """
    hints = get_type_hints(verb, include_extras=True)
    plain = inspect.signature(verb)
    groups: dict[str, Any] = {n: h for n, h in hints.items() if dataclasses.is_dataclass(h)}
    parameters: list[inspect.Parameter] = []
    for name, parameter in plain.parameters.items():
        if name not in groups:
            parameters.append(parameter.replace(annotation=hints[name]))
            continue
        fields = get_type_hints(groups[name], include_extras=True)
        parameters += [
            inspect.Parameter(
                field.name,
                inspect.Parameter.KEYWORD_ONLY,
                default=field.default,
                annotation=fields[field.name],
            )
            for field in dataclasses.fields(groups[name])
        ]
    parameters.sort(key=lambda parameter: parameter.kind is inspect.Parameter.KEYWORD_ONLY)

    @functools.wraps(verb)
    def spread(*args: Any, **options: Any) -> None:
        for name, group in groups.items():
            fields = [field.name for field in dataclasses.fields(group)]
            options[name] = group(**{field: options.pop(field) for field in fields})
        verb(*args, **options)

    spread.__signature__ = plain.replace(parameters=parameters)  # type: ignore[attr-defined]
    spread.__annotations__ = {p.name: p.annotation for p in parameters} | {"return": None}
    del spread.__wrapped__  # else the library would look at the verb's own signature
    return spread
