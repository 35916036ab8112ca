"""MuJoCo's callbacks of the whole process, shared by all flights and rigs that run in it.

MuJoCo has one slot for a passive force and one for its warnings, whatever the number of models and threads. A block
that stored what it found and put it back would rob the others: of two flights in two threads the first to end would
take the air away from the second. So one function of ours sits in a slot while any block is open, looks up which force
belongs to the model that is stepped, and hands every other model on to what was in the slot before the first block.
"""

from __future__ import annotations

from _ctypes import CFuncPtr
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Lock, get_ident
from typing import Any

import mujoco

from discsim.errors import InputError

__all__ = ["PassiveForce", "check_lent", "compile_model", "own_warnings", "passive_force"]

PassiveForce = Callable[[Any, Any], None]


class _Slot:
    """A slot of the process, lent to ``ours`` while at least one block is open."""

    def __init__(self, name: str, get: Callable[[], Any], put: Callable[[Any], None], ours: Callable[..., None]):
        self._name, self._get, self._put, self._ours = name, get, put, ours
        self._lock, self._open = Lock(), 0
        #: what was in the slot before the first block
        self.before: Any = None

    @property
    def lent(self) -> bool:
        return self._get() is self._ours

    @property
    def taken(self) -> RuntimeError:
        return RuntimeError(
            f"another callback was put into MuJoCo's one slot for {self._name} while a flight or a rig needed it; "
            "install your own before the first block (a model of your own still reaches it)"
        )

    def borrow(self) -> None:
        with self._lock:
            if self._open and not self.lent:
                raise self.taken
            if not self._open:
                found = self._get()
                self.before = None if found is self._ours else found
                self._put(self._ours)
            self._open += 1

    def give_back(self) -> bool:
        """Restore what was found if this is the last block; return False where ours was no longer in the slot."""
        with self._lock:
            lent = self.lent
            self._open -= 1
            if not self._open:
                if lent:
                    self._put(self.before)
                self.before = None
            return lent


#: the forces of the blocks that are open, by identity of their model; the last one acts. The tuples are replaced, never
#: changed: another thread may be reading them.
_FORCES: dict[int, tuple[PassiveForce, ...]] = {}
_FORCES_CHANGE = Lock()
#: the threads whose warnings are kept off the console, as often as they asked
_SILENT: list[int] = []


def _dispatch(model: Any, data: Any) -> None:
    """Be MuJoCo's passive callback: the force of this model, or what was installed before."""
    if (forces := _FORCES.get(id(model))) is not None:
        forces[-1](model, data)
    elif (before := _PASSIVE.before) is not None:
        if isinstance(before, CFuncPtr):
            before(model._address, data._address)
        else:
            before(model, data)


def _warn(message: str) -> None:
    """Be MuJoCo's handler of warnings: swallow those of a silent thread, hand on the others."""
    if get_ident() not in _SILENT and _WARNINGS.before is not None:
        _WARNINGS.before(message)


_PASSIVE = _Slot("passive forces", mujoco.get_mjcb_passive, mujoco.set_mjcb_passive, _dispatch)
_WARNINGS = _Slot("warnings", mujoco.get_mju_user_warning, mujoco.set_mju_user_warning, _warn)


@contextmanager
def passive_force(model: Any, apply: PassiveForce) -> Iterator[None]:
    """Let ``apply(model, data)`` add to ``data.qfrc_passive`` whenever ``model`` is stepped inside the block.

    Blocks may nest, and may be open in several threads at once; of several blocks for one model the one opened last
    acts. A model without a block gets the callback that was installed before the first block, which is back in the slot
    after the last. Raises RuntimeError where something else takes the slot meanwhile, and where a model is compiled
    inside the block without `compile_model`.
    """
    _PASSIVE.borrow()
    with _FORCES_CHANGE:
        _FORCES[id(model)] = (*_FORCES.get(id(model), ()), apply)
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
        with _FORCES_CHANGE:
            forces = _FORCES.pop(id(model))
            last = len(forces) - 1 - forces[::-1].index(apply)
            if len(forces) > 1:
                _FORCES[id(model)] = forces[:last] + forces[last + 1 :]
        if not _PASSIVE.give_back() and not failed:
            raise _PASSIVE.taken


def check_lent() -> None:
    """Raise RuntimeError where ours is no longer in the slot for passive forces, inside a block of `passive_force`."""
    if not _PASSIVE.lent:
        raise _PASSIVE.taken


@contextmanager
def own_warnings() -> Iterator[None]:
    """Keep this thread's MuJoCo warnings off the console and out of a log file in the working folder."""
    _WARNINGS.borrow()
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
