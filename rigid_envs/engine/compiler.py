"""Decorators by which functions are compiled, and compiled code on disk."""

import functools
import gc
import hashlib
import logging
import os
import re
import stat
import sys
import sysconfig
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import CodeType
from typing import Any, TypeVar, cast

import llvmlite
import numba
from numba import core

from rigid_envs.base.files import DamagedFileError, write_atomic

# Disk cache of compiled code, and its keys.
#
# Numba's own cache checks only the file of the compiled function: after an edit to a helper in
# another file it would load stale code (numba issue 1833), and it does not distinguish two closures
# of one factory. Here code lies in a folder named by a hash of every source file of this package
# that can be compiled into it. The key of a kernel consists of the names of its functions, with a
# hash of all files of any other package from which one comes; and of the versions and the processor
# that the code was made for. A checksum of the key and the code is compared before anything is
# loaded. Hashes are of bytecode: comments and docstrings are no part of it, nor line numbers.

_cpu = core.registry.cpu_target
_PACKAGE = Path(__file__).resolve().parent.parent
_COMPILED = (
    *("engine/*.py", "tasks/parts.py", "tasks/reduction.py"),
    *("systems/*/tasks/*.py", "systems/*/dynamics.py", "systems/*/friction.py"),
    *("systems/*/saddle.py", "systems/*/elastica.py", "systems/*/nearby.py"),
    *("systems/*/meeting.py", "systems/*/covering.py", "systems/*/strips.py"),
    "watch/panda.py",
)
_CHECKSUM = hashlib.sha256().digest_size
_log = logging.getLogger(__name__)
_said: set[tuple[str, Path]] = set()


