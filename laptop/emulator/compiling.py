"""Compile the emulator's physics: `python -m laptop.emulator.compiling`.

mypyc translates the modules of `compiled.MODULES` to C, by their types, and a C compiler makes
extension modules of it.  `compiled` says where they lie and when they are used.
"""

import os
import shutil
import sys
import tempfile
import time

from laptop.emulator import compiled

EXACT = {"unix": ["-ffp-contract=off"], "msvc": ["/fp:precise"]}
"""Options by which a C compiler computes floats as Python does: it must not join a product and a
sum to one operation that rounds once."""


class CannotCompile(Exception):
    """The modules cannot be compiled; why, and what to do."""


def build(target: str) -> None:
    """Compile the modules into a folder, which begins to exist when all of them are there.

    Raises:
        CannotCompile: there is no mypyc or no C compiler, or it fails.
    """
    try:
        import setuptools
        from mypyc.build import mypycify
    except ImportError:
        raise CannotCompile(
            "mypyc is not installed; write uv run --group compiled "
            "python -m laptop.emulator.compiling"
        ) from None
    from setuptools.errors import BaseError, CCompilerError

    os.makedirs(os.path.dirname(target), exist_ok=True)
    made = tempfile.mkdtemp(dir=os.path.dirname(target), prefix="made-")
    before = os.getcwd()
    os.chdir(compiled.REPO_ROOT)  # mypyc tells modules' names by their paths
    try:
        extensions = mypycify(
            ["--python-executable", sys.executable, "--explicit-package-bases"]
            + [
                os.path.join(compiled.REPO_ROOT, compiled.path_of(name))
                for name in compiled.MODULES
            ],
            group_name=compiled.GROUP,
            target_dir=os.path.join(made, "c"),
            opt_level="3",
            debug_level="0",
        )
        command = setuptools.Distribution({"ext_modules": extensions}).get_command_obj("build_ext")
        command.build_lib = os.path.join(made, "modules")
        command.build_temp = os.path.join(made, "objects")
        command.parallel = True
        command.ensure_finalized()
        kind = "msvc" if os.name == "nt" else "unix"
        for extension in extensions:
            extension.extra_compile_args += EXACT[kind]
        try:
            command.run()
        except (BaseError, CCompilerError) as error:
            raise CannotCompile(
                "no C compiler could make them ({}); install one, such as gcc with Python's "
                "headers, or go on without: all runs as before, in pure Python".format(error)
            ) from None
        if not os.path.isdir(target):
            os.rename(command.build_lib, target)
    finally:
        os.chdir(before)
        shutil.rmtree(made)


def main() -> int:
    """Compile what is not compiled yet, and say where it is."""
    begun, target = time.monotonic(), compiled.folder()
    if os.path.isdir(target):
        print("compiling: {} has the modules of these sources already".format(target))
        return 0
    try:
        build(target)
    except CannotCompile as error:
        sys.stderr.write("compiling: {}\n".format(error))
        return 1
    print(
        "compiling: {} modules, in {:.0f} s: {}".format(
            len(compiled.MODULES), time.monotonic() - begun, target
        )
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
