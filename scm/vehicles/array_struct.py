"""Records of arrays that kernels pass on: inside compiled code such a record is one pointer.

numba passes a tuple of arrays by value, seven numbers or more for each array, and counts a
reference to each array wherever the tuple is touched. For 50 arrays that takes longer to compile
than what is done with them. An `ArrayStruct` is passed as the address of a table that holds, for
each array, where its data are and its shape. In a kernel, `lanes.length[lane]` reads as in Python.
"""

import functools
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, dataclass_transform

import numba.extending
import numpy as np
from llvmlite import ir
from numba.extending import models, typeof_impl

_numba: Any = numba  # untyped
_NamedTuple: Any = _numba.types.NamedTuple
_WORD = ir.IntType(64)


@dataclass_transform(frozen_default=True)
class ArrayStruct:
    """Base of records whose fields are C-contiguous arrays or such records.

    The fields cannot be replaced, but what the arrays hold can. The record keeps its arrays.
    """

    if TYPE_CHECKING:
        _fields: tuple[str, ...]
        kernel_type: Any
        address: int

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True, eq=False)(cls)
        cls._fields = tuple(field.name for field in fields(cls))  # type: ignore[arg-type]  # just made one

    def __post_init__(self) -> None:
        """Write the table of addresses and shapes."""
        table: list[int] = []
        places = {}
        values = [getattr(self, name) for name in self._fields]
        for name, value in zip(self._fields, values, strict=True):
            places[name] = len(table)
            if isinstance(value, ArrayStruct):
                table.append(value.address)
                continue
            if not value.flags.c_contiguous:
                msg = f"{type(self).__name__}.{name} must be C-contiguous"
                raise ValueError(msg)
            table += [value.ctypes.data, *value.shape]
        words = np.array(table, np.uint64)
        kind = _StructType(type(self), [_numba.typeof(value) for value in values], places)
        vars(self).update(_words=words, address=words.ctypes.data, kernel_type=kind)


class _StructType(_NamedTuple):  # type: ignore[misc]
    """Type of a record in kernels: numba reads its fields as those of a named tuple.

    `places` says where in the table each of them begins.
    """

    def __init__(self, cls: type, members: Sequence[Any], places: dict[str, int]) -> None:
        super().__init__(members, cls)
        self.places = places
        digest = hashlib.sha256(repr(members).encode()).hexdigest()[:8]
        self.name = f"{cls.__name__}_{digest}"  # short: it is part of each function's name

    @property
    def key(self) -> str:
        """What makes two types equal."""
        return self.name


@typeof_impl.register(ArrayStruct)
def _type_of(value: ArrayStruct, _: object) -> Any:
    return value.kernel_type


def _from_python(_: object, value: Any, c: Any) -> Any:
    number = c.pyapi.object_getattr_string(value, "address")
    address = c.pyapi.long_as_voidptr(number)
    c.pyapi.decref(number)
    return _numba.extending.NativeValue(address)


def _member(context: Any, builder: Any, struct: Any, value: Any, name: str) -> Any:
    """Write code that reads a member from the table."""
    kind, place = struct[struct.fields.index(name)], struct.places[name]
    table = builder.bitcast(value, _WORD.as_pointer())

    def word(at: int) -> Any:
        loaded = builder.load(builder.gep(table, [ir.Constant(_WORD, place + at)]))
        loaded.set_metadata("invariant.load", builder.module.add_metadata([]))
        return loaded

    if isinstance(kind, _StructType):
        return builder.inttoptr(word(0), value.type)
    array = context.make_array(kind)(context, builder)
    array.data = builder.inttoptr(word(0), array.data.type)
    size = context.get_abi_sizeof(context.get_data_type(kind.dtype))
    shape = [word(1 + axis) for axis in range(kind.ndim)]
    strides = [ir.Constant(_WORD, size)]
    for length in shape[:0:-1]:
        strides.insert(0, builder.mul(strides[0], length))
    array.itemsize = ir.Constant(_WORD, size)
    array.nitems = functools.reduce(builder.mul, shape)
    for axis in range(kind.ndim):
        array.shape = builder.insert_value(array.shape, shape[axis], axis)
        array.strides = builder.insert_value(array.strides, strides[axis], axis)
    array.meminfo = ir.Constant(array.meminfo.type, None)
    array.parent = ir.Constant(array.parent.type, None)
    return array._getvalue()  # noqa: SLF001 as numba's own guide does


_numba.extending.register_model(_StructType)(models.OpaqueModel)
_numba.extending.unbox(_StructType)(_from_python)
_numba.extending.lower_getattr_generic(_StructType)(_member)