class KernelCache(core.caching.NullCache):  # type: ignore[misc]
    """Files of one kernel, ``<name>-<hash of the key>.nbc``, in the private folder.

    Each holds the code for one key, see `_key`: a checksum of both, then the code.

    Args:
        folder: `cache_directory()`.
        name: Unique name of the kernel: see `cache_name`.
    """

    def __init__(self, folder: Path, name: str) -> None:
        """Set the known folder and name, without a search."""
        self._folder, self._name = folder, name

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled code from its file; None where there is none, or it is another's."""
        core.runtime.rtsys.initialize(target_context)  # what the code may call
        key = _key(self._name, sig, target_context.codegen())
        try:
            parts = core.serialize.loads(_read(self._file(key), key))
            return core.compiler.CompileResult._rebuild(target_context, *parts)
        except FileNotFoundError:
            return None
        except Exception as error:  # or a class of a third package that is not there any more
            _say_once("read", self._folder, error)
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep compiled code in a file; where that fails the process goes on without."""
        key = _key(self._name, sig, data.codegen)
        try:
            if data.library.has_dynamic_globals:
                raise OSError("it holds addresses of this process")
            code = core.serialize.dumps(data._reduce())
            write_atomic(self._file(key), _checksum(key, code) + code)
        except OSError as error:  # a full disk, a limit of size, a folder that is gone
            _say_once("kept", self._folder, error)

    def _file(self, key: bytes) -> Path:
        return self._folder / f"{self._name}-{hashlib.sha256(key).hexdigest()[:16]}.nbc"


def _key(name: str, sig: Any, codegen: Any) -> bytes:
    """What the code of a kernel depends on: its name, types of arguments, versions, processor."""
    python = sysconfig.get_config_var("EXT_SUFFIX")  # tag and ABI
    versions = (python, numba.__version__, llvmlite.__version__)
    options = (numba.config.OPT, numba.config.BOUNDSCHECK)
    return repr((name, sig, versions, codegen.magic_tuple(), options)).encode()


def _checksum(key: bytes, code: bytes) -> bytes:
    return hashlib.sha256(hashlib.sha256(key).digest() + code).digest()


def _read(path: Path, key: bytes) -> bytes:
    """The code in a file.

    Raises:
        DamagedFileError: It is not the code that was written for this key.
        FileNotFoundError: No file.
    """
    data = path.read_bytes()
    if data[:_CHECKSUM] != _checksum(key, data[_CHECKSUM:]):
        raise DamagedFileError(f"{path.name} is not as it was written")
    return data[_CHECKSUM:]


def _say_once(deed: str, folder: Path, error: Exception) -> None:
    """Log that files of a folder cannot be used, once in a process."""
    if (deed, folder) not in _said:
        _said.add((deed, folder))
        _log.warning(
            "compiled code cannot be %s in %s (%s): this process compiles it; where that goes on, "
            "make room, or set NUMBA_CACHE_DIR",
            *(deed, folder, error),
        )


def cache_name(label: str, parts: Iterable[Any]) -> str | None:
    """File name of a kernel, from its functions and types; None if one has no source file.

    Args:
        label: First part of the name.
        parts: Functions, classes and tuples of numbers compiled into the kernel.
    """
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, tuple):
            digest.update(repr(part).encode())
            continue
        stamp = _source_hash(part.__module__)
        if stamp is None or "<" in part.__qualname__:  # typed at a prompt, or a closure
            return None
        digest.update(f"{part.__module__}.{part.__qualname__} {stamp}\0".encode())
    return f"{label}-{digest.hexdigest()[:16]}"


def compiled_sources() -> list[Path]:
    """Files of this package with functions that are compiled."""
    return sorted(file for each in _COMPILED for file in _PACKAGE.glob(each))


@functools.cache
def kernel_hash() -> str:
    """Hash of the sources of all compiled code in the package, as 16 hex digits."""
    return _hash_of(_PACKAGE, compiled_sources())


@functools.cache
def _source_hash(module: str) -> str | None:
    """Hash of the package of a module, or of its file if it has no package."""
    top: Any = sys.modules.get(module.partition(".")[0])
    if top is sys.modules[__package__.partition(".")[0]]:
        return ""  # the folder is named by it
    if hasattr(top, "__path__"):
        folders = map(Path, top.__path__)
        return "".join(_hash_of(folder, sorted(folder.rglob("*.py"))) for folder in folders)
    if getattr(top, "__file__", None):
        path = Path(top.__file__)
        return _hash_of(path.parent, [path])
    return None


def _hash_of(base: Path, paths: Iterable[Path]) -> str:
    """Hash of the bytecode of source files, as 16 hex digits.

    It takes a tenth of a second, and is noted in the name of an empty file for these very bytes.
    """
    sources = {path.relative_to(base).as_posix(): path.read_bytes() for path in paths}
    notes = _private_folder("sources")
    known = _digest((sys.version, sources))
    for note in notes.glob(f"{known}-*") if notes else ():
        return note.name.partition("-")[2]
    with _no_collection():
        found = _digest({name: _executed(source) for name, source in sources.items()})
    if notes:
        with suppress(OSError):  # a full disk, a folder that is gone
            (notes / f"{known}-{found}").touch()
    return found


def _digest(value: Any) -> str:
    return hashlib.sha256(repr(value).encode()).hexdigest()[:16]


def _executed(source: bytes) -> Any:
    """What of a source is executed: its bytecode without docstrings; all where it has none."""
    if re.search(rb"^\s*assert\b", source, re.MULTILINE):  # these would go with the docstrings
        return source
    try:
        return _values(compile(source, "", "exec", dont_inherit=True, optimize=2))
    except (SyntaxError, ValueError):  # a template, say, that nobody imports
        return source


def _values(constant: Any) -> Any:
    """A constant of bytecode by its values, those of a function or class without line numbers."""
    if isinstance(constant, frozenset):
        return sorted(map(repr, constant))
    if not isinstance(constant, CodeType):
        return constant
    counts = constant.co_argcount, constant.co_posonlyargcount, constant.co_kwonlyargcount
    names = constant.co_names, constant.co_varnames, constant.co_freevars, constant.co_cellvars
    instructions = constant.co_code, constant.co_exceptiontable, constant.co_flags
    return constant.co_name, counts, names, instructions, *map(_values, constant.co_consts)


@functools.cache
def cache_directory() -> Path | None:
    """Private folder for compiled code of exactly these sources; None if it cannot be made.

    It lies below ``NUMBA_CACHE_DIR``, else below ``XDG_CACHE_HOME``, else below ``~/.cache``.
    """
    folder = _private_folder(kernel_hash())
    if folder is None:
        _log.warning(
            "compiled code is not kept: no folder below %s that only this user can change; every "
            "process compiles it: set NUMBA_CACHE_DIR to one",
            _base(),
        )
    return folder


def _base() -> str:
    return os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or "~/.cache"


def _private_folder(name: str) -> Path | None:
    """A folder for what this user's processes believe; None if it cannot be made.

    What lies in it is run. A folder with another owner or writable by others is never read, nor one
    below a folder in which others could put their own in its place: see `_is_safe`.
    """
    try:
        folder = Path(_base()).expanduser().absolute() / "rigid-envs" / name
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
        usable = os.access(folder, os.W_OK) and _is_private(folder) and _is_safe(folder.resolve())
    except (OSError, RuntimeError):  # RuntimeError: no home directory to expand
        usable = False
    return folder if usable else None


def _is_private(folder: Path) -> bool:
    """Whether the folder belongs to the user, and no other may write to it."""
    if not hasattr(os, "getuid"):
        return True
    status = folder.stat()
    return status.st_uid == os.getuid() and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _is_safe(folder: Path) -> bool:
    """Whether no other user can rename the folder or one above it.

    Each of these belongs to the user or to the system, and is closed to all others, or open as
    ``/tmp`` is, where nobody renames what belongs to another. The user's own group is trusted: many
    systems give each user one.
    """
    if not hasattr(os, "getuid"):
        return True
    for above in folder.parents:
        status = above.stat()
        group = 0 if status.st_gid == os.getgid() else stat.S_IWGRP
        is_open = status.st_mode & (group | stat.S_IWOTH) and not status.st_mode & stat.S_ISVTX
        if is_open or status.st_uid not in (0, os.getuid()):
            return False
    return True


# Compilation of the functions that kernels consist of.
#
# Numba makes machine code, and entries for calls from Python and C, of every function that a kernel
# calls. That takes as long as the kernel itself, and nobody calls them: the kernel contains copies.
# Here a function is translated to the code of LLVM only, and optimised where it has been copied to:
# once, where numba does so twice for the sake of code that counts references.

Function = TypeVar("Function", bound=Callable[..., Any])

_NEEDLESS = {  # of numba's passes: for what no function here has, and for reports
    *("WithLifting", "FindLiterallyCalls", "LiteralUnroll", "LiteralPropagationSubPipelinePass"),
    *("InlineOverloads", "NopythonRewrites", "DumpParforDiagnostics"),
    "NoPythonSupportedFeatureValidation",
}


class _Part(core.codegen.JITCodeLibrary):  # type: ignore[misc]
    """LLVM code of a function, to be linked into kernels."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


