"""Generates ``bimorph.v1`` from the repository's .proto files: by the build, or as ``python generate.py``.

Nothing generated is kept in the repository. A source distribution carries the generated files instead of the .proto
files, and then there is nothing left to do.

With BIMORPH_PROGRAMS, the folder of a release build, a wheel brings the command, the ngspice plug-in and the module for models in process
of this machine's platform: ``make wheel``.
"""

from __future__ import annotations

import os
import sys
import sysconfig
from pathlib import Path

HERE = Path(__file__).resolve().parent
PROTO = HERE.parent.parent / "proto"
OUT = HERE / "src"
PACKAGE = OUT / "bimorph" / "v1"


def generate() -> None:
    """Writes ``src/bimorph/v1``."""
    sources = sorted(PROTO.glob("bimorph/v1/*.proto"))
    if not sources:
        if (PACKAGE / "service_pb2_grpc.py").exists():
            return
        raise RuntimeError(f"no .proto files in {PROTO}, and no generated code in {PACKAGE}")
    import grpc_tools
    from grpc_tools import protoc

    # google/protobuf comes with the compiler; google/rpc with googleapis-common-protos, of which no code is made here
    known = Path(grpc_tools.__file__).parent / "_proto"
    PACKAGE.mkdir(parents=True, exist_ok=True)
    options = [f"--python_out={OUT}", f"--pyi_out={OUT}", f"--grpc_python_out={OUT}"]
    code = protoc.main(["protoc", f"-I{PROTO}", f"-I{known}", *options, *map(str, sources)])
    if code != 0:
        raise RuntimeError(f"protoc failed with code {code}")
    (PACKAGE / "__init__.py").write_text('"""Generated messages and stubs of the protocol."""\n')
    for source in sources:
        # Only one file has a service; the stubs of the others are empty.
        if source.stem != "service":
            (PACKAGE / f"{source.stem}_pb2_grpc.py").unlink(missing_ok=True)


try:
    from hatchling.builders.hooks.plugin.interface import BuildHookInterface
except ImportError:
    pass
else:

    class GenerateHook(BuildHookInterface):
        """Runs before a wheel or source distribution is put together."""

        def initialize(self, version: str, build_data: dict) -> None:
            """Generates the code, and takes the programs along."""
            generate()
            folder = os.environ.get("BIMORPH_PROGRAMS")
            if folder and self.target_name == "wheel" and version != "editable":
                names = ("bimorph", "libbimorph_ngspice.so", "libbimorph_python.so")
                command, plugin, module = (Path(folder).resolve() / name for name in names)
                for program in (command, plugin, module):
                    if not program.is_file():
                        raise RuntimeError(f"{program} is missing: scripts/wheel builds it")
                build_data["shared_scripts"][str(command)] = command.name
                # Where the command looks for it.
                build_data["shared_data"][str(plugin)] = f"lib/bimorph/{plugin.name}"
                build_data["force_include"][str(module)] = "bimorph/_native.abi3.so"
                platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
                build_data.update(pure_python=False, tag=f"cp311-abi3-{platform}")


if __name__ == "__main__":
    sys.exit(generate())
