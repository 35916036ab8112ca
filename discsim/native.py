"""A passive callback that MuJoCo calls without Python: one C function for all models, its forces in a table.

MuJoCo hands the callback the addresses of a model and its data. A row of the table says which force belongs to that
model; the force is a C function, too, and gets the numbers it needs by address. Where in MuJoCo's data they stand is
taken from the description of its structures that ships with it, and tried on live data before anything flies so. Where
that fails, `native_callback` gives None, and forces go through Python as they always can.
"""

from __future__ import annotations

import ctypes
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

import llvmlite.binding
import mujoco
import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from discsim.arrays import FloatArray, IntArray
from discsim.compiled import compiled, compiled_address

__all__ = ["FORCE_SIGNATURE", "NativeCallback", "NativeForce", "at", "call_force", "carray", "native_callback"]


#: what a force is called with: the address of its record, time s, and the addresses of qpos, qvel and qfrc_passive of
#: the data that is stepped, to the last of which it adds. It returns whether it had a finite answer
FORCE_SIGNATURE = "int32(intp, float64, intp, intp, intp)"
#: models that may have a native force at once; beyond, a block is refused and takes the Python callback
CAPACITY = 512
#: the table's head: rows in use, a foreign C callback or 0, and the offsets of time, qpos, qvel, qfrc_passive in mjData
_ROWS, _BEFORE, _TIME, _QPOS, _QVEL, _QFRC, _HEAD = range(7)
_FIELDS = ("time", "qpos", "qvel", "qfrc_passive")
_NUMBERS: dict[str, Any] = {
    "int": ctypes.c_int,
    "mjtNum": ctypes.c_double,
    "mjtBool": ctypes.c_bool,
    "mjtSize": ctypes.c_int64,
    "size_t": ctypes.c_size_t,
    "uintptr_t": ctypes.c_size_t,
    "uint64_t": ctypes.c_uint64,
}


class NativeForce(NamedTuple):
    """A force for `NativeCallback`.

    ``record`` (k,) starts with the address of the C function, of `FORCE_SIGNATURE`; what follows is that function's own
    business. ``holds`` are the arrays the record points to, which must live as long.
    """

    record: IntArray
    holds: tuple[Any, ...]

    @property
    def address(self) -> int:
        """Where the record starts."""
        return int(self.record.ctypes.data)


@intrinsic
def _pointer(context: Any, address: Any) -> Any:
    """Turn an address into what ``numba.carray`` takes."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], ir.IntType(8).as_pointer())

    return types.voidptr(types.intp), generate


@intrinsic
def _force(context: Any, function: Any, record: Any, t: Any, qpos: Any, qvel: Any, qfrc: Any) -> Any:
    """Call a function of `FORCE_SIGNATURE` at an address."""
    word = ir.IntType(64)
    kind = ir.FunctionType(ir.IntType(32), [word, ir.DoubleType(), word, word, word])

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), arguments[1:])

    return types.int32(types.intp, types.intp, types.float64, *(types.intp,) * 3), generate


@intrinsic
def _callback(context: Any, function: Any, model: Any, data: Any) -> Any:
    """Call ``void (mjModel *, mjData *)`` at an address."""
    kind = ir.FunctionType(ir.VoidType(), [ir.IntType(64)] * 2)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), arguments[1:])
        return context.get_dummy_value()

    return types.void(*(types.intp,) * 3), generate


#: the contexts are the compiler's business
at: Any = _pointer
_numba: Any = numba  # which does not tell checkers of types what it offers
carray: Any = _numba.carray
_call_force: Any = _force
_call_back: Any = _callback


@compiled
def call_force(function: int, record: int, t: float, qpos: int, qvel: int, qfrc: int) -> int:
    """Call a force from Python: half the time that ctypes takes for it."""
    return int(_call_force(function, record, t, qpos, qvel, qfrc))


def _passive(table: int, model: int, data: int) -> None:
    """Add the force of a model's row, or hand the model on: the callback, with the table's address before it."""
    word = carray(at(table), (_HEAD + 2 * CAPACITY,), np.int64)
    for row in range(_HEAD, _HEAD + 2 * word[_ROWS], 2):
        if word[row] == model:
            record = word[row + 1]
            function = carray(at(record), (1,), np.int64)[0]
            t = carray(at(data + word[_TIME]), (1,), np.float64)[0]
            qpos = carray(at(data + word[_QPOS]), (1,), np.int64)[0]
            qvel = carray(at(data + word[_QVEL]), (1,), np.int64)[0]
            qfrc = carray(at(data + word[_QFRC]), (1,), np.int64)[0]
            _call_force(function, record, t, qpos, qvel, qfrc)
            return
    if word[_BEFORE] != 0:
        _call_back(word[_BEFORE], model, data)


class _Address:
    """What the callback may be called with from Python: an address, or MuJoCo's own object."""

    @staticmethod
    def from_param(given: Any) -> ctypes.c_void_p:
        return ctypes.c_void_p(given if isinstance(given, int) else given._address)