class _Kernel(core.codegen.JITCodeLibrary):  # type: ignore[misc]
    """Machine code of a kernel."""

    _optimize_functions = _Part._optimize_functions

    def _optimize_final_module(self) -> None:
        made = self._codegen._module_pass_manager()
        manager, *builder = made if isinstance(made, tuple) else (made,)  # none in old versions
        manager.run(self._final_module, *builder)


class _Place:
    """Stands for the address of a function that has none."""


@core.compiler_machinery.register_pass(mutates_CFG=True, analysis_only=False)
class _PartLowering(core.typed_passes.NativeLowering):  # type: ignore[misc]
    """Translates a typed function to a `_Part`."""

    _name = "rigid_envs_part_lowering"

    def run_pass(self, state: Any) -> bool:
        state.library = _Part(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        super().run_pass(state)
        place = _Place()
        state.targetctx.insert_user_function(place, state.cr.fndesc, [state.library])
        state.cr = state.cr._replace(cfunc=place)
        return True


@core.compiler_machinery.register_pass(mutates_CFG=True, analysis_only=False)
class _KernelLowering(core.typed_passes.NativeLowering):  # type: ignore[misc]
    """Translates a typed function to a `_Kernel`."""

    _name = "rigid_envs_kernel_lowering"

    def run_pass(self, state: Any) -> bool:
        state.library = _Kernel(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return bool(super().run_pass(state))


class _PartCompiler(core.compiler.CompilerBase):  # type: ignore[misc]
    """Numba's compiler with another last pass, and without those that nothing here needs."""

    lowering: type[Any] = _PartLowering

    def define_pipelines(self) -> list[Any]:
        usual = core.compiler.DefaultPassBuilder.define_nopython_pipeline(self.state)
        manager = type(usual)(usual.pipeline_name)
        for each, text in usual.passes:
            if each.__name__ not in _NEEDLESS:
                manager.add_pass(
                    self.lowering if each is core.typed_passes.NativeLowering else each, text
                )
        manager.finalize()
        return [manager]


class _KernelCompiler(_PartCompiler):
    """The same for kernels."""

    lowering = _KernelLowering

    def compile_extra(self, function: Any) -> Any:
        with _once(self.state.targetctx):
            for check in _checks.get(function, ()):
                check()
            return super().compile_extra(function)


@contextmanager
def _once(target: Any) -> Iterator[None]:
    """Without what numba does again for each call in a kernel, a tenth of the time.

    It tries all meanings of ``+`` for the same types, those of NumPy among them, and imports all
    modules that declare functions.
    """
    typing, known = _cpu.typing_context, dict[Any, Any]()
    if "resolve_function_type" in vars(typing):  # a kernel that another one calls
        yield
        return
    resolve = typing.resolve_function_type

    def resolve_once(function: Any, positional: Any, named: Any) -> Any:
        call = (function, positional, tuple(dict(named).items()))
        try:
            found = known.get(call)
        except TypeError:  # a constant slice has no hash
            return resolve(function, positional, named)
        if found is None:
            found = known[call] = resolve(function, positional, named)
        return found

    def install_again() -> None:
        for each in tuple(target._registries):
            target.install_registry(each)

    typing.resolve_function_type = resolve_once
    for each in (target, _cpu.target_context):
        each.load_additional_registries = install_again
    try:
        yield
    finally:
        del typing.resolve_function_type
        for each in (target, _cpu.target_context):
            del each.load_additional_registries


def part(function: Function, **options: bool) -> Function:
    """Compile a function for kernels, and as numba does when Python calls it."""
    compiled = numba.njit(error_model="numpy", **options)(function)
    if compiled is function:  # with NUMBA_DISABLE_JIT
        return function
    options |= {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    inside = numba.njit(error_model="numpy", pipeline_class=_PartCompiler, **options)(function)
    # numba would keep an address for calls from Python, where there is none
    inside.add_overload = lambda result: inside.overloads.__setitem__(
        tuple(result.signature.args), result
    )
    # one translation for all values of an argument, where numba makes one for each constant
    compiled.get_call_template = lambda positional, named: inside.get_call_template(
        tuple(map(numba.types.unliteral, positional)),
        {key: numba.types.unliteral(named[key]) for key in named},
    )
    compiled.get_overload = inside.get_overload
    return cast(Function, compiled)


# Decorators that compile functions.
#
# =============  ===================================================================================
# `scalar`       a function of one row, inlined into the loop that calls it
# `phase`        a part of a kernel, inlined before type inference
# `routine`      a part of a kernel, called once per block and not inlined
# `instruction`  a function defined by its LLVM instructions
# `kernel`       a loop over rows that Python calls, cached on disk
# =============  ===================================================================================


COMPILES: bool = not numba.config.DISABLE_JIT
"""Whether functions are compiled; with ``NUMBA_DISABLE_JIT=1`` they run as plain Python."""

_TIME = "1 to 6 s"  # which the least and the largest kernel take on a fast and on a slow machine


def scalar(function: Function) -> Function:
    """Compile a function of scalars and tuples, inlined into the loop that calls it."""
    return part(function, forceinline=True)


def instruction(function: Callable[..., Any]) -> Callable[..., Any]:
    """Define a function by its LLVM instructions."""
    return cast(Callable[..., Any], numba.extending.intrinsic(function))


def phase(function: Function) -> Function:
    """Inline a function into its caller before type inference: for parts of a kernel."""
    return cast(Function, numba.njit(inline="always", error_model="numpy")(function))


def routine(function: Function) -> Function:
    """Compile a function that is called once per block, without inlining."""
    return part(function)


def kernel(
    function: Function,
    label: str | None = None,
    parts: Iterable[Any] = (),
    *,
    allocates: bool = True,
    checks: Iterable[Callable[[], object]] = (),
) -> Function:
    """Compile a loop over rows; the code is cached on disk and releases the interpreter lock.

    If no private cache folder can be made (read-only home), or a part has no source file, the
    kernel is compiled again in every process.

    Args:
        function: The loop: a function of a module, or a closure over `parts`.
        label: Name for messages and files; by default module and function name.
        parts: Functions, classes and tuples of numbers in a closure.
        allocates: Whether it makes arrays: otherwise it is compiled without counts of references.
        checks: Called before it is compiled, not where it is loaded; each may refuse that.
    """
    _checks[function] = tuple(checks)
    label = label or f"{function.__module__}.{function.__name__}"
    folder, name = cache_directory(), cache_name(label, parts or (function,))
    if name is not None:
        # Numba counts the functions of a process in its names for them: the code of two loops that
        # other processes have compiled could bear the same one, and be taken for each other
        function.__qualname__ = name
    options = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True, "_nrt": allocates}
    compiled = numba.njit(pipeline_class=_KernelCompiler, **options)(function)
    if folder is not None and name is not None:
        compiled._cache = KernelCache(folder, name)
    _labels[compiled] = label.removeprefix("rigid_envs.")
    return cast(Function, compiled)


def returned_type(function: Callable[..., Any], *arguments: Any) -> Any:
    """Type that numba gives to what a function returns; None where numba cannot compile it.

    Args:
        function: From `scalar`; what is compiled here is taken for kernels.
        arguments: Examples of the types of its arguments.
    """
    kinds = tuple(map(numba.typeof, arguments))
    try:
        typing = _cpu.typing_context
        return typing.resolve_function_type(numba.typeof(function), kinds, {}).return_type
    except numba.core.errors.NumbaError:  # the kernel meets it too, and tells where
        return None


def compiled_for(kernel: Function, *arguments: Any) -> Function:
    """The machine code of a kernel for arguments of certain types; compiled, or loaded, now.

    A call of it does not look at the types of its arguments, which takes 0.1 us.

    Args:
        kernel: From `kernel`.
        arguments: Examples of the types.
    """
    if not COMPILES:
        return kernel
    compiled: Any = kernel
    with _no_collection():
        return cast(Function, compiled.compile(tuple(map(numba.typeof, arguments))))


def address_of(kernel: Function, *arguments: Any) -> int:
    """Address of the machine code of a kernel for arguments of certain types.

    Args:
        kernel: From `kernel`.
        arguments: Examples of the types.
    """
    compiled_for(kernel, *arguments)
    compiled: Any = kernel
    result = compiled.overloads[tuple(map(numba.typeof, arguments))]
    return int(result.library.get_pointer_to_function(result.fndesc.llvm_func_name))


@contextmanager
def _no_collection() -> Iterator[None]:
    """Without garbage collection, which takes a tenth of the time and finds hardly anything.

    What is made meanwhile counts as old afterwards: otherwise the next allocation would have all of
    it searched at once.
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if not gc.get_freeze_count():  # by the user, to be kept so
            gc.freeze()
            gc.unfreeze()
        if was_on:
            gc.enable()


class _Announcer(core.event.Listener):  # type: ignore[misc]
    """Says which kernel is going to be compiled: on standard error where nobody reads logs."""

    def on_start(self, event: core.event.Event) -> None:
        dispatcher = event.data["dispatcher"]
        if dispatcher not in _labels:
            return
        is_kept = isinstance(dispatcher._cache, KernelCache)
        often = "once" if is_kept else "in every process, for want of a cache folder"
        said = f"compiling {_labels[dispatcher]}, {often}: {_TIME}"
        if _log.hasHandlers() or _log.level > logging.INFO:
            _log.info(said)
        else:
            print(f"rigid-envs: {said}", file=sys.stderr, flush=True)

    def on_end(self, event: core.event.Event) -> None:
        pass


_labels: dict[Any, str] = {}
_checks: dict[Any, tuple[Callable[[], object], ...]] = {}
core.event.register("numba:compile", _Announcer())
