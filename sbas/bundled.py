"""Where the data files that come with the package lie."""

from __future__ import annotations

from pathlib import Path

from sbas.exceptions import InputError

_PACKAGE = Path(__file__).resolve().parent


def bundled(*parts: str) -> Path:
    """Path of a bundled file or folder: below `sbas/data` in an installed wheel, else `data`.

    Parameters
    ----------
    parts : names below the data folder, such as "allocations", "npa_do229.toml".

    Raises
    ------
    InputError : nothing of that name is bundled.

    Examples
    --------
    >>> bundled("allocations").is_dir()
    True
    """
    # In a checkout the data lie beside the package; only a wheel has them inside it.
    root = next((r for r in (_PACKAGE / "data", _PACKAGE.parent / "data") if r.is_dir()), _PACKAGE)
    path = root.joinpath(*parts)
    if not path.exists():
        raise InputError(
            f"no bundled file {'/'.join(parts)!r}",
            where=str(path),
            cure="install sbas again, or give the path of your own file",
        )
    return path
