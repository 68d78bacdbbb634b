"""Builds a wheel of Lucerna: the interface of PEP 517 around CMake.

The wheel holds what `cmake --install` installs: the module `lucerna`, the command `lucerna` with its manual, and the shared
libraries that both load. It is of the Python and the system that build it, because it links the system's libraries.
"""
import base64
import hashlib
import os
import pathlib
import re
import subprocess
import sys
import sysconfig
import tempfile
import zipfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
SUMMARY = "Renderer for scenes lit by measured lamps"


def _version():
    return re.search(r"project\(lucerna VERSION ([\d.]+)", (SOURCE / "CMakeLists.txt").read_text()).group(1)


def _tag():
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    return f"{python}-{python}-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"


def _metadata():
    return (f"Metadata-Version: 2.1\nName: lucerna\nVersion: {_version()}\nSummary: {SUMMARY}\nRequires-Python: >=3.9\n"
            "Requires-Dist: numpy\nLicense: Apache-2.0\nDescription-Content-Type: text/markdown\n\n" + (SOURCE / "README.md").read_text())


def _install(build, prefix, site_packages):
    """Configures, builds and installs into the prefix; CMake's own messages tell what is missing."""
    environment = dict(os.environ, DESTDIR="")
    cmake = os.environ.get("CMAKE", "cmake")
    # The interpreter's folder may be that of an isolated environment, whose programs are Python's alone.
    subprocess.run([cmake, "-S", SOURCE, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DLUCERNA_UNITY=ON",
                    "-DLUCERNA_TESTS=OFF", "-DLUCERNA_PYTHON=ON", f"-DPython_EXECUTABLE={sys.executable}",
                    f"-DLUCERNA_PYTHON_FOLDER={site_packages}", "-DCMAKE_INSTALL_LIBDIR=lib", f"-DCMAKE_INSTALL_PREFIX={prefix}",
                    "--log-level=NOTICE"], check=True, env=environment)
    subprocess.run([cmake, "--build", build, "--target", "lucerna", "lucerna_python"], check=True, env=environment)
    for component in ["program", "python"]:
        subprocess.run([cmake, "--install", build, "--component", component, "--strip"], check=True, env=environment)


class _Wheel:
    """A wheel being written, and its list of files (RECORD)."""

    def __init__(self, path):
        self.zip = zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED)
        self.records = []

    def add(self, name, data, mode=0o644):
        info = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
        info.external_attr = (0o100000 | mode) << 16
        info.compress_type = zipfile.ZIP_DEFLATED
        self.zip.writestr(info, data)
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        self.records.append(f"{name},sha256={digest},{len(data)}")

    def close(self, dist_info):
        record = f"{dist_info}/RECORD"
        self.zip.writestr(record, "\n".join([*self.records, f"{record},,"]) + "\n")
        self.zip.close()


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """Writes the wheel into the folder and returns its name. The setting `build` names a folder for CMake's files that is kept."""
    name = f"lucerna-{_version()}-{_tag()}.whl"
    dist_info, data_folder = f"lucerna-{_version()}.dist-info", f"lucerna-{_version()}.data"
    # Where an environment has its modules, below its prefix: from there the module finds the libraries in lib/lucerna.
    site_packages = pathlib.PurePosixPath(f"lib/python{sys.version_info.major}.{sys.version_info.minor}/site-packages")
    with tempfile.TemporaryDirectory() as temporary:
        prefix = pathlib.Path(temporary, "prefix")
        build = (config_settings or {}).get("build", str(pathlib.Path(temporary, "build")))
        _install(os.path.abspath(build), prefix, site_packages)
        wheel = _Wheel(pathlib.Path(wheel_directory, name))
        for file in sorted(path for path in prefix.rglob("*") if path.is_file()):
            within = pathlib.PurePosixPath(file.relative_to(prefix))
            if within.is_relative_to(site_packages):
                target = str(within.relative_to(site_packages))
            elif within.parts[0] == "bin":
                target = f"{data_folder}/scripts/{within.name}"
            else:
                target = f"{data_folder}/data/{within}"
            wheel.add(target, file.read_bytes(), file.stat().st_mode & 0o777)
    wheel.add(f"{dist_info}/METADATA", _metadata().encode())
    wheel.add(f"{dist_info}/WHEEL", f"Wheel-Version: 1.0\nGenerator: lucerna\nRoot-Is-Purelib: false\nTag: {_tag()}\n".encode())
    wheel.add(f"{dist_info}/LICENSE", (SOURCE / "LICENSE").read_bytes())
    wheel.close(dist_info)
    return name
