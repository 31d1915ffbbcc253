"""Builds the ROS packages that no wheel holds, from the texts of their interfaces, with gcc alone.

Each FOLDER given holds PACKAGE/msg/*.msg, PACKAGE/srv/*.srv and PACKAGE/action/*.action; a folder
that is itself a package is understood too. They are installed into the environment of the Python
that runs this, and built only when a text, this program or the environment's packages changed.
The generators come with the wheels; they are called one by one, because the program `rosidl`, which
finds them by their entry points, finds each twice in these wheels and then does nothing.
"""

import hashlib
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path

PREFIX = Path(sys.prefix)
SHARE = PREFIX / "share"
SITE_PACKAGES = Path(sysconfig.get_path("purelib"))
PINS = Path(__file__).parents[2] / "constraints" / "ros2.txt"
SUFFIXES = (".msg", ".srv", ".action")

TYPE_SUPPORT = "rosidl_typesupport_fastrtps_c"
INTROSPECTION = "rosidl_typesupport_introspection_c"
RUNTIME = (
    "rosidl_runtime_c",
    "rosidl_typesupport_c",
    TYPE_SUPPORT,
    INTROSPECTION,
    "rosidl_typesupport_fastrtps_cpp",
    "rcutils",
    "rcpputils",
    "fastcdr",
)


@dataclass(frozen=True, slots=True)
class Package:
    """A ROS package of interfaces: its name is its folder's."""

    folder: Path

    @property
    def name(self) -> str:
        return self.folder.name

    @property
    def stamp(self) -> Path:
        """The file that holds the fingerprint of what the installed package was built from."""
        return SHARE / self.name / "built-from"

    def interfaces(self) -> list[Path]:
        return sorted(path for path in self.folder.glob("*/*") if path.suffix in SUFFIXES)

    def fingerprint(self) -> str:
        texts = [Path(__file__), PINS, *self.interfaces()]
        digest = hashlib.sha256(str(PREFIX).encode())
        for path in texts:
            digest.update(f"{path.name}\n".encode() + path.read_bytes())
        return digest.hexdigest()

    def is_built(self) -> bool:
        return self.stamp.is_file() and self.stamp.read_text() == self.fingerprint()


def packages_in(folder: Path) -> Iterator[Package]:
    if not folder.is_dir():
        raise SystemExit(f"{folder} is no folder. Does MAPSPEAK_ROSBRIDGE_SOURCE name sources?")
    for candidate in (folder, *sorted(folder.iterdir())):
        if candidate.is_dir() and Package(candidate).interfaces():
            yield Package(candidate)


def build(package: Package) -> None:
    sys.stdout.write(f"Building the ROS package {package.name}.\n")
    sys.stdout.flush()
    with tempfile.TemporaryDirectory(prefix="interfaces-") as scratch:
        generated = Path(scratch)
        with (generated / "log").open("w") as log, redirect_stdout(log):
            descriptions = describe(package)
            generate_sources(package, generated, descriptions)
        install_headers(package, generated)
        compile_libraries(package, generated)
        install_module(package, generated)
    package.stamp.write_text(package.fingerprint())


def describe(package: Package) -> list[str]:
    """Writes each interface as IDL and with its type hash; gives the files of the hashes."""
    from rosidl_adapter.action import convert_action_to_idl  # noqa: PLC0415 - see main
    from rosidl_adapter.msg import convert_msg_to_idl  # noqa: PLC0415
    from rosidl_adapter.srv import convert_srv_to_idl  # noqa: PLC0415
    from rosidl_generator_type_description.cli import HashTypeDescription  # noqa: PLC0415

    converters = dict(
        zip(SUFFIXES, (convert_msg_to_idl, convert_srv_to_idl, convert_action_to_idl), strict=True)
    )
    share = SHARE / package.name
    shutil.rmtree(share, ignore_errors=True)
    for text in package.interfaces():
        relative = text.relative_to(package.folder)
        target = share / relative
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(text, target)
        converters[text.suffix](package.folder, package.name, relative, target.parent)
    register(package)
    hashes = HashTypeDescription("type_description").generate_type_hashes(
        package.name, idl_files(package), [str(SHARE)], share
    )
    return [str(path) for path in hashes]


def register(package: Package) -> None:
    index = SHARE / "ament_index" / "resource_index" / "packages"
    index.mkdir(parents=True, exist_ok=True)
    (index / package.name).touch()


def idl_files(package: Package) -> list[str]:
    share = SHARE / package.name
    return [f"{share}:{path.relative_to(share)}" for path in sorted(share.glob("*/*.idl"))]


def generate_sources(package: Package, generated: Path, descriptions: list[str]) -> None:
    from rosidl_generator_c.cli import GenerateC  # noqa: PLC0415 - see main
    from rosidl_generator_cpp.cli import GenerateCpp  # noqa: PLC0415
    from rosidl_generator_py.cli import GeneratePython  # noqa: PLC0415
    from rosidl_typesupport_c.cli import GenerateCTypesupport  # noqa: PLC0415
    from rosidl_typesupport_fastrtps_c.cli import (  # noqa: PLC0415
        GenerateFastRTPSCTypesupport,
    )
    from rosidl_typesupport_fastrtps_cpp.cli import (  # noqa: PLC0415
        GenerateFastRTPSCppTypesupport,
    )
    from rosidl_typesupport_introspection_c.cli import (  # noqa: PLC0415
        GenerateIntrospectionCTypesupport,
    )

    files, include = idl_files(package), [str(SHARE)]
    for generator in (GenerateC("c"), GenerateCpp("cpp")):
        generator.generate(
            package.name,
            files,
            include,
            generated / generator.name,
            type_description_files=descriptions,
        )
    for generator in (
        GenerateFastRTPSCTypesupport("fastrtps_c"),
        GenerateFastRTPSCppTypesupport("fastrtps_cpp"),
        GenerateIntrospectionCTypesupport("introspection_c"),
        GenerateCTypesupport("c", typesupport_implementations=[TYPE_SUPPORT, INTROSPECTION]),
        GeneratePython("py", typesupport_implementations=["rosidl_typesupport_c"]),
    ):
        generator.generate(package.name, files, include, generated / generator.name)


