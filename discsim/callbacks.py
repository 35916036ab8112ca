"""MuJoCo's callbacks of the whole process, shared by all flights and rigs that run in it.

MuJoCo has one slot for a passive force and one for its warnings, whatever the number of models and threads. A block
that stored what it found and put it back would rob the others: of two flights in two threads the first to end would
take the air away from the second. So one function of ours sits in a slot while any block is open, looks up which force
belongs to the model that is stepped, and hands every other model on to what was in the slot before the first block.
While all forces are compiled, and what was found is, that function is the C function of `discsim.native`; else it is
one in Python.
"""

from __future__ import annotations

from _ctypes import CFuncPtr
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import RLock, get_ident
from typing import Any, NamedTuple

import mujoco

from discsim.errors import InputError
from discsim.native import NativeCallback, NativeForce, native_callback

__all__ = ["PassiveForce", "check_lent", "compile_model", "own_warnings", "passive_force", "stepped_by_c"]

PassiveForce = Callable[[Any, Any], None]


class _Slot:
    """A slot of the process, lent to one of ours while at least one block is open.

    ``choose`` says which of ours is needed, given what was in the slot before the first block.
    """

    def __init__(
        self,
        name: str,
        get: Callable[[], Any],
        put: Callable[[Any], None],
        choose: Callable[[Any], Callable[..., None]],
    ) -> None:
        self._name, self._get, self._put, self._choose = name, get, put, choose
        self._open = 0
        #: the one of ours that is in it
        self.ours: Any = None
        self._known: list[Any] = []
        #: held while anything about the slot changes
        self.lock = RLock()
        #: what was in the slot before the first block
        self.before: Any = None

    @property
    def lent(self) -> bool:
        with self.lock:
            return self._get() is self.ours

    @property
    def taken(self) -> RuntimeError:
        return RuntimeError(
            f"another callback was put into MuJoCo's one slot for {self._name} while a flight or a rig needed it; "
            "install your own before the first block (a model of your own still reaches it)"
        )

    def borrow(self) -> None:
        """Open a block; raises RuntimeError where another has taken the slot. `settle` puts ours in."""
        with self.lock:
            if self._open and not self.lent:
                raise self.taken
            if not self._open:
                found = self._get()
                self.before = None if any(found is each for each in self._known) else found
                self.ours = None
            self._open += 1

    def settle(self) -> None:
        """Put in the one of ours that the open blocks need now."""
        with self.lock:
            ours = self._choose(self.before)
            if ours is not self.ours:
                if not any(ours is each for each in self._known):
                    self._known.append(ours)
                self.ours = ours
                self._put(ours)

    def give_back(self) -> bool:
        """Restore what was found if this is the last block; return False where ours was no longer in the slot."""
        with self.lock:
            lent = self.lent
            self._open -= 1
            if not self._open:
                if lent:
                    self._put(self.before)
                self.before = None
            elif lent:
                self.settle()
            return lent


class _Force(NamedTuple):
    """A force of a block: as Python calls it, and as C does where it can."""

    apply: PassiveForce
    native: NativeForce | None


#: the forces of the blocks that are open, by identity of their model; the last one acts. The tuples are replaced, never
#: changed: another thread may be reading them.
_FORCES: dict[int, tuple[_Force, ...]] = {}
#: those models among them whose force C cannot call
_BY_PYTHON: set[int] = set()
#: the threads whose warnings are kept off the console, as often as they asked
_SILENT: list[int] = []


def _dispatch(model: Any, data: Any) -> None:
    """Be MuJoCo's passive callback: the force of this model, or what was installed before."""
    if (forces := _FORCES.get(id(model))) is not None:
        forces[-1][0](model, data)
    elif (before := _PASSIVE.before) is not None:
        if isinstance(before, CFuncPtr):
            before(model._address, data._address)
        else:
            before(model, data)


def _dispatcher(before: Any) -> Callable[..., None]:
    """Return the callback that serves all open blocks, and what was found before them."""
    if _FORCES and not _BY_PYTHON and (before is None or isinstance(before, CFuncPtr)):
        callback = native_callback()
        assert callback is not None
        callback.hand_on(before)
        return callback.function
    return _dispatch


def _found() -> NativeCallback | None:
    """Return the callback in C where one has been looked for already."""
    return native_callback() if native_callback.cache_info().currsize else None


