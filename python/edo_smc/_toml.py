"""Python values as TOML."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def value(it: Any) -> str:
    """Returns a value in TOML. Accepts numbers and arrays of numpy."""
    if hasattr(it, "tolist"):
        it = it.tolist()
    if isinstance(it, bool):
        return "true" if it else "false"
    if isinstance(it, (int, str)):
        return json.dumps(it, ensure_ascii=False)
    if isinstance(it, float):
        return {"inf": "inf", "-inf": "-inf", "nan": "nan"}.get(repr(it), repr(it))
    if isinstance(it, Mapping):
        inside = ", ".join(f"{_key(key)} = {value(inner)}" for key, inner in it.items() if inner is not None)
        return f"{{ {inside} }}" if inside else "{}"
    if isinstance(it, (list, tuple)):
        return f"[{', '.join(value(inner) for inner in it)}]"
    raise TypeError(f"a scenario has numbers, texts, lists and dictionaries, not {type(it).__name__}: {it!r}")


def _key(key: Any) -> str:
    return key if isinstance(key, str) and _BARE.fullmatch(key) else json.dumps(str(key))


def changes(tables: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, str | None]]:
    """Yields each key of nested dictionaries as `table.key` with its value. `None` is left out."""
    for key, inner in tables.items():
        path = f"{above}{key}"
        if inner is None:
            continue
        if isinstance(inner, Mapping) and inner and all(_BARE.fullmatch(str(it)) for it in inner):
            yield from changes(inner, f"{path}.")
        else:
            yield path, value(inner)


def settings(tables: Mapping[str, Any]) -> list[str]:
    """Returns whole tables as `KEY=VALUE` settings."""
    return [f"{key}={value(inner)}" for key, inner in tables.items() if inner is not None]
