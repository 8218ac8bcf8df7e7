"""How Numba compiles here: functions that only others call are optimized within those, and loops stay small.

Numba optimizes every function, turns it into machine code, links it into each caller and optimizes it again there. With
functions in functions in functions that is half of all compilation, for machine code that nobody calls. And it unrolls
loops and takes several passes of each side by side: as the loops of these equations run over three, six or some dozens
of numbers, that is a quarter of the code for nothing.
"""

from __future__ import annotations

import os
from itertools import count
from typing import Any

import llvmlite.binding as llvm
from numba.core.bytecode import FunctionIdentity
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler


def _name_apart() -> None:
    """Have no function named like another of some other process, whose code may come from disk and be linked here.

    Numba tells functions of one name apart by their number in the process.
    """
    FunctionIdentity._unique_ids = count(int.from_bytes(os.urandom(7), "little"))


_name_apart()
os.register_at_fork(after_in_child=_name_apart)


class _Library(JITCodeLibrary):  # type: ignore[misc]  # Numba has no annotations
    """Code of a function, made smaller before it meets that of others; what takes time waits until then."""

    def _optimize_functions(self, module: Any) -> None:
        module.data_layout = self._codegen._data_layout
        builder = llvm.create_pass_builder(self._codegen._tm, llvm.create_pipeline_tuning_options(speed_level=1))
        passes = llvm.create_new_function_pass_manager()
        passes.add_sroa_pass()
        passes.add_simplify_cfg_pass()
        passes.add_instruction_combine_pass()
        for function in module.functions:
            if not function.is_declaration:
                passes.run(function, builder)


class _Whole(_Library):
    """Code of a function with all that it calls, optimized without copies of what loops repeat."""

    def _optimize_final_module(self) -> None:
        codegen = self._codegen
        tuning = llvm.create_pipeline_tuning_options(speed_level=3)
        tuning.loop_vectorization, tuning.slp_vectorization = True, False
        tuning.loop_interleaving = tuning.loop_unrolling = False
        builder = llvm.create_pass_builder(codegen._tm, tuning)
        passes = builder.getModulePassManager()
        passes.add_refprune_pass()
        passes.run(self._final_module, builder)


class _Linked(_Library):
    """Code of a function that only others call, with all that it calls, as it is linked into them.

    What of it becomes machine code is the place of its environment, which Numba sets whether it is asked for or not.
    """

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True
        whole = self._get_module_for_linking()  # which is kept
        names = [each.name for each in whole.global_variables if each.name.startswith("_ZN08NumbaEnv")]
        self._final_module = llvm.parse_assembly("\n".join(f'@"{name}" = common global ptr null' for name in names))
        super()._finalize_final_module()


class _Compiler(Compiler):  # type: ignore[misc]
    library: type[JITCodeLibrary]

    def define_pipelines(self) -> Any:
        """Those of Numba, for a library of this kind."""
        self.state.library = self.library(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        self.state.library.enable_object_caching()
        return super().define_pipelines()


class CompilerOfKernels(_Compiler):
    """Of functions that are called from Python, or by their address."""

    library = _Whole


class CompilerOfParts(_Compiler):
    """Of functions that only compiled ones call, by name."""

    library = _Linked
