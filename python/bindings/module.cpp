// The extension module: its errors, and the bindings of the other files.
#include <pybind11/pybind11.h>

#include <string>

#include "engine/base/error.h"
#include "engine/base/version.h"
#include "python/bindings/bindings.h"

PYBIND11_MODULE(_lucerna, module) {
    module.doc() = "Implementation of the package lucerna; use that package.";
    pybind11::register_exception<lucerna::InputError>(module, "InputError", PyExc_ValueError);
    module.attr("InputError").attr("__module__") = "lucerna";
    module.attr("__version__") = std::string(lucerna::program_version());
    lucerna::bind_images(module);
    lucerna::bind_scenes(module);
    lucerna::bind_lamps(module);
    lucerna::bind_maps(module);
}
