"""Conan 2 package of the static library: header and archive of one core. `cargo xtask capi` builds the archives first.

    conan create controller-capi --no-remote                          # this machine
    conan create controller-capi --no-remote -o "edo_smc/*:core=thumbv7em" -tf=
"""

from pathlib import Path

from conan import ConanFile
from conan.errors import ConanException, ConanInvalidConfiguration
from conan.tools.files import copy


class EdoSmc(ConanFile):
    name = "edo_smc"
    license = "MIT OR Apache-2.0"
    description = "Position and speed control for motors and flexible joints, with load and friction estimation"
    topics = ("motor-control", "embedded", "sliding-mode-control")
    package_type = "static-library"
    settings = "os", "arch", "compiler", "build_type"
    options = {"core": ["thumbv6m", "thumbv7m", "thumbv7em", "thumbv8m", "host"]}
    default_options = {"core": "host"}
    exports_sources = "include/*.h", "target/archive/*/libedo_smc.a", "cmake/edo_smc.cmake"

    def set_version(self):
        lines = (Path(self.recipe_folder) / "Cargo.toml").read_text().splitlines()
        self.version = next(line.split('"')[1] for line in lines if line.startswith("version = "))

    def export_sources(self):
        copy(self, "LICENSE-*", Path(self.recipe_folder).parent, self.export_sources_folder)

    def configure(self):
        self.settings.rm_safe("compiler.cppstd")
        self.settings.rm_safe("compiler.libcxx")

    def validate(self):
        if self.options.core == "host" and self.settings.get_safe("os") == "baremetal":
            raise ConanInvalidConfiguration("core = host: no archive for os = baremetal. Set -o edo_smc/*:core=thumbv7em")

    def package_id(self):
        # The archive does not depend on compiler and build type; one of a chip depends on the core alone.
        if self.info.options.core == "host":
            self.info.settings.rm_safe("compiler")
            self.info.settings.rm_safe("build_type")
        else:
            self.info.settings.clear()

    def package(self):
        core = str(self.options.core)
        source = Path(self.source_folder)
        archive = source / "target" / "archive" / core
        if not (archive / "libedo_smc.a").exists():
            raise ConanException(f"core = {core}: no libedo_smc.a for it. Build it: cargo xtask capi")
        copy(self, "libedo_smc.a", archive, Path(self.package_folder) / "lib")
        copy(self, "*.h", source / "include", Path(self.package_folder) / "include")
        copy(self, "edo_smc.cmake", source / "cmake", Path(self.package_folder) / "cmake")
        copy(self, "LICENSE-*", source, Path(self.package_folder) / "licenses")

    def package_info(self):
        self.cpp_info.libs = ["edo_smc"]
        # The function edo_smc_export comes with the generated target.
        self.cpp_info.builddirs = ["cmake"]
        self.cpp_info.set_property("cmake_build_modules", ["cmake/edo_smc.cmake"])