def install_headers(package: Package, generated: Path) -> None:
    target = PREFIX / "include" / package.name / package.name
    shutil.rmtree(target.parent, ignore_errors=True)
    for kind in ("c", "cpp", "fastrtps_c", "fastrtps_cpp", "introspection_c"):
        shutil.copytree(
            generated / kind,
            target,
            dirs_exist_ok=True,
            ignore=shutil.ignore_patterns("*.c", "*.cpp"),
        )


def compile_libraries(package: Package, generated: Path) -> None:
    """Compiles every file, two at a time and more where there are cores, then links."""
    sources = {
        "rosidl_generator_c": sorted((generated / "c").rglob("*.c")),
        TYPE_SUPPORT: sorted((generated / "fastrtps_c").rglob("*.cpp")),
        INTROSPECTION: sorted((generated / "introspection_c").rglob("*.c")),
        "rosidl_typesupport_c": sorted((generated / "c").rglob("*.cpp")),
        "rosidl_generator_py": sorted((generated / "py").glob("*/_*_s.c")),
        "extension": sorted((generated / "py").glob("*.ep.rosidl_typesupport_c.c")),
    }
    with ThreadPoolExecutor(os.cpu_count() or 2) as pool:
        compiled = {kind: list(pool.map(compile_source, paths)) for kind, paths in sources.items()}
    before: list[str] = []
    for kind in list(sources)[:-1]:
        name = f"{package.name}__{kind}"
        link(compiled[kind], PREFIX / "lib" / f"lib{name}.so", before)
        before.append(name)
    extension = generated / "py" / f"{package.name}_s__rosidl_typesupport_c.so"
    link(compiled["extension"], extension, before)


def compile_source(source: Path) -> Path:
    compiler, standard = ("g++", "c++17") if source.suffix == ".cpp" else ("gcc", "gnu11")
    target = source.with_suffix(".o")
    run(compiler, "-O0", "-fPIC", "-w", f"-std={standard}", *includes(), "-c", source, "-o", target)
    return target


def includes() -> list[str]:
    import numpy as np  # noqa: PLC0415 - see main

    folders = [PREFIX / "include", *sorted((PREFIX / "include").iterdir())]
    return [f"-I{path}" for path in (*folders, sysconfig.get_path("include"), np.get_include())]


def link(objects: list[Path], target: Path, own: list[str]) -> None:
    """Links against our own libraries made before, and whatever other packages hold of each kind.

    More is named than is needed, which the linker sorts out (as-needed).
    """
    lib = PREFIX / "lib"
    others = [path.name[3:-3] for kind in KINDS for path in sorted(lib.glob(f"lib*__{kind}.so"))]
    names = [*own, *(name for name in others if f"lib{name}.so" != target.name), *RUNTIME]
    run(
        *("g++", "-shared", f"-L{lib}", f"-Wl,-rpath,{lib}", "-Wl,--as-needed", "-o"),
        target,
        *objects,
        *(f"-l{name}" for name in names if (lib / f"lib{name}.so").exists()),
    )


KINDS = (
    "rosidl_generator_c",
    TYPE_SUPPORT,
    INTROSPECTION,
    "rosidl_typesupport_c",
    "rosidl_generator_py",
)


def install_module(package: Package, generated: Path) -> None:
    module = SITE_PACKAGES / package.name
    shutil.rmtree(module, ignore_errors=True)
    shutil.copytree(generated / "py", module, ignore=shutil.ignore_patterns("*.c", "*.o"))
    (module / "__init__.py").touch()


def run(*command: str | Path) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603
    if done.returncode != 0:
        raise SystemExit(f"{command[0]} failed:\n{done.stderr}")


def explain_what_is_missing() -> str | None:
    if missing := [name for name in ("gcc", "g++") if shutil.which(name) is None]:
        return (
            f"{' and '.join(missing)} not found, and the ROS message packages must be compiled.\n"
            "Install it: sudo apt install g++ (or: sudo dnf install gcc-c++)"
        )
    if not (Path(sysconfig.get_path("include")) / "Python.h").is_file():
        return (
            "This Python came without its header files, and the ROS message packages need them.\n"
            "Install them: sudo apt install python3.12-dev (or: sudo dnf install python3.12-devel)"
        )
    return None


def main() -> None:
    """Builds what is missing; the generators are imported only then, which saves half a second."""
    packages = [found for folder in sys.argv[1:] for found in packages_in(Path(folder).resolve())]
    outdated = [package for package in packages if not package.is_built()]
    if outdated and (explanation := explain_what_is_missing()):
        raise SystemExit(explanation)
    os.environ["AMENT_PREFIX_PATH"] = str(PREFIX)
    for package in outdated:
        build(package)


if __name__ == "__main__":
    main()
