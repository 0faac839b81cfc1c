"""Laws within kernels are text only; called plainly they are functions as ever."""

from numba import float64
from numba.core.registry import cpu_target

from scm.vehicles.jit import array_kernel, law, load_compiler


@law
def twice(x):
    return 2.0 * x


@array_kernel
def four_times(x):
    return twice(twice(x))


def test_a_law_serves_a_kernel_first_and_a_plain_call_after():
    assert (four_times(1.5), twice(1.5)) == (6.0, 3.0)


def test_a_law_within_a_kernel_makes_no_machine_code_of_its_own():
    twice._text.compile("(float64,)")
    (compiled,) = twice._text.overloads.values()
    assert compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name) == 0


def test_pythons_max_makes_no_machine_code_of_its_own():
    load_compiler()
    kind = cpu_target.typing_context.resolve_value_type(max)
    signature = kind.get_call_type(cpu_target.typing_context, (float64, float64), {})
    (library,) = cpu_target.target_context.get_function(kind, signature).libs
    (function,) = library.get_defined_functions()
    assert library.get_pointer_to_function(function.name) == 0