class NativeCallback:
    """The callback and its table.

    Attributes
    ----------
    function : ctypes function
        What is put into MuJoCo's slot.
    """

    def __init__(self, offsets: Sequence[int]) -> None:
        self._table = np.zeros(_HEAD + 2 * CAPACITY, dtype=np.int64)
        self._table[_TIME : _QFRC + 1] = offsets
        self._rows: dict[int, tuple[int, NativeForce]] = {}
        #: a thread that is stepped while its block closes may still be in a force: its record lives a while longer
        self._retired: deque[NativeForce] = deque(maxlen=CAPACITY)
        inner = compiled_address(_passive, "void(intp, intp, intp)")
        self._engine = _bound(inner, self._table.ctypes.data)
        address = self._engine.get_function_address("passive")
        function: Any = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(address)
        # a thread on its way into the callback in Python finds this one where the slot changes hands meanwhile
        function.argtypes = (_Address, _Address)
        self.function: Callable[..., None] = function

    def put(self, model: int, force: NativeForce) -> bool:
        """Let a force act on the model at an address, in the place of its last one; return False where all is full.

        One store of eight bytes makes the change, so a thread that is stepping sees the one or the other.
        """
        if model in self._rows:
            row, before = self._rows[model]
            self._retired.append(before)
        elif len(self._rows) == CAPACITY:
            return False
        else:
            taken = {row for row, _ in self._rows.values()}
            row = next(k for k in range(CAPACITY) if k not in taken)
        self._rows[model] = row, force
        place = _HEAD + 2 * row
        self._table[place + 1] = force.address
        self._table[place] = model
        self._table[_ROWS] = max(self._table[_ROWS], row + 1)
        return True

    def remove(self, model: int) -> None:
        """Let no native force act on the model any more, if one did."""
        if model in self._rows:
            row, force = self._rows.pop(model)
            self._table[_HEAD + 2 * row] = 0
            self._retired.append(force)

    def hand_on(self, before: Any) -> None:
        """Give models without a row to a foreign C callback, a ctypes function, or to none."""
        self._table[_BEFORE] = 0 if before is None else ctypes.cast(before, ctypes.c_void_p).value or 0


def _bound(function: int, table: int) -> Any:
    """Return machine code of ``passive(model, data)``, which calls ``function(table, model, data)``.

    Numba would take 0.3 s for these lines in every process: an address is another each time, so nothing can be cached.
    """
    llvmlite.binding.initialize_native_target()
    llvmlite.binding.initialize_native_asmprinter()
    module = llvmlite.binding.parse_assembly(f"""
        define void @passive(i64 %model, i64 %data) {{
            %function = inttoptr i64 {function} to void (i64, i64, i64)*
            call void %function(i64 {table}, i64 %model, i64 %data)
            ret void
        }}""")
    machine = llvmlite.binding.Target.from_default_triple().create_target_machine()
    engine = llvmlite.binding.create_mcjit_compiler(module, machine)
    engine.finalize_object()
    return engine


@cache
def native_callback() -> NativeCallback | None:
    """Return the one callback of this process, tried on live data; None where MuJoCo's memory is not as described."""
    try:
        callback = NativeCallback(field_offsets())
        return callback if works(callback) else None
    except Exception:  # whatever is missing or refused on this machine, Python's callback still works
        return None


def field_offsets() -> list[int]:
    """Return the offsets of `_FIELDS` in mjData by MuJoCo's own description of it."""
    from mujoco.introspect.structs import STRUCTS

    data = _structure("mjData", STRUCTS)
    return [int(getattr(data, name).offset) for name in _FIELDS]


def _structure(name: str, described: Mapping[str, Any]) -> Any:
    """Return the ctypes structure of a described one; raises KeyError for a type that is not known."""
    fields = []
    for field in described[name].fields:
        kind, extents = field.type, getattr(field.type, "extents", ())
        if extents:
            kind = kind.inner_type
        if hasattr(kind, "inner_type"):
            item: Any = ctypes.c_void_p
        else:
            item = _NUMBERS.get(kind.name) or _structure(kind.name, described)
        for count in reversed(extents):
            item = item * count
        fields.append((field.name, item))
    return type(name, (ctypes.Structure,), {"_fields_": fields})


def works(callback: NativeCallback) -> bool:
    """Call it on two sets of data of a small model: it must find the time and the arrays that MuJoCo shows."""
    # without springs and dampers MuJoCo compiles it whatever callback is installed, see `callbacks.compile_model`
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><option><flag spring='disable' damper='disable'/></option>"
        "<worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>"
    )
    seen: list[tuple[float, int, int, int]] = []
    kind = ctypes.CFUNCTYPE(
        ctypes.c_int32, ctypes.c_int64, ctypes.c_double, ctypes.c_int64, ctypes.c_int64, ctypes.c_int64
    )

    def look(record: int, t: float, qpos: int, qvel: int, qfrc: int) -> int:
        seen.append((t, qpos, qvel, qfrc))
        return 1

    looking = kind(look)
    datas, expected = [mujoco.MjData(model), mujoco.MjData(model)], []
    for data, time in zip(datas, (0.25, -1.75), strict=True):
        data.time = time
        views: tuple[FloatArray, ...] = (data.qpos, data.qvel, data.qfrc_passive)
        expected.append((time, *(view.ctypes.data for view in views)))
    record = np.array([ctypes.cast(looking, ctypes.c_void_p).value], dtype=np.int64)
    callback.put(model._address, NativeForce(record, (looking,)))
    for data in datas:
        callback.function(model._address, data._address)
    callback.remove(model._address)
    callback.function(model._address, datas[0]._address)
    return seen == expected
