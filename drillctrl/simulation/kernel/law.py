"""The law of the bit, by its address: it is compiled apart, so that all laws share the rest."""

from __future__ import annotations

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from .jit import inner


@intrinsic
def _loads(typing, address, depth, pressed, sign, axial, rotary, q):
    pair = types.UniTuple(types.float64, 2)

    def call(context, builder, signature, values):
        number = ir.DoubleType()
        kind = ir.FunctionType(ir.VoidType(), [number] * 5 + [number.as_pointer()] * 2)
        function = builder.inttoptr(values[0], kind.as_pointer())
        record = context.make_array(signature.args[-1])(context, builder, values[-1])
        result = cgutils.alloca_once(builder, number, size=2)
        builder.call(function, [*values[1:6], record.data, result])
        both = [builder.load(cgutils.gep_inbounds(builder, result, i)) for i in range(2)]
        return context.make_tuple(builder, signature.return_type, both)

    return pair(types.intp, *[types.float64] * 5, q), call


@inner
def load(contact, speeds, law):
    """Weight and torque on bit.

    Parameters
    ----------
    contact : tuple
        Depth that is cut, share of the wear-flat force, sign of Φ'.
    speeds : tuple
        Z' and Φ'.
    law : tuple
        As in `Settings`.
    """
    return _loads(  # type: ignore[call-arg]  # compiled code leaves the first out
        law[0], contact[0], contact[1], contact[2], speeds[0], speeds[1], law[1]
    )
