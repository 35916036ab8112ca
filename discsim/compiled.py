"""One way to compile: numba in nopython mode, cached per state of the sources.

Numba's own on-disk cache looks only at the file in which a function stands, so an edit to an
effect would leave the compiled engines that call it stale. Here the cache folder's name holds a
digest of the sources (of estimators/ and validation/, which the engines are not built on, only those that
compile), so any edit that matters starts a fresh one, and a read-only installation works too. In it code lies
by the name of its module, so that it serves the same sources wherever they are installed.
"""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numba.core.caching
import numba.core.config

__all__ = [
    "compiled",
    "compiled_address",
    "compiled_before",
    "compiled_nogil",
    "compiled_nogil_sums",
    "compiled_sums",
    "inlined",
]

F = TypeVar("F", bound=Callable[..., Any])

#: numba's own choice of a folder; an older numba asks for no other one
_Locator: Any = getattr(numba.core.caching, "UserProvidedCacheLocator", object)


def _load_without_blas() -> None:
    """Load numba's functions of arrays without scipy's linear algebra, which is a sixth of a flight's start.

    While they load, numba sees whether there is a BLAS by loading one. There is: scipy comes with this package. What
    calls it loads it when it is compiled, or, from the cache, when it runs.
    """
    if "numba.np.arraymath" in sys.modules:
        return
    try:
        linalg: Any = import_module("numba.np.linalg")
        ensure, linalg.ensure_blas = linalg.ensure_blas, lambda: None
    except (ImportError, AttributeError):  # another numba, which may do as it likes
        return
    try:
        arrays: Any = import_module("numba.np.arraymath")
        arrays.ensure_blas = ensure
    finally:
        linalg.ensure_blas = ensure


_load_without_blas()


class KeptByModule(_Locator):  # type: ignore[misc]
    """Where numba keeps what it compiles of a function: by its module's name for ours, by its file's place for others.

    Numba asks it for the function's folder; what it is to be compiled of it knows by the digest of its file.
    """

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        super().__init__(function, file)
        module = function.__module__
        ours = module.partition(".")[0] == __name__.partition(".")[0]
        self._folder = str(_cache_folder() / module) if ours else super().get_cache_path()

    def get_cache_path(self) -> str:
        """Return the folder."""
        return self._folder


@cache
def _cache_folder() -> Path:
    here = Path(__file__).resolve().parent
    digest = hashlib.sha256(numba.__version__.encode())
    inner = [here / "estimators", here / "validation"]  # in a checkout links, which rglob does not follow
    own = [source for source in here.rglob("*.py") if not set(inner) & set(source.parents)]
    for source in sorted(own) + [source for package in inner for source in sorted(package.rglob("*.py"))]:
        text = source.read_bytes()
        if not set(inner) & set(source.parents) or b"compiled" in text:
            digest.update(text)
    try:
        base = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    except RuntimeError:  # a user without a home: nowhere to keep anything
        base = os.devnull
    return Path(base) / "discsim" / digest.hexdigest()[:16]


def compiled_before() -> bool:
    """Return whether anything has been compiled on this installation: if not, the first call takes its time."""
    folder = _cache_folder()
    return folder.is_dir() and any(folder.iterdir())


def compiled(function: F) -> F:
    """Compile ``function`` on first call (nopython, division by zero gives inf or nan, no fast-math)."""
    return _compile(function)


def compiled_nogil(function: F) -> F:
    """Compile like `compiled`, and let other threads run meanwhile: for loops that last."""
    return _compile(function, nogil=True)


def compiled_sums(function: F) -> F:
    """Compile like `compiled`, free to add in another order: sums over readings then go four at a time.

    Values change by rounding alone; NaN and infinity keep their meaning.
    """
    return _compile(function, reorder=True)


def compiled_nogil_sums(function: F) -> F:
    """Compile like `compiled_sums`, and let other threads run meanwhile."""
    return _compile(function, nogil=True, reorder=True)


def inlined(function: F) -> F:
    """Compile like `compiled`, into every caller: where passing the arguments costs as much as the work.

    Such a function makes no arrays, so that it need not count who holds those that it is given: counting the ten arrays
    of `Tables` took four fifths of an evaluation of the air.
    """
    return _compile(function, forceinline=True)


#: C functions stay in memory for as long as the process lives: nobody knows who still holds their address
_C_FUNCTIONS: list[Any] = []


@contextmanager
def _kept() -> Iterator[None]:
    """Have numba keep in our folder what it is told to compile inside the block, and leave numba as it was."""
    config: Any = numba.core.config
    ours = {"CACHE_DIR": str(_cache_folder())}
    if hasattr(config, "CACHE_LOCATOR_CLASSES") and _Locator is not object:
        # where that folder cannot be written to, numba's others
        ours["CACHE_LOCATOR_CLASSES"] = f"{__name__}.{KeptByModule.__name__},InTreeCacheLocator,UserWideCacheLocator"
    before = {name: getattr(config, name) for name in ours}
    try:
        for name, value in ours.items():
            setattr(config, name, value)
        yield
    finally:
        for name, value in before.items():
            setattr(config, name, value)


def compiled_address(function: Callable[..., Any], signature: str) -> int:
    """Return the address of ``function``, compiled at once as a C function of a signature such as "void(intp)"."""
    with _kept():
        try:
            _C_FUNCTIONS.append(numba.cfunc(signature, cache=True, error_model="numpy")(function))
        except RuntimeError:  # nowhere to write a cache
            _C_FUNCTIONS.append(numba.cfunc(signature, error_model="numpy")(function))
    return int(_C_FUNCTIONS[-1].address)


def _compile(function: F, nogil: bool = False, forceinline: bool = False, reorder: bool = False) -> F:
    how: dict[str, Any] = {"error_model": "numpy", "nogil": nogil, "forceinline": forceinline, "_nrt": not forceinline}
    how["fastmath"] = {"reassoc", "nsz", "contract"} if reorder else False
    with _kept():
        try:
            return cast(F, numba.njit(cache=True, **how)(function))
        except RuntimeError:  # nowhere to write a cache: compile anew in each process
            return cast(F, numba.njit(**how)(function))