def _act(model: Any) -> None:
    """Let the force of the last block of a model act on it, if there is one: by C where that is possible."""
    forces = _FORCES.get(id(model))
    wanted = None if forces is None else forces[-1].native
    callback = _found() if wanted is None else native_callback()
    by_c = wanted is not None and callback is not None and callback.put(model._address, wanted)
    if callback is not None and not by_c:
        callback.remove(model._address)
    if forces is None or by_c:
        _BY_PYTHON.discard(id(model))
    else:
        _BY_PYTHON.add(id(model))


def _warn(message: str) -> None:
    """Be MuJoCo's handler of warnings: swallow those of a silent thread, hand on the others."""
    if get_ident() not in _SILENT and _WARNINGS.before is not None:
        _WARNINGS.before(message)


_PASSIVE = _Slot("passive forces", mujoco.get_mjcb_passive, mujoco.set_mjcb_passive, _dispatcher)
_WARNINGS = _Slot("warnings", mujoco.get_mju_user_warning, mujoco.set_mju_user_warning, lambda before: _warn)


@contextmanager
def passive_force(model: Any, apply: PassiveForce, native: NativeForce | None = None) -> Iterator[None]:
    """Let ``apply(model, data)`` add to ``data.qfrc_passive`` whenever ``model`` is stepped inside the block.

    ``native`` is the same force for C, which is called in its place while no other block needs Python.

    Blocks may nest, and may be open in several threads at once; of several blocks for one model the one opened last
    acts. A model without a block gets the callback that was installed before the first block, which is back in the slot
    after the last. Raises RuntimeError where something else takes the slot meanwhile, and where a model is compiled
    inside the block without `compile_model`.
    """
    force = _Force(apply, native)
    with _PASSIVE.lock:
        _PASSIVE.borrow()
        _FORCES[id(model)] = (*_FORCES.get(id(model), ()), force)
        _act(model)
        _PASSIVE.settle()
    failed = True
    try:
        yield
        failed = False
    except ValueError as error:
        if "Python exception raised" in str(error):
            raise RuntimeError(
                "a MuJoCo model was compiled while a passive-force callback was installed, which MuJoCo cannot do; "
                "compile every model before entering the block, or by discsim.callbacks.compile_model"
            ) from error
        raise
    finally:
        with _PASSIVE.lock:
            forces = _FORCES.pop(id(model))
            last = max(k for k, each in enumerate(forces) if each is force)
            if len(forces) > 1:
                _FORCES[id(model)] = forces[:last] + forces[last + 1 :]
            _act(model)
            lent = _PASSIVE.give_back()
            if not _FORCES and (callback := _found()) is not None:
                callback.hand_on(None)
        if not lent and not failed:
            raise _PASSIVE.taken


def check_lent() -> None:
    """Raise RuntimeError where ours is no longer in the slot for passive forces, inside a block of `passive_force`."""
    # without the lock, for this is asked at every step; with it only where another thread may be changing the slot
    if mujoco.get_mjcb_passive() is not _PASSIVE.ours and not _PASSIVE.lent:
        raise _PASSIVE.taken


@contextmanager
def stepped_by_c() -> Iterator[bool]:
    """Yield whether every force is called by C, which stays so inside: no other thread opens or closes a block."""
    with _PASSIVE.lock:
        callback = native_callback()
        yield callback is not None and _PASSIVE.lent and _PASSIVE.ours is callback.function


@contextmanager
def own_warnings() -> Iterator[None]:
    """Keep this thread's MuJoCo warnings off the console and out of a log file in the working folder."""
    _WARNINGS.borrow()
    _WARNINGS.settle()
    _SILENT.append(get_ident())
    try:
        yield
    finally:
        _SILENT.remove(get_ident())
        _WARNINGS.give_back()


def compile_model(spec: Any) -> Any:
    """Return the mujoco.MjModel of a mujoco.MjSpec, whatever callback is installed meanwhile and in whatever thread.

    MuJoCo's compiler steps the half-built model, which it cannot hand to a Python callback: it would only say "Python
    exception raised". A model without springs and dampers never calls it, so both are switched off until it is built.
    Raises `InputError` where no body has the masses or inertias that were given.
    """
    flags = spec.option.disableflags
    spec.option.disableflags = flags | int(mujoco.mjtDisableBit.mjDSBL_SPRING | mujoco.mjtDisableBit.mjDSBL_DAMPER)
    try:
        model = spec.compile()
    except ValueError as error:
        reason = str(error).splitlines()[0].removeprefix("Error: ")
        raise InputError(f"no rigid body has these inertias or masses: {reason}; expected those of a body") from None
    finally:
        spec.option.disableflags = flags
    model.opt.disableflags = flags
    return model
